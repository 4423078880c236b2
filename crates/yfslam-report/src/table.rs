//! In: headers and cells. Out: the table as plain text for a terminal, as Markdown, as LaTeX or as CSV.

use std::collections::BTreeSet;

/// How a table is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TableStyle {
    /// Columns two spaces apart, a rule under the header.
    #[default]
    Plain,
    /// GitHub Markdown, aligned in its source as well.
    Markdown,
    /// A LaTeX `tabular` with the rules of the package `booktabs`; the best figures are bold.
    Latex,
    /// Comma-separated values (RFC 4180): cells with a comma, a quote or a line break are quoted.
    Csv,
}

/// A table; its first column is left-aligned, the others are right-aligned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    rows: Vec<Vec<String>>,
    /// Row and column of cells that are bold in LaTeX.
    bold: BTreeSet<(usize, usize)>,
}

impl Table {
    /// Creates an empty table with the given column headers.
    pub fn new<S: Into<String>>(headers: impl IntoIterator<Item = S>) -> Self {
        Self { rows: vec![headers.into_iter().map(Into::into).collect()], bold: BTreeSet::new() }
    }

    /// Appends a row; missing cells stay empty.
    pub fn push<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// Marks the smallest figures of a column as the best ones, among rows with the same first cell.
    pub fn mark_smallest(&mut self, column: usize) {
        let figure = |row: &Vec<String>| row.get(column).and_then(|cell| cell.parse::<f64>().ok());
        let best_of = |name: Option<&String>| {
            let same = self.rows.iter().skip(1).filter(|row| row.first() == name);
            same.filter_map(figure).fold(f64::INFINITY, f64::min)
        };
        let is_best = |row: &Vec<String>| figure(row).is_some_and(|value| value <= best_of(row.first()));
        let best: Vec<usize> = (1..self.rows.len()).filter(|at| self.rows.get(*at).is_some_and(is_best)).collect();
        self.bold.extend(best.into_iter().map(|row| (row, column)));
    }

    /// Returns the headers, then the rows.
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
    }

    /// Returns the table as text; each line ends with a newline and without trailing spaces.
    pub fn render(&self, style: TableStyle) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        if style == TableStyle::Csv {
            let line = |row: &Vec<String>| {
                (0..columns).map(|c| quoted(row.get(c).map_or("", String::as_str))).collect::<Vec<_>>().join(",") + "\n"
            };
            return self.rows.iter().map(line).collect();
        }
        if style == TableStyle::Latex {
            return self.latex(columns);
        }
        let cell = |row: &[String], column: usize| match row.get(column) {
            // A bar would end the Markdown cell.
            Some(text) if style == TableStyle::Markdown => text.replace('|', "\\|"),
            Some(text) => text.clone(),
            None => String::new(),
        };
        let width = |column| self.rows.iter().map(|r| cell(r, column).chars().count()).max().unwrap_or(0);
        // Three is the shortest rule that every Markdown reader takes.
        let widths: Vec<usize> = (0..columns).map(|c| width(c).max(3)).collect();

        let line = |cells: Vec<String>| match style {
            TableStyle::Markdown => format!("| {} |\n", cells.join(" | ")),
            _ => format!("{}\n", cells.join("  ").trim_end()),
        };
        let rule = |(column, &width): (usize, &usize)| match style {
            TableStyle::Markdown if column > 0 => format!("{}:", "-".repeat(width - 1)),
            _ => "-".repeat(width),
        };
        let mut text = String::new();
        for (index, row) in self.rows.iter().enumerate() {
            let pad = |(column, &width): (usize, &usize)| match column {
                0 => format!("{:<width$}", cell(row, column)),
                _ => format!("{:>width$}", cell(row, column)),
            };
            text += &line(widths.iter().enumerate().map(pad).collect());
            if index == 0 {
                text += &line(widths.iter().enumerate().map(rule).collect());
            }
        }
        text
    }

    fn latex(&self, columns: usize) -> String {
        let line = |(index, row): (usize, &Vec<String>)| {
            let cell = |column: usize| {
                let text = latex_text(row.get(column).map_or("", String::as_str));
                if self.bold.contains(&(index, column)) { format!("\\textbf{{{text}}}") } else { text }
            };
            (0..columns).map(cell).collect::<Vec<_>>().join(" & ") + " \\\\\n"
        };
        let mut lines = self.rows.iter().enumerate().map(line);
        let headers = lines.next().unwrap_or_default();
        let alignment = "l".to_owned() + &"r".repeat(columns.saturating_sub(1));
        let rows: String = lines.collect();
        format!(
            "% \\usepackage{{booktabs}}\n\\begin{{tabular}}{{{alignment}}}\n\\toprule\n{headers}\\midrule\n{rows}\\bottomrule\n\\end{{tabular}}\n"
        )
    }
}

