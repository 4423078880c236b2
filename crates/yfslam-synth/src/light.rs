//! Light: area lamps with shadows for static surfaces, cheap light and contact shadows for moving ones.
//!
//! In: the lamps and a point. Out: its irradiance (linear RGB), with shadow rays for the light maps and without them for moving
//! vertices; and the darkening that moving bodies cast around them (ambient occlusion of a sphere, Quílez, "Sphere ambient
//! occlusion", 2006).

use crate::mesh::Vec3;

/// A rectangular lamp (or window) that emits light from its front.
#[derive(Clone, Copy, Debug)]
pub struct Lamp {
    /// Middle, m.
    pub center: Vec3,
    /// Half edges, m.
    pub half: [Vec3; 2],
    /// Direction of the light, unit.
    pub normal: Vec3,
    /// Radiant power per area and direction, linear RGB.
    pub radiance: [f32; 3],
    /// Whether its brightness never changes; the others flicker together.
    pub steady: bool,
}

/// All light sources of a scene.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Area lamps.
    pub lamps: Vec<Lamp>,
    /// Reflected light of the room, from above and from below, linear RGB.
    pub ambient: [[f32; 3]; 2],
}

/// A sphere of a moving body that darkens its surroundings.
#[derive(Clone, Copy, Debug)]
pub struct Occluder {
    /// Centre in the coordinates of the points, m.
    pub center: Vec3,
    /// Radius, m.
    pub radius: f32,
}

/// Beyond this distance a hit does not reduce ambient light, m.
const AMBIENT_REACH_M: f32 = 1.5;
/// Share of ambient light that still comes from a surface nearby.
const BOUNCED: f32 = 0.35;
/// Keeps the light finite at the lamp itself, m².
const SOFTENING_M2: f32 = 0.05;
/// Irradiance below which the contribution of a lamp is ignored: it could not change a grey level.
const NEGLIGIBLE: f32 = 0.002;
/// Offset of ray origins from their own surface, m.
const OFFSET_M: f32 = 2e-3;

impl Lamp {
    fn area(&self) -> f32 {
        4.0 * self.half[0].norm() * self.half[1].norm()
    }

    /// Returns whether the lamp could add a visible contribution at `point`.
    fn matters_at(&self, point: &Vec3) -> bool {
        let strongest = self.radiance.iter().copied().fold(0.0, f32::max);
        strongest * self.area() > NEGLIGIBLE * (self.center - point).norm_squared()
    }
}

impl Lights {
    /// Returns the irradiance at a point, and in the fourth lane the share of it that flickers. `hidden(origin, direction,
    /// distance)` returns whether the ray is blocked; `samples` is the number of rays per lamp; the ambient term takes
    /// twice as many. All points use the same sample pattern: the remaining error is smooth over a surface instead of mottled.
    pub fn irradiance(
        &self,
        point: &Vec3,
        normal: &Vec3,
        samples: usize,
        hidden: &impl Fn(&Vec3, &Vec3, f32) -> bool,
    ) -> [f32; 4] {
        let origin = point + normal * OFFSET_M;
        // Steady and flickering light.
        let mut sums = [[0.0; 3]; 2];
        for lamp in self.lamps.iter().filter(|lamp| lamp.matters_at(&origin)) {
            let sum = &mut sums[usize::from(!lamp.steady)];
            for [a, b] in (0..samples.max(1)).map(scattered) {
                let to = lamp.center + lamp.half[0] * (2.0 * a - 1.0) + lamp.half[1] * (2.0 * b - 1.0) - origin;
                let distance = to.norm();
                let direction = to / distance;
                let (facing, leaving) = (normal.dot(&direction), -lamp.normal.dot(&direction));
                if facing > 0.0 && leaving > 0.0 && (samples == 0 || !hidden(&origin, &direction, distance - 0.02)) {
                    let gain =
                        facing * leaving * lamp.area() / (distance * distance + SOFTENING_M2) / samples.max(1) as f32;
                    (0..3).for_each(|k| sum[k] += lamp.radiance[k] * gain);
                }
            }
        }
        let rays = 2 * samples;
        let open = (0..rays)
            .map(scattered)
            .map(|[s, t]| if hidden(&origin, &hemisphere(normal, s, t), AMBIENT_REACH_M) { BOUNCED } else { 1.0 });
        let open = if rays == 0 { 1.0 } else { open.sum::<f32>() / rays as f32 };
        let (ambient, unsteady) = (self.ambient_light(normal), self.unsteady_share());
        for k in 0..3 {
            sums[0][k] += open * ambient[k] * (1.0 - unsteady);
            sums[1][k] += open * ambient[k] * unsteady;
        }
        let total: [f32; 3] = std::array::from_fn(|k| sums[0][k] + sums[1][k]);
        let flickering = sums[1].iter().sum::<f32>() / total.iter().sum::<f32>().max(1e-6);
        [total[0], total[1], total[2], flickering]
    }

