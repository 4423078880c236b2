// Tracks a recording and saves its trajectory: track_recording FOLDER_OR_BAG [CAMERA [TRAJECTORY.txt]]
#include <iostream>
#include <yfslam.hpp>

int main(int argc, char **argv) try {
    if (argc < 2) {
        std::cerr << "usage: " << argv[0] << " FOLDER_OR_BAG [CAMERA [TRAJECTORY.txt]]\n";
        return 2;
    }
    yfslam::Recording recording(argv[1], argc > 2 ? argv[2] : "");
    yfslam::Options options;
    options.sensor = recording.sensor();
    yfslam::Slam slam(recording.camera(), options);
    std::size_t tracked = 0;
    for (const yfslam::Frame &frame : recording) {
        if (slam.track(frame)) ++tracked;
    }
    slam.finish();
    slam.save_trajectory(argc > 3 ? argv[3] : "trajectory.txt");
    std::cout << tracked << " frames tracked, " << slam.landmarks().size() << " landmarks\n";
    return 0;
} catch (const yfslam::Error &error) {
    std::cerr << error.what() << '\n';
    return 1;
}
