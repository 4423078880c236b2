//! Light maps: irradiance of static surfaces, with shadows.
//!
//! In: the static mesh and the lamps. Out: a [`LightMap`] per patch, computed with shadow rays at points about
//! [`SPACING_M`] apart.

use crate::bvh::Bvh;
use crate::light::Lights;
use crate::mesh::{Mesh, Triangle, Vec3};

/// Irradiance over the [0, 1]² of a patch.
#[derive(Clone, Debug)]
pub struct LightMap {
    width: usize,
    height: usize,
    /// Linear RGB, and the share of it that flickers.
    values: Vec<[f32; 4]>,
}

/// Distance between light-map samples on large surfaces, m.
const SPACING_M: f32 = 0.11;

/// Computes light maps, one patch at a time.
#[derive(Clone, Debug)]
pub struct Baker {
    lights: Lights,
    bvh: Bvh,
    /// Index of the first triangle of each patch, and the total at the end.
    first: Vec<usize>,
    samples: usize,
}

impl Baker {
    /// Creates a baker for `mesh` that casts `samples` rays per lamp and point, see [`Lights::irradiance`].
    pub fn new(mesh: &Mesh, lights: Lights, samples: usize) -> Self {
        // Without rays no hierarchy is needed.
        let bvh = if samples > 0 { Bvh::new(mesh) } else { Bvh::new(&Mesh::default()) };
        Self { lights, bvh, first: first_triangles(mesh), samples }
    }

    /// Computes the light map of patch number `patch` of the mesh.
    pub fn bake(&self, mesh: &Mesh, patch: usize) -> LightMap {
        let triangles = &mesh.triangles[self.first[patch]..self.first[patch + 1]];
        let [w, h] = extent(mesh, triangles);
        let cells = |metres: f32| ((metres / SPACING_M).ceil() as usize).clamp(2, 96);
        let (width, height) = (cells(w), cells(h));
        let hidden = |o: &Vec3, d: &Vec3, far: f32| self.bvh.hit(o, d, far);
        let values = (0..width * height)
            .map(|i| {
                // Samples lie also on the border, which bilinear interpolation needs, but slightly inside, so that they do not
                // start within a wall that the patch touches.
                let inset = |k: usize, n: usize| (k as f32 / (n - 1) as f32).clamp(0.02, 0.98);
                let uv = [inset(i % width, width), inset(i / width, height)];
                match locate(mesh, triangles, uv) {
                    Some((point, normal)) => self.lights.irradiance(&point, &normal, self.samples, &hidden),
                    None => [0.0; 4],
                }
            })
            .collect();
        LightMap { width, height, values }
    }
}

impl LightMap {
    /// Returns the irradiance at (u, v) and the share of it that flickers, bilinear.
    #[inline]
    pub fn sample(&self, u: f32, v: f32) -> [f32; 4] {
        let x = (u * (self.width - 1) as f32).clamp(0.0, (self.width - 1) as f32);
        let y = (v * (self.height - 1) as f32).clamp(0.0, (self.height - 1) as f32);
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(self.width - 1), (y0 + 1).min(self.height - 1));
        let (fx, fy) = (x - x0 as f32, y - y0 as f32);
        let get = |x: usize, y: usize| &self.values[y * self.width + x];
        let (a, b, c, d) = (get(x0, y0), get(x1, y0), get(x0, y1), get(x1, y1));
        std::array::from_fn(|k| (a[k] * (1.0 - fx) + b[k] * fx) * (1.0 - fy) + (c[k] * (1.0 - fx) + d[k] * fx) * fy)
    }
}

/// Returns the index of the first triangle of each patch, and the total at the end; patches are contiguous by construction.
fn first_triangles(mesh: &Mesh) -> Vec<usize> {
    (0..=mesh.patches.len() as u32).map(|patch| mesh.triangles.partition_point(|t| t.patch < patch)).collect()
}

fn extent(mesh: &Mesh, triangles: &[Triangle]) -> [f32; 2] {
    // The greatest length per unit of u and v over the edges of the triangles.
    let mut size = [0.0f32; 2];
    for triangle in triangles {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (mesh.vertices[triangle.vertices[i] as usize], mesh.vertices[triangle.vertices[j] as usize]);
            let span = [(a.uv[0] - b.uv[0]).abs(), (a.uv[1] - b.uv[1]).abs()];
            let metres = (a.position - b.position).norm();
            if span[0] > 1e-4 && span[1] < 1e-6 {
                size[0] = size[0].max(metres / span[0]);
            } else if span[1] > 1e-4 && span[0] < 1e-6 {
                size[1] = size[1].max(metres / span[1]);
            }
        }
    }
    size
}

/// Returns the point and normal at `uv`.
fn locate(mesh: &Mesh, triangles: &[Triangle], uv: [f32; 2]) -> Option<(Vec3, Vec3)> {
    triangles.iter().find_map(|triangle| {
        let [a, b, c] = triangle.vertices.map(|i| mesh.vertices[i as usize]);
        let cross =
            |p: [f32; 2], q: [f32; 2], r: [f32; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
        let total = cross(a.uv, b.uv, c.uv);
        let l = [cross(b.uv, c.uv, uv) / total, cross(c.uv, a.uv, uv) / total, cross(a.uv, b.uv, uv) / total];
        l.iter().all(|&l| l >= -1e-4).then(|| {
            let point = a.position * l[0] + b.position * l[1] + c.position * l[2];
            let normal = (a.normal * l[0] + b.normal * l[1] + c.normal * l[2]).normalize();
            (point, normal)
        })
    })
}
