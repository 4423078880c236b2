// yfslam for C++17: a header that wraps yfslam.h. Objects own their handles, errors are exceptions, results are std::vector.
//
//   yfslam::Slam slam(yfslam::Camera::load("bonn"));
//   for (const yfslam::Frame &frame : yfslam::Recording("rgbd_bonn_crowd", "bonn")) {
//       yfslam::Tracked tracked = slam.track(frame);
//   }
//   slam.save_trajectory("trajectory.txt");
//
// Frames of your own: yfslam::Frame::rgbd(timestamp_ns, width, height, rgb, depth, depth_scale).
// yfslam.h says what the fields mean, and in which units they are.
#ifndef YFSLAM_HPP
#define YFSLAM_HPP

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "yfslam.h"

namespace yfslam {

/// Something that cannot be used; the text says what, and what to do.
class Error : public std::runtime_error {
public:
    Error(yfslam_status status, const std::string &text) : std::runtime_error(text), status_(status) {}

    yfslam_status status() const noexcept { return status_; }

private:
    yfslam_status status_;
};

/// A frame that does not fit the camera or the time before it; the next frame is handled as if this one had not come.
class FrameRejected : public Error {
    using Error::Error;
};

namespace detail {

inline void check(yfslam_status status) {
    if (status == YFSLAM_ERROR_FRAME) throw FrameRejected(status, yfslam_last_error());
    if (status != YFSLAM_OK) throw Error(status, yfslam_last_error());
}

template <auto Free>
struct Deleter {
    template <class T>
    void operator()(T *handle) const noexcept {
        Free(handle);
    }
};

template <class T, auto Free>
using Owned = std::unique_ptr<T, Deleter<Free>>;

} // namespace detail

enum class State : yfslam_state {
    not_initialised = YFSLAM_NOT_INITIALISED,
    tracking = YFSLAM_TRACKING,
    lost = YFSLAM_LOST,
};

using Pose = yfslam_pose;
using Point = yfslam_point;
using Detection = yfslam_detection;

/// A calibration; its fields are those of yfslam_camera.
struct Camera : yfslam_camera {
    Camera() : yfslam_camera{} { struct_size = sizeof(yfslam_camera); }

    static Camera pinhole(std::uint32_t width, std::uint32_t height, double fx, double fy, double cx, double cy) {
        Camera camera;
        camera.width = width;
        camera.height = height;
        camera.fx = fx;
        camera.fy = fy;
        camera.cx = cx;
        camera.cy = cy;
        return camera;
    }

    /// Loads a preset or a file.
    static Camera load(const std::string &preset_or_file) {
        Camera camera;
        detail::check(yfslam_camera_load(preset_or_file.c_str(), &camera));
        return camera;
    }
};

/// The images of one instant; its fields are those of yfslam_frame. It does not own the images.
struct Frame : yfslam_frame {
    Frame() : yfslam_frame{} { struct_size = sizeof(yfslam_frame); }

    /// Packed images, red, green, blue; other formats and strides by the fields.
    static Frame mono(std::int64_t timestamp_ns, std::uint32_t width, std::uint32_t height, const std::uint8_t *rgb) {
        Frame frame;
        frame.timestamp_ns = timestamp_ns;
        frame.width = width;
        frame.height = height;
        frame.color = rgb;
        return frame;
    }

    static Frame rgbd(std::int64_t timestamp_ns, std::uint32_t width, std::uint32_t height, const std::uint8_t *rgb,
                      const std::uint16_t *depth, double depth_scale = 0.0) {
        Frame frame = mono(timestamp_ns, width, height, rgb);
        frame.depth_u16 = depth;
        frame.depth_scale = depth_scale;
        return frame;
    }

    static Frame rgbd(std::int64_t timestamp_ns, std::uint32_t width, std::uint32_t height, const std::uint8_t *rgb,
                      const float *depth_m) {
        Frame frame = mono(timestamp_ns, width, height, rgb);
        frame.depth_m = depth_m;
        return frame;
    }

