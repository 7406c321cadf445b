// html.c - a page in plain HTML with its style inside, readable in light and dark.
#define _GNU_SOURCE
#include "ui/html.h"
#include "core/outfile.h"
#include <stdlib.h>

static const char style[] =
    ":root{--ink:#1d2430;--soft:#5d6877;--line:#dde2e9;--bg:#fff;--card:#f5f7fa;--mark:#1667b7}"
    "@media(prefers-color-scheme:dark){:root{--ink:#e4e8ee;--soft:#98a3b3;--line:#2e3743;--bg:#"
    "12161c;"
    "--card:#1a2029;--mark:#6db1f5}}"
    "body{font:16px/1.55 system-ui,'DejaVu Sans',sans-serif;color:var(--ink);background:var(--bg);"
    "max-width:66rem;margin:0 auto;padding:2.5rem 1.5rem 4rem}"
    "h1{font-size:2rem;line-height:1.2;margin:0 0 .3rem}h2{font-size:1.25rem;margin:2.6rem 0 .4rem;"
    "border-top:1px solid var(--line);padding-top:1.4rem}.lead,figcaption,.soft{color:var(--soft)}"
    "p{margin:.4rem 0 .8rem;max-width:46rem}figure{margin:0}figure img{width:100%;display:block;"
    "border-radius:6px;background:#000}figcaption{font-size:.87rem;margin-top:.4rem}"
    ".row{display:grid;grid-template-columns:repeat(auto-fit,minmax(17rem,1fr));gap:1.2rem;margin:"
    "1rem 0}"
    ".half{max-width:36rem}"
    ".cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(11.5rem,1fr));gap:.8rem;"
    "margin:1.4rem 0}"
    ".card{background:var(--card);border-radius:8px;padding:.8rem 1rem}.card "
    "b{display:block;font-size:1.45rem;white-space:nowrap;"
    "font-variant-numeric:tabular-nums}.card span{color:var(--soft);font-size:.85rem}"
    "pre{background:var(--card);border-radius:6px;padding:.6rem "
    ".9rem;overflow-x:auto;font-size:.83rem;"
    "white-space:pre-wrap;margin:.6rem 0}table{border-collapse:collapse;width:100%;"
    "font-variant-numeric:tabular-nums}td,th{text-align:left;padding:.35rem .8rem .35rem 0;"
    "border-bottom:1px solid var(--line);vertical-align:top}th{color:var(--soft);font-weight:500}"
    "td.n,th.n{text-align:right}.bar{background:var(--mark);height:.7rem;border-radius:3px;min-"
    "width:2px}";

void html_open(struct html *h, const char *title, const char *lead)
{
    *h = (struct html){0};
    h->f = open_memstream(&h->text, &h->size);
    fprintf(
        h->f,
        "<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport "
        "content=\"width=device-width\"><title>%s</title><style>%s</style></head><body><h1>%s</h1>"
        "<p class=lead>%s</p>\n",
        title, style, title, lead);
}

void html_escape(struct html *h, const char *text)
{
    for (; *text; text++)
        switch (*text) {
        case '<': fputs("&lt;", h->f); break;
        case '>': fputs("&gt;", h->f); break;
        case '&': fputs("&amp;", h->f); break;
        case '"': fputs("&quot;", h->f); break;
        default: fputc(*text, h->f);
        }
}

void html_section(struct html *h, const char *title, const char *text)
{
    fprintf(h->f, "<h2>%s</h2><p>%s</p>\n", title, text);
}

void html_picture(struct html *h, const char *file, const char *caption)
{
    fprintf(h->f, "<figure><img src=\"%s\" alt=\"%s\"><figcaption>%s</figcaption></figure>\n", file,
            caption, caption);
}

void html_command(struct html *h, const char *words)
{
    fputs("<pre>nacre ", h->f);
    html_escape(h, words);
    fputs("</pre>\n", h->f);
}

bool html_close(struct html *h, const char *path, struct err *e)
{
    if (path)
        fputs("</body></html>\n", h->f);
    fclose(h->f);
    const bool ok = path && outfile_write(path, h->text, h->size, e);
    free(h->text);
    *h = (struct html){0};
    return ok;
}
