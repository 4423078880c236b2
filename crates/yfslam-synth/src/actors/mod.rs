//! All that moves: people, robots, and things that are pushed, carried or displaced.
//!
//! In: a scene, a configuration and a seed. Out: at any time, everyone's posed meshes and the spheres that shade their
//! surroundings. Actors are numbered from 1 in the order people, robots, pushed chair, carried object, displaced box. What
//! nobody can move (desks, the chairs of the scene) is no actor.

pub mod companion;
pub mod displaced;
pub mod people;
pub mod rounds;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may")]
mod tests;
mod thing;
pub mod walkway;

use yfslam::Camera;

use crate::camera_path::CameraPath;
use crate::config::{Activity, CarriedObject, WorldConfig};
use crate::light::{Lights, Occluder};
use crate::mesh::{Mesh, Vec3};
use crate::scene::Scene;
use displaced::Displaced;
use people::body::Body;
use people::skeleton::BonePoses;
use people::tasks::{self, Task};
use people::{Person, Plan, upright};
use rounds::{Way, way};
use thing::Thing;

/// Names of the classes of actors, by the class of a [`SynthFrame`](crate::SynthFrame)'s boxes and detections.
pub const CLASS_NAMES: [&str; 5] = ["person", "robot", "chair", "box", "laptop"];

/// What an actor is; the value is the index into [`CLASS_NAMES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    Person,
    Robot,
    Chair,
    Box,
    Laptop,
}

/// Where a thing is.
#[derive(Clone, Debug)]
enum Motion {
    Drives(Way),
    /// Pushed or carried by the person of this index.
    Handled(usize),
    Displaced(Displaced),
}

/// Everyone and everything that moves in a scene.
#[derive(Clone, Debug)]
pub struct Actors {
    people: Vec<Person>,
    things: Vec<(Thing, Motion)>,
}

impl Actors {
    /// Invites everyone. Their textures are ordered from the scene's palette.
    pub fn new(scene: &mut Scene, config: &WorldConfig, path: &CameraPath) -> Self {
        let bodies: Vec<Body> =
            (0..config.people).map(|k| Body::new(k as u8 + 1, &mut scene.palette, config.seed)).collect();
        let person = |(k, body)| Person::new(body, plan(scene, config, path, k), config.seed, k);
        let people: Vec<Person> = bodies.into_iter().enumerate().map(person).collect();
        let mut actors = Self { people, things: Vec::new() };
        let wanted = &config.actors;
        for robot in 0..wanted.robots {
            let way = way(scene, config, path, config.people + robot, 0.5);
            actors.add(Motion::Drives(way), |instance| Thing::robot(instance, &mut scene.palette, config.seed));
        }
        if let Some(pusher) = rounds::pusher(config) {
            actors.add(Motion::Handled(pusher), |instance| Thing::chair(instance, &mut scene.palette, config.seed));
        }
        if let Some(carrier) = rounds::carrier(config) {
            actors.add(Motion::Handled(carrier), |instance| match wanted.carried_object {
                CarriedObject::Box => Thing::cardboard(instance, &mut scene.palette, tasks::BOX_M.into(), config.seed),
                CarriedObject::Laptop => {
                    Thing::laptop(instance, &mut scene.palette, tasks::LAPTOP_M.into(), config.seed)
                }
            });
        }
        if wanted.moved_object {
            let way = Displaced::new(scene, config, path);
            actors.add(Motion::Displaced(way), |instance| {
                Thing::cardboard(instance, &mut scene.palette, displaced::BOX_M.into(), config.seed ^ 0xb)
            });
        }
        actors
    }

    fn add(&mut self, motion: Motion, thing: impl FnOnce(u8) -> Thing) {
        let instance = (self.people.len() + self.things.len() + 1) as u8;
        self.things.push((thing(instance), motion));
    }

    /// Number of actors.
    pub fn len(&self) -> usize {
        self.people.len() + self.things.len()
    }

    /// What actor number `instance` (from 1) is.
    pub fn class(&self, instance: u8) -> Class {
        let index = usize::from(instance).saturating_sub(1);
        match index.checked_sub(self.people.len()) {
            Some(thing) => self.things.get(thing).map_or(Class::Box, |(thing, _)| thing.class),
            None => Class::Person,
        }
    }

