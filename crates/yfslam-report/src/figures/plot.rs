//! In: axes and marks in their units. Out: a figure as SVG or PDF. Only this file and its PDF backend use the plotting library.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::Axis;
use super::ink::Ink;
use super::path::{Point, clip, thin};
use super::pdf::{PdfBackend, PdfContent, text_width};

/// The library rounds positions to whole pixels; figures are drawn this many times larger to avoid visible steps.
const FINE: f64 = 10.0;
/// Largest number of points of a line: more than there are pixel columns.
const MOST_POINTS: usize = 2500;
/// Space for labels and names of the axes, px.
const LEFT: f64 = 70.0;
const BELOW: f64 = 46.0;
const MARGIN: f64 = 12.0;
/// Size of labels, px.
const TEXT: f64 = 12.5;

/// An element of a figure; positions in units of the axes, before their scale.
pub enum Mark {
    /// A line; `width` in px.
    Line { points: Vec<Point>, ink: Ink, width: f64, opacity: f64 },
    /// An interval of the horizontal axis.
    Span { from: f64, to: f64, ink: Ink },
    /// A dot; `radius` in px.
    Dot { at: Point, ink: Ink, radius: f64 },
    /// A cross; `radius` in px.
    Cross { at: Point, ink: Ink, radius: f64 },
    /// A vertical bar from the lower end of the axis, with a text on top.
    Bar { from: f64, to: f64, height: f64, ink: Ink, text: String },
}

/// A figure: two axes and the marks between them, drawn in order.
pub struct Figure {
    /// Description for screen readers.
    pub description: String,
    /// Whole width and height, px.
    pub size: [f64; 2],
    pub x: Axis,
    pub y: Axis,
    pub marks: Vec<Mark>,
    /// Names of the lines, for a figure in a file of its own; the page has its legend beside the figure.
    pub legend: Vec<(String, Ink)>,
}

type Chart<'a, B> = ChartContext<'a, B, Cartesian2d<Axis, Axis>>;
impl Mark {
    /// Returns the points that a legend should not cover.
    fn points(&self) -> Vec<Point> {
        match self {
            Self::Line { points, .. } => points.clone(),
            Self::Dot { at, .. } | Self::Cross { at, .. } => vec![*at],
            Self::Bar { from, to, height, .. } => {
                let middle = (from + to) / 2.0;
                (0..=10).map(|k| [middle, height * f64::from(k) / 10.0]).collect()
            }
            Self::Span { .. } => Vec::new(),
        }
    }
}

type Drawn = Result<(), Box<dyn std::error::Error>>;

/// Returns the size of the plot in a figure of this size, px.
pub fn plot_size([width, height]: [f64; 2]) -> [f64; 2] {
    [width - LEFT - 2.0 * MARGIN, height - BELOW - 2.0 * MARGIN]
}

/// Returns the height of a figure with a plot of `plot_height`, px.
pub fn height_for(plot_height: f64) -> f64 {
    plot_height + BELOW + 2.0 * MARGIN
}

impl Figure {
    /// Returns the figure as an SVG element; empty if the library cannot draw it.
    pub fn svg(&self) -> String {
        let mut svg = String::new();
        match self.draw(&mut svg) {
            Ok(()) => {
                svg.replacen("<svg ", &format!("<svg role=\"img\" aria-label=\"{}\" ", escape(&self.description)), 1)
            }
            Err(_) => String::new(),
        }
    }

    /// Returns the figure as an SVG file, in its size in px; empty if the library cannot draw it.
    pub fn svg_file(&self) -> String {
        let [width, height] = self.size.map(fine);
        let drawn = format!("width=\"{width}\" height=\"{height}\"");
        self.svg().replacen(&drawn, &format!("width=\"{:.0}\" height=\"{:.0}\"", self.size[0], self.size[1]), 1)
    }

    /// Returns the figure as a PDF file; empty if the library cannot draw it.
    pub fn pdf(&self) -> Vec<u8> {
        let mut content = PdfContent::new(self.size.map(fine), FINE);
        match self.draw_on(PdfBackend::new(&mut content)) {
            Ok(()) => content.file(&self.description),
            Err(_) => Vec::new(),
        }
    }

    fn draw(&self, svg: &mut String) -> Drawn {
        self.draw_on(SVGBackend::with_string(svg, (fine(self.size[0]), fine(self.size[1]))))
    }

