//! The tables of the paper: absolute and relative errors with their improvement (Tables 2 to 4, equation 3), times (Table 5), and the
//! share of frames that were tracked.
//!
//! In: all cells. Out: tables with headings. What papers published stands beside a recorded sequence of the very name, if all of it was run.

use yfslam_eval::{Measure, Statistics, improvement_percent, published};
use yfslam_report::{IMPROVEMENT, ORIGIN, PUBLISHED, Table, TableSection};

use super::cell::Cell;
use super::table::{Row, overview, rows, show};

/// The method that the others are compared with: ORB-SLAM2's place in the paper.
const BASELINE: &str = "none";

/// A table of errors: which they are, and where a cell has them.
struct Errors {
    id: &'static str,
    title: &'static str,
    unit: &'static str,
    measure: Measure,
    rmse: fn(&Cell) -> Option<f64>,
    std: fn(&Cell) -> Option<f64>,
}

const ERRORS: [Errors; 3] = [
    Errors {
        id: "ate",
        title: "Absolute trajectory error (Table 2)",
        unit: "m",
        measure: Measure::Ate,
        rmse: |c| c.ate_rmse_m,
        std: |c| c.ate_std_m,
    },
    Errors {
        id: "rpe_translation",
        title: "Relative pose error per second, translation (Table 3)",
        unit: "m",
        measure: Measure::RpeTranslation,
        rmse: |c| c.rpe_second_m,
        std: |c| c.rpe_second_std_m,
    },
    Errors {
        id: "rpe_rotation",
        title: "Relative pose error per second, rotation (Table 4)",
        unit: "°",
        measure: Measure::RpeRotation,
        rmse: |c| c.rpe_second_deg,
        std: |c| c.rpe_second_std_deg,
    },
];

/// Stages of Table 5 by their name in `run.json`, with their heading.
const STAGES: [(&str, &str); 6] = [
    ("features", "features"),
    ("detector", "detector"),
    ("dynamic_filter", "dynamic filter"),
    ("tracking", "tracking"),
    ("mapping", "mapping, a keyframe"),
    ("frame", "frame as a whole"),
];

/// All tables: the overview first, then those of the paper.
pub fn sections(cells: &[Cell]) -> Vec<TableSection> {
    let rows = rows(cells);
    let about = "Median over the seeds, and the range. Lost frames have no error: read the error with the share of frames tracked.";
    let first = TableSection { id: "overview", title: "Overview".into(), about: about.into(), table: overview(&rows) };
    let errors = ERRORS.iter().map(|errors| errors.section(&rows));
    [first].into_iter().chain(errors).chain([times(&rows), tracked(&rows)]).collect()
}

impl Errors {
    fn section(&self, rows: &[Row]) -> TableSection {
        let Self { id, title, unit, .. } = *self;
        let mut table = Table::new([
            "sequence".to_owned(),
            "system".to_owned(),
            format!("RMSE ({unit})"),
            format!("S.D. ({unit})"),
            "RMSE, min–max".to_owned(),
            format!("{IMPROVEMENT} of RMSE (%)"),
            format!("{IMPROVEMENT} of S.D. (%)"),
            ORIGIN.to_owned(),
        ]);
        for (place, row) in rows.iter().enumerate() {
            table.push(self.measured(row, rows));
            let is_last = rows.get(place + 1).is_none_or(|next| next.sequence != row.sequence);
            if is_last && row.cells.iter().all(|cell| cell.whole) {
                self.push_published(row.sequence, &mut table);
            }
        }
        let about = format!(
            "Medians over the seeds. Improvement on {BASELINE}: (1 − error / error of {BASELINE}) · 100 % (equation 3). Rows marked \
             {PUBLISHED} are figures that papers report for the whole sequence, on other machines."
        );
        TableSection { id, title: title.to_owned(), about, table }
    }

    fn measured(&self, row: &Row, rows: &[Row]) -> [String; 8] {
        let baseline = rows.iter().find(|other| (other.sequence, other.method) == (row.sequence, BASELINE));
        let improvement = |figure: fn(&Cell) -> Option<f64>| {
            let pair = row.median(figure).zip(baseline.and_then(|baseline| baseline.median(figure)));
            let percent = pair.and_then(|(ours, original)| improvement_percent(ours, original));
            percent.filter(|_| row.method != BASELINE).map_or(String::new(), |percent| format!("{percent:.2}"))
        };
        let range = |s: Statistics| format!("{:.4}–{:.4}", s.min, s.max);
        let runs = row.cells.len() - row.failures();
        [
            row.sequence.to_owned(),
            row.method.to_owned(),
            show(row.median(self.rmse)),
            show(row.median(self.std)),
            row.over(self.rmse).map_or("-".to_owned(), range),
            improvement(self.rmse),
            improvement(self.std),
            format!("measured, {runs} of {} runs", row.cells.len()),
        ]
    }

    fn push_published(&self, sequence: &str, table: &mut Table) {
        for figure in published(sequence, self.measure) {
            let std = figure.std.map_or(String::new(), |std| std.to_string());
            let none = String::new;
            let source = format!("{PUBLISHED}: {}", figure.source);
            let system = figure.system.to_owned();
            table.push([sequence.to_owned(), system, figure.rmse.to_string(), std, none(), none(), none(), source]);
        }
    }
}

