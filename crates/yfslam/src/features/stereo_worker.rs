//! The right image of a stereo pair: its features are extracted on a worker while the calling thread extracts those of the left image.
//!
//! In: the right image, then the features of the left image. Out: a depth for each feature that was matched. The answer of the worker is
//! awaited within the frame, so that the result does not depend on timing.

use std::sync::Arc;

use crate::config::{FeatureConfig, StereoConfig};
use crate::features::stereo::{StereoMatcher, StereoView};
use crate::features::{Features, FrameFeatures, OrbExtractor};
use crate::image::{DepthImage, RgbImage};
use crate::worker::Worker;

/// Side of the square that is filled with the depth of a feature in the sparse depth image, px; equal to the cells of instance masks.
const SQUARE_PX: usize = 4;
/// Unit of the sparse depth image, m.
pub(crate) const METRES_PER_UNIT: f32 = 1e-3;

/// Right image, number of features to extract, and the buffers for them.
type Request = (Arc<RgbImage>, usize, Box<StereoView>);

/// Worker that extracts the features of right images, and the matcher with the features of left images.
pub(crate) struct StereoWorker {
    matcher: StereoMatcher,
    /// Number of features of the right image as a multiple of that of the left image.
    right_features: f64,
    worker: Worker<Request, Box<StereoView>>,
    /// Buffers of the right image; `None` while the worker uses them.
    view: Option<Box<StereoView>>,
}

impl StereoWorker {
    /// Starts the worker for a stereo pair with baseline times focal length `bf`, px·m, and focal length `fx`, px.
    ///
    /// # Errors
    /// If the operating system cannot start a thread.
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

    /// Sends the right image of a frame to the worker; `count` is the number of features of the left image.
    pub(crate) fn start(&mut self, image: &Arc<RgbImage>, count: usize) {
        if let Some(view) = self.view.take() {
            // If the worker has ended, `finish` receives no answer and sets no depths.
            self.worker.send((Arc::clone(image), (self.right_features * count as f64) as usize, view));
        }
    }

    /// Waits for the worker and sets the depths of `features`, which were made from `left` by `extractor`. `sparse_depth` becomes zero
    /// except for a square around each feature with depth.
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
                fill_square(sparse_depth, feature.raw, depth_m);
            }
        });
    }
}

/// Fills the square around (x, y) with a depth.
fn fill_square(sparse_depth: &mut DepthImage, [x, y]: [f32; 2], depth_m: f32) {
    let unit = (depth_m / sparse_depth.metres_per_unit + 0.5) as u16;
    let first = |centre: f32| (centre + 1.0) as usize - (SQUARE_PX / 2).min((centre + 1.0) as usize);
    let (left, top) = (first(x), first(y));
    let right = (left + SQUARE_PX).min(sparse_depth.raw.width());
    for row in top..(top + SQUARE_PX).min(sparse_depth.raw.height()) {
        sparse_depth.raw.row_mut(row)[left.min(right)..right].fill(unit);
    }
}
