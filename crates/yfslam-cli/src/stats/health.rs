//! Signs that the result of a run may be wrong although no stage has reported an error.

use serde::{Deserialize, Serialize};
use yfslam::{FrameHealth, Tracked, TrackingStart};
use yfslam_io::time::format_stamp;

use super::recognition::RecognitionTally;

/// In how many frames there was a sign, and when first and last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sign {
    pub frames: usize,
    pub first_ns: Option<i64>,
    pub last_ns: Option<i64>,
}

/// The signs of all frames; see [`FrameHealth`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HealthTally {
    pub depth_missing: Sign,
    pub depth_saturated: Sign,
    pub depth_noisy: Sign,
    pub depth_contradicts: Sign,
    pub plane_fills_view: Sign,
    pub stands_still: Sign,
    pub image_repeated: Sign,
    pub time_gap: Sign,
    /// A new map or submap was begun after the camera was lost.
    pub begun_anew: Sign,
}

impl HealthTally {
    /// Counts a frame.
    pub fn count(&mut self, tracked: &Tracked, recognition: &RecognitionTally) {
        let health: &FrameHealth = &tracked.health;
        let begun_anew = tracked.start == Some(TrackingStart::NewMap) && !recognition.lost.is_empty();
        let signs = [
            (&mut self.depth_missing, health.depth_missing),
            (&mut self.depth_saturated, health.depth_saturated),
            (&mut self.depth_noisy, health.depth_noisy),
            (&mut self.depth_contradicts, health.depth_contradicts),
            (&mut self.plane_fills_view, health.plane_fills_view),
            (&mut self.stands_still, health.stands_still),
            (&mut self.image_repeated, health.image_repeated),
            (&mut self.time_gap, health.time_gap),
            (&mut self.begun_anew, begun_anew),
        ];
        for (sign, _) in signs.into_iter().filter(|(_, is_there)| *is_there) {
            sign.frames += 1;
            sign.first_ns.get_or_insert(tracked.timestamp_ns);
            sign.last_ns = Some(tracked.timestamp_ns);
        }
    }

    /// Returns the signs that there were, with what they mean.
    pub fn signs(&self) -> impl Iterator<Item = (&'static str, Sign)> + use<> {
        let all = [
            ("hardly any depth", self.depth_missing),
            ("saturated depth", self.depth_saturated),
            ("depth that is noise", self.depth_noisy),
            ("depth that contradicts the images", self.depth_contradicts),
            ("a plane that fills the view", self.plane_fills_view),
            ("an image that stands still while the pose moves", self.stands_still),
            ("the same image again", self.image_repeated),
            ("a gap in time", self.time_gap),
            ("a map that was begun anew", self.begun_anew),
        ];
        all.into_iter().filter(|(_, sign)| sign.frames > 0)
    }

    /// Describes the signs in one line; `None` if there were none.
    pub fn describe(&self) -> Option<String> {
        let describe = |(meaning, Sign { frames, first_ns, .. }): (&str, Sign)| {
            let first = first_ns.map_or(String::new(), |ns| format!(" from {} s on", format_stamp(ns)));
            format!("{meaning} in {frames} frames{first}")
        };
        let signs: Vec<_> = self.signs().map(describe).collect();
        (!signs.is_empty()).then(|| signs.join("; "))
    }
}
