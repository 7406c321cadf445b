// rpc.h - JSON-RPC 2.0, one document a line: parsing, checking, writing.
//
// The parameters of every method are a table, which checks messages and describes the protocol.
#pragma once
#include "core/err.h"
#include <stdint.h>

enum { RPC_PROTOCOL = 1 };

enum rpc_code { // JSON-RPC's own, and those of err.h as -1000 - code
    RPC_PARSE = -32700,
    RPC_REQUEST = -32600,
    RPC_METHOD = -32601,
    RPC_PARAMS = -32602,
    RPC_ERR = -1000,
};

enum rpc_kind { RPC_TEXT, RPC_INT, RPC_FLAG };

struct rpc_param {
    const char *name; // NULL ends the table
    enum rpc_kind kind;
    bool needed;
    const char *help;
};

// --- reading ---

struct rpc_message; // a request, a notification, a reply or an error

// NULL and *code when the line is not a JSON-RPC 2.0 message.
struct rpc_message *rpc_read(const char *line, enum rpc_code *code, struct err *e);
void rpc_free(struct rpc_message *m); // accepts NULL

const char *rpc_method(const struct rpc_message *m); // NULL: a reply
bool rpc_wants_reply(const struct rpc_message *m);   // it has an id
int64_t rpc_id(const struct rpc_message *m);         // of a reply; 0: none

// Refuses unknown, missing and wrongly typed parameters; names them.
bool rpc_check(const struct rpc_message *m, const struct rpc_param *params, struct err *e);

// A value of the parameters, or of a reply's result; NULL or `otherwise` when absent.
const char *rpc_text(const struct rpc_message *m, const char *name);
int64_t rpc_int(const struct rpc_message *m, const char *name, int64_t otherwise);
double rpc_num(const struct rpc_message *m, const char *name, double otherwise);
bool rpc_flag(const struct rpc_message *m, const char *name);

// A reply that is an error: fills *e (with the code that the other side's err had), true.
bool rpc_is_error(const struct rpc_message *m, struct err *e);

// --- writing; a line with its '\n', allocated ---

struct rpc_object; // being filled

struct rpc_object *rpc_object(void);
void rpc_put_text(struct rpc_object *o, const char *key, const char *value);
void rpc_put_int(struct rpc_object *o, const char *key, int64_t value);
void rpc_put_num(struct rpc_object *o, const char *key, double value); // NAN: null
void rpc_put_flag(struct rpc_object *o, const char *key, bool value);
void rpc_append(struct rpc_object *o, const char *key, struct rpc_object *item); // takes item

char *rpc_reply(const struct rpc_message *to, struct rpc_object *result);     // takes result
char *rpc_error(const struct rpc_message *to, int code, const char *text);    // `to` may be NULL
char *rpc_request(int64_t id, const char *method, struct rpc_object *params); // takes params
char *rpc_event(const char *method, struct rpc_object *params);               // takes params
