// hdr_peer.cpp - OpenCV's merges as a program of their own, beside which ours is timed: nothing of
// nacre links with them.
//
//   nacre-hdr-peer METHOD W H FRAMES RESPONSE OUT TIME...   METHOD: robertson debevec
//
// FRAMES holds the codes [n][h][w][3], RESPONSE X of every code [256][3] float, OUT gets [h][w][3]
// float. One thread; prints the median of three runs, processor seconds: others may be at work.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <opencv2/photo.hpp>
#include <string>
#include <vector>

int main(int argc, char **argv)
{
    if (argc < 9)
        return 2;
    cv::setNumThreads(1);
    const std::string method = argv[1];
    const int w = atoi(argv[2]), h = atoi(argv[3]);
    std::ifstream frames(argv[4], std::ios::binary), curve(argv[5], std::ios::binary);
    std::vector<float> times;
    std::vector<cv::Mat> image;
    for (int k = 7; k < argc; k++) {
        times.push_back((float)atof(argv[k]));
        image.emplace_back(h, w, CV_8UC3);
        frames.read((char *)image.back().data, (std::streamsize)w * h * 3);
    }
    cv::Mat response(256, 1, CV_32FC3), out;
    curve.read((char *)response.data, 256 * 3 * sizeof(float));
    if (!frames || !curve)
        return 5;
    std::vector<double> seconds;
    for (int run = 0; run < 3; run++) {
        const std::clock_t start = std::clock();
        if (method == "robertson")
            cv::createMergeRobertson()->process(image, out, times, response);
        else
            cv::createMergeDebevec()->process(image, out, times, response);
        seconds.push_back((double)(std::clock() - start) / CLOCKS_PER_SEC);
    }
    std::sort(seconds.begin(), seconds.end());
    std::ofstream(argv[6], std::ios::binary)
        .write((const char *)out.data, (std::streamsize)w * h * 12);
    printf("%.6f\n", seconds[1]);
    return 0;
}