    fn draw_on<B: DrawingBackend>(&self, backend: B) -> Drawn
    where
        B::ErrorType: 'static,
    {
        let root = backend.into_drawing_area();
        let mut chart = ChartBuilder::on(&root)
            .margin(fine(MARGIN))
            .x_label_area_size(fine(BELOW))
            .y_label_area_size(fine(LEFT))
            .build_cartesian_2d(self.x.clone(), self.y.clone())?;
        self.draw_axes(&mut chart)?;
        for mark in &self.marks {
            self.draw_mark(&mut chart, mark)?;
        }
        drop(chart);
        self.draw_legend(&root)?;
        Ok(root.present()?)
    }

    /// Draws the names of the lines inside the plot, in the corner with the fewest points.
    fn draw_legend<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> Drawn
    where
        B::ErrorType: 'static,
    {
        if self.legend.is_empty() {
            return Ok(());
        }
        let names = self.legend.iter().map(|(name, _)| text_width(name, TEXT));
        let size = [names.fold(0.0, f64::max) + 34.0, 16.0 * self.legend.len() as f64 + 6.0];
        let [left, top] = self.quietest_corner(size);
        let px = |x: f64, y: f64| (fine(left + x) as i32, fine(top + y) as i32);
        root.draw(&Rectangle::new([px(0.0, 0.0), px(size[0], size[1])], WHITE.mix(0.8).filled()))?;
        root.draw(&Rectangle::new([px(0.0, 0.0), px(size[0], size[1])], color(Ink::Grid).stroke_width(fine(1.0))))?;
        for (row, (name, ink)) in self.legend.iter().enumerate() {
            let y = 16.0 * row as f64 + 11.0;
            root.draw(&PathElement::new(vec![px(6.0, y), px(24.0, y)], color(*ink).stroke_width(fine(2.0))))?;
            let place = Pos::new(HPos::Left, VPos::Center);
            let style = ("sans-serif", fine(TEXT * 1.24)).into_font().color(&color(Ink::Text)).pos(place);
            root.draw(&Text::new(name.clone(), px(29.0, y), style))?;
        }
        Ok(())
    }

    /// Returns the place of a box of this size in the corner of the plot with the fewest points, px.
    fn quietest_corner(&self, [width, height]: [f64; 2]) -> [f64; 2] {
        const GAP: f64 = 6.0;
        let plot = plot_size(self.size);
        let (low_x, low_y) = (LEFT + MARGIN + GAP, MARGIN + GAP);
        let (high_x, high_y) = (LEFT + MARGIN + plot[0] - width - GAP, MARGIN + plot[1] - height - GAP);
        let points: Vec<Point> = self.marks.iter().flat_map(Mark::points).map(|at| self.px_of(at)).collect();
        let inside = |[left, top]: [f64; 2]| {
            let holds = |[x, y]: &&Point| (left..left + width).contains(x) && (top..top + height).contains(y);
            points.iter().filter(holds).count()
        };
        let corners = [[high_x, low_y], [low_x, low_y], [high_x, high_y], [low_x, high_y]];
        corners.into_iter().min_by_key(|corner| inside(*corner)).unwrap_or([high_x, low_y])
    }

    /// Returns where a point is in the figure, px.
    fn px_of(&self, at: Point) -> Point {
        let [x, y] = self.place(at);
        let share = |v: f64, [low, high]: [f64; 2]| (v - low) / (high - low).max(f64::MIN_POSITIVE);
        let plot = plot_size(self.size);
        [LEFT + MARGIN + share(x, self.x.range) * plot[0], MARGIN + (1.0 - share(y, self.y.range)) * plot[1]]
    }

