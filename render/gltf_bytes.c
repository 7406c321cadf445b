// gltf_bytes.c - parts of a .glb, base64, files beside the file.
#define _GNU_SOURCE
#include "render/gltf_bytes.h"
#include "core/infile.h"
#include "core/mem.h"
#include <stdlib.h>
#include <string.h>

static const int64_t bytes_most = (int64_t)1 << 31;

static uint32_t word(const unsigned char *p)
{
    return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

bool gltf_split(struct gltf_bytes file, struct gltf_bytes *text, struct gltf_bytes *binary,
                struct err *e)
{
    *text = file;
    *binary = (struct gltf_bytes){0};
    if (file.size < 12 || memcmp(file.at, "glTF", 4))
        return true;
    if (word(file.at + 4) != 2)
        return err_set(e, ERR_DATA, "is glTF %u: only version 2 is read", word(file.at + 4));
    *text = (struct gltf_bytes){0};
    for (size_t at = 12; at < file.size;) {
        const size_t left = file.size - at, n = left < 8 ? SIZE_MAX : word(file.at + at);
        if (n > left - 8)
            return err_set(e, ERR_DATA, "is cut off");
        const struct gltf_bytes part = {file.at + at + 8, n};
        if (!memcmp(file.at + at + 4, "JSON", 4) && !text->at)
            *text = part;
        if (!memcmp(file.at + at + 4, "BIN\0", 4) && !binary->at)
            *binary = part;
        at += 8 + n;
    }
    return text->at || err_set(e, ERR_DATA, "has no JSON part");
}

static int sextet(char c)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *at = c ? strchr(digits, c) : NULL;
    return at ? (int)(at - digits) : -1;
}

static bool base64(const char *text, struct gltf_bytes *out, struct err *e)
{
    const size_t n = strlen(text);
    unsigned bits = 0, held = 0;
    out->at = xcalloc(n + 1, 1);
    out->size = 0;
    for (size_t k = 0; k < n && text[k] != '='; k++) {
        const int six = sextet(text[k]);
        if (six < 0) {
            free(out->at);
            *out = (struct gltf_bytes){0};
            return err_set(e, ERR_DATA, "holds a buffer that is not base64");
        }
        bits = (bits << 6 | (unsigned)six) & 0xffff;
        held += 6;
        if (held >= 8) {
            held -= 8;
            out->at[out->size++] = (unsigned char)(bits >> held);
        }
    }
    return true;
}

static void undo_percent(char *s)
{
    char *to = s;
    for (; *s; s++) {
        unsigned byte;
        if (*s == '%' && sscanf(s + 1, "%2x", &byte) == 1 && byte) {
            *to++ = (char)byte;
            s += 2;
        } else {
            *to++ = *s;
        }
    }
    *to = 0;
}

bool gltf_uri(const char *path, const char *uri, struct gltf_bytes *out, struct err *e)
{
    const char *data = strstr(uri, ";base64,");
    if (!strncmp(uri, "data:", 5))
        return data ? base64(data + 8, out, e)
                    : err_set(e, ERR_DATA, "holds a buffer that is not base64");
    if (strstr(uri, "://"))
        return err_set(e, ERR_DATA, "wants '%.60s': only files beside it are read", uri);
    const char *slash = strrchr(path, '/');
    char *name = xasprintf("%.*s%s", slash ? (int)(slash - path) + 1 : 0, path, uri);
    undo_percent(name);
    out->at = (unsigned char *)infile_slurp(name, bytes_most, &out->size, e);
    const bool ok = out->at || err_in(e, "%s", name);
    free(name);
    return ok;
}
