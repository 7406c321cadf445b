// cv_warp.cpp - OpenCV's getAffineTransform and warpAffine, as C.
#include "process/cv_warp.h"
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

extern "C" bool cv_affine(const double from[3][2], const double to[3][2], double m[2][3],
                          struct err *e)
{
    try {
        cv::Point2f a[3], b[3];
        for (int k = 0; k < 3; k++) {
            a[k] = cv::Point2f((float)from[k][0], (float)from[k][1]);
            b[k] = cv::Point2f((float)to[k][0], (float)to[k][1]);
        }
        const cv::Mat map = cv::getAffineTransform(a, b);
        std::memcpy(m, map.ptr<double>(), 6 * sizeof(double));
        return true;
    } catch (const cv::Exception &x) {
        return err_set(e, ERR_DATA, "no affine map: %s", x.err.c_str());
    }
}

extern "C" bool cv_warp(const float *in, int w, int h, const double m[2][3], float *out, int ow,
                        int oh, struct err *e)
{
    try {
        cv::setNumThreads(1);
        const cv::Mat from(h, w, CV_32FC3, const_cast<float *>(in));
        const cv::Mat map(2, 3, CV_64F, const_cast<double *>(&m[0][0]));
        cv::Mat to(oh, ow, CV_32FC3, out);
        cv::warpAffine(from, to, map, to.size(), cv::INTER_LANCZOS4 | cv::WARP_INVERSE_MAP,
                       cv::BORDER_CONSTANT, cv::Scalar(0, 0, 0));
        return true;
    } catch (const cv::Exception &x) {
        return err_set(e, ERR_DATA, "no warp: %s", x.err.c_str());
    }
}
