"""What other packages get."""

import numpy as np
import pytest

import yfslam


def test_evo_computes_the_same_errors(world, frames):
    pytest.importorskip("evo", reason="pip install evo")
    from evo.core import metrics, sync

    import yfslam.evo

    slam = yfslam.Slam(world.camera)
    for frame in frames:
        slam.track(frame.frame)
    found, truth = slam.finish(), world.truth()
    ours = yfslam.evaluate(truth, found)
    reference, estimate = sync.associate_trajectories(yfslam.evo.trajectory(truth), yfslam.evo.trajectory(found), max_diff=0.02)
    estimate.align(reference)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((reference, estimate))
    assert ours.ate_m.rmse == pytest.approx(error.get_statistic(metrics.StatisticsType.rmse), rel=1e-6)


def test_open3d_gets_clouds_and_meshes(world, frames):
    pytest.importorskip("open3d", reason="pip install open3d")
    import yfslam.open3d

    slam = yfslam.Slam(world.camera, dense=True)
    for frame in frames[:6]:
        slam.track(frame.frame)
    dense = slam.dense_map()
    cloud, mesh = dense.cloud(), dense.mesh()
    assert np.allclose(np.asarray(yfslam.open3d.point_cloud(cloud).points), cloud.positions)
    made = yfslam.open3d.triangle_mesh(mesh)
    assert len(made.triangles) == len(mesh.triangles) and made.has_vertex_normals()


@pytest.mark.parametrize("extra", ["open3d", "rerun", "evo", "pyrealsense2"])
def test_without_a_package_an_error_names_the_extra(monkeypatch, world, extra):
    import sys

    import yfslam.evo
    import yfslam.live
    import yfslam.open3d
    import yfslam.rerun

    calls = {
        "open3d": lambda: yfslam.open3d._sdk(),
        "rerun": lambda: yfslam.rerun.Log(world.camera),
        "evo": lambda: yfslam.evo.trajectory(world.truth()),
        "pyrealsense2": lambda: yfslam.live.RealSense(),
    }
    for name in [name for name in sys.modules if name == extra or name.startswith(extra + ".")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, extra, None)
    with pytest.raises(yfslam.Error, match="pip install"):
        calls[extra]()
