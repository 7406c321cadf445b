// rpc.c - JSON-RPC 2.0 on jansson, which stays in this file.
#define _GNU_SOURCE
#include "acquire/rpc.h"
#include "core/mem.h"
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct rpc_message {
    json_t *root;
};

struct rpc_object {
    json_t *json;
};

struct rpc_message *rpc_read(const char *line, enum rpc_code *code, struct err *e)
{
    json_error_t why;
    json_t *root = json_loads(line, JSON_REJECT_DUPLICATES, &why);
    *code = RPC_PARSE;
    if (!root) {
        err_set(e, ERR_DATA, "not JSON: %s at column %d", why.text, why.column);
        return NULL;
    }
    const json_t *version = json_object_get(root, "jsonrpc"), *id = json_object_get(root, "id");
    const char *said = json_string_value(version);
    const json_t *params = json_object_get(root, "params");
    const bool ok = json_is_object(root) && said && !strcmp(said, "2.0") &&
                    (!id || json_is_integer(id) || json_is_string(id) || json_is_null(id)) &&
                    (!params || json_is_object(params)) &&
                    (json_is_string(json_object_get(root, "method")) ||
                     json_object_get(root, "result") || json_object_get(root, "error"));
    *code = RPC_REQUEST;
    if (!ok) {
        json_decref(root);
        err_set(e, ERR_DATA, "not a JSON-RPC 2.0 message with a method and named params");
        return NULL;
    }
    struct rpc_message *m = xcalloc(1, sizeof *m);
    m->root = root;
    return m;
}

void rpc_free(struct rpc_message *m)
{
    if (!m)
        return;
    json_decref(m->root);
    free(m);
}

const char *rpc_method(const struct rpc_message *m)
{
    return json_string_value(json_object_get(m->root, "method"));
}

bool rpc_wants_reply(const struct rpc_message *m)
{
    return rpc_method(m) && json_object_get(m->root, "id");
}

int64_t rpc_id(const struct rpc_message *m)
{
    return json_integer_value(json_object_get(m->root, "id"));
}

static const json_t *value_of(const struct rpc_message *m, const char *name)
{
    const json_t *params = json_object_get(m->root, rpc_method(m) ? "params" : "result");
    return json_object_get(params, name);
}

static bool is_kind(const json_t *v, enum rpc_kind kind)
{
    return kind == RPC_TEXT  ? json_is_string(v)
           : kind == RPC_INT ? json_is_integer(v)
                             : json_is_boolean(v);
}

bool rpc_check(const struct rpc_message *m, const struct rpc_param *params, struct err *e)
{
    static const char *const kinds[] = {"a text", "a whole number", "true or false"};
    json_t *given = json_object_get(m->root, "params");
    const char *key;
    json_t *v;
    for (const struct rpc_param *p = params; p->name; p++) {
        const json_t *at = json_object_get(given, p->name);
        if (!at && p->needed)
            return err_set(e, ERR_USAGE, "%s: needs '%s'", rpc_method(m), p->name);
        if (at && !is_kind(at, p->kind))
            return err_set(e, ERR_USAGE, "%s: '%s' must be %s", rpc_method(m), p->name,
                           kinds[p->kind]);
    }
    json_object_foreach(given, key, v)
    {
        const struct rpc_param *p = params;
        while (p->name && strcmp(p->name, key) != 0)
            p++;
        if (!p->name)
            return err_set(e, ERR_USAGE, "%s: unknown parameter '%.40s'", rpc_method(m), key);
    }
    return true;
}

const char *rpc_text(const struct rpc_message *m, const char *name)
{
    return json_string_value(value_of(m, name));
}

int64_t rpc_int(const struct rpc_message *m, const char *name, int64_t otherwise)
{
    const json_t *v = value_of(m, name);
    return json_is_integer(v) ? json_integer_value(v) : otherwise;
}

double rpc_num(const struct rpc_message *m, const char *name, double otherwise)
{
    const json_t *v = value_of(m, name);
    return json_is_number(v) ? json_number_value(v) : otherwise;
}

bool rpc_flag(const struct rpc_message *m, const char *name)
{
    return json_is_true(value_of(m, name));
}

bool rpc_is_error(const struct rpc_message *m, struct err *e)
{
    const json_t *error = json_object_get(m->root, "error");
    if (!error)
        return false;
    const int64_t code = RPC_ERR - json_integer_value(json_object_get(error, "code"));
    const char *text = json_string_value(json_object_get(error, "message"));
    const bool ours = code >= ERR_USAGE && code <= ERR_PARTIAL;
    err_set(e, ours ? (enum err_code)code : ERR_DEVICE, "%s", text ? text : "no reason given");
    return true;
}

struct rpc_object *rpc_object(void)
{
    struct rpc_object *o = xcalloc(1, sizeof *o);
    o->json = json_object();
    return o;
}

void rpc_put_text(struct rpc_object *o, const char *key, const char *value)
{
    json_t *text = json_string(value); // NULL when it is not UTF-8, as a file name may be
    json_object_set_new(o->json, key, text ? text : json_string("(not UTF-8)"));
}
void rpc_put_int(struct rpc_object *o, const char *key, int64_t value)
{
    json_object_set_new(o->json, key, json_integer(value));
}
void rpc_put_num(struct rpc_object *o, const char *key, double value)
{
    json_object_set_new(o->json, key, isfinite(value) ? json_real(value) : json_null());
}
void rpc_put_flag(struct rpc_object *o, const char *key, bool value)
{
    json_object_set_new(o->json, key, json_boolean(value));
}

static json_t *taken(struct rpc_object *o)
{
    json_t *json = o ? o->json : json_object();
    free(o);
    return json;
}

void rpc_append(struct rpc_object *o, const char *key, struct rpc_object *item)
{
    json_t *list = json_object_get(o->json, key);
    if (!list) {
        list = json_array();
        json_object_set_new(o->json, key, list);
    }
    if (item)
        json_array_append_new(list, taken(item));
}

static char *line_of(json_t *root) // takes root
{
    char *text = json_dumps(root, JSON_COMPACT | JSON_REAL_PRECISION(15));
    char *line = xasprintf("%s\n", text);
    free(text);
    json_decref(root);
    return line;
}

static json_t *id_of(const struct rpc_message *m)
{
    json_t *id = m ? json_object_get(m->root, "id") : NULL;
    return id ? json_incref(id) : json_null();
}

char *rpc_reply(const struct rpc_message *to, struct rpc_object *result)
{
    return line_of(
        json_pack("{s:s, s:o, s:o}", "jsonrpc", "2.0", "id", id_of(to), "result", taken(result)));
}

char *rpc_error(const struct rpc_message *to, int code, const char *text)
{
    json_t *message = json_string(text);
    return line_of(json_pack("{s:s, s:o, s:{s:i, s:o}}", "jsonrpc", "2.0", "id", id_of(to), "error",
                             "code", code, "message",
                             message ? message : json_string("(not UTF-8)")));
}

char *rpc_request(int64_t id, const char *method, struct rpc_object *params)
{
    return line_of(json_pack("{s:s, s:I, s:s, s:o}", "jsonrpc", "2.0", "id", (json_int_t)id,
                             "method", method, "params", taken(params)));
}

char *rpc_event(const char *method, struct rpc_object *params)
{
    return line_of(
        json_pack("{s:s, s:s, s:o}", "jsonrpc", "2.0", "method", method, "params", taken(params)));
}
