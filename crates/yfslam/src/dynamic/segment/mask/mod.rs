//! The instance mask: which cells of the image belong to a movable instance.
//!
//! In: the depth image, bounding boxes with the depth of the object in each, masks of a segmentation network. Out: a mask on a grid
//! of cells, with the instance of each cell.

mod coarse;
mod grow;
mod islands;
mod network;

use crate::detect::BoundingBox;
use crate::image::DepthImage;

/// Side of a cell, px.
pub(crate) const CELL_PX: usize = 4;

/// Label of cells that move without belonging to a track: the network's mask covers them, or they have changed with respect to the
/// depth history.
const UNTRACKED: u8 = u8::MAX;

/// Returns the label of a track, below [`UNTRACKED`] and the label that `islands` uses; tracks past the last number share it.
fn label_of(track: usize) -> u8 {
    track.min(usize::from(UNTRACKED) - 3) as u8 + 1
}

/// A mask of the cells that show movable instances. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct InstanceMask {
    columns: usize,
    rows: usize,
    /// Depth at the centre of each cell, m; 0 where it is unknown.
    depth_m: Vec<f32>,
    /// Label of each cell: 0 for none, [`UNTRACKED`], or that of a track.
    labels: Vec<u8>,
    /// Cells of the segment that is being made.
    segment: Vec<Reached>,
}

/// Centre and size of an instance in the image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Extent {
    /// Centre of its cells, px.
    pub middle: [f32; 2],
    /// Number of its cells.
    pub cells: usize,
}

/// A cell of a segment, or of a gap without depth in it.
#[derive(Clone, Copy, Debug)]
struct Reached {
    cell: u32,
    /// Depth of the cell, or of the last cell before the gap, m.
    depth_m: f32,
    /// Number of cells without depth since then.
    gap: u8,
}

impl InstanceMask {
    /// Begins a frame: samples its depth and clears all labels.
    pub(crate) fn begin_frame(&mut self, depth: &DepthImage) {
        self.columns = depth.raw.width() / CELL_PX;
        self.rows = depth.raw.height() / CELL_PX;
        self.depth_m.clear();
        for row in 0..self.rows {
            let y = row * CELL_PX + CELL_PX / 2;
            let cell = |column: usize| depth.metres(column * CELL_PX + CELL_PX / 2, y).unwrap_or(0.0);
            self.depth_m.extend((0..self.columns).map(cell));
        }
        self.labels.clear();
        self.labels.resize(self.depth_m.len(), 0);
    }

