//! Extraction reuses its buffers.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use yfslam::config::FeatureConfig;
use yfslam::features::{Features, OrbExtractor};
use yfslam::image::{GrayImage, RgbImage, gray_from_rgb};

struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is handed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are those `System` asks for.
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

/// Random fields of 8 × 8 px.
fn texture(seed: u32) -> RgbImage {
    let mut image = RgbImage::new(640, 480);
    for (pixel, i) in image.data_mut().iter_mut().zip(0u32..) {
        let field = (i % 640 / 8) * 7919 + (i / 640 / 8) * 104_729 + seed;
        *pixel = [field.wrapping_mul(2_654_435_761).to_be_bytes()[0]; 3];
    }
    image
}

#[test]
fn no_allocation_after_the_first_frame() {
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
