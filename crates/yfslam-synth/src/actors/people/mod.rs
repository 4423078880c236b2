//! People: their bodies and their movements.
//!
//! In: a body and a plan. Out: at any time, the posed skeleton and the place of the object that the person pushes or carries.

pub mod body;
pub mod gait;
mod head;
pub mod skeleton;
pub mod tasks;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

use super::routes::Route;
use crate::light::Occluder;
use crate::mesh::Vec3;
use crate::rng::{Rng, hash};
use crate::scene::Seat;
use body::Body;
use skeleton::{Bone, BonePoses, Joints};
use tasks::Task;

/// The activity of one person.
#[derive(Clone, Debug)]
pub enum Plan {
    /// Walks along a route, possibly with a task.
    Walk(Route, Task),
    /// Sits and gestures.
    Sit(Seat),
    /// Repeatedly sits down and gets up.
    SitAndRise(Seat),
    /// Stands and gestures.
    Stand(Seat),
}

/// One person.
#[derive(Clone, Debug)]
pub struct Person {
    /// The body.
    pub body: Body,
    /// The activity.
    pub plan: Plan,
    seed: u64,
}

/// Height of the hip joints above the seat, m.
const HIPS_ABOVE_SEAT_M: f32 = 0.09;

/// Returns an upright pose on the floor.
pub fn upright(position: [f32; 2], z: f32, heading: f32) -> Isometry3<f32> {
    let turn = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), heading);
    Isometry3::from_parts(Translation3::new(position[0], position[1], z), turn)
}

/// Returns a smooth step from 0 at `t` = 0 to 1 at `t` = 1.
pub fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl Person {
    /// Creates person number `k` (from 0) of a world with the given seed.
    pub fn new(body: Body, plan: Plan, seed: u64, k: usize) -> Self {
        Self { body, plan, seed: hash(seed, 100 + k as u64) }
    }

    /// Returns the poses of the bones at `time` seconds.
    pub fn poses(&self, time: f64) -> BonePoses {
        let p = &self.body.proportions;
        let (seed, t) = (self.seed, time as f32);
        match &self.plan {
            Plan::Walk(route, task) => {
                let step = route.at(time);
                let mut joints = gait::walk(p, step.distance as f32, step.speed as f32, seed, t);
                let turn = task.prepare(route, &step, &mut joints);
                let position = step.position.map(|v| v as f32);
                let heading = step.heading as f32 + turn.unwrap_or(step.glance as f32);
                let root = upright(position, self.height_on_floor(&joints), heading);
                let mut poses = skeleton::forward_kinematics(&root, p, &joints);
                task.hands(route, &step, p, &mut poses);
                poses
            }
            Plan::Sit(seat) => self.seated(seat, 0.0, t),
            Plan::SitAndRise(seat) => self.seated(seat, rising(seed, t), t),
            Plan::Stand(s) => {
                let joints = gait::stand(seed, t);
                let root = upright([s.position.x, s.position.y], self.height_on_floor(&joints), s.heading);
                skeleton::forward_kinematics(&root, p, &joints)
            }
        }
    }

    /// Returns the poses between sitting (0) and standing (1) in front of the seat. The feet stay in place.
    fn seated(&self, seat: &Seat, risen: f32, time: f32) -> BonePoses {
        let p = &self.body.proportions;
        let hips = seat.position.z + HIPS_ABOVE_SEAT_M;
        let sitting = gait::sit(p, hips, self.seed, time);
        let standing = gait::stand(self.seed, time);
        let mut joints = sitting.blend(&standing, risen);
        // To get up, a person leans over the feet.
        joints.trunk[0] += 0.75 * libm::sinf(std::f32::consts::PI * risen);
        let ankle = |j: &Joints| {
            let poses = skeleton::forward_kinematics(&Isometry3::identity(), p, j);
            let [right, left] = [0, 1].map(|side| poses[Bone::Foot(side).index()].translation.vector);
            (right + left) / 2.0
        };
        let forward = ankle(&sitting).y - ankle(&joints).y;
        let root = upright([seat.position.x, seat.position.y], self.height_on_floor(&joints), seat.heading)
            * Isometry3::from_parts(Translation3::new(0.0, forward, 0.0), UnitQuaternion::identity());
        skeleton::forward_kinematics(&root, p, &joints)
    }

    /// Returns the height of the hips at which the lower foot touches the floor.
    fn height_on_floor(&self, joints: &Joints) -> f32 {
        let p = &self.body.proportions;
        -skeleton::lowest_sole(&skeleton::forward_kinematics(&Isometry3::identity(), p, joints), p)
    }

    /// Returns spheres in the trunk, the legs and the feet.
    pub fn occluders(&self, poses: &BonePoses) -> Vec<Occluder> {
        let sphere = |bone: Bone, z: f32, radius: f32| Occluder {
            center: (poses[bone.index()] * Point3::new(0.0, 0.0, z)).coords,
            radius,
        };
        let mut spheres = vec![sphere(Bone::Chest, 0.30, 0.20), sphere(Bone::Pelvis, 0.0, 0.18)];
        for side in [0, 1] {
            spheres.push(sphere(Bone::Shank(side), 0.0, 0.10));
            spheres.push(sphere(Bone::Foot(side), 0.02, 0.09));
        }
        spheres
    }
}

/// Returns how far a person has got up at `time`: the person sits for some seconds, takes 1.6 s to get up, stands, and takes 1.8 s
/// to sit down.
fn rising(seed: u64, time: f32) -> f32 {
    let mut rng = Rng::new(seed, 0x515);
    let (sits, stands, phase) = (rng.range(2.5, 4.5), rng.range(2.0, 4.0), rng.range(0.0, 1.0));
    let period = sits + stands + 3.4;
    let t = (time + phase * period).rem_euclid(period);
    smooth((t - sits) / 1.6) * (1.0 - smooth((t - sits - 1.6 - stands) / 1.8))
}