    /// Returns the share of all power that comes from flickering lamps; reflected light has this share too.
    fn unsteady_share(&self) -> f32 {
        let power = |lamp: &Lamp| lamp.area() * lamp.radiance.iter().sum::<f32>();
        let all: f32 = self.lamps.iter().map(power).sum();
        let unsteady: f32 = self.lamps.iter().filter(|lamp| !lamp.steady).map(power).sum();
        if all > 0.0 { unsteady / all } else { 0.0 }
    }

    /// Returns the same lamps with those that flicker at `brightness`.
    pub fn dimmed(&self, brightness: f32) -> Self {
        let share = self.unsteady_share();
        let mut dimmed = self.clone();
        for lamp in dimmed.lamps.iter_mut().filter(|lamp| !lamp.steady) {
            lamp.radiance = lamp.radiance.map(|c| c * brightness);
        }
        let bounced = 1.0 + share * (brightness - 1.0);
        dimmed.ambient = dimmed.ambient.map(|side| side.map(|c| c * bounced));
        dimmed
    }

    /// Returns the ambient light for a normal, by how far it points up.
    fn ambient_light(&self, normal: &Vec3) -> [f32; 3] {
        let up = 0.5 + 0.5 * normal.z;
        std::array::from_fn(|k| self.ambient[0][k] * up + self.ambient[1][k] * (1.0 - up))
    }

    /// Returns the light on a moving vertex: lamps without shadow rays, and the ambient term.
    pub fn on_vertex(&self, point: &Vec3, normal: &Vec3) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for lamp in self.lamps.iter().filter(|lamp| lamp.matters_at(point)) {
            let to = lamp.center - point;
            let distance2 = to.norm_squared();
            let direction = to / distance2.sqrt();
            // A large lamp also lights surfaces slightly turned away.
            let facing = (normal.dot(&direction) * 0.8 + 0.2).max(0.0) * (-lamp.normal.dot(&direction)).max(0.0);
            let gain = facing * lamp.area() / (distance2 + SOFTENING_M2);
            (0..3).for_each(|k| sum[k] += lamp.radiance[k] * gain);
        }
        let ambient = self.ambient_light(normal);
        std::array::from_fn(|k| sum[k] + 0.9 * ambient[k])
    }
}

impl Occluder {
    /// Returns the distance beyond which the sphere is ignored, m: seven radii, where it would take 2 % of the light.
    pub fn reach(&self) -> f32 {
        7.0 * self.radius
    }

    /// Returns the share of light that the sphere leaves at a point with the given normal.
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

/// Returns point number `i` of a sequence that fills [0, 1]² evenly: the additive recurrence of the plastic number (Roberts, "The
/// unreasonable effectiveness of quasirandom sequences", 2018).
pub fn scattered(i: usize) -> [f32; 2] {
    let n = i as f32 + 0.5;
    [(n * 0.754_877_7).fract(), (n * 0.569_840_3).fract()]
}

/// Returns a cosine-weighted direction around `normal` (Malley's method).
pub fn hemisphere(normal: &Vec3, s: f32, t: f32) -> Vec3 {
    let axis = if normal.z.abs() < 0.7 { Vec3::z() } else { Vec3::x() };
    let a = normal.cross(&axis).normalize();
    let b = normal.cross(&a);
    let (sin, cos) = libm::sincosf(t * std::f32::consts::TAU);
    let r = s.sqrt();
    a * (r * cos) + b * (r * sin) + normal * (1.0 - s).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp(x: f32, steady: bool) -> Lamp {
        let half = [Vec3::x() * 0.3, Vec3::y() * 0.2];
        Lamp { center: Vec3::new(x, 0.0, 2.5), half, normal: -Vec3::z(), radiance: [2.0, 1.9, 1.8], steady }
    }

    #[test]
    fn the_flickering_share_of_light_is_removed_by_dimming() {
        let lights = Lights { lamps: vec![lamp(-1.0, true), lamp(1.5, false)], ambient: [[0.3; 3], [0.2; 3]] };
        let at = |lights: &Lights| lights.irradiance(&Vec3::new(0.4, 0.2, 0.0), &Vec3::z(), 4, &|_, _, _| false);
        let (full, dim) = (at(&lights), at(&lights.dimmed(0.3)));
        assert!((0.2..0.8).contains(&full[3]), "{full:?}");
        let gain = 1.0 + full[3] * (0.3 - 1.0);
        let (before, after) = (full[..3].iter().sum::<f32>(), dim[..3].iter().sum::<f32>());
        assert!((before * gain - after).abs() < 1e-4, "{before} times {gain} is not {after}");
    }
}
