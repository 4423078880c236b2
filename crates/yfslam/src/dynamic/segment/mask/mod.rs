//! The outline of bodies in the depth image: from a depth inside a box to all that hangs together with it.
//!
//! In: the depth image, boxes with the depth of the body in each. Out: a mask on a grid of cells. DynaSLAM (IEEE RA-L 2018, section
//! III-C) grows regions in depth likewise, from key points.

mod islands;

use crate::config::DynamicConfig;
use crate::detect::BoundingBox;
use crate::image::{DepthImage, Image};

/// Side of a cell, px.
pub(crate) const CELL_PX: usize = 4;

/// Owner of cells that move without being a track's body: they were in a mask, or have moved since earlier views.
const NO_TRACK: u8 = u8::MAX;

/// The owner that stands for a track, below [`NO_TRACK`] and the mark of islands; those past the last number share it.
fn owner(track: usize) -> u8 {
    track.min(usize::from(NO_TRACK) - 3) as u8 + 1
}

/// Which cells of the image show something that moves. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct InstanceMask {
    columns: usize,
    rows: usize,
    /// Depth in the middle of each cell, m; 0 where it is unknown.
    depth_m: Vec<f32>,
    /// Whose body each cell belongs to: 0 nobody's.
    owner: Vec<u8>,
    /// Cells of the body that is being outlined.
    body: Vec<Reached>,
}

/// Place and size of a body in the image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Extent {
    /// Its middle, px.
    pub middle: [f32; 2],
    /// Cells that it fills.
    pub cells: usize,
}

/// A cell of a body, or of a gap in it.
#[derive(Clone, Copy, Debug)]
struct Reached {
    cell: u32,
    /// Its depth, or that of the last cell before the gap, m.
    depth_m: f32,
    /// Cells without depth since.
    gap: u8,
}

impl InstanceMask {
    /// Begins a frame: samples depth, and nothing moves.
    pub(crate) fn begin(&mut self, depth: &DepthImage) {
        self.columns = depth.raw.width() / CELL_PX;
        self.rows = depth.raw.height() / CELL_PX;
        self.depth_m.clear();
        for row in 0..self.rows {
            let y = row * CELL_PX + CELL_PX / 2;
            let cell = |column: usize| depth.metres(column * CELL_PX + CELL_PX / 2, y).unwrap_or(0.0);
            self.depth_m.extend((0..self.columns).map(cell));
        }
        self.owner.clear();
        self.owner.resize(self.depth_m.len(), 0);
    }

    /// Becomes a copy of another, in the memory it has.
    pub(crate) fn copy(&mut self, other: &Self) {
        (self.columns, self.rows) = (other.columns, other.rows);
        self.depth_m.clone_from(&other.depth_m);
        self.owner.clone_from(&other.owner);
    }

    /// Appends the depths in a box that belong to no body yet, m.
    pub(crate) fn free_depths(&self, bbox: &BoundingBox, out: &mut Vec<f32>) {
        let [left, top, right, bottom] = self.cells(bbox, 0.0);
        for row in top..bottom {
            let line = row * self.columns..(row + 1) * self.columns;
            let cells = self.depth_m[line.clone()].iter().zip(&self.owner[line]).take(right).skip(left);
            out.extend(cells.filter(|(z, owner)| **z > 0.0 && **owner == 0).map(|(z, _)| *z));
        }
    }

