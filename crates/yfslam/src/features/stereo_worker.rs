//! The right image of a stereo pair: its features are extracted on a thread beside those of the left image; depths follow.
//!
//! In: the right image, then the features of the left image. Out: a depth for each feature that was matched. The thread is joined within
//! the frame, so the result does not depend on timing.

use std::sync::Arc;

use crate::config::{FeatureConfig, StereoConfig};
use crate::features::stereo::{StereoMatcher, StereoView};
use crate::features::{Features, FrameFeatures, OrbExtractor};
use crate::image::{DepthImage, RgbImage};
use crate::worker::Worker;

/// Side of the square that a feature's depth fills in the depth image of a stereo camera, px: that of the cells of instance masks.
const SQUARE_PX: usize = 4;
/// Unit of that depth image, m.
pub(crate) const METRES_PER_UNIT: f32 = 1e-3;

/// An image, the number of features to extract, and the buffers that they go to.
type Request = (Arc<RgbImage>, usize, Box<StereoView>);

/// Extracts the features of right images and matches them with those of left images.
pub(crate) struct StereoWorker {
    matcher: StereoMatcher,
    /// Features of the right image as a multiple of those of the left image.
    right_features: f64,
    worker: Worker<Request, Box<StereoView>>,
    /// `None` while the thread has it.
    view: Option<Box<StereoView>>,
}

impl StereoWorker {
    /// Starts the thread for a pair whose baseline times focal length is `bf`, px·m, and whose focal length is `fx`, px.
    ///
    /// # Errors
    /// If the operating system grants no thread.
    pub(crate) fn spawn(features: &FeatureConfig, config: &StereoConfig, bf: f64, fx: f64) -> std::io::Result<Self> {
        let extract = |(image, count, mut view): Request| {
            view.extract(&image, count);
            Some(view)
        };
        Ok(Self {
            matcher: StereoMatcher::new(config, bf, fx),
            right_features: config.right_feature_factor,
            worker: Worker::spawn("stereo", 1, |_| extract)?,
            view: Some(Box::new(StereoView::new(features))),
        })
    }

    /// Hands over the right image of a frame whose left image is to have `count` features.
    pub(crate) fn start(&mut self, image: &Arc<RgbImage>, count: usize) {
        if let Some(view) = self.view.take() {
            // A thread that has ended is noticed when its answer is awaited.
            self.worker.send((Arc::clone(image), (self.right_features * count as f64) as usize, view));
        }
    }

    /// Sets the depths of `features`, which were made of `left`, which `extractor` has just extracted. `sparse_depth` becomes zero but
    /// for a square around each feature that has a depth.
    pub(crate) fn finish(
        &mut self,
        extractor: &OrbExtractor,
        left: &Features,
        features: &mut FrameFeatures,
        sparse_depth: &mut DepthImage,
    ) {
        sparse_depth.raw.data_mut().fill(0);
        if self.view.is_none() {
            self.view = self.worker.wait();
        }
        let Some(right) = &self.view else { return };
        self.matcher.match_rows(extractor, left, right, |i, depth_m| {
            if let Some(feature) = features.features.get_mut(i) {
                feature.depth_m = Some(depth_m);
                paint(sparse_depth, feature.raw, depth_m);
            }
        });
    }
}

fn paint(sparse_depth: &mut DepthImage, [x, y]: [f32; 2], depth_m: f32) {
    let unit = (depth_m / sparse_depth.metres_per_unit + 0.5) as u16;
    let first = |centre: f32| (centre + 1.0) as usize - (SQUARE_PX / 2).min((centre + 1.0) as usize);
    let (left, top) = (first(x), first(y));
    let right = (left + SQUARE_PX).min(sparse_depth.raw.width());
    for row in top..(top + SQUARE_PX).min(sparse_depth.raw.height()) {
        sparse_depth.raw.row_mut(row)[left.min(right)..right].fill(unit);
    }
}
