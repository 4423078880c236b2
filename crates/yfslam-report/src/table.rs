//! In: headers and cells. Out: the table as plain text for a terminal, as Markdown, as LaTeX or as CSV.

/// How a table is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TableStyle {
    /// Columns two spaces apart, a rule under the header.
    #[default]
    Plain,
    /// GitHub Markdown, aligned in its source as well.
    Markdown,
    /// A LaTeX `tabular` that needs no package.
    Latex,
    /// Comma-separated values (RFC 4180): cells with a comma, a quote or a line break are quoted.
    Csv,
}

/// A table; its first column is left-aligned, the others are right-aligned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Creates an empty table with the given column headers.
    pub fn new<S: Into<String>>(headers: impl IntoIterator<Item = S>) -> Self {
        Self { rows: vec![headers.into_iter().map(Into::into).collect()] }
    }

    /// Appends a row; missing cells stay empty.
    pub fn push<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
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
        let line = |row: &Vec<String>| {
            let cells: Vec<_> = (0..columns).map(|c| latex_text(row.get(c).map_or("", String::as_str))).collect();
            cells.join(" & ") + " \\\\\n"
        };
        let mut lines = self.rows.iter().map(line);
        let headers = lines.next().unwrap_or_default();
        let alignment = "l".to_owned() + &"r".repeat(columns.saturating_sub(1));
        let rows: String = lines.collect();
        format!("\\begin{{tabular}}{{{alignment}}}\n\\hline\n{headers}\\hline\n{rows}\\hline\n\\end{{tabular}}\n")
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
        let expected = "\\begin{tabular}{lr}\n\\hline\nsequence & improvement (\\%) \\\\\n\\hline\n\
                        walking\\_xyz & $-$0.5 \\& more \\\\\n\\hline\n\\end{tabular}\n";
        assert_eq!(table.render(TableStyle::Latex), expected);
    }

    #[test]
    fn csv_quotes_what_would_end_a_cell_and_fills_short_rows() {
        let mut table = Table::new(["a", "b"]);
        table.push(["walk, \"fast\"", "1"]);
        table.push(["x"]);
        assert_eq!(table.render(TableStyle::Csv), "a,b\n\"walk, \"\"fast\"\"\",1\nx,\n");
    }
}
