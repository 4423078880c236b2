// A detector of your own, and frames of your own: a wall with a random pattern moves past the camera, and the detector takes its left
// third for a person. Needs no data; fails if the poses are not those of the motion.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <vector>
#include <yfslam.hpp>

namespace {

constexpr std::uint32_t width = 640, height = 480;
constexpr double focal = 500.0, wall_m = 2.0, step_m = 0.012;

/// Returns the brightness of the wall at a position in mm: squares of 25 mm with random brightness.
std::uint8_t pattern(double x_mm, double y_mm) {
    const auto column = static_cast<std::uint32_t>(std::floor(x_mm / 25.0) + 10000.0);
    const auto row = static_cast<std::uint32_t>(std::floor(y_mm / 25.0) + 10000.0);
    std::uint32_t hash = column * 2654435761u ^ row * 2246822519u;
    hash = (hash ^ (hash >> 15)) * 2246822519u;
    return static_cast<std::uint8_t>(30 + ((hash >> 13) & 0x7f));
}

} // namespace

int main() try {
    yfslam::Options options;
    options.detector = [](const std::uint8_t *, std::uint32_t, std::uint32_t image_height) {
        return std::vector<yfslam::Detection>{{0.0f, 0.0f, width / 3.0f, static_cast<float>(image_height), 0.9f, 0}};
    };
    // Everything in the boxes is left out.
    options.method = "boxes";
    yfslam::Camera camera = yfslam::Camera::pinhole(width, height, focal, focal, 319.5, 239.5);
    camera.knows_readout = 1;
    yfslam::Slam slam(camera, options);

    std::vector<std::uint8_t> gray(width * height);
    const std::vector<float> depth_m(width * height, static_cast<float>(wall_m));
    double worst_m = 0.0;
    const int frames = 12;
    for (int index = 0; index < frames; ++index) {
        for (std::uint32_t row = 0; row < height; ++row) {
            for (std::uint32_t column = 0; column < width; ++column) {
                const double x_m = (column - 319.5) / focal * wall_m + index * step_m;
                const double y_m = (row - 239.5) / focal * wall_m;
                gray[row * width + column] = pattern(1e3 * x_m, 1e3 * y_m);
            }
        }
        yfslam::Frame frame = yfslam::Frame::rgbd(33'000'000LL * index, width, height, gray.data(), depth_m.data());
        frame.pixels = YFSLAM_GRAY8;
        const yfslam::Tracked tracked = slam.track(frame);
        if (!tracked) {
            std::cerr << "frame " << index << ": " << slam.lost_reason() << '\n';
            return 1;
        }
        const double *p = tracked.pose.position_m;
        worst_m = std::max(worst_m, std::hypot(p[0] - index * step_m, p[1], p[2]));
    }
    std::cout << frames << " frames, largest error of a position " << 1e3 * worst_m << " mm\n";
    if (slam.trajectory().size() != frames || worst_m > 0.005) return 1;

    // What is wrong is an exception, and the system goes on.
    try {
        slam.track(yfslam::Frame::mono(0, 2, 2, gray.data()));
        return 1;
    } catch (const yfslam::FrameRejected &error) {
        std::cout << "refused as it should be: " << error.what() << '\n';
    }
    return 0;
} catch (const yfslam::Error &error) {
    std::cerr << error.what() << '\n';
    return 1;
}
