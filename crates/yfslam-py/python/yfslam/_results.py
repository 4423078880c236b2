"""Results as named tuples of arrays."""

from __future__ import annotations

from typing import NamedTuple, Optional

import numpy as np
from numpy.typing import NDArray


class Landmarks(NamedTuple):
    """The landmarks of a map; row i of each array belongs to landmark i."""

    positions: NDArray[np.float64]
    """N x 3, in the world, m."""
    colors: NDArray[np.uint8]
    """N x 3, red, green, blue."""
    observations: NDArray[np.uint32]
    """N, the number of keyframes that observe each."""


class Keyframes(NamedTuple):
    """The keyframes of a map, in the order of their insertion."""

    timestamps_ns: NDArray[np.int64]
    poses: NDArray[np.float64]
    """N x 4 x 4, world from camera."""
    covisible: NDArray[np.int64]
    """M x 3: two keyframes, by their indices, and the number of landmarks that both observe."""
    loops: NDArray[np.int64]
    """K x 2: two keyframes between which a loop was closed."""


class Features(NamedTuple):
    """The features of a frame."""

    pixels: NDArray[np.float32]
    """N x 2, column and row in the image as the camera delivers it."""
    depth_m: NDArray[np.float32]
    """N, NaN where nothing was measured."""
    trust: NDArray[np.float32]
    """N, the probability that the feature is static; with 0 it is not used."""
    matched: NDArray[np.bool_]
    """N, whether the feature is matched to a landmark."""


class Cloud(NamedTuple):
    """A coloured point for each occupied voxel; the z-axis points up."""

    positions: NDArray[np.float32]
    """N x 3, m."""
    colors: NDArray[np.uint8]
    """N x 3, red, green, blue."""


class Grid(NamedTuple):
    """A grid of the ground for navigation; row y, column x."""

    cells: NDArray[np.int8]
    """H x W: 0 free, 100 occupied, -1 unknown, as in ``nav_msgs/OccupancyGrid``; the row with the least y first."""
    origin_m: NDArray[np.float64]
    """x and y of the corner of the first cell."""
    resolution_m: float


class Mesh(NamedTuple):
    """Triangles of the surfaces; the z-axis points up."""

    vertices: NDArray[np.float32]
    """N x 3, m."""
    colors: NDArray[np.uint8]
    """N x 3, red, green, blue."""
    triangles: NDArray[np.uint32]
    """M x 3, indices of vertices, counter-clockwise from the free side."""


class Statistics(NamedTuple):
    """Statistics of errors."""

    samples: int
    rmse: float
    mean: float
    median: float
    std: float
    min: float
    max: float


class Alignment(NamedTuple):
    """What brings an estimate onto the reference."""

    matrix: NDArray[np.float64]
    """4 x 4: scale times rotation, and translation."""
    scale: float
    """1 except for ``sim3``."""


class Evaluation(NamedTuple):
    """The errors of an estimated trajectory."""

    ate_m: Statistics
    """Absolute trajectory error after the alignment."""
    alignment: Alignment
    scale: Optional[float]
    """Scale of the Sim(3) alignment, whichever alignment was asked for."""
    rpe_frame: Optional[tuple[Statistics, Statistics]]
    """Relative pose error per frame: translation in m, rotation in degrees."""
    rpe_second: Optional[tuple[Statistics, Statistics]]
    """The same per second; None for trajectories that are too short."""
    matches: int
    """Pairs of poses that were compared."""
    tracked_fraction: Optional[float]
    """Share of the expected frames with an estimated pose; None without expected frames."""
