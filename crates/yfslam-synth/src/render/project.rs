//! Triangle set-up: converts world vertices to planes over the image that give the inside test and the depth for any ray.
//!
//! In: a mesh and a camera pose. Out: one [`Projected`] per visible triangle. With the vertices v0, v1, v2 in camera coordinates
//! and the ray d = (x, y, 1), d lies inside if d·(vⱼ × vₖ) has one sign for all three edges, and 1/z is the sum of these terms over
//! det(v0, v1, v2): Olano and Greer, "Triangle scan conversion using 2D homogeneous coordinates", Graphics Hardware 1997, sections
//! 3 and 4. Nothing is clipped and lines need not be straight in the image, so that lens distortion costs nothing and is exact.

use nalgebra::{Isometry3, Point3, Vector3};

use super::rays::Rect;
use crate::mesh::Mesh;

/// A triangle for the rasteriser. Planes are `[a, b, c]` for a·x + b·y + c at the ray (x, y, 1).
#[derive(Clone, Copy, Debug)]
pub struct Projected {
    /// The three edges; all at least 0 inside. Edge i belongs to the barycentric coordinate of vertex i.
    pub edges: [[f32; 3]; 3],
    /// Converts an edge value to (barycentric coordinate / z).
    pub edge_scale: f32,
    /// Inverse depth 1/z.
    pub inverse_depth: [f32; 3],
    /// Range in normalised coordinates; infinite if the triangle reaches behind the camera.
    pub bounds: Rect,
    /// Index of the mesh, then of its triangle.
    pub mesh: u8,
    /// Index of the triangle in its mesh.
    pub triangle: u32,
}

/// Nearest depth that is drawn, m.
pub const NEAR_M: f64 = 0.05;

/// Appends the visible triangles of `mesh` (the mesh numbered `mesh_index`) to `out`.
pub fn project(mesh: &Mesh, mesh_index: u8, t_cam_world: &Isometry3<f64>, view: &Rect, out: &mut Vec<Projected>) {
    let vertices: Vec<Vector3<f64>> =
        mesh.vertices.iter().map(|v| (t_cam_world * Point3::from(v.position.cast::<f64>())).coords).collect();
    for (index, triangle) in (0u32..).zip(&mesh.triangles) {
        out.extend(project_triangle(&triangle.vertices.map(|i| vertices[i as usize]), mesh_index, index, view));
    }
}

/// Projects the triangle with corners `v` in camera coordinates, or returns `None` if it is invisible in `view`.
pub fn project_triangle(v: &[Vector3<f64>; 3], mesh: u8, triangle: u32, view: &Rect) -> Option<Projected> {
    let crosses = [v[1].cross(&v[2]), v[2].cross(&v[0]), v[0].cross(&v[1])];
    let det = v[0].dot(&crosses[0]);
    // A triangle faces away (or is edge-on) exactly if the determinant is not negative.
    if det >= 0.0 || v.iter().all(|p| p.z < NEAR_M) {
        return None;
    }
    let bounds = bounds(v);
    if !bounds.overlaps(view) {
        return None;
    }
    let normal = (v[1] - v[0]).cross(&(v[2] - v[0]));
    // Edges stay unscaled: two triangles that share an edge have exactly opposite values, and no ray passes between them.
    Some(Projected {
        edges: crosses.map(|c| [-c.x as f32, -c.y as f32, -c.z as f32]),
        edge_scale: (-1.0 / det) as f32,
        inverse_depth: (normal / det).cast::<f32>().into(),
        bounds,
        mesh,
        triangle,
    })
}

/// Returns the range of the triangle with corners `v` in camera coordinates.
fn bounds(v: &[Vector3<f64>; 3]) -> Rect {
    if v.iter().any(|p| p.z < NEAR_M) {
        return Rect::EVERYTHING;
    }
    let [x, y] = [v.map(|p| (p.x / p.z) as f32), v.map(|p| (p.y / p.z) as f32)];
    let range = |a: [f32; 3]| [a[0].min(a[1]).min(a[2]), a[0].max(a[1]).max(a[2])];
    Rect { x: range(x), y: range(y) }
}
