//! A backend of the plotting library that writes PDF: vector lines, and text in Helvetica, which every reader has.

use std::convert::Infallible;

use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontTransform,
};

/// Points of PDF for each px: 96 px and 72 points are an inch.
const POINTS_PER_PX: f64 = 0.75;

/// Widths of the characters from the blank to `~` in Helvetica, thousandths of the size. Source: the metrics that Adobe publishes with
/// the fonts that every PDF reader has.
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556, 556, 556,
    556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833,
    722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556,
    556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334,
    260, 334, 584,
];

/// Returns the width of a text in the unit of its size.
pub fn text_width(text: &str, size: f64) -> f64 {
    let of = |c: char| {
        let index = (c as usize).checked_sub(usize::from(b' '));
        f64::from(index.and_then(|index| WIDTHS.get(index)).copied().unwrap_or(if c == '°' { 400 } else { 584 }))
    };
    text.chars().map(of).sum::<f64>() * size / 1000.0
}

/// Returns the bytes of a text in the encoding WinAnsi.
fn win_ansi(text: &str) -> Vec<u8> {
    let byte = |c: char| match c {
        ' '..='~' | '\u{a0}'..='\u{ff}' => c as u8,
        '−' | '–' => 0x96,
        '…' => 0x85,
        _ => b'?',
    };
    text.chars().map(byte).collect()
}

/// A page that is being drawn.
pub struct PdfContent {
    content: Content,
    /// Width and height in units of the backend.
    size: [u32; 2],
    /// Points of PDF for each unit of the backend.
    scale: f64,
    /// Opacities in use, in hundredths.
    opacities: Vec<u32>,
}

impl PdfContent {
    /// Starts a page; `fine` units of the backend are a px.
    pub fn new(size: [u32; 2], fine: f64) -> Self {
        let mut content = Content::new();
        content.set_line_join(LineJoinStyle::RoundJoin);
        Self { content, size, scale: POINTS_PER_PX / fine, opacities: vec![100] }
    }

    fn point(&self, (x, y): BackendCoord) -> (f32, f32) {
        let up = f64::from(self.size[1]) - f64::from(y);
        ((f64::from(x) * self.scale) as f32, (up * self.scale) as f32)
    }

    fn length(&self, units: f64) -> f32 {
        (units * self.scale) as f32
    }

    fn set_opacity(&mut self, alpha: f64) {
        let percent = (alpha.clamp(0.0, 1.0) * 100.0).round() as u32;
        if !self.opacities.contains(&percent) {
            self.opacities.push(percent);
        }
        self.content.set_parameters(Name(format!("G{percent}").as_bytes()));
    }

    fn stroke_with(&mut self, style: &impl BackendStyle) {
        let BackendColor { alpha, rgb: (r, g, b) } = style.color();
        let [r, g, b] = [r, g, b].map(|v| f32::from(v) / 255.0);
        self.set_opacity(alpha);
        let width = self.length(f64::from(style.stroke_width()));
        self.content.set_stroke_rgb(r, g, b).set_line_width(width);
    }

    fn fill_with(&mut self, color: BackendColor) {
        let (r, g, b) = color.rgb;
        let [r, g, b] = [r, g, b].map(|v| f32::from(v) / 255.0);
        self.set_opacity(color.alpha);
        self.content.set_fill_rgb(r, g, b);
    }

    fn path(&mut self, points: impl IntoIterator<Item = BackendCoord>) {
        for (index, at) in points.into_iter().enumerate() {
            let (x, y) = self.point(at);
            if index == 0 {
                self.content.move_to(x, y)
            } else {
                self.content.line_to(x, y)
            };
        }
    }

