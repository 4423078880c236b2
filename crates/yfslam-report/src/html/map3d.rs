//! The map in three dimensions, which pointer and keys turn.
//!
//! In: landmarks, keyframes and trajectories. Out: a section with its data and scripts. Everything is drawn in the world of the last method: the
//! others and the ground truth are brought into it by their alignments with the ground truth.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use nalgebra::{Matrix4, Vector3};

use crate::content::{MethodReport, Report};
use crate::figures::ink::Ink;
use yfslam_eval::{Alignment, StampedPose};

/// Most landmarks of a method, and most poses of a line; of more, every n-th is drawn.
const MAX_LANDMARKS: usize = 12_000;
const MAX_POSES: usize = 5_000;
/// Most keyframes of a method.
const MAX_KEYFRAMES: usize = 1_000;

/// Returns the section; nothing without the script or without landmarks.
pub fn map3d(report: &Report) -> Markup {
    let is_empty = report.methods.iter().all(|method| method.landmarks.is_empty());
    if report.scene_script.is_empty() || is_empty {
        return html! {};
    }
    html! {
        section #map3d {
            h2 { "Map in three dimensions" }
            p.about {
                "Landmarks, keyframes and trajectory. Drag to turn, with Shift to move; the wheel or two fingers zoom; with the keyboard: arrow keys, plus \
                 and minus. The squares of the grid are the scale."
            }
            div.map3d {
                div {
                    select #map-method aria-label="Method" {
                        @for (index, method) in report.methods.iter().enumerate() {
                            option value=(index) selected=[(index + 1 == report.methods.len()).then_some("selected")] { (method.name) }
                        }
                    }
                    button #map-orbit aria-pressed="true" { "Orbit" }
                    button #map-top aria-pressed="false" { "Top" }
                    button #map-fit { "Fit" }
                    span.legend {
                        @if report.truth.is_some() { span { i style="background:var(--ink-truth)" {} "ground truth" } }
                        @for (index, method) in report.methods.iter().enumerate() {
                            span { i style=(format!("background:var({})", Ink::method(method.name, index).variable())) {} (method.name) }
                        }
                        span #map-grid {}
                    }
                }
                canvas #map-canvas tabindex="0" role="application" aria-label="Map in three dimensions" {}
                noscript { p.none { "The map needs JavaScript." } }
            }
            script { (PreEscaped(script(report))) }
        }
    }
}

fn script(report: &Report) -> String {
    let last = report.methods.last().and_then(alignment);
    let to_last = |from: Option<Alignment>| {
        let (Some(last), Some(from)) = (last, from) else { return Matrix4::identity() };
        matrix(&last).try_inverse().unwrap_or_else(Matrix4::identity) * matrix(&from)
    };
    let mut data = String::from("const yfMap={methods:[");
    for (index, method) in report.methods.iter().enumerate() {
        let step = method.landmarks.len().div_ceil(MAX_LANDMARKS).max(1);
        let shown = || method.landmarks.iter().step_by(step);
        let colors: Vec<u8> = shown().flat_map(|(_, color)| *color).collect();
        let color = Ink::method(method.name, index).variable();
        let numbers = matrix_text(&to_last(alignment(method)));
        // Writing to a string does not fail.
        let _ = write!(
            data,
            "{{color:\"{color}\",matrix:[{numbers}],landmarks:\"{}\",colors:\"{}\",path:\"{}\",keyframes:\"{}\"}},",
            floats(shown().flat_map(|(position, _)| *position)),
            STANDARD.encode(colors),
            positions(method.trajectory, MAX_POSES),
            positions(method.keyframes, MAX_KEYFRAMES),
        );
    }
    let truth = report.truth.zip(last).map(|(truth, last)| {
        let inside = |pose: &&StampedPose| {
            let frames = report.frames_ns.first().zip(report.frames_ns.last());
            frames.is_none_or(|(first, last)| (*first..=*last).contains(&pose.timestamp_ns))
        };
        let shown: Vec<StampedPose> = truth.iter().filter(inside).copied().collect();
        let inverse = matrix(&last).try_inverse().unwrap_or_else(Matrix4::identity);
        format!("{{path:\"{}\",matrix:[{}]}}", positions(&shown, MAX_POSES), matrix_text(&inverse))
    });
    let _ = write!(data, "],truth:{}}};", truth.as_deref().unwrap_or("null"));
    // Only text of the program and numbers: no script can end early. The marks keep the page well-formed XML.
    ["//<![CDATA[", report.scene_script, &data, include_str!("map3d.js"), "//]]>"].join("\n")
}

/// Returns the alignment of a method with the ground truth.
fn alignment(method: &MethodReport) -> Option<Alignment> {
    Some(method.evaluation?.ate.alignment)
}

fn matrix(alignment: &Alignment) -> Matrix4<f64> {
    Matrix4::new_translation(&alignment.translation)
        * alignment.rotation.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&Vector3::repeat(alignment.scale))
}

fn matrix_text(matrix: &Matrix4<f64>) -> String {
    matrix.iter().map(|value| format!("{value:.6}")).collect::<Vec<_>>().join(",")
}

fn positions(poses: &[StampedPose], most: usize) -> String {
    let step = poses.len().div_ceil(most).max(1);
    let shown = poses.iter().step_by(step).map(|pose| pose.t_world_cam.translation.vector);
    floats(shown.flat_map(|v| [v.x as f32, v.y as f32, v.z as f32]))
}

fn floats(values: impl Iterator<Item = f32>) -> String {
    STANDARD.encode(values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
}
