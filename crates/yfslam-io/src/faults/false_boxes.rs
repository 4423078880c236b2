//! A detector that takes anything for a person.
//!
//! In: the size of the images. Out: boxes that stay for some frames, the same on every run.

use yfslam::{BoundingBox, Detection};

use super::mixed;

/// Most boxes at a time.
const BOXES: usize = 3;
/// Longest time for which a box stays, frames.
const MAX_FRAMES: u64 = 60;
/// Probability with which a frame without the most boxes gets one more.
const PROBABILITY: f64 = 0.1;

/// The boxes of the current frame.
#[derive(Debug, Default)]
pub(super) struct FalseBoxes {
    boxes: Vec<Detection>,
    /// The frame from which on each box is gone, by its number.
    ends: Vec<u64>,
    frame: u64,
    seed: u64,
    draws: u64,
}

impl FalseBoxes {
    /// Other seeds give other boxes.
    pub(super) fn new(seed: u64) -> Self {
        Self { seed: mixed(seed), ..Self::default() }
    }

    /// Returns the boxes of the next frame, of `width` × `height` px: up to three at a time, of any size and place, with scores of .3 to .9,
    /// each for 1 to 60 frames.
    pub(super) fn next(&mut self, width: usize, height: usize) -> &[Detection] {
        self.frame += 1;
        for i in (0..self.boxes.len()).rev() {
            if self.ends[i] <= self.frame {
                self.boxes.remove(i);
                self.ends.remove(i);
            }
        }
        if self.boxes.len() < BOXES && self.draw() < PROBABILITY {
            let [x_min, x_max] = self.draw_interval(width);
            let [y_min, y_max] = self.draw_interval(height);
            let score = (0.3 + 0.6 * self.draw()) as f32;
            self.boxes.push(Detection { class: 0, score, bbox: BoundingBox { x_min, y_min, x_max, y_max } });
            let frames = 1 + (self.draw() * MAX_FRAMES as f64) as u64;
            self.ends.push(self.frame + frames.min(MAX_FRAMES));
        }
        &self.boxes
    }

    /// Returns begin and end of an interval of any size and place, px.
    fn draw_interval(&mut self, length: usize) -> [f32; 2] {
        let (size, place) = (self.draw(), self.draw());
        let from = (1.0 - size) * place;
        [(from * length as f64) as f32, ((from + size) * length as f64) as f32 + 1.0]
    }

    /// Returns a number in [0, 1).
    fn draw(&mut self) -> f64 {
        self.draws += 1;
        (mixed(self.seed ^ self.draws) >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_come_and_go_within_their_limits_and_are_the_same_again() {
        let frames = |mut boxes: FalseBoxes| -> Vec<Vec<Detection>> {
            (0..600).map(|_| boxes.next(640, 480).to_vec()).collect()
        };
        let all = frames(FalseBoxes::new(0));
        assert_eq!(all, frames(FalseBoxes::new(0)));
        assert_ne!(all, frames(FalseBoxes::new(1)));
        assert!((0..=BOXES).all(|count| all.iter().any(|boxes| boxes.len() == count)));
        let flat: Vec<&Detection> = all.iter().flatten().collect();
        assert!(flat.iter().all(|d| (0.3..0.9).contains(&d.score) && d.bbox.x_min >= 0.0 && d.bbox.y_max <= 481.0));
        let share = |d: &&Detection| d.bbox.area() / (640.0 * 480.0);
        assert!(flat.iter().any(|d| share(d) > 0.5) && flat.iter().any(|d| share(d) < 0.02));
    }
}
