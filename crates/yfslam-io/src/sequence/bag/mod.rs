//! A recording in a bag: frames from messages, the camera from `CameraInfo`, the ground truth from poses or transforms.
//!
//! In: a bag of ROS 1, MCAP or rosbag2, and a [`TopicChoice`]. Out: its frames, as from a folder.

mod camera;
mod choose;
mod frames;
mod transforms;

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use yfslam::config::DepthSource;

use super::layout::Listing;
use super::pairs::{List, from_lists};
use super::{GroundTruthReader, ImageRef, ListedImage, SequenceOptions};
use crate::bag::{Bag, MessageRef, Need};
use crate::error::{Error, Result};
use crate::message::MessageType;
use crate::time::format_stamp;
use crate::trajectory::read_topic;
pub use camera::camera_of_topic;
pub use choose::TopicChoice;
use choose::{Chosen, ImageTopic, Survey};
use frames::Frames;
use transforms::Poses;

/// Lists the frames of the bag at `path`.
pub fn list(path: &Path, options: &SequenceOptions) -> Result<Listing> {
    let bag = Arc::new(Bag::open(path)?);
    let mut notes: Vec<String> = bag.notes().to_vec();
    let survey = Survey::of(&bag)?;
    let chosen = choose::choose(&survey, options)?;
    notes.push(chosen.describe());

    let truth = truth_topic(&bag, options)?;
    let mut frames = Frames::new(&chosen);
    let mut poses = Poses::default();
    let mut needs = vec![Need::Skip; bag.topics().len()];
    let mut request = |topic: usize, need| needs.iter_mut().skip(topic).take(1).for_each(|n| *n = need);
    chosen.images().for_each(|image| request(image.topic, Need::Head));
    let is_static = |name: &str| name.ends_with("tf_static");
    for (index, topic) in bag.topics().iter().enumerate() {
        if Some(index) == truth || (topic.kind == Some(MessageType::Tf) && is_static(&topic.name)) {
            request(index, Need::Whole);
        }
    }
    let visited = bag.visit(&needs, &mut |found| {
        let Some(topic) = bag.topics().get(found.topic) else { return ControlFlow::Continue(()) };
        let Some((kind, wire)) = topic.kind.zip(topic.wire) else { return ControlFlow::Continue(()) };
        match kind {
            MessageType::Image | MessageType::CompressedImage => frames.add(kind, wire, &found),
            _ if is_static(&topic.name) => poses.add_static(wire, found.bytes),
            _ => poses.add_truth(kind, wire, found.bytes),
        }
        ControlFlow::Continue(())
    })?;
    notes.extend(visited.notes);
    notes.extend(frames.notes(&bag));

    let camera_frame = chosen.color.head.frame_id.as_str();
    notes.extend(frames_differ(&chosen, &poses));
    notes.extend(poses.describe_base(camera_frame, options.topics.base_frame.as_deref()));
    let stamps_ns = frames.stamps_ns();
    let calibration =
        if options.read_calibration { camera::calibration(&bag, &survey, &chosen, options, &stamps_ns)? } else { None };

    let unreadable = frames.unreadable;
    let mut lists = frames.into_lists().map(|images| {
        let image = |(stamp_ns, topic, position)| ListedImage {
            stamp_ns,
            image: ImageRef::Message(MessageRef::new(bag.clone(), topic, position)),
        };
        images.into_iter().map(image).collect::<Vec<_>>()
    });
    let list = |images: Option<Vec<ListedImage>>, name: &str| List {
        images: images.unwrap_or_default(),
        unstamped: unreadable,
        path: format!("{}:{name}", path.display()).into(),
    };
    let color = list(lists.next(), &chosen.color.name);
    let paired = chosen.paired.as_ref().map(|paired| list(lists.next(), &paired.name));
    let (entries, report) = from_lists(path, color, paired, options.association_tolerance_ns)?;

    let ground_truth = match (truth.and_then(|truth| bag.topics().get(truth)), chain(options)) {
        (Some(topic), _) => {
            let (truth, note) = poses.truth(path, &topic.name, camera_frame, &options.topics)?;
            notes.push(note);
            GroundTruthReader::bag(path.into(), truth, topic.name.clone())
        }
        (None, Some(chain)) => {
            let (mut file, body) = read_topic(&bag, Some(chain), "--truth-topic")?;
            let said = poses.moved_to_camera(&mut file.poses, &body, camera_frame);
            notes.append(&mut file.notes);
            let source = file.source.unwrap_or_default();
            notes.push(format!("ground truth: {} poses of {source}, {said}", file.poses.len()));
            GroundTruthReader::bag(path.into(), file.poses, chain.to_owned())
        }
        (None, None) => GroundTruthReader::none(),
    };
    Ok(Listing { depth_source: chosen.depth_source, entries, report, calibration, ground_truth, notes })
}

/// Returns the topic of the ground truth if it names two frames, as in `/tf:map.camera_link`, which several transforms may connect.
fn chain(options: &SequenceOptions) -> Option<&str> {
    options.topics.truth.as_deref().filter(|name| name.contains(':'))
}

/// Returns the index of the topic of the ground truth, if one was asked for by its name alone.
fn truth_topic(bag: &Bag, options: &SequenceOptions) -> Result<Option<usize>> {
    let Some(name) = options.topics.truth.as_ref().filter(|_| chain(options).is_none()) else { return Ok(None) };
    let is_pose = |kind| matches!(kind, Some(MessageType::Tf | MessageType::Pose | MessageType::PoseOfChild));
    let found =
        bag.topics().iter().position(|topic| topic.name == *name && is_pose(topic.kind) && topic.wire.is_some());
    if found.is_some() {
        return Ok(found);
    }
    let offered: Vec<&str> =
        bag.topics().iter().filter(|topic| is_pose(topic.kind)).map(|topic| topic.name.as_str()).collect();
    let problem = format!("has no topic '{name}' of poses (PoseStamped, Odometry, TransformStamped or TF)");
    let cure = match offered.as_slice() {
        [] => "leave out --truth-topic, and give a file with --groundtruth".to_owned(),
        _ => format!("its topics of poses are {}", offered.join(", ")),
    };
    Err(Error::content(bag.path(), problem, cure))
}

/// Tells when depth images are in another frame than colour images.
fn frames_differ(chosen: &Chosen, poses: &Poses) -> Option<String> {
    let depth = chosen.paired.as_ref().filter(|_| chosen.depth_source == DepthSource::Image)?;
    let (of_color, of_depth) = (chosen.color.head.frame_id.as_str(), depth.head.frame_id.as_str());
    if of_color == of_depth || of_color.is_empty() || of_depth.is_empty() || poses.are_same(of_color, of_depth) {
        return None;
    }
    Some(format!(
        "the depth images of {} are in the frame '{of_depth}', the colour images in '{of_color}': lengths are right only if depth is registered \
         to colour; if it is not, record aligned depth images, and choose them with --depth-topic",
        depth.name
    ))
}

/// Describes the times of a recording whose messages have no time stamps of their own.
fn received_note(first_ns: i64) -> String {
    format!(
        "the time stamps in the images are all {}: the times at which they were received are used",
        format_stamp(first_ns)
    )
}
