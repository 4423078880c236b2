"""What the tests share: a small synthetic world, and recordings where they are there."""

import os
import pathlib

import pytest

import yfslam

# Small and short, so that the tests take seconds.
SPEC = "synth:walking_xyz?seed=3&people=1&frames=24&width=320&height=240&shadows=off"


@pytest.fixture(scope="session")
def frames() -> list[yfslam.SynthFrame]:
    return list(yfslam.World(SPEC))


@pytest.fixture(scope="session")
def world() -> yfslam.World:
    return yfslam.World(SPEC)


@pytest.fixture(scope="session")
def data() -> pathlib.Path:
    """The folder of recordings, as for the tests in Rust; tests that need it are skipped without."""
    default = pathlib.Path(__file__).parents[3] / ".." / "shared" / "data"
    folder = pathlib.Path(os.environ.get("YFSLAM_DATA", default))
    if not (folder / "rgbd").is_dir():
        pytest.skip(f"no recordings in {folder}; set YFSLAM_DATA")
    return folder
