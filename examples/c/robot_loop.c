/* The loop of a robot without ROS: track, keep a map of obstacles, and slow down before them: robot_loop FOLDER_OR_BAG [CAMERA]
 * A recording stands for the camera; what comes from your driver goes into yfslam_frame in its place. */
#include <math.h>
#include <stdio.h>
#include <yfslam.h>

/* Obstacles between these heights above and below the first camera stop the robot, m. */
#define LOW_M -0.5f
#define HIGH_M 0.5f
/* The way ahead that must be free, m. */
#define AHEAD_M 1.0
#define FRAMES_PER_GRID 60

/* Returns the free way ahead, m: along the optical axis, in the world of the grid, whose z-axis points up. */
static double free_way(const yfslam_grid_info *info, const uint8_t *cells, const double matrix[16]) {
    /* In the world of the map the first camera looks along z with y down; in that of the grid it looks along x with z up. */
    const double x = matrix[11], y = -matrix[3];
    double dx = matrix[10], dy = -matrix[2];
    const double length = sqrt(dx * dx + dy * dy);
    if (length < 1e-6) return AHEAD_M;
    dx /= length;
    dy /= length;
    for (double way = 0.2; way < AHEAD_M; way += info->resolution_m) {
        const double column = floor((x + way * dx - info->origin_m[0]) / info->resolution_m);
        const double row = floor((y + way * dy - info->origin_m[1]) / info->resolution_m);
        if (column < 0 || row < 0 || column >= info->width || row >= info->height) continue;
        if (cells[(size_t)row * info->width + (size_t)column] == YFSLAM_CELL_OCCUPIED) return way;
    }
    return AHEAD_M;
}

int main(int argc, char **argv) {
    if (argc < 2) {
        fprintf(stderr, "usage: %s FOLDER_OR_BAG [CAMERA]\n", argv[0]);
        return 2;
    }
    yfslam_recording *driver = NULL;
    yfslam_slam *slam = NULL;
    yfslam_camera camera = YFSLAM_CAMERA_INIT;
    yfslam_options options = YFSLAM_OPTIONS_INIT;
    options.threaded = 1; /* mapping runs beside tracking */
    options.dense = 1;
    if (yfslam_recording_open(argv[1], argc > 2 ? argv[2] : NULL, &driver) != YFSLAM_OK ||
        yfslam_recording_camera(driver, &camera) != YFSLAM_OK || yfslam_create(&camera, &options, &slam) != YFSLAM_OK) {
        fprintf(stderr, "%s\n", yfslam_last_error());
        yfslam_recording_close(driver);
        return 1;
    }
    double way = 0.0;
    for (size_t count = 0;; ++count) {
        yfslam_frame frame = YFSLAM_FRAME_INIT;
        yfslam_tracked tracked = YFSLAM_TRACKED_INIT;
        const yfslam_status status = yfslam_recording_next(driver, &frame);
        if (status == YFSLAM_END) break;
        if (status != YFSLAM_OK || yfslam_track(slam, &frame, &tracked) != YFSLAM_OK) {
            fprintf(stderr, "skipped: %s\n", yfslam_last_error());
            continue;
        }
        if (!tracked.has_pose) {
            way = 0.0; /* a robot that does not know where it is stands still */
        } else if (count % FRAMES_PER_GRID == FRAMES_PER_GRID - 1) {
            yfslam_grid_info info = YFSLAM_GRID_INFO_INIT;
            yfslam_grid *grid = NULL;
            if (yfslam_get_grid(slam, LOW_M, HIGH_M, &info, &grid) == YFSLAM_OK) {
                way = free_way(&info, yfslam_grid_data(grid), tracked.matrix);
                printf("frame %zu: at %.2f %.2f %.2f m, grid %u x %u, free way %.2f m, speed %.2f m/s\n", count,
                       tracked.pose.position_m[0], tracked.pose.position_m[1], tracked.pose.position_m[2], info.width,
                       info.height, way, 0.3 * way / AHEAD_M);
                yfslam_grid_free(grid);
            }
        }
    }
    yfslam_destroy(slam);
    yfslam_recording_close(driver);
    return 0;
}
