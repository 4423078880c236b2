//! The overview of all cells, with medians over the seeds, and CSV with every cell.

use std::fmt::Write;

use yfslam_eval::Statistics;
use yfslam_report::Table;

use super::cell::Cell;

/// The cells of one sequence and one method, one for each seed.
pub struct Row<'a> {
    pub sequence: &'a str,
    pub method: &'a str,
    pub cells: Vec<&'a Cell>,
}

/// Groups the cells by sequence and method, in their order.
pub fn rows(cells: &[Cell]) -> Vec<Row<'_>> {
    let mut rows: Vec<Row> = Vec::new();
    for cell in cells {
        match rows.iter_mut().find(|row| (row.sequence, row.method) == (&*cell.sequence, &*cell.method)) {
            Some(row) => row.cells.push(cell),
            None => rows.push(Row { sequence: &cell.sequence, method: &cell.method, cells: vec![cell] }),
        }
    }
    rows
}

impl Row<'_> {
    /// Returns statistics of a figure over the seeds; `None` if no run has it.
    pub fn over(&self, figure: impl Fn(&Cell) -> Option<f64>) -> Option<Statistics> {
        Statistics::of(&self.cells.iter().filter_map(|cell| figure(cell)).collect::<Vec<_>>())
    }

    /// Returns the median of a figure over the seeds.
    pub fn median(&self, figure: impl Fn(&Cell) -> Option<f64>) -> Option<f64> {
        self.over(figure).map(|s| s.median)
    }

    /// Returns the number of runs without results.
    pub fn failures(&self) -> usize {
        self.cells.iter().filter(|cell| cell.failure.is_some()).count()
    }
}

/// Formats a figure with four decimals, or as a dash.
pub fn show(figure: Option<f64>) -> String {
    figure.map_or("-".to_owned(), |value| format!("{value:.4}"))
}

/// Returns the table of the main results of each sequence and method.
pub fn overview(rows: &[Row]) -> Table {
    let mut table = Table::new([
        "sequence",
        "system",
        "ATE RMSE median (min–max), m",
        "tracked median (least), %",
        "RPE per frame, m",
        "RPE per second, m",
        "runs",
        "failed",
    ]);
    for row in rows {
        let ate = row.over(|c| c.ate_rmse_m);
        let tracked = row.over(|c| c.tracked);
        table.push([
            row.sequence.to_owned(),
            row.method.to_owned(),
            ate.map_or("-".into(), |s| format!("{:.4} ({:.4}–{:.4})", s.median, s.min, s.max)),
            tracked.map_or("-".into(), |s| format!("{:.1} ({:.1})", 100.0 * s.median, 100.0 * s.min)),
            show(row.median(|c| c.rpe_frame_m)),
            show(row.median(|c| c.rpe_second_m)),
            row.cells.len().to_string(),
            row.failures().to_string(),
        ]);
    }
    table
}

/// Returns one line for each cell; unknown figures are empty.
pub fn csv(cells: &[Cell]) -> String {
    let mut text =
        "sequence,method,seed,ate_rmse_m,ate_std_m,tracked,rpe_frame_m,rpe_second_m,rpe_second_std_m,rpe_second_deg,\
                    rpe_second_std_deg,process_ms_per_frame,failure\n"
            .to_owned();
    for cell in cells {
        let figures = [
            cell.ate_rmse_m,
            cell.ate_std_m,
            cell.tracked,
            cell.rpe_frame_m,
            cell.rpe_second_m,
            cell.rpe_second_std_m,
            cell.rpe_second_deg,
            cell.rpe_second_std_deg,
            cell.process_ms_per_frame,
        ];
        let figures = figures.map(|figure| figure.map_or(String::new(), |value| value.to_string())).join(",");
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let failure = cell.failure.as_deref().map_or(String::new(), quoted);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{},{},{},{figures},{failure}", quoted(&cell.sequence), cell.method, cell.seed);
    }
    text
}

#[cfg(test)]
pub mod tests {
    use yfslam_report::TableStyle;

    use super::*;

    /// A cell for tests; most figures have the same value.
    pub fn cell(sequence: &str, method: &str, seed: u64, ate: Option<f64>) -> Cell {
        Cell {
            sequence: sequence.into(),
            method: method.into(),
            seed,
            ate_rmse_m: ate,
            ate_std_m: ate.map(|v| v / 2.0),
            tracked: ate.map(|_| 0.5),
            rpe_frame_m: ate,
            rpe_second_m: None,
            rpe_second_std_m: None,
            rpe_second_deg: ate,
            rpe_second_std_deg: ate,
            stages_ms: [("frame".to_owned(), 12.5), ("detector".to_owned(), 7.0)].into(),
            process_ms_per_frame: Some(20.0),
            whole: true,
            failure: ate.is_none().then(|| "no trajectory".into()),
            arguments: vec![],
            program_crc32: String::new(),
        }
    }

    const NAME: &str = "walk, \"fast\"";

    #[test]
    fn rows_are_medians_over_seeds_and_failures_are_counted() {
        let cells = [
            cell(NAME, "none", 1, Some(0.5)),
            cell(NAME, "yf", 1, Some(0.03)),
            cell(NAME, "yf", 2, Some(0.01)),
            cell(NAME, "yf", 3, None),
        ];
        let table = overview(&rows(&cells)).render(TableStyle::Markdown);
        let row: Vec<&str> = table.lines().nth(3).unwrap().split('|').map(str::trim).collect();
        assert_eq!(row[2..9], ["yf", "0.0200 (0.0100–0.0300)", "50.0 (50.0)", "0.0200", "-", "3", "1"]);
    }

    #[test]
    fn csv_quotes_names_and_leaves_unknown_figures_empty() {
        let text = csv(&[cell(NAME, "yf", 3, None), cell(NAME, "yf", 1, Some(0.25))]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1], "\"walk, \"\"fast\"\"\",yf,3,,,,,,,,,20,\"no trajectory\"");
        assert_eq!(lines[2], "\"walk, \"\"fast\"\"\",yf,1,0.25,0.125,0.5,0.25,,,0.25,0.25,20,");
    }
}
