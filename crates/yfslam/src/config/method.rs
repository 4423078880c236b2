//! The names of the dynamic filters and of the searches for depth groups.

use serde::{Deserialize, Serialize};

/// The dynamic filter, which keeps dynamic features out of tracking and mapping.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Every feature is used, as in ORB-SLAM2.
    None,
    /// Every feature inside a bounding box is dropped.
    Boxes,
    /// YF-SLAM: inside a box, the depth group of the person is dropped and the background is kept.
    #[serde(rename = "yf")]
    YfSlam,
    /// DS-SLAM: people are dropped while a feature on them violates the epipolar geometry.
    #[serde(rename = "ds")]
    DsSlam,
    /// DynaSLAM: people are dropped, and features that are nearer than the depth predicted by earlier keyframes.
    #[serde(rename = "dyna")]
    DynaSlam,
    /// DMS-SLAM: features whose motion differs from that of their neighbours are dropped; it uses no detector.
    #[serde(rename = "dms")]
    DmsSlam,
    /// The method of this project: people are segmented in the depth image, and objects that have moved in the last seconds are dropped.
    #[default]
    Full,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 7] =
        [Self::None, Self::Boxes, Self::YfSlam, Self::DsSlam, Self::DynaSlam, Self::DmsSlam, Self::Full];

    /// Returns whether the filter uses bounding boxes of movable objects.
    pub fn needs_boxes(self) -> bool {
        !matches!(self, Self::None | Self::DmsSlam)
    }
}

/// The search for the largest depth group in a bounding box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Grouping {
    /// The paper's Geometric Depth RANSAC: pairs of depths are drawn from a seeded generator.
    Ransac,
    /// A sliding window over the sorted depths: always the largest group, without random draws.
    #[default]
    Exact,
}
