#!/usr/bin/env python3
"""Opens every product of `yfslam map` with software of others, and compares with what the command says of it.

    pip install open3d trimesh pypcd4 plyfile pillow pyyaml numpy     (and Debian's octomap-tools)
    yfslam run SEQUENCE --dense --out RUN
    python3 crates/yfslam-bench/peers/open_maps.py --yfslam target/release/yfslam RUN [--resolution 0.05]

Ends with an error at the first product that another reader sees otherwise. A reader that is not installed is named as skipped.
"""

import argparse
import importlib.metadata
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import numpy as np


def agree(what, ours, theirs, tolerance=0.0):
    """Ends the program unless both are the same."""
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    if ours.shape != theirs.shape or np.abs(ours - theirs).max(initial=0.0) > tolerance:
        sys.exit(f"{what}: yfslam says {ours}, the reader {theirs}")
    print(f"  {what}: {' '.join(f'{value:.6g}' for value in theirs.ravel())}")


def reader(name):
    """The module of that name, with the version of its package told; or None."""
    try:
        module = __import__(name)
    except ImportError:
        print(f"{name}: not installed, skipped")
        return None
    package = {"yaml": "PyYAML", "PIL": "pillow"}.get(name, name)
    print(f"{package} {importlib.metadata.version(package)}")
    return module


def said(text, pattern):
    """The numbers that the command has said."""
    found = re.search(pattern, text)
    if not found:
        sys.exit(f"yfslam map does not say '{pattern}':\n{text}")
    return [int(number) for number in found.groups()]


def extent(points):
    return np.concatenate([points.min(axis=0), points.max(axis=0)])


def clouds(folder, count):
    """PLY and PCD hold the same points, in every program that reads them."""
    extents, labels = {}, {}
    if o3d := reader("open3d"):
        for name in ["cloud.ply", "cloud.pcd"]:
            cloud = o3d.io.read_point_cloud(str(folder / name))
            agree(f"points of {name}", count, len(cloud.points))
            assert cloud.has_colors()
            extents[f"open3d {name}"] = extent(np.asarray(cloud.points))
            extents[f"colours of {name}"] = np.asarray(cloud.colors).mean(axis=0)
    if plyfile := reader("plyfile"):
        vertices = plyfile.PlyData.read(str(folder / "cloud.ply"))["vertex"]
        agree("points of cloud.ply", count, len(vertices))
        extents["plyfile"] = extent(np.stack([vertices["x"], vertices["y"], vertices["z"]], axis=1))
        if "class" in vertices.data.dtype.names:
            labels["plyfile"] = np.bincount(vertices["class"], minlength=1)
    if pypcd4 := reader("pypcd4"):
        cloud = pypcd4.PointCloud.from_path(str(folder / "cloud.pcd"))
        agree("points of cloud.pcd", count, cloud.points)
        extents["pypcd4"] = extent(cloud.numpy(("x", "y", "z")))
        if "label" in cloud.fields:
            labels["pypcd4"] = np.bincount(cloud.numpy(("label",)).ravel().astype(int), minlength=1)
    boxes = {name: values for name, values in extents.items() if len(values) == 6}
    first = next(iter(boxes.values()), None)
    for name, box in boxes.items():
        agree(f"extent, m, by {name}", first, box, 1e-5)
    if "open3d cloud.ply" in extents:
        agree("mean colour, PLY and PCD", extents["colours of cloud.ply"], extents["colours of cloud.pcd"], 1e-6)
    if len(labels) == 2:
        agree("points of each class, PLY and PCD", *(found[found > 0] for found in labels.values()))
    return first


def meshes(folder, vertices, triangles):
    if trimesh := reader("trimesh"):
        mesh = trimesh.load(str(folder / "mesh.ply"), process=False)
        agree("vertices and triangles by trimesh", [vertices, triangles], [len(mesh.vertices), len(mesh.faces)])
    if o3d := reader("open3d"):
        mesh = o3d.io.read_triangle_mesh(str(folder / "mesh.ply"))
        found = [len(mesh.vertices), len(mesh.triangles)]
        agree("vertices and triangles by open3d", [vertices, triangles], found)
        assert mesh.has_vertex_colors()


