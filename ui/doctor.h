// doctor.h - the parts of nacre doctor.
#pragma once
#include "ui/cli.h"

void doctor_devices(struct cli *cli); // drivers, options, devices; into cli->doc
