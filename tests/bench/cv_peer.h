// cv_peer.h - OpenCV as an opponent in the benchmarks; never used by the program itself.
#pragma once
#ifdef __cplusplus
extern "C" {
#endif

// Richardson-Lucy as a loop on sepFilter2D, one thread; data, out [h][w].
void cv_richardson_lucy(const float *data, int w, int h, double sigma_px, int iterations,
                        float *out);

#ifdef __cplusplus
}
#endif
