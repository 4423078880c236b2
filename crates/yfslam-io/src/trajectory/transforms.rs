//! Chains of transforms (TF) of a bag.
//!
//! In: the messages of a topic of TF and of `/tf_static`. Out: the poses of one frame in another, composed of all transforms between
//! them. A pose is made at each time of the transform that was sent most often; the others are interpolated at that time, as `tf2` does,
//! and never extrapolated. Only the transforms of the chain are kept in memory.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use nalgebra::Isometry3;
use yfslam_eval::StampedPose;

use super::Sorted;
use super::bag::{Found, is_static, split_frames};
use crate::bag::{Bag, Need};
use crate::error::{Error, Result};
use crate::message::types::{Transform, frame_name};
use crate::message::wire::{Reader, Wire};

/// Most pairs of frames that are kept; a robot has tens.
const MAX_PAIRS: usize = 10_000;

/// Most pairs that an error message lists.
const MAX_LISTED: usize = 20;

/// Parent and child.
type Pair = (String, String);

/// The transforms of a bag: which frames they connect.
pub struct TransformTree {
    pairs: BTreeMap<Pair, Link>,
}

/// A transform between two frames.
#[derive(Clone, Copy)]
enum Link {
    /// It never changes.
    Fixed(Isometry3<f64>),
    /// It was sent this often.
    Sent(usize),
}

/// One transform of a chain; `is_inverse` where the chain goes from the child to the parent.
struct Step {
    pair: Pair,
    is_inverse: bool,
    link: Link,
}

/// Poses of one transform; times ascend.
type Samples = Vec<StampedPose>;

impl TransformTree {
    /// Reads which frames the topic of TF with this index and the topics of static transforms connect.
    ///
    /// # Errors
    /// The bag cannot be read.
    pub fn of(bag: &Bag, topic: usize) -> Result<Self> {
        let mut pairs: BTreeMap<Pair, Link> = BTreeMap::new();
        visit(bag, Some(topic), &mut |transform, fixed| {
            let pair = (frame_name(&transform.parent), frame_name(&transform.child));
            if pairs.len() >= MAX_PAIRS && !pairs.contains_key(&pair) {
                return;
            }
            let link = pairs.entry(pair).or_insert(Link::Sent(0));
            match link {
                _ if fixed => *link = Link::Fixed(transform.t_parent_child),
                Link::Sent(count) => *count += 1,
                Link::Fixed(_) => {}
            }
        })?;
        Ok(Self { pairs })
    }

    /// Returns the poses of one frame in another, which `frames` names as `parent.child`; without it, the bag must have one transform
    /// that changes.
    ///
    /// # Errors
    /// The frames are not there or not connected, or nothing between them changes.
    pub fn trajectory(self, bag: &Bag, topic: usize, frames: Option<&str>, flag: &str) -> Result<Found> {
        let name = bag.topics().get(topic).map_or("", |topic| topic.name.as_str());
        let (parent, child) = self.frames(bag, name, frames, flag)?;
        let steps = self.chain(&parent, &child).ok_or_else(|| {
            let problem = format!("no transforms lead from '{parent}' to '{child}'");
            Error::content(bag.path(), problem, format!("its transforms are {}", self.listed()))
        })?;
        let (samples, notes) = samples(bag, topic, &steps)?;
        let Some(densest) = samples.iter().flatten().max_by_key(|samples| samples.len()) else {
            let problem = format!("the transforms from '{parent}' to '{child}' never change");
            return Err(Error::content(bag.path(), problem, "choose frames that move against each other"));
        };
        let at = |stamp_ns: i64| {
            steps.iter().zip(&samples).try_fold(Isometry3::identity(), |t, (step, samples)| {
                let step_pose = match (step.link, samples) {
                    (Link::Fixed(pose), _) => pose,
                    (_, Some(samples)) => interpolated(samples, stamp_ns)?,
                    _ => return None,
                };
                Some(t * if step.is_inverse { step_pose.inverse() } else { step_pose })
            })
        };
        let poses: Vec<StampedPose> = densest
            .iter()
            .filter_map(|pose| Some(StampedPose::new(pose.timestamp_ns, at(pose.timestamp_ns)?)))
            .collect();
        let changing = samples.iter().flatten().count();
        let mut source = format!("{name}:{parent}.{child} ({} transforms, of which {changing} change", steps.len());
        if poses.len() < densest.len() {
            source +=
                &format!("; {} of {} times are outside of one of them", densest.len() - poses.len(), densest.len());
        }
        Ok(Found { poses, child, source: source + ")", notes })
    }

    /// Returns parent and child of the poses that are wanted.
    fn frames(&self, bag: &Bag, name: &str, frames: Option<&str>, flag: &str) -> Result<Pair> {
        if let Some(frames) = frames {
            let mut known: Vec<String> = Vec::new();
            for frame in self.pairs.keys().flat_map(|(parent, child)| [parent, child]) {
                if !known.contains(frame) {
                    known.push(frame.clone());
                }
            }
            return split_frames(bag.path(), frames, &known);
        }
        let mut sent = self.pairs.iter().filter(|(_, link)| matches!(link, Link::Sent(_))).map(|(pair, _)| pair);
        match (sent.next(), sent.next()) {
            (Some(pair), None) => Ok(pair.clone()),
            (None, _) => {
                let problem = format!("{name} has no transform that can be read");
                Err(Error::content(bag.path(), problem, format!("choose another topic with {flag}")))
            }
            (Some((parent, child)), Some(_)) => {
                let problem = format!("{name} has several transforms: {}", self.listed());
                let cure =
                    format!("choose two frames, also of several transforms, as in {flag} {name}:{parent}.{child}");
                Err(Error::content(bag.path(), problem, cure))
            }
        }
    }

