//! In: errors and times of all methods. Out: their tables, with one column for each method.

use maud::{Markup, html};

use crate::content::{MethodReport, ProcessorTime, Report, Stage};
use crate::figures::ink::Ink;
use yfslam_eval::{Delta, Evaluation, Rpe, Statistics, improvement_percent};

/// Returns a figure of the errors of a method.
type Find = Box<dyn Fn(&Evaluation) -> Option<f64>>;

/// A row of the table of errors: name, name of the figure in `run.json`, and how to get it.
struct Row {
    name: String,
    key: String,
    of: Find,
}

/// Returns errors and improvement (paper Tables 2 to 4, equation 3); with a single method, absolute and relative errors are side by side.
pub fn errors(report: &Report) -> Markup {
    let rows = rows(report);
    let absolute = rows.iter().filter(|row| row.key.starts_with("ate")).count();
    match (report.methods.as_slice(), rows.split_at(absolute)) {
        ([_], (absolute, relative)) => html! { (table(report, absolute, true)) (table(report, relative, false)) },
        _ => table(report, &rows, true),
    }
}

fn table(report: &Report, rows: &[Row], with_tracked: bool) -> Markup {
    let others = report.methods.get(1..).unwrap_or_default();
    let baseline = report.methods.first();
    html! {
        div.scroll {
            table.figures {
                thead {
                    @if let (Some(first), false) = (baseline, others.is_empty()) {
                        tr.groups {
                            th {}
                            th colspan=(report.methods.len()) {}
                            th.improve colspan=(others.len()) { "improvement (%) on " (first.name) }
                        }
                    }
                    tr {
                        th {}
                        @for (index, method) in report.methods.iter().enumerate() { (method_heading(method, index)) }
                        @for (index, method) in others.iter().enumerate() { (method_heading(method, index + 1)) }
                    }
                }
                tbody {
                    @for row in rows {
                        tr {
                            th { (row.name) }
                            @for method in &report.methods {
                                td data-key=(format!("{}.{}", method.name, row.key)) {
                                    (method.evaluation.and_then(&row.of).map_or("–".to_owned(), |v| format!("{v:.4}")))
                                }
                            }
                            @for method in others { (improvement(baseline, method, row)) }
                        }
                    }
                    @if with_tracked {
                      tr {
                        th { "Frames tracked (%)" }
                        @for method in &report.methods {
                            td data-key=(format!("{}.tracked_percent", method.name)) {
                                (format!("{:.1}", method.frames.tracked_percent()))
                            }
                        }
                        @for _ in others { td {} }
                      }
                    }
                }
            }
        }
    }
}

/// Returns the heading of a column in the colour of its method.
fn method_heading(method: &MethodReport, index: usize) -> Markup {
    html! { th style=(format!("color:var({})", Ink::method(method.name, index).variable())) { (method.name) } }
}

fn improvement(baseline: Option<&MethodReport>, method: &MethodReport, row: &Row) -> Markup {
    let value = |m: &MethodReport| m.evaluation.and_then(&row.of);
    let percent = match (value(method), baseline.and_then(value)) {
        (Some(ours), Some(original)) => improvement_percent(ours, original),
        _ => None,
    };
    html! {
        td.improve.worse[percent.is_some_and(|p| p < 0.0)] {
            (percent.map_or("–".to_owned(), |p| format!("{p:.2}").replace('-', "−")))
        }
    }
}

