//! The errors of the sensor.

use serde::{Deserialize, Serialize};

/// What the sensor adds to the exact picture. Each part has its own switch: a zero (or `false`) turns it off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorConfig {
    /// Standard deviation of colour noise, grey levels of 255.
    pub color_noise: f32,
    /// Depth noise independent of distance, m: the first term of σ_z = a + b (z − 0.4 m)² (Nguyen, Izadi and Lovell,
    /// "Modeling Kinect sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012, eq. 3: a = 0.0012 m).
    pub depth_noise_m: f32,
    /// Depth noise that grows with distance, 1/m: the second term there (b = 0.0019 /m).
    pub depth_noise_growth: f32,
    /// Depth noise at steep angles θ of the surface, m^1.5: the factor of θ² / (π/2 − θ)² / √z, which is added above 60° (same paper,
    /// eq. 3: 0.0001). The paper itself was not at hand for this term: formula and factor agree with open implementations that cite
    /// it, and that the two terms above hold alone between 10° and 60° with what others say of it.
    pub depth_noise_angle: f32,
    /// Step of the disparity in px of a structured-light sensor (1/8 for the Kinect: Khoshelham and Elberink,
    /// Sensors 2012, section 3); the depth step is z² · step / bf.
    pub disparity_step_px: f32,
    /// Whether places that the projector cannot see, and depth edges, have no depth.
    pub holes: bool,
    /// Angle between the surface's normal and the ray beyond which there is no depth, degrees; 90 measures at any angle. The
    /// default is a choice of ours, from no measurement: little of the projected light comes back from steeper surfaces.
    pub max_angle_deg: f32,
    /// Least light that comes back, as reflectance · cos θ / z², 1/m²; darker places have no depth; 0 measures them all. The default
    /// loses black cloth and screens (reflectance 0.04) beyond 2.8 m and keeps grey walls over the whole range.
    pub min_return: f32,
    /// Time between the colour image and the depth image that goes with it, s: depth shows the world this much later. 0 is a sensor
    /// that synchronises both, as PrimeSense ones can; freely running ones are up to half a frame apart.
    pub depth_offset_s: f64,
    /// How long the colour camera's shutter is open, s: what moves is smeared; 0 freezes it. 10 ms is the shortest time that does not
    /// flicker in light of 50 Hz mains.
    pub exposure_s: f64,
    /// Share of a change of brightness that automatic exposure makes up for, 0 to 1; 0 keeps the gain. PrimeSense cameras adapt.
    pub auto_exposure: f32,
    /// Nearest depth that is measured, m.
    pub min_depth_m: f32,
    /// Farthest depth that is measured, m.
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
            exposure_s: 0.010,
            auto_exposure: 0.8,
            min_depth_m: 0.4,
            max_depth_m: 5.0,
        }
    }
}

impl SensorConfig {
    /// The perfect sensor: no noise, no blur, no holes, depth of everything, rounded to the camera's unit only.
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
            exposure_s: 0.0,
            auto_exposure: 0.0,
            min_depth_m: 0.0,
            max_depth_m: f32::INFINITY,
        }
    }
}
