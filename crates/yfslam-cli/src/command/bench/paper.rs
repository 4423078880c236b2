//! The tables of the paper: absolute and relative errors with their improvement (Tables 2 to 4, equation 3), times (Table 5), and the
//! share of frames that were tracked.
//!
//! In: all cells. Out: tables with headings. Results from papers are added to a recorded sequence of the same name, if it was run as a whole.

use yfslam_eval::{Measure, Statistics, improvement_percent, published};
use yfslam_report::{IMPROVEMENT, ORIGIN, PUBLISHED, Table, TableSection};

use super::cell::Cell;
use super::table::{Row, overview, paired_table, rows, show};

/// The method with which the others are compared; it corresponds to ORB-SLAM2 in the paper.
const BASELINE: &str = "none";

/// A table of errors, and the figures of a cell that it shows.
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

/// Stages of Table 5: name in `run.json`, and heading.
const STAGES: [(&str, &str); 6] = [
    ("features", "features"),
    ("detector", "detector"),
    ("dynamic_filter", "dynamic filter"),
    ("tracking", "tracking"),
    ("mapping", "mapping, per keyframe"),
    ("frame", "whole frame"),
];

/// Returns all tables: the overview first, then those of the paper.
pub fn sections(cells: &[Cell]) -> Vec<TableSection> {
    let rows = rows(cells);
    let about = "Median over the seeds, and the range. Lost frames have no error, so that an error is meaningful only together with the share of tracked frames.";
    let first = TableSection { id: "overview", title: "Overview".into(), about: about.into(), table: overview(&rows) };
    let errors = ERRORS.iter().map(|errors| errors.section(&rows));
    [first].into_iter().chain(errors).chain([compared(&rows), times(&rows), tracked(&rows)]).collect()
}

/// Returns the systems in pairs.
fn compared(rows: &[Row]) -> TableSection {
    let about = "Absolute trajectory errors of two systems on the same sequences and seeds. p is the probability of a difference at least as \
                 clear if both were equally good: the signed-rank test of Wilcoxon, two-sided, exact up to 50 pairs. With n pairs it is \
                 never below 2 / 2ⁿ: five pairs cannot reach 0.05.";
    TableSection { id: "paired", title: "Systems in pairs".into(), about: about.into(), table: paired_table(rows) }
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
        table.mark_smallest(2);
        table.mark_smallest(3);
        let about = format!(
            "Medians over the seeds. Improvement on {BASELINE}: (1 − error / error of {BASELINE}) · 100 % (equation 3). Rows marked \
             {PUBLISHED} are results that papers report for the whole sequence, measured on other machines."
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
        // The name follows those of parent folders, where several recordings have the same name.
        let name = sequence.rsplit('/').next().unwrap_or(sequence);
        for figure in published(name, self.measure) {
            let std = figure.std.map_or(String::new(), |std| std.to_string());
            let none = String::new;
            let source = format!("{PUBLISHED}: {}", figure.source);
            let system = figure.system.to_owned();
            table.push([sequence.to_owned(), system, figure.rmse.to_string(), std, none(), none(), none(), source]);
        }
    }
}

/// Returns the methods in the order of the rows.
fn methods<'a>(rows: &[Row<'a>]) -> Vec<&'a str> {
    let mut methods = Vec::new();
    for row in rows {
        if !methods.contains(&row.method) {
            methods.push(row.method);
        }
    }
    methods
}

/// Returns the times of the stages over all sequences.
fn times(rows: &[Row]) -> TableSection {
    let mut headers = vec!["system".to_owned()];
    headers.extend(STAGES.iter().map(|(_, heading)| format!("{heading} (ms)")));
    headers.push("processor time per frame (ms)".to_owned());
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
    let about = "Wall time on this machine: median over all sequences and seeds of the median of a run. Methods run at the same time, one \
                 thread each; use --jobs 1 and one method for times without that load. The detector runs once for all methods; the whole \
                 frame does not include reading and rendering. Processor time is that of the whole process, including reading and \
                 detection, without the parts of other methods.";
    TableSection { id: "time", title: "Time of each stage (Table 5)".into(), about: about.into(), table }
}

/// Returns the share of tracked frames, with one column for each method.
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
    let about = "Tracked frames, % of the frames with a true pose: median over the seeds, and minimum.";
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
    fn improvement_is_equation_3_on_medians_and_published_results_follow_their_sequence() {
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
        // Published results hold for the whole sequence only.
        cells.iter_mut().for_each(|cell| cell.whole = false);
        let sections = super::sections(&cells);
        assert!(table_of(&sections, "ate").iter().all(|row| !row[7].starts_with(PUBLISHED)));
    }
}
