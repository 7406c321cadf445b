// session_export.c - a session as a BagIt folder (RFC 8493) that any archive can check.
//
// Made beside its name and renamed when it is whole. A session that is not what its ledger says is
// not exported.
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/outfile.h"
#include "core/sha256.h"
#include "ui/doc.h"
#include "ui/session_verbs.h"
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

struct bag {
    char *root; // where it is being made
    FILE *manifest;
    char *manifest_text;
    size_t manifest_size;
    double bytes;
    int files;
};

static bool make_folder(const char *path, struct err *e)
{
    return !mkdir(path, 0777) || errno == EEXIST || err_errno(e, "%s", path);
}

// Notes a file that lies at data/`name` with its sum.
static bool list(struct bag *b, const char *name, struct err *e)
{
    char hex[SHA256_TEXT], *path = xasprintf("%s/data/%s", b->root, name);
    struct stat st = {0};
    const bool ok = sha256_file(path, hex, e) && (!stat(path, &st) || err_errno(e, "%s", path));
    if (ok) {
        fprintf(b->manifest, "%s  data/%s\n", hex, name);
        b->bytes += (double)st.st_size;
        b->files++;
    }
    free(path);
    return ok;
}

static bool copy(struct bag *b, const char *from, const char *name, struct err *e)
{
    enum { CHUNK = 1 << 16 };
    char *to = xasprintf("%s/data/%s", b->root, name), *chunk = xcalloc(1, CHUNK);
    FILE *in = fopen(from, "rb"), *out = in ? fopen(to, "wb") : NULL;
    bool ok = in && out;
    if (!ok)
        err_errno(e, "%s", in ? to : from);
    for (size_t n; ok && (n = fread(chunk, 1, CHUNK, in)) > 0;)
        ok = fwrite(chunk, 1, n, out) == n || err_errno(e, "%s", to);
    ok = ok && (!ferror(in) || err_errno(e, "%s", from));
    if (in)
        fclose(in);
    if (out && fclose(out) && ok)
        ok = err_errno(e, "%s", to);
    free(chunk);
    free(to);
    return ok && list(b, name, e);
}

// Everything below a folder of the session, except the ledger's own files, by name.
static bool copy_folder(struct bag *b, const struct session *s, const char *below, struct err *e)
{
    char *path = session_path(s, below), *to = xasprintf("%s/data/%s", b->root, below);
    struct dirent **entry = NULL;
    const int n = scandir(path, &entry, NULL, alphasort);
    bool ok = (n >= 0 || err_errno(e, "%s", path)) && make_folder(to, e);
    for (int k = 0; k < n; k++) {
        const char *name = entry[k]->d_name;
        if (ok && name[0] != '.' && strncmp(name, "ledger.db", 9) != 0) {
            char *inner = xasprintf("%s%s%s", below, *below ? "/" : "", name);
            char *full = session_path(s, inner);
            struct stat st;
            ok = !stat(full, &st) || err_errno(e, "%s", full);
            if (ok)
                ok = S_ISDIR(st.st_mode) ? copy_folder(b, s, inner, e) : copy(b, full, inner, e);
            free(inner);
            free(full);
        }
        free(entry[k]);
    }
    free(entry);
    free(path);
    free(to);
    return ok;
}

static bool write_ledger(struct bag *b, struct session *s, const struct session_report *r,
                         struct err *e)
{
    struct session_frame *frame;
    int n;
    char *db = xasprintf("%s/data/ledger.db", b->root);
    char *json = xasprintf("%s/data/ledger.json", b->root);
    bool ok = session_frames(s, false, &frame, &n, e);
    if (ok) {
        struct doc *d = doc_new();
        char *created = session_get(s, "created");
        doc_text(d, "created", created);
        free(created);
        session_describe_state(r, d);
        doc_list(d, "frames");
        doc_list(d, "rejected");
        for (int k = 0; k < n; k++)
            session_describe_frame(
                &frame[k], doc_item(d, strcmp(frame[k].verdict, "good") ? "rejected" : "frames"));
        ok = session_describe_meterings(s, d, e) && session_describe_history(s, d, e) &&
             session_describe_products(s, d, e);
        FILE *f = ok ? fopen(json, "w") : NULL;
        if (f)
            doc_print(d, true, f);
        ok = ok && ((f && !fclose(f)) || err_errno(e, "%s", json));
        doc_free(d);
        free(frame);
    }
    ok =
        ok && session_copy_ledger(s, db, e) && list(b, "ledger.db", e) && list(b, "ledger.json", e);
    free(db);
    free(json);
    return ok;
}

static bool write_tags(struct bag *b, const char *session, struct err *e)
{
    const time_t now = time(NULL);
    struct tm tm;
    char date[20];
    strftime(date, sizeof date, "%Y-%m-%d", gmtime_r(&now, &tm));
    static const char bagit[] = "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n";
    char *info = xasprintf("Bagging-Date: %s\nBag-Software-Agent: nacre " NACRE_VERSION
                           "\nExternal-Identifier: %s\nPayload-Oxum: %.0f.%d\n",
                           date, session, b->bytes, b->files);
    char *p1 = xasprintf("%s/bagit.txt", b->root), *p2 = xasprintf("%s/bag-info.txt", b->root),
         *p3 = xasprintf("%s/manifest-sha256.txt", b->root);
    const bool ok = outfile_write(p1, bagit, sizeof bagit - 1, e) &&
                    outfile_write(p2, info, strlen(info), e) &&
                    outfile_write(p3, b->manifest_text, b->manifest_size, e);
    free(info);
    free(p1);
    free(p2);
    free(p3);
    return ok;
}

static void remove_tree(const char *path)
{
    struct dirent **entry = NULL;
    const int n = scandir(path, &entry, NULL, NULL);
    for (int k = 0; k < n; k++) {
        if (strcmp(entry[k]->d_name, ".") != 0 && strcmp(entry[k]->d_name, "..") != 0) {
            char *inner = xasprintf("%s/%s", path, entry[k]->d_name);
            if (unlink(inner))
                remove_tree(inner);
            free(inner);
        }
        free(entry[k]);
    }
    free(entry);
    rmdir(path);
}

bool session_export(struct session *s, const struct session_args *a, struct cli *cli, struct err *e)
{
    struct session_report r;
    struct stat st;
    if (!a->out)
        return err_set(e, ERR_USAGE, "export needs -o FOLDER");
    if (!stat(a->out, &st))
        return err_set(e, ERR_FILE, "%s: is there already", a->out);
    if (!session_verify(s, &r, e))
        return false;
    if (r.state == SESSION_DAMAGED)
        return err_set(e, ERR_DATA, "%s: damaged: %s", session_folder(s), r.problem[0]);
    struct bag b = {.root = xasprintf("%s.part", a->out)};
    char *data = xasprintf("%s/data", b.root);
    remove_tree(b.root);
    b.manifest = open_memstream(&b.manifest_text, &b.manifest_size);
    bool ok = make_folder(b.root, e) && make_folder(data, e) && copy_folder(&b, s, "", e) &&
              write_ledger(&b, s, &r, e);
    fclose(b.manifest);
    ok = ok && write_tags(&b, session_folder(s), e) &&
         (!rename(b.root, a->out) || err_errno(e, "%s", a->out));
    if (ok) {
        doc_text(cli->doc, "bag", a->out);
        doc_int(cli->doc, "files", b.files);
        doc_num(cli->doc, "bytes", b.bytes);
        doc_text(cli->doc, "status", session_state_name[r.state]);
    } else {
        remove_tree(b.root);
    }
    free(b.manifest_text);
    free(b.root);
    free(data);
    return ok;
}
