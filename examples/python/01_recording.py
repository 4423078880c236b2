"""Track a recording: 01_recording.py [FOLDER_OR_BAG [CAMERA]]. Without arguments, a synthetic world."""

import sys

import yfslam


def main() -> None:
    path = sys.argv[1] if len(sys.argv) > 1 else "synth:walking_xyz?frames=60"
    camera = sys.argv[2] if len(sys.argv) > 2 else None
    recording = yfslam.open(path, camera=camera)
    slam = yfslam.Slam(recording.camera, sensor=recording.sensor)
    for frame in recording:
        tracked = slam.track(frame)
        if not tracked:
            print(f"{tracked.timestamp_ns} ns: {tracked.reason}")
    trajectory = slam.finish()
    trajectory.save("trajectory.txt")
    truth = recording.truth()
    if truth is not None:
        errors = yfslam.evaluate(truth, trajectory)
        print(f"{len(trajectory)} poses, error {1e3 * errors.ate_m.rmse:.1f} mm (RMSE)")


if __name__ == "__main__":
    main()
