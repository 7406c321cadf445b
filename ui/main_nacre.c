// main_nacre.c - the command line: this list, and nothing else.
#include "ui/commands.h"

// clang-format off
static const struct command *const commands[] = {
    &cmd_demo,
    &cmd_capture,
    &cmd_session,
    &cmd_hdr,
    &cmd_calib,
    &cmd_lut,
    &cmd_bokeh,
    &cmd_deconvolve,
    &cmd_height,
    &cmd_tables,
    &cmd_slits,
    &cmd_eval,
    &cmd_export,
    &cmd_factor,
    &cmd_prefilter,
    &cmd_methods,
    &cmd_render,
    &cmd_gallery,
    &cmd_report,
    &cmd_simulate,
    &cmd_convert,
    &cmd_look,
    &cmd_compare,
    &cmd_doctor,
    &cmd_bench,
    NULL,
};
// clang-format on

int main(int argc, char **argv)
{
    return cli_main(argc, argv, commands);
}
