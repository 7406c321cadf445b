// response_file.c - curves as YAML lists, one of ln X and one of its sigma for every channel.
#include "calib/response_file.h"

bool response_write(const struct response *r, const struct record *rec, const char *command,
                    const char *path, struct err *e)
{
    struct record_file rf;
    record_begin(&rf, rec, command);
    fprintf(rf.f, "channels: %d\npixels: %d\ncode_min: %d\ncode_max: %d\n", r->nc, r->pixels,
            r->code_min, r->code_max);
    for (int c = 0; c < r->nc; c++) {
        char key[32];
        snprintf(key, sizeof key, "log_x_%d", c);
        record_list(rf.f, key, r->log_x[c], RESPONSE_CODES);
        snprintf(key, sizeof key, "log_sigma_%d", c);
        record_list(rf.f, key, r->log_sigma[c], RESPONSE_CODES);
    }
    return record_end(&rf, path, e);
}

static bool read_curves(struct response *r, struct ynode *root, struct err *e)
{
    static const char *const curve[] = {"log_x_0", "log_x_1", "log_x_2", "log_x_3"};
    static const char *const sigma[] = {"log_sigma_0", "log_sigma_1", "log_sigma_2", "log_sigma_3"};
    for (int c = 0; c < r->nc; c++) {
        if (!record_read_list(root, curve[c], -50, 50, r->log_x[c], RESPONSE_CODES, e) ||
            !record_read_list(root, sigma[c], 1e-9, 1e9, r->log_sigma[c], RESPONSE_CODES, e))
            return false;
        for (int z = 1; z < RESPONSE_CODES; z++)
            if (r->log_x[c][z] < r->log_x[c][z - 1])
                return yaml_bad(ymap_find(root, curve[c]), e,
                                "falls from code %d to %d: a response never falls", z - 1, z);
    }
    return true;
}

bool response_read(struct response *out, struct record *rec, const char *path, struct err *e)
{
    struct yaml *y;
    struct response r = {0};
    if (!yaml_open(&y, path, e))
        return false;
    struct ynode *root = yaml_root(y);
    bool ok = record_read(rec, root, path, "response", e) &&
              ymap_int(root, "channels", Y_NEEDED, 1, RESPONSE_CHANNELS, &r.nc, e) &&
              ymap_int(root, "pixels", Y_OPTIONAL, 0, 1000000000, &r.pixels, e) &&
              ymap_int(root, "code_min", Y_NEEDED, 0, 254, &r.code_min, e) &&
              ymap_int(root, "code_max", Y_NEEDED, r.code_min, 255, &r.code_max, e) &&
              read_curves(&r, root, e);
    r.residual = rec->residual;
    ok = yaml_close(y, ok, e) && ok;
    if (ok)
        *out = r;
    return ok;
}
