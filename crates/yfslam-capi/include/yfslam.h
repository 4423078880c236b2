/* yfslam: visual SLAM for places where people move. The interface for C; yfslam.hpp wraps it for C++.
 *
 *   yfslam_camera camera = YFSLAM_CAMERA_INIT;
 *   yfslam_camera_load("bonn", &camera);                    or fill in width, height, fx, fy, cx, cy
 *   yfslam_slam *slam = NULL;
 *   if (yfslam_create(&camera, NULL, &slam) != YFSLAM_OK) puts(yfslam_last_error());
 *   yfslam_tracked tracked = YFSLAM_TRACKED_INIT;
 *   yfslam_track(slam, &frame, &tracked);                   for each frame
 *   yfslam_destroy(slam);
 *
 * Conventions
 *   The camera has x to the right, y down and z forward. The world is the first camera of the map. Lengths are metres, times are
 *   nanoseconds. Matrices are row by row. Text is UTF-8.
 *   Structures begin with their size, which the macros YFSLAM_..._INIT set, so that a program and a library of different versions
 *   agree on their fields: fields that one of them does not have are zero for the other.
 *   Functions return a yfslam_status; after anything but YFSLAM_OK and YFSLAM_END, yfslam_last_error() says on the same thread what is
 *   wrong and what to do.
 *   A handle may be used from several threads; the calls run one after the other. No call may use a handle that is being destroyed.
 *   Pointers are either NULL, where this is allowed, or valid for the sizes that are given beside them.
 */
#ifndef YFSLAM_H
#define YFSLAM_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#define YFSLAM_SIZED(type) {sizeof(type)}
#else
#define YFSLAM_SIZED(type) {.struct_size = sizeof(type)}
#endif

/* The version of this interface. It grows when a program has to be compiled anew. */
#define YFSLAM_ABI_VERSION 1

/* Results of functions. */
typedef int32_t yfslam_status;
#define YFSLAM_OK 0
/* An argument that cannot be used: a NULL pointer, a size, a name. */
#define YFSLAM_ERROR_ARGUMENT 1
/* A camera, configuration, detector or map that cannot be used. */
#define YFSLAM_ERROR_SETUP 2
/* A frame that does not fit the camera or the time before it. The next frame is handled as if this one had not come. */
#define YFSLAM_ERROR_FRAME 3
/* A file that cannot be read or written. */
#define YFSLAM_ERROR_FILE 4
/* A fault of the library; please report it. */
#define YFSLAM_ERROR_INTERNAL 5
/* There are no more frames. */
#define YFSLAM_END 6

/* What depth comes from. */
typedef int32_t yfslam_sensor;
#define YFSLAM_RGBD 0
#define YFSLAM_STEREO 1
#define YFSLAM_MONO 2

/* Pixels of colour images. */
typedef int32_t yfslam_pixels;
#define YFSLAM_RGB8 0
#define YFSLAM_BGR8 1
#define YFSLAM_GRAY8 2

/* Tracking states. */
typedef int32_t yfslam_state;
#define YFSLAM_NOT_INITIALISED 0
#define YFSLAM_TRACKING 1
#define YFSLAM_LOST 2

/* Who finds people in the images. */
typedef int32_t yfslam_detector;
/* The network in the library. */
#define YFSLAM_DETECTOR_EMBEDDED 0
/* None; only the detections and masks that come with frames are used. */
#define YFSLAM_DETECTOR_NONE 1
/* An ONNX file, detector_file. */
#define YFSLAM_DETECTOR_FILE 2
/* A function, detector_function. */
#define YFSLAM_DETECTOR_FUNCTION 3

/* Cells of a grid. */
#define YFSLAM_CELL_UNKNOWN 0
#define YFSLAM_CELL_FREE 1
#define YFSLAM_CELL_OCCUPIED 2

/* A calibration of the colour image, to which depth images are registered, or of the left image of a rectified stereo pair. */
typedef struct {
    uint32_t struct_size;
    uint32_t width;  /* px */
    uint32_t height; /* px */
    uint32_t reserved;
    double fx, fy, cx, cy;  /* px */
    double distortion[8];   /* k1 k2 p1 p2 k3 k4 k5 k6 as in OpenCV; 0 for rectified images */
    double fps;             /* frames per second; 0 stands for 30 */
    double baseline_m;      /* of a stereo camera; else 0 */
    double depth_scale;     /* metres per unit of 16-bit depth images, such as 0.001; 0 if unknown */
    int32_t knows_readout;  /* whether readout_ms is known; else it is estimated */
    int32_t reserved2;
    double readout_ms;      /* time from the first to the last row of an image; 0 for a global shutter */
} yfslam_camera;
#define YFSLAM_CAMERA_INIT YFSLAM_SIZED(yfslam_camera)

