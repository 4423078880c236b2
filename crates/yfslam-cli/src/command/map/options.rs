//! Options of `yfslam map` that consist of several numbers.

use std::str::FromStr;

use nalgebra::Vector3;

/// A range of heights above the floor, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightBand(pub [f32; 2]);

impl FromStr for HeightBand {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<f32> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
        match numbers[..] {
            [low, high] if low < high && low.is_finite() && high.is_finite() => Ok(Self([low, high])),
            _ => Err(format!("'{text}' is not a range of heights; write LOW,HIGH such as 0.1,1.8")),
        }
    }
}

/// How the upward direction is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Up {
    /// From horizontal surfaces in the map.
    Level,
    /// The upward direction of the first image.
    Camera,
    /// A direction in the world of the run.
    Direction([f64; 3]),
}

impl FromStr for Up {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "level" => return Ok(Self::Level),
            "camera" => return Ok(Self::Camera),
            _ => {}
        }
        let numbers: Vec<f64> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
        match <[f64; 3]>::try_from(numbers) {
            Ok(up) if Vector3::from(up).norm() > 1e-6 && up.iter().all(|v| v.is_finite()) => Ok(Self::Direction(up)),
            _ => Err(format!("'{text}' is not a direction; write level, camera, or X,Y,Z such as 0,-1,0")),
        }
    }
}
