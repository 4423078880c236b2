//! Cells as tables: Markdown with medians over the seeds, CSV with every cell.

use std::fmt::Write;

use yfslam_eval::{Statistics, Table, TableStyle};

use super::Cell;

/// One row for each sequence and method, in the order of the cells.
pub fn markdown(cells: &[Cell]) -> String {
    let mut table = Table::new([
        "sequence",
        "method",
        "ATE RMSE median (min–max), m",
        "tracked median (least), %",
        "RPE per frame, m",
        "RPE per second, m",
        "runs",
        "failed",
    ]);
    let mut rows: Vec<(&str, &str)> = Vec::new();
    for cell in cells {
        let row = (cell.sequence.as_str(), cell.method.as_str());
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    for (sequence, method) in rows {
        let runs: Vec<&Cell> =
            cells.iter().filter(|c| (c.sequence.as_str(), c.method.as_str()) == (sequence, method)).collect();
        let over = |figure: fn(&Cell) -> Option<f64>| {
            Statistics::of(&runs.iter().filter_map(|cell| figure(cell)).collect::<Vec<_>>())
        };
        let median = |figure| over(figure).map_or("-".to_owned(), |s| format!("{:.4}", s.median));
        table.push([
            sequence.to_owned(),
            method.to_owned(),
            over(|c| c.ate_rmse_m).map_or("-".into(), |s| format!("{:.4} ({:.4}–{:.4})", s.median, s.min, s.max)),
            over(|c| c.tracked).map_or("-".into(), |s| format!("{:.1} ({:.1})", 100.0 * s.median, 100.0 * s.min)),
            median(|c| c.rpe_frame_m),
            median(|c| c.rpe_second_m),
            runs.len().to_string(),
            runs.iter().filter(|cell| cell.failure.is_some()).count().to_string(),
        ]);
    }
    table.render(TableStyle::Markdown)
}

/// One line for each cell; a figure that is not known is empty.
pub fn csv(cells: &[Cell]) -> String {
    let mut text =
        "sequence,method,seed,ate_rmse_m,tracked,rpe_frame_m,rpe_second_m,cpu_ms_per_frame,failure\n".to_owned();
    for cell in cells {
        let figures = [cell.ate_rmse_m, cell.tracked, cell.rpe_frame_m, cell.rpe_second_m, cell.cpu_ms_per_frame];
        let figures = figures.map(|figure| figure.map_or(String::new(), |value| value.to_string())).join(",");
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let failure = cell.failure.as_deref().map_or(String::new(), quoted);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{},{},{},{figures},{failure}", quoted(&cell.sequence), cell.method, cell.seed);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(method: &str, seed: u64, ate: Option<f64>) -> Cell {
        Cell {
            sequence: "walk, \"fast\"".into(),
            method: method.into(),
            seed,
            ate_rmse_m: ate,
            tracked: ate.map(|_| 0.5),
            rpe_frame_m: ate,
            rpe_second_m: None,
            cpu_ms_per_frame: Some(20.0),
            failure: ate.is_none().then(|| "no trajectory".into()),
            arguments: vec![],
            program_crc32: String::new(),
        }
    }

    #[test]
    fn rows_are_medians_over_seeds_and_failures_are_counted() {
        let cells =
            [cell("none", 1, Some(0.5)), cell("yf", 1, Some(0.03)), cell("yf", 2, Some(0.01)), cell("yf", 3, None)];
        let table = markdown(&cells);
        let row: Vec<&str> = table.lines().nth(3).unwrap().split('|').map(str::trim).collect();
        assert_eq!(row[2..9], ["yf", "0.0200 (0.0100–0.0300)", "50.0 (50.0)", "0.0200", "-", "3", "1"]);
        let text = csv(&cells);
        assert_eq!(text.lines().nth(1).unwrap(), "\"walk, \"\"fast\"\"\",none,1,0.5,0.5,0.5,,20,");
        assert!(text.lines().nth(4).unwrap().ends_with(",\"no trajectory\""));
    }
}
