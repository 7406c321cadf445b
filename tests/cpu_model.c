// cpu_model.c - an older processor than this one: stands in for what libgcc asks the hardware, so
// that the choice between target_clones is made by the build.
//
// The names and places of the bits are libgcc's (gcc/common/config/i386/i386-cpuinfo.h).
enum { AVX2 = 10, FMA = 14, AVX512F = 15, X86_64_V3 = 97 - 96 };

struct cpu_model {
    unsigned vendor, type, subtype, features;
};
extern struct cpu_model __cpu_model;
extern unsigned __cpu_features2[8];
int __cpu_indicator_init(void);

struct cpu_model __cpu_model = {
    .vendor = 1,
    .features = PATH >= 2 ? (1u << AVX2) | (1u << FMA) | (unsigned)(PATH == 3) << AVX512F : 0,
};
unsigned __cpu_features2[8] = {[2] = PATH >= 2 ? 1u << X86_64_V3 : 0};

int __cpu_indicator_init(void)
{
    return 0;
}
