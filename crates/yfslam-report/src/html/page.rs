//! In: a report. Out: its page. The template escapes every text.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::dense::dense;
use super::map3d::map3d;
use super::tables;
use crate::content::{MethodReport, Report, Snapshot};
use crate::figures::axis::length;
use crate::figures::bars::bars;
use crate::figures::ink::{self, Ink};
use crate::figures::over_time::over_time;
use crate::figures::scene::{Captioned, Scene};
use crate::figures::views::{multiples, views};

use yfslam_eval::{AlignmentKind, improvement_percent};

/// Style sheet of all pages.
const STYLE: &str = include_str!("style.css");

impl Report<'_> {
    /// Returns the page.
    pub fn html(&self) -> String {
        page(self).into_string()
    }
}

/// The whole page.
fn page(report: &Report) -> Markup {
    let scene = Scene::new(report);
    let content = html! {
        (header(report))
        (accuracy(report, &scene))
        (trajectory(&scene))
        (map3d(report))
        (errors(report, &scene))
        (snapshots(report))
        (dense(report))
        (times(report))
        (setup(report))
    };
    shell(report.sequence, report.version, &content)
}

/// Returns a page with this content.
pub fn shell(title: &str, version: &str, content: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) " – yfslam" }
                style { (PreEscaped(ink::style())) (PreEscaped(STYLE)) }
            }
            body {
                main { (content) }
                footer { "yfslam " (version) }
            }
        }
    }
}

fn header(report: &Report) -> Markup {
    html! {
        header {
            p.eyebrow { "yfslam" }
            h1 { (report.sequence) }
            p.verdict { (verdict(report)) }
            div.cards {
                @for (index, method) in report.methods.iter().enumerate() { (card(method, index)) }
            }
            dl.facts {
                @for (name, value) in &report.facts { div { dt { (name) } dd { (value) } } }
            }
        }
    }
}

/// Summarises the last method, which is the main subject of the report, in a sentence.
fn verdict(report: &Report) -> Markup {
    let Some(method) = report.methods.last() else { return html! {} };
    let ate = method.evaluation.map(|e| e.ate.translation_m.rmse);
    let before = report.methods.first().filter(|first| first.name != method.name);
    let original = before.and_then(|first| Some((first.name, first.evaluation?.ate.translation_m.rmse)));
    let better = ate.zip(original).and_then(|(ours, (name, rmse))| Some((improvement_percent(ours, rmse)?, name)));
    html! {
        b { (method.name) } " tracks " b { (percent(method.frames.tracked_percent())) } " of the frames"
        @if let Some(ate) = ate { " with an error (ATE, RMSE) of " b { (length(ate)) } }
        @if let Some((by, name)) = better {
            @if by >= 0.0 { ", " (format!("{by:.2}")) " % less than " (name) } @else { ", " (format!("{:.2}", -by)) " % more than " (name) }
        }
        @if report.truth.is_none() { "; the error is not known, because there is no ground truth" }
        "."
        @if let Some(time) = &report.processor_time {
            span data-timing="" {
                @if report.methods.len() == 1 { " The process takes " } @else { " All methods together take " }
                b { (format!("{:.1} ms", time.total_ms)) } " of processor time per frame."
            }
        }
    }
}

fn card(method: &MethodReport, index: usize) -> Markup {
    let color = format!("--accent:var({})", Ink::method(method.name, index).variable());
    html! {
        div.card style=(color) {
            p.name { (method.name) }
            p.summary { (method.summary) }
            @match method.evaluation {
                Some(e) => p.big { (length(e.ate.translation_m.rmse)) small { "ATE, RMSE" } },
                None => p.big { (percent(method.frames.tracked_percent())) small { "of the frames tracked" } },
            }
            p.counts {
                (method.frames.tracked) " of " (method.frames.total) " frames tracked"
                @if method.frames.lost > 0 { ", " (method.frames.lost) " lost" }
                @for (reason, count) in &method.frames.skipped { ", " (count) " skipped (" (reason) ")" }
            }
        }
    }
}

