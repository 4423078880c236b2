//! The sensor model and the configuration that all stages share.
//!
//! In: a camera and a configuration. Out: projection, image bounds and noise of the features, computed once.

use crate::camera::Camera;
use crate::config::{Config, DepthSource};
use crate::features::{Feature, ImageBounds};
use crate::geometry::Pinhole;
use crate::optimize::residual::Measurement;

/// Sensor model and configuration, as all stages use them.
#[derive(Clone, Debug)]
pub(crate) struct Context {
    /// Sensor model.
    pub sensor: SensorModel,
    /// Configuration; for a camera without depth the values of section `monocular` are in effect.
    pub config: Config,
}

impl Context {
    /// Applies the configuration to a camera; `scale_factors` are those of the ORB extractor.
    pub(crate) fn new(camera: &Camera, config: &Config, scale_factors: &[f32]) -> Self {
        let sensor = SensorModel::new(camera, config, scale_factors);
        Self { sensor, config: config.clone().for_sensor() }
    }
}

/// Camera, pyramid and noise model, computed once from the configuration.
#[derive(Clone, Debug)]
pub(crate) struct SensorModel {
    /// Calibration.
    pub camera: Camera,
    /// Projection without lens distortion.
    pub pinhole: Pinhole,
    /// Extent of the undistorted image.
    pub bounds: ImageBounds,
    /// Scale of each pyramid level relative to the finest.
    pub scale_factors: Vec<f32>,
    /// 1/σ² of a feature's position for each level, px⁻².
    weights_px: Vec<f64>,
    /// 1/σ² of the disparity for each level, px⁻².
    weights_disparity: Vec<f64>,
    /// Largest depth at which a single measurement is accurate enough to create a landmark, m ("close" in ORB-SLAM2).
    pub close_limit_m: f64,
    /// Depth beyond which measurements are ignored, m.
    max_depth_m: f64,
    /// Whether depth is measured; if it is not, the map has an arbitrary unit of length.
    pub measures_depth: bool,
}

impl SensorModel {
    /// Applies the configuration to a camera; `scale_factors` are those of the ORB extractor.
    pub(crate) fn new(camera: &Camera, config: &Config, scale_factors: &[f32]) -> Self {
        let pinhole = Pinhole::from(camera);
        // With σ_z = n z² the standard deviation of the disparity bf / z is bf·n at every depth.
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
                // The noise of the disparity already gives far depths a small weight.
                DepthSource::Stereo => f64::INFINITY,
                DepthSource::Image | DepthSource::Motion => config.depth.max_m,
            },
            measures_depth: config.depth.source != DepthSource::Motion,
        }
    }

    /// Returns the baseline of the depth sensor, m: a longer motion along the optical axis changes the scale of features noticeably.
    /// Infinite without depth, because then no metric length exists.
    pub(crate) fn baseline(&self) -> f64 {
        if self.measures_depth { self.pinhole.bf / self.pinhole.fx } else { f64::INFINITY }
    }

    /// Returns the number of pyramid levels.
    pub(crate) fn levels(&self) -> usize {
        self.scale_factors.len()
    }

    /// Returns the scale of a pyramid level relative to the finest.
    #[inline]
    pub(crate) fn scale(&self, octave: u8) -> f32 {
        self.scale_factors.get(usize::from(octave)).copied().unwrap_or(1.0)
    }

    /// Returns a feature's position and disparity with their weights, as the optimisers use them.
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

    /// Predicts the pyramid level of a landmark at `distance_m`, given its `max_distance_m` (ORB-SLAM, IEEE T-RO 2015, section V-D).
    #[inline]
    pub(crate) fn predict_octave(&self, max_distance_m: f64, distance_m: f64) -> u8 {
        let ratio = (max_distance_m / distance_m) as f32;
        // The first level whose scale reaches the ratio. A few comparisons are faster than a logarithm.
        self.scale_factors.iter().position(|s| *s >= ratio).unwrap_or(self.levels().saturating_sub(1)) as u8
    }
}