    /// Copies another mask into the memory of this one.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        (self.columns, self.rows) = (other.columns, other.rows);
        self.depth_m.clone_from(&other.depth_m);
        self.labels.clone_from(&other.labels);
    }

    /// Appends the depths, m, of the cells in a box that have no label.
    pub(crate) fn unlabelled_depths(&self, bbox: &BoundingBox, out: &mut Vec<f32>) {
        let [left, top, right, bottom] = self.cell_range(bbox, 0.0);
        for row in top..bottom {
            let row_range = row * self.columns..(row + 1) * self.columns;
            let cells = self.depth_m[row_range.clone()].iter().zip(&self.labels[row_range]).take(right).skip(left);
            out.extend(cells.filter(|(z, label)| **z > 0.0 && **label == 0).map(|(z, _)| *z));
        }
    }

    /// Returns centre and size of the segment made last.
    fn extent(&self) -> Extent {
        let (mut column, mut row) = (0, 0);
        for reached in &self.segment {
            column += reached.cell as usize % self.columns;
            row += reached.cell as usize / self.columns;
        }
        let cells = self.segment.len();
        let middle = |sum: usize| (sum * CELL_PX) as f32 / cells.max(1) as f32;
        Extent { middle: [middle(column), middle(row)], cells }
    }

    /// Returns the share of a box's cells that are nearer than `depth_m`.
    pub(crate) fn share_nearer(&self, bbox: &BoundingBox, depth_m: f32) -> f32 {
        let [left, top, right, bottom] = self.cell_range(bbox, 0.0);
        let row = |row: usize| self.depth_m[row * self.columns..].iter().take(right).skip(left);
        let nearer = (top..bottom).flat_map(row).filter(|z| **z > 0.0 && **z < depth_m).count();
        nearer as f32 / (bottom.saturating_sub(top) * right.saturating_sub(left)).max(1) as f32
    }

    /// Returns whether a box contains a labelled cell.
    pub(crate) fn contains_instance(&self, bbox: &BoundingBox) -> bool {
        let [left, top, right, bottom] = self.cell_range(bbox, 0.0);
        (top..bottom)
            .any(|row| self.labels[row * self.columns..].iter().take(right).skip(left).any(|label| *label != 0))
    }

    /// Labels the whole box of a track.
    pub(crate) fn mark_box(&mut self, track: usize, bbox: &BoundingBox) {
        let [left, top, right, bottom] = self.cell_range(bbox, 0.0);
        for row in top..bottom {
            self.labels[row * self.columns + left..row * self.columns + right.max(left)].fill(label_of(track));
        }
    }

    /// Returns the least difference, m, by which a cell within `radius_px` of a position is nearer than `expected_m`, and the
    /// variance of all depths there, m²; `None` if none is nearer.
    pub(crate) fn depth_step(&self, [x, y]: [f32; 2], radius_px: f32, expected_m: f32) -> Option<(f32, f32)> {
        let near = |v: f32, limit: usize| {
            let cell = |v: f32| (v.max(0.0) as usize / CELL_PX).min(limit.saturating_sub(1));
            cell(v - radius_px)..=cell(v + radius_px)
        };
        let (mut least, mut count, mut sum, mut squares) = (f32::INFINITY, 0.0f32, 0.0, 0.0);
        for row in near(y, self.rows) {
            for column in near(x, self.columns) {
                let z = *self.depth_m.get(row * self.columns + column)?;
                if z > 0.0 {
                    (count, sum, squares) = (count + 1.0, sum + z, squares + z * z);
                    if z < expected_m {
                        least = least.min(expected_m - z);
                    }
                }
            }
        }
        least.is_finite().then(|| (least, (squares / count - (sum / count).powi(2)).max(0.0)))
    }

    /// Returns the share of the image that the instance of a track covers.
    pub(crate) fn share_of_track(&self, track: usize) -> f32 {
        let label = label_of(track);
        self.labels.iter().filter(|other| **other == label).count() as f32 / self.labels.len().max(1) as f32
    }

    /// Clears the labels of a track.
    pub(crate) fn clear_track(&mut self, track: usize) {
        let label = label_of(track);
        self.labels.iter_mut().filter(|other| **other == label).for_each(|other| *other = 0);
    }

    /// Returns whether a position, px of the raw image, lies on an instance or within `edge_px` of one.
    pub(crate) fn covers(&self, [x, y]: [f32; 2], edge_px: f32) -> bool {
        let near = |d: f32, r: f32| (((d - r).max(0.0) as usize) / CELL_PX, ((d + r).max(0.0) as usize) / CELL_PX);
        let ((left, right), (top, bottom)) = (near(x, edge_px), near(y, edge_px));
        (top..=bottom.min(self.rows.saturating_sub(1))).any(|row| {
            let (from, to) =
                (row * self.columns + left, row * self.columns + right.min(self.columns.saturating_sub(1)));
            self.labels.get(from..=to).is_some_and(|cells| cells.iter().any(|label| *label != 0))
        })
    }

    /// Returns the track on whose instance a position, px of the raw image, lies.
    pub(crate) fn instance_at(&self, [x, y]: [f32; 2]) -> Option<usize> {
        let [column, row] = [x, y].map(|v| (v.max(0.0) as usize) / CELL_PX);
        let label = *self.labels.get(row * self.columns + column).filter(|_| column < self.columns)?;
        (label != 0 && label != UNTRACKED).then(|| usize::from(label) - 1)
    }

    /// Returns the range of cells of a box grown by a share of its size: left, top, right, bottom.
    fn cell_range(&self, b: &BoundingBox, margin: f32) -> [usize; 4] {
        let (dx, dy) = (margin * (b.x_max - b.x_min), margin * (b.y_max - b.y_min));
        let cell = |v: f32, limit: usize| ((v.max(0.0) as usize) / CELL_PX).min(limit);
        [
            cell(b.x_min - dx, self.columns),
            cell(b.y_min - dy, self.rows),
            cell(b.x_max + dx + CELL_PX as f32, self.columns),
            cell(b.y_max + dy + CELL_PX as f32, self.rows),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::DynamicConfig;
    use crate::image::Image;

    /// Returns a depth image in millimetres, made by a function of the pixel position.
    pub(super) fn depth(rule: impl Fn(usize, usize) -> u16) -> DepthImage {
        let mut raw = Image::new(320, 240);
        for y in 0..240 {
            raw.row_mut(y).iter_mut().enumerate().for_each(|(x, d)| *d = rule(x, y));
        }
        DepthImage { raw, metres_per_unit: 0.001 }
    }

    /// Returns the depth, mm, of a person at a pixel: a trunk at 2 m, an arm that reaches to 1.5 m, a gap without depth beside it,
    /// a wall at 4 m.
    fn person(x: usize, y: usize) -> u16 {
        match (x, y) {
            (100..150, 40..) => 2000,
            (150..200, 100..120) => 2000 - 10 * (x as u16 - 150),
            (90..100, 40..) => 0,
            _ => 4000,
        }
    }

    fn segmented(near_m: f32) -> InstanceMask {
        let (config, mut instances) = (DynamicConfig::default(), InstanceMask::default());
        instances.begin_frame(&depth(person));
        let bbox = BoundingBox { x_min: 92.0, y_min: 40.0, x_max: 195.0, y_max: 240.0 };
        instances.segment(&config, 0, &bbox, near_m);
        instances
    }

    #[test]
    fn a_person_is_segmented_along_the_surface_and_over_gaps_but_not_onto_the_wall() {
        let instances = segmented(2.0);
        for on_person in [[120.0, 100.0], [190.0, 110.0], [98.0, 150.0]] {
            assert!(instances.covers(on_person, 0.0), "{on_person:?}");
        }
        for background in [[170.0, 60.0], [170.0, 200.0], [60.0, 150.0]] {
            assert!(!instances.covers(background, 2.0), "{background:?}");
        }
        assert!(instances.covers([153.0, 60.0], 6.0), "the edge");
    }

    #[test]
    fn the_cells_that_one_instance_leaves_are_searched_for_the_next() {
        let (instances, mut free) = (segmented(2.0), Vec::new());
        instances.unlabelled_depths(&BoundingBox { x_min: 100.0, y_min: 40.0, x_max: 200.0, y_max: 240.0 }, &mut free);
        assert!(!free.is_empty() && free.iter().all(|z| *z == 4.0), "{free:?}");
    }

    #[test]
    fn the_cells_of_a_mask_in_a_box_are_assigned_to_its_track() {
        let config = DynamicConfig::default();
        let (mut instances, mut mask) = (InstanceMask::default(), Image::new(320, 240));
        instances.begin_frame(&depth(|x, _| if x < 160 { 2000 } else { 3000 }));
        let bbox = BoundingBox { x_min: 80.0, y_min: 40.0, x_max: 240.0, y_max: 200.0 };
        assert_eq!(instances.masked_depth(&config, &bbox), None);
        (80..160).for_each(|y| mask.row_mut(y)[100..180].fill(1u8));
        instances.mark_mask(&mask);
        assert_eq!(instances.masked_depth(&config, &bbox), Some(2.0));
        let extent = instances.assign_masked(4, &bbox);
        assert_eq!((extent.cells, extent.middle), (400, [138.0, 118.0]));
        assert_eq!(instances.masked_depth(&config, &bbox), None, "a cell is assigned once");
        let far = BoundingBox { x_min: 0.0, x_max: 320.0, y_min: 0.0, y_max: 240.0 };
        assert_eq!(instances.masked_depth(&config, &far), None);
    }

    #[test]
    fn a_mask_labels_the_cells_that_it_covers() {
        let (mut instances, mut mask) = (InstanceMask::default(), Image::new(320, 240));
        instances.begin_frame(&depth(|_, _| 4000));
        mask.row_mut(50)[98] = 3u8;
        instances.mark_mask(&mask);
        assert!(instances.covers([98.0, 50.0], 0.0) && !instances.covers([110.0, 50.0], 2.0));
    }
}