    static Frame stereo(std::int64_t timestamp_ns, std::uint32_t width, std::uint32_t height, const std::uint8_t *left,
                        const std::uint8_t *right) {
        Frame frame = mono(timestamp_ns, width, height, left);
        frame.right = right;
        return frame;
    }

    /// Gives the detections, which must outlive the frame, in place of the run of the detector.
    void set_detections(const std::vector<Detection> &found) {
        has_detections = 1;
        detections = found.data();
        detection_count = found.size();
    }
};

/// The result of a frame; its fields are those of yfslam_tracked.
struct Tracked : yfslam_tracked {
    Tracked() : yfslam_tracked{} { struct_size = sizeof(yfslam_tracked); }

    State tracking_state() const noexcept { return static_cast<State>(state); }
    explicit operator bool() const noexcept { return has_pose != 0; }
    std::optional<Pose> pose_if_known() const {
        if (has_pose == 0) return std::nullopt;
        return pose;
    }
};

/// Finds people in a packed image (red, green, blue); runs on a thread of the library.
using Detector = std::function<std::vector<Detection>(const std::uint8_t *rgb, std::uint32_t width, std::uint32_t height)>;

/// How the system works; empty texts stand for the defaults.
struct Options {
    yfslam_sensor sensor = YFSLAM_RGBD;
    std::string config_toml;
    std::string method;
    bool has_detector = true;
    std::string detector_file;
    Detector detector;
    bool threaded = false;
    std::string map_file;
    bool localise = false;
    bool dense = false;
};

/// A grid of the ground; cells are rows along x, that with the least y first.
struct Grid {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    double origin_m[2] = {0.0, 0.0};
    double resolution_m = 0.0;
    std::vector<std::uint8_t> cells;
};

/// The system: frames in, poses out.
class Slam {
public:
    explicit Slam(const Camera &camera, const Options &options = {})
        : detector_(options.detector ? std::make_unique<Detector>(options.detector) : nullptr) {
        const auto text = [](const std::string &value) { return value.empty() ? nullptr : value.c_str(); };
        yfslam_options raw{};
        raw.struct_size = sizeof(raw);
        raw.sensor = options.sensor;
        raw.config_toml = text(options.config_toml);
        raw.method = text(options.method);
        raw.threaded = options.threaded;
        raw.map_file = text(options.map_file);
        raw.localise = options.localise;
        raw.dense = options.dense;
        if (!options.has_detector) {
            raw.detector = YFSLAM_DETECTOR_NONE;
        } else if (detector_) {
            raw.detector = YFSLAM_DETECTOR_FUNCTION;
            raw.detector_function = call_detector;
            raw.detector_user = detector_.get();
        } else if (!options.detector_file.empty()) {
            raw.detector = YFSLAM_DETECTOR_FILE;
            raw.detector_file = options.detector_file.c_str();
        }
        yfslam_slam *slam = nullptr;
        detail::check(yfslam_create(&camera, &raw, &slam));
        slam_.reset(slam);
    }

    Tracked track(const Frame &frame) {
        Tracked tracked;
        detail::check(yfslam_track(slam_.get(), &frame, &tracked));
        return tracked;
    }

    /// Why the pose of the last frame is not known; empty while tracking.
    std::string lost_reason() const { return yfslam_lost_reason(slam_.get()); }

    void finish() { detail::check(yfslam_finish(slam_.get())); }
    void save_map(const std::string &path) { detail::check(yfslam_save_map(slam_.get(), path.c_str())); }
    void save_trajectory(const std::string &path) { detail::check(yfslam_save_trajectory(slam_.get(), path.c_str())); }

    std::vector<Pose> trajectory() {
        yfslam_trajectory *raw = nullptr;
        detail::check(yfslam_get_trajectory(slam_.get(), &raw));
        const detail::Owned<yfslam_trajectory, yfslam_trajectory_free> poses(raw);
        const Pose *data = yfslam_trajectory_data(raw);
        return {data, data + yfslam_trajectory_size(raw)};
    }