    /// Leads all who go round nearer to the camera (up to 2) or farther from it (0); the further below 0, the later they
    /// come by.
    pub fn set_closeness(&mut self, scene: &Scene, config: &WorldConfig, path: &CameraPath, closeness: f64) {
        let walkers = self.people.iter_mut().enumerate().filter_map(|(k, person)| match &mut person.plan {
            Plan::Walk(way, _) => Some((k, way)),
            _ => None,
        });
        let drivers = self.things.iter_mut().filter_map(|(_, motion)| match motion {
            Motion::Drives(way) => Some(way),
            _ => None,
        });
        for (k, old) in walkers.chain(drivers.enumerate().map(|(k, way)| (config.people + k, way))) {
            *old = way(scene, config, path, k, closeness);
        }
    }

    /// Whether anyone goes round.
    pub fn anyone_walks(&self) -> bool {
        self.people.iter().any(|person| matches!(person.plan, Plan::Walk(..)))
            || self.things.iter().any(|(_, motion)| matches!(motion, Motion::Drives(_)))
    }

    /// Everyone's mesh and occluders at `time` seconds, in world coordinates.
    pub fn at(&self, time: f64, lights: &Lights) -> (Mesh, Vec<Occluder>) {
        let (mut mesh, mut occluders) = (Mesh::default(), Vec::new());
        let poses: Vec<BonePoses> = self.people.iter().map(|person| person.poses(time)).collect();
        for (person, poses) in self.people.iter().zip(&poses) {
            person.body.pose(poses, lights, &mut mesh);
            occluders.extend(person.occluders(poses));
        }
        for (thing, motion) in &self.things {
            let pose = match motion {
                Motion::Drives(way) => {
                    let step = way.at(time);
                    upright(step.position.map(|v| v as f32), 0.0, (step.heading + step.glance) as f32)
                }
                Motion::Handled(by) => match &self.people[*by].plan {
                    Plan::Walk(way, Task::Carry(object)) => tasks::carried(*object, way, &way.at(time), &poses[*by]),
                    Plan::Walk(way, _) => tasks::chair(&way.at(time)),
                    _ => continue,
                },
                Motion::Displaced(way) => way.at(time),
            };
            thing.pose(&pose, lights, &mut mesh);
            occluders.extend(thing.occluders(&pose));
        }
        (mesh, occluders)
    }
}

/// What person `k` does.
fn plan(scene: &Scene, config: &WorldConfig, path: &CameraPath, k: usize) -> Plan {
    let walk = || {
        let task = match k {
            _ if rounds::pusher(config) == Some(k) => Task::Push,
            _ if rounds::carrier(config) == Some(k) => Task::Carry(config.actors.carried_object),
            _ => Task::Nothing,
        };
        Plan::Walk(way(scene, config, path, k, 0.5), task)
    };
    let seats = scene.seats.len();
    match config.activity {
        Activity::Walking => walk(),
        Activity::Sitting => match (scene.seats.get(k), scene.stands.get(k.saturating_sub(seats))) {
            (Some(seat), _) => Plan::Sit(*seat),
            (None, Some(place)) => Plan::Stand(*place),
            (None, None) => walk(),
        },
        // The last ones take the seats.
        Activity::Crowd => match scene.seats.get(config.people - 1 - k) {
            Some(seat) if k + 1 == config.people => Plan::SitAndRise(*seat),
            Some(seat) => Plan::Sit(*seat),
            None => walk(),
        },
    }
}

/// Whether the camera sees some of a ball.
fn in_view(camera: &Camera, t_cam_world: &nalgebra::Isometry3<f64>, center: &Vec3, radius: f64) -> bool {
    let p = (t_cam_world * nalgebra::Point3::from(center.cast::<f64>())).coords;
    let size = [(camera.width, camera.fx, camera.cx, p.x), (camera.height, camera.fy, camera.cy, p.y)];
    // Planes through the centre of projection and the picture's edges; distortion is allowed for by a tenth of its size.
    p.z > -radius
        && size.iter().all(|&(pixels, focal, middle, offset)| {
            let slack = 0.1 * pixels as f64;
            let (low, high) = ((-slack - middle) / focal, (pixels as f64 + slack - middle) / focal);
            let beyond = |slope: f64, side: f64| side * (offset - slope * p.z) / (1.0 + slope * slope).sqrt();
            beyond(low, -1.0) < radius && beyond(high, 1.0) < radius
        })
}
