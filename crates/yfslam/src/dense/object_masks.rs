//! Segmentation of static objects, for dense maps with classes.
//!
//! In: detections of objects that cannot move, the depth image, and what moves in it. Out: the class of the object at each
//! position. Objects are segmented like people, by the depth group in the box (YF-SLAM, section 3.3), among the cells that people
//! in front of them leave; but no surface is followed out of the box, because chairs stand on floors and screens in front of walls.

use crate::config::DynamicConfig;
use crate::detect::Detection;
use crate::dynamic::MovingMask;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::mask::InstanceMask;
use crate::image::DepthImage;

/// The mask of the static objects of a frame, and the class of each.
#[derive(Clone, Debug, Default)]
pub(super) struct ObjectMasks {
    instances: InstanceMask,
    classes: Vec<usize>,
}

impl ObjectMasks {
    /// Segments the objects of detections with a score of at least `config.open_score`.
    pub(super) fn segment(
        config: &DynamicConfig,
        boxes: &[Detection],
        depth: &DepthImage,
        moving: &MovingMask,
    ) -> Self {
        let mut certain: Vec<Detection> = boxes.iter().filter(|one| one.score >= config.open_score).copied().collect();
        // An object on a table is in the table's box too: the smaller box comes first.
        certain.sort_by(|a, b| a.bbox.area().total_cmp(&b.bbox.area()));
        let without_margin = DynamicConfig { box_margin_share: 0.0, limb_reach_m: 0.0, ..config.clone() };
        let (mut clusters, mut instances) = (DepthClusters::new(config.seed), InstanceMask::default());
        instances.begin_frame(depth);
        instances.mark_where(|x, y| moving.covers(depth, [x as f32, y as f32], 0.0));
        for (number, one) in certain.iter().enumerate() {
            if let Some(center_m) = clusters.unlabelled_object_depth(config, &one.bbox, &instances) {
                instances.segment(&without_margin, number, &one.bbox, center_m);
            }
        }
        Self { instances, classes: certain.iter().map(|one| one.class).collect() }
    }

    /// Returns the class, as [`Detection::class`], of the object at a position, px of the raw image.
    pub(super) fn class_at(&self, raw: [f32; 2]) -> Option<usize> {
        self.classes.get(self.instances.instance_at(raw)?).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::BoundingBox;
    use crate::dynamic::Region;
    use crate::image::Image;

    fn detection(class: usize, score: f32, [x_min, y_min, x_max, y_max]: [f32; 4]) -> Detection {
        Detection { class, score, bbox: BoundingBox { x_min, y_min, x_max, y_max } }
    }

    #[test]
    fn an_object_has_its_class_and_the_background_and_a_person_in_front_have_none() {
        let mut raw = Image::new(320, 240);
        raw.data_mut().fill(15_000u16);
        // A chair 1.5 m away with a cup on it, a person at 1 m in front of both, a wall at 3 m.
        (80..200).for_each(|y| raw.row_mut(y)[100..160].fill(7_500));
        (80..110).for_each(|y| raw.row_mut(y)[110..130].fill(7_000));
        (60..210).for_each(|y| raw.row_mut(y)[140..170].fill(5_000));
        let depth = DepthImage { raw, metres_per_unit: 1.0 / 5000.0 };
        let boxes = [
            detection(56, 0.9, [90.0, 60.0, 180.0, 210.0]),
            detection(41, 0.5, [108.0, 76.0, 132.0, 112.0]),
            detection(7, 0.1, [200.0, 60.0, 300.0, 210.0]),
        ];
        let bbox = detection(0, 0.9, [140.0, 60.0, 170.0, 210.0]).bbox;
        let walker = Region { bbox, score: 0.9, misses: 0, depth_m: Some([0.8, 1.2]) };
        let moving = MovingMask::from_regions(vec![walker]);
        let masks = ObjectMasks::segment(&DynamicConfig::default(), &boxes, &depth, &moving);
        let class_at = |x: f32, y: f32| masks.class_at([x, y]);
        assert_eq!((class_at(120.0, 150.0), class_at(120.0, 95.0)), (Some(56), Some(41)));
        assert_eq!(
            (class_at(150.0, 150.0), class_at(175.0, 70.0), class_at(20.0, 20.0), class_at(250.0, 100.0)),
            (None, None, None, None)
        );
        assert_eq!((class_at(319.5, 10.0), class_at(5000.0, 10.0), class_at(10.0, 5000.0)), (None, None, None));
    }
}
