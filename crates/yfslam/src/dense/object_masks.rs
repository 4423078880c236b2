//! What stands in a frame: the body in each box, for maps that know classes.
//!
//! In: boxes of static_objects that cannot move, the depth image, and what moves in it. Out: the class at each position. Bodies are found as those
//! of people are, by the depth group in the box (YF-SLAM, section 3.3), in what whoever walks before them leaves of it; but no surface is
//! followed out of the box: chairs stand on floors, and screens before walls.

use crate::config::DynamicConfig;
use crate::detect::Detection;
use crate::dynamic::MovingMask;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::mask::InstanceMask;
use crate::image::DepthImage;

/// Segmenter of static_objects, and the class of each.
#[derive(Clone, Debug, Default)]
pub(super) struct ObjectMasks {
    bodies: InstanceMask,
    classes: Vec<usize>,
}

impl ObjectMasks {
    /// Segmenter the static_objects in boxes of at least `config.open_score`.
    pub(super) fn segment(
        config: &DynamicConfig,
        boxes: &[Detection],
        depth: &DepthImage,
        moving: &MovingMask,
    ) -> Self {
        let mut certain: Vec<Detection> = boxes.iter().filter(|one| one.score >= config.open_score).copied().collect();
        // What stands on a table is in the table's box too, and comes before it.
        certain.sort_by(|a, b| a.bbox.area().total_cmp(&b.bbox.area()));
        let within = DynamicConfig { box_margin_share: 0.0, limb_reach_m: 0.0, ..config.clone() };
        let (mut groups, mut bodies) = (DepthClusters::new(config.seed), InstanceMask::default());
        bodies.begin(depth);
        bodies.mark_where(|x, y| moving.covers(depth, [x as f32, y as f32], 0.0));
        for (number, one) in certain.iter().enumerate() {
            if let Some(center_m) = groups.thing_in(config, &one.bbox, &bodies) {
                bodies.grow(&within, number, &one.bbox, center_m);
            }
        }
        Self { bodies, classes: certain.iter().map(|one| one.class).collect() }
    }

    /// The class, as [`Detection::class`], of the thing at a position of the raw image, px.
    pub(super) fn class_at(&self, raw: [f32; 2]) -> Option<usize> {
        self.classes.get(self.bodies.body_at(raw)?).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::BoundingBox;
    use crate::dynamic::Region;
    use crate::image::Image;

    fn found(class: usize, score: f32, [x_min, y_min, x_max, y_max]: [f32; 4]) -> Detection {
        Detection { class, score, bbox: BoundingBox { x_min, y_min, x_max, y_max } }
    }

    #[test]
    fn in_a_box_the_thing_has_its_class_and_what_is_behind_or_walks_before_it_has_none() {
        let mut raw = Image::new(320, 240);
        raw.data_mut().fill(15_000u16);
        // A chair 1.5 m away with a cup on it, somebody at 1 m before both, in a world that ends 3 m away.
        (80..200).for_each(|y| raw.row_mut(y)[100..160].fill(7_500));
        (80..110).for_each(|y| raw.row_mut(y)[110..130].fill(7_000));
        (60..210).for_each(|y| raw.row_mut(y)[140..170].fill(5_000));
        let depth = DepthImage { raw, metres_per_unit: 1.0 / 5000.0 };
        let boxes = [
            found(56, 0.9, [90.0, 60.0, 180.0, 210.0]),
            found(41, 0.5, [108.0, 76.0, 132.0, 112.0]),
            found(7, 0.1, [200.0, 60.0, 300.0, 210.0]),
        ];
        let bbox = found(0, 0.9, [140.0, 60.0, 170.0, 210.0]).bbox;
        let walker = Region { bbox, score: 0.9, misses: 0, depth_m: Some([0.8, 1.2]) };
        let moving = MovingMask::from_regions(vec![walker]);
        let static_objects = ObjectMasks::segment(&DynamicConfig::default(), &boxes, &depth, &moving);
        let at = |x: f32, y: f32| static_objects.class_at([x, y]);
        assert_eq!((at(120.0, 150.0), at(120.0, 95.0)), (Some(56), Some(41)));
        assert_eq!((at(150.0, 150.0), at(175.0, 70.0), at(20.0, 20.0), at(250.0, 100.0)), (None, None, None, None));
        assert_eq!((at(319.5, 10.0), at(5000.0, 10.0), at(10.0, 5000.0)), (None, None, None));
    }
}
