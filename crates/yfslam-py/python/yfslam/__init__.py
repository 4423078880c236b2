"""Visual SLAM for places where people move.

Give it the images of an RGB-D, stereo or single camera, and it returns the trajectory of the camera and a map without the people who
walked through it::

    import yfslam

    recording = yfslam.open("rgbd_bonn_crowd", camera="bonn")
    slam = yfslam.Slam(recording.camera)
    for frame in recording:
        tracked = slam.track(frame)          # or slam.track(timestamp_ns, rgb, depth) with numpy arrays
    slam.finish().save("trajectory.txt")

Conventions: the camera has x to the right, y down and z forward; poses are 4 x 4 matrices that map points of the camera into the world,
which is the first camera of the map; lengths are metres, times are integer nanoseconds. Messages go to the logger ``yfslam``.
"""

from ._results import Alignment, Cloud, Evaluation, Features, Grid, Keyframes, Landmarks, Mesh, Statistics
from ._yfslam import (
    Camera,
    DenseMap,
    Error,
    Frame,
    FrameRejected,
    Recording,
    RecordingIterator,
    SavedMap,
    Slam,
    SynthFrame,
    Tracked,
    Trajectory,
    World,
    WorldIterator,
    __version__,
    align,
    default_config_toml,
    evaluate,
    load_dense_map,
    load_map,
    load_trajectory,
    open,
    presets,
    worlds,
)

__all__ = [
    "Alignment",
    "Camera",
    "Cloud",
    "DenseMap",
    "Error",
    "Evaluation",
    "Features",
    "Frame",
    "FrameRejected",
    "Grid",
    "Keyframes",
    "Landmarks",
    "Mesh",
    "Recording",
    "RecordingIterator",
    "SavedMap",
    "Slam",
    "Statistics",
    "SynthFrame",
    "Tracked",
    "Trajectory",
    "World",
    "WorldIterator",
    "__version__",
    "align",
    "default_config_toml",
    "evaluate",
    "load_dense_map",
    "load_map",
    "load_trajectory",
    "open",
    "presets",
    "worlds",
]
