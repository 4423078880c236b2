//! Trajectories from the messages of a bag.
//!
//! In: a bag, and the name of a topic, after which the frames of a transform may stand as in `/tf:map.base_link`. Out: the poses with
//! the times in their headers. Without a name, the topic is found by its type.

use std::ops::ControlFlow;
use std::path::Path;

use yfslam_eval::StampedPose;

use super::TrajectoryFile;
use super::transforms::TransformTree;
use crate::bag::{Bag, Need, Topic, is_bag};
use crate::error::{Error, Result};
use crate::message::MessageType;
use crate::message::types::{Transform, frame_name};
use crate::message::wire::{Reader, Wire, WireError};
use crate::time::format_stamp;

/// Most topics or frames that an error message lists.
const MAX_LISTED: usize = 20;

/// Most pairs of frames of a topic that are distinguished.
const MAX_PAIRS: usize = 100;

const TYPES: &str = "PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped or TF";

/// Reads a trajectory from a topic of a bag, or from a file of text; only a bag has topics. `flag` is what the user chooses a topic
/// with, for error messages.
///
/// # Errors
/// The file cannot be read, several topics could be meant, or the topic has no pose.
pub fn read_trajectory(path: &Path, topic: Option<&str>, flag: &str) -> Result<TrajectoryFile> {
    if is_bag(path) {
        return read(path, topic, flag);
    }
    if let Some(topic) = topic {
        let problem = format!("is no bag and has no topic '{topic}'");
        return Err(Error::content(path, problem, format!("leave out {flag}, or name a bag")));
    }
    TrajectoryFile::parse(&crate::text::read_text(path)?, path)
}

fn read(path: &Path, topic: Option<&str>, flag: &str) -> Result<TrajectoryFile> {
    read_topic(&Bag::open(path)?, topic, flag).map(|(file, _)| file)
}

/// Reads a trajectory from a topic of an open bag; also returns the name of the frame whose poses it has, which is empty if it is not
/// named.
pub(crate) fn read_topic(bag: &Bag, topic: Option<&str>, flag: &str) -> Result<(TrajectoryFile, String)> {
    let path = bag.path();
    let (name, frames) = match topic.map(|topic| topic.split_once(':').ok_or(topic)) {
        Some(Ok((name, frames))) => (Some(name), Some(frames)),
        Some(Err(name)) => (Some(name), None),
        None => (None, None),
    };
    let index = choose(bag, name, flag)?;
    let Some(topic) = bag.topics().get(index) else { return Err(no_poses(bag)) };
    let found = match topic.kind {
        Some(MessageType::Tf) => TransformTree::of(bag, index)?.trajectory(bag, index, frames, flag)?,
        _ => poses(bag, index, frames, flag)?,
    };
    let Found { poses, child, source, mut notes } = found;
    notes.splice(0..0, bag.notes().iter().cloned());
    let (all, is_finite) =
        (poses.len(), |pose: &StampedPose| pose.t_world_cam.to_matrix().iter().all(|v| v.is_finite()));
    let poses: Vec<StampedPose> = poses.into_iter().filter(is_finite).collect();
    if poses.len() < all {
        notes.push(format!("{} poses of {} are left out, because they are not finite", all - poses.len(), topic.name));
    }
    if poses.is_empty() {
        let problem = format!("{source} has no pose that can be read");
        return Err(Error::content(path, problem, format!("choose another topic with {flag}")));
    }
    let mut file = TrajectoryFile::from_poses(poses, path)?;
    file.notes.splice(0..0, notes);
    file.source = Some(source);
    Ok((file, child))
}

/// What was found in a bag.
pub struct Found {
    pub poses: Vec<StampedPose>,
    /// The frame whose poses they are; empty if it is not named.
    pub child: String,
    pub source: String,
    pub notes: Vec<String>,
}

/// Returns the index of the topic of this name or, without one, of the only topic that has poses.
fn choose(bag: &Bag, name: Option<&str>, flag: &str) -> Result<usize> {
    let is_usable = |topic: &Topic| {
        let has_poses = matches!(topic.kind, Some(MessageType::Pose | MessageType::PoseOfChild));
        let has_transforms = topic.kind == Some(MessageType::Tf) && !is_static(topic);
        topic.wire.is_some() && topic.messages > 0 && (has_poses || has_transforms)
    };
    let usable = || bag.topics().iter().enumerate().filter(|(_, topic)| is_usable(topic));
    let offer = || {
        let all =
            usable().take(MAX_LISTED).map(|(_, t)| format!("{} ({}, {} messages)", t.name, t.type_name, t.messages));
        all.collect::<Vec<_>>().join(", ")
    };
    if usable().next().is_none() {
        return Err(no_poses(bag));
    }
    if let Some(name) = name {
        return usable().find(|(_, topic)| topic.name == name).map(|(index, _)| index).ok_or_else(|| {
            let problem = format!("has no topic '{name}' with poses");
            Error::content(bag.path(), problem, format!("its topics of poses are {}", offer()))
        });
    }
    let of_poses: Vec<usize> = usable().filter(|(_, t)| t.kind != Some(MessageType::Tf)).map(|(i, _)| i).collect();
    let all: Vec<usize> = usable().map(|(index, _)| index).collect();
    match (&of_poses[..], &all[..]) {
        ([one], _) | ([], [one]) => Ok(*one),
        _ => {
            let problem = format!("has several topics of poses: {}", offer());
            Err(Error::content(bag.path(), problem, format!("choose one with {flag}")))
        }
    }
}

