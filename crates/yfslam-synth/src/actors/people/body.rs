//! The surface of a person: textured parts, each fixed to a bone.
//!
//! In: proportions, colours and a seed. Out: a mesh in bone coordinates with the bone of every vertex.

use nalgebra::Isometry3;

use rayon::prelude::*;

use super::skeleton::{self, BONES, Bone, Proportions};
use crate::bvh::Bvh;
use crate::light::{Lights, hemisphere, scattered};
use crate::mesh::{Lighting, Mesh, Patch, Vec3, Vertex};
use crate::rig::Rig;
use crate::rng::Rng;
use crate::scene::builder::Palette;
use crate::texture::material::{Material, Pattern, blend, tint};

const SKINS: [[f32; 3]; 5] =
    [[0.90, 0.72, 0.62], [0.86, 0.67, 0.55], [0.80, 0.60, 0.48], [0.64, 0.45, 0.34], [0.50, 0.35, 0.27]];
const HAIRS: [[f32; 3]; 5] =
    [[0.16, 0.12, 0.10], [0.30, 0.20, 0.13], [0.62, 0.48, 0.30], [0.22, 0.21, 0.21], [0.50, 0.49, 0.48]];
const SHIRTS: [[[f32; 3]; 2]; 6] = [
    [[0.24, 0.28, 0.40], [0.80, 0.80, 0.78]],
    [[0.66, 0.74, 0.86], [0.90, 0.91, 0.93]],
    [[0.86, 0.85, 0.82], [0.22, 0.30, 0.44]],
    [[0.50, 0.20, 0.20], [0.72, 0.66, 0.60]],
    [[0.30, 0.29, 0.31], [0.66, 0.30, 0.22]],
    [[0.24, 0.44, 0.38], [0.84, 0.80, 0.66]],
];
const TROUSERS: [[f32; 3]; 5] =
    [[0.24, 0.30, 0.44], [0.22, 0.21, 0.22], [0.58, 0.51, 0.41], [0.36, 0.40, 0.46], [0.40, 0.46, 0.58]];
const PATTERNS: [Pattern; 6] =
    [Pattern::Jacket, Pattern::Buttons, Pattern::Stripes, Pattern::Checks, Pattern::Print, Pattern::Motifs];

/// Rays per vertex for the light that a body hides from itself, and their length, m.
const SELF_SHADE: (usize, f32) = (12, 0.40);

/// Limb (trunk, head, arms, legs) of each bone.
const LIMBS: [u8; BONES] = [0, 0, 1, 2, 3, 2, 3, 4, 5, 4, 5, 4, 5];
const LIMB_COUNT: u8 = 6;

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
    /// Creates person number `instance` (from 1); textures are ordered from `palette`.
    pub fn new(instance: u8, palette: &mut Palette, seed: u64) -> Self {
        let style = Rng::new(seed, 0x57).below(36);
        let mut rng = Rng::new(seed, 0xb0d1 + u64::from(instance));
        let proportions = Proportions { height: rng.range(1.62, 1.86), girth: rng.range(0.92, 1.12) };
        let mut tailor = Tailor { mesh: Mesh::default(), bones: Vec::new(), palette, rng, instance, style };
        tailor.dress(&proportions);
        let mut body = Self { proportions, mesh: tailor.mesh, bones: tailor.bones };
        body.shade_itself();
        body
    }

    /// Darkens what other limbs hide from light in a relaxed stand: armpits, below the chin, between the legs. A limb does not
    /// darken itself, because its joints bend.
    fn shade_itself(&mut self) {
        let joints = super::gait::stand(0, 0.0);
        let poses = skeleton::forward_kinematics(&Isometry3::identity(), &self.proportions, &joints);
        let mut rig = Rig::default();
        self.attach(&mut rig, 0);
        let posed = rig.posed(&poses, &Lights::default());
        let limb_of = |vertex: u32| LIMBS[usize::from(self.bones[vertex as usize])];
        let others: Vec<Bvh> = (0..LIMB_COUNT)
            .into_par_iter()
            .map(|limb| {
                let triangles = posed.triangles.iter().filter(|t| limb_of(t.vertices[0]) != limb).copied().collect();
                Bvh::new(&Mesh { vertices: posed.vertices.clone(), triangles, patches: posed.patches.clone() })
            })
            .collect();
        let (rays, reach) = SELF_SHADE;
        let open = |(index, vertex): (usize, &Vertex)| {
            let bvh = &others[usize::from(limb_of(index as u32))];
            let hidden = |[s, t]: &[f32; 2]| bvh.hit(&vertex.position, &hemisphere(&vertex.normal, *s, *t), reach);
            let free = (0..rays).map(scattered).filter(|sample| !hidden(sample)).count();
            0.30 + 0.70 * free as f32 / rays as f32
        };
        let open: Vec<f32> = posed.vertices.par_iter().enumerate().map(open).collect();
        for (vertex, open) in self.mesh.vertices.iter_mut().zip(open) {
            vertex.light = [open; 3];
        }
    }

    /// Adds the surface to a rig whose bones from number `first_bone` on are those of this body.
    pub fn attach(&self, rig: &mut Rig, first_bone: usize) {
        rig.attach(&self.mesh, |vertex| first_bone + usize::from(self.bones[vertex]));
    }
}

