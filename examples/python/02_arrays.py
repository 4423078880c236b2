"""Frames from numpy arrays, such as a driver of a camera delivers them, and a detector of your own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import yfslam


def detector(image: NDArray[np.uint8]) -> list[list[float]]:
    """Find people in an image: rows of x_min, y_min, x_max, y_max (px) and a score. Your network goes here."""
    height, width, _ = image.shape
    return [[0.4 * width, 0.0, 0.6 * width, float(height), 0.3]]


def main() -> None:
    camera = yfslam.Camera(640, 480, 525.0, 525.0, 319.5, 239.5, depth_scale=0.001)
    slam = yfslam.Slam(camera, detector=detector)
    random = np.random.default_rng(1)
    wall = random.integers(30, 200, (60, 90), dtype=np.uint8).repeat(12, axis=0).repeat(12, axis=1)
    for index in range(10):
        # The camera moves along a wall that is 2 m away: 4 px a frame are 4 / 525 * 2 m.
        gray = wall[100 : 100 + 480, 100 + 4 * index : 100 + 4 * index + 640]
        depth = np.full((480, 640), 2000, np.uint16)
        tracked = slam.track(33_000_000 * index, gray, depth)
        if tracked.pose is not None:
            print(f"{tracked.state}: x = {tracked.pose[0, 3]:.3f} m, expected {4 * index / 525 * 2:.3f} m")


if __name__ == "__main__":
    main()
