"""Trajectories for ``evo``: ``pip install 'yfslam[evo]'``."""

from __future__ import annotations

from typing import Any

import yfslam


def trajectory(of: yfslam.Trajectory) -> Any:
    """Return an ``evo.core.trajectory.PoseTrajectory3D`` with the same poses."""
    try:
        from evo.core.trajectory import PoseTrajectory3D
    except ImportError as error:
        raise yfslam.Error("evo is not installed; install it with: pip install 'yfslam[evo]'") from error
    return PoseTrajectory3D(poses_se3=list(of.poses), timestamps=of.timestamps_ns * 1e-9)
