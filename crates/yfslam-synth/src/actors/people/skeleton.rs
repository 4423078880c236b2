//! The skeleton: bones, their lengths, and the pose of each for given joint angles.
//!
//! In: proportions and joint angles. Out: one pose per bone in the world. The axes of a person are right (+x), forward (+y) and up
//! (+z). Segment lengths as shares of body height follow Drillis and Contini, "Body segment parameters" (1966), as in Winter,
//! "Biomechanics and Motor Control of Human Movement", figure 4.1.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion};

use crate::mesh::Vec3;

/// Bones; sides are right, then left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bone {
    Pelvis,
    Chest,
    Head,
    UpperArm(usize),
    Forearm(usize),
    Thigh(usize),
    Shank(usize),
    Foot(usize),
}

/// Number of bones.
pub const BONES: usize = 13;

impl Bone {
    /// Returns the index in a [`BonePoses`].
    pub fn index(self) -> usize {
        match self {
            Self::Pelvis => 0,
            Self::Chest => 1,
            Self::Head => 2,
            Self::UpperArm(side) => 3 + side,
            Self::Forearm(side) => 5 + side,
            Self::Thigh(side) => 7 + side,
            Self::Shank(side) => 9 + side,
            Self::Foot(side) => 11 + side,
        }
    }
}

/// World (or root) from bone, by [`Bone::index`]. Limb bones start at their joint and extend along −z.
pub type BonePoses = [Isometry3<f32>; BONES];

/// Lengths of a body, m.
#[derive(Clone, Copy, Debug)]
pub struct Proportions {
    /// Body height.
    pub height: f32,
    /// Width of the trunk relative to an average one.
    pub girth: f32,
}

impl Joints {
    /// Blends from `self` (0) to `other` (1), angle by angle.
    pub fn blend(&self, other: &Self, t: f32) -> Self {
        fn mix<const N: usize>(a: [f32; N], b: [f32; N], t: f32) -> [f32; N] {
            std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
        }
        Self {
            trunk: mix(self.trunk, other.trunk, t),
            head: mix(self.head, other.head, t),
            shoulder: mix(self.shoulder, other.shoulder, t),
            lift: mix(self.lift, other.lift, t),
            elbow: mix(self.elbow, other.elbow, t),
            hip: mix(self.hip, other.hip, t),
            spread: mix(self.spread, other.spread, t),
            knee: mix(self.knee, other.knee, t),
            ankle: mix(self.ankle, other.ankle, t),
            pelvis: mix(self.pelvis, other.pelvis, t),
        }
    }
}

impl Proportions {
    /// Returns the distance from hip joint to knee.
    pub fn thigh(&self) -> f32 {
        0.245 * self.height
    }

    /// Returns the distance from knee to ankle.
    pub fn shank(&self) -> f32 {
        0.246 * self.height
    }

    /// Returns the height of the ankle above the sole.
    pub fn ankle(&self) -> f32 {
        0.045 * self.height
    }

    /// Returns the distance from hip joint to shoulder joint.
    pub fn trunk(&self) -> f32 {
        0.285 * self.height
    }

    /// Returns the distance from shoulder to elbow.
    pub fn upper_arm(&self) -> f32 {
        0.180 * self.height
    }

    /// Returns the distance from elbow to wrist.
    pub fn forearm(&self) -> f32 {
        0.146 * self.height
    }

    /// Returns half the distance between the shoulders.
    pub fn half_shoulders(&self) -> f32 {
        0.093 * self.height * (0.6 + 0.4 * self.girth)
    }

    /// Returns half the distance between the hip joints.
    pub fn half_hips(&self) -> f32 {
        0.046 * self.height
    }
}

/// Joint angles, rad; a limb's angle is positive when it swings forward. Pairs are right, left.
#[derive(Clone, Copy, Debug, Default)]
pub struct Joints {
    /// Trunk: lean forward, turn (yaw) relative to the pelvis, lean sideways.
    pub trunk: [f32; 3],
    /// Head: nod down, turn.
    pub head: [f32; 2],
    /// Shoulders: swing forward.
    pub shoulder: [f32; 2],
    /// Shoulders: lift sideways.
    pub lift: [f32; 2],
    /// Elbows: bend.
    pub elbow: [f32; 2],
    /// Hips: swing forward.
    pub hip: [f32; 2],
    /// Hips: spread sideways.
    pub spread: [f32; 2],
    /// Knees: bend.
    pub knee: [f32; 2],
    /// Ankles: lift the toes.
    pub ankle: [f32; 2],
    /// Pelvis: turn, roll.
    pub pelvis: [f32; 2],
}

fn rot_x(angle: f32) -> UnitQuaternion<f32> {
    UnitQuaternion::from_axis_angle(&Vec3::x_axis(), angle)
}

fn rot_y(angle: f32) -> UnitQuaternion<f32> {
    UnitQuaternion::from_axis_angle(&Vec3::y_axis(), angle)
}

fn rot_z(angle: f32) -> UnitQuaternion<f32> {
    UnitQuaternion::from_axis_angle(&Vec3::z_axis(), angle)
}

