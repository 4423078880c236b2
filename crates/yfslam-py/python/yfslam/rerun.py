"""Shows what the system does in the Rerun viewer: ``pip install 'yfslam[rerun]'``.

::

    log = yfslam.rerun.Log(recording.camera)             # opens the viewer; save="run.rrd" writes a file in its place
    for frame in recording:
        log.frame(slam, frame, slam.track(frame))
    log.map(slam)

The world of Rerun is that of the trajectory: x to the right, y down, z forward in the first image.
"""

from __future__ import annotations

from typing import Any, Optional

import numpy as np

import yfslam


def _sdk() -> Any:
    try:
        import rerun
    except ImportError as error:
        raise yfslam.Error("rerun-sdk is not installed; install it with: pip install 'yfslam[rerun]'") from error
    return rerun


class Log:
    """Logs frames and maps to Rerun."""

    def __init__(
        self,
        camera: yfslam.Camera,
        *,
        application: str = "yfslam",
        spawn: bool = True,
        save: Optional[str] = None,
        map_every: int = 30,
    ) -> None:
        """Open the viewer, or write to the file `save`; landmarks are logged with every `map_every`-th frame."""
        rr = self._rr = _sdk()
        import rerun.blueprint as rrb

        self._recording = rr.RecordingStream(application)
        if save is not None:
            self._recording.save(save)
        elif spawn:
            self._recording.spawn()
        self._camera = camera
        self._map_every = map_every
        self._frames = 0
        self._path: list[Any] = []
        view = rrb.Spatial3DView(origin="world", name="Map")
        images = rrb.Vertical(
            rrb.Spatial2DView(origin="world/camera/image", name="Camera"),
            rrb.TimeSeriesView(origin="plots", name="Inliers and time"),
        )
        self._recording.send_blueprint(rrb.Blueprint(rrb.Horizontal(view, images, column_shares=[3, 2])))
        self._log("world", rr.ViewCoordinates.RIGHT_HAND_Y_DOWN, static=True)
        pinhole = rr.Pinhole(image_from_camera=camera.matrix, resolution=[camera.width, camera.height])
        self._log("world/camera/image", pinhole, static=True)

    def _log(self, entity: str, value: Any, *, static: bool = False) -> None:
        self._recording.log(entity, value, static=static)

    def frame(self, slam: yfslam.Slam, frame: yfslam.Frame, tracked: yfslam.Tracked) -> None:
        """Log a frame after it was tracked: image, features by trust, what moves, camera, path."""
        rr = self._rr
        self._recording.set_time("time", timestamp=frame.timestamp_ns * 1e-9)
        self._log("world/camera/image", rr.Image(frame.rgb).compress(jpeg_quality=80))
        features = slam.features()
        trust = features.trust[:, None]
        # Green is static, red is dynamic; what is not matched to the map is darker.
        colors = (trust * np.array([0, 220, 60]) + (1 - trust) * np.array([230, 40, 40])).astype(np.uint8)
        colors[~features.matched] //= 2
        self._log("world/camera/image/features", rr.Points2D(features.pixels, colors=colors, radii=1.5))
        boxes = slam.moving_regions()[:, :4]
        self._log("world/camera/image/moving", rr.Boxes2D(array=boxes, array_format=rr.Box2DFormat.XYXY, colors=[230, 40, 40]))
        self._log("plots/inliers", rr.Scalars(tracked.inliers))
        self._log("plots/time_ms", rr.Scalars(sum(tracked.times_ms.values())))
        if tracked.reason is not None:
            self._log("log", rr.TextLog(f"{tracked.state}: {tracked.reason}", level="WARN"))
        pose = tracked.pose
        if pose is not None:
            self._log("world/camera", rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
            self._path.append(pose[:3, 3])
            self._log("world/path", rr.LineStrips3D([np.array(self._path)], colors=[255, 200, 0]))
        if self._frames % self._map_every == 0:
            self.map(slam)
        self._frames += 1

    def map(self, slam: yfslam.Slam) -> None:
        """Log landmarks, keyframes and their graph."""
        rr = self._rr
        landmarks, keyframes = slam.landmarks(), slam.keyframes()
        self._log("world/landmarks", rr.Points3D(landmarks.positions, colors=landmarks.colors, radii=0.008))
        positions = keyframes.poses[:, :3, 3]
        self._log("world/keyframes", rr.Points3D(positions, colors=[80, 140, 255], radii=0.02))
        self._log("world/graph", rr.LineStrips3D(positions[keyframes.covisible[:, :2]], colors=[80, 140, 255, 60]))
        self._log("world/loops", rr.LineStrips3D(positions[keyframes.loops], colors=[255, 80, 200]))

    def dense(self, slam: yfslam.Slam) -> None:
        """Log the cloud of the dense map, turned back into the world of the trajectory."""
        dense = slam.dense_map()
        cloud = dense.cloud()
        # Rows times the rotation are columns times its inverse.
        self._log("world/cloud", self._rr.Points3D(cloud.positions @ dense.rotation, colors=cloud.colors, radii=0.02))
