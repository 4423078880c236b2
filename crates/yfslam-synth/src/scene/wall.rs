//! Walls, and objects on and along them, in the coordinates of the wall.
//!
//! In: places along a wall. Out: geometry in a [`Builder`].

use super::builder::{Builder, Side};
use crate::mesh::Vec3;
use crate::texture::Color;
use crate::texture::material::Material;

/// A wall as seen by a person who faces it.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    /// Lower left corner, m.
    pub corner: Vec3,
    /// Direction to the right, horizontal and unit.
    pub right: Vec3,
    /// Length, m.
    pub length: f32,
}

/// Distance of flat objects from the wall, m: enough to separate them for any camera.
const PROUD_M: f32 = 0.012;

impl Wall {
    /// Returns the four walls of a room, seen from inside: north (far +y), east, south, west.
    pub fn room(x: [f32; 2], y: [f32; 2]) -> [Self; 4] {
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let wall = |corner: Vec3, right: Vec3, length: f32| Self { corner, right, length };
        let ([west, east], [south, north]) = (x, y);
        [
            wall(corner(west, north), Vec3::x(), east - west),
            wall(corner(east, north), -Vec3::y(), north - south),
            wall(corner(east, south), -Vec3::x(), east - west),
            wall(corner(west, south), Vec3::y(), north - south),
        ]
    }

    /// Returns the four walls of a block, seen from outside: its south, east, north and west side.
    pub fn block(x: [f32; 2], y: [f32; 2]) -> [Self; 4] {
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let wall = |corner: Vec3, right: Vec3, length: f32| Self { corner, right, length };
        let ([west, east], [south, north]) = (x, y);
        [
            wall(corner(west, south), Vec3::x(), east - west),
            wall(corner(east, south), Vec3::y(), north - south),
            wall(corner(east, north), -Vec3::x(), east - west),
            wall(corner(west, north), -Vec3::y(), north - south),
        ]
    }

    /// Returns the direction out of the wall.
    pub fn normal(&self) -> Vec3 {
        self.right.cross(&Vec3::z())
    }

    /// Returns the angle that turns the front (−y) of a box out of the wall.
    pub fn yaw(&self) -> f32 {
        libm::atan2f(self.right.y, self.right.x)
    }

    /// Returns the point `s` to the right, `z` up and `out` of the wall.
    pub fn at(&self, s: f32, z: f32, out: f32) -> Vec3 {
        self.corner + self.right * s + Vec3::z() * z + self.normal() * out
    }

    /// Adds a part of the wall, in panels at most `panel` wide, from height `low` to `high`.
    pub fn panels(&self, b: &mut Builder, panel: f32, [low, high]: [f32; 2], material: Material) {
        let count = (self.length / panel).ceil().max(1.0);
        let width = self.length / count;
        for k in 0..count as usize {
            let top_left = self.at(k as f32 * width, high, 0.0);
            b.rectangle(top_left, self.right * width, -Vec3::z() * (high - low), material);
        }
    }

    /// Adds a flat object to the wall: its left edge at `s`, its top at `z`.
    pub fn attach(&self, b: &mut Builder, [s, z]: [f32; 2], [width, height]: [f32; 2], material: Material) {
        b.rectangle(self.at(s, z, PROUD_M), self.right * width, -Vec3::z() * height, material);
    }

    /// Adds a box against the wall: middle at `s`, underside at `z`, size along, out of and up the wall.
    pub fn mount(&self, b: &mut Builder, [s, z]: [f32; 2], size: Vec3, material: impl Fn(Side) -> Material) {
        let base = self.at(s, z, 0.5 * size.y + 0.5 * PROUD_M);
        b.cuboid(base, size, self.yaw(), material);
    }

    /// Adds a door in its frame, in front of the skirting: left edge at `s`.
    pub fn door(&self, b: &mut Builder, s: f32, [width, height]: [f32; 2], color: Color) {
        let place = [s + width / 2.0, 0.0];
        self.mount(b, place, Vec3::new(width, 0.05, height), |side| match side {
            Side::Front => Material::Door(color),
            _ => Material::Plain([0.62, 0.63, 0.64]),
        });
    }
}
