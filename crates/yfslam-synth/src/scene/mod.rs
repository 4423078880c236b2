//! Places: a static mesh, its lights, where the camera stands and where people may be.

pub mod builder;
mod corridor;
pub mod furniture;
mod lab;
mod office;
mod rescue;
mod wall;

use nalgebra::{Isometry3, Point3};

use crate::config::SceneKind;
use crate::light::Lights;
use crate::mesh::{Mesh, Vec3};
use builder::Palette;

/// A place where someone can sit.
#[derive(Clone, Copy, Debug)]
pub struct Seat {
    /// Middle of the seat's top, m.
    pub position: Vec3,
    /// Direction the sitter faces: angle about +z from +y, rad.
    pub heading: f32,
}

/// Where people walk while the camera goes on the round of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Company {
    /// Around the furniture, which keeps clear of the round.
    Apart,
    /// On the round, ahead of the camera: it leaves no room to meet anyone.
    Ahead,
    /// On the round: some ahead of the camera, some towards it and past it, so far to the right of the round, m.
    BothWays(f64),
}

/// A place.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Everything that stands still.
    pub mesh: Mesh,
    /// Its textures; people add theirs.
    pub palette: Palette,
    /// Its lights.
    pub lights: Lights,
    /// World from camera at the start.
    pub camera: Isometry3<f64>,
    /// Middle of the walk around the furniture, m.
    pub walk_center: Point3<f64>,
    /// Half width of the walk in x, m.
    pub walk_half_width: f64,
    /// y of the far side of the walk, m.
    pub walk_far_y: f64,
    /// Range of y for the near side of the walk: closest to the camera first, m.
    pub walk_near_y: [f64; 2],
    /// Corners of a closed round on the floor along which a camera can be carried or driven, the first on a straight, m.
    pub circuit: Vec<[f64; 2]>,
    /// Where people walk while the camera is on that round.
    pub company: Company,
    /// Where people can sit.
    pub seats: Vec<Seat>,
    /// Where people can stand without being in the way: position on the floor and heading.
    pub stands: Vec<Seat>,
}

impl Scene {
    /// Builds a scene; the seed varies its prints and clutter.
    pub fn new(kind: SceneKind, seed: u64) -> Self {
        match kind {
            SceneKind::Office => office::build(seed),
            SceneKind::Rescue => rescue::build(seed),
            SceneKind::Corridor => corridor::build(seed),
            SceneKind::Lab => lab::build(seed),
        }
    }
}