    fn listed(&self) -> String {
        let pairs = self.pairs.keys().take(MAX_LISTED).map(|(parent, child)| format!("{parent}.{child}"));
        pairs.collect::<Vec<_>>().join(", ")
    }

    /// Returns the fewest transforms that lead from `parent` to `child`.
    fn chain(&self, parent: &str, child: &str) -> Option<Vec<Step>> {
        // For each frame that was reached: the frame before it, and the transform between them.
        let mut reached: Vec<(&str, &str, &Pair, bool)> = Vec::new();
        let mut queue = vec![parent];
        let mut next_in_queue = 0;
        while let Some(&frame) = queue.get(next_in_queue) {
            next_in_queue += 1;
            if frame == child {
                break;
            }
            for pair in self.pairs.keys() {
                let (next, is_inverse) = match (pair.0 == frame, pair.1 == frame) {
                    (true, _) => (pair.1.as_str(), false),
                    (_, true) => (pair.0.as_str(), true),
                    _ => continue,
                };
                if next != parent && reached.iter().all(|(known, ..)| *known != next) {
                    reached.push((next, frame, pair, is_inverse));
                    queue.push(next);
                }
            }
        }
        let mut steps = Vec::new();
        let mut frame = child;
        while frame != parent {
            let (_, before, pair, is_inverse) = *reached.iter().find(|(known, ..)| *known == frame)?;
            let link = *self.pairs.get(pair)?;
            steps.push(Step { pair: pair.clone(), is_inverse, link });
            frame = before;
        }
        steps.reverse();
        Some(steps)
    }
}

/// Reads the samples of the steps that change, and what is to be said about the bag.
fn samples(bag: &Bag, topic: usize, steps: &[Step]) -> Result<(Vec<Option<Samples>>, Vec<String>)> {
    let changing = |step: &Step| matches!(step.link, Link::Sent(_)).then(Samples::new);
    let mut all: Vec<Option<Samples>> = steps.iter().map(changing).collect();
    let notes = visit(bag, Some(topic), &mut |transform, fixed| {
        let pair = (frame_name(&transform.parent), frame_name(&transform.child));
        let step = steps.iter().zip(&mut all).find(|(step, _)| !fixed && step.pair == pair);
        if let Some((_, Some(samples))) = step {
            samples.push(StampedPose::new(transform.stamp_ns, transform.t_parent_child));
        }
    })?;
    for samples in all.iter_mut().flatten() {
        *samples = Sorted::of(samples).poses;
    }
    Ok((all, notes))
}

/// Calls `each` with all transforms of a topic of TF and of the topics of static transforms, and whether they are static; returns what
/// is to be said about the bag.
fn visit(bag: &Bag, topic: Option<usize>, each: &mut dyn FnMut(Transform, bool)) -> Result<Vec<String>> {
    let is_needed = |index: usize, topic_of_bag| Some(index) == topic || is_static(topic_of_bag);
    let need = |(index, topic)| if is_needed(index, topic) { Need::Whole } else { Need::Skip };
    let needs: Vec<Need> = bag.topics().iter().enumerate().map(need).collect();
    let mut unreadable = 0;
    let visited = bag.visit(&needs, &mut |found| {
        let Some(topic) = bag.topics().get(found.topic) else { return ControlFlow::Continue(()) };
        match transforms(topic.wire, found.bytes) {
            Some(read) => read.into_iter().for_each(|transform| each(transform, is_static(topic))),
            None => unreadable += 1,
        }
        ControlFlow::Continue(())
    })?;
    let mut notes = visited.notes;
    if unreadable > 0 {
        notes.push(format!("{unreadable} messages of transforms are damaged and left out"));
    }
    Ok(notes)
}

fn transforms(wire: Option<Wire>, bytes: &[u8]) -> Option<Vec<Transform>> {
    Transform::read_tf(&mut Reader::new(wire?, bytes).ok()?).ok()
}

/// Returns the pose at a time, between the samples before and after it; `None` where there is none before or none after.
fn interpolated(samples: &[StampedPose], stamp_ns: i64) -> Option<Isometry3<f64>> {
    let after = samples.partition_point(|pose| pose.timestamp_ns < stamp_ns);
    let StampedPose { timestamp_ns: end_ns, t_world_cam: end } = samples.get(after)?;
    if *end_ns == stamp_ns {
        return Some(*end);
    }
    let StampedPose { timestamp_ns: begin_ns, t_world_cam: begin } = samples.get(after.checked_sub(1)?)?;
    let share = (stamp_ns - begin_ns) as f64 / (end_ns - begin_ns) as f64;
    // Poses that are turned by exactly 180° have no shortest way between them.
    Some(begin.try_lerp_slerp(end, share, 1e-12).unwrap_or(*begin))
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    #[test]
    fn a_pose_between_two_samples_is_interpolated_and_one_outside_is_not_made() {
        let pose = |x: f64, angle: f64| Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::new(0.0, 0.0, angle));
        let samples = [StampedPose::new(100, pose(1.0, 0.0)), StampedPose::new(200, pose(3.0, 1.0))];
        let middle = interpolated(&samples, 125).unwrap();
        assert!((middle.translation.x - 1.5).abs() < 1e-12);
        assert!(middle.rotation.angle_to(&UnitQuaternion::from_euler_angles(0.0, 0.0, 0.25)) < 1e-12);
        assert_eq!(interpolated(&samples, 200), Some(samples[1].t_world_cam));
        assert!(interpolated(&samples, 99).is_none() && interpolated(&samples, 201).is_none());
    }
}
