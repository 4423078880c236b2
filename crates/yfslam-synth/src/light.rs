//! Light: soft light maps for everything that stands still, cheap light and contact shadows for what moves.
//!
//! In: the static mesh and the lamps. Out: irradiance (linear RGB) per light-map texel, baked with shadow rays; the same
//! lamps evaluated without shadow rays for moving vertices; and the darkening that moving bodies cast around them
//! (ambient occlusion of a sphere, Quílez, "Sphere ambient occlusion", 2006).

use rayon::prelude::*;

use crate::bvh::Bvh;
use crate::mesh::{Lighting, Mesh, Vec3};

/// A rectangular lamp (or window) that shines from its front.
#[derive(Clone, Copy, Debug)]
pub struct Lamp {
    /// Middle, m.
    pub center: Vec3,
    /// Half edges, m.
    pub half: [Vec3; 2],
    /// Direction it shines to, unit.
    pub normal: Vec3,
    /// Radiant power per area and direction, linear RGB.
    pub radiance: [f32; 3],
}

/// All light sources of a scene.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Area lamps.
    pub lamps: Vec<Lamp>,
    /// Light that bounces around the room, from above and from below, linear RGB.
    pub ambient: [[f32; 3]; 2],
}

/// Irradiance over a patch's [0, 1]².
#[derive(Clone, Debug)]
pub struct LightMap {
    width: usize,
    height: usize,
    /// Linear RGB; the fourth lane is unused.
    values: Vec<[f32; 4]>,
}

/// A sphere of a moving body that shades its surroundings.
#[derive(Clone, Copy, Debug)]
pub struct Occluder {
    /// Centre in the coordinates in which points are given, m.
    pub center: Vec3,
    /// Radius, m.
    pub radius: f32,
}

/// Distance between light-map samples on large surfaces, m.
const SPACING_M: f32 = 0.11;
/// Beyond this distance a hit does not dim ambient light any more, m.
const AMBIENT_REACH_M: f32 = 1.5;
/// Share of ambient light that still comes from a surface nearby.
const BOUNCED: f32 = 0.35;
/// Keeps light finite at the lamp itself, m².
const SOFTENING_M2: f32 = 0.05;
/// Lifts ray origins off their own surface, m.
const OFFSET_M: f32 = 2e-3;

impl Lights {
    /// Irradiance at a point. `hidden(origin, direction, distance)` tells whether something is in the way; `samples`
    /// is the number of rays per lamp and twice as many for the ambient term. All points use the same sample pattern:
    /// what error remains is smooth over a surface instead of mottled.
    fn irradiance(
        &self,
        point: &Vec3,
        normal: &Vec3,
        samples: usize,
        hidden: &impl Fn(&Vec3, &Vec3, f32) -> bool,
    ) -> [f32; 4] {
        let origin = point + normal * OFFSET_M;
        let mut sum = [0.0; 4];
        for lamp in &self.lamps {
            let area = 4.0 * lamp.half[0].norm() * lamp.half[1].norm();
            for [a, b] in (0..samples).map(scattered) {
                let to = lamp.center + lamp.half[0] * (2.0 * a - 1.0) + lamp.half[1] * (2.0 * b - 1.0) - origin;
                let distance = to.norm();
                let direction = to / distance;
                let (facing, leaving) = (normal.dot(&direction), -lamp.normal.dot(&direction));
                if facing > 0.0 && leaving > 0.0 && !hidden(&origin, &direction, distance - 0.02) {
                    let gain = facing * leaving * area / (distance * distance + SOFTENING_M2) / samples as f32;
                    (0..3).for_each(|k| sum[k] += lamp.radiance[k] * gain);
                }
            }
        }
        let rays = 2 * samples;
        let open = (0..rays)
            .map(scattered)
            .map(|[s, t]| if hidden(&origin, &hemisphere(normal, s, t), AMBIENT_REACH_M) { BOUNCED } else { 1.0 });
        let open = if rays == 0 { 1.0 } else { open.sum::<f32>() / rays as f32 };
        let ambient = self.ambient_light(normal);
        (0..3).for_each(|k| sum[k] += open * ambient[k]);
        sum
    }

    /// Light from all around, by how far up a surface looks.
    fn ambient_light(&self, normal: &Vec3) -> [f32; 3] {
        let up = 0.5 + 0.5 * normal.z;
        std::array::from_fn(|k| self.ambient[0][k] * up + self.ambient[1][k] * (1.0 - up))
    }

    /// Bakes the light maps of every patch of `mesh` and makes the patches use them.
    pub fn bake(&self, mesh: &mut Mesh, samples: usize) -> Vec<LightMap> {
        let bvh = Bvh::new(mesh);
        let first = first_triangles(mesh);
        let maps: Vec<Option<LightMap>> = (0..mesh.patches.len())
            .into_par_iter()
            .map(|patch| {
                let baked = matches!(mesh.patches[patch].lighting, Lighting::Baked(_));
                baked.then(|| self.bake_patch(mesh, &bvh, &first, patch, samples))
            })
            .collect();
        let mut out = Vec::new();
        for (patch, map) in mesh.patches.iter_mut().zip(maps) {
            if let Some(map) = map {
                patch.lighting = Lighting::Baked(out.len() as u32);
                out.push(map);
            }
        }
        out
    }