    /// Returns the file, with one page.
    pub fn file(self, title: &str) -> Vec<u8> {
        let [catalog, pages, page, font, stream, info] = [1, 2, 3, 4, 5, 6].map(Ref::new);
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(pages);
        pdf.document_info(info).title(pdf_writer::TextStr(title));
        pdf.pages(pages).kids([page]).count(1);
        let [width, height] = self.size.map(|side| (f64::from(side) * self.scale) as f32);
        let states: Vec<(String, Ref, f32)> = self
            .opacities
            .iter()
            .zip(10..)
            .map(|(percent, number)| (format!("G{percent}"), Ref::new(number), *percent as f32 / 100.0))
            .collect();
        let mut described = pdf.page(page);
        described.media_box(Rect::new(0.0, 0.0, width, height)).parent(pages).contents(stream);
        let mut resources = described.resources();
        resources.fonts().pair(Name(b"F"), font);
        let mut of_page = resources.ext_g_states();
        for (name, reference, _) in &states {
            of_page.pair(Name(name.as_bytes()), *reference);
        }
        of_page.finish();
        resources.finish();
        described.finish();
        pdf.type1_font(font).base_font(Name(b"Helvetica")).encoding_predefined(Name(b"WinAnsiEncoding"));
        for (_, reference, opacity) in &states {
            pdf.ext_graphics(*reference).stroking_alpha(*opacity).non_stroking_alpha(*opacity);
        }
        pdf.stream(stream, &self.content.finish());
        pdf.finish()
    }
}

/// The backend; it draws into a page.
pub struct PdfBackend<'a>(&'a mut PdfContent);

impl<'a> PdfBackend<'a> {
    pub fn new(content: &'a mut PdfContent) -> Self {
        Self(content)
    }
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl DrawingBackend for PdfBackend<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.0.size[0], self.0.size[1])
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn {
        self.draw_rect(point, (point.0 + 1, point.1 + 1), &color, true)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(&mut self, a: BackendCoord, b: BackendCoord, style: &S, fill: bool) -> Drawn {
        let corners = [a, (b.0, a.1), b, (a.0, b.1)];
        if fill {
            return self.fill_polygon(corners, style);
        }
        self.0.stroke_with(style);
        self.0.path(corners);
        self.0.content.close_and_stroke();
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Drawn {
        if style.color().alpha > 0.0 {
            self.0.stroke_with(style);
            self.0.path(path);
            self.0.content.stroke();
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(&mut self, center: BackendCoord, radius: u32, style: &S, fill: bool) -> Drawn {
        // Four curves; the factor is the usual approximation of a quarter of a circle.
        let ((x, y), r) = (self.0.point(center), self.0.length(f64::from(radius)));
        let k = 0.5523 * r;
        if fill {
            self.0.fill_with(style.color())
        } else {
            self.0.stroke_with(style)
        }
        let content = &mut self.0.content;
        content.move_to(x + r, y);
        content.cubic_to(x + r, y + k, x + k, y + r, x, y + r);
        content.cubic_to(x - k, y + r, x - r, y + k, x - r, y);
        content.cubic_to(x - r, y - k, x - k, y - r, x, y - r);
        content.cubic_to(x + k, y - r, x + r, y - k, x + r, y);
        if fill {
            content.fill_nonzero()
        } else {
            content.close_and_stroke()
        };
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, points: I, style: &S) -> Drawn {
        self.0.fill_with(style.color());
        self.0.path(points);
        self.0.content.fill_nonzero();
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        // The plotting library gives a size of which the letters take the same share as in its SVG.
        let size = f64::from(self.0.length(style.size() / 1.24));
        let anchor = style.anchor();
        let along = match anchor.h_pos {
            HPos::Left => 0.0,
            HPos::Center => -text_width(text, size) / 2.0,
            HPos::Right => -text_width(text, size),
        };
        let below = match anchor.v_pos {
            VPos::Top => -0.76 * size,
            VPos::Center => -0.36 * size,
            VPos::Bottom => 0.0,
        };
        let ((x, y), (along, below)) = (self.0.point(at), (along as f32, below as f32));
        let (cos, sin) = match style.transform() {
            FontTransform::None => (1.0, 0.0),
            FontTransform::Rotate90 => (0.0, -1.0),
            FontTransform::Rotate180 => (-1.0, 0.0),
            FontTransform::Rotate270 => (0.0, 1.0),
        };
        self.0.fill_with(style.color());
        self.0
            .content
            .begin_text()
            .set_font(Name(b"F"), size as f32)
            .set_text_matrix([cos, sin, -sin, cos, x + along * cos - below * sin, y + along * sin + below * cos])
            .show(Str(&win_ansi(text)))
            .end_text();
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let size = style.size() / 1.24;
        Ok((text_width(text, size).ceil() as u32, size.ceil() as u32))
    }
}