/* An object in an image. */
typedef struct {
    float x_min, y_min, x_max, y_max; /* px */
    float score;                      /* 0 to 1 */
    uint32_t class_index;             /* number of the class; 0 is a person */
} yfslam_detection;

/* Finds people in a packed image (red, green, blue), on a thread of the library. Writes at most `capacity` detections and their number,
 * and returns 0; anything else counts as a failure on this image. */
typedef int32_t (*yfslam_detector_function)(void *user, const uint8_t *rgb, uint32_t width, uint32_t height,
                                            yfslam_detection *detections, size_t capacity, size_t *count);

/* How the system works. All zero but for the size is the default. */
typedef struct {
    uint32_t struct_size;
    yfslam_sensor sensor;
    const char *config_toml;   /* settings that differ from the defaults, as text in TOML; NULL for none */
    const char *method;        /* none, boxes, yf, ds, dyna, dms, full; NULL takes that of the settings, which is full */
    yfslam_detector detector;
    int32_t threaded;          /* 1: mapping runs on its own thread, for live cameras */
    const char *detector_file; /* an ONNX file */
    yfslam_detector_function detector_function;
    void *detector_user;       /* first argument of detector_function */
    const char *map_file;      /* a saved map in which the system starts; NULL for none */
    int32_t localise;          /* 1: the map stays as it is; 0: it is extended */
    int32_t dense;             /* 1: makes a dense map, for yfslam_cloud and yfslam_grid */
} yfslam_options;
#define YFSLAM_OPTIONS_INIT YFSLAM_SIZED(yfslam_options)

/* The images of one instant. Strides are bytes from one row to the next; 0 stands for packed rows. */
typedef struct {
    uint32_t struct_size;
    yfslam_pixels pixels;      /* of color and right */
    int64_t timestamp_ns;
    uint32_t width, height;    /* px, of all images */
    const uint8_t *color;
    size_t color_stride;
    const uint16_t *depth_u16; /* depth in units of depth_scale, 0 where nothing was measured; or depth_m */
    const float *depth_m;      /* depth in metres, 0 or NaN where nothing was measured */
    size_t depth_stride;
    double depth_scale;        /* metres per unit of depth_u16; 0 takes that of the camera */
    int32_t has_depth_timestamp;
    int32_t has_detections;    /* 1: detections replace the run of the detector, also if there are none */
    int64_t depth_timestamp_ns;
    const uint8_t *right;      /* right image of a rectified stereo pair */
    size_t right_stride;
    const uint8_t *mask;       /* movable objects: 0 where there is none; may be NULL */
    size_t mask_stride;
    const yfslam_detection *detections;
    size_t detection_count;
} yfslam_frame;
#define YFSLAM_FRAME_INIT YFSLAM_SIZED(yfslam_frame)

/* A pose, world from camera, with its time. */
typedef struct {
    int64_t timestamp_ns;
    double position_m[3];
    double quaternion[4]; /* x y z w */
} yfslam_pose;

/* The result of a frame. */
typedef struct {
    uint32_t struct_size;
    yfslam_state state;
    int32_t has_pose;
    int32_t has_covariance;
    int32_t is_keyframe;
    int32_t closed_loop; /* poses may have changed */
    uint64_t inliers;    /* matched landmarks that fit the pose */
    yfslam_pose pose;
    double matrix[16];   /* the pose as a 4 x 4 matrix */
    /* Covariance of the pose error d in matrix * exp(d), d = (translation in m, rotation in rad) along the axes of the camera. */
    double covariance[36];
} yfslam_tracked;
#define YFSLAM_TRACKED_INIT YFSLAM_SIZED(yfslam_tracked)

/* A coloured point. */
typedef struct {
    float position_m[3];
    uint8_t color[3]; /* red, green, blue */
    uint8_t reserved;
} yfslam_point;

