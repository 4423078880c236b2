//! Matrices as OpenCV stores them (`camera_matrix: !!opencv-matrix`), under the names that its samples and the field use.

use super::super::draft::{Draft, Lens};
use super::super::settings::{Settings, pixels};
use super::ros::{given, no_pinhole};
use super::stereo::{Right, motion, with_right};
use crate::error::Result;

pub const CURE: &str = "give the matrix of a pinhole camera without skew, such as cv2.calibrateCamera returns it";

const MATRICES: [&str; 11] = [
    "camera_matrix",
    "Camera_Matrix",
    "cameraMatrix",
    "CameraMatrix",
    "camera_intrinsics",
    "intrinsic_matrix",
    "intrinsics",
    "M1",
    "K1",
    "K",
    "cameraMatrix1",
];
const COEFFICIENTS: [&str; 13] = [
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distortionCoefficients",
    "distCoeffs",
    "DistCoeffs",
    "dist_coeffs",
    "dist_coeff",
    "distortion_coeffs",
    "distortion",
    "D1",
    "D",
    "distCoeffs1",
    "dist",
];

pub fn recognises(settings: &Settings) -> bool {
    MATRICES.iter().any(|key| settings.has(key) || settings.has(&format!("{key}.data")))
}

pub fn read(settings: &mut Settings) -> Result<Draft> {
    let key = given(settings, &MATRICES);
    let matrix = settings.numbers(&[key])?.unwrap_or_default();
    let mut draft = match matrix[..] {
        [fx, fy, cx, cy] => Draft::new([fx, fy, cx, cy]),
        [..] if matrix.len() == 9 => Draft::from_matrix(&matrix, 3).ok_or_else(|| no_pinhole(settings, &MATRICES))?,
        _ => return Err(settings.refuse(key, format!("{key} has {} numbers, not 9", matrix.len()), CURE)),
    };
    let key = given(settings, &COEFFICIENTS);
    let numbers = settings.numbers(&[key])?.unwrap_or_default();
    let model = settings.text(&["distortion_model"])?;
    draft.lens = Lens::of_model(model.as_deref().map(|model| ("distortion_model", model)), &numbers, settings, key)?;
    draft.size = settings.size(
        &["image_width", "image_Width", "imageWidth", "width", "cols"],
        &["image_height", "image_Height", "imageHeight", "height", "rows"],
    )?;
    let key = given(settings, &["image_size", "imageSize", "ImageSize", "img_size", "resolution", "size"]);
    if let (None, Some(size)) = (draft.size, settings.exactly::<2>(&[key])?) {
        let [width, height] = size.map(pixels);
        let size = width.zip(height);
        let size =
            size.ok_or_else(|| settings.refuse(key, format!("{key} is {size:?}"), "give whole numbers of pixels"))?;
        draft.size = Some(size.into());
    }
    draft.fps = settings.number(&["fps", "frame_rate"])?;
    draft.depth_factor = settings.number(&["depth_factor", "depth_map_factor", "DepthMapFactor"])?;
    let second = given(settings, &["M2", "K2", "cameraMatrix2"]);
    if let Some(matrix) = settings.exactly::<9>(&[second])? {
        let right = Draft::from_matrix(&matrix, 3).ok_or_else(|| no_pinhole(settings, &[second]))?;
        let coefficients = settings.numbers(&["D2", "distCoeffs2"])?.unwrap_or_default();
        let lens = Lens::of_opencv(&coefficients, settings, "D2")?;
        let (of_right, of_left) = (motion(settings, &["T_c1_c2"])?, stereo_calibrate(settings)?);
        let (is_right_in_left, motion) = (of_right.is_some(), of_right.or(of_left));
        let (intrinsics, size) = (right.intrinsics, draft.size);
        draft = with_right(draft, &Right { intrinsics, lens, size, motion, is_right_in_left, key: second });
    }
    Ok(draft)
}

/// Returns `R` and `T` of `stereoCalibrate`, which take points of the first camera to the second, as a 4 × 4 matrix.
fn stereo_calibrate(settings: &mut Settings) -> Result<Option<Vec<f64>>> {
    let (rotation, translation) = (settings.numbers(&["R"])?, settings.numbers(&["T"])?);
    Ok(match (rotation.as_deref(), translation.as_deref()) {
        (Some(&[a, b, c, d, e, f, g, h, i]), Some(&[x, y, z])) => {
            Some(vec![a, b, c, x, d, e, f, y, g, h, i, z, 0.0, 0.0, 0.0, 1.0])
        }
        _ => None,
    })
}
