//! A frame that is no keyframe allocates no memory. There is one test function only, because the counter is that of the whole
//! process.

use std::alloc::{GlobalAlloc, Layout, System};
use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use yfslam::config::FeatureConfig;
use yfslam::unstable::{Features, GrayImage, OrbExtractor, gray_from_rgb};
use yfslam::{BoundingBox, Camera, Config, DepthImage, DepthSource, Detection, Frame, Image, Method, RgbImage, Slam};

/// An allocator that counts its calls.
struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller meets the conditions of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Returns an image of random squares of 8 × 8 px.
fn texture(seed: u32) -> RgbImage {
    let mut image = RgbImage::new(640, 480);
    for (pixel, i) in image.data_mut().iter_mut().zip(0u32..) {
        let field = (i % 640 / 8) * 7919 + (i / 640 / 8) * 104_729 + seed;
        *pixel = [field.wrapping_mul(2_654_435_761).to_be_bytes()[0]; 3];
    }
    image
}

#[test]
fn a_frame_that_is_no_keyframe_allocates_nothing() -> Result<(), Box<dyn Error>> {
    extraction_allocates_nothing_after_the_first_frame();
    let methods = [Method::None, Method::Boxes, Method::YfSlam, Method::DsSlam, Method::DynaSlam, Method::Full];
    for source in [DepthSource::Image, DepthSource::Stereo] {
        for method in methods {
            tracking_allocates_nothing_between_keyframes(method, source)?;
        }
    }
    Ok(())
}

/// Tracks a static camera in front of a wall, with the detection of a person in the image.
fn tracking_allocates_nothing_between_keyframes(method: Method, source: DepthSource) -> Result<(), Box<dyn Error>> {
    let camera = Camera::pinhole(640, 480, 535.4, 539.2, 320.1, 247.6);
    let mut config = Config::default();
    config.dynamic.method = method;
    config.depth.source = source;
    let mut slam = Slam::builder(camera).config(config).build()?;
    let mut raw = Image::new(640, 480);
    raw.data_mut().fill(9000u16);
    let bbox = BoundingBox { x_min: 100.0, y_min: 50.0, x_max: 250.0, y_max: 470.0 };
    let color = Arc::new(texture(3));
    let mut right = RgbImage::new(640, 480);
    // The wall has a disparity of 40 px.
    (0..480).for_each(|y| right.row_mut(y)[..600].copy_from_slice(&color.row(y)[40..]));
    let mut frame = Frame::rgbd(0, color, DepthImage { raw, metres_per_unit: 1.0 / 5000.0 })
        .with_detections(vec![Detection { class: 0, score: 0.9, bbox }]);
    frame.right = Some(Arc::new(right));
    let (mut quiet, mut last_keyframe) = (0, 0);
    for i in 0..60 {
        frame.timestamp_ns = i * 33_000_000;
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        let tracked = slam.track(&frame)?;
        let allocations = ALLOCATIONS.load(Ordering::Relaxed) - before;
        assert!(tracked.t_world_cam.is_some());
        last_keyframe = if tracked.is_keyframe { i } else { last_keyframe };
        // The list of tracked frames doubles its capacity at 16, 32 and 64 frames, and the frame after a keyframe observes more
        // landmarks than any before.
        if i > 20 && i > last_keyframe + 1 && i != 32 {
            assert_eq!(allocations, 0, "frame {i} of {method:?}, {source:?}");
            quiet += 1;
        }
    }
    assert!(quiet > 20, "only {quiet} frames of {method:?}, {source:?} were no keyframes");
    Ok(())
}

fn extraction_allocates_nothing_after_the_first_frame() {
    let frames = [texture(1), texture(2)];
    let mut extractor = OrbExtractor::new(&FeatureConfig::default());
    let (mut gray, mut features) = (GrayImage::default(), Features::default());
    let mut run = || {
        for frame in &frames {
            gray_from_rgb(frame, &mut gray);
            extractor.extract(&gray, &mut features);
            assert_eq!(features.key_points.len(), 1000);
        }
    };
    run();
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    assert!(before > 0);
    run();
    assert_eq!(ALLOCATIONS.load(Ordering::Relaxed), before);
}
