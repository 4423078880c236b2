//! Parts of a body that hang together with nothing else in the depth image.
//!
//! In: the segmenter of all bodies, the box and depth of one. Out: its limbs whose way to the trunk is hidden.

use crate::config::DynamicConfig;
use crate::detect::BoundingBox;
use crate::dynamic::segment::mask::{InstanceMask, NO_TRACK, Reached, owner};

/// Owner of cells that were visited and found to lead out of the box, or out of the body's reach.
const ATTACHED: u8 = NO_TRACK - 1;

impl InstanceMask {
    /// Marks what lies in the box of a track at depths that its body can reach and hangs together with nothing else: limbs whose way to the
    /// trunk is hidden, by the trunk itself or by somebody in front.
    pub(crate) fn add_islands(&mut self, config: &DynamicConfig, track: usize, bbox: &BoundingBox, center_m: f32) {
        let owner = owner(track);
        let (inner, outer) = (self.cells(bbox, 0.0), self.cells(bbox, config.box_margin_share));
        let reach_m = config.group_half_width_m + config.limb_reach_m;
        for row in inner[1]..inner[3] {
            for column in inner[0]..inner[2] {
                let seed = row * self.columns + column;
                if self.owner[seed] == 0 && (self.depth_m[seed] - center_m).abs() <= reach_m {
                    let is_island = self.collect_surface(config, seed, outer, [center_m - reach_m, center_m + reach_m]);
                    for reached in &self.body {
                        self.owner[reached.cell as usize] = if is_island { owner } else { ATTACHED };
                    }
                }
            }
        }
        for row in outer[1]..outer[3] {
            let line = &mut self.owner[row * self.columns..][outer[0]..outer[2].max(outer[0])];
            line.iter_mut().filter(|owner| **owner == ATTACHED).for_each(|owner| *owner = 0);
        }
    }

    /// Makes the surface that a free cell lies on the body, as far as it is free and within an outer box. Returns whether it ends there, and
    /// within `reach_m` of a depth.
    fn collect_surface(
        &mut self,
        config: &DynamicConfig,
        seed: usize,
        outer: [usize; 4],
        [near_m, far_m]: [f32; 2],
    ) -> bool {
        self.body.clear();
        self.body.push(Reached { cell: seed as u32, depth_m: self.depth_m[seed], gap: 0 });
        self.owner[seed] = ATTACHED;
        let (mut next, mut ends) = (0, true);
        while let Some(&Reached { cell, depth_m, .. }) = self.body.get(next) {
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
                    ends = false;
                } else if self.owner[cell] == 0 {
                    self.owner[cell] = ATTACHED;
                    self.body.push(Reached { cell: cell as u32, depth_m: z, gap: 0 });
                }
            }
        }
        ends
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamic::segment::mask::tests::depth;

    #[test]
    fn a_limb_whose_way_to_the_trunk_is_hidden_is_the_bodys_and_a_table_that_leads_out_of_the_box_is_not() {
        let hidden = |x: usize, y: usize| match (x, y) {
            (100..150, 40..) => 2000,
            (160..180, 100..120) => 1600,
            (160.., 180..200) => 1500,
            _ => 4000,
        };
        let (config, mut bodies) = (DynamicConfig::default(), InstanceMask::default());
        bodies.begin(&depth(hidden));
        let bbox = BoundingBox { x_min: 92.0, y_min: 40.0, x_max: 195.0, y_max: 240.0 };
        bodies.grow(&config, 0, &bbox, 2.0);
        let (limb, table) = ([170.0, 110.0], [170.0, 190.0]);
        assert!(bodies.covers([120.0, 100.0], 0.0) && !bodies.covers(limb, 0.0));
        bodies.add_islands(&config, 0, &bbox, 2.0);
        assert_eq!([limb, table, [170.0, 60.0]].map(|at| bodies.covers(at, 0.0)), [true, false, false]);
    }
}