    std::vector<Point> landmarks() { return points(yfslam_get_landmarks); }
    std::vector<Point> cloud() { return points(yfslam_get_cloud); }

    Grid grid(float low_m, float high_m) {
        yfslam_grid_info info{};
        info.struct_size = sizeof(info);
        yfslam_grid *raw = nullptr;
        detail::check(yfslam_get_grid(slam_.get(), low_m, high_m, &info, &raw));
        const detail::Owned<yfslam_grid, yfslam_grid_free> cells(raw);
        const std::uint8_t *data = yfslam_grid_data(raw);
        Grid grid;
        grid.width = info.width;
        grid.height = info.height;
        grid.origin_m[0] = info.origin_m[0];
        grid.origin_m[1] = info.origin_m[1];
        grid.resolution_m = info.resolution_m;
        grid.cells.assign(data, data + std::size_t(info.width) * info.height);
        return grid;
    }

    yfslam_slam *get() const noexcept { return slam_.get(); }

private:
    std::vector<Point> points(yfslam_status (*get)(yfslam_slam *, yfslam_points **)) {
        yfslam_points *raw = nullptr;
        detail::check(get(slam_.get(), &raw));
        const detail::Owned<yfslam_points, yfslam_points_free> owned(raw);
        const Point *data = yfslam_points_data(raw);
        return {data, data + yfslam_points_size(raw)};
    }

    // Exceptions must not reach the library; a detector that throws has failed on this image.
    static std::int32_t call_detector(void *user, const std::uint8_t *rgb, std::uint32_t width, std::uint32_t height,
                                      yfslam_detection *detections, std::size_t capacity, std::size_t *count) noexcept {
        try {
            const std::vector<Detection> found = (*static_cast<Detector *>(user))(rgb, width, height);
            *count = found.size() < capacity ? found.size() : capacity;
            for (std::size_t index = 0; index < *count; ++index) detections[index] = found[index];
            return 0;
        } catch (...) {
            return 1;
        }
    }

    // Before the system, which calls it until its end.
    std::unique_ptr<Detector> detector_;
    detail::Owned<yfslam_slam, yfslam_destroy> slam_;
};

/// A folder or bag, frame by frame, once.
class Recording {
public:
    explicit Recording(const std::string &path, const std::string &camera = {}) {
        yfslam_recording *raw = nullptr;
        detail::check(yfslam_recording_open(path.c_str(), camera.empty() ? nullptr : camera.c_str(), &raw));
        recording_.reset(raw);
    }

    Camera camera() const {
        Camera camera;
        detail::check(yfslam_recording_camera(recording_.get(), &camera));
        return camera;
    }

    yfslam_sensor sensor() const { return yfslam_recording_sensor(recording_.get()); }

    /// Returns the next frame, whose images stay valid until the next call; frames that cannot be used are left out.
    std::optional<Frame> next() {
        for (;;) {
            Frame frame;
            const yfslam_status status = yfslam_recording_next(recording_.get(), &frame);
            if (status == YFSLAM_END) return std::nullopt;
            if (status == YFSLAM_ERROR_FRAME) {
                ++skipped_;
                continue;
            }
            detail::check(status);
            return frame;
        }
    }

    /// Frames that could not be used so far.
    std::size_t skipped() const noexcept { return skipped_; }

    class Iterator {
    public:
        explicit Iterator(Recording *recording) : recording_(recording) { ++*this; }
        const Frame &operator*() const { return *frame_; }
        Iterator &operator++() {
            if (recording_ != nullptr) frame_ = recording_->next();
            return *this;
        }
        bool operator!=(const Iterator &) const { return frame_.has_value(); }

    private:
        Recording *recording_;
        std::optional<Frame> frame_;
    };

    Iterator begin() { return Iterator(this); }
    Iterator end() { return Iterator(nullptr); }

private:
    detail::Owned<yfslam_recording, yfslam_recording_close> recording_;
    std::size_t skipped_ = 0;
};

} // namespace yfslam

#endif
