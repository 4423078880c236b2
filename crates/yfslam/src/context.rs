//! The sensor model and the configuration that all stages share.
//!
//! In: a camera and a configuration. Out: projection, bounds and noise of the features, resolved once.

use crate::camera::Camera;
use crate::config::{Config, DepthSource};
use crate::features::{Feature, ImageBounds};
use crate::geometry::Pinhole;
use crate::optimize::residual::Measurement;

/// The sensor model with the configuration it was resolved from, as the stages use it.
#[derive(Clone, Debug)]
pub(crate) struct Context {
    /// The sensor model.
    pub sensor: SensorModel,
    /// The configuration, with the values of section `monocular` in place for a camera without depth.
    pub config: Config,
}

impl Context {
    /// Resolves the configuration for a camera; `scale_factors` are those of the extractor.
    pub(crate) fn new(camera: &Camera, config: &Config, scale_factors: &[f32]) -> Self {
        let sensor = SensorModel::new(camera, config, scale_factors);
        Self { sensor, config: config.clone().for_sensor() }
    }
}

/// Camera, pyramid and noise model, resolved from the configuration once.
#[derive(Clone, Debug)]
pub(crate) struct SensorModel {
    /// The calibration.
    pub camera: Camera,
    /// Its distortion-free part.
    pub pinhole: Pinhole,
    /// Extent of the undistorted image.
    pub bounds: ImageBounds,
    /// Scale of each pyramid level relative to the finest.
    pub scale_factors: Vec<f32>,
    /// 1/σ² of a corner's position per level, px⁻².
    weights_px: Vec<f64>,
    /// 1/σ² of the disparity per level, px⁻².
    weights_disparity: Vec<f64>,
    /// Depth up to which a feature's depth is trusted to make a landmark at once, m.
    pub close_limit_m: f64,
    /// Depth beyond which the sensor's readings are ignored, m.
    max_depth_m: f64,
    /// Whether it measures depth: without, all lengths are in a unit of their own.
    pub measures_depth: bool,
}

impl SensorModel {
    /// Resolves the configuration for a camera; `scale_factors` are those of the extractor.
    pub(crate) fn new(camera: &Camera, config: &Config, scale_factors: &[f32]) -> Self {
        let pinhole = Pinhole::from(camera);
        // σ_z = n z² makes the disparity bf / z uncertain by bf·n, whatever the depth.
        let sigma_disparity = camera.bf * config.depth.noise_per_m;
        let sigma = |scale: &f32| match config.depth.source {
            DepthSource::Stereo => config.stereo.disparity_sigma_px * f64::from(*scale),
            DepthSource::Image | DepthSource::Motion => sigma_disparity,
        };
        Self {
            camera: camera.clone(),
            pinhole,
            bounds: ImageBounds::of(camera),
            scale_factors: scale_factors.to_vec(),
            weights_px: scale_factors.iter().map(|s| (config.depth.corner_sigma_px * f64::from(*s)).powi(-2)).collect(),
            weights_disparity: scale_factors.iter().map(|scale| sigma(scale).powi(-2)).collect(),
            close_limit_m: config.depth.close_limit_baselines * camera.bf / camera.fx,
            max_depth_m: match config.depth.source {
                // The noise of a disparity already says how little a far depth tells.
                DepthSource::Stereo => f64::INFINITY,
                DepthSource::Image | DepthSource::Motion => config.depth.max_m,
            },
            measures_depth: config.depth.source != DepthSource::Motion,
        }
    }

    /// Motion along the optical axis above which it tells how the scale of what is seen changes: the baseline of the depth sensor, m.
    /// Without one there is no length to compare with.
    pub(crate) fn baseline(&self) -> f64 {
        if self.measures_depth { self.pinhole.bf / self.pinhole.fx } else { f64::INFINITY }
    }

    /// Number of pyramid levels.
    pub(crate) fn levels(&self) -> usize {
        self.scale_factors.len()
    }

    /// Scale of a pyramid level.
    #[inline]
    pub(crate) fn scale(&self, octave: u8) -> f32 {
        self.scale_factors.get(usize::from(octave)).copied().unwrap_or(1.0)
    }

    /// The feature as the optimisers want it.
    #[inline]
    pub(crate) fn measurement(&self, feature: &Feature) -> Measurement {
        let depth = feature.depth_m.map(f64::from).filter(|z| *z < self.max_depth_m);
        let at_level = |weights: &[f64]| weights.get(usize::from(feature.octave)).copied().unwrap_or(0.0);
        Measurement {
            u: f64::from(feature.u),
            v: f64::from(feature.v),
            disparity: depth.map_or(0.0, |z| self.pinhole.bf / z),
            weight_px: at_level(&self.weights_px),
            weight_disparity: if depth.is_some() { at_level(&self.weights_disparity) } else { 0.0 },
        }
    }

    /// The level at which a landmark should be found from `distance_m`, given its `max_distance_m` (ORB-SLAM, IEEE T-RO 2015, V-D).
    #[inline]
    pub(crate) fn predict_octave(&self, max_distance_m: f64, distance_m: f64) -> u8 {
        let ratio = (max_distance_m / distance_m) as f32;
        // The first level whose scale reaches the ratio; a handful of comparisons beat a logarithm.
        self.scale_factors.iter().position(|s| *s >= ratio).unwrap_or(self.levels().saturating_sub(1)) as u8
    }
}
