//! Learns the test pairs of the descriptor from photos: the table in `src/features/pattern.rs`.
//!
//! `cargo run --release --example learn_pattern -- IMAGE.pgm ...` (2 GB of memory, minutes)
//!
//! Rublee et al. (ICCV 2011, section 4.3) take the tests with means near one half that correlate little with those taken before. This
//! program follows the same greedy path, with a criterion that also knows how tests behave when the same corner is seen again: each
//! patch is sampled twice, upright and slightly displaced. Of all tests it takes the one that, together with those taken
//! before, separates best the Hamming distances of two views of one corner from those of different corners: the largest difference
//! of means relative to the standard deviation (Fisher's criterion).

mod pgm;

use std::f32::consts::TAU;
use std::io::Result;

use fearless_simd::{Level, Simd, dispatch};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;
use yfslam::config::FeatureConfig;
use yfslam::unstable::GrayImage;
use yfslam::unstable::{Features, KeyPoint, OrbExtractor};

/// Test pairs wanted.
const PAIRS: usize = 256;

/// Largest distance of a point from the key point, px.
const RADIUS: i32 = 17;

/// Least distance between the points of a pair, px: the blur makes closer ones alike.
const MIN_DISTANCE: i32 = 3;

/// Patches learned from, at least; all photos give the same number.
const PATCHES: usize = 1 << 14;

/// Standard deviations by which the second view differs: angle (rad), log of scale, position (px), brightness (grey levels).
const JITTER: [f32; 4] = [0.1, 0.08, 0.7, 2.0];

/// Seed of the second views.
const SEED: u64 = 1;

/// A pixel of the patch in all patches, in both views.
struct Point {
    offset: [i8; 2],
    views: [Vec<u8>; 2],
}

/// A candidate pair, and what its outcomes on all patches say.
struct Test {
    pair: [i8; 4],
    /// One bit a patch: the two views of the corner differ, the corner differs from another one.
    same: Bits,
    other: Bits,
    /// Covariance with all tests taken so far, of both kinds together.
    covariance: f64,
}

/// One bit a patch.
struct Bits {
    words: Vec<u64>,
    mean: f64,
}

fn main() -> Result<()> {
    let photos: Vec<String> = std::env::args().skip(1).collect();
    let points = sample(&photos)?;
    let mut tests = candidates(&points);
    eprintln!("{} tests on {} patches", tests.len(), points[0].views[0].len());
    for (i, pair) in choose(&mut tests).iter().enumerate() {
        let (start, end) = (if i % 6 == 0 { "    " } else { " " }, if i % 6 == 5 { "\n" } else { "" });
        eprint!("{start}{pair:?},{end}");
    }
    eprintln!();
    Ok(())
}

/// Brightness of each point of the disc in both views of all patches.
fn sample(photos: &[String]) -> Result<Vec<Point>> {
    let side = -RADIUS..=RADIUS;
    let square = side.clone().flat_map(|v| side.clone().map(move |u| [u, v]));
    let disc = square.filter(|[u, v]| u * u + v * v <= RADIUS * RADIUS).map(|offset| offset.map(|d| d as i8));
    let mut points: Vec<Point> = disc.map(|offset| Point { offset, views: Default::default() }).collect();
    let per_photo = PATCHES.div_ceil(photos.len().max(1));
    let config = FeatureConfig { count: 2 * per_photo, ..FeatureConfig::default() };
    let scales: Vec<f32> = (0..config.levels).map(|octave| config.scale_factor.powi(octave as i32)).collect();
    let mut extractor = OrbExtractor::new(&config);
    let mut features = Features::default();
    let mut random = Pcg32::new(SEED, 0);
    for path in photos {
        let photo = pgm::read(path)?;
        extractor.extract(&photo, &mut features);
        let levels: Vec<GrayImage> = scales.iter().map(|&scale| level(&photo, scale)).collect();
        let views = |k: &KeyPoint| {
            let (image, scale) = (&levels[usize::from(k.octave)], scales[usize::from(k.octave)]);
            let upright = view(image, scale, k, &points, || 0.0)?;
            Some([upright, view(image, scale, k, &points, || gaussian(&mut random))?])
        };
        let patches: Vec<[Vec<u8>; 2]> = features.key_points.iter().filter_map(views).take(per_photo).collect();
        for patch in patches {
            for (i, point) in points.iter_mut().enumerate() {
                point.views[0].push(patch[0][i]);
                point.views[1].push(patch[1][i]);
            }
        }
    }
    Ok(points)
}

/// Brightness of the points around `k`, displaced by `random` standard deviations; `None` at the image's edge.
fn view(
    image: &GrayImage,
    scale: f32,
    k: &KeyPoint,
    points: &[Point],
    mut random: impl FnMut() -> f32,
) -> Option<Vec<u8>> {
    let [angle, zoom, position, brightness] = JITTER;
    let (sin, cos) = (k.angle_rad + angle * random()).sin_cos();
    let zoom = (zoom * random()).exp();
    let x = (k.x + 0.5) / scale - 0.5 + position * random();
    let y = (k.y + 0.5) / scale - 0.5 + position * random();
    let pixel = |point: &Point| {
        let [u, v] = point.offset.map(|d| f32::from(d) * zoom);
        let (x, y) = ((x + u * cos - v * sin).round(), (y + u * sin + v * cos).round());
        let pixel = image.get(x as usize, y as usize).filter(|_| x >= 0.0 && y >= 0.0)?;
        Some((f32::from(*pixel) + brightness * random()).round() as u8)
    };
    points.iter().map(pixel).collect()
}

