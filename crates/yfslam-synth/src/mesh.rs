//! Triangle meshes made of curved or flat grids ("patches"), each with its own texture over [0, 1]².
//!
//! In: functions that map (u, v) to a surface. Out: vertices, triangles and patches for the rasteriser. The top left of a texture
//! is (0, 0); seen from outside, u runs to the right and v down.

use nalgebra::{Isometry3, Vector3};

/// Three-dimensional vector in metres (or a direction), single precision.
pub type Vec3 = Vector3<f32>;

/// A corner of triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Position, m.
    pub position: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// Texture coordinates in [0, 1]².
    pub uv: [f32; 2],
    /// Irradiance (linear RGB), used where the patch has [`Lighting::Vertex`].
    pub light: [f32; 3],
}

/// Three vertices, counter-clockwise seen from outside, and the patch they belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Indices of the vertices.
    pub vertices: [u32; 3],
    /// Index of the patch.
    pub patch: u32,
}

/// Source of the light on a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lighting {
    /// A light map with shadows, for static objects.
    Baked,
    /// Interpolated from the vertices, for moving objects.
    Vertex,
    /// Emits light: the texture times this factor.
    Emissive(f32),
    /// The same for a lamp that flickers.
    Lamp(f32),
}

/// A part of a surface with one texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Index of the texture.
    pub texture: u32,
    /// Lighting.
    pub lighting: Lighting,
    /// 0 for the static world, k for actor k (counted from 1).
    pub instance: u8,
}

/// Vertices, triangles and patches.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// All vertices.
    pub vertices: Vec<Vertex>,
    /// All triangles.
    pub triangles: Vec<Triangle>,
    /// All patches.
    pub patches: Vec<Patch>,
}

impl Mesh {
    /// Adds a grid of `nu` × `nv` cells; `surface` gives position and outward normal at (u, v) in [0, 1]².
    pub fn grid(&mut self, nu: u32, nv: u32, patch: Patch, surface: impl Fn(f32, f32) -> (Vec3, Vec3)) {
        let first = self.vertices.len() as u32;
        let patch_index = self.patches.len() as u32;
        self.patches.push(patch);
        for j in 0..=nv {
            for i in 0..=nu {
                let uv = [i as f32 / nu as f32, j as f32 / nv as f32];
                let (position, normal) = surface(uv[0], uv[1]);
                self.vertices.push(Vertex { position, normal, uv, light: [1.0; 3] });
            }
        }
        for j in 0..nv {
            for i in 0..nu {
                let a = first + j * (nu + 1) + i;
                let (b, c, d) = (a + 1, a + nu + 1, a + nu + 2);
                for vertices in [[a, c, b], [b, c, d]] {
                    if !self.is_degenerate(vertices) {
                        self.triangles.push(Triangle { vertices, patch: patch_index });
                    }
                }
            }
        }
    }

    /// Adds a closed surface around +z of `nu` × `nv` cells whose normals follow from its shape; `surface` gives the position
    /// at (u, v), u once around from +x over +y, v downward.
    pub fn sculpture(&mut self, nu: u32, nv: u32, patch: Patch, surface: impl Fn(f32, f32) -> Vec3) {
        const STEP: f32 = 0.01;
        self.grid(nu, nv, patch, |u, v| {
            // u = 0 and u = 1 must be the same point to the bit, or the seam would be visible.
            let u = if u >= 1.0 { 0.0 } else { u };
            let around = |d: f32| surface((u + d).rem_euclid(1.0), v.clamp(STEP, 1.0 - STEP));
            let along = |d: f32| surface(u, (v + d).clamp(0.0, 1.0));
            let normal = (along(STEP) - along(-STEP)).cross(&(around(STEP) - around(-STEP)));
            (surface(u, v), normal.try_normalize(1e-12).unwrap_or_else(Vec3::z))
        });
    }

