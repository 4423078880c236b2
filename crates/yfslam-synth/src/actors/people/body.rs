//! A person's surface: textured parts, each fixed to a bone.
//!
//! In: proportions, colours and a seed. Out: a mesh in bone coordinates with the bone of every vertex.

use nalgebra::{Isometry3, Point3};

use super::skeleton::{Bone, BonePoses, Proportions};
use crate::light::Lights;
use crate::mesh::{Lighting, Mesh, Patch, Vec3};
use crate::rng::Rng;
use crate::scene::builder::Palette;
use crate::texture::material::{Material, Pattern};

const SKINS: [[f32; 3]; 4] = [[0.86, 0.68, 0.56], [0.78, 0.58, 0.45], [0.60, 0.42, 0.31], [0.46, 0.31, 0.23]];
const HAIRS: [[f32; 3]; 4] = [[0.16, 0.12, 0.10], [0.34, 0.22, 0.14], [0.60, 0.46, 0.28], [0.24, 0.23, 0.23]];
const SHIRTS: [[[f32; 3]; 2]; 6] = [
    [[0.72, 0.20, 0.18], [0.92, 0.90, 0.86]],
    [[0.20, 0.34, 0.58], [0.85, 0.86, 0.88]],
    [[0.90, 0.89, 0.85], [0.16, 0.26, 0.42]],
    [[0.22, 0.46, 0.34], [0.88, 0.78, 0.40]],
    [[0.30, 0.29, 0.32], [0.86, 0.50, 0.20]],
    [[0.85, 0.66, 0.24], [0.26, 0.22, 0.30]],
];
const TROUSERS: [[f32; 3]; 4] = [[0.22, 0.27, 0.38], [0.26, 0.24, 0.23], [0.56, 0.49, 0.39], [0.34, 0.38, 0.42]];

const PATTERNS: [Pattern; 4] = [Pattern::Stripes, Pattern::Checks, Pattern::Motifs, Pattern::Print];

/// A dressed body.
#[derive(Clone, Debug)]
pub struct Body {
    /// Lengths.
    pub proportions: Proportions,
    mesh: Mesh,
    /// Bone per vertex.
    bones: Vec<u8>,
}

impl Body {
    /// Person number `instance` (from 1); textures are ordered from `palette`.
    pub fn new(instance: u8, palette: &mut Palette, seed: u64) -> Self {
        let style = Rng::new(seed, 0x57).below(12);
        let mut rng = Rng::new(seed, 0xb0d1 + u64::from(instance));
        let proportions = Proportions { height: rng.range(1.62, 1.86), girth: rng.range(0.92, 1.12) };
        let mut tailor = Tailor { mesh: Mesh::default(), bones: Vec::new(), palette, rng, instance, style };
        tailor.dress(&proportions);
        Self { proportions, mesh: tailor.mesh, bones: tailor.bones }
    }

    /// Appends the body in the given pose to `out`, lit by `lights`.
    pub fn pose(&self, poses: &BonePoses, lights: &Lights, out: &mut Mesh) {
        out.append(&self.mesh, |index, vertex| {
            let pose: &Isometry3<f32> = &poses[usize::from(self.bones[index])];
            let position = (pose * Point3::from(vertex.position)).coords;
            let normal = pose.rotation * vertex.normal;
            crate::mesh::Vertex { position, normal, light: lights.on_vertex(&position, &normal), ..*vertex }
        });
    }
}

/// Puts parts on bones.
struct Tailor<'a> {
    mesh: Mesh,
    bones: Vec<u8>,
    palette: &'a mut Palette,
    rng: Rng,
    instance: u8,
    /// Shifts the choice of shirts, by the seed.
    style: usize,
}

