//! The structures of `yfslam.h`; the test `tests::layout` compares their fields with those that a C compiler sees.
#![allow(unsafe_code, reason = "the promise that structures hold numbers and pointers only")]

use std::ffi::c_void;

use crate::ffi::{DetectorFunction, Sized32, Text};

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Camera {
    pub struct_size: u32,
    pub width: u32,
    pub height: u32,
    pub reserved: u32,
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub distortion: [f64; 8],
    pub fps: f64,
    pub baseline_m: f64,
    pub depth_scale: f64,
    pub knows_readout: i32,
    pub reserved2: i32,
    pub readout_ms: f64,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Detection {
    pub x_min: f32,
    pub y_min: f32,
    pub x_max: f32,
    pub y_max: f32,
    pub score: f32,
    pub class_index: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct Options<'a> {
    pub struct_size: u32,
    pub sensor: i32,
    pub config_toml: Text<'a>,
    pub method: Text<'a>,
    pub detector: i32,
    pub threaded: i32,
    pub detector_file: Text<'a>,
    pub detector_function: Option<DetectorFunction>,
    pub detector_user: *mut c_void,
    pub map_file: Text<'a>,
    pub localise: i32,
    pub dense: i32,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            sensor: 0,
            config_toml: Text::NONE,
            method: Text::NONE,
            detector: 0,
            threaded: 0,
            detector_file: Text::NONE,
            detector_function: None,
            detector_user: std::ptr::null_mut(),
            map_file: Text::NONE,
            localise: 0,
            dense: 0,
        }
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub struct_size: u32,
    pub pixels: i32,
    pub timestamp_ns: i64,
    pub width: u32,
    pub height: u32,
    pub color: *const u8,
    pub color_stride: usize,
    pub depth_u16: *const u16,
    pub depth_m: *const f32,
    pub depth_stride: usize,
    pub depth_scale: f64,
    pub has_depth_timestamp: i32,
    pub has_detections: i32,
    pub depth_timestamp_ns: i64,
    pub right: *const u8,
    pub right_stride: usize,
    pub mask: *const u8,
    pub mask_stride: usize,
    pub detections: *const Detection,
    pub detection_count: usize,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            pixels: 0,
            timestamp_ns: 0,
            width: 0,
            height: 0,
            color: std::ptr::null(),
            color_stride: 0,
            depth_u16: std::ptr::null(),
            depth_m: std::ptr::null(),
            depth_stride: 0,
            depth_scale: 0.0,
            has_depth_timestamp: 0,
            has_detections: 0,
            depth_timestamp_ns: 0,
            right: std::ptr::null(),
            right_stride: 0,
            mask: std::ptr::null(),
            mask_stride: 0,
            detections: std::ptr::null(),
            detection_count: 0,
        }
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Pose {
    pub timestamp_ns: i64,
    pub position_m: [f64; 3],
    pub quaternion: [f64; 4],
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Tracked {
    pub struct_size: u32,
    pub state: i32,
    pub has_pose: i32,
    pub has_covariance: i32,
    pub is_keyframe: i32,
    pub closed_loop: i32,
    pub inliers: u64,
    pub pose: Pose,
    pub matrix: [f64; 16],
    pub covariance: [f64; 36],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Point {
    pub position_m: [f32; 3],
    pub color: [u8; 3],
    pub reserved: u8,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct GridInfo {
    pub struct_size: u32,
    pub width: u32,
    pub height: u32,
    pub reserved: u32,
    pub origin_m: [f64; 2],
    pub resolution_m: f64,
}

// SAFETY: repr(C), the size first, then numbers.
unsafe impl Sized32 for Camera {}
// SAFETY: repr(C), the size first, then numbers, pointers and a function that may be null.
unsafe impl Sized32 for Options<'_> {}
// SAFETY: repr(C), the size first, then numbers and pointers.
unsafe impl Sized32 for Frame {}
// SAFETY: repr(C), the size first, then numbers.
unsafe impl Sized32 for Tracked {}
// SAFETY: repr(C), the size first, then numbers.
unsafe impl Sized32 for GridInfo {}
