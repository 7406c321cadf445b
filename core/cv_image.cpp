// cv_image.cpp - OpenCV's imread and imwrite, as C.
#include "core/cv_image.h"
#include <cstring>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

// OpenCV, libpng and libjpeg talk on stderr, and libjpeg tells nowhere else that it made up a part
// of the picture. While this lives, stderr goes into memory.
class stderr_catcher
{
    static std::mutex one_at_a_time;
    std::lock_guard<std::mutex> lock{one_at_a_time};
    int kept = dup(STDERR_FILENO), caught = memfd_create("stderr", MFD_CLOEXEC);

  public:
    stderr_catcher()
    {
        if (kept >= 0 && caught >= 0)
            dup2(caught, STDERR_FILENO);
    }
    ~stderr_catcher()
    {
        if (kept >= 0)
            dup2(kept, STDERR_FILENO);
        close(kept);
        close(caught);
    }
    stderr_catcher(const stderr_catcher &) = delete;
    stderr_catcher &operator=(const stderr_catcher &) = delete;

    // Did libjpeg lose data? Bytes too many between segments, as some cameras write, lose nothing.
    bool jpeg_is_corrupt() const
    {
        char buf[4096];
        const ssize_t n = pread(caught, buf, sizeof buf, 0);
        const std::string text(buf, n > 0 ? size_t(n) : 0);
        for (size_t at = 0; (at = text.find("Corrupt JPEG data: ", at)) != text.npos; at += 19)
            if (text.substr(at, text.find('\n', at) - at).find("extraneous") == text.npos)
                return true;
        return text.find("Premature end of JPEG") != text.npos;
    }
};
std::mutex stderr_catcher::one_at_a_time;

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
    const stderr_catcher caught;
    try {
        const cv::Mat m = cv::imread(path, cv::IMREAD_UNCHANGED);
        if (m.empty() || caught.jpeg_is_corrupt())
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
    const stderr_catcher caught;
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