/// A draw from the normal distribution (Box & Muller 1958).
fn gaussian(random: &mut Pcg32) -> f32 {
    let mut uniform = || (random.next_u32() as f32 + 0.5) / 2f32.powi(32);
    (-2.0 * uniform().ln()).sqrt() * (TAU * uniform()).cos()
}

/// The photo at 1/`scale`, smoothed like the extractor's.
fn level(photo: &GrayImage, scale: f32) -> GrayImage {
    let size = |len: usize| (len as f32 / scale) as usize;
    let (width, height) = (size(photo.width()), size(photo.height()));
    let nearest = |x: usize| ((x as f32 + 0.5) * scale) as usize;
    let gauss = |i: usize| (-(i.abs_diff(3).pow(2) as f32) / 8.0).exp();
    let total: f32 = (0..7).map(gauss).sum();
    let pass = |pixel: &dyn Fn(usize, usize) -> u8, dx: usize, dy: usize| {
        let mut out = GrayImage::new(width, height);
        for (i, value) in out.data_mut().iter_mut().enumerate() {
            let tap = |t: usize| {
                let x = (i % width + t * dx).saturating_sub(3 * dx).min(width - 1);
                let y = (i / width + t * dy).saturating_sub(3 * dy).min(height - 1);
                gauss(t) * f32::from(pixel(x, y))
            };
            *value = ((0..7).map(tap).sum::<f32>() / total).round() as u8;
        }
        out
    };
    let columns = pass(&|x, y| photo.row(nearest(y))[nearest(x)], 0, 1);
    pass(&|x, y| columns.row(y)[x], 1, 0)
}

/// All tests between two points that are far enough apart.
fn candidates(points: &[Point]) -> Vec<Test> {
    let mut tests = Vec::new();
    for (i, a) in points.iter().enumerate() {
        for b in &points[i + 1..] {
            let [du, dv] = [0, 1].map(|axis| i32::from(a.offset[axis]) - i32::from(b.offset[axis]));
            if du * du + dv * dv >= MIN_DISTANCE * MIN_DISTANCE {
                tests.push(Test::new(a, b));
            }
        }
    }
    tests
}

impl Test {
    fn new(a: &Point, b: &Point) -> Self {
        let outcome = |view: usize| -> Vec<u64> {
            let (a, b) = (a.views[view].as_chunks::<64>().0, b.views[view].as_chunks::<64>().0);
            let word = |(a, b): (&[u8; 64], &[u8; 64])| (0..64).fold(0, |word, i| word | u64::from(a[i] < b[i]) << i);
            a.iter().zip(b).map(word).collect()
        };
        let (first, second) = (outcome(0), outcome(1));
        let half = first.len() / 2;
        let another = second[half..].iter().chain(&second[..half]);
        let same = Bits::new(first.iter().zip(&second).map(|(a, b)| a ^ b).collect());
        let other = Bits::new(first.iter().zip(another).map(|(a, b)| a ^ b).collect());
        Self { pair: [a.offset[0], a.offset[1], b.offset[0], b.offset[1]], same, other, covariance: 0.0 }
    }
}

impl Bits {
    fn new(words: Vec<u64>) -> Self {
        let ones: u32 = words.iter().map(|word| word.count_ones()).sum();
        Self { mean: f64::from(ones) / (64 * words.len()) as f64, words }
    }

    fn variance(&self) -> f64 {
        self.mean * (1.0 - self.mean)
    }

    #[inline(always)]
    fn covariance(&self, other: &Self) -> f64 {
        let both: u32 = self.words.iter().zip(&other.words).map(|(a, b)| (a & b).count_ones()).sum();
        f64::from(both) / (64 * self.words.len()) as f64 - self.mean * other.mean
    }
}

/// Takes [`PAIRS`] tests, each the best in company of those taken before.
fn choose(tests: &mut Vec<Test>) -> Vec<[i8; 4]> {
    let (mut separation, mut variance) = (0.0, 0.0);
    let mut chosen = Vec::new();
    while chosen.len() < PAIRS {
        let with = |test: &Test| {
            let added = test.same.variance() + test.other.variance() + 2.0 * test.covariance;
            (separation + test.other.mean - test.same.mean, (variance + added).max(f64::MIN_POSITIVE))
        };
        let criterion = |test: &Test| with(test).0 / with(test).1.sqrt();
        let Some(best) = (0..tests.len()).max_by(|&a, &b| criterion(&tests[a]).total_cmp(&criterion(&tests[b]))) else {
            break;
        };
        (separation, variance) = with(&tests[best]);
        let best = tests.swap_remove(best);
        dispatch!(Level::new(), simd => add_covariance(simd, tests, &best));
        chosen.push(best.pair);
    }
    chosen
}

/// The bulk of the work; dispatched for the sake of the instruction that counts bits.
#[inline(always)]
fn add_covariance<S: Simd>(_: S, tests: &mut [Test], best: &Test) {
    for test in tests {
        test.covariance += test.same.covariance(&best.same) + test.other.covariance(&best.other);
    }
}
