//! In: tables with their titles. Out: one HTML page of them that needs nothing but itself, in the style of a run's report.

use maud::{Markup, html};

use super::page::shell;
use crate::figures::ink::Ink;
use crate::table::Table;

/// Word with which the last cell of a row begins whose figures were taken from a paper.
pub const PUBLISHED: &str = "published";
/// Header of the column that says where figures come from.
pub const ORIGIN: &str = "figures";
/// Header that begins the name of a column of improvements.
pub const IMPROVEMENT: &str = "improvement";

/// Tables on a page.
#[derive(Clone, Debug)]
pub struct TablesPage<'a> {
    /// What all of it is about.
    pub title: &'a str,
    /// What there is to know of it, as name and value.
    pub facts: Vec<(&'a str, String)>,
    /// The tables, in order.
    pub sections: &'a [TableSection],
    /// Version of the program.
    pub version: &'a str,
    /// The command that gives this page again.
    pub command: String,
}

/// A table with its heading.
#[derive(Clone, Debug)]
pub struct TableSection {
    /// Short name, for files and links.
    pub id: &'static str,
    /// The heading.
    pub title: String,
    /// What the figures are, in a sentence or two.
    pub about: String,
    /// Its rows; a row that ends in a cell with [`PUBLISHED`] stands back.
    pub table: Table,
}

impl TablesPage<'_> {
    /// The page.
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
            section #setup { h2 { "Repeat it" } pre.command { (self.command) } }
        };
        shell(self.title, self.version, &content).into_string()
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
    fn a_page_escapes_its_texts_and_tells_published_rows_from_measured_ones() {
        let mut table = Table::new(["sequence", "system", "RMSE", "improvement of RMSE (%)", "figures"]);
        table.push(["a<b", "none", "0.5", "", "measured"]);
        table.push(["a<b", "yf", "0.6", "-20.00", "measured"]);
        table.push(["a<b", "DynaSLAM", "0.1", "", "published: a paper"]);
        let section = TableSection { id: "ate", title: "T".into(), about: String::new(), table };
        let page = TablesPage {
            title: "x & y",
            facts: Vec::new(),
            sections: &[section],
            version: "0",
            command: "yfslam bench".into(),
        };
        let html = page.html();
        assert!(html.contains("x &amp; y") && html.contains("a&lt;b") && !html.contains("a<b"));
        assert_eq!(html.matches("<tr class=\"published\"").count(), 1, "{html}");
        assert!(html.contains("<td class=\"improve worse\">−20.00</td>"), "{html}");
        assert!(!html.contains("src=") && !html.contains("http"), "it needs nothing but itself");
    }
}
