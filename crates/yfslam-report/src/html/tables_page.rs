//! In: tables with their titles. Out: one HTML page in the style of the report of a run.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use super::page::shell;
use crate::figures::ink::Ink;
use crate::table::Table;

/// First word of the last cell in a row of figures from a paper.
pub const PUBLISHED: &str = "published";
/// Header of the column with the origin of the figures.
pub const ORIGIN: &str = "figures";
/// First word of the header of a column of improvements.
pub const IMPROVEMENT: &str = "improvement";

/// Tables on a page.
#[derive(Clone, Debug)]
pub struct TablesPage<'a> {
    /// Title of the page.
    pub title: &'a str,
    /// Facts, as name and value.
    pub facts: Vec<(&'a str, String)>,
    /// The tables, in order.
    pub sections: &'a [TableSection],
    /// Figures below the tables, each with a title and an SVG file.
    pub figures: Vec<(String, String)>,
    /// Version of the program.
    pub version: &'a str,
    /// Command that produces this page again.
    pub command: String,
}

/// A table with its heading.
#[derive(Clone, Debug)]
pub struct TableSection {
    /// Short name, for files and links.
    pub id: &'static str,
    /// The heading.
    pub title: String,
    /// Explanation of the figures.
    pub about: String,
    /// The table; rows whose last cell begins with [`PUBLISHED`] are less prominent.
    pub table: Table,
}

impl TablesPage<'_> {
    /// Returns the page.
    pub fn html(&self) -> String {
        let content = html! {
            header {
                p.eyebrow { "yfslam" }
                h1 { (self.title) }
                dl.facts {
                    @for (name, value) in &self.facts { div { dt { (name) } dd { (value) } } }
                }
            }
            @for section in self.sections { (show(section)) }
            @if !self.figures.is_empty() {
                section #figures {
                    h2 { "Figures" }
                    p.about { "Trajectories and errors with the first seed; errors over all seeds, with quartiles, extremes and a dot for each run." }
                    div.pair { @for (title, svg) in &self.figures { (drawn(title, svg)) } }
                }
            }
            section #setup { h2 { "How to repeat it" } pre.command { (self.command) } }
        };
        shell(self.title, self.version, &content).into_string()
    }
}

/// Returns a figure as an image of its own, with the colours of a light page.
fn drawn(title: &str, svg: &str) -> Markup {
    let source = format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg));
    html! {
        figure {
            figcaption { b { (title) } }
            img src=(source) alt=(title) style="background:#fff;width:100%";
        }
    }
}

fn show(section: &TableSection) -> Markup {
    let (headers, rows) = section.table.rows().split_first().map_or((&[][..], &[][..]), |(h, r)| (h.as_slice(), r));
    let names = headers.iter().position(|header| header == "system");
    html! {
        section id=(section.id) {
            h2 { (section.title) }
            p.about { (section.about) }
            div.scroll {
                table.figures.suite {
                    thead { tr { @for header in headers { th { (header) } } } }
                    tbody {
                        @for (index, row) in rows.iter().enumerate() {
                            @let repeats = index > 0 && rows[index - 1].first() == row.first();
                            @let published = row.last().is_some_and(|cell| cell.starts_with(PUBLISHED));
                            tr.published[published].first[!repeats] {
                                @for (column, cell) in row.iter().enumerate() {
                                    @let is_ours = names == Some(column) && !published;
                                    (cell_of(headers.get(column), is_ours, column == 0 && repeats, cell))
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn cell_of(header: Option<&String>, is_ours: bool, repeats: bool, cell: &str) -> Markup {
    let improves = header.is_some_and(|header| header.starts_with(IMPROVEMENT)) && !cell.is_empty();
    html! {
        @if repeats { th {} }
        @else if is_ours { th style=(format!("color:var({})", Ink::method(cell, 0).variable())) { (cell) } }
        @else if header.is_some_and(|header| header == "sequence" || header == "system") { th { (cell) } }
        @else if header.is_some_and(|header| header == ORIGIN) { td.figures-of { (cell) } }
        @else { td.improve[improves].worse[improves && cell.starts_with('-')] { (cell.replace('-', "−")) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_escapes_texts_and_marks_published_rows() {
        let mut table = Table::new(["sequence", "system", "RMSE", "improvement of RMSE (%)", "figures"]);
        table.push(["a<b", "none", "0.5", "", "measured"]);
        table.push(["a<b", "yf", "0.6", "-20.00", "measured"]);
        table.push(["a<b", "DynaSLAM", "0.1", "", "published: a paper"]);
        let section = TableSection { id: "ate", title: "T".into(), about: String::new(), table };
        let page = TablesPage {
            title: "x & y",
            facts: Vec::new(),
            sections: &[section],
            figures: Vec::new(),
            version: "0",
            command: "yfslam bench".into(),
        };
        let html = page.html();
        assert!(html.contains("x &amp; y") && html.contains("a&lt;b") && !html.contains("a<b"));
        assert_eq!(html.matches("<tr class=\"published\"").count(), 1, "{html}");
        assert!(html.contains("<td class=\"improve worse\">−20.00</td>"), "{html}");
        assert!(!html.contains("src=") && !html.contains("http"), "the page loads nothing");
    }
}
