//! The errors of the sensor.

use serde::{Deserialize, Serialize};

/// Errors that the sensor adds to the exact image. Each can be switched off with a zero or `false`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorConfig {
    /// Standard deviation of colour noise, grey levels of 255.
    pub color_noise: f32,
    /// Depth noise independent of distance, m: the first term of σ_z = a + b (z − 0.4 m)² (Nguyen, Izadi and Lovell,
    /// "Modeling Kinect sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012, eq. 3: a = 0.0012 m).
    pub depth_noise_m: f32,
    /// Depth noise that grows with distance, 1/m: the second term of the same equation (b = 0.0019 /m).
    pub depth_noise_growth: f32,
    /// Depth noise at steep angles θ of the surface, m^1.5: the factor of θ² / (π/2 − θ)² / √z, which is added above 60° (same
    /// paper, eq. 3: 0.0001). The paper itself was not available for this term: formula and factor agree with open implementations
    /// that cite it. That the two terms above hold alone between 10° and 60° agrees with other citations.
    pub depth_noise_angle: f32,
    /// Step of the disparity in px of a structured-light sensor (1/8 for the Kinect: Khoshelham and Elberink,
    /// Sensors 2012, section 3); the depth step is z² · step / bf.
    pub disparity_step_px: f32,
    /// Whether pixels that the projector cannot reach, and depth edges, have no depth.
    pub holes: bool,
    /// Angle between the surface normal and the ray beyond which there is no depth, degrees; 90 measures at any angle. The default
    /// is our choice and not measured: steep surfaces return little of the projected light.
    pub max_angle_deg: f32,
    /// Least returned light, as reflectance · cos θ / z², 1/m²; darker pixels have no depth; 0 measures all. The default loses
    /// black cloth and screens (reflectance 0.04) beyond 2.8 m and keeps grey walls over the whole range.
    pub min_return: f32,
    /// Time from the colour image to its depth image, s: depth shows the world this much later. 0 is a sensor that synchronises
    /// both, such as those of PrimeSense; without synchronisation they are up to half a frame apart.
    pub depth_offset_s: f64,
    /// Time from the first to the last row of the colour image, and of each image of a stereo pair, ms, -100 to 100: positive if the
    /// top row is read first, negative if the bottom row is, 0 for a global shutter, which reads all rows at once. The stamp and the
    /// pose of a frame are those of the instant at which the row in the middle of the image is read. The `readout_ms` of the camera
    /// of the world is what a SLAM system is told, which may be nothing; it does not change the images.
    pub readout_ms: f64,
    /// The same for the depth image, about its own stamp. `None`: as for the colour image.
    pub depth_readout_ms: Option<f64>,
    /// Exposure time of the colour camera, s: motion is blurred, about the instant at which a row is read; 0 gives sharp images. 10 ms is the shortest time without flicker
    /// in light of 50 Hz mains.
    pub exposure_s: f64,
    /// Share of a change of brightness that automatic exposure compensates, 0 to 1; 0 keeps the gain. PrimeSense cameras have
    /// automatic exposure.
    pub auto_exposure: f32,
    /// Smallest measured depth, m.
    pub min_depth_m: f32,
    /// Largest measured depth, m.
    pub max_depth_m: f32,
}

impl Default for SensorConfig {
    fn default() -> Self {
        Self {
            color_noise: 1.5,
            depth_noise_m: 0.0012,
            depth_noise_growth: 0.0019,
            depth_noise_angle: 0.0001,
            disparity_step_px: 0.125,
            holes: true,
            max_angle_deg: 80.0,
            min_return: 0.005,
            depth_offset_s: 0.0,
            readout_ms: 0.0,
            depth_readout_ms: None,
            exposure_s: 0.010,
            auto_exposure: 0.8,
            min_depth_m: 0.4,
            max_depth_m: 5.0,
        }
    }
}

impl SensorConfig {
    /// Returns the perfect sensor: no noise, no blur, no holes, all rows at once, unlimited depth, rounded to the unit of the camera only.
    pub fn perfect() -> Self {
        Self {
            color_noise: 0.0,
            depth_noise_m: 0.0,
            depth_noise_growth: 0.0,
            depth_noise_angle: 0.0,
            disparity_step_px: 0.0,
            holes: false,
            max_angle_deg: 90.0,
            min_return: 0.0,
            depth_offset_s: 0.0,
            readout_ms: 0.0,
            depth_readout_ms: None,
            exposure_s: 0.0,
            auto_exposure: 0.0,
            min_depth_m: 0.0,
            max_depth_m: f32::INFINITY,
        }
    }

    /// Returns the time from the first to the last row of the depth image, ms.
    pub fn depth_readout(&self) -> f64 {
        self.depth_readout_ms.unwrap_or(self.readout_ms)
    }
}
