//! All that moves: people, robots, and objects that are pushed, carried or displaced.
//!
//! In: a scene, a configuration and a seed. Out: at any time, the posed meshes of all actors and the spheres that darken their
//! surroundings. Actors are numbered from 1 in the order people, robots, pushed chair, carried object, displaced box. Objects that
//! are never moved (desks, the chairs of the scene) are not actors.

pub mod displaced;
pub mod people;
mod rigid_actor;
pub mod routes;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may")]
mod tests;
pub mod tour_walker;
pub mod walkway;

use yfslam::Camera;

use crate::camera_path::CameraPath;
use crate::config::{Activity, CarriedObject, WorldConfig};
use crate::light::{Lights, Occluder};
use crate::mesh::{Mesh, Vec3};
use crate::scene::Scene;
use displaced::DisplacedBox;
use people::body::Body;
use people::skeleton::BonePoses;
use people::tasks::{self, Task};
use people::{Person, Plan, upright};
use rigid_actor::RigidActor;
use routes::{Route, route};

/// Names of the classes of actors, by the class of the boxes and detections of a [`SynthFrame`](crate::SynthFrame).
pub const CLASS_NAMES: [&str; 5] = ["person", "robot", "chair", "box", "laptop"];

/// Class of an actor; the value is the index into [`CLASS_NAMES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    Person,
    Robot,
    Chair,
    Box,
    Laptop,
}

/// Motion of a rigid actor.
#[derive(Clone, Debug)]
enum Motion {
    Drives(Route),
    /// Pushed or carried by the person with this index.
    Handled(usize),
    Displaced(DisplacedBox),
}

/// All actors of a scene.
#[derive(Clone, Debug)]
pub struct Actors {
    people: Vec<Person>,
    rigid_actors: Vec<(RigidActor, Motion)>,
}

impl Actors {
    /// Creates all actors and orders their textures from the palette of the scene.
    pub fn new(scene: &mut Scene, config: &WorldConfig, path: &CameraPath) -> Self {
        let bodies: Vec<Body> =
            (0..config.people).map(|k| Body::new(k as u8 + 1, &mut scene.palette, config.seed)).collect();
        let person = |(k, body)| Person::new(body, plan(scene, config, path, k), config.seed, k);
        let people: Vec<Person> = bodies.into_iter().enumerate().map(person).collect();
        let mut actors = Self { people, rigid_actors: Vec::new() };
        let wanted = &config.actors;
        for robot in 0..wanted.robots {
            let route = route(scene, config, path, config.people + robot, 0.5);
            actors.add(Motion::Drives(route), |instance| RigidActor::robot(instance, &mut scene.palette, config.seed));
        }
        if let Some(pusher) = routes::pusher(config) {
            actors
                .add(Motion::Handled(pusher), |instance| RigidActor::chair(instance, &mut scene.palette, config.seed));
        }
        if let Some(carrier) = routes::carrier(config) {
            actors.add(Motion::Handled(carrier), |instance| match wanted.carried_object {
                CarriedObject::Box => {
                    RigidActor::cardboard(instance, &mut scene.palette, tasks::BOX_M.into(), config.seed)
                }
                CarriedObject::Laptop => {
                    RigidActor::laptop(instance, &mut scene.palette, tasks::LAPTOP_M.into(), config.seed)
                }
            });
        }
        if wanted.moved_object {
            let displaced = DisplacedBox::new(scene, config, path);
            actors.add(Motion::Displaced(displaced), |instance| {
                RigidActor::cardboard(instance, &mut scene.palette, displaced::BOX_M.into(), config.seed ^ 0xb)
            });
        }
        actors
    }

    fn add(&mut self, motion: Motion, rigid_actor: impl FnOnce(u8) -> RigidActor) {
        let instance = (self.people.len() + self.rigid_actors.len() + 1) as u8;
        self.rigid_actors.push((rigid_actor(instance), motion));
    }

    /// Returns the number of actors.
    pub fn len(&self) -> usize {
        self.people.len() + self.rigid_actors.len()
    }

    /// Returns the class of actor number `instance` (from 1).
    pub fn class(&self, instance: u8) -> Class {
        let index = usize::from(instance).saturating_sub(1);
        match index.checked_sub(self.people.len()) {
            Some(rigid_actor) => {
                self.rigid_actors.get(rigid_actor).map_or(Class::Box, |(rigid_actor, _)| rigid_actor.class)
            }
            None => Class::Person,
        }
    }

