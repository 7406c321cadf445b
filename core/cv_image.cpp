// cv_image.cpp - OpenCV's imread and imwrite, as C.
#include "core/cv_image.h"
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

static void copy_samples(const cv::Mat &m, struct image *im)
{
    // OpenCV's order is B, G, R, A
    static const int order[4] = {2, 1, 0, 3};
    const int nc = im->nc;
    const float scale = m.depth() == CV_8U ? 1 / 255.f : m.depth() == CV_16U ? 1 / 65535.f : 1.f;
    for (int j = 0; j < im->h; j++) {
        float *row = im->px + (size_t)j * (size_t)im->w * (size_t)nc;
        for (int i = 0; i < im->w * nc; i++) {
            const int from = nc >= 3 ? i - i % nc + order[i % nc] : i;
            const float v = m.depth() == CV_8U    ? m.ptr<uint8_t>(j)[from]
                            : m.depth() == CV_16U ? m.ptr<uint16_t>(j)[from]
                                                  : m.ptr<float>(j)[from];
            row[i] = v * scale;
        }
    }
}

extern "C" bool cv_read(struct image *im, const char *path, struct err *e)
{
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    try {
        const cv::Mat m = cv::imread(path, cv::IMREAD_UNCHANGED);
        if (m.empty())
            return err_set(e, ERR_DATA, "damaged or cut short: it cannot be decoded");
        if (m.depth() != CV_8U && m.depth() != CV_16U && m.depth() != CV_32F)
            return err_set(e, ERR_DATA, "samples must be 8 or 16 bit unsigned, or 32-bit float");
        if (m.channels() != 1 && m.channels() != 3 && m.channels() != 4)
            return err_set(e, ERR_DATA, "%d channels: must be 1, 3 or 4", m.channels());
        if (!image_init(im, m.cols, m.rows, m.channels(), e))
            return false;
        copy_samples(m, im);
        meta_set_num(&im->meta, "nacre.encoded", m.depth() == CV_8U);
        return true;
    } catch (const std::exception &) {
        return err_set(e, ERR_DATA, "damaged: it cannot be decoded");
    }
}

extern "C" bool cv_write(const void *px, int w, int h, int nc, int sample_bytes, const char *path,
                         struct err *e)
{
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    try {
        const int depth = sample_bytes == 1 ? CV_8U : CV_16U;
        const cv::Mat rgb(h, w, CV_MAKETYPE(depth, nc), const_cast<void *>(px));
        cv::Mat bgr = rgb;
        if (nc == 3) {
            static const int swap[] = {0, 2, 1, 1, 2, 0};
            bgr = cv::Mat(h, w, rgb.type());
            cv::mixChannels(&rgb, 1, &bgr, 1, swap, 3);
        }
        if (!cv::imwrite(path, bgr))
            return err_set(e, ERR_FILE, "cannot write");
        return true;
    } catch (const std::exception &) {
        return err_set(e, ERR_FILE, "cannot write");
    }
}