/* A grid of the ground; cells are rows along x, that with the least y first. */
typedef struct {
    uint32_t struct_size;
    uint32_t width, height; /* cells */
    uint32_t reserved;
    double origin_m[2];     /* corner of the first cell with the least x and y */
    double resolution_m;
} yfslam_grid_info;
#define YFSLAM_GRID_INFO_INIT YFSLAM_SIZED(yfslam_grid_info)

typedef struct yfslam_slam yfslam_slam;
typedef struct yfslam_recording yfslam_recording;
typedef struct yfslam_trajectory yfslam_trajectory;
typedef struct yfslam_points yfslam_points;
typedef struct yfslam_grid yfslam_grid;

/* Returns YFSLAM_ABI_VERSION of the library. */
uint32_t yfslam_abi_version(void);
/* Returns the version of the library, such as "0.1.0". */
const char *yfslam_version(void);
/* Returns what was wrong with the last call on this thread that failed; it stays valid until the next one. */
const char *yfslam_last_error(void);

/* Loads a preset, such as "bonn" or "tum1", or a camera file of any common kind. */
yfslam_status yfslam_camera_load(const char *preset_or_file, yfslam_camera *camera);

/* Makes a system; `options` may be NULL. */
yfslam_status yfslam_create(const yfslam_camera *camera, const yfslam_options *options, yfslam_slam **slam);
/* Ends a system and its threads; NULL is allowed. */
void yfslam_destroy(yfslam_slam *slam);
/* Takes one frame through all stages; the images are copied. Lost is no error: see the state. */
yfslam_status yfslam_track(yfslam_slam *slam, const yfslam_frame *frame, yfslam_tracked *tracked);
/* Returns why the pose of the last frame is not known; "" while tracking. It stays valid until the next call on this thread. */
const char *yfslam_lost_reason(yfslam_slam *slam);
/* Waits until mapping is finished, so that trajectory and map are complete. */
yfslam_status yfslam_finish(yfslam_slam *slam);
/* Saves the map, with the dense map if there is one, for yfslam_options.map_file and the program `yfslam map`. */
yfslam_status yfslam_save_map(yfslam_slam *slam, const char *path);
/* Saves the trajectory in the format of TUM. */
yfslam_status yfslam_save_trajectory(yfslam_slam *slam, const char *path);

/* Copies the poses of all tracked frames, as the map has them now. */
yfslam_status yfslam_get_trajectory(yfslam_slam *slam, yfslam_trajectory **trajectory);
/* Returns the first pose, and their number; both 0 for NULL. */
const yfslam_pose *yfslam_trajectory_data(const yfslam_trajectory *trajectory);
size_t yfslam_trajectory_size(const yfslam_trajectory *trajectory);
void yfslam_trajectory_free(yfslam_trajectory *trajectory);

/* Copies the landmarks of the map. */
yfslam_status yfslam_get_landmarks(yfslam_slam *slam, yfslam_points **points);
/* Makes the cloud of the dense map, in a world whose z-axis points up. */
yfslam_status yfslam_get_cloud(yfslam_slam *slam, yfslam_points **points);
const yfslam_point *yfslam_points_data(const yfslam_points *points);
size_t yfslam_points_size(const yfslam_points *points);
void yfslam_points_free(yfslam_points *points);

/* Makes the grid of obstacles between two heights, m, of the dense map, for navigation. */
yfslam_status yfslam_get_grid(yfslam_slam *slam, float low_m, float high_m, yfslam_grid_info *info, yfslam_grid **grid);
/* Returns width * height cells. */
const uint8_t *yfslam_grid_data(const yfslam_grid *grid);
void yfslam_grid_free(yfslam_grid *grid);

/* Opens a folder or bag that `yfslam run` reads; `camera` is a preset or file, or NULL for the camera of the recording. */
yfslam_status yfslam_recording_open(const char *path, const char *camera, yfslam_recording **recording);
yfslam_status yfslam_recording_camera(yfslam_recording *recording, yfslam_camera *camera);
yfslam_sensor yfslam_recording_sensor(yfslam_recording *recording);
/* Returns the next frame, whose images stay valid until the next call with this recording, or YFSLAM_END. After YFSLAM_ERROR_FRAME,
 * for a frame that cannot be used, the recording goes on. */
yfslam_status yfslam_recording_next(yfslam_recording *recording, yfslam_frame *frame);
void yfslam_recording_close(yfslam_recording *recording);

#ifdef __cplusplus
}
#endif

#endif
