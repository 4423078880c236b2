//! The head: skull, face, nose, ears and hair, in the axes of the head bone (origin at the top of the neck).

use super::body::{Tailor, ellipsoid};
use super::skeleton::Bone;
use crate::mesh::Vec3;
use crate::texture::hairline;
use crate::texture::material::Material;

/// Middle of the skull.
const MIDDLE: [f32; 3] = [0.0, 0.016, 0.128];

/// Shape of the hair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cut {
    Short,
    Full,
    Long,
}

/// Returns the surface of skull and face around their middle: u once around from the right ear over the face, v from crown to chin.
fn skull(u: f32, v: f32) -> Vec3 {
    let (sin, cos) = libm::sincosf(u * std::f32::consts::TAU);
    let (ring, height) = libm::sincosf(v * std::f32::consts::PI);
    // No taper above the eyes; the jaw is narrower, and less deep at the back.
    let below = (-height).max(0.0);
    let wide = 0.077 * (1.0 - 0.30 * below * below);
    let deep = if sin > 0.0 { 0.094 * (1.0 - 0.06 * below) } else { 0.100 * (1.0 - 0.45 * below) };
    // The plane of the face is flatter than an ellipse.
    let front = sin.max(0.0);
    let flat = 1.0 - 0.07 * front.powi(4) * (1.0 - height * height);
    Vec3::new(wide * ring * cos, deep * ring * sin * flat, 0.119 * height)
}

impl Tailor<'_> {
    /// Adds neck, head and hair; `s` is the size relative to an average body.
    pub fn head(&mut self, s: f32, skin: [f32; 3], hair: [f32; 3]) {
        let cut = self.rng.pick([Cut::Short, Cut::Short, Cut::Full, Cut::Long]);
        let beard = cut != Cut::Long && self.rng.chance(0.3);
        let middle = Vec3::from(MIDDLE) * s;
        let patch = self.patch(Material::Skin(skin), [0.36, 0.2], 400.0);
        let neck = [[0.085, 0.050, 0.056], [0.03, 0.050, 0.055], [-0.03, 0.054, 0.056], [-0.075, 0.070, 0.060]];
        self.part(Bone::Head, Vec3::new(0.0, -0.012, 0.0) * s, 0.0, &neck.map(|ring| ring.map(|v| v * s)), patch);
        let patch = self.patch(Material::Head(skin, hair, beard), [0.52, 0.37], 900.0);
        self.sculpture(Bone::Head, 30, 20, patch, |u, v| middle + skull(u, v) * s);
        let patch = self.patch(Material::Skin(skin), [0.06, 0.05], 400.0);
        let nose = [
            [0.030, 0.0, 0.0],
            [0.022, 0.006, 0.008],
            [-0.006, 0.011, 0.016],
            [-0.016, 0.015, 0.020],
            [-0.024, 0.012, 0.014],
            [-0.027, 0.0, 0.0],
        ];
        let at = middle + Vec3::new(0.0, 0.083, -0.008) * s;
        self.part(Bone::Head, at, 0.16, &nose.map(|ring| ring.map(|v| v * s)), patch);
        if cut != Cut::Long {
            for side in [-1.0, 1.0] {
                let patch = self.patch(Material::Skin(skin), [0.08, 0.06], 400.0);
                let at = middle + Vec3::new(side * 0.078, -0.012, 0.0) * s;
                self.part(Bone::Head, at, 0.15, &ellipsoid([0.010, 0.019, 0.032].map(|v| v * s)), patch);
            }
        }
        let patch = self.patch(Material::Hair(hair), [0.55, 0.35], 600.0);
        self.sculpture(Bone::Head, 30, 12, patch, |u, v| middle + strand(cut, u, v) * s);
    }
}

/// Returns the surface of the hair: over the skull from the crown to the hairline, and down the back if it is long.
fn strand(cut: Cut, u: f32, v: f32) -> Vec3 {
    let aside = (u - 0.25).abs();
    let side = aside.min(1.0 - aside);
    let long = cut == Cut::Long;
    let line = hairline(side) + if long { 0.30 * ((side - 0.15) / 0.1).clamp(0.0, 1.0) } else { 0.0 };
    let thick = if cut == Cut::Short { 0.07 } else { 0.16 };
    // It becomes thinner towards the hairline and goes below the skin at its end.
    let edge = if long && side > 0.2 { 0.3 * v } else { v };
    let on = skull(u, (v * line).min(0.62));
    let drop = (v * line - 0.62).max(0.0);
    let lifted = on * (1.0 + thick * (1.0 - edge.powi(6)) + 0.02 - 0.03 * edge.powi(12));
    lifted - Vec3::z() * (0.55 * drop)
}
