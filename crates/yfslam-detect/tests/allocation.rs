//! The detector runs in the per-frame path: after the first image of a size it allocates nothing.

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use common::{Net, Size, Style};
use yfslam::Detector;
use yfslam::image::RgbImage;
use yfslam_detect::{DetectorConfig, YoloFastestV2};

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn detecting_allocates_nothing_after_the_first_image() {
    let net = Net::yolo(&Size { height: 64, width: 64, channels: 4, classes: 80 }, Style::Folded, 1);
    let config = DetectorConfig { score_threshold: 0.01, ..DetectorConfig::default() };
    let mut detector = YoloFastestV2::from_bytes("synthetic", &net.to_onnx(), &config).unwrap();
    let image = RgbImage::from_vec(30, 20, (0..600).map(|index| [(index % 251) as u8; 3]).collect()).unwrap();
    let mut found = Vec::new();
    detector.detect(&image, &mut found).unwrap();
    assert!(!found.is_empty());
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    for _ in 0..10 {
        detector.detect(&image, &mut found).unwrap();
    }
    assert_eq!(ALLOCATIONS.load(Ordering::Relaxed) - before, 0);
}
