/* Tracks a recording and saves its trajectory: track_recording FOLDER_OR_BAG [CAMERA [TRAJECTORY.txt]] */
#include <stdio.h>
#include <yfslam.h>

static int fail(const char *what) {
    fprintf(stderr, "%s: %s\n", what, yfslam_last_error());
    return 1;
}

int main(int argc, char **argv) {
    if (argc < 2) {
        fprintf(stderr, "usage: %s FOLDER_OR_BAG [CAMERA [TRAJECTORY.txt]]\n", argv[0]);
        return 2;
    }
    const char *preset = argc > 2 ? argv[2] : NULL;
    const char *file = argc > 3 ? argv[3] : "trajectory.txt";

    yfslam_recording *recording = NULL;
    yfslam_slam *slam = NULL;
    yfslam_camera camera = YFSLAM_CAMERA_INIT;
    yfslam_options options = YFSLAM_OPTIONS_INIT;
    int code = 0;

    if (yfslam_recording_open(argv[1], preset, &recording) != YFSLAM_OK) return fail(argv[1]);
    options.sensor = yfslam_recording_sensor(recording);
    if (yfslam_recording_camera(recording, &camera) != YFSLAM_OK || yfslam_create(&camera, &options, &slam) != YFSLAM_OK) {
        code = fail("the system cannot be created");
    }

    size_t tracked_frames = 0, skipped = 0;
    yfslam_state state = YFSLAM_NOT_INITIALISED;
    while (code == 0) {
        yfslam_frame frame = YFSLAM_FRAME_INIT;
        yfslam_tracked tracked = YFSLAM_TRACKED_INIT;
        yfslam_status status = yfslam_recording_next(recording, &frame);
        if (status == YFSLAM_END) break;
        /* A frame that cannot be read or used is left out; the next one may be good. */
        if (status == YFSLAM_OK) status = yfslam_track(slam, &frame, &tracked);
        if (status != YFSLAM_OK) {
            fprintf(stderr, "skipped: %s\n", yfslam_last_error());
            ++skipped;
            continue;
        }
        tracked_frames += tracked.has_pose ? 1 : 0;
        if (tracked.state != state) {
            printf("%lld ns: %s %s\n", (long long)tracked.pose.timestamp_ns,
                   tracked.state == YFSLAM_TRACKING ? "tracking" : "lost", yfslam_lost_reason(slam));
            state = tracked.state;
        }
    }
    if (code == 0 && yfslam_finish(slam) != YFSLAM_OK) code = fail("finish");
    if (code == 0 && yfslam_save_trajectory(slam, file) != YFSLAM_OK) code = fail(file);
    if (code == 0) printf("%zu frames tracked, %zu skipped; written to %s\n", tracked_frames, skipped, file);

    yfslam_destroy(slam);
    yfslam_recording_close(recording);
    return code;
}
