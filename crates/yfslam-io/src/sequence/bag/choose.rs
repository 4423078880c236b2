//! Chooses the topics of a bag that make the frames, by type, encoding and name, or as the user says.

use std::ops::ControlFlow;

use yfslam::config::DepthSource;

use crate::bag::{Bag, Need};
use crate::error::{Error, Result};
use crate::message::types::CameraInfo;
use crate::message::wire::Reader;
use crate::message::{ImageHead, MessageType};
use crate::sequence::SequenceOptions;

/// The topics that the user chose; `None` leaves the choice to the types and names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopicChoice {
    /// Topic of the colour images.
    pub color: Option<String>,
    /// Topic of the depth images.
    pub depth: Option<String>,
    /// Topic of the left images of a stereo camera.
    pub left: Option<String>,
    /// Topic of the right images of a stereo camera.
    pub right: Option<String>,
    /// Topic of the calibration of the colour or left camera.
    pub camera_info: Option<String>,
    /// Topic of the ground truth: `PoseStamped`, `Odometry`, `TransformStamped` or TF; `/tf:map.base_link` composes transforms.
    pub truth: Option<String>,
    /// Frame of the body whose poses the ground truth has, and to which the camera is mounted.
    pub base_frame: Option<String>,
}

impl TopicChoice {
    /// Returns whether the user chose any topic.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// A topic of images, with what its first message says.
#[derive(Clone, Debug)]
pub struct ImageTopic {
    pub topic: usize,
    pub name: String,
    pub kind: MessageType,
    pub head: ImageHead,
}

/// The image topics of a bag, and its calibrations by the name of their topic.
pub struct Survey {
    pub images: Vec<ImageTopic>,
    pub cameras: Vec<(String, CameraInfo)>,
    /// The bag, for messages.
    path: std::path::PathBuf,
    all: Vec<String>,
}

impl Survey {
    /// Reads the first message of each topic of images or calibrations.
    pub fn of(bag: &Bag) -> Result<Self> {
        let need = |topic: &crate::bag::Topic| match topic.kind {
            _ if topic.wire.is_none() => Need::Skip,
            Some(MessageType::Image | MessageType::CompressedImage) => Need::Head,
            Some(MessageType::CameraInfo) => Need::Whole,
            _ => Need::Skip,
        };
        let needs: Vec<Need> = bag.topics().iter().map(need).collect();
        let awaited =
            bag.topics().iter().zip(&needs).filter(|(t, need)| **need != Need::Skip && t.messages > 0).count();
        let all =
            bag.topics().iter().map(|t| format!("{} ({}, {} messages)", t.name, t.type_name, t.messages)).collect();
        let mut survey = Self { images: Vec::new(), cameras: Vec::new(), path: bag.path().into(), all };
        let mut seen = vec![false; needs.len()];
        bag.visit(&needs, &mut |found| {
            let (Some(seen_one), Some(topic)) = (seen.get_mut(found.topic), bag.topics().get(found.topic)) else {
                return ControlFlow::Continue(());
            };
            let Some((kind, wire)) = topic.kind.zip(topic.wire).filter(|_| !*seen_one) else {
                return ControlFlow::Continue(());
            };
            let name = topic.name.clone();
            if kind == MessageType::CameraInfo {
                let info = Reader::new(wire, found.bytes).and_then(|mut from| CameraInfo::read(&mut from));
                *seen_one = info.is_ok();
                survey.cameras.extend(info.ok().map(|info| (name, info)));
            } else if let Ok(head) = ImageHead::read(kind, wire, found.bytes) {
                *seen_one = true;
                survey.images.push(ImageTopic { topic: found.topic, name, kind, head });
            }
            let read = seen.iter().filter(|seen| **seen).count();
            if read < awaited { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        })?;
        // The order of arrival may change from recording to recording.
        survey.images.sort_by_key(|image| image.topic);
        Ok(survey)
    }

    /// Returns the topic of this name.
    fn named(&self, flag: &str, name: &str) -> Result<ImageTopic> {
        let found = self.images.iter().find(|image| image.name == name);
        found.cloned().ok_or_else(|| {
            let problem = format!("{flag} {name}: there is no such topic of images");
            Error::content(&self.path, problem, self.offer())
        })
    }

    /// Lists what could be chosen.
    fn offer(&self) -> String {
        let image = |image: &ImageTopic| format!("{} ({})", image.name, image.head.encoding);
        let images: Vec<String> = self.images.iter().map(image).collect();
        match images.as_slice() {
            [] => format!("it has no topic of images that is understood, only: {}", self.all.join(", ")),
            _ => format!("its topics of images are {}", images.join(", ")),
        }
    }

    /// Returns the candidate with the highest rank; several are an error that names the flag.
    fn best<K: Ord>(
        &self,
        flag: &str,
        candidates: impl Iterator<Item = ImageTopic>,
        rank: impl Fn(&ImageTopic) -> K,
    ) -> Result<Option<ImageTopic>> {
        let mut ranked: Vec<(K, ImageTopic)> = candidates.map(|image| (rank(&image), image)).collect();
        let Some(highest) = ranked.iter().map(|(rank, _)| rank).max() else { return Ok(None) };
        let equal: Vec<&str> =
            ranked.iter().filter(|(rank, _)| rank == highest).map(|(_, image)| image.name.as_str()).collect();
        if equal.len() > 1 {
            let problem = format!("has several topics that could be used: {}", equal.join(", "));
            return Err(Error::content(&self.path, problem, format!("choose one with {flag}")));
        }
        let index = ranked.iter().position(|(rank, _)| rank == highest);
        Ok(index.map(|index| ranked.swap_remove(index).1))
    }

    /// Returns the depth topic: aligned to colour rather than not, lossless rather than compressed.
    fn depth(&self) -> Result<Option<ImageTopic>> {
        let candidates =
            self.images.iter().filter(|image| image.head.is_depth(&image.name) && !is_infrared(&image.name));
        self.best("--depth-topic", candidates.cloned(), |image| {
            let name = image.name.to_lowercase();
            let aligned = ["aligned", "registered", "depth_to_rgb", "depth_to_color"];
            let is_aligned = aligned.iter().any(|word| name.contains(word));
            (is_aligned, name.contains("depth"), !name.contains("rect"), image.kind == MessageType::Image)
        })
    }

    /// Returns the colour topic: named so, in colours, as recorded rather than rectified, lossless rather than compressed.
    fn color(&self, depth: Option<&ImageTopic>) -> Result<Option<ImageTopic>> {
        let is_color =
            |image: &&ImageTopic| !image.head.is_depth(&image.name) && depth.is_none_or(|d| d.topic != image.topic);
        self.best("--color-topic", self.images.iter().filter(is_color).cloned(), |image| {
            let name = image.name.to_lowercase();
            let named = ["color", "colour", "rgb"].iter().any(|word| name.contains(word));
            let encoding = image.head.encoding.as_str();
            let is_grey = ["mono", "8UC1", "16UC1"].iter().any(|grey| encoding.starts_with(grey));
            let is_left = ["left", "infra1", "cam0"].iter().any(|word| name.contains(word));
            let is_raw = !name.contains("rect") && !name.contains("mono");
            (named, !is_grey, is_left, is_raw, image.kind == MessageType::Image, !is_infrared(&name))
        })
    }

    /// Returns the left and the right topic of a stereo camera: pairs of names such as `left` and `right`.
    fn stereo(&self) -> Result<Option<(ImageTopic, ImageTopic)>> {
        let right_of = |left: &ImageTopic| {
            PAIRS.iter().find_map(|[a, b]| {
                let name = left.name.replace(a, b);
                self.images.iter().find(|right| left.name.contains(a) && right.name == name)
            })
        };
        let candidates = self.images.iter().filter(|left| right_of(left).is_some() && !left.head.is_depth(&left.name));
        let left = self.best("--left-topic and --right-topic", candidates.cloned(), |image| {
            let is_rectified = image.name.contains("rect");
            (is_rectified, image.kind == MessageType::Image, image.name.contains("color"))
        })?;
        Ok(left.and_then(|left| right_of(&left).cloned().map(|right| (left, right))))
    }
}

/// Words that the names of the left and of the right topic have.
const PAIRS: [[&str; 2]; 7] = [
    ["left", "right"],
    ["infra1", "infra2"],
    ["Infrared_1", "Infrared_2"],
    ["cam0", "cam1"],
    ["camera_0", "camera_1"],
    ["image_0", "image_1"],
    ["fisheye1", "fisheye2"],
];

fn is_infrared(name: &str) -> bool {
    let name = name.to_lowercase();
    ["infra", "/ir/", "/ir_"].iter().any(|word| name.contains(word))
}

/// The topics that make the frames.
pub struct Chosen {
    pub depth_source: DepthSource,
    /// Colour or left images.
    pub color: ImageTopic,
    /// Depth or right images.
    pub paired: Option<ImageTopic>,
}

impl Chosen {
    pub fn images(&self) -> impl Iterator<Item = &ImageTopic> {
        std::iter::once(&self.color).chain(&self.paired)
    }

