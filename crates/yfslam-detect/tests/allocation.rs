//! The detector runs for every frame: after the first image of a size it allocates nothing.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use common::{Net, Size, Style};
use yfslam::{Detector, RgbImage};
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

/// Counts the allocations of `work`.
fn allocations(work: impl FnOnce()) -> usize {
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    work();
    ALLOCATIONS.load(Ordering::Relaxed) - before
}

fn image(width: usize, height: usize, pixel: impl Fn(usize) -> u8) -> RgbImage {
    RgbImage::from_vec(width, height, (0..width * height).map(|index| [pixel(index); 3]).collect()).unwrap()
}

/// All networks are in one test, because the count is that of all threads.
#[test]
fn detecting_allocates_nothing_after_the_first_image_of_a_size_however_many_objects_the_next_one_shows() {
    assert!(allocations(|| drop(vec![1_u8])) > 0, "the counter counts");
    let net = Net::yolo(&Size { height: 64, width: 64, channels: 4, classes: 80 }, Style::Folded, 1);
    let config = DetectorConfig { score_threshold: 0.1, ..DetectorConfig::default() };
    let random = YoloFastestV2::from_bytes("synthetic", &net.to_onnx(), &config).unwrap();
    let low = DetectorConfig { score_threshold: 0.008, ..DetectorConfig::default() };
    let embedded = YoloFastestV2::embedded(&low).unwrap();
    let integers = YoloFastestV2::embedded(&DetectorConfig { integers: true, ..low }).unwrap();
    for (mut detector, width, height, blank) in
        [(random, 30, 20, 0), (embedded, 640, 480, 200), (integers, 640, 480, 200)]
    {
        // A vertical bar in front of a textured wall.
        let figure = |index: usize| {
            let (x, y) = (index % width * 100 / width, index / width * 100 / height);
            if x.abs_diff(50) < 12 && y > 20 { (index % 97) as u8 } else { 150 + (index % 101) as u8 }
        };
        let (first, next) = (image(width, height, |_| blank), image(width, height, figure));
        let mut found = Vec::with_capacity(10_000);
        detector.detect(&first, &mut found).unwrap();
        let few = found.len();

        let made = allocations(|| (0..10).for_each(|_| detector.detect(&next, &mut found).unwrap()));
        assert_eq!(made, 0, "{width}×{height}");
        // The first image is empty, so that no detection in it could reserve memory.
        assert!(few == 0 && !found.is_empty(), "{few} boxes, then {}", found.len());
    }
}
