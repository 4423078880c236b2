"""Maps: arrays, saving, loading, localisation, dense products."""

import numpy as np
import pytest

import yfslam


@pytest.fixture(scope="module")
def mapped(world, frames):
    slam = yfslam.Slam(world.camera, dense=True)
    for frame in frames:
        slam.track(frame.frame)
    slam.finish()
    return slam


def test_landmarks_and_keyframes_are_arrays(mapped):
    landmarks, keyframes = mapped.landmarks(), mapped.keyframes()
    count = len(landmarks.positions)
    assert count > 200 and landmarks.positions.shape == (count, 3) and landmarks.colors.shape == (count, 3)
    assert landmarks.observations.min() >= 1
    assert keyframes.poses.shape == (len(keyframes.timestamps_ns), 4, 4)
    assert (np.diff(keyframes.timestamps_ns) > 0).all()
    assert mapped.statistics["keyframes"] == len(keyframes.timestamps_ns)
    assert keyframes.covisible.shape[1] == 3 and keyframes.loops.shape[1] == 2
    if len(keyframes.covisible):
        assert keyframes.covisible[:, :2].max() < len(keyframes.timestamps_ns)


def test_a_saved_map_is_localised_in(tmp_path, mapped, world, frames):
    path = tmp_path / "room.map"
    mapped.save_map(path)
    saved = yfslam.load_map(path)
    assert (saved.landmarks().positions == mapped.landmarks().positions).all()
    for source in (path, mapped.map_bytes()):
        slam = yfslam.Slam(world.camera, map=source, localise=True)
        assert slam.state == "lost"
        assert any(slam.track(frame.frame) for frame in frames[3:8])
        assert len(slam.landmarks().positions) == len(saved.landmarks().positions)
    with pytest.raises(yfslam.Error, match="needs a map"):
        yfslam.Slam(world.camera, localise=True)
    path.write_bytes(b"nonsense")
    with pytest.raises(yfslam.Error, match="room.map"):
        yfslam.Slam(world.camera, map=path)
    with pytest.raises(yfslam.Error, match="nowhere"):
        yfslam.load_map("/nowhere.map")


def test_dense_products_are_arrays(tmp_path, mapped):
    dense = mapped.dense_map()
    cloud, mesh, grid = dense.cloud(), dense.mesh(), dense.grid(-1.0, 1.0)
    assert len(cloud.positions) > 500 and cloud.positions.shape == cloud.colors.shape
    assert mesh.triangles.max() < len(mesh.vertices) and len(mesh.vertices) == len(mesh.colors)
    assert set(np.unique(grid.cells)) <= {-1, 0, 100} and (grid.cells == 100).any() and (grid.cells == 0).any()
    assert abs(grid.resolution_m - 0.05) < 1e-9 and grid.origin_m.shape == (2,)
    assert len(dense.cloud(resolution_m=0.1).positions) < len(cloud.positions)
    with pytest.raises(yfslam.Error, match="resolution"):
        dense.cloud(resolution_m=-1.0)
    with pytest.raises(yfslam.Error, match="do not ascend"):
        dense.grid(1.0, 0.0)
    path = tmp_path / "dense.map"
    dense.save(path)
    again = yfslam.load_dense_map(path)
    assert again.cloud().positions.tobytes() == cloud.positions.tobytes()
    rotation = yfslam.load_dense_map(path, up="camera").rotation
    assert np.allclose(rotation, [[0, 0, 1], [-1, 0, 0], [0, -1, 0]])


def test_without_a_dense_map_an_error_says_what_to_do(world):
    with pytest.raises(yfslam.Error, match="dense=True"):
        yfslam.Slam(world.camera).dense_map()