impl Tailor<'_> {
    fn patch(&mut self, material: Material, size_m: [f32; 2], density: f32) -> Patch {
        let texture = self.palette.order(material, size_m, density * material.detail(), self.rng.bits());
        Patch { texture, lighting: Lighting::Vertex, instance: self.instance }
    }

    /// A loft on `bone`, moved by `at` and tilted by `pitch` about the bone's x axis.
    fn part(&mut self, bone: Bone, at: Vec3, pitch: f32, rings: &[[f32; 3]], patch: Patch) {
        let first = self.mesh.vertices.len();
        self.mesh.loft(16, rings, patch);
        let pose = Isometry3::new(at, Vec3::x() * pitch);
        self.mesh.transform_from(first, &pose);
        self.bones.resize(self.mesh.vertices.len(), bone.index() as u8);
    }

    fn dress(&mut self, p: &Proportions) {
        let (skin, hair) = (self.rng.pick(SKINS), self.rng.pick(HAIRS));
        // The number chooses the shirt, so that people in one picture differ.
        let [shirt, accent] = SHIRTS[(usize::from(self.instance) + self.style) % SHIRTS.len()];
        let pattern = PATTERNS[(usize::from(self.instance) + self.style) % PATTERNS.len()];
        let trousers = self.rng.pick(TROUSERS);
        let (s, g) = (p.height / 1.75, p.girth);
        let top = p.trunk() - 0.06 + 0.045 * s;
        let shirt_material = Material::Shirt(shirt, accent, pattern);
        let sleeve = if pattern == Pattern::Print { Material::Cloth(shirt) } else { shirt_material };
        let patch = self.patch(shirt_material, [1.1, 0.68], 600.0);
        let trunk = [
            [top + 0.035 * s, 0.045, 0.045],
            [top + 0.02 * s, 0.065, 0.06],
            [top - 0.005, 0.125 * s * g, 0.080 * s],
            [top - 0.04 * s, 0.178 * s * g, 0.098 * s * g],
            [top - 0.11 * s, 0.186 * s * g, 0.120 * s * g],
            [top - 0.22 * s, 0.174 * s * g, 0.122 * s * g],
            [top - 0.36 * s, 0.158 * s * g, 0.110 * s * g],
            [-0.02, 0.172 * s * g, 0.124 * s * g],
            [-0.10, 0.190 * s * g, 0.142 * s * g],
            [-0.11, 0.184 * s * g, 0.136 * s * g],
            [-0.10, 0.12, 0.09],
        ];
        self.part(Bone::Chest, Vec3::zeros(), 0.0, &smooth(&trunk), patch);
        let patch = self.patch(Material::Cloth(trousers), [1.1, 0.3], 500.0);
        let hips = [
            [0.06, 0.12, 0.08],
            [0.04, 0.145 * s * g, 0.102 * s * g],
            [-0.03, 0.166 * s * g, 0.120 * s * g],
            [-0.10, 0.150 * s * g, 0.110 * s * g],
            [-0.15, 0.06, 0.06],
        ];
        self.part(Bone::Pelvis, Vec3::zeros(), 0.0, &smooth(&hips), patch);
        self.head(s, skin, hair);
        let bare = self.rng.chance(0.5);
        for side in [0, 1] {
            self.arm(p, side, sleeve, bare, skin);
            self.leg(p, side, s, g, trousers);
        }
    }

    fn head(&mut self, s: f32, skin: [f32; 3], hair: [f32; 3]) {
        let patch = self.patch(Material::Plain(skin), [0.36, 0.14], 400.0);
        self.part(Bone::Head, Vec3::new(0.0, -0.01, 0.0), 0.0, &limb(0.06, 0.058 * s, 0.06 * s, 0.13), patch);
        let patch = self.patch(Material::Head(skin, hair), [0.52, 0.33], 700.0);
        self.part(
            Bone::Head,
            Vec3::new(0.0, 0.015, 0.135 * s),
            0.0,
            &ellipsoid([0.076 * s, 0.096 * s, 0.118 * s]),
            patch,
        );
        let patch = self.patch(Material::Hair(hair), [0.55, 0.3], 500.0);
        let cap = ellipsoid([0.083 * s, 0.092 * s, 0.105 * s]);
        self.part(Bone::Head, Vec3::new(0.0, -0.008, 0.162 * s), 0.0, &cap, patch);
        let patch = self.patch(Material::Plain(skin), [0.06, 0.05], 400.0);
        let nose = ellipsoid([0.014 * s, 0.018 * s, 0.026 * s]);
        self.part(Bone::Head, Vec3::new(0.0, 0.108 * s, 0.118 * s), 0.0, &nose, patch);
    }

    fn arm(&mut self, p: &Proportions, side: usize, sleeve: Material, bare: bool, skin: [f32; 3]) {
        let s = p.height / 1.75;
        let patch = self.patch(sleeve, [0.36, p.upper_arm() + 0.1], 500.0);
        self.part(Bone::UpperArm(side), Vec3::zeros(), 0.0, &limb(0.0, 0.062 * s, 0.051 * s, p.upper_arm()), patch);
        let material = if bare { Material::Plain(skin) } else { sleeve };
        let patch = self.patch(material, [0.28, p.forearm() + 0.08], 500.0);
        self.part(Bone::Forearm(side), Vec3::zeros(), 0.0, &limb(0.0, 0.043 * s, 0.030 * s, p.forearm()), patch);
        let patch = self.patch(Material::Plain(skin), [0.2, 0.18], 400.0);
        let hand = ellipsoid([0.022 * s, 0.042 * s, 0.085 * s]);
        self.part(Bone::Forearm(side), -Vec3::z() * (p.forearm() + 0.065 * s), 0.0, &hand, patch);
    }

    fn leg(&mut self, p: &Proportions, side: usize, s: f32, g: f32, trousers: [f32; 3]) {
        let cloth = Material::Cloth(trousers);
        let patch = self.patch(cloth, [0.52, p.thigh() + 0.14], 500.0);
        self.part(Bone::Thigh(side), Vec3::zeros(), 0.0, &limb(0.0, 0.082 * s * g, 0.060 * s, p.thigh()), patch);
        let patch = self.patch(cloth, [0.40, p.shank() + 0.1], 500.0);
        let (r, l) = (s, p.shank());
        let calf = [
            [0.06 * r, 0.0, 0.0],
            [0.04 * r, 0.042 * r, 0.042 * r],
            [0.0, 0.061 * r, 0.061 * r],
            [-0.28 * l, 0.060 * r, 0.064 * r],
            [-0.70 * l, 0.050 * r, 0.052 * r],
            [-0.97 * l, 0.056 * r, 0.058 * r],
            [-l, 0.030, 0.030],
        ];
        self.part(Bone::Shank(side), Vec3::zeros(), 0.0, &smooth(&calf), patch);
        let leather = self.rng.range(0.14, 0.5);
        let patch = self.patch(Material::Plain([leather, 0.9 * leather, 0.8 * leather]), [0.3, 0.28], 500.0);
        // The shoe's axis lies forward: the loft is tilted by a quarter turn.
        let a = p.ankle();
        let shoe = [
            [0.090 * s, 0.0, 0.0],
            [0.085 * s, 0.030, 0.035],
            [0.050 * s, 0.044, 0.052],
            [-0.03 * s, 0.046, 0.050],
            [-0.12 * s, 0.050, 0.034],
            [-0.17 * s, 0.040, 0.026],
            [-0.19 * s, 0.0, 0.0],
        ];
        let at = Vec3::new(0.0, 0.015, -a + 0.042);
        self.part(Bone::Foot(side), at, std::f32::consts::FRAC_PI_2, &smooth(&shoe), patch);
    }
}

