//! Transforms between the frames of a robot, and the ground truth of a recording in a bag.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Isometry3;
use yfslam_eval::StampedPose;

use super::choose::TopicChoice;
use crate::error::{Error, Result};
use crate::message::MessageType;
use crate::message::types::{Transform, frame_name as name};
use crate::message::wire::{Reader, Wire, WireError};

/// Most frames between a camera and the base of its robot.
const MAX_DEPTH: usize = 64;
/// Most static transforms that are kept; a robot has tens.
const MAX_STATIC: usize = 10_000;
/// Names of the body of a robot (REP 105).
const BASES: [&str; 3] = ["base_link", "base_footprint", "base"];

/// Poses and static transforms that were found in a bag.
#[derive(Default)]
pub struct Poses {
    /// Parent and pose of each frame.
    fixed: BTreeMap<String, (String, Isometry3<f64>)>,
    truth: Vec<Transform>,
    unreadable: usize,
}

impl Poses {
    /// Adds the transforms of `/tf_static`.
    pub fn add_static(&mut self, wire: Wire, bytes: &[u8]) {
        let transforms = Reader::new(wire, bytes).and_then(|mut from| Transform::read_tf(&mut from));
        for transform in transforms.unwrap_or_default() {
            if self.fixed.len() < MAX_STATIC {
                self.fixed.insert(name(&transform.child), (name(&transform.parent), transform.t_parent_child));
            }
        }
    }

    /// Adds a message of the ground truth.
    pub fn add_truth(&mut self, kind: MessageType, wire: Wire, bytes: &[u8]) {
        let read = |mut from: Reader<'_>| -> std::result::Result<Vec<Transform>, WireError> {
            match kind {
                MessageType::Tf => Transform::read_tf(&mut from),
                MessageType::PoseOfChild => Transform::read_with_child(&mut from).map(|pose| vec![pose]),
                _ => Transform::read_pose_stamped(&mut from).map(|pose| vec![pose]),
            }
        };
        match Reader::new(wire, bytes).and_then(read) {
            Ok(poses) => self.truth.extend(poses),
            Err(_) => self.unreadable += 1,
        }
    }

    /// Returns the frames above a frame, the nearest first, with its pose in each.
    fn ancestors(&self, frame: &str) -> Vec<(String, Isometry3<f64>)> {
        let mut chain = vec![(name(frame), Isometry3::identity())];
        while let Some((parent, t_parent_child)) = chain.last().and_then(|(frame, _)| self.fixed.get(frame)) {
            let t_child_frame = chain.last().map_or(Isometry3::identity(), |(_, pose)| *pose);
            chain.push((parent.clone(), t_parent_child * t_child_frame));
            if chain.len() > MAX_DEPTH {
                break;
            }
        }
        chain
    }

    /// Returns the pose of frame `b` in frame `a`, if static transforms connect them.
    fn between(&self, a: &str, b: &str) -> Option<Isometry3<f64>> {
        let (of_a, of_b) = (self.ancestors(a), self.ancestors(b));
        of_a.iter().find_map(|(frame, t_frame_a)| {
            let (_, t_frame_b) = of_b.iter().find(|(other, _)| other == frame)?;
            Some(t_frame_a.inverse() * t_frame_b)
        })
    }

    /// Returns whether two frames are the same, within 1 mm and 0.1°.
    pub fn are_same(&self, a: &str, b: &str) -> bool {
        self.between(a, b).is_some_and(|t| t.translation.vector.norm() < 1e-3 && t.rotation.angle() < 1.75e-3)
    }

    /// Describes where the camera is mounted.
    pub fn describe_base(&self, camera: &str, base: Option<&str>) -> Option<String> {
        let bases = base.map_or(BASES.to_vec(), |base| vec![base]);
        let (base, t) = bases.iter().find_map(|base| Some((base, self.between(base, camera)?)))?;
        let (p, q) = (t.translation.vector, t.rotation.coords);
        Some(format!(
            "pose of the camera '{camera}' in {base}: x {:.4} y {:.4} z {:.4} m, qx {:.5} qy {:.5} qz {:.5} qw {:.5}",
            p.x, p.y, p.z, q.x, q.y, q.z, q.w
        ))
    }

    /// Moves poses of a body to the camera, if static transforms connect both; returns what was done.
    pub fn moved_to_camera(&self, poses: &mut [StampedPose], body: &str, camera: &str) -> String {
        let mount = if name(body) == name(camera) { None } else { Some(self.between(body, camera)) };
        if let Some(t_body_cam) = mount.flatten() {
            poses.iter_mut().for_each(|pose| pose.t_world_cam *= t_body_cam);
        }
        match mount {
            None => format!("those of the camera '{camera}'"),
            Some(Some(_)) => format!("those of '{body}', to which /tf_static gives the pose of the camera '{camera}'"),
            Some(None) => format!(
                "those of '{body}', taken as those of the camera, because no static transform leads to '{camera}'"
            ),
        }
    }

    /// Returns the poses of the camera, and what was done for it.
    pub fn truth(
        self,
        path: &Path,
        topic: &str,
        camera: &str,
        choice: &TopicChoice,
    ) -> Result<(Vec<StampedPose>, String)> {
        let base = choice.base_frame.as_deref();
        let mut pairs: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        for pose in &self.truth {
            *pairs.entry((&pose.parent, &pose.child)).or_default() += 1;
        }
        let wanted = |(_, child): &(&str, &str)| base.is_none_or(|base| child.is_empty() || name(child) == name(base));
        let candidates: Vec<_> = pairs.keys().copied().filter(wanted).collect();
        let (parent, child) = match candidates.as_slice() {
            [pair] => (pair.0.to_owned(), pair.1.to_owned()),
            _ => {
                let offered: Vec<String> = pairs.keys().take(20).map(|(p, c)| format!("'{c}' in '{p}'")).collect();
                let problem = format!("{topic} has poses of {} frames: {}", pairs.len(), offered.join(", "));
                return Err(Error::content(
                    path,
                    problem,
                    "choose one with --base-frame, such as --base-frame base_link",
                ));
            }
        };
        let body = if child.is_empty() { base.unwrap_or("").to_owned() } else { child.clone() };
        let selected = self.truth.iter().filter(|pose| pose.parent == parent && pose.child == child);
        let poses = selected.map(|pose| StampedPose::new(pose.stamp_ns, pose.t_parent_child));
        let mut poses: Vec<StampedPose> = poses.collect();
        let said = if body.is_empty() {
            "taken as those of the camera".to_owned()
        } else {
            self.moved_to_camera(&mut poses, &body, camera)
        };
        poses.sort_by_key(|pose| pose.timestamp_ns);
        let damaged =
            if self.unreadable > 0 { format!("; {} messages are damaged", self.unreadable) } else { String::new() };
        let note = format!("ground truth from {topic}: {} poses in '{parent}', {said}{damaged}", poses.len());
        Ok((poses, note))
    }
}
