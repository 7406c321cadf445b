// sha256.c - OpenSSL's EVP behind four words.
#define _GNU_SOURCE
#include "core/sha256.h"
#include "core/mem.h"
#include <assert.h>
#include <openssl/evp.h>
#include <stdio.h>
#include <stdlib.h>

struct sha256 {
    EVP_MD_CTX *ctx;
};

struct sha256 *sha256_new(void)
{
    struct sha256 *s = xcalloc(1, sizeof *s);
    s->ctx = EVP_MD_CTX_new();
    if (!s->ctx || !EVP_DigestInit_ex(s->ctx, EVP_sha256(), NULL))
        abort(); // only when there is no memory
    return s;
}

void sha256_add(struct sha256 *s, const void *data, size_t size)
{
    EVP_DigestUpdate(s->ctx, data, size);
}

void sha256_end(struct sha256 *s, char hex[SHA256_TEXT])
{
    unsigned char sum[EVP_MAX_MD_SIZE];
    unsigned n = 0;
    EVP_DigestFinal_ex(s->ctx, sum, &n);
    assert(2 * n + 1 == SHA256_TEXT);
    for (unsigned k = 0; hex && k < n; k++)
        snprintf(hex + 2 * k, 3, "%02x", sum[k]);
    EVP_MD_CTX_free(s->ctx);
    free(s);
}

void sha256_of(const void *data, size_t size, char hex[SHA256_TEXT])
{
    struct sha256 *s = sha256_new();
    sha256_add(s, data, size);
    sha256_end(s, hex);
}

bool sha256_file(const char *path, char hex[SHA256_TEXT], struct err *e)
{
    enum { CHUNK = 1 << 16 };
    FILE *f = fopen(path, "rb");
    if (!f)
        return err_errno(e, "%s", path);
    struct sha256 *s = sha256_new();
    char *chunk = xcalloc(1, CHUNK);
    for (size_t n; (n = fread(chunk, 1, CHUNK, f)) > 0;)
        sha256_add(s, chunk, n);
    const bool ok = !ferror(f) || err_errno(e, "%s", path);
    sha256_end(s, ok ? hex : NULL);
    fclose(f);
    free(chunk);
    return ok;
}