fn percent(value: f64) -> String {
    if value >= 100.0 { "100 %".into() } else { format!("{value:.1} %") }
}

/// Describes the scale of each method after alignment by Sim(3).
fn scales(report: &Report) -> String {
    let chosen = report.methods.iter().filter_map(|m| Some((m.name, m.evaluation?.ate.alignment)));
    let chosen: Vec<String> = chosen
        .filter(|(_, alignment)| alignment.kind == AlignmentKind::Sim3)
        .map(|(name, alignment)| format!("{name} by s = {:.4}", alignment.scale))
        .collect();
    if chosen.is_empty() {
        String::new()
    } else {
        format!(" and scale (Sim(3): {}, for its RPE, too)", chosen.join(", "))
    }
}

fn accuracy(report: &Report, scene: &Scene) -> Markup {
    if report.truth.is_none() {
        return html! {
            section #accuracy {
                h2 { "Accuracy" }
                p.none { "This sequence has no ground truth, so errors cannot be measured." }
            }
        };
    }
    // A table of many methods needs the whole width of the page.
    let is_narrow = report.methods.len() <= 3;
    html! {
        section #accuracy {
            h2 { "Accuracy" }
            @for method in report.methods.iter().filter(|m| m.evaluation.is_none()) {
                p.none { "The trajectory of " (method.name) " cannot be compared with the ground truth: it is too short, or too straight to be aligned." }
            }
            p.about {
                "Absolute trajectory error (ATE) after alignment by rotation and translation" (scales(report))
                ", and relative pose error (RPE) without alignment. S.D.: standard deviation."
                @if report.methods.len() > 1 { " Improvement is (1 − error / error of the first) · 100 %." }
            }
            div.pair.accuracy[is_narrow].wide[!is_narrow] {
                (tables::errors(report))
                @if let Some(bars) = bars(report, scene) { (figure(scene, &bars, false)) }
            }
        }
    }
}

fn trajectory(scene: &Scene) -> Markup {
    let about = if scene.truth.is_some() {
        "Ground truth, and estimates aligned to it by rotation and translation."
    } else {
        "Estimates in the frame of the first camera pose."
    };
    html! {
        section #trajectory {
            h2 { "Trajectory" }
            p.about {
                (about) " The dot is the start."
                @if scene.any_lost() { " A cross is where tracking was lost; the faint line leads to where it resumed." }
            }
            div.pair { @for view in views(scene) { (figure(scene, &view, true)) } }
            (each_alone(scene))
        }
    }
}

/// The trajectory of each method by itself, because small errors are hidden where trajectories cover each other.
fn each_alone(scene: &Scene) -> Markup {
    let multiples = multiples(scene);
    html! {
        @if !multiples.figures.is_empty() {
            h3 { "Each method by itself, from above" }
            p.about {
                "In the colours of the error: "
                span.legend { @for (name, ink) in &multiples.legend { (key(name, *ink)) } span { i style="background:var(--ink-axis)" {} "ground truth" } }
            }
            div.pair {
                @for one in &multiples.figures {
                    figure {
                        figcaption { b { (one.title) } }
                        (PreEscaped(one.figure.svg()))
                        @if !one.note.is_empty() { p.note { (one.note) } }
                    }
                }
            }
        }
    }
}

fn errors(report: &Report, scene: &Scene) -> Markup {
    let figures = over_time(scene);
    if figures.is_empty() || report.truth.is_none() {
        return html! {};
    }
    html! {
        section #errors {
            h2 { "Error over time" }
            p.about {
                "Distance between the aligned estimate and the ground truth, and angles between them about the camera's viewing direction \
                 (roll), its right (pitch) and its down direction (yaw). For the angles, the orientations are aligned, because positions along a \
                 line do not determine the rotation about it."
                @if let Some(angle) = scene.body_rotation.angle_deg() {
                    " The ground truth holds the poses of a body that is rotated by " (format!("{angle:.1}")) "° relative to the camera. This \
                     constant rotation is removed here, but not in the RPE of the table."
                }
                @if scene.any_lost() { " Shaded: lost." }
            }
            div.pair { @for one in &figures { (figure(scene, one, false)) } }
        }
    }
}