    /// Moves the routes of all walkers and drivers closer to the camera (up to 2) or farther from it (0); the further below 0, the
    /// later they pass the camera.
    pub fn set_closeness(&mut self, scene: &Scene, config: &WorldConfig, path: &CameraPath, closeness: f64) {
        let walkers = self.people.iter_mut().enumerate().filter_map(|(k, person)| match &mut person.plan {
            Plan::Walk(route, _) => Some((k, route)),
            _ => None,
        });
        let drivers = self.rigid_actors.iter_mut().filter_map(|(_, motion)| match motion {
            Motion::Drives(route) => Some(route),
            _ => None,
        });
        for (k, old) in walkers.chain(drivers.enumerate().map(|(k, route)| (config.people + k, route))) {
            *old = route(scene, config, path, k, closeness);
        }
    }

    /// Returns whether any actor walks or drives along a route.
    pub fn has_walkers(&self) -> bool {
        self.people.iter().any(|person| matches!(person.plan, Plan::Walk(..)))
            || self.rigid_actors.iter().any(|(_, motion)| matches!(motion, Motion::Drives(_)))
    }

    /// Returns the mesh and the occluders of all actors at `time` seconds, in world coordinates.
    pub fn at(&self, time: f64, lights: &Lights) -> (Mesh, Vec<Occluder>) {
        let (mut mesh, mut occluders) = (Mesh::default(), Vec::new());
        let poses: Vec<BonePoses> = self.people.iter().map(|person| person.poses(time)).collect();
        for (person, poses) in self.people.iter().zip(&poses) {
            person.body.pose(poses, lights, &mut mesh);
            occluders.extend(person.occluders(poses));
        }
        for (rigid_actor, motion) in &self.rigid_actors {
            let pose = match motion {
                Motion::Drives(route) => {
                    let step = route.at(time);
                    upright(step.position.map(|v| v as f32), 0.0, (step.heading + step.glance) as f32)
                }
                Motion::Handled(by) => match &self.people[*by].plan {
                    Plan::Walk(route, Task::Carry(object)) => {
                        tasks::carried(*object, route, &route.at(time), &poses[*by])
                    }
                    Plan::Walk(route, _) => tasks::chair(&route.at(time)),
                    _ => continue,
                },
                Motion::Displaced(displaced) => displaced.at(time),
            };
            rigid_actor.pose(&pose, lights, &mut mesh);
            occluders.extend(rigid_actor.occluders(&pose));
        }
        (mesh, occluders)
    }
}

/// Returns the activity of person `k`.
fn plan(scene: &Scene, config: &WorldConfig, path: &CameraPath, k: usize) -> Plan {
    let walk = || {
        let task = match k {
            _ if routes::pusher(config) == Some(k) => Task::Push,
            _ if routes::carrier(config) == Some(k) => Task::Carry(config.actors.carried_object),
            _ => Task::Nothing,
        };
        Plan::Walk(route(scene, config, path, k, 0.5), task)
    };
    let seats = scene.seats.len();
    match config.activity {
        Activity::Walking => walk(),
        Activity::Sitting => match (scene.seats.get(k), scene.stands.get(k.saturating_sub(seats))) {
            (Some(seat), _) => Plan::Sit(*seat),
            (None, Some(place)) => Plan::Stand(*place),
            (None, None) => walk(),
        },
        // The last people take the seats.
        Activity::Crowd => match scene.seats.get(config.people - 1 - k) {
            Some(seat) if k + 1 == config.people => Plan::SitAndRise(*seat),
            Some(seat) => Plan::Sit(*seat),
            None => walk(),
        },
    }
}

/// Returns whether any part of a ball is in the view of the camera.
fn in_view(camera: &Camera, t_cam_world: &nalgebra::Isometry3<f64>, center: &Vec3, radius: f64) -> bool {
    let p = (t_cam_world * nalgebra::Point3::from(center.cast::<f64>())).coords;
    let size = [(camera.width, camera.fx, camera.cx, p.x), (camera.height, camera.fy, camera.cy, p.y)];
    // Planes through the centre of projection and the edges of the image; distortion is allowed for by a tenth of the image size.
    p.z > -radius
        && size.iter().all(|&(pixels, focal, middle, offset)| {
            let slack = 0.1 * pixels as f64;
            let (low, high) = ((-slack - middle) / focal, (pixels as f64 + slack - middle) / focal);
            let beyond = |slope: f64, side: f64| side * (offset - slope * p.z) / (1.0 + slope * slope).sqrt();
            beyond(low, -1.0) < radius && beyond(high, 1.0) < radius
        })
}