fn rows(report: &Report) -> Vec<Row> {
    type Pick = fn(&Statistics) -> f64;
    let picks: [(&str, &str, Pick); 5] = [
        ("RMSE", "rmse", |s| s.rmse),
        ("S.D.", "std", |s| s.std),
        ("mean", "mean", |s| s.mean),
        ("median", "median", |s| s.median),
        ("max", "max", |s| s.max),
    ];
    let mut rows: Vec<Row> = picks
        .into_iter()
        .map(|(name, key, pick)| Row {
            name: format!("ATE {name} (m)"),
            key: format!("ate.translation_m.{key}"),
            of: Box::new(move |e| Some(pick(&e.ate.translation_m))),
        })
        .collect();
    let deltas = report.methods.iter().filter_map(|m| m.evaluation).flat_map(|e| &e.rpe).map(|rpe| rpe.options.delta);
    let mut seen: Vec<Delta> = Vec::new();
    for delta in deltas {
        if !seen.contains(&delta) {
            seen.push(delta);
        }
    }
    for delta in seen {
        let find = move |e: &Evaluation| -> Option<Rpe> { e.rpe.iter().find(|r| r.options.delta == delta).copied() };
        rows.push(Row {
            name: format!("RPE per {delta}, RMSE (m)"),
            key: format!("rpe.{delta}.translation_m.rmse"),
            of: Box::new(move |e| Some(find(e)?.translation_m.rmse)),
        });
        rows.push(Row {
            name: format!("RPE per {delta}, RMSE (°)"),
            key: format!("rpe.{delta}.rotation_deg.rmse"),
            of: Box::new(move |e| Some(find(e)?.rotation_deg.rmse)),
        });
    }
    rows
}

/// Returns the times of the stages with bars (paper Table 5).
pub fn times(report: &Report) -> Markup {
    let stages = stage_names(report);
    let found = |method: &MethodReport, name: &str| method.times.stages.iter().find(|s| s.name == name).cloned();
    let all = report.methods.iter().flat_map(|m| &m.times.stages).chain(&report.shared_stages);
    let longest_ms = all.map(|s| s.p99_ms).fold(1e-3, f64::max);
    html! {
        div.scroll {
            table.figures.times {
                thead {
                    tr { th { "stage" } th {} th { "median (ms)" } th { "p99 (ms)" } th { "runs" } th.bar {} }
                }
                @for name in &stages {
                    tbody {
                        @for (index, method) in report.methods.iter().enumerate() {
                            @if let Some(stage) = found(method, name) {
                                tr {
                                    th { @if index == 0 { (name) } }
                                    (method_heading(method, index))
                                    (stage_cells(&stage, longest_ms, Ink::method(method.name, index)))
                                }
                            }
                        }
                    }
                }
                @if !report.shared_stages.is_empty() {
                    tbody {
                        @for stage in &report.shared_stages {
                            tr { th { (stage.name) } th { "all" } (stage_cells(stage, longest_ms, Ink::Axis)) }
                        }
                    }
                }
            }
        }
    }
}

/// Returns the processor time of a frame and its parts.
pub fn processor_time(time: &ProcessorTime) -> Markup {
    html! {
        table.figures.totals {
            thead { tr { th { "processor time per frame" } th { "ms" } } }
            tbody {
                @for (name, ms) in &time.parts { tr { th { (name) } td { (format!("{ms:.2}")) } } }
                tr { th { b { "total" } } td { b { (format!("{:.2}", time.total_ms)) } } }
            }
        }
        p.about {
            "Processor time of the whole process, all threads together. The parts are measured separately; “other” is the rest, at least 0."
        }
    }
}

/// Returns the stages of all methods in their order.
fn stage_names<'a>(report: &'a Report) -> Vec<&'a str> {
    let mut names: Vec<&'a str> = Vec::new();
    for stage in report.methods.iter().flat_map(|m| &m.times.stages) {
        if !names.contains(&stage.name.as_str()) {
            names.push(&stage.name);
        }
    }
    names
}

fn stage_cells(stage: &Stage, longest_ms: f64, ink: Ink) -> Markup {
    let percent = |ms: f64| (100.0 * ms / longest_ms).clamp(0.0, 100.0);
    let bar = |ms: f64| format!("width:{:.2}%;background:var({})", percent(ms), ink.variable());
    html! {
        td { (format!("{:.2}", stage.median_ms)) }
        td { (format!("{:.2}", stage.p99_ms)) }
        td { (stage.count) }
        td.bar { div.bar { div.p99 style=(bar(stage.p99_ms)) {} div.median style=(bar(stage.median_ms)) {} } }
    }
}