    /// Adds a flat rectangle; `right` and `down` are its edges as seen from outside.
    pub fn rectangle(&mut self, top_left: Vec3, right: Vec3, down: Vec3, patch: Patch) {
        let normal = down.cross(&right).normalize();
        self.grid(1, 1, patch, |u, v| (top_left + right * u + down * v, normal));
    }

    /// Adds a surface of revolution around +z through `rings` of (height z, radius in x, radius in y), top ring first.
    /// A ring of radius 0 closes the surface. Texture: u once around, v from the first ring to the last.
    pub fn loft(&mut self, segments: u32, rings: &[[f32; 3]], patch: Patch) {
        let last = rings.len().saturating_sub(1);
        let ring = |j: usize| rings[j.min(last)];
        self.grid(segments, last as u32, patch, |u, v| {
            let j = (v * last as f32).round() as usize;
            // u = 0 and u = 1 must be the same point to the bit, or the seam would be visible.
            let (sin, cos) = if u >= 1.0 { (0.0, 1.0) } else { libm::sincosf(u * std::f32::consts::TAU) };
            let [z, rx, ry] = ring(j);
            let (above, below) = (ring(j.saturating_sub(1)), ring(j + 1));
            let (dz, dr) = (above[0] - below[0], (below[1] + below[2] - above[1] - above[2]) / 2.0);
            let (ex, ey) = (rx.max(1e-3), ry.max(1e-3));
            // The normal of an ellipse is its gradient; the slope along the axis tilts it.
            let side = Vec3::new(cos / ex, sin / ey, 0.0).normalize();
            let normal = (side * dz.abs().max(1e-6) + Vec3::z() * dr * dz.signum()).normalize();
            (Vec3::new(rx * cos, ry * sin, z), normal)
        });
    }

    /// Appends `other`; `place(index, vertex)` gives each of its vertices.
    pub fn append(&mut self, other: &Self, place: impl Fn(usize, &Vertex) -> Vertex) {
        let (vertices, patches) = (self.vertices.len() as u32, self.patches.len() as u32);
        self.vertices.extend(other.vertices.iter().enumerate().map(|(index, vertex)| place(index, vertex)));
        self.triangles.extend(
            other
                .triangles
                .iter()
                .map(|t| Triangle { vertices: t.vertices.map(|v| v + vertices), patch: t.patch + patches }),
        );
        self.patches.extend(&other.patches);
    }

    /// Moves everything from vertex `first` on.
    pub fn transform_from(&mut self, first: usize, pose: &Isometry3<f32>) {
        for vertex in self.vertices.iter_mut().skip(first) {
            vertex.position = (pose * nalgebra::Point3::from(vertex.position)).coords;
            vertex.normal = pose.rotation * vertex.normal;
        }
    }

    fn is_degenerate(&self, vertices: [u32; 3]) -> bool {
        let [a, b, c] = vertices.map(|i| self.vertices[i as usize].position);
        (b - a).cross(&(c - a)).norm_squared() < 1e-18
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATCH: Patch = Patch { texture: 0, lighting: Lighting::Vertex, instance: 0 };

    fn winding_agrees_with_normals(mesh: &Mesh) {
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.vertices.map(|i| mesh.vertices[i as usize]);
            let face = (b.position - a.position).cross(&(c.position - a.position));
            assert!(face.dot(&(a.normal + b.normal + c.normal)) > 0.0, "{a:?}");
        }
    }

    #[test]
    fn triangles_wind_counter_clockwise_around_their_normals() {
        let mut mesh = Mesh::default();
        mesh.rectangle(Vec3::zeros(), Vec3::x(), -Vec3::z(), PATCH);
        assert_eq!(mesh.vertices[0].normal, -Vec3::y(), "a poster on the far wall faces the camera");
        mesh.loft(12, &[[0.3, 0.0, 0.0], [0.2, 0.2, 0.1], [-0.1, 0.3, 0.1], [-0.2, 0.0, 0.0]], PATCH);
        winding_agrees_with_normals(&mesh);
    }
}
