// session_doc.c - a session's frames and state as a document: for show, and for what export writes.
#define _GNU_SOURCE
#include "core/product.h"
#include "ui/session_verbs.h"
#include <math.h>
#include <stdlib.h>

void session_describe_frame(const struct session_frame *f, struct doc *d)
{
    static const char *const kinds[] = {"light", "dark", "meter"};
    doc_int(d, "id", f->id);
    doc_int(d, "step", f->step.index);
    doc_int(d, "attempt", f->attempt);
    doc_text(d, "kind", kinds[f->step.kind]);
    doc_text(d, "light", f->step.light);
    doc_text(d, "filter", f->step.filter);
    doc_int(d, "repeat", f->step.repeat);
    doc_num(d, "exposure_s", session_exposure_s(f));
    doc_num(d, "requested_s", 1e-9 * (double)f->step.exposure_ns);
    doc_num(d, "reported_s", f->reported_ns ? 1e-9 * (double)f->reported_ns : NAN);
    doc_num(d, "measured_s", f->measured_ns ? 1e-9 * (double)f->measured_ns : NAN);
    doc_num(d, "measured_sigma", f->measured_sigma);
    doc_num(d, "gain", f->gain);
    doc_num(d, "focus_per_m", f->focus_per_m);
    doc_num(d, "temperature_k", f->temperature_k);
    doc_int(d, "sequence", (long)f->seq);
    doc_int(d, "device_ns", f->device_ns);
    doc_int(d, "start_ns", f->start_ns);
    doc_int(d, "arrived_ns", f->arrived_ns);
    doc_int(d, "utc_ns", f->utc_ns);
    doc_int(d, "light_on_ns", f->light_on_ns);
    doc_int(d, "light_off_ns", f->light_off_ns);
    doc_int(d, "w", f->w);
    doc_int(d, "h", f->h);
    doc_num(d, "black", f->black);
    doc_int(d, "white", f->white);
    doc_num(d, "saturated", f->saturated);
    doc_text(d, "path", f->path);
    doc_text(d, "sha256", f->sha256);
    doc_text(d, "verdict", f->verdict);
    if (*f->reason)
        doc_text(d, "reason", f->reason);
}

void session_describe_state(const struct session_report *r, struct doc *d)
{
    doc_text(d, "status", session_state_name[r->state]);
    doc_int(d, "planned", r->planned);
    doc_bool(d, "planned_to_end", r->is_final);
    doc_int(d, "good", r->good);
    doc_int(d, "rejected_count", r->other);
    for (int k = 0; k < r->n_problems && k < 16; k++)
        doc_text(doc_item(d, "problems"), "text", r->problem[k]);
}

bool session_describe_meterings(struct session *s, struct doc *d, struct err *e)
{
    struct session_frame *frame;
    int n;
    if (!session_meterings(s, &frame, &n, e))
        return false;
    for (int k = 0; k < n; k++) {
        struct doc *item = doc_item(d, "metering");
        doc_int(item, "group", frame[k].step.group);
        session_describe_frame(&frame[k], item);
    }
    free(frame);
    return true;
}

bool session_describe_history(struct session *s, struct doc *d, struct err *e)
{
    struct session_event *event;
    int n;
    if (!session_history(s, &event, &n, e))
        return false;
    doc_list(d, "history");
    for (int k = 0; k < n; k++) {
        struct doc *item = doc_item(d, "history");
        doc_int(item, "boot_ns", event[k].boot_ns);
        doc_text(item, "what", event[k].what);
        doc_text(item, "text", event[k].text);
    }
    free(event);
    return true;
}

bool session_describe_products(struct session *s, struct doc *d, struct err *e)
{
    struct product *p;
    int n;
    if (!product_list(s, &p, &n, e))
        return false;
    doc_list(d, "products");
    for (int k = 0; k < n; k++) {
        struct doc *item = doc_item(d, "products");
        doc_text(item, "path", p[k].path);
        doc_text(item, "command", p[k].command);
        if (*p[k].folder)
            doc_text(item, "folder", p[k].folder);
        doc_text(item, "version", p[k].version);
        doc_int(item, "utc_ns", p[k].utc_ns);
        doc_text(item, "sha256", p[k].sha256);
        doc_list(item, "inputs");
        for (int i = 0; i < p[k].n_inputs; i++) {
            struct doc *in = doc_item(item, "inputs");
            doc_text(in, "path", p[k].input[i].path);
            doc_text(in, "sha256", p[k].input[i].sha256);
        }
        product_finish(&p[k]);
    }
    free(p);
    return true;
}
