"""Clouds and meshes for Open3D: ``pip install 'yfslam[open3d]'``."""

from __future__ import annotations

from typing import Any, Union

import numpy as np

import yfslam


def _sdk() -> Any:
    try:
        import open3d
    except ImportError as error:
        raise yfslam.Error("open3d is not installed; install it with: pip install 'yfslam[open3d]'") from error
    return open3d


def point_cloud(of: Union[yfslam.Cloud, yfslam.Landmarks]) -> Any:
    """Return an ``open3d.geometry.PointCloud`` of a cloud or of landmarks."""
    o3d = _sdk()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(of.positions.astype(np.float64)))
    cloud.colors = o3d.utility.Vector3dVector(of.colors / 255.0)
    return cloud


def triangle_mesh(of: yfslam.Mesh) -> Any:
    """Return an ``open3d.geometry.TriangleMesh`` of a mesh, with normals."""
    o3d = _sdk()
    vertices = o3d.utility.Vector3dVector(of.vertices.astype(np.float64))
    mesh = o3d.geometry.TriangleMesh(vertices, o3d.utility.Vector3iVector(of.triangles.astype(np.int32)))
    mesh.vertex_colors = o3d.utility.Vector3dVector(of.colors / 255.0)
    mesh.compute_vertex_normals()
    return mesh
