// cv_board.cpp - OpenCV's chessboard and ChArUco targets and its camera calibration, as C.
#include "calib/cv_board.h"
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace
{
using cv::aruco::CharucoBoard;

const struct {
    const char *name;
    int id;
} dictionaries[] = {
    {"4x4_50", cv::aruco::DICT_4X4_50},           {"4x4_100", cv::aruco::DICT_4X4_100},
    {"4x4_250", cv::aruco::DICT_4X4_250},         {"4x4_1000", cv::aruco::DICT_4X4_1000},
    {"5x5_50", cv::aruco::DICT_5X5_50},           {"5x5_100", cv::aruco::DICT_5X5_100},
    {"5x5_250", cv::aruco::DICT_5X5_250},         {"5x5_1000", cv::aruco::DICT_5X5_1000},
    {"6x6_50", cv::aruco::DICT_6X6_50},           {"6x6_100", cv::aruco::DICT_6X6_100},
    {"6x6_250", cv::aruco::DICT_6X6_250},         {"6x6_1000", cv::aruco::DICT_6X6_1000},
    {"7x7_50", cv::aruco::DICT_7X7_50},           {"7x7_100", cv::aruco::DICT_7X7_100},
    {"7x7_250", cv::aruco::DICT_7X7_250},         {"7x7_1000", cv::aruco::DICT_7X7_1000},
    {"original", cv::aruco::DICT_ARUCO_ORIGINAL}, {"16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"25h9", cv::aruco::DICT_APRILTAG_25h9},      {"36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"36h11", cv::aruco::DICT_APRILTAG_36h11},
};

// Throws for what is not possible; the callers turn that into ERR_DATA.
cv::Ptr<CharucoBoard> charuco(const struct board &b)
{
    for (const auto &d : dictionaries)
        if (!strcmp(d.name, b.dictionary)) {
            const auto dictionary = cv::aruco::getPredefinedDictionary(d.id);
            const int markers = (b.cols + 1) * (b.rows + 1) / 2;
            if (markers > dictionary->bytesList.rows)
                CV_Error(cv::Error::StsBadArg, "the board needs " + std::to_string(markers) +
                                                   " markers, the dictionary has " +
                                                   std::to_string(dictionary->bytesList.rows));
            return CharucoBoard::create(b.cols + 1, b.rows + 1, (float)b.square_m,
                                        (float)b.marker_m, dictionary);
        }
    std::string names;
    for (const auto &d : dictionaries)
        names += std::string(names.empty() ? "" : " ") + d.name;
    CV_Error(cv::Error::StsBadArg,
             "no dictionary '" + std::string(b.dictionary) + "'; there are " + names);
}

cv::Point3f place(const struct board &b, int id)
{
    return {(float)(id % b.cols * b.square_m), (float)(id / b.cols * b.square_m), 0};
}

// Half the side of the window that the corner is refined in: well inside the four squares.
int window(const std::vector<cv::Point2f> &at)
{
    double least = 1e9;
    for (size_t k = 0; k < at.size(); k++)
        for (size_t m = 0; m < k; m++)
            least = std::min(least, cv::norm(at[k] - at[m]));
    return std::max(2, std::min(11, (int)(0.3 * least)));
}

void refine(const cv::Mat &grey, std::vector<cv::Point2f> &at)
{
    const int half = window(at);
    cv::cornerSubPix(grey, at, {half, half}, {-1, -1},
                     {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-4});
}

void find_chessboard(const struct board &b, const cv::Mat &grey, std::vector<cv::Point2f> &at,
                     std::vector<int> &id)
{
    if (!cv::findChessboardCornersSB(grey, {b.cols, b.rows}, at,
                                     cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE |
                                         cv::CALIB_CB_ACCURACY) &&
        !cv::findChessboardCorners(grey, {b.cols, b.rows}, at)) {
        at.clear();
        return;
    }
    refine(grey, at);
    for (int k = 0; k < b.cols * b.rows; k++)
        id.push_back(k);
}

void find_charuco(const struct board &b, const cv::Mat &grey, std::vector<cv::Point2f> &at,
                  std::vector<int> &id)
{
    const auto target = charuco(b);
    std::vector<std::vector<cv::Point2f>> marker;
    std::vector<int> which;
    cv::aruco::detectMarkers(grey, target->dictionary, marker, which);
    if (which.empty())
        return;
    cv::aruco::interpolateCornersCharuco(marker, which, grey, target, at, id);
    if (at.size() > 1)
        refine(grey, at);
}
} // namespace

