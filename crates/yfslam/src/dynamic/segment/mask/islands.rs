//! Parts of an instance that are connected with nothing else in the depth image.
//!
//! In: the mask with all instances, the box and the depth of one. Out: its parts that are separated from its main part by an
//! occlusion, such as an arm.

use crate::config::DynamicConfig;
use crate::detect::BoundingBox;
use crate::dynamic::segment::mask::{InstanceMask, Reached, UNTRACKED, label_of};

/// Label of visited cells whose surface leads out of the box or out of the depth range of the instance.
const ATTACHED: u8 = UNTRACKED - 1;

impl InstanceMask {
    /// Adds to the instance of a track the connected components in its box that are within its depth range and end there: parts
    /// that are separated from the main part by the instance itself or by another one in front of it.
    pub(crate) fn add_isolated_parts(
        &mut self,
        config: &DynamicConfig,
        track: usize,
        bbox: &BoundingBox,
        center_m: f32,
    ) {
        let label = label_of(track);
        let (inner, outer) = (self.cell_range(bbox, 0.0), self.cell_range(bbox, config.box_margin_share));
        let reach_m = config.group_half_width_m + config.limb_reach_m;
        for row in inner[1]..inner[3] {
            for column in inner[0]..inner[2] {
                let seed = row * self.columns + column;
                if self.labels[seed] == 0 && (self.depth_m[seed] - center_m).abs() <= reach_m {
                    let is_isolated =
                        self.collect_surface(config, seed, outer, [center_m - reach_m, center_m + reach_m]);
                    for reached in &self.segment {
                        self.labels[reached.cell as usize] = if is_isolated { label } else { ATTACHED };
                    }
                }
            }
        }
        for row in outer[1]..outer[3] {
            let line = &mut self.labels[row * self.columns..][outer[0]..outer[2].max(outer[0])];
            line.iter_mut().filter(|label| **label == ATTACHED).for_each(|label| *label = 0);
        }
    }

    /// Collects in `segment` the connected surface of an unlabelled cell, within an outer box. Returns whether the whole surface
    /// lies within that box and the depth range.
    fn collect_surface(
        &mut self,
        config: &DynamicConfig,
        seed: usize,
        outer: [usize; 4],
        [near_m, far_m]: [f32; 2],
    ) -> bool {
        self.segment.clear();
        self.segment.push(Reached { cell: seed as u32, depth_m: self.depth_m[seed], gap: 0 });
        self.labels[seed] = ATTACHED;
        let (mut next, mut is_enclosed) = (0, true);
        while let Some(&Reached { cell, depth_m, .. }) = self.segment.get(next) {
            next += 1;
            let cell = cell as usize;
            let (row, column) = (cell / self.columns, cell % self.columns);
            let step = config.full.surface_step_m + config.full.surface_step_share * depth_m;
            for (r, c) in
                [(row.wrapping_sub(1), column), (row + 1, column), (row, column.wrapping_sub(1)), (row, column + 1)]
            {
                if r >= self.rows || c >= self.columns {
                    continue;
                }
                let cell = r * self.columns + c;
                let z = self.depth_m[cell];
                if z <= 0.0 || (z - depth_m).abs() > step {
                    continue;
                }
                if r < outer[1] || r >= outer[3] || c < outer[0] || c >= outer[2] || z < near_m || z > far_m {
                    is_enclosed = false;
                } else if self.labels[cell] == 0 {
                    self.labels[cell] = ATTACHED;
                    self.segment.push(Reached { cell: cell as u32, depth_m: z, gap: 0 });
                }
            }
        }
        is_enclosed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamic::segment::mask::tests::depth;

    #[test]
    fn an_occluded_arm_is_added_and_a_table_that_leads_out_of_the_box_is_not() {
        let occluded = |x: usize, y: usize| match (x, y) {
            (100..150, 40..) => 2000,
            (160..180, 100..120) => 1600,
            (160.., 180..200) => 1500,
            _ => 4000,
        };
        let (config, mut instances) = (DynamicConfig::default(), InstanceMask::default());
        instances.begin_frame(&depth(occluded));
        let bbox = BoundingBox { x_min: 92.0, y_min: 40.0, x_max: 195.0, y_max: 240.0 };
        instances.segment(&config, 0, &bbox, 2.0);
        let (arm, table) = ([170.0, 110.0], [170.0, 190.0]);
        assert!(instances.covers([120.0, 100.0], 0.0) && !instances.covers(arm, 0.0));
        instances.add_isolated_parts(&config, 0, &bbox, 2.0);
        assert_eq!([arm, table, [170.0, 60.0]].map(|position| instances.covers(position, 0.0)), [true, false, false]);
    }
}
