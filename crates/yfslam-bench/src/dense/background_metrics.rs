//! Compares the views without people with the same world in which there are none.
//!
//! In: the dense map of a rendered world, its volume, the world. Out: the share of what people hide whose colour is known, and the
//! distance of these colours from the exact ones. The exposure of an image depends on what it shows, so the exact image is first scaled,
//! channel by channel, to the brightness of the view where no person hides anything.

use anyhow::Result;
use nalgebra::{Isometry3, Point3};
use yfslam::Image;
use yfslam::dense::Backgrounds;
use yfslam::dense::{CellGrid, DenseConfig, DenseMap, KeyframePatch, Volume};
use yfslam_synth::World;

use super::ghost_metrics::index_of;

/// Number of keyframes from one view that is compared to the next.
const EVERY: usize = 3;
/// Difference in depth up to which a keyframe shows the same surface, m, and as a share of the depth.
const SAME_M: f32 = 0.03;
const SAME_SHARE: f32 = 0.03;

/// The comparison over all views.
#[derive(Clone, Copy, Debug, Default)]
pub struct BackgroundMetrics {
    /// Share of all pixels whose colour is known.
    pub valid: f64,
    /// Share of the pixels hidden by what moves whose colour is known.
    pub filled: f64,
    /// Share of them that another keyframe has seen, by the exact world: more cannot be filled in.
    pub fillable: f64,
    /// Peak signal-to-noise ratio of all known pixels, dB.
    pub psnr_db: f64,
    /// The same of the pixels that were filled in.
    pub filled_psnr_db: f64,
}

/// Sums of squared differences.
#[derive(Default)]
struct Error {
    squares: f64,
    count: usize,
}

impl Error {
    fn add(&mut self, a: [f64; 3], b: [u8; 3]) {
        self.squares += a.iter().zip(b).map(|(a, b)| (a - f64::from(b)).powi(2)).sum::<f64>();
        self.count += 3;
    }

    fn psnr_db(&self) -> f64 {
        10.0 * (255.0f64.powi(2) * self.count as f64 / self.squares.max(1e-9)).log10()
    }
}

/// The exact view of a keyframe.
struct ExactView {
    t_world_cam: Isometry3<f32>,
    depth_m: Image<f32>,
    instances: Image<u8>,
}

impl ExactView {
    fn of(world: &World, timestamp_ns: i64) -> Self {
        let frame = world.frame(index_of(world, timestamp_ns));
        Self { t_world_cam: frame.t_world_cam.cast(), depth_m: frame.exact_depth, instances: frame.instances }
    }

    /// Whether the view shows a point of the world, with no person in front of it.
    fn shows(&self, grid: &CellGrid, point: &Point3<f32>) -> bool {
        let p = self.t_world_cam.inverse_transform_point(point);
        let Some(at) = grid.project(&p) else { return false };
        let [u, v] = at.map(|cell| cell.round() as usize * grid.stride_px());
        let depth = self.depth_m.get(u, v).filter(|_| self.instances.get(u, v) == Some(&0));
        depth.is_some_and(|depth| (depth - p.z).abs() <= SAME_M + SAME_SHARE * p.z)
    }
}

/// Compares the views of every few keyframes.
pub fn compare(map: &DenseMap, volume: &Volume, world: &World) -> Result<BackgroundMetrics> {
    let exact_views: Vec<ExactView> = map.patches.iter().map(|one| ExactView::of(world, one.timestamp_ns)).collect();
    let mut empty = world.config().clone();
    (empty.people, empty.actors) = (0, Default::default());
    let empty = World::new(&empty)?;
    let config = DenseConfig::default();
    let views = Backgrounds::new(map, volume, |_| {});
    let (mut all, mut filled) = (Error::default(), Error::default());
    let (mut cells, mut known, mut hidden, mut hidden_known, mut fillable) = (0usize, 0usize, 0usize, 0usize, 0usize);
    for (number, one) in map.patches.iter().enumerate().step_by(EVERY) {
        let frame = empty.frame(index_of(&empty, one.timestamp_ns));
        let Some(depth) = &frame.frame.depth else { continue };
        let exact = KeyframePatch::extract(&config, &map.grid, &frame.frame.color, depth, |_, _| false);
        let Some(view) = views.of_patch(number) else { continue };
        let mut brightness = [[0.0f64; 3]; 2];
        for cell in (0..view.valid.data().len()).filter(|cell| !one.patch.moves(*cell)) {
            for (sums, rgb) in brightness.iter_mut().zip([view.color.data()[cell], exact.color(cell)]) {
                sums.iter_mut().zip(rgb).for_each(|(sum, v)| *sum += f64::from(v));
            }
        }
        let gain = [0, 1, 2].map(|channel| brightness[0][channel] / brightness[1][channel].max(1.0));
        let is_fillable = |cell: usize| {
            let (columns, stride) = (map.grid.columns(), map.grid.stride_px());
            let z =
                frame.exact_depth.get(cell % columns * stride, cell / columns * stride).copied().unwrap_or_default();
            let [x, y] = map.grid.rays()[cell];
            let point = frame.t_world_cam.cast() * Point3::new(x * z, y * z, z);
            exact_views.iter().enumerate().any(|(other, view)| other != number && view.shows(&map.grid, &point))
        };
        for (cell, &valid) in view.valid.data().iter().enumerate() {
            let moves = one.patch.moves(cell);
            cells += 1;
            known += usize::from(valid);
            hidden += usize::from(moves);
            hidden_known += usize::from(moves && valid);
            fillable += usize::from(moves && is_fillable(cell));
            if valid {
                let rgb = exact.color(cell);
                let rgb = [0, 1, 2].map(|channel| (f64::from(rgb[channel]) * gain[channel]).min(255.0));
                all.add(rgb, view.color.data()[cell]);
                if moves {
                    filled.add(rgb, view.color.data()[cell]);
                }
            }
        }
    }
    let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
    Ok(BackgroundMetrics {
        valid: share(known, cells),
        filled: share(hidden_known, hidden),
        fillable: share(fillable, hidden),
        psnr_db: all.psnr_db(),
        filled_psnr_db: filled.psnr_db(),
    })
}