/// Methods in the order in which they come up.
fn methods<'a>(rows: &[Row<'a>]) -> Vec<&'a str> {
    let mut methods = Vec::new();
    for row in rows {
        if !methods.contains(&row.method) {
            methods.push(row.method);
        }
    }
    methods
}

/// Time per stage, over all sequences.
fn times(rows: &[Row]) -> TableSection {
    let mut headers = vec!["system".to_owned()];
    headers.extend(STAGES.iter().map(|(_, heading)| format!("{heading} (ms)")));
    headers.push("processor time, a frame (ms)".to_owned());
    let mut table = Table::new(headers);
    for method in methods(rows) {
        let cells = || rows.iter().filter(|row| row.method == method).flat_map(|row| &row.cells);
        let median = |figure: &dyn Fn(&Cell) -> Option<f64>| {
            let figures: Vec<f64> = cells().filter_map(|cell| figure(cell)).collect();
            Statistics::of(&figures).map_or("-".to_owned(), |s| format!("{:.2}", s.median))
        };
        let mut line = vec![method.to_owned()];
        line.extend(STAGES.iter().map(|(name, _)| median(&|cell| cell.stages_ms.get(*name).copied())));
        line.push(median(&|cell| cell.process_ms_per_frame));
        table.push(line);
    }
    let about = "Wall time on this machine: medians of the runs' medians, over all sequences and seeds. Methods run side by side, a thread \
                 each, so give --jobs 1 and one method for times without that load. The detector runs once for all, beside or before the \
                 other stages; the frame as a whole leaves out reading and rendering. Processor time counts all threads.";
    TableSection { id: "time", title: "Time of each stage (Table 5)".into(), about: about.into(), table }
}

/// Share of frames tracked, a method a column.
fn tracked(rows: &[Row]) -> TableSection {
    let methods = methods(rows);
    let mut table = Table::new(["sequence"].iter().chain(&methods).copied());
    let mut line: Vec<String> = Vec::new();
    for (place, row) in rows.iter().enumerate() {
        if line.is_empty() {
            line = vec![row.sequence.to_owned()];
            line.resize(methods.len() + 1, String::new());
        }
        if let Some(cell) = methods.iter().position(|method| *method == row.method).and_then(|m| line.get_mut(m + 1)) {
            let share = row.over(|c| c.tracked);
            *cell = share.map_or("-".into(), |s| format!("{:.1} ({:.1})", 100.0 * s.median, 100.0 * s.min));
        }
        if rows.get(place + 1).is_none_or(|next| next.sequence != row.sequence) {
            table.push(std::mem::take(&mut line));
        }
    }
    let about = "Frames whose pose is known, % of all with a true pose: median over the seeds, and the least.";
    TableSection { id: "tracked", title: "Frames tracked".into(), about: about.into(), table }
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::cell;
    use super::*;

    const KNOWN: &str = "rgbd_dataset_freiburg3_walking_xyz";

    fn table_of<'a>(sections: &'a [TableSection], id: &str) -> &'a [Vec<String>] {
        sections.iter().find(|section| section.id == id).unwrap().table.rows()
    }

    #[test]
    fn improvement_is_equation_3_on_medians_and_published_figures_follow_the_sequence_of_their_name() {
        let mut cells = vec![
            cell(KNOWN, "none", 1, Some(0.8)),
            cell(KNOWN, "none", 2, Some(0.6)),
            cell(KNOWN, "yf", 1, Some(0.07)),
            cell("walking_xyz", "none", 1, Some(0.5)),
        ];
        let sections = sections(&cells);
        let ate = table_of(&sections, "ate");
        assert_eq!(ate[1][1..], ["none", "0.7000", "0.3500", "0.6000–0.8000", "", "", "measured, 2 of 2 runs"]);
        assert_eq!(ate[2][1..7], ["yf", "0.0700", "0.0350", "0.0700–0.0700", "90.00", "90.00"]);
        let quoted: Vec<_> = ate.iter().filter(|row| row[7].starts_with(PUBLISHED)).collect();
        assert!(quoted.iter().all(|row| row[0] == KNOWN) && quoted.len() == 7, "{quoted:?}");
        assert!(quoted.iter().any(|row| row[1] == "ORB-SLAM2" && row[2] == "0.7214" && row[3] == "0.256"));
        assert_eq!(ate.len(), 11);
        let time = table_of(&sections, "time");
        assert_eq!(time[1], ["none", "-", "7.00", "-", "-", "-", "12.50", "20.00"]);
        assert_eq!(table_of(&sections, "tracked")[1], [KNOWN, "50.0 (50.0)", "50.0 (50.0)"]);
        // A part of the sequence is not what was published about.
        cells.iter_mut().for_each(|cell| cell.whole = false);
        let sections = super::sections(&cells);
        assert!(table_of(&sections, "ate").iter().all(|row| !row[7].starts_with(PUBLISHED)));
    }
}
