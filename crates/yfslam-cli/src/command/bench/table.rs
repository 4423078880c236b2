//! The overview of all cells, with medians over the seeds, and CSV with every cell.

use std::fmt::Write;

use yfslam_eval::{Paired, Statistics, paired};
use yfslam_report::{Table, TableStyle};

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

/// A figure of a cell, if it is known.
type Figure = fn(&Cell) -> Option<f64>;

/// Returns one line for each sequence and method, with one number in each cell; unknown figures are empty.
pub fn summary_csv(cells: &[Cell]) -> String {
    let figures: [(&str, Figure); 5] = [
        ("ate_rmse_m", |c| c.ate_rmse_m),
        ("tracked", |c| c.tracked),
        ("rpe_frame_m", |c| c.rpe_frame_m),
        ("rpe_second_m", |c| c.rpe_second_m),
        ("rpe_second_deg", |c| c.rpe_second_deg),
    ];
    let of_each = ["median", "mean", "std", "min", "max"];
    let mut headers = vec!["sequence".to_owned(), "method".into(), "runs".into(), "failed".into()];
    headers.extend(figures.iter().flat_map(|(name, _)| of_each.map(|statistic| format!("{name}_{statistic}"))));
    let mut table = Table::new(headers);
    for row in rows(cells) {
        let mut line = vec![
            row.sequence.to_owned(),
            row.method.to_owned(),
            row.cells.len().to_string(),
            row.failures().to_string(),
        ];
        for (_, figure) in figures {
            let statistics = row.over(figure);
            let values = statistics.map(|s| [s.median, s.mean, s.std, s.min, s.max]);
            line.extend(values.map_or_else(|| of_each.map(|_| String::new()), |values| values.map(|v| v.to_string())));
        }
        table.push(line);
    }
    table.render(TableStyle::Csv)
}

/// Returns the systems in pairs, compared on the runs that both have.
pub fn paired_table(rows: &[Row]) -> Table {
    let mut methods: Vec<&str> = Vec::new();
    for row in rows {
        if !methods.contains(&row.method) {
            methods.push(row.method);
        }
    }
    let mut table = Table::new([
        "first system",
        "second system",
        "pairs of runs",
        "first better",
        "second better",
        "ATE first / second, median",
        "p (Wilcoxon)",
    ]);
    for (index, second) in methods.iter().enumerate() {
        for first in methods.iter().skip(index + 1) {
            let Some(result) = paired(&pairs(rows, first, second)) else { continue };
            let Paired { pairs, wins, losses, median_ratio, p } = result;
            let counts = [pairs, wins, losses].map(|count| count.to_string());
            let ratio = median_ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.3}"));
            table.push(
                [(*first).to_owned(), (*second).to_owned()].into_iter().chain(counts).chain([ratio, format!("{p:.4}")]),
            );
        }
    }
    table
}

/// Returns the errors of two systems on the same sequences and seeds.
fn pairs(rows: &[Row], first: &str, second: &str) -> Vec<(f64, f64)> {
    let of = |method: &str| {
        rows.iter().filter(|row| row.method == method).flat_map(|row| &row.cells).copied().collect::<Vec<&Cell>>()
    };
    let others = of(second);
    let pair = |cell: &&Cell| {
        let other = others.iter().find(|other| (&other.sequence, other.seed) == (&cell.sequence, cell.seed))?;
        cell.ate_rmse_m.zip(other.ate_rmse_m)
    };
    of(first).iter().filter_map(pair).collect()
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
        let plain = |text: &str| if text.contains([',', '"']) { quoted(text) } else { text.to_owned() };
        let failure = cell.failure.as_deref().map_or(String::new(), quoted);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{},{},{},{figures},{failure}", quoted(&cell.sequence), plain(&cell.method), cell.seed);
    }
    text
}

#[cfg(test)]
pub mod tests {
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

    #[test]
    fn pairs_are_of_the_same_sequence_and_seed_and_a_summary_has_one_number_a_cell() {
        let mut cells = Vec::new();
        for seed in 1..=4 {
            cells.push(cell("a", "none", seed, Some(0.2 + 0.01 * seed as f64)));
            cells.push(cell("a", "yf", seed, Some(0.1)));
        }
        cells.push(cell("a", "ORB", 1, Some(0.3)));
        let rows = rows(&cells);
        let table = paired_table(&rows);
        let found: Vec<Vec<&str>> =
            table.rows().iter().skip(1).map(|row| row.iter().map(String::as_str).collect()).collect();
        assert_eq!(found[0], ["yf", "none", "4", "4", "0", "0.445", "0.1250"]);
        assert_eq!(found[1][..5], ["ORB", "none", "1", "0", "1"]);
        let text = summary_csv(&cells);
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].starts_with("sequence,method,runs,failed,ate_rmse_m_median,ate_rmse_m_mean"));
        assert!(lines[3].starts_with("a,ORB,1,0,0.3,0.3,0,0.3,0.3,") && lines.len() == 4, "{text}");
    }
}