/// Builder that adds parts to bones.
pub struct Tailor<'a> {
    mesh: Mesh,
    bones: Vec<u8>,
    palette: &'a mut Palette,
    /// Draws for variety.
    pub rng: Rng,
    instance: u8,
    /// Offset of the choice of shirts, by the seed.
    style: usize,
}

impl Tailor<'_> {
    /// Creates a patch of the material.
    pub fn patch(&mut self, material: Material, size_m: [f32; 2], density: f32) -> Patch {
        let texture = self.palette.order(material, size_m, density * material.detail(), self.rng.bits());
        Patch { texture, lighting: Lighting::Vertex, instance: self.instance }
    }

    /// Adds a loft on `bone`, moved by `at` and tilted by `pitch` about the x axis of the bone.
    pub fn part(&mut self, bone: Bone, at: Vec3, pitch: f32, rings: &[[f32; 3]], patch: Patch) {
        let first = self.mesh.vertices.len();
        self.mesh.loft(16, rings, patch);
        let pose = Isometry3::new(at, Vec3::x() * pitch);
        self.mesh.transform_from(first, &pose);
        self.bones.resize(self.mesh.vertices.len(), bone.index() as u8);
    }

    /// Adds a closed surface on `bone`.
    pub fn sculpture(&mut self, bone: Bone, nu: u32, nv: u32, patch: Patch, surface: impl Fn(f32, f32) -> Vec3) {
        self.mesh.sculpture(nu, nv, patch, surface);
        self.bones.resize(self.mesh.vertices.len(), bone.index() as u8);
    }

    fn dress(&mut self, p: &Proportions) {
        let (skin, hair) = (self.rng.pick(SKINS), self.rng.pick(HAIRS));
        // The number chooses the shirt, so that people in one image differ.
        let [shirt, accent] = SHIRTS[(usize::from(self.instance) + self.style) % SHIRTS.len()];
        let pattern = PATTERNS[(usize::from(self.instance) + self.style) % PATTERNS.len()];
        let trousers = self.rng.pick(TROUSERS);
        let (s, g) = (p.height / 1.75, p.girth);
        let top = p.trunk() - 0.06 + 0.045 * s;
        let shirt_material = Material::Shirt(shirt, accent, pattern);
        // Sleeves have no print, zip or buttons.
        let sleeve = match pattern {
            Pattern::Print => Material::Garment(shirt),
            Pattern::Jacket => Material::Shirt(shirt, blend(shirt, accent, 0.4), Pattern::Checks),
            Pattern::Buttons => Material::Garment(blend(shirt, accent, 0.5)),
            _ => shirt_material,
        };
        let patch = self.patch(shirt_material, [1.1, 0.68], 700.0);
        let belly = self.rng.range(0.95, 1.12);
        let trunk = [
            [top + 0.045 * s, 0.052 * s, 0.052 * s],
            [top + 0.038 * s, 0.078 * s, 0.066 * s],
            [top + 0.016 * s, 0.136 * s * g, 0.078 * s],
            [top - 0.025 * s, 0.176 * s * g, 0.088 * s * g],
            [top - 0.07 * s, 0.186 * s * g, 0.102 * s * g],
            [top - 0.14 * s, 0.182 * s * g, 0.118 * s * g],
            [top - 0.24 * s, 0.170 * s * g, 0.114 * s * g],
            [top - 0.36 * s, 0.156 * s * g, 0.106 * s * g * belly],
            [-0.02, 0.160 * s * g, 0.114 * s * g * belly],
            [-0.09, 0.172 * s * g, 0.126 * s * g],
            [-0.10, 0.168 * s * g, 0.122 * s * g],
            [-0.09, 0.12, 0.09],
        ];
        self.part(Bone::Chest, Vec3::zeros(), 0.0, &smooth(&trunk), patch);
        let patch = self.patch(
            Material::Garment(tint(if pattern == Pattern::Jacket { accent } else { shirt }, 0.85)),
            [0.45, 0.06],
            400.0,
        );
        let collar = [
            [0.0, 0.050 * s, 0.050 * s],
            [0.004, 0.058 * s, 0.060 * s],
            [-0.03 * s, 0.070 * s, 0.066 * s],
            [-0.05 * s, 0.08 * s, 0.07 * s],
        ];
        self.part(Bone::Chest, Vec3::new(0.0, -0.004, top + 0.062 * s), 0.08, &collar, patch);
        let patch = self.patch(Material::Garment(trousers), [1.1, 0.3], 500.0);
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

    fn arm(&mut self, p: &Proportions, side: usize, sleeve: Material, bare: bool, skin: [f32; 3]) {
        let s = p.height / 1.75;
        let patch = self.patch(sleeve, [0.36, p.upper_arm() + 0.1], 500.0);
        self.part(Bone::UpperArm(side), Vec3::zeros(), 0.0, &limb(0.0, 0.062 * s, 0.051 * s, p.upper_arm()), patch);
        let material = if bare { Material::Skin(skin) } else { sleeve };
        let patch = self.patch(material, [0.28, p.forearm() + 0.08], 500.0);
        self.part(Bone::Forearm(side), Vec3::zeros(), 0.0, &limb(0.0, 0.043 * s, 0.030 * s, p.forearm()), patch);
        // Palm, fingers and thumb; the thumb points forward.
        let wrist = -Vec3::z() * p.forearm();
        let sign = if side == 0 { 1.0 } else { -1.0 };
        for (at, size, pitch) in [
            ([-0.004 * sign, 0.0, -0.045], [0.018, 0.038, 0.055], 0.0),
            ([-0.010 * sign, 0.004, -0.115], [0.013, 0.034, 0.052], 0.10),
            ([-0.012 * sign, 0.040, -0.062], [0.012, 0.013, 0.040], 0.55),
        ] {
            let patch = self.patch(Material::Skin(skin), [0.12, 0.12], 400.0);
            let shape = ellipsoid(size.map(|v| v * s));
            self.part(Bone::Forearm(side), wrist + Vec3::from(at) * s, pitch, &shape, patch);
        }
    }

    fn leg(&mut self, p: &Proportions, side: usize, s: f32, g: f32, trousers: [f32; 3]) {
        let cloth = Material::Garment(trousers);
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
        // The axis of the shoe points forward: the loft is tilted by a quarter turn.
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

/// Returns the rings of an ellipsoid.
pub fn ellipsoid([rx, ry, rz]: [f32; 3]) -> Vec<[f32; 3]> {
    (0..=8)
        .map(|i| {
            let (sin, cos) = libm::sincosf(i as f32 * std::f32::consts::PI / 8.0);
            let sin = if i == 0 || i == 8 { 0.0 } else { sin };
            [rz * cos, rx * sin, ry * sin]
        })
        .collect()
}

/// Returns the rings of a tapered capsule that extends downward from `z` by `length`.
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

/// Doubles the number of rings with a Catmull–Rom curve, so that few values give a round shape.
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
