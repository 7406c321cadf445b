// report_page.c - a library as a page that sorts by a click, and as CSV.
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/outfile.h"
#include "ui/html.h"
#include "ui/report_library.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Sorts by the cell's data-v (a number where both are), unknown ones last.
static const char sorting[] =
    "<script>document.querySelectorAll('th[data-k]').forEach((h,k)=>h.onclick=()=>{"
    "const b=document.querySelector('tbody'),up=h.dataset.up=h.dataset.up==1?0:1,"
    "v=r=>r.cells[k].dataset.v;"
    "[...b.rows].sort((p,q)=>{const x=v(p),y=v(q);if(x===''||y==='')return(x==='')-(y==='');"
    "const d=isNaN(x)||isNaN(y)?x.localeCompare(y):x-y;return up==1?d:-d})"
    ".forEach(r=>b.append(r))})</script>"
    "<style>body{max-width:80rem}th[data-k]{cursor:pointer;text-decoration:underline dotted}"
    "td img{width:7rem;display:block;border-radius:4px;background:#000}.bad{color:#c33}"
    "details pre{max-width:40rem}</style>\n";

static void number_cell(struct html *h, double value, double scale, const char *unit)
{
    if (isfinite(value))
        fprintf(h->f, "<td class=n data-v=%.9g>%.3g%s", value, value * scale, unit);
    else
        fputs("<td class=n data-v=''>", h->f);
}

static void text_cell(struct html *h, const char *text)
{
    fputs("<td data-v=\"", h->f);
    html_escape(h, text);
    fputs("\">", h->f);
    html_escape(h, text);
}

static void picture_cell(struct html *h, const struct entry *s)
{
    const struct stage *picture = entry_stage(s, "render");
    fprintf(h->f, "<td data-v=%d>", s->done);
    if (picture && picture->sha256)
        fprintf(h->f, "<a href=\"%s\"><img loading=lazy src=\"%s\" alt=\"\"></a>", picture->file,
                picture->file);
}

// Every product that there is, how it was made, and its sum.
static void provenance_cell(struct html *h, const struct entry *s)
{
    if (!s->done) {
        fputs("<td class=bad data-v=failed>", h->f);
        html_escape(h, s->failed ? s->failed : "not run");
        fputs(": ", h->f);
        html_escape(h, s->reason   ? s->reason
                       : s->failed ? "ended without a word (killed?)"
                                   : "something before it is missing");
        return;
    }
    fprintf(h->f, "<td data-v=done><details><summary>%d products</summary>", s->n_stages);
    for (int k = 0; k < s->n_stages; k++) {
        const struct stage *at = &s->stage[k];
        fprintf(h->f, "<p><a href=\"%s\">%s</a> ", at->file, at->name);
        if (isfinite(at->seconds))
            fprintf(h->f, "%.2f s ", at->seconds);
        if (at->sha256)
            fprintf(h->f, "<span class=soft>%.16s</span>", at->sha256);
        fputs("</p>", h->f);
        if (at->command) {
            fputs("<pre>", h->f);
            html_escape(h, at->command);
            fputs("</pre>", h->f);
        }
    }
    fputs("</details>", h->f);
}

bool library_write_page(const struct library *l, const char *folder, struct err *e)
{
    struct html h;
    char *lead =
        xasprintf("nacre " NACRE_VERSION ": %d of %d samples are done. A click on a heading "
                  "sorts; <a href=samples.csv>samples.csv</a> has the same figures.",
                  l->n_done, l->n);
    html_open(&h, l->title, lead);
    fputs("<table><thead><tr><th data-k>picture<th data-k>sample<th data-k class=n>table against "
          "truth<th data-k class=n>tables' own error<th data-k class=n>time<th data-k class=n>peak "
          "memory<th data-k>provenance</thead><tbody>\n",
          h.f);
    for (int k = 0; k < l->n; k++) {
        const struct entry *s = &l->entry[k];
        fputs("<tr>", h.f);
        picture_cell(&h, s);
        text_cell(&h, s->name);
        number_cell(&h, s->error, 100, " %");
        number_cell(&h, s->tables_error, 100, " %");
        number_cell(&h, s->seconds, 1, " s");
        number_cell(&h, s->peak_mb, 1, " MB");
        provenance_cell(&h, s);
        fputs("</tr>\n", h.f);
    }
    fputs("</tbody></table>\n", h.f);
    fputs(sorting, h.f);
    char *path = xasprintf("%s/index.html", folder);
    const bool ok = html_close(&h, path, e);
    free(path);
    free(lead);
    return ok;
}

static void csv_text(FILE *f, const char *text)
{
    fputs(",\"", f);
    for (; text && *text; text++)
        fputs(*text == '"' ? "\"\"" : (char[]){*text, 0}, f);
    fputc('"', f);
}

static void csv_number(FILE *f, double value)
{
    fputc(',', f);
    if (isfinite(value))
        fprintf(f, "%.9g", value);
}

bool library_write_csv(const struct library *l, const char *folder, struct err *e)
{
    static const char *const products[] = {"table", "tables", "height", "factors"};
    char *text = NULL, *path = xasprintf("%s/samples.csv", folder);
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    fputs("sample,state,error,tables_error,seconds,peak_mb,failed_stage,reason", f);
    for (int k = 0; k < 4; k++)
        fprintf(f, ",%s,%s_sha256", products[k], products[k]);
    fputc('\n', f);
    for (int k = 0; k < l->n; k++) {
        const struct entry *s = &l->entry[k];
        fprintf(f, "%s,%s", s->name, s->done ? "done" : "missing");
        csv_number(f, s->error);
        csv_number(f, s->tables_error);
        csv_number(f, s->seconds);
        csv_number(f, s->peak_mb);
        csv_text(f, s->failed);
        csv_text(f, s->reason);
        for (int i = 0; i < 4; i++) {
            const struct stage *at = entry_stage(s, products[i]);
            csv_text(f, at && at->sha256 ? at->file : NULL);
            csv_text(f, at ? at->sha256 : NULL);
        }
        fputc('\n', f);
    }
    fclose(f);
    const bool ok = outfile_write(path, text, size, e);
    free(text);
    free(path);
    return ok;
}