def octrees(folder, nodes):
    """OctoMap's own tools make of one tree what we made, and read the others."""
    if not shutil.which("convert_octree"):
        print("octomap-tools: not installed, skipped")
        return
    print("octomap-tools")
    for name, count in nodes.items():
        with tempfile.TemporaryDirectory() as place:
            theirs = pathlib.Path(place) / "theirs.ot"
            done = subprocess.run(["convert_octree", folder / name, theirs], capture_output=True, text=True)
            if done.returncode:
                sys.exit(f"convert_octree {name}: {done.stdout}{done.stderr}")
            size = re.search(rb"\nsize (\d+)", theirs.read_bytes()[:400])
            agree(f"nodes of {name}", count, int(size.group(1)))


def grid(folder, width, height, occupied, free):
    """As nav2_map_server documents it: occupancy is (255 - shade) / 255, or shade / 255 if negated; trinary by two thresholds; the first
    row is the farthest; the origin is the lower left corner with its yaw."""
    yaml, image = reader("yaml"), reader("PIL")
    if not yaml or not image:
        return
    from PIL import Image

    about = yaml.safe_load((folder / "grid.yaml").read_text())
    assert about["mode"] == "trinary" and about["negate"] in (0, False) and len(about["origin"]) == 3, about
    shades = np.asarray(Image.open(folder / about["image"]).convert("L"), float)
    share = shades / 255 if about["negate"] else (255 - shades) / 255
    stands, is_free = share > about["occupied_thresh"], share < about["free_thresh"]
    found = [shades.shape[1], shades.shape[0], stands.sum(), is_free.sum()]
    agree("cells along x, along y, occupied, free", [width, height, occupied, free], found)
    return about, stands


def on_grid(about, occupied, cloud_extent):
    """What stands in the grid lies within the cloud, cell by cell of tolerance."""
    rows, columns = np.nonzero(occupied)
    step, (x, y, yaw) = about["resolution"], about["origin"]
    assert yaw == 0.0
    left, right = x + columns.min() * step, x + (columns.max() + 1) * step
    low, high = y + (occupied.shape[0] - 1 - rows.max()) * step, y + (occupied.shape[0] - rows.min()) * step
    box = np.array([cloud_extent[0] - left, cloud_extent[1] - low, right - cloud_extent[3], high - cloud_extent[4]])
    print(f"  obstacles span x {left:.2f} to {right:.2f} m, y {low:.2f} to {high:.2f} m")
    if (box > 2 * step).any():
        sys.exit(f"obstacles lie outside the cloud {cloud_extent} by {box} m")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="output folder of a run with --dense, or its map")
    parser.add_argument("--yfslam", default="yfslam", help="the program")
    parser.add_argument("--resolution", default="0.05", help="side of a voxel, m")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        command = [arguments.yfslam, "map", arguments.run, "--resolution", arguments.resolution, "--out", place]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        print(text)
        (count,) = said(text, r"cloud: (\d+) points")
        cloud_extent = clouds(folder, count)
        meshes(folder, *said(text, r"mesh: (\d+) vertices, (\d+) triangles"))
        nodes = dict(zip(["octomap.bt", "octomap.ot"], said(text, r"octomap: (\d+) nodes in octomap.bt, (\d+)")))
        if (folder / "semantic.ot").exists():
            (nodes["semantic.ot"],) = said(text, r", (\d+) in semantic.ot")
            legend = json.loads((folder / "classes.json").read_text())
            (all_occupied,) = said(text, r"occupancy: (\d+) voxels")
            named = sum(entry["voxels"] for entry in legend["classes"]) + legend["unknown"]
            agree("voxels in the legend of classes", all_occupied, named)
        octrees(folder, nodes)
        found = grid(folder, *said(text, r"grid: (\d+) × (\d+) cells, (\d+) occupied, (\d+) free"))
        if found and cloud_extent is not None:
            on_grid(*found, cloud_extent)
    print("all agree")


if __name__ == "__main__":
    main()