    fn bake_patch(&self, mesh: &Mesh, bvh: &Bvh, first: &[usize], patch: usize, samples: usize) -> LightMap {
        let triangles = &mesh.triangles[first[patch]..first[patch + 1]];
        let [w, h] = extent(mesh, triangles);
        let cells = |metres: f32| ((metres / SPACING_M).ceil() as usize).clamp(2, 96);
        let (width, height) = (cells(w), cells(h));
        let hidden = |o: &Vec3, d: &Vec3, far: f32| bvh.hit(o, d, far);
        let values = (0..width * height)
            .map(|i| {
                // Samples sit on the border too, as bilinear interpolation wants them, but a little inside, so that
                // they do not start within a wall that the patch touches.
                let inset = |k: usize, n: usize| (k as f32 / (n - 1) as f32).clamp(0.02, 0.98);
                let uv = [inset(i % width, width), inset(i / width, height)];
                match locate(mesh, triangles, uv) {
                    Some((point, normal)) => self.irradiance(&point, &normal, samples, &hidden),
                    None => [0.0; 4],
                }
            })
            .collect();
        LightMap { width, height, values }
    }

    /// Light on a moving vertex: lamps without shadow rays, and the ambient term.
    pub fn on_vertex(&self, point: &Vec3, normal: &Vec3) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for lamp in &self.lamps {
            let to = lamp.center - point;
            let distance2 = to.norm_squared();
            let direction = to / distance2.sqrt();
            // A large lamp lights a little around the corner.
            let facing = (normal.dot(&direction) * 0.8 + 0.2).max(0.0) * (-lamp.normal.dot(&direction)).max(0.0);
            let area = 4.0 * lamp.half[0].norm() * lamp.half[1].norm();
            let gain = facing * area / (distance2 + SOFTENING_M2);
            (0..3).for_each(|k| sum[k] += lamp.radiance[k] * gain);
        }
        let ambient = self.ambient_light(normal);
        std::array::from_fn(|k| sum[k] + 0.9 * ambient[k])
    }
}

impl LightMap {
    /// Irradiance at (u, v), bilinear.
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

impl Occluder {
    /// Distance from which the sphere does not matter, m: seven radii, where it would take 2 % of the light.
    pub fn reach(&self) -> f32 {
        7.0 * self.radius
    }

    /// Share of light that the sphere leaves at a point with the given normal.
    #[inline]
    pub fn visibility(&self, point: &Vec3, normal: &Vec3) -> f32 {
        let to = self.center - point;
        let distance2 = to.norm_squared();
        let fade = 1.0 - distance2 / (self.reach() * self.reach());
        if fade <= 0.0 {
            return 1.0;
        }
        let cosine = normal.dot(&to) / distance2.sqrt().max(1e-6);
        let ratio = (self.radius * self.radius / distance2).min(1.0);
        1.0 - 0.8 * cosine.max(0.0) * ratio * fade
    }
}

/// Point number `i` of a sequence that fills [0, 1]² evenly: the additive recurrence of the plastic number (Roberts,
/// "The unreasonable effectiveness of quasirandom sequences", 2018).
pub fn scattered(i: usize) -> [f32; 2] {
    let n = i as f32 + 0.5;
    [(n * 0.754_877_7).fract(), (n * 0.569_840_3).fract()]
}

/// Cosine-weighted direction around `normal` (Malley's method).
pub fn hemisphere(normal: &Vec3, s: f32, t: f32) -> Vec3 {
    let axis = if normal.z.abs() < 0.7 { Vec3::z() } else { Vec3::x() };
    let a = normal.cross(&axis).normalize();
    let b = normal.cross(&a);
    let (sin, cos) = (t * std::f32::consts::TAU).sin_cos();
    let r = s.sqrt();
    a * (r * cos) + b * (r * sin) + normal * (1.0 - s).max(0.0).sqrt()
}

/// Index of the first triangle of each patch, and the total at the end; patches are contiguous by construction.
fn first_triangles(mesh: &Mesh) -> Vec<usize> {
    (0..=mesh.patches.len() as u32).map(|patch| mesh.triangles.partition_point(|t| t.patch < patch)).collect()
}

fn extent(mesh: &Mesh, triangles: &[crate::mesh::Triangle]) -> [f32; 2] {
    // Greatest length per unit of u and v over the triangles' edges.
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

/// Point and normal at `uv`.
fn locate(mesh: &Mesh, triangles: &[crate::mesh::Triangle], uv: [f32; 2]) -> Option<(Vec3, Vec3)> {
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
