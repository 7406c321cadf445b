// commands.h - the commands of nacre, one file each (cmd_<name>.c).
#pragma once
#include "ui/cli.h"

extern const struct command cmd_doctor;
