//! Searches how close people and robots come to the camera, so that they cover the wanted share of the image.

use rayon::prelude::*;

use super::World;
use crate::actors::Actors;
use crate::light::Lights;
use crate::render::Backdrop;

impl World {
    /// Searches the closeness of people and robots at which all actors cover the wanted share of the image.
    pub(super) fn choose_distance(&mut self) {
        const FRAMES: usize = 24;
        let rays = self.small_rays.clone();
        let count = FRAMES.min(self.len());
        let times: Vec<f64> = (0..count).map(|k| self.seconds(k * self.len() / count)).collect();
        let backdrops: Vec<Backdrop> =
            times.iter().map(|&t| Backdrop::new(&rays, self.path.pose(t).inverse(), &self.scene.mesh)).collect();
        // Light does not matter for the share.
        let dark = Lights::default();
        let share = |actors: &Actors| {
            let shares = times.par_iter().zip(&backdrops).map(|(&t, b)| b.share(&rays, &actors.at(t, &dark)));
            // Summed in order: a parallel sum would depend on the threads.
            shares.collect::<Vec<f64>>().iter().sum::<f64>() / count as f64
        };
        if !self.actors.has_walkers() {
            self.person_share = share(&self.actors);
            return;
        }
        let mut try_out = |closeness: f64| {
            self.actors.set_closeness(&self.scene, &self.config, &self.path, closeness);
            let reached = share(&self.actors);
            ((reached - self.config.person_share).abs(), closeness, reached)
        };
        let mut best = try_out(-1.0);
        let mut step = 0.5;
        for k in -1..=4 {
            let tried = try_out(f64::from(k) * step);
            best = if tried.0 < best.0 { tried } else { best };
        }
        for _ in 0..4 {
            step /= 2.0;
            for closeness in [best.1 - step, best.1 + step] {
                let tried = try_out(closeness.min(2.0));
                best = if tried.0 < best.0 { tried } else { best };
            }
        }
        (_, _, self.person_share) = try_out(best.1);
    }
}