extern "C" bool cv_board_find(const struct board *b, const uint8_t *grey, int w, int h,
                              struct corners *out, struct err *e)
{
    try {
        cv::setNumThreads(1);
        const cv::Mat m(h, w, CV_8U, const_cast<uint8_t *>(grey));
        std::vector<cv::Point2f> at;
        std::vector<int> id;
        if (b->marker_m > 0)
            find_charuco(*b, m, at, id);
        else
            find_chessboard(*b, m, at, id);
        const size_t n = at.size();
        *out = {(int)n, static_cast<int *>(malloc((n + 1) * sizeof(int))),
                static_cast<double(*)[2]>(malloc((n + 1) * sizeof(double[2])))};
        if (!out->id || !out->px)
            abort();
        for (size_t k = 0; k < n; k++) {
            out->id[k] = id[k];
            out->px[k][0] = at[k].x;
            out->px[k][1] = at[k].y;
        }
        return true;
    } catch (const cv::Exception &x) {
        return err_set(e, ERR_DATA, "%s", x.err.c_str());
    }
}

extern "C" bool cv_board_calibrate(const struct board *b, const struct corners *seen, int n, int w,
                                   int h, bool with_k3, struct camera_fit *camera,
                                   struct view_fit *view, struct err *e)
{
    try {
        cv::setNumThreads(1);
        std::vector<std::vector<cv::Point3f>> object((size_t)n);
        std::vector<std::vector<cv::Point2f>> image((size_t)n);
        for (int v = 0; v < n; v++)
            for (int k = 0; k < seen[v].n; k++) {
                object[(size_t)v].push_back(place(*b, seen[v].id[k]));
                image[(size_t)v].push_back({(float)seen[v].px[k][0], (float)seen[v].px[k][1]});
            }
        cv::Mat K, D, sigma, ignored, per_view;
        std::vector<cv::Mat> turn, shift;
        camera->rms_px =
            cv::calibrateCamera(object, image, {w, h}, K, D, turn, shift, sigma, ignored, per_view,
                                with_k3 ? 0 : cv::CALIB_FIX_K3,
                                {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-14});
        for (int a = 0; a < 2; a++) {
            camera->focal_px[a] = K.at<double>(a, a);
            camera->center_px[a] = K.at<double>(a, 2);
            camera->focal_sigma_px[a] = sigma.at<double>(a);
            camera->center_sigma_px[a] = sigma.at<double>(2 + a);
        }
        for (int k = 0; k < 5; k++) {
            camera->distortion[k] = D.at<double>(k);
            camera->distortion_sigma[k] = sigma.at<double>(4 + k);
        }
        for (int v = 0; v < n; v++) {
            cv::Mat R;
            cv::Rodrigues(turn[(size_t)v], R);
            memcpy(view[v].rotation, R.ptr<double>(), sizeof view[v].rotation);
            memcpy(view[v].origin_m, shift[(size_t)v].ptr<double>(), sizeof view[v].origin_m);
            view[v].rms_px = per_view.at<double>(v);
        }
        return true;
    } catch (const cv::Exception &) {
        return err_set(e, ERR_DATA, "the views do not determine a camera");
    }
}

extern "C" bool cv_board_draw(const struct board *b, int square_px, uint8_t *grey, struct err *e)
{
    try {
        const int w = (b->cols + 3) * square_px, h = (b->rows + 3) * square_px;
        cv::Mat m(h, w, CV_8U, grey);
        if (b->marker_m > 0) {
            charuco(*b)->draw({w, h}, m, square_px);
            return true;
        }
        m.setTo(255);
        for (int j = 0; j <= b->rows; j++)
            for (int i = j % 2; i <= b->cols; i += 2)
                m(cv::Rect((i + 1) * square_px, (j + 1) * square_px, square_px, square_px)) = 0;
        return true;
    } catch (const cv::Exception &x) {
        return err_set(e, ERR_DATA, "%s", x.err.c_str());
    }
}