/// Rings of an ellipsoid.
fn ellipsoid([rx, ry, rz]: [f32; 3]) -> Vec<[f32; 3]> {
    (0..=8)
        .map(|i| {
            let (sin, cos) = (i as f32 * std::f32::consts::PI / 8.0).sin_cos();
            let sin = if i == 0 || i == 8 { 0.0 } else { sin };
            [rz * cos, rx * sin, ry * sin]
        })
        .collect()
}

/// Rings of a tapered capsule that hangs down from `z` by `length`.
fn limb(z: f32, top: f32, bottom: f32, length: f32) -> Vec<[f32; 3]> {
    let ring = |height: f32, radius: f32| [height, radius, radius];
    vec![
        ring(z + top, 0.0),
        ring(z + 0.87 * top, 0.5 * top),
        ring(z + 0.5 * top, 0.87 * top),
        ring(z, top),
        ring(z - 0.5 * length, 0.55 * (top + bottom) * 0.95),
        ring(z - length, bottom),
        ring(z - length - 0.5 * bottom, 0.87 * bottom),
        ring(z - length - 0.87 * bottom, 0.5 * bottom),
        ring(z - length - bottom, 0.0),
    ]
}

/// Doubles the number of rings with a Catmull–Rom curve, so that few figures give a round shape.
fn smooth(rings: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let at = |i: isize| rings[i.clamp(0, rings.len() as isize - 1) as usize];
    let mut out = Vec::with_capacity(2 * rings.len());
    for i in 0..rings.len() as isize {
        out.push(at(i));
        if i + 1 < rings.len() as isize {
            let (a, b, c, d) = (at(i - 1), at(i), at(i + 1), at(i + 2));
            out.push(std::array::from_fn(|k| {
                let middle = (9.0 * (b[k] + c[k]) - a[k] - d[k]) / 16.0;
                let (low, high) = (b[k].min(c[k]), b[k].max(c[k]));
                if k == 0 { middle.clamp(low, high) } else { middle.max(0.0) }
            }));
        }
    }
    out
}
