//! The right picture of a stereo pair: its features on a thread of their own beside those of the left, and the depths that follow.
//!
//! In: the right picture, then the features of the left. Out: depth for the features of the frame. The thread is waited for in the same
//! frame, so that the result does not depend on timing.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use crate::config::Config;
use crate::features::stereo::{StereoMatcher, StereoView};
use crate::features::{Features, FrameFeatures, OrbExtractor};
use crate::image::{DepthImage, RgbImage};
use crate::sensor::SensorModel;

/// Side of the spot that a feature's depth fills in the depth image of a stereo camera, px: that of the cells in which bodies are
/// outlined.
const SPOT_PX: usize = 4;
/// Unit of that image, m.
pub const METRES_PER_UNIT: f32 = 1e-3;

/// A picture to look at, the number of features asked for, and where they go.
type Request = (Arc<RgbImage>, usize, Box<StereoView>);

/// Looks at right pictures.
pub struct RightEye {
    matcher: StereoMatcher,
    /// Features asked for, as a multiple of those in the left picture.
    right_features: f64,
    /// `None` once the thread was told to end.
    requests: Option<SyncSender<Request>>,
    answers: Receiver<Box<StereoView>>,
    thread: Option<JoinHandle<()>>,
    /// `None` while the thread has it.
    view: Option<Box<StereoView>>,
}

impl RightEye {
    /// Starts the thread.
    ///
    /// # Errors
    /// If the operating system grants no thread.
    pub fn open(config: &Config, sensor: &SensorModel) -> std::io::Result<Self> {
        let (requests, inbox) = sync_channel::<Request>(1);
        let (outbox, answers) = sync_channel(1);
        let thread = std::thread::Builder::new().name("right picture".to_owned()).spawn(move || {
            for (picture, count, mut view) in inbox {
                view.see(&picture, count);
                drop(picture);
                if outbox.send(view).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self {
            matcher: StereoMatcher::new(&config.stereo, sensor.pinhole.bf, sensor.pinhole.fx),
            right_features: config.stereo.right_features,
            requests: Some(requests),
            answers,
            thread: Some(thread),
            view: Some(Box::new(StereoView::new(&config.features))),
        })
    }

    /// Hands over the right picture of this frame, in whose left picture `count` features are asked for.
    pub fn start(&mut self, picture: &Arc<RgbImage>, count: usize) {
        if let (Some(requests), Some(view)) = (&self.requests, self.view.take()) {
            // A thread that is gone shows when its view is asked for.
            let _ = requests.send((Arc::clone(picture), (self.right_features * count as f64) as usize, view));
        }
    }

    /// Gives `features`, made of `left`, which `extractor` has just found, the depths that the right picture tells. Of what they were
    /// `spots` is left with the depth of each feature in a spot around it, zero elsewhere.
    pub fn finish(
        &mut self,
        extractor: &OrbExtractor,
        left: &Features,
        features: &mut FrameFeatures,
        spots: &mut DepthImage,
    ) {
        spots.raw.data_mut().fill(0);
        if self.view.is_none() {
            self.view = self.answers.recv().ok();
        }
        let Some(right) = &self.view else { return };
        self.matcher.match_rows(extractor, left, right, |i, depth_m| {
            if let Some(feature) = features.features.get_mut(i) {
                feature.depth_m = Some(depth_m);
                paint(spots, feature.raw, depth_m);
            }
        });
    }
}

fn paint(spots: &mut DepthImage, [x, y]: [f32; 2], depth_m: f32) {
    let unit = (depth_m / spots.metres_per_unit + 0.5) as u16;
    let first = |centre: f32| (centre + 1.0) as usize - (SPOT_PX / 2).min((centre + 1.0) as usize);
    let (left, top) = (first(x), first(y));
    let right = (left + SPOT_PX).min(spots.raw.width());
    for row in top..(top + SPOT_PX).min(spots.raw.height()) {
        spots.raw.row_mut(row)[left.min(right)..right].fill(unit);
    }
}

impl Drop for RightEye {
    fn drop(&mut self) {
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // A panic was reported by the thread already.
            let _ = thread.join();
        }
    }
}