fn figure(scene: &Scene, captioned: &Captioned, with_truth: bool) -> Markup {
    html! {
        figure {
            figcaption {
                b { (captioned.title) }
                span.legend {
                    @if with_truth && scene.truth.is_some() { (key("ground truth", Ink::Truth)) }
                    @for method in &scene.methods { (key(method.name, method.ink)) }
                }
            }
            (PreEscaped(captioned.figure.svg()))
            @if !captioned.note.is_empty() { p.note { (captioned.note) } }
        }
    }
}

fn key(name: &str, ink: Ink) -> Markup {
    html! { span { i style=(format!("background:var({})", ink.variable())) {} (name) } }
}

fn snapshots(report: &Report) -> Markup {
    let mut frames: Vec<usize> = report.methods.iter().flat_map(|m| &m.snapshots).map(|p| p.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    if frames.is_empty() {
        return html! {};
    }
    let one = report.methods.len() == 1;
    html! {
        section #images {
            h2 { "Decisions of the dynamic filter" }
            p.about {
                span.legend {
                    span { i.ring {} "static feature, matched to the map" }
                    span { i.dim {} "static feature, not matched" }
                    span { i.dynamic {} "dynamic feature, not used" }
                    span { i.box {} "bounding box of a person" }
                }
            }
            div.images.grid[one] {
                @for frame in frames {
                    div.snapshot.two[report.methods.len().is_multiple_of(2)] {
                        @for (index, method) in report.methods.iter().enumerate() {
                            @if let Some(snapshot) = method.snapshots.iter().find(|p| p.frame == frame) {
                                (show_snapshot(method, index, snapshot))
                            }
                        }
                    }
                }
            }
        }
    }
}

fn show_snapshot(method: &MethodReport, index: usize, snapshot: &Snapshot) -> Markup {
    let [width, height] = snapshot.size;
    let [used, dropped] = snapshot.features;
    let color = format!("color:var({})", Ink::method(method.name, index).variable());
    html! {
        figure {
            img width=(width) height=(height) alt=(format!("frame {} under {}", snapshot.frame, method.name))
                src=(format!("data:image/jpeg;base64,{}", STANDARD.encode(&snapshot.jpeg)));
            figcaption {
                b style=(color) { (method.name) }
                " frame " (snapshot.frame) @if !snapshot.note.is_empty() { ", " (snapshot.note) }
                ": " (used) " features used, " (dropped) " dropped"
            }
        }
    }
}

fn times(report: &Report) -> Markup {
    html! {
        section #times data-timing="" {
            h2 { "Time" }
            p.about {
                "Wall time of each stage. Solid: median; light: 99th percentile (p99). Detection runs in parallel with feature extraction; \
                 images are read or rendered ahead of their use."
            }
            (tables::times(report))
            table.figures.totals {
                thead {
                    tr { th {} th { "wall time of tracking (s)" } th { "frames per second" } }
                }
                tbody {
                    @for (index, method) in report.methods.iter().enumerate() {
                        tr {
                            th style=(format!("color:var({})", Ink::method(method.name, index).variable())) { (method.name) }
                            td { (format!("{:.2}", method.times.tracking_s)) }
                            td { (format!("{:.1}", method.frames.total as f64 / method.times.tracking_s.max(1e-9))) }
                        }
                    }
                }
            }
            p.about {
                "Everything together, reading or rendering included, took " (format!("{:.2} s", report.wall_s)) "."
            }
            @if let Some(time) = &report.processor_time { (tables::processor_time(time)) }
        }
    }
}

fn setup(report: &Report) -> Markup {
    html! {
        section #setup {
            h2 { "How to repeat it" }
            pre.command { (report.command) }
            @for method in &report.methods {
                details {
                    summary { "Configuration of " (method.name) }
                    pre { (method.config) }
                }
            }
        }
    }
}
