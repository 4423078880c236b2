//! What the view without people is worth, by the same world in which there are none.
//!
//! In: a survey of a world, its volume. Out: how much of what people hide is known, and how near its colours are to the exact ones.
//! Exposure follows what is in the picture, people or not: the exact picture is brought to the light of the view by one factor a channel,
//! from what nobody hides.

use anyhow::Result;
use nalgebra::{Isometry3, Point3};
use yfslam::dense::background::Backgrounds;
use yfslam::dense::{CellGrid, DenseConfig, Piece, Survey, Volume};
use yfslam::image::Image;
use yfslam_synth::World;

use super::ghost_metrics::index_of;

/// Every so many keyframes a view is judged.
const EVERY: usize = 3;

/// Difference in depth up to which a keyframe sees the same surface, m, and as a share of it.
const SAME_M: f32 = 0.03;
const SAME_SHARE: f32 = 0.03;

/// What was found, over all views judged.
#[derive(Clone, Copy, Debug, Default)]
pub struct Views {
    /// Share of all pixels whose colour is known.
    pub valid: f64,
    /// The same of what moves hides.
    pub filled: f64,
    /// Share of what moves hides that another keyframe saw, by the exact world: more cannot be filled in.
    pub shown: f64,
    /// Peak signal-to-noise ratio of what is known, dB.
    pub psnr_db: f64,
    /// The same of what was filled in.
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

/// What a keyframe saw, exactly.
struct Sight {
    t_world_cam: Isometry3<f32>,
    depth_m: Image<f32>,
    instances: Image<u8>,
}

impl Sight {
    fn of(world: &World, timestamp_ns: i64) -> Self {
        let shot = world.frame(index_of(world, timestamp_ns));
        Self { t_world_cam: shot.t_world_cam.cast(), depth_m: shot.exact_depth, instances: shot.instances }
    }

    /// Whether a point of the world was seen, with nobody in the way.
    fn shows(&self, grid: &CellGrid, point: &Point3<f32>) -> bool {
        let p = self.t_world_cam.inverse_transform_point(point);
        let Some(at) = grid.project(&p) else { return false };
        let [u, v] = at.map(|cell| cell.round() as usize * grid.stride_px());
        let depth = self.depth_m.get(u, v).filter(|_| self.instances.get(u, v) == Some(&0));
        depth.is_some_and(|depth| (depth - p.z).abs() <= SAME_M + SAME_SHARE * p.z)
    }
}

/// Judges the views of keyframes.
pub fn judge(survey: &Survey, volume: &Volume, world: &World) -> Result<Views> {
    let sights: Vec<Sight> = survey.pieces.iter().map(|one| Sight::of(world, one.timestamp_ns)).collect();
    let mut empty = world.config().clone();
    (empty.people, empty.actors) = (0, Default::default());
    let empty = World::new(&empty)?;
    let config = DenseConfig::default();
    let views = Backgrounds::new(survey, volume, |_| {});
    let (mut all, mut filled) = (Error::default(), Error::default());
    let (mut cells, mut known, mut hidden, mut hidden_known, mut shown) = (0usize, 0usize, 0usize, 0usize, 0usize);
    for (number, one) in survey.pieces.iter().enumerate().step_by(EVERY) {
        let shot = empty.frame(index_of(&empty, one.timestamp_ns));
        let exact = Piece::cut(&config, &survey.grid, &shot.frame.color, &shot.frame.depth, |_, _| false);
        let Some(view) = views.of_piece(number) else { continue };
        let mut light = [[0.0f64; 3]; 2];
        for cell in (0..view.valid.data().len()).filter(|cell| !one.piece.moves(*cell)) {
            for (sums, rgb) in light.iter_mut().zip([view.color.data()[cell], exact.color(cell)]) {
                sums.iter_mut().zip(rgb).for_each(|(sum, v)| *sum += f64::from(v));
            }
        }
        let gain = [0, 1, 2].map(|channel| light[0][channel] / light[1][channel].max(1.0));
        let is_shown = |cell: usize| {
            let (columns, stride) = (survey.grid.columns(), survey.grid.stride_px());
            let z = shot.exact_depth.get(cell % columns * stride, cell / columns * stride).copied().unwrap_or_default();
            let [x, y] = survey.grid.rays()[cell];
            let point = shot.t_world_cam.cast() * Point3::new(x * z, y * z, z);
            sights.iter().enumerate().any(|(other, sight)| other != number && sight.shows(&survey.grid, &point))
        };
        for (cell, &valid) in view.valid.data().iter().enumerate() {
            let moves = one.piece.moves(cell);
            cells += 1;
            known += usize::from(valid);
            hidden += usize::from(moves);
            hidden_known += usize::from(moves && valid);
            shown += usize::from(moves && is_shown(cell));
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
    Ok(Views {
        valid: share(known, cells),
        filled: share(hidden_known, hidden),
        shown: share(shown, hidden),
        psnr_db: all.psnr_db(),
        filled_psnr_db: filled.psnr_db(),
    })
}
