//! Points of depth images on a coarse grid: what stands still at a keyframe, and what moves now.

use std::borrow::Cow;

use serde_json::json;
use yfslam::dense::CellGrid;
use yfslam::{BoundingBox, Camera, DepthImage, Frame, Region, Slam};

use crate::packet::{Numbered, PacketBuilder, seconds};

/// Columns of the grid, about.
const COLUMNS: usize = 80;
/// Units of a coordinate per metre.
const UNITS: f32 = 1000.0;
/// Points farther away are left out, m: sensors are imprecise there, and coordinates have 16 bits.
const MAX_RANGE_M: f32 = 8.0;
/// Step of the depth to a neighbour, as a share of it, from which on the cell lies on an edge.
const EDGE: f32 = 0.04;
/// Margin around a box of something that moves, as a share of its sides.
const MARGIN: f32 = 0.1;

/// The grid of cells of a camera.
pub struct Cells {
    grid: CellGrid,
    rows: usize,
}

/// What the points of a keyframe are made of.
pub struct Keyframe {
    number: u64,
    frame: Frame,
    regions: Vec<Region>,
    boxes: Vec<BoundingBox>,
}

impl Keyframe {
    /// Keeps the frame that `slam` has just tracked; its images are shared.
    pub fn new(number: u64, frame: &Frame, slam: &Slam) -> Self {
        let boxes = slam.detections().iter().map(|detection| detection.bbox).collect();
        Self { number, frame: frame.clone(), regions: slam.moving_regions().to_vec(), boxes }
    }
}

/// What moves in a frame.
#[derive(Default)]
pub struct Movers {
    /// 1 for each cell that moves, row by row, else 0; empty if nothing moves.
    pub mask: Vec<u8>,
    /// Coordinates of the cells that move, in the frame of the camera, mm, 16 bits each.
    pub points: Vec<u8>,
}

impl Cells {
    pub fn new(camera: &Camera) -> Self {
        let grid = CellGrid::new(camera, (camera.width / COLUMNS).max(1));
        let rows = grid.rays().len() / grid.columns().max(1);
        Self { grid, rows }
    }

    pub fn columns(&self) -> usize {
        self.grid.columns()
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the cells that move.
    pub fn movers(&self, frame: &Frame, regions: &[Region]) -> Movers {
        if regions.is_empty() && frame.mask.is_none() {
            return Movers::default();
        }
        let depth = depth_of(frame);
        let mut movers = Movers { mask: Vec::with_capacity(self.grid.rays().len()), points: Vec::new() };
        for cell in 0..self.grid.rays().len() {
            let moves = self.moves(cell, frame, regions, &depth);
            movers.mask.push(u8::from(moves));
            if moves && let Some(point) = self.point(cell, &depth) {
                movers.points.extend(point.into_iter().flat_map(i16::to_le_bytes));
            }
        }
        movers
    }

    /// Makes the packet of a keyframe's points that stand still; `None` without depth.
    pub fn patch(&self, keyframe: &Keyframe, start_ns: i64) -> Option<Numbered> {
        let Keyframe { number, frame, .. } = keyframe;
        let depth = depth_of(frame);
        let (mut points, mut colors) = (Vec::new(), Vec::new());
        for cell in 0..self.grid.rays().len() {
            if self.is_edge(cell, &depth) || self.may_move(cell, keyframe) {
                continue;
            }
            let Some(point) = self.point(cell, &depth) else { continue };
            let [x, y] = self.middle(cell);
            points.extend(point.into_iter().flat_map(i16::to_le_bytes));
            colors.extend(frame.color.get(x, y).copied().unwrap_or_default());
        }
        let head = json!({ "number": number, "t": seconds(frame.timestamp_ns, start_ns) });
        let packet = PacketBuilder::new("patch", head).part("points", &points).part("colors", &colors);
        (!points.is_empty()).then(|| Numbered { number: *number, packet: packet.build() })
    }

    fn middle(&self, cell: usize) -> [usize; 2] {
        let (columns, stride) = (self.grid.columns().max(1), self.grid.stride_px());
        [cell % columns * stride + stride / 2, cell / columns * stride + stride / 2]
    }

    fn metres(&self, cell: usize, depth: &DepthImage) -> Option<f32> {
        let [x, y] = self.middle(cell);
        depth.metres(x, y).filter(|z| *z <= MAX_RANGE_M)
    }

    fn point(&self, cell: usize, depth: &DepthImage) -> Option<[i16; 3]> {
        let (z, [x, y]) = (self.metres(cell, depth)?, self.grid.rays().get(cell)?);
        Some([x * z, y * z, z].map(|metres| (metres * UNITS).round() as i16))
    }

    fn is_edge(&self, cell: usize, depth: &DepthImage) -> bool {
        let Some(z) = self.metres(cell, depth) else { return true };
        let neighbours = [cell + 1, cell + self.columns()].map(|other| self.metres(other, depth));
        neighbours.into_iter().flatten().any(|other| (other - z).abs() > EDGE * z)
    }

    /// Returns whether a cell may belong to something that moves: everything near a region or a detection is left out, as another keyframe shows
    /// what is behind.
    fn may_move(&self, cell: usize, Keyframe { frame, regions, boxes, .. }: &Keyframe) -> bool {
        let [x, y] = self.middle(cell);
        let near = |low: f32, high: f32, at: usize| {
            let margin = MARGIN * (high - low);
            (low - margin..high + margin).contains(&(at as f32))
        };
        let covers = |bbox: &BoundingBox| near(bbox.x_min, bbox.x_max, x) && near(bbox.y_min, bbox.y_max, y);
        let masked = frame.mask.as_deref().and_then(|mask| mask.get(x, y)).is_some_and(|value| *value != 0);
        masked || regions.iter().map(|region| &region.bbox).chain(boxes).any(covers)
    }

    fn moves(&self, cell: usize, frame: &Frame, regions: &[Region], depth: &DepthImage) -> bool {
        let [x, y] = self.middle(cell);
        let masked = frame.mask.as_deref().and_then(|mask| mask.get(x, y)).is_some_and(|value| *value != 0);
        masked
            || regions.iter().any(|region| {
                let bbox = &region.bbox;
                let inside = |at: usize, low: f32, high: f32| (low..high).contains(&(at as f32));
                let is_inside = inside(x, bbox.x_min, bbox.x_max) && inside(y, bbox.y_min, bbox.y_max);
                let is_near = |[near, far]: [f32; 2]| depth.metres(x, y).is_some_and(|z| z >= near && z <= far);
                is_inside && region.depth_m.is_none_or(is_near)
            })
    }
}

fn depth_of(frame: &Frame) -> Cow<'_, DepthImage> {
    frame.depth.as_deref().map_or_else(Cow::default, Cow::Borrowed)
}
