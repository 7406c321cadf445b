// response_file.h - a response as a record.
#pragma once
#include "calib/record.h"
#include "calib/response.h"

bool response_write(const struct response *r, const struct record *rec, const char *command,
                    const char *path, struct err *e);
bool response_read(struct response *r, struct record *rec, const char *path, struct err *e);