    fn draw_axes<B: DrawingBackend>(&self, chart: &mut Chart<'_, B>) -> Drawn
    where
        B::ErrorType: 'static,
    {
        let text = |ink: Ink| ("sans-serif", fine(TEXT * 1.24)).into_font().color(&color(ink));
        let mut mesh = chart.configure_mesh();
        if self.x.name.is_empty() {
            mesh.disable_x_mesh();
        }
        mesh.max_light_lines(0)
            .bold_line_style(color(Ink::Grid).stroke_width(fine(1.0)))
            .axis_style(color(Ink::Axis).stroke_width(fine(1.0)))
            .set_all_tick_mark_size(fine(4.0))
            .label_style(text(Ink::Text))
            .axis_desc_style(text(Ink::Text))
            .x_desc(self.x.name.as_str())
            .y_desc(self.y.name.as_str())
            .draw()?;
        Ok(())
    }

    fn draw_mark<B: DrawingBackend>(&self, chart: &mut Chart<'_, B>, mark: &Mark) -> Drawn
    where
        B::ErrorType: 'static,
    {
        let [bottom, top] = self.y.range;
        match mark {
            Mark::Line { points, ink, width, opacity } => {
                let style = color(*ink).mix(*opacity).stroke_width(fine(*width));
                for part in self.visible(points) {
                    chart.draw_series([PathElement::new(part, style)])?;
                }
            }
            Mark::Span { from, to, ink } => {
                let [low, high] = self.x.range;
                let ends = [(from.max(low), bottom), (to.min(high), top)];
                chart.draw_series([Rectangle::new(ends, color(*ink).mix(0.13).filled())])?;
            }
            Mark::Dot { at, ink, radius } => {
                if let Some(at) = self.inside(*at) {
                    chart.draw_series([Circle::new(at, fine(*radius), color(*ink).filled())])?;
                }
            }
            Mark::Cross { at, ink, radius } => {
                if let Some(at) = self.inside(*at) {
                    chart.draw_series([Cross::new(at, fine(*radius), color(*ink).stroke_width(fine(2.0)))])?;
                }
            }
            Mark::Bar { from, to, height, ink, text } => {
                let height = self.y.scale.position(*height).clamp(bottom, top);
                let ends = [(*from, bottom), (*to, height)];
                chart.draw_series([Rectangle::new(ends, color(*ink).filled())])?;
                let place = Pos::new(HPos::Center, VPos::Bottom);
                let style = ("sans-serif", fine(TEXT * 1.24)).into_font().color(&color(Ink::Text)).pos(place);
                let above = height + (top - bottom) * 4.0 / plot_size(self.size)[1];
                chart.draw_series([Text::new(text.clone(), ((from + to) / 2.0, above), style)])?;
            }
        }
        Ok(())
    }

    /// Returns positions on the axes.
    fn place(&self, [x, y]: Point) -> Point {
        [self.x.scale.position(x), self.y.scale.position(y)]
    }

    fn inside(&self, at: Point) -> Option<(f64, f64)> {
        let [x, y] = self.place(at);
        let holds = |[low, high]: [f64; 2], v: f64| v >= low && v <= high;
        (holds(self.x.range, x) && holds(self.y.range, y)).then_some((x, y))
    }

    /// Returns the parts of a line between the axes, thinned.
    fn visible(&self, points: &[Point]) -> Vec<Vec<(f64, f64)>> {
        let plot = plot_size(self.size);
        let px_per_unit = [self.x.range, self.y.range].map(|[low, high]| 1.0 / (high - low).max(f64::MIN_POSITIVE));
        let px = |p: Point| {
            let [x, y] = self.place(p);
            [(x - self.x.range[0]) * px_per_unit[0] * plot[0], (y - self.y.range[0]) * px_per_unit[1] * plot[1]]
        };
        let back = |[x, y]: Point| {
            (self.x.range[0] + x / plot[0] / px_per_unit[0], self.y.range[0] + y / plot[1] / px_per_unit[1])
        };
        let line: Vec<Point> = points.iter().map(|&p| px(p)).collect();
        let parts = thin(&clip(&line, [0.0, 0.0], plot), MOST_POINTS);
        parts.into_iter().filter(|part| !part.is_empty()).map(|part| part.into_iter().map(back).collect()).collect()
    }
}

/// Positions along an axis, which has its own ticks and labels.
impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, position: &f64, (low_px, high_px): (i32, i32)) -> i32 {
        let [low, high] = self.range;
        let share = (position - low) / (high - low).max(f64::MIN_POSITIVE);
        low_px + (share * f64::from(high_px - low_px)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        let [low, high] = self.range;
        self.ticks.iter().map(|(at, _)| *at).filter(|at| *at >= low && *at <= high).collect()
    }

    fn range(&self) -> Range<f64> {
        self.range[0]..self.range[1]
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, at: &f64) -> String {
        self.ticks.iter().find(|(tick, _)| tick == at).map_or(String::new(), |(_, label)| label.clone())
    }
}

fn color(ink: Ink) -> RGBColor {
    let [r, g, b] = ink.light();
    RGBColor(r, g, b)
}

fn fine(px: f64) -> u32 {
    (px * FINE).round() as u32
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
