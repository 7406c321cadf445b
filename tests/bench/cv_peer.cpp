// cv_peer.cpp - the loops that a user of OpenCV would write.
#include "tests/bench/cv_peer.h"
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

void cv_richardson_lucy(const float *data, int w, int h, double sigma_px, int iterations,
                        float *out)
{
    cv::setNumThreads(1);
    const cv::Mat d(h, w, CV_32F, const_cast<float *>(data));
    const cv::Mat k =
        cv::getGaussianKernel(2 * (int)std::ceil(4 * sigma_px) + 1, sigma_px, CV_32F);
    cv::Mat u(h, w, CV_32F, cv::Scalar(cv::mean(d)[0])), model, ratio, back;
    for (int it = 0; it < iterations; it++) {
        cv::sepFilter2D(u, model, CV_32F, k, k, cv::Point(-1, -1), 0, cv::BORDER_REFLECT);
        cv::divide(d, model, ratio);
        cv::sepFilter2D(ratio, back, CV_32F, k, k, cv::Point(-1, -1), 0, cv::BORDER_REFLECT);
        cv::multiply(u, back, u);
    }
    u.copyTo(cv::Mat(h, w, CV_32F, out));
}
