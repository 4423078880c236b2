//! All that moves: people, robots, and objects that are pushed, carried or displaced.
//!
//! In: a scene, a configuration and a seed. Out: at any time, the poses and meshes of all actors and the spheres that darken their
//! surroundings. Actors are numbered from 1 in the order people, robots, pushed chair, carried object, displaced box, unknown object. Objects that
//! are never moved (desks, the chairs of the scene) are not actors.

pub mod displaced;
pub mod people;
mod rigid_actor;
pub mod routes;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may")]
mod tests;
pub mod tour_walker;
mod unknown;
pub mod walkway;

use nalgebra::Isometry3;
use yfslam::Camera;

use crate::camera_path::CameraPath;
use crate::config::{Activity, CarriedObject, WorldConfig};
use crate::light::{Lights, Occluder};
use crate::mesh::{Mesh, Vec3};
use crate::rig::Rig;
use crate::scene::Scene;
use displaced::DisplacedBox;
use people::body::Body;
use people::skeleton::{BONES, BonePoses};
use people::tasks::{self, Task};
use people::{Person, Plan, upright};
use rigid_actor::RigidActor;
use routes::{Route, route};
use unknown::UnknownMotion;

/// Names of the classes of actors, by the class of the boxes and detections of a [`SynthFrame`](crate::SynthFrame).
pub const CLASS_NAMES: [&str; 7] = ["person", "robot", "chair", "box", "laptop", "door", "wall"];

/// Class of an actor; the value is the index into [`CLASS_NAMES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    Person,
    Robot,
    Chair,
    Box,
    Laptop,
    Door,
    Wall,
}

/// Motion of a rigid actor.
#[derive(Clone, Debug)]
enum Motion {
    Drives(Route),
    /// Pushed or carried by the person with this index.
    Handled(usize),
    Displaced(DisplacedBox),
    Unknown(UnknownMotion),
}

/// All actors of a scene.
#[derive(Clone, Debug)]
pub struct Actors {
    people: Vec<Person>,
    rigid_actors: Vec<(RigidActor, Motion)>,
    rig: Rig,
}

/// The poses of all actors at one time.
#[derive(Clone, Debug)]
pub struct Poses {
    /// Poses of the bones of [`Actors::rig`].
    pub bones: Vec<Isometry3<f32>>,
    /// Spheres that darken their surroundings, in world coordinates.
    pub occluders: Vec<Occluder>,
}

impl Actors {
    /// Creates all actors and orders their textures from the palette of the scene.
    pub fn new(scene: &mut Scene, config: &WorldConfig, path: &CameraPath) -> Self {
        let bodies: Vec<Body> =
            (0..config.people).map(|k| Body::new(k as u8 + 1, &mut scene.palette, config.seed)).collect();
        let person = |(k, body)| Person::new(body, plan(scene, config, path, k), config.seed, k);
        let people: Vec<Person> = bodies.into_iter().enumerate().map(person).collect();
        let mut actors = Self { people, rigid_actors: Vec::new(), rig: Rig::default() };
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
        if let Some(object) = wanted.unknown {
            let motion = UnknownMotion::new(object, &scene.camera, wanted.unknown_moves);
            actors.add(Motion::Unknown(motion), |instance| {
                RigidActor::unknown(object, instance, &mut scene.palette, config.seed)
            });
        }
        actors.rigged()
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

    /// Returns the mesh of all actors at `time` seconds, in world coordinates, lit by `lights`.
    pub fn at(&self, time: f64, lights: &Lights) -> Mesh {
        self.rig.posed(&self.poses(time).bones, lights)
    }

    /// Returns the surfaces of all actors.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Returns the poses of all actors at `time` seconds.
    pub fn poses(&self, time: f64) -> Poses {
        let people: Vec<BonePoses> = self.people.iter().map(|person| person.poses(time)).collect();
        let mut occluders: Vec<Occluder> =
            self.people.iter().zip(&people).flat_map(|(person, poses)| person.occluders(poses)).collect();
        let mut bones = people.concat();
        for (rigid_actor, motion) in &self.rigid_actors {
            let Some(pose) = self.place(motion, time, &people) else { continue };
            occluders.extend(rigid_actor.occluders(&pose));
            bones.push(pose);
        }
        Poses { bones, occluders }
    }

    /// Returns the pose of a rigid actor, or `None` if nobody handles it, which no time changes.
    fn place(&self, motion: &Motion, time: f64, people: &[BonePoses]) -> Option<Isometry3<f32>> {
        Some(match motion {
            Motion::Drives(route) => {
                let step = route.at(time);
                upright(step.position.map(|v| v as f32), 0.0, (step.heading + step.glance) as f32)
            }
            Motion::Handled(by) => match &self.people[*by].plan {
                Plan::Walk(route, Task::Carry(object)) => tasks::carried(*object, route, &route.at(time), &people[*by]),
                Plan::Walk(route, _) => tasks::chair(&route.at(time)),
                _ => return None,
            },
            Motion::Displaced(displaced) => displaced.at(time),
            Motion::Unknown(motion) => motion.at(time),
        })
    }

    /// Hangs the surfaces of all actors on the bones of [`Actors::poses`].
    fn rigged(mut self) -> Self {
        let people: Vec<BonePoses> = self.people.iter().map(|person| person.poses(0.0)).collect();
        let (mut rig, mut bone) = (Rig::default(), 0);
        for person in &self.people {
            person.body.attach(&mut rig, bone);
            bone += BONES;
        }
        for (rigid_actor, motion) in &self.rigid_actors {
            if self.place(motion, 0.0, &people).is_some() {
                rigid_actor.attach(&mut rig, bone);
                bone += 1;
            }
        }
        self.rig = rig;
        self
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