fn joint(x: f32, y: f32, z: f32, rotation: UnitQuaternion<f32>) -> Isometry3<f32> {
    Isometry3::from_parts(Translation3::new(x, y, z), rotation)
}

/// Returns the bone poses with the middle of the hips at `root`.
pub fn forward_kinematics(root: &Isometry3<f32>, p: &Proportions, j: &Joints) -> BonePoses {
    let mut poses = [*root; BONES];
    let pelvis = root * joint(0.0, 0.0, 0.0, rot_z(j.pelvis[0]) * rot_y(j.pelvis[1]));
    let chest = root * joint(0.0, 0.0, 0.06, rot_z(j.trunk[1]) * rot_x(-j.trunk[0]) * rot_y(j.trunk[2]));
    let neck = p.trunk() + 0.03 * p.height;
    let head = chest * joint(0.0, 0.0, neck - 0.06, rot_z(j.head[1]) * rot_x(j.trunk[0] * 0.7 - j.head[0]));
    poses[Bone::Pelvis.index()] = pelvis;
    poses[Bone::Chest.index()] = chest;
    poses[Bone::Head.index()] = head;
    for (side, sign) in [(0, 1.0), (1, -1.0)] {
        let shoulder = joint(sign * p.half_shoulders(), 0.0, p.trunk() - 0.06, rot_y(-sign * j.lift[side]));
        let arm = chest * shoulder * joint(0.0, 0.0, 0.0, rot_x(j.shoulder[side]));
        let forearm = arm * joint(0.0, 0.0, -p.upper_arm(), rot_x(j.elbow[side]));
        let thigh = pelvis
            * joint(sign * p.half_hips(), 0.0, 0.0, rot_y(-sign * j.spread[side]))
            * joint(0.0, 0.0, 0.0, rot_x(j.hip[side]));
        let shank = thigh * joint(0.0, 0.0, -p.thigh(), rot_x(-j.knee[side]));
        let foot = shank * joint(0.0, 0.0, -p.shank(), rot_x(j.ankle[side]));
        poses[Bone::UpperArm(side).index()] = arm;
        poses[Bone::Forearm(side).index()] = forearm;
        poses[Bone::Thigh(side).index()] = thigh;
        poses[Bone::Shank(side).index()] = shank;
        poses[Bone::Foot(side).index()] = foot;
    }
    poses
}

/// Bends an arm so that its palm reaches `target` (a point of the world), or as near as the arm is long; the elbow points down and
/// outward. The circle of possible elbows is that of two spheres around shoulder and palm.
pub fn reach(poses: &mut BonePoses, p: &Proportions, side: usize, target: &Vec3) {
    let (upper, lower) = (p.upper_arm(), p.forearm() + PALM * p.height);
    let chest = poses[Bone::Chest.index()];
    let shoulder = poses[Bone::UpperArm(side).index()].translation.vector;
    let outward = chest.rotation * Vec3::x() * if side == 0 { 1.0 } else { -1.0 };
    let to = target - shoulder;
    let distance = to.norm().clamp((upper - lower).abs() + 0.02, upper + lower - 0.003);
    let along = to.normalize();
    let share = (upper * upper - lower * lower + distance * distance) / (2.0 * distance);
    let aside = (upper * upper - share * share).max(0.0).sqrt();
    let pole = outward * 0.7 - Vec3::z();
    let pole = (pole - along * pole.dot(&along)).normalize();
    let elbow = shoulder + along * share + pole * aside;
    let palm = shoulder + along * distance;
    let right = chest.rotation * Vec3::x();
    poses[Bone::UpperArm(side).index()] = bone_between(&shoulder, &elbow, &right);
    poses[Bone::Forearm(side).index()] = bone_between(&elbow, &palm, &right);
}

/// Distance from wrist to palm as a share of body height.
pub const PALM: f32 = 0.045;

/// Returns the place of the palm of an arm.
pub fn palm(poses: &BonePoses, p: &Proportions, side: usize) -> Vec3 {
    let wrist = Point3::new(0.0, 0.0, -p.forearm() - PALM * p.height);
    (poses[Bone::Forearm(side).index()] * wrist).coords
}

/// Returns the pose of a bone that starts at `from`, points to `to` and has its x axis roughly along `right`.
fn bone_between(from: &Vec3, to: &Vec3, right: &Vec3) -> Isometry3<f32> {
    let z = (from - to).normalize();
    let x = (right - z * right.dot(&z)).normalize();
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Isometry3::from_parts(Translation3::from(*from), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Returns the height of the lowest point of the soles (heel or ball) for poses computed with the root at height 0.
pub fn lowest_sole(poses: &BonePoses, p: &Proportions) -> f32 {
    let soles = [0, 1].into_iter().flat_map(|side| {
        let foot = poses[Bone::Foot(side).index()];
        [-0.05, 0.14].map(|y| (foot * Point3::new(0.0, y, -p.ankle())).z)
    });
    soles.fold(f32::INFINITY, f32::min)
}
