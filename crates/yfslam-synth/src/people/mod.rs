//! People: who they are, where they go and how they move.
//!
//! In: a scene, an activity and a seed. Out: at any time, their posed meshes and the spheres that shade their surroundings.

pub mod body;
pub mod gait;
pub mod skeleton;
pub mod walkway;

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use crate::config::{Activity, WorldConfig};
use crate::light::{Lights, Occluder};
use crate::mesh::{Mesh, Vec3};
use crate::rng::{Rng, hash};
use crate::scene::{Scene, Seat};
use body::Body;
use skeleton::{Bone, BonePoses};
use walkway::{Stop, Walkway};

/// What one person does.
#[derive(Clone, Debug)]
enum Plan {
    Walk(Walkway),
    Sit(Seat),
    Stand(Seat),
}

/// One person.
#[derive(Clone, Debug)]
pub struct Person {
    body: Body,
    plan: Plan,
    seed: u64,
}

/// Everyone in a scene.
#[derive(Clone, Debug)]
pub struct People {
    people: Vec<Person>,
}

impl People {
    /// Invites everyone. Their textures are ordered from the scene's palette.
    pub fn new(scene: &mut Scene, config: &WorldConfig) -> Self {
        let people = (0..config.people)
            .map(|k| {
                let body = Body::new(k as u8 + 1, &mut scene.palette, config.seed);
                let plan = match (
                    config.activity,
                    scene.seats.get(k),
                    scene.stands.get(k.saturating_sub(scene.seats.len())),
                ) {
                    (Activity::Sitting, Some(seat), _) => Plan::Sit(*seat),
                    (Activity::Sitting, None, Some(place)) => Plan::Stand(*place),
                    _ => Plan::Walk(walk_plan(scene, k, config, 0.5)),
                };
                Person { body, plan, seed: hash(config.seed, 100 + k as u64) }
            })
            .collect();
        Self { people }
    }

    /// Leads the walkers nearer to the camera (1) or farther from it (0); the further below 0, the later they come by.
    pub fn set_closeness(&mut self, scene: &Scene, config: &WorldConfig, closeness: f64) {
        for (k, person) in self.people.iter_mut().enumerate() {
            if let Plan::Walk(walkway) = &mut person.plan {
                *walkway = walk_plan(scene, k, config, closeness);
            }
        }
    }

    /// Whether anyone walks.
    pub fn anyone_walks(&self) -> bool {
        self.people.iter().any(|person| matches!(person.plan, Plan::Walk(_)))
    }

    /// Everyone's mesh and occluders at `time` seconds, in world coordinates.
    pub fn at(&self, time: f64, lights: &Lights) -> (Mesh, Vec<Occluder>) {
        let (mut mesh, mut occluders) = (Mesh::default(), Vec::new());
        for person in &self.people {
            let poses = person.poses(time);
            person.body.pose(&poses, lights, &mut mesh);
            occluders.extend(person.occluders(&poses));
        }
        (mesh, occluders)
    }
}

impl Person {
    fn poses(&self, time: f64) -> BonePoses {
        let p = &self.body.proportions;
        let place = |x: f32, y: f32, z: f32, heading: f32| {
            Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_axis_angle(&Vec3::z_axis(), heading))
        };
        let (joints, x, y, heading, seat_z) = match &self.plan {
            Plan::Walk(walkway) => {
                let step = walkway.at(time);
                let joints = gait::walk(p, step.distance as f32, step.speed as f32, self.seed, time as f32);
                (joints, step.position[0] as f32, step.position[1] as f32, step.heading as f32, None)
            }
            Plan::Sit(s) => {
                (gait::sit(self.seed, time as f32), s.position.x, s.position.y, s.heading, Some(s.position.z))
            }
            Plan::Stand(s) => (gait::stand(self.seed, time as f32), s.position.x, s.position.y, s.heading, None),
        };
        let z = match seat_z {
            // The hip joints are about 9 cm above the seat.
            Some(z) => z + 0.09,
            None => {
                let grounded = skeleton::forward_kinematics(&Isometry3::identity(), p, &joints);
                -skeleton::lowest_sole(&grounded, p)
            }
        };
        skeleton::forward_kinematics(&place(x, y, z, heading), p, &joints)
    }

    /// Spheres in the trunk, the legs and the feet.
    fn occluders(&self, poses: &BonePoses) -> Vec<Occluder> {
        let sphere = |bone: Bone, z: f32, radius: f32| Occluder {
            center: (poses[bone.index()] * nalgebra::Point3::new(0.0, 0.0, z)).coords,
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

/// The round of walker `k`: an oval around the furniture in one of two lanes, walked in opposite directions. The closer,
/// the longer one lingers in front of the camera, too, and the shorter out of its sight.
fn walk_plan(scene: &Scene, k: usize, config: &WorldConfig, closeness: f64) -> Walkway {
    const LANE_M: f64 = 0.5;
    let (late, closeness) = ((-closeness).max(0.0), closeness.max(0.0));
    let lane = k % 2;
    let inward = LANE_M * lane as f64;
    let [closest, farthest] = scene.walk_near_y;
    let near = farthest + (closest - farthest) * closeness + inward;
    let (far, half) = (scene.walk_far_y - inward, scene.walk_half_width - 0.9 * inward);
    let (cx, cy) = (scene.walk_center.x, (near + far) / 2.0);
    let mut own = Rng::new(config.seed, 0x3a1c + k as u64);
    let mut jitter = |v: f64| v + own.range64(-0.05, 0.05);
    // A rounded rectangle, anticlockwise from the right.
    let waypoints = [
        [half, cy],
        [0.92 * half, far - 0.35],
        [0.35 * half, far],
        [-0.35 * half, far],
        [-0.92 * half, far - 0.35],
        [-half, cy],
        [-0.80 * half, near + 0.30],
        [-0.30 * half, near],
        [0.30 * half, near],
        [0.80 * half, near + 0.30],
    ]
    .map(|[x, y]| [jitter(cx + x), jitter(y)]);
    // People of one lane share its schedule, evenly spread over the round, and so never meet.
    let mut draw = Rng::new(config.seed, 0x5c4e + lane as u64);
    let speed = draw.range64(0.75, 1.0);
    let mut stop = |x: f64, y: f64, linger: f64| Stop {
        near: [cx + x + draw.range64(-0.2, 0.2), y],
        pause: draw.range64(0.5, 1.0) + linger * draw.range64(0.8, 1.2),
        glance: draw.range64(-1.2, 1.2),
    };
    // Shy people wait at the side, which the camera does not see.
    let (bold, shy) = (5.0 * closeness, 10.0 * (1.0 - closeness));
    let stops = [stop(-0.35, near, bold), stop(0.35, near, bold), stop(0.0, far, 0.0), stop(half, cy, shy)];
    let in_lane = (config.people + 1 - lane) / 2;
    let spread = (k / 2) as f64 / in_lane.max(1) as f64;
    // Someone of each lane comes by early, however short the sequence is; the lanes take turns.
    let seconds = config.frames as f64 / config.camera.fps;
    let first_visit = seconds.min(12.0) * (late + 0.3 + 0.4 * lane as f64 + draw.range64(-0.1, 0.1));
    Walkway::new(&waypoints, &stops, speed, lane == 0).meeting(first_visit, spread)
}
