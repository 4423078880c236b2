//! Segmentation of one instance by region growing in the depth image.
//!
//! In: the mask so far, a bounding box with the depth of the object in it, or a position. Out: the mask with the cells of the instance.

use crate::config::DynamicConfig;
use crate::detect::BoundingBox;
use crate::dynamic::segment::mask::{CELL_PX, Extent, InstanceMask, Reached, UNTRACKED, label_of};

impl InstanceMask {
    /// Segments the instance of a track at depth `center_m` by region growing: from the unlabelled cells of the box near that
    /// depth, along the surface as long as depth changes without a step, also over gaps without depth, within the box grown by
    /// `config.box_margin_share`. Cells of gaps are labelled inside the box only. Returns centre and size of the instance.
    ///
    /// DynaSLAM (IEEE RA-L 2018, section III-C) grows regions in depth likewise, from key points.
    pub(crate) fn segment(
        &mut self,
        config: &DynamicConfig,
        track: usize,
        bbox: &BoundingBox,
        center_m: f32,
    ) -> Extent {
        let label = label_of(track);
        let (inner, outer) = (self.cell_range(bbox, 0.0), self.cell_range(bbox, config.box_margin_share));
        let [near, far] = [center_m - config.group_half_width_m, center_m + config.group_half_width_m];
        let [nearest, farthest] = [near - config.limb_reach_m, far + config.limb_reach_m];
        self.segment.clear();
        for row in inner[1]..inner[3] {
            for column in inner[0]..inner[2] {
                let cell = row * self.columns + column;
                let z = self.depth_m[cell];
                if z >= near && z <= far && self.labels[cell] == 0 {
                    self.labels[cell] = label;
                    self.segment.push(Reached { cell: cell as u32, depth_m: z, gap: 0 });
                }
            }
        }
        let mut next = 0;
        while let Some(&Reached { cell, depth_m, gap }) = self.segment.get(next) {
            next += 1;
            let cell = cell as usize;
            let (row, column) = (cell / self.columns, cell % self.columns);
            let step = (config.full.surface_step_m + config.full.surface_step_share * depth_m) * (1.0 + f32::from(gap));
            for (r, c) in
                [(row.wrapping_sub(1), column), (row + 1, column), (row, column.wrapping_sub(1)), (row, column + 1)]
            {
                if r < outer[1] || r >= outer[3] || c < outer[0] || c >= outer[2] {
                    continue;
                }
                let cell = r * self.columns + c;
                if self.labels[cell] != 0 {
                    continue;
                }
                let z = self.depth_m[cell];
                if z > 0.0 {
                    if (z - depth_m).abs() <= step && z >= nearest && z <= farthest {
                        self.labels[cell] = label;
                        self.segment.push(Reached { cell: cell as u32, depth_m: z, gap: 0 });
                    }
                } else if gap < config.full.max_gap_cells
                    && r >= inner[1]
                    && r < inner[3]
                    && c >= inner[0]
                    && c < inner[2]
                {
                    self.labels[cell] = label;
                    self.segment.push(Reached { cell: cell as u32, depth_m, gap: gap + 1 });
                }
            }
        }
        self.extent()
    }

    /// Marks the connected region around a position whose depths differ from its mean by less than `step_m`. Returns whether any
    /// cell was marked.
    pub(crate) fn grow_region(&mut self, [x, y]: [f32; 2], step_m: f32) -> bool {
        let (column, row) = (x.max(0.0) as usize / CELL_PX, y.max(0.0) as usize / CELL_PX);
        if column >= self.columns || row >= self.rows {
            return false;
        }
        let seed = row * self.columns + column;
        let depth_m = self.depth_m[seed];
        if depth_m <= 0.0 || self.labels[seed] != 0 {
            return false;
        }
        self.segment.clear();
        self.segment.push(Reached { cell: seed as u32, depth_m, gap: 0 });
        self.labels[seed] = UNTRACKED;
        let (mut sum, mut next) = (depth_m, 0);
        while let Some(&Reached { cell, .. }) = self.segment.get(next) {
            next += 1;
            let cell = cell as usize;
            let column = cell % self.columns;
            let left = (column > 0).then(|| cell - 1);
            let right = (column + 1 < self.columns).then_some(cell + 1);
            let up = cell.checked_sub(self.columns);
            let down = Some(cell + self.columns).filter(|c| *c < self.depth_m.len());
            for cell in [left, right, up, down].into_iter().flatten() {
                let z = self.depth_m[cell];
                if self.labels[cell] == 0 && z > 0.0 && (z - sum / self.segment.len() as f32).abs() < step_m {
                    self.labels[cell] = UNTRACKED;
                    self.segment.push(Reached { cell: cell as u32, depth_m: z, gap: 0 });
                    sum += z;
                }
            }
        }
        true
    }
}