/// Returns whether a topic has transforms that never change.
pub fn is_static(topic: &Topic) -> bool {
    topic.kind == Some(MessageType::Tf) && topic.name.ends_with("tf_static")
}

fn no_poses(bag: &Bag) -> Error {
    let all = bag.topics().iter().take(MAX_LISTED).map(|topic| format!("{} ({})", topic.name, topic.type_name));
    let all = all.collect::<Vec<_>>().join(", ");
    let problem = if all.is_empty() { "has no messages".into() } else { format!("has no topic of poses, only {all}") };
    Error::content(bag.path(), problem, format!("record a topic of {TYPES}"))
}

/// Splits `parent.child`, of which each may have dots of its own, into two names of frames that are there.
///
/// # Errors
/// No split, or more than one, gives two frames.
pub fn split_frames(path: &Path, text: &str, known: &[String]) -> Result<(String, String)> {
    let splits = text.match_indices('.').filter_map(|(at, _)| {
        let (parent, child) = (text.get(..at)?, text.get(at + 1..)?);
        Some((frame_name(parent), frame_name(child)))
    });
    let fitting: Vec<_> = splits.filter(|(parent, child)| known.contains(parent) && known.contains(child)).collect();
    match &fitting[..] {
        [(parent, child)] if parent != child => Ok((parent.clone(), child.clone())),
        _ => {
            let problem = format!("'{text}' does not name two frames as in 'map.base_link'");
            let listed: Vec<&str> = known.iter().take(MAX_LISTED).map(String::as_str).collect();
            Err(Error::content(path, problem, format!("its frames are {}", listed.join(", "))))
        }
    }
}

/// Reads the poses of a topic that is not TF.
fn poses(bag: &Bag, index: usize, frames: Option<&str>, flag: &str) -> Result<Found> {
    let mut read = Vec::new();
    let mut unreadable = 0;
    let mut needs = vec![Need::Skip; bag.topics().len()];
    needs.iter_mut().skip(index).take(1).for_each(|need| *need = Need::Whole);
    let topic = bag.topics().get(index);
    let kind = topic.and_then(|topic| topic.kind.zip(topic.wire));
    let visited = bag.visit(&needs, &mut |found| {
        match kind.map(|(kind, wire)| one_pose(kind, wire, found.bytes)) {
            Some(Ok(pose)) => read.push((pose, found.received_ns)),
            _ => unreadable += 1,
        }
        ControlFlow::Continue(())
    })?;
    let mut notes = visited.notes;
    let name = topic.map_or("", |topic| topic.name.as_str());
    if unreadable > 0 {
        notes.push(format!("{unreadable} messages of {name} are damaged and left out"));
    }
    let pair = |pose: &Transform| (frame_name(&pose.parent), frame_name(&pose.child));
    let mut pairs: Vec<(String, String)> = Vec::new();
    for pair in read.iter().map(|(pose, _)| pair(pose)) {
        if pairs.len() < MAX_PAIRS && !pairs.contains(&pair) {
            pairs.push(pair);
        }
    }
    let wanted = match frames {
        Some(frames) => {
            let known: Vec<String> = pairs.iter().flat_map(|(a, b)| [a.clone(), b.clone()]).collect();
            Some(split_frames(bag.path(), frames, &known)?)
        }
        None => None,
    };
    // The parent of odometry may change its name; another child is another body.
    let mut children: Vec<&str> = Vec::new();
    for (_, child) in &pairs {
        if !children.contains(&child.as_str()) {
            children.push(child);
        }
    }
    if let ([(parent, child), ..], None, 2..) = (&pairs[..], &wanted, children.len()) {
        let problem = format!("{name} has poses of {} frames: {}", children.len(), children.join(", "));
        let cure = format!("choose one with {flag} such as {flag} {name}:{parent}.{child}");
        return Err(Error::content(bag.path(), problem, cure));
    }
    read.retain(|(pose, _)| wanted.as_ref().is_none_or(|wanted| pair(pose) == *wanted));
    let first_ns = read.first().map_or(0, |(pose, _)| pose.stamp_ns);
    if read.len() > 1 && read.iter().all(|(pose, _)| pose.stamp_ns == first_ns) {
        read.iter_mut().for_each(|(pose, received_ns)| pose.stamp_ns = *received_ns);
        notes.push(format!(
            "the time stamps in {name} are all {}: the times at which its messages were received are used",
            format_stamp(first_ns)
        ));
    }
    let child = read.first().map_or_else(String::new, |(pose, _)| frame_name(&pose.child));
    let poses = read.iter().map(|(pose, _)| StampedPose::new(pose.stamp_ns, pose.t_parent_child)).collect();
    let type_name = topic.map_or("", |topic| topic.type_name.as_str());
    let frames = frames.map_or(String::new(), |frames| format!(":{frames}"));
    Ok(Found { poses, child, source: format!("{name}{frames} ({type_name})"), notes })
}

fn one_pose(kind: MessageType, wire: Wire, bytes: &[u8]) -> std::result::Result<Transform, WireError> {
    let mut from = Reader::new(wire, bytes)?;
    match kind {
        MessageType::PoseOfChild => Transform::read_with_child(&mut from),
        _ => Transform::read_pose_stamped(&mut from),
    }
}
