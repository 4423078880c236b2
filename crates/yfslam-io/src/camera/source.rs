//! A camera calibration with its origin, and what its file does not say.

use std::sync::Arc;

use nalgebra::Isometry3;
use yfslam::Camera;
use yfslam::config::DepthSource;

use super::check::check_camera;
use crate::error::{Error, Result};
use crate::rectify::{MountedCamera, StereoRectification};

/// A checked camera calibration and its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraSource {
    /// The calibration.
    pub camera: Camera,
    /// Depth units per metre of the depth images that belong to it, such as 5000 for TUM and 1000 for millimetres.
    pub depth_factor: f64,
    /// The preset or file, for display.
    pub origin: String,
    /// Keys of the file that were not used.
    pub unused_keys: Vec<String>,
    /// The kind of file, such as "ORB-SLAM settings".
    pub kind: &'static str,
    /// What the user should know about the calibration.
    pub notes: Vec<String>,
    /// What the file does not say; [`complete_camera`](crate::complete_camera) fills it in.
    pub missing: Missing,
    /// The right camera of a stereo pair whose images are not rectified; [`complete_camera`](crate::complete_camera) rectifies them.
    pub right: Option<RightCamera>,
    /// Rectification of the images when they are read; `camera` is then the rectified left camera.
    pub rectification: Option<Arc<StereoRectification>>,
}

/// The right camera of a stereo pair.
#[derive(Clone, Debug, PartialEq)]
pub struct RightCamera {
    /// Calibration; the size is 0 where the file has none.
    pub camera: Camera,
    /// Pose of the right camera in the left one, m.
    pub t_left_right: Isometry3<f64>,
    /// The key that describes it.
    pub key: &'static str,
}

/// What a camera file does not say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Missing {
    /// The size of the images: `width` and `height` of the camera are 0.
    pub size: bool,
    /// The depth factor: it is 1.
    pub depth_factor: bool,
    /// The baseline of a stereo camera: `bf` is a default value, which does for RGB-D cameras only.
    pub baseline: bool,
    /// Why the calibration cannot be used for a stereo camera, with the key and what to do.
    pub stereo_problem: Option<String>,
}

impl CameraSource {
    /// Makes the source of a calibration that is complete: with the size of the images, the depth factor and, for a stereo camera, the
    /// baseline.
    pub fn new(camera: Camera, depth_factor: f64, origin: impl Into<String>) -> Self {
        let (unused_keys, notes) = (Vec::new(), Vec::new());
        Self {
            camera,
            depth_factor,
            origin: origin.into(),
            unused_keys,
            kind: "calibration",
            notes,
            missing: Missing::default(),
            right: None,
            rectification: None,
        }
    }

    /// Makes the source of a camera whose sequence has no depth images.
    pub(crate) fn without_depth(camera: Camera, origin: String) -> Self {
        Self::new(camera, 1.0, origin)
    }

    /// Takes another depth factor than that of the file.
    pub fn set_depth_factor(&mut self, depth_factor: f64) {
        self.depth_factor = depth_factor;
        self.missing.depth_factor = false;
    }

    /// Fills in what the file does not say and the recording does: the size of the images. Refuses what is missing still.
    ///
    /// # Errors
    /// There is no depth factor for depth images or no baseline for a stereo camera, the first image cannot be read, or the calibration
    /// does not fit its size.
    pub fn complete(
        &mut self,
        depth_source: DepthSource,
        image_size: impl FnOnce() -> Result<[usize; 2]>,
    ) -> Result<()> {
        let refuse =
            |problem: String, cure: &str| Err(Error::argument(format!("camera {}: {problem}", self.origin), cure));
        match depth_source {
            DepthSource::Image if self.missing.depth_factor => {
                let cure = "give --depth-factor with the depth units per metre: 5000 for TUM, 1000 for millimetres; or add it to the file ('DepthMapFactor: 5000.0' in settings of ORB-SLAM)";
                return refuse("the depth factor is missing".into(), cure);
            }
            DepthSource::Stereo if self.missing.stereo_problem.is_some() => {
                let problem = self.missing.stereo_problem.clone().unwrap_or_default();
                let cure = "rectify the images and give the calibration of the rectified camera with its baseline, or use --sensor mono";
                return refuse(problem, cure);
            }
            DepthSource::Stereo if self.missing.baseline => {
                let cure = "add 'bf = …' (baseline in m times fx in px) to a file in TOML, or 'Camera.bf' or 'Stereo.b' (m) to settings of ORB-SLAM, or use --sensor mono";
                return refuse("the baseline of the stereo camera is missing".into(), cure);
            }
            _ => {}
        }
        self.complete_size(image_size)
    }

    /// Takes the size of the images where the file has none.
    fn complete_size(&mut self, image_size: impl FnOnce() -> Result<[usize; 2]>) -> Result<()> {
        if self.missing.size {
            [self.camera.width, self.camera.height] = image_size()?;
            self.missing.size = false;
            let Camera { width, height, .. } = self.camera;
            self.notes
                .push(format!("the file has no image size; that of the first image, {width}×{height} px, is used"));
            check_camera(self)?;
        }
        Ok(())
    }

    /// Prepares the rectification of a pair that is not rectified; the camera is then the rectified left one.
    ///
    /// # Errors
    /// The first image cannot be read, or the two cameras do not form a stereo pair.
    pub(crate) fn rectify(&mut self, image_size: impl FnOnce() -> Result<[usize; 2]>) -> Result<()> {
        let Some(mut right) = self.right.take() else { return Ok(()) };
        self.complete_size(image_size)?;
        let left = &self.camera;
        if right.camera.width == 0 {
            (right.camera.width, right.camera.height) = (left.width, left.height);
        }
        let mounted = |camera: &Camera, t_body_cam| MountedCamera { camera: camera.clone(), t_body_cam };
        let pair = [mounted(left, Isometry3::identity()), mounted(&right.camera, right.t_left_right)];
        let [left, other] = &pair;
        let rectification = StereoRectification::new(left, other).map_err(|problem| {
            let problem = format!("camera {}: {problem}, by {}", self.origin, right.key);
            Error::argument(problem, "check the order of the cameras and the pose of one in the other")
        })?;
        self.camera = rectification.camera.clone();
        self.origin += &format!(", rectified with {}", right.key);
        (self.missing.stereo_problem, self.missing.baseline) = (None, false);
        self.rectification = Some(Arc::new(rectification));
        check_camera(self)
    }
}