    /// Describes the topics in one line.
    pub fn describe(&self) -> String {
        let topic = |image: &ImageTopic| format!("{} ({})", image.name, image.head.encoding);
        let color = topic(&self.color);
        match (&self.paired, self.depth_source) {
            (Some(depth), DepthSource::Image) => format!("topics: colour {color}, depth {}", topic(depth)),
            (Some(right), _) => format!("topics: left {color}, right {}", topic(right)),
            (None, _) => format!("topic: {color}"),
        }
    }
}

/// Chooses the topics.
pub fn choose(survey: &Survey, options: &SequenceOptions) -> Result<Chosen> {
    let choice = &options.topics;
    let named = |flag: &str, name: &Option<String>| name.as_ref().map(|name| survey.named(flag, name)).transpose();
    let color = named("--color-topic", &choice.color)?;
    let depth = named("--depth-topic", &choice.depth)?;
    let (left, right) = (named("--left-topic", &choice.left)?, named("--right-topic", &choice.right)?);
    let missing = |what: &str, flag: &str| {
        let problem = format!("has no topic of {what}");
        let cure =
            format!("choose one with {flag}, or the sensor with --sensor rgbd, stereo or mono; {}", survey.offer());
        Error::content(&survey.path, problem, cure)
    };
    if left.is_some() != right.is_some() && options.depth_source != Some(DepthSource::Motion) {
        let problem = "only one of --left-topic and --right-topic is given";
        return Err(Error::argument(problem, "give both, or one with --sensor mono"));
    }
    let wanted = match options.depth_source {
        Some(wanted) => wanted,
        None if depth.is_some() => DepthSource::Image,
        None if left.is_some() => DepthSource::Stereo,
        None if survey.images.iter().any(|i| i.head.is_depth(&i.name) && !is_infrared(&i.name)) => DepthSource::Image,
        None if survey.stereo()?.is_some() => DepthSource::Stereo,
        None => return Err(missing("depth images, and none of right images", "--depth-topic or --right-topic")),
    };
    let any_color = |depth: Option<&ImageTopic>| match color.clone() {
        Some(color) => Ok(color),
        None => survey.color(depth)?.ok_or_else(|| missing("colour images", "--color-topic")),
    };
    let (color, paired) = match wanted {
        DepthSource::Image => {
            let depth = match depth {
                Some(depth) => depth,
                None => survey.depth()?.ok_or_else(|| missing("depth images", "--depth-topic"))?,
            };
            (any_color(Some(&depth))?, Some(depth))
        }
        DepthSource::Stereo => {
            let both = match left.zip(right) {
                Some(both) => both,
                None => survey.stereo()?.ok_or_else(|| missing("right images", "--left-topic and --right-topic"))?,
            };
            (both.0, Some(both.1))
        }
        DepthSource::Motion => (left.map_or_else(|| any_color(None), Ok)?, None),
    };
    let chosen = Chosen { depth_source: wanted, color, paired };
    check_sizes(survey, &chosen)?;
    Ok(chosen)
}

/// Refuses depth that is not registered to colour, where the sizes show it.
fn check_sizes(survey: &Survey, chosen: &Chosen) -> Result<()> {
    let Some(paired) = &chosen.paired else { return Ok(()) };
    let Some((a, b)) = chosen.color.head.size.zip(paired.head.size).filter(|(a, b)| a != b) else { return Ok(()) };
    let problem = format!("{} has {a} pixels, but {} has {b}", chosen.color.name, paired.name);
    let cure = match chosen.depth_source {
        DepthSource::Image => {
            "depth must be registered to colour: choose aligned depth images with --depth-topic, or record them (with \
             realsense2_camera: align_depth.enable:=true)"
        }
        _ => "choose two topics of the same size with --left-topic and --right-topic",
    };
    Err(Error::content(&survey.path, problem, cure))
}
