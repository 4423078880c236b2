//! An image of an occupancy grid with the path of the camera, axes, a scale bar and a legend.
//!
//! In: a grid and positions in the same frame. Out: an image in the grey levels of the file for navigation; x to the right, y up, and each
//! cell a square of whole pixels.

use yfslam::RgbImage;
use yfslam::dense::{GridCell, GroundGrid};

use super::dense_image::scale_bar;
use super::shapes::{Color, bar, disc, rectangle};
use super::text::{dot_of_width, label, width};

/// Largest width and height of the grid, px, unless a pixel for each cell needs more.
const PLOT_PX: [f64; 2] = [900.0, 700.0];
/// Largest side of a cell, px.
const MAX_CELL_PX: f64 = 24.0;
const PAPER: Color = [250; 3];
const INK: Color = [40; 3];
const PATH: Color = [20, 90, 220];
const START: Color = [0, 150, 60];

/// The grey level of a cell, as in the file for navigation.
fn shade(cell: GridCell) -> Color {
    [match cell {
        GridCell::Occupied => 0,
        GridCell::Free => 254,
        GridCell::Unknown => 205,
    }; 3]
}

/// The part of the ground that is drawn, and where.
struct Plot {
    /// Left lower corner, m.
    low: [f64; 2],
    /// Width and height, m.
    size: [f64; 2],
    px_per_m: f64,
    /// Left upper corner in the image, px.
    corner: [i64; 2],
}

impl Plot {
    /// Returns where a position is drawn.
    fn at(&self, [x, y]: [f64; 2]) -> [f32; 2] {
        let [left, top] = self.corner.map(|px| px as f64);
        [
            (left + (x - self.low[0]) * self.px_per_m) as f32,
            (top + (self.low[1] + self.size[1] - y) * self.px_per_m) as f32,
        ]
    }

    /// Returns width and height, px.
    fn px(&self) -> [i64; 2] {
        self.size.map(|side| (side * self.px_per_m).round().max(1.0) as i64)
    }
}

/// Draws the grid and the path, in the order of time, from its green start on.
pub fn draw_grid(grid: &GroundGrid, path: &[[f64; 2]]) -> RgbImage {
    let resolution = grid.resolution_m;
    let mut plot = area(grid, path, resolution);
    let [wide, high] = plot.px();
    // Text grows with the image, and the margins with the text.
    let margins = |dot: i64| [34 * dot, 12 * dot];
    let total = |dot: i64| (wide + margins(dot).iter().sum::<i64>()).max(290 * dot);
    let dot = (1..100).find(|&dot| dot_of_width(total(dot) as usize) <= dot).unwrap_or(100);
    let line = 11 * dot;
    plot.corner = [margins(dot)[0], line + dot];
    let height = plot.corner[1] + high + 5 * line;
    let mut image = RgbImage::new(total(dot) as usize, height as usize);
    image.data_mut().fill(PAPER);
    let [left, top] = plot.corner;
    bar(&mut image, plot.corner, [left + wide - 1, top + high - 1], shade(GridCell::Unknown));
    cells(&mut image, grid, &plot, resolution);
    draw_path(&mut image, &plot, path, dot);
    axes(&mut image, &plot, dot);
    legend(&mut image, [dot * 4, top + high + 2 * line + 2 * dot], dot);
    scale_bar(&mut image, plot.px_per_m as f32);
    image
}

/// Returns the ground that holds the grid and the path, in whole cells.
fn area(grid: &GroundGrid, path: &[[f64; 2]], resolution: f64) -> Plot {
    let cells = [grid.width, grid.height];
    let mut low = [0.0; 2];
    let mut size = [resolution; 2];
    for axis in 0..2 {
        let origin = grid.origin_m[axis];
        let positions = || path.iter().map(|position| position[axis]).filter(|value| value.is_finite());
        let first = positions().fold(0.0f64, |least, value| least.min(((value - origin) / resolution).floor()));
        let last = positions().fold(cells[axis] as f64, |most, value| most.max(((value - origin) / resolution).ceil()));
        low[axis] = origin + first * resolution;
        size[axis] = (last - first).max(1.0) * resolution;
    }
    let cell_px = (0..2).map(|axis| PLOT_PX[axis] / (size[axis] / resolution)).fold(MAX_CELL_PX, f64::min);
    Plot { low, size, px_per_m: cell_px.floor().max(1.0) / resolution, corner: [0, 0] }
}

fn cells(image: &mut RgbImage, grid: &GroundGrid, plot: &Plot, resolution: f64) {
    let side = (plot.px_per_m * resolution).round() as i64;
    for (row, cells) in grid.cells.chunks(grid.width.max(1)).enumerate() {
        for (column, cell) in cells.iter().enumerate().filter(|(_, cell)| **cell != GridCell::Unknown) {
            let origin = grid.origin_m;
            // The left upper corner of the cell.
            let [x, y] = plot.at([origin[0] + column as f64 * resolution, origin[1] + (row + 1) as f64 * resolution]);
            let (x, y) = (x.round() as i64, y.round() as i64);
            bar(image, [x, y], [x + side - 1, y + side - 1], shade(*cell));
        }
    }
}

