//! The mask of a segmentation network, on the cells of the instance mask.
//!
//! In: a mask of movable objects, bounding boxes. Out: marked cells, and their assignment to the tracks of the boxes.

use crate::config::DynamicConfig;
use crate::detect::BoundingBox;
use crate::dynamic::segment::mask::{CELL_PX, Extent, InstanceMask, Reached, UNTRACKED, label_of};
use crate::image::Image;

impl InstanceMask {
    /// Returns the median depth of the cells in a box that the network's mask covers, m, infinite where it was not measured; `None`
    /// if they fill less than `config.group_min_share` of the box.
    pub(crate) fn masked_depth(&mut self, config: &DynamicConfig, bbox: &BoundingBox) -> Option<f32> {
        let cells = self.collect_masked(bbox);
        if self.segment.is_empty() || (self.segment.len() as f32) < config.group_min_share * cells as f32 {
            return None;
        }
        self.segment.retain(|reached| reached.depth_m > 0.0);
        let middle = self.segment.len() / 2;
        if self.segment.is_empty() {
            return Some(f32::INFINITY);
        }
        let (_, median, _) = self.segment.select_nth_unstable_by(middle, |a, b| a.depth_m.total_cmp(&b.depth_m));
        Some(median.depth_m)
    }

    /// Assigns the cells in a box that the network's mask covers to a track. Returns their centre and number.
    pub(crate) fn assign_masked(&mut self, track: usize, bbox: &BoundingBox) -> Extent {
        self.collect_masked(bbox);
        for reached in &self.segment {
            self.labels[reached.cell as usize] = label_of(track);
        }
        self.extent()
    }

    /// Collects in `segment` the cells in a box that the network's mask covers. Returns the number of cells of the box.
    fn collect_masked(&mut self, bbox: &BoundingBox) -> usize {
        let [left, top, right, bottom] = self.cell_range(bbox, 0.0);
        self.segment.clear();
        for row in top..bottom {
            for cell in row * self.columns + left..row * self.columns + right.max(left) {
                if self.labels[cell] == UNTRACKED {
                    self.segment.push(Reached { cell: cell as u32, depth_m: self.depth_m[cell], gap: 0 });
                }
            }
        }
        bottom.saturating_sub(top) * right.saturating_sub(left)
    }

    /// Marks the cells whose centre a mask of movable objects covers.
    pub(crate) fn mark_mask(&mut self, mask: &Image<u8>) {
        self.mark_where(|x, y| mask.get(x, y).is_some_and(|number| *number > 0));
    }

    /// Marks the cells for whose centre, px, `moves` returns true.
    pub(crate) fn mark_where(&mut self, moves: impl Fn(usize, usize) -> bool) {
        for (row, labels) in self.labels.chunks_mut(self.columns.max(1)).enumerate() {
            for (column, label) in labels.iter_mut().enumerate() {
                if moves(column * CELL_PX + CELL_PX / 2, row * CELL_PX + CELL_PX / 2) {
                    *label = UNTRACKED;
                }
            }
        }
    }
}
