//! Versions, errors, cameras.

use std::ffi::c_char;

use yfslam_io::{CameraSource, load_camera};

use crate::error::{self, Failure, Result};
use crate::ffi::{Out, Text, export, guarded};
use crate::structs::Camera;

/// As `YFSLAM_ABI_VERSION` of the header.
pub const ABI_VERSION: u32 = 1;

export! {
    fn yfslam_abi_version() -> u32 {
        ABI_VERSION
    }

    fn yfslam_version() -> *const c_char {
        concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
    }

    fn yfslam_last_error() -> *const c_char {
        error::last()
    }

    fn yfslam_camera_load(preset_or_file: Text<'_>, camera: Out<'_, Camera>) -> i32 {
        guarded(|| {
            camera.check("camera")?;
            let source = load_camera(preset_or_file.required("preset_or_file")?, None).map_err(Failure::file)?;
            camera.set("camera", &Camera::of(&source))
        })
    }
}

impl Camera {
    pub fn of(source: &CameraSource) -> Self {
        let c = &source.camera;
        let mut distortion = [0.0; 8];
        distortion.iter_mut().zip(c.distortion.iter().chain(&c.rational)).for_each(|(to, from)| *to = *from);
        Self {
            struct_size: size_of::<Self>() as u32,
            width: u32::try_from(c.width).unwrap_or(u32::MAX),
            height: u32::try_from(c.height).unwrap_or(u32::MAX),
            fx: c.fx,
            fy: c.fy,
            cx: c.cx,
            cy: c.cy,
            distortion,
            fps: c.fps,
            baseline_m: if source.missing.baseline { 0.0 } else { c.bf / c.fx },
            depth_scale: if source.missing.depth_factor { 0.0 } else { 1.0 / source.depth_factor },
            knows_readout: i32::from(c.readout_ms.is_some()),
            readout_ms: c.readout_ms.unwrap_or_default(),
            ..Self::default()
        }
    }

    /// Returns the checked calibration.
    pub fn source(&self) -> Result<CameraSource> {
        let [k1, k2, p1, p2, k3, k4, k5, k6] = self.distortion;
        let (width, height) = (self.width as usize, self.height as usize);
        let mut camera = yfslam::Camera::pinhole(width, height, self.fx, self.fy, self.cx, self.cy)
            .with_distortion([k1, k2, p1, p2, k3]);
        camera.rational = [k4, k5, k6];
        if self.fps != 0.0 {
            camera = camera.with_fps(self.fps);
        }
        if self.baseline_m != 0.0 {
            camera = camera.with_bf(self.baseline_m * self.fx);
        }
        camera.readout_ms = (self.knows_readout != 0).then_some(self.readout_ms);
        let mut source = CameraSource::new(camera, 1.0, "yfslam_camera");
        if self.depth_scale != 0.0 {
            source.set_depth_factor(1.0 / self.depth_scale);
        }
        source.missing.depth_factor = self.depth_scale == 0.0;
        source.missing.baseline = self.baseline_m == 0.0;
        yfslam_io::camera::check_camera(&source).map_err(Failure::setup)?;
        Ok(source)
    }
}
