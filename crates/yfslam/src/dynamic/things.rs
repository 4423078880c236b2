//! What stands in a frame: the body in each box, for maps that know classes.
//!
//! In: boxes of things that cannot move, the depth image, the frame's features. Out: the class at each position. Bodies are found as
//! those of people are, by the depth group in the box (YF-SLAM, section 3.3), but no surface is followed out of it: chairs stand on
//! floors, and screens before walls.

use crate::config::DynamicConfig;
use crate::detection::Detection;
use crate::dynamic::body_depth::DepthGroups;
use crate::dynamic::body_mask::BodyMask;
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// Outlines of things, and the class of each.
#[derive(Clone, Debug, Default)]
pub struct Things {
    bodies: BodyMask,
    classes: Vec<usize>,
}

impl Things {
    /// Outlines the things in boxes of at least `config.open_score`.
    pub fn outline(config: &DynamicConfig, boxes: &[Detection], depth: &DepthImage, features: &FrameFeatures) -> Self {
        let mut certain: Vec<Detection> = boxes.iter().filter(|one| one.score >= config.open_score).copied().collect();
        // What stands on a table is in the table's box too, and comes before it.
        certain.sort_by(|a, b| a.bbox.area().total_cmp(&b.bbox.area()));
        let within = DynamicConfig { margin: 0.0, reach_m: 0.0, ..config.clone() };
        let (mut groups, mut bodies) = (DepthGroups::new(config.seed), BodyMask::default());
        bodies.begin(depth);
        let depths_m = groups.depths_of(config, &certain, depth, features);
        for (number, (one, depth_m)) in certain.iter().zip(depths_m).enumerate() {
            if let Some(center_m) = depth_m {
                bodies.grow(&within, number, &one.bbox, *center_m);
            }
        }
        Self { bodies, classes: certain.iter().map(|one| one.class).collect() }
    }

    /// The class, as [`Detection::class`], of the thing at a position of the raw image, px.
    pub fn class_at(&self, raw: [f32; 2]) -> Option<usize> {
        self.classes.get(self.bodies.body_at(raw)?).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::BoundingBox;
    use crate::image::Image;

    #[test]
    fn in_a_box_the_thing_has_its_class_and_the_wall_behind_has_none() {
        let mut raw = Image::new(320, 240);
        raw.data_mut().fill(15_000u16);
        // A chair 1.5 m away and a cup before it, in a world that ends 3 m away.
        (80..200).for_each(|y| raw.row_mut(y)[100..160].fill(7_500));
        (80..110).for_each(|y| raw.row_mut(y)[110..130].fill(7_000));
        let depth = DepthImage { raw, metres_per_unit: 1.0 / 5000.0 };
        let found = |class, score, [x_min, y_min, x_max, y_max]: [f32; 4]| Detection {
            class,
            score,
            bbox: BoundingBox { x_min, y_min, x_max, y_max },
        };
        let boxes = [
            found(56, 0.9, [90.0, 60.0, 180.0, 210.0]),
            found(41, 0.5, [108.0, 76.0, 132.0, 112.0]),
            found(7, 0.1, [200.0, 60.0, 300.0, 210.0]),
        ];
        let things = Things::outline(&DynamicConfig::default(), &boxes, &depth, &FrameFeatures::default());
        let at = |x: f32, y: f32| things.class_at([x, y]);
        assert_eq!((at(150.0, 150.0), at(120.0, 95.0)), (Some(56), Some(41)));
        assert_eq!((at(170.0, 70.0), at(20.0, 20.0), at(250.0, 100.0)), (None, None, None));
        assert_eq!((at(319.5, 10.0), at(5000.0, 10.0), at(10.0, 5000.0)), (None, None, None));
    }
}
