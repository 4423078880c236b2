//! Which topics of a bag are read.

use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use clap::Args;
use yfslam_io::Bag;
use yfslam_io::sequence::TopicChoice;
use yfslam_io::time::seconds;

/// The topics of a bag. Without a flag, each is chosen by its type, encoding and name.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Bags")]
pub struct BagArgs {
    /// Topic of the colour images in a bag [default: chosen by type and name; `yfslam info BAG` lists the topics].
    #[arg(long, value_name = "TOPIC")]
    color_topic: Option<String>,
    /// Topic of the depth images in a bag, registered to colour.
    #[arg(long, value_name = "TOPIC")]
    depth_topic: Option<String>,
    /// Topic of the left images of a stereo camera in a bag.
    #[arg(long, value_name = "TOPIC")]
    left_topic: Option<String>,
    /// Topic of the right images of a stereo camera in a bag.
    #[arg(long, value_name = "TOPIC")]
    right_topic: Option<String>,
    /// Topic of the calibration in a bag [default: that beside the colour or left images].
    #[arg(long, value_name = "TOPIC")]
    camera_info_topic: Option<String>,
    /// Topic of the ground truth in a bag: PoseStamped, Odometry, TransformStamped or TF; of TF also a chain of transforms, as in
    /// /tf:map.camera_link.
    #[arg(long, value_name = "TOPIC")]
    truth_topic: Option<String>,
    /// Frame of the body whose poses --truth-topic has; /tf_static leads from it to the camera [default: that of the messages].
    #[arg(long, value_name = "FRAME")]
    base_frame: Option<String>,
}

impl BagArgs {
    /// Chooses these topics.
    pub fn of(topics: TopicChoice) -> Self {
        let TopicChoice { color, depth, left, right, camera_info, truth, base_frame } = topics;
        Self {
            color_topic: color,
            depth_topic: depth,
            left_topic: left,
            right_topic: right,
            camera_info_topic: camera_info,
            truth_topic: truth,
            base_frame,
        }
    }

    /// Returns the topics that the user chose.
    pub fn choice(&self) -> TopicChoice {
        TopicChoice {
            color: self.color_topic.clone(),
            depth: self.depth_topic.clone(),
            left: self.left_topic.clone(),
            right: self.right_topic.clone(),
            camera_info: self.camera_info_topic.clone(),
            truth: self.truth_topic.clone(),
            base_frame: self.base_frame.clone(),
        }
    }
}

/// Describes the topics of a bag: types, numbers of messages, encodings, duration.
///
/// # Errors
/// The bag cannot be read.
pub fn describe(path: &Path) -> Result<String> {
    let bag = Bag::open(path)?;
    let encodings = bag.encodings()?;
    let mut text = String::new();
    if let Some((first_ns, last_ns)) = bag.span_ns() {
        writeln!(text, "received      in {:.3} s", seconds(last_ns.saturating_sub(first_ns)))?;
    }
    for (index, topic) in bag.topics().iter().enumerate() {
        let encoding = encodings.get(&index).map_or(String::new(), |encoding| format!(", {encoding}"));
        let understood = if topic.wire.is_some() { "" } else { ", in a serialisation that is not understood" };
        writeln!(
            text,
            "topic         {}: {}, {} messages{encoding}{understood}",
            topic.name, topic.type_name, topic.messages
        )?;
    }
    for note in bag.notes() {
        writeln!(text, "              {note}")?;
    }
    Ok(text)
}