fn draw_path(image: &mut RgbImage, plot: &Plot, path: &[[f64; 2]], dot: i64) {
    let radius = dot as f32 * 0.6;
    for pair in path.windows(2) {
        let (Some(from), Some(to)) = (pair.first(), pair.last()) else { continue };
        let ([x, y], [to_x, to_y]) = (plot.at(*from), plot.at(*to));
        let steps = ((to_x - x).abs().max((to_y - y).abs()).ceil() as usize).clamp(1, 100_000);
        for step in 0..=steps {
            let share = step as f32 / steps as f32;
            disc(image, [x + (to_x - x) * share, y + (to_y - y) * share], radius, PATH);
        }
    }
    if let Some(start) = path.first() {
        disc(image, plot.at(*start), 3.0 * dot as f32, PAPER);
        disc(image, plot.at(*start), 2.2 * dot as f32, START);
    }
}

/// Draws a frame with ticks at round numbers of metres.
fn axes(image: &mut RgbImage, plot: &Plot, dot: i64) {
    let ([left, top], [wide, high]) = (plot.corner, plot.px());
    rectangle(image, [left - 1, top - 1], [left + wide, top + high], 1, INK);
    let step = tick_step_m(40.0 * dot as f64 / plot.px_per_m);
    let decimals = if step < 1.0 { (-step.log10()).ceil() as usize } else { 0 };
    for axis in 0..2 {
        let first = (plot.low[axis] / step).ceil() as i64;
        let last = ((plot.low[axis] + plot.size[axis]) / step).floor() as i64;
        for number in first..=last {
            let value = number as f64 * step;
            let text = format!("{value:.decimals$}");
            let long = width(image, &text);
            let at = plot.at(if axis == 0 { [value, plot.low[1]] } else { [plot.low[0], value] });
            let [x, y] = at.map(|px| px.round() as i64);
            if axis == 0 {
                bar(image, [x, y], [x, y + 2 * dot], INK);
                label(image, [x - long / 2, y + 3 * dot], &text, INK, PAPER);
            } else {
                bar(image, [x - 2 * dot, y], [x - 1, y], INK);
                label(image, [x - 3 * dot - long, y - 5 * dot], &text, INK, PAPER);
            }
        }
    }
    label(image, [left - 3 * dot - width(image, "y (m)"), 0], "y (m)", INK, PAPER);
    label(image, [left + wide - width(image, "x (m)"), top + high + 13 * dot], "x (m)", INK, PAPER);
}

/// Returns 1, 2 or 5 times a power of ten that is at least `least_m`.
fn tick_step_m(least_m: f64) -> f64 {
    let power = 10f64.powf(least_m.max(1e-6).log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|step| *step >= least_m).unwrap_or(10.0 * power)
}

fn legend(image: &mut RgbImage, [mut x, y]: [i64; 2], dot: i64) {
    let items = [
        ("occupied", shade(GridCell::Occupied)),
        ("free", shade(GridCell::Free)),
        ("unknown", shade(GridCell::Unknown)),
        ("path", PATH),
        ("start", START),
    ];
    for (text, color) in items {
        bar(image, [x, y + 2 * dot], [x + 7 * dot, y + 9 * dot], color);
        rectangle(image, [x, y + 2 * dot], [x + 7 * dot, y + 9 * dot], 1, INK);
        label(image, [x + 8 * dot, y], text, INK, PAPER);
        x += 12 * dot + width(image, text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_and_path_are_drawn_where_they_are_with_x_to_the_right_and_y_up() {
        use GridCell::{Free, Occupied, Unknown};
        let cells = vec![Occupied, Free, Free, Free, Free, Unknown];
        let grid = GroundGrid { origin_m: [-1.0, 2.0], resolution_m: 0.5, width: 3, height: 2, cells };
        // The path leaves the grid to the right.
        let path = [[-0.25, 2.25], [1.75, 2.75]];
        let plot = area(&grid, &path, 0.5);
        assert_eq!((plot.low, plot.size), ([-1.0, 2.0], [3.0, 1.0]));
        assert_eq!(plot.px_per_m, MAX_CELL_PX / 0.5);
        let image = draw_grid(&grid, &path);
        let (left, top) = (34, 12);
        // A pixel of the upper right quarter of a cell, away from path and frame.
        let color = |x: f64, y: f64| {
            let px = [left as f64 + (x + 1.0) * plot.px_per_m + 18.0, top as f64 + (3.0 - y) * plot.px_per_m - 19.0];
            *image.get(px[0] as usize, px[1] as usize).unwrap()
        };
        assert_eq!(color(-1.0, 2.0), shade(Occupied));
        assert_eq!(color(-1.0, 2.5), shade(Free));
        assert_eq!(color(0.0, 2.5), shade(Unknown));
        assert_eq!(color(1.0, 2.0), shade(Unknown), "beyond the grid");
        let count = |color: Color| image.data().iter().filter(|pixel| **pixel == color).count();
        assert!(count(PATH) > 80 && count(START) > 10 && count(INK) > 300);
        assert!(draw_grid(&GroundGrid { width: 0, height: 0, cells: Vec::new(), ..grid }, &[]).width() > 0);
    }

    #[test]
    fn ticks_are_at_round_numbers() {
        for (least, step) in [(0.7, 1.0), (1.0, 1.0), (1.3, 2.0), (3.0, 5.0), (6.0, 10.0), (0.03, 0.05), (120.0, 200.0)]
        {
            assert!((tick_step_m(least) / step - 1.0).abs() < 1e-9, "{least}: {}", tick_step_m(least));
        }
    }
}
