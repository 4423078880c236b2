//! Scenes: a static mesh, its lights, the start of the camera, and the places of people.

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

/// A place to sit.
#[derive(Clone, Copy, Debug)]
pub struct Seat {
    /// Middle of the top of the seat, m.
    pub position: Vec3,
    /// Direction the sitter faces: angle about +z from +y, rad.
    pub heading: f32,
}

/// Where people walk while the camera moves along the circuit of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Company {
    /// Around the furniture, away from the circuit.
    Apart,
    /// On the circuit, ahead of the camera: there is no room to pass each other.
    Ahead,
    /// On the circuit: some ahead of the camera, some towards it and past it, at this distance to the right of the circuit, m.
    BothWays(f64),
}

/// A scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The static mesh.
    pub mesh: Mesh,
    /// The textures; people add theirs.
    pub palette: Palette,
    /// The lights.
    pub lights: Lights,
    /// Pose of the camera (world from camera) at the start.
    pub camera: Isometry3<f64>,
    /// Middle of the walk around the furniture, m.
    pub walk_center: Point3<f64>,
    /// Half width of the walk in x, m.
    pub walk_half_width: f64,
    /// y of the far side of the walk, m.
    pub walk_far_y: f64,
    /// Range of y for the near side of the walk, the value closest to the camera first, m.
    pub walk_near_y: [f64; 2],
    /// Corners of a closed circuit on the floor along which a camera can be carried or driven, the first on a straight section, m.
    pub circuit: Vec<[f64; 2]>,
    /// Where people walk while the camera is on that circuit.
    pub company: Company,
    /// Places to sit.
    pub seats: Vec<Seat>,
    /// Places to stand without being in the way: position on the floor and heading.
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