/// Replaces the characters that LaTeX would interpret.
fn latex_text(cell: &str) -> String {
    let mut text = String::new();
    for c in cell.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => text.extend(['\\', c]),
            '\\' => text += "\\textbackslash{}",
            '~' => text += "\\textasciitilde{}",
            '^' => text += "\\textasciicircum{}",
            '°' => text += "$^\\circ$",
            '−' => text += "$-$",
            '–' => text += "--",
            c => text.push(c),
        }
    }
    text
}

/// Quotes a cell for CSV.
fn quoted(cell: &str) -> String {
    if cell.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Table {
        let mut table = Table::new(["sequence", "RMSE", "n"]);
        table.push(["crowd|1", "0.0156", "1200"]);
        table.push(["größer", "12.0"]);
        table
    }

    #[test]
    fn plain_columns_line_up() {
        let expected = "sequence    RMSE     n\n--------  ------  ----\ncrowd|1   0.0156  1200\ngrößer      12.0\n";
        assert_eq!(example().render(TableStyle::Plain), expected);
    }

    #[test]
    fn markdown_aligns_figures_right_and_escapes_bars() {
        let expected = "| sequence |   RMSE |    n |\n| -------- | -----: | ---: |\n| crowd\\|1 | 0.0156 | 1200 |\n\
                        | größer   |   12.0 |      |\n";
        assert_eq!(example().render(TableStyle::Markdown), expected);
    }

    #[test]
    fn latex_escapes_what_it_would_interpret() {
        let mut table = Table::new(["sequence", "improvement (%)"]);
        table.push(["walking_xyz", "−0.5 & more"]);
        let expected = "% \\usepackage{booktabs}\n\\begin{tabular}{lr}\n\\toprule\nsequence & improvement (\\%) \\\\\n\\midrule\n\
                        walking\\_xyz & $-$0.5 \\& more \\\\\n\\bottomrule\n\\end{tabular}\n";
        assert_eq!(table.render(TableStyle::Latex), expected);
    }

    #[test]
    fn the_best_figures_of_each_sequence_are_bold_in_latex() {
        let mut table = Table::new(["sequence", "system", "RMSE"]);
        for row in [["a", "x", "0.2"], ["a", "y", "0.1"], ["a", "z", "-"], ["b", "x", "0.4"], ["b", "y", "0.5"]] {
            table.push(row);
        }
        table.mark_smallest(2);
        let latex = table.render(TableStyle::Latex);
        let bold: Vec<&str> = latex.lines().filter(|line| line.contains("textbf")).collect();
        assert_eq!(bold, ["a & y & \\textbf{0.1} \\\\", "b & x & \\textbf{0.4} \\\\"]);
    }

    #[test]
    fn csv_quotes_what_would_end_a_cell_and_fills_short_rows() {
        let mut table = Table::new(["a", "b"]);
        table.push(["walk, \"fast\"", "1"]);
        table.push(["x"]);
        assert_eq!(table.render(TableStyle::Csv), "a,b\n\"walk, \"\"fast\"\"\",1\nx,\n");
    }
}