    /// Marks the body of a track, whose middle is `center_m` away: the cells of the box at that depth, and those in the box grown by `config.box_margin_share`
    /// to which the surface leads on without a step, over gaps without depth too. Of the gaps, those in the box are marked.
    /// Returns what was marked.
    pub(crate) fn grow(&mut self, config: &DynamicConfig, track: usize, bbox: &BoundingBox, center_m: f32) -> Extent {
        let owner = owner(track);
        let (inner, outer) = (self.cells(bbox, 0.0), self.cells(bbox, config.box_margin_share));
        let [near, far] = [center_m - config.group_half_width_m, center_m + config.group_half_width_m];
        let [nearest, farthest] = [near - config.limb_reach_m, far + config.limb_reach_m];
        self.body.clear();
        for row in inner[1]..inner[3] {
            for column in inner[0]..inner[2] {
                let cell = row * self.columns + column;
                let z = self.depth_m[cell];
                if z >= near && z <= far && self.owner[cell] == 0 {
                    self.owner[cell] = owner;
                    self.body.push(Reached { cell: cell as u32, depth_m: z, gap: 0 });
                }
            }
        }
        let mut next = 0;
        while let Some(&Reached { cell, depth_m, gap }) = self.body.get(next) {
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
                if self.owner[cell] != 0 {
                    continue;
                }
                let z = self.depth_m[cell];
                if z > 0.0 {
                    if (z - depth_m).abs() <= step && z >= nearest && z <= farthest {
                        self.owner[cell] = owner;
                        self.body.push(Reached { cell: cell as u32, depth_m: z, gap: 0 });
                    }
                } else if gap < config.full.max_gap_cells
                    && r >= inner[1]
                    && r < inner[3]
                    && c >= inner[0]
                    && c < inner[2]
                {
                    self.owner[cell] = owner;
                    self.body.push(Reached { cell: cell as u32, depth_m, gap: gap + 1 });
                }
            }
        }
        self.extent()
    }

    /// Place and size of the body that was outlined last.
    fn extent(&self) -> Extent {
        let (mut column, mut row) = (0, 0);
        for reached in &self.body {
            column += reached.cell as usize % self.columns;
            row += reached.cell as usize / self.columns;
        }
        let cells = self.body.len();
        let middle = |sum: usize| (sum * CELL_PX) as f32 / cells.max(1) as f32;
        Extent { middle: [middle(column), middle(row)], cells }
    }

    /// How far away what a mask marked in a box is, m, infinite where that was not measured; `None` if it fills less than
    /// `config.group_min_share` of the box.
    pub(crate) fn masked_depth(&mut self, config: &DynamicConfig, bbox: &BoundingBox) -> Option<f32> {
        let cells = self.collect_masked(bbox);
        if self.body.is_empty() || (self.body.len() as f32) < config.group_min_share * cells as f32 {
            return None;
        }
        self.body.retain(|reached| reached.depth_m > 0.0);
        let middle = self.body.len() / 2;
        if self.body.is_empty() {
            return Some(f32::INFINITY);
        }
        let (_, median, _) = self.body.select_nth_unstable_by(middle, |a, b| a.depth_m.total_cmp(&b.depth_m));
        Some(median.depth_m)
    }

    /// Gives what a mask marked in a box to a track. Returns what that is.
    pub(crate) fn claim(&mut self, track: usize, bbox: &BoundingBox) -> Extent {
        self.collect_masked(bbox);
        for reached in &self.body {
            self.owner[reached.cell as usize] = owner(track);
        }
        self.extent()
    }

    /// Makes what a mask marked in a box the body. Returns how many cells the box has.
    fn collect_masked(&mut self, bbox: &BoundingBox) -> usize {
        let [left, top, right, bottom] = self.cells(bbox, 0.0);
        self.body.clear();
        for row in top..bottom {
            for cell in row * self.columns + left..row * self.columns + right.max(left) {
                if self.owner[cell] == NO_TRACK {
                    self.body.push(Reached { cell: cell as u32, depth_m: self.depth_m[cell], gap: 0 });
                }
            }
        }
        bottom.saturating_sub(top) * right.saturating_sub(left)
    }

    /// Marks the cells whose middle a mask of movable objects covers.
    pub(crate) fn mark_mask(&mut self, mask: &Image<u8>) {
        self.mark_where(|x, y| mask.get(x, y).is_some_and(|number| *number > 0));
    }

    /// Marks the cells whose middle, px, is said to move.
    pub(crate) fn mark_where(&mut self, moves: impl Fn(usize, usize) -> bool) {
        for (row, line) in self.owner.chunks_mut(self.columns.max(1)).enumerate() {
            for (column, owner) in line.iter_mut().enumerate() {
                if moves(column * CELL_PX + CELL_PX / 2, row * CELL_PX + CELL_PX / 2) {
                    *owner = NO_TRACK;
                }
            }
        }
    }

    /// Share of a box that shows something nearer than `depth_m`.
    pub(crate) fn share_nearer(&self, bbox: &BoundingBox, depth_m: f32) -> f32 {
        let [left, top, right, bottom] = self.cells(bbox, 0.0);
        let row = |row: usize| self.depth_m[row * self.columns..].iter().take(right).skip(left);
        let nearer = (top..bottom).flat_map(row).filter(|z| **z > 0.0 && **z < depth_m).count();
        nearer as f32 / (bottom.saturating_sub(top) * right.saturating_sub(left)).max(1) as f32
    }

    /// Whether a box shows something that moves.
    pub(crate) fn holds_body(&self, bbox: &BoundingBox) -> bool {
        let [left, top, right, bottom] = self.cells(bbox, 0.0);
        (top..bottom).any(|row| self.owner[row * self.columns..].iter().take(right).skip(left).any(|owner| *owner != 0))
    }

    /// Marks the whole box of a track.
    pub(crate) fn fill(&mut self, track: usize, bbox: &BoundingBox) {
        let [left, top, right, bottom] = self.cells(bbox, 0.0);
        for row in top..bottom {
            self.owner[row * self.columns + left..row * self.columns + right.max(left)].fill(owner(track));
        }
    }

    /// Every second cell of every second row, a coarse cell: whether something moves there, and its depth, m, 0 where it is unknown.
    pub(crate) fn coarse(&self) -> impl Iterator<Item = (bool, f32)> + '_ {
        let count = (self.rows / 2) * (self.columns / 2);
        (0..count).map(|coarse| self.finest(coarse)).map(|cell| (self.owner[cell] != 0, self.depth_m[cell]))
    }

    /// The track whose body a coarse cell belongs to.
    pub(crate) fn track_at(&self, coarse: usize) -> Option<usize> {
        match self.owner[self.finest(coarse)] {
            0 | NO_TRACK => None,
            owner => Some(usize::from(owner) - 1),
        }
    }

    /// Takes back what was marked in a coarse cell.
    pub(crate) fn release_coarse(&mut self, coarse: usize) {
        let cell = self.finest(coarse);
        for line in [cell, cell + self.columns] {
            self.owner[line..line + 2].fill(0);
        }
    }

    /// The upper left of the four cells that make a coarse one.
    fn finest(&self, coarse: usize) -> usize {
        let half = (self.columns / 2).max(1);
        2 * (coarse / half) * self.columns + 2 * (coarse % half)
    }

    /// How much nearer than `expected_m` the farthest thing in front of that depth is, m, among the cells within `radius_px` of a position,
    /// and the variance of all depths there, m²; `None` if nothing is nearer.
    pub(crate) fn step_behind(&self, [x, y]: [f32; 2], radius_px: f32, expected_m: f32) -> Option<(f32, f32)> {
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

    /// Marks the region around a position whose depths differ from its mean by at most `step_m`. Returns whether anything is new.
    pub(crate) fn grow_from(&mut self, [x, y]: [f32; 2], step_m: f32) -> bool {
        let (column, row) = (x.max(0.0) as usize / CELL_PX, y.max(0.0) as usize / CELL_PX);
        if column >= self.columns || row >= self.rows {
            return false;
        }
        let seed = row * self.columns + column;
        let depth_m = self.depth_m[seed];
        if depth_m <= 0.0 || self.owner[seed] != 0 {
            return false;
        }
        self.body.clear();
        self.body.push(Reached { cell: seed as u32, depth_m, gap: 0 });
        self.owner[seed] = NO_TRACK;
        let (mut sum, mut next) = (depth_m, 0);
        while let Some(&Reached { cell, .. }) = self.body.get(next) {
            next += 1;
            let cell = cell as usize;
            let column = cell % self.columns;
            let left = (column > 0).then(|| cell - 1);
            let right = (column + 1 < self.columns).then_some(cell + 1);
            let up = cell.checked_sub(self.columns);
            let down = Some(cell + self.columns).filter(|c| *c < self.depth_m.len());
            for cell in [left, right, up, down].into_iter().flatten() {
                let z = self.depth_m[cell];
                if self.owner[cell] == 0 && z > 0.0 && (z - sum / self.body.len() as f32).abs() < step_m {
                    self.owner[cell] = NO_TRACK;
                    self.body.push(Reached { cell: cell as u32, depth_m: z, gap: 0 });
                    sum += z;
                }
            }
        }
        true
    }

    /// Takes back what was marked for a track.
    pub(crate) fn release(&mut self, track: usize) {
        let owner = owner(track);
        self.owner.iter_mut().filter(|o| **o == owner).for_each(|o| *o = 0);
    }

    /// Marks a cell of twice the side, and what adjoins it.
    pub(crate) fn mark_coarse(&mut self, column: usize, row: usize) {
        for r in (2 * row).saturating_sub(1)..(2 * row + 3).min(self.rows) {
            let line = r * self.columns;
            let cells = line + (2 * column).saturating_sub(1)..line + (2 * column + 3).min(self.columns);
            self.owner[cells].iter_mut().filter(|owner| **owner == 0).for_each(|owner| *owner = NO_TRACK);
        }
    }

    /// Whether a position of the raw image, px, lies on a body or within `edge_px` of one.
    pub(crate) fn covers(&self, [x, y]: [f32; 2], edge_px: f32) -> bool {
        let near = |d: f32, r: f32| (((d - r).max(0.0) as usize) / CELL_PX, ((d + r).max(0.0) as usize) / CELL_PX);
        let ((left, right), (top, bottom)) = (near(x, edge_px), near(y, edge_px));
        (top..=bottom.min(self.rows.saturating_sub(1))).any(|row| {
            let (from, to) =
                (row * self.columns + left, row * self.columns + right.min(self.columns.saturating_sub(1)));
            self.owner.get(from..=to).is_some_and(|cells| cells.iter().any(|owner| *owner != 0))
        })
    }

    /// The track whose body a position of the raw image, px, lies on.
    pub(crate) fn body_at(&self, [x, y]: [f32; 2]) -> Option<usize> {
        let [column, row] = [x, y].map(|v| (v.max(0.0) as usize) / CELL_PX);
        let owner = *self.owner.get(row * self.columns + column).filter(|_| column < self.columns)?;
        (owner != 0 && owner != NO_TRACK).then(|| usize::from(owner) - 1)
    }

    /// Cells of a box grown by a share of its size: left, top, right, bottom.
    fn cells(&self, b: &BoundingBox, margin: f32) -> [usize; 4] {
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

    /// Depth in millimetres from a rule in pixels.
    pub(super) fn depth(rule: impl Fn(usize, usize) -> u16) -> DepthImage {
        let mut raw = Image::new(320, 240);
        for y in 0..240 {
            raw.row_mut(y).iter_mut().enumerate().for_each(|(x, d)| *d = rule(x, y));
        }
        DepthImage { raw, metres_per_unit: 0.001 }
    }

    /// A trunk at 2 m, an arm that reaches to 1.5 m, a gap without depth beside it, a wall at 4 m.
    fn somebody(x: usize, y: usize) -> u16 {
        match (x, y) {
            (100..150, 40..) => 2000,
            (150..200, 100..120) => 2000 - 10 * (x as u16 - 150),
            (90..100, 40..) => 0,
            _ => 4000,
        }
    }

    fn outlined(near_m: f32) -> InstanceMask {
        let (config, mut bodies) = (DynamicConfig::default(), InstanceMask::default());
        bodies.begin(&depth(somebody));
        let bbox = BoundingBox { x_min: 92.0, y_min: 40.0, x_max: 195.0, y_max: 240.0 };
        bodies.grow(&config, 0, &bbox, near_m);
        bodies
    }

    #[test]
    fn a_body_is_followed_along_its_surface_and_over_gaps_but_not_onto_the_wall() {
        let bodies = outlined(2.0);
        for on_body in [[120.0, 100.0], [190.0, 110.0], [98.0, 150.0]] {
            assert!(bodies.covers(on_body, 0.0), "{on_body:?}");
        }
        for beside in [[170.0, 60.0], [170.0, 200.0], [60.0, 150.0]] {
            assert!(!bodies.covers(beside, 2.0), "{beside:?}");
        }
        assert!(bodies.covers([153.0, 60.0], 6.0), "the edge");
    }

    #[test]
    fn what_one_body_leaves_free_is_asked_about_the_next() {
        let (bodies, mut free) = (outlined(2.0), Vec::new());
        bodies.free_depths(&BoundingBox { x_min: 100.0, y_min: 40.0, x_max: 200.0, y_max: 240.0 }, &mut free);
        assert!(!free.is_empty() && free.iter().all(|z| *z == 4.0), "{free:?}");
    }

    #[test]
    fn what_a_mask_shows_in_a_box_is_the_body_of_its_track() {
        let config = DynamicConfig::default();
        let (mut bodies, mut mask) = (InstanceMask::default(), Image::new(320, 240));
        bodies.begin(&depth(|x, _| if x < 160 { 2000 } else { 3000 }));
        let bbox = BoundingBox { x_min: 80.0, y_min: 40.0, x_max: 240.0, y_max: 200.0 };
        assert_eq!(bodies.masked_depth(&config, &bbox), None);
        (80..160).for_each(|y| mask.row_mut(y)[100..180].fill(1u8));
        bodies.mark_mask(&mask);
        assert_eq!(bodies.masked_depth(&config, &bbox), Some(2.0));
        let body = bodies.claim(4, &bbox);
        assert_eq!((body.cells, body.middle), (400, [138.0, 118.0]));
        assert_eq!(bodies.masked_depth(&config, &bbox), None, "it is given once");
        let far = BoundingBox { x_min: 0.0, x_max: 320.0, y_min: 0.0, y_max: 240.0 };
        assert_eq!(bodies.masked_depth(&config, &far), None);
    }

    #[test]
    fn a_mask_marks_what_it_covers() {
        let (mut bodies, mut mask) = (InstanceMask::default(), Image::new(320, 240));
        bodies.begin(&depth(|_, _| 4000));
        mask.row_mut(50)[98] = 3u8;
        bodies.mark_mask(&mask);
        assert!(bodies.covers([98.0, 50.0], 0.0) && !bodies.covers([110.0, 50.0], 2.0));
    }
}
