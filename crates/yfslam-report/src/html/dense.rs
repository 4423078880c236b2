//! In: images of dense maps. Out: the section that shows them, with the methods side by side.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use crate::content::{DenseMapImages, MethodReport, Report};
use crate::figures::ink::Ink;

/// Returns the section; empty if no method has a dense map.
pub fn dense(report: &Report) -> Markup {
    let maps: Vec<_> = report.methods.iter().enumerate().filter_map(|(i, m)| Some((i, m, m.dense.as_ref()?))).collect();
    if maps.is_empty() {
        return html! {};
    }
    let one = maps.len() == 1;
    html! {
        section #dense {
            h2 { "Dense map" }
            p.about { "Occupied voxels in their colours, from above (x to the right, y up, as in the occupancy grid) and from a corner; points high above the floor are left out." }
            div.images.grid[one] {
                div.snapshot { @for (index, method, map) in &maps { (view(method, *index, map, 0)) } }
                div.snapshot { @for (index, method, map) in &maps { (view(method, *index, map, 1)) } }
            }
        }
    }
}

fn view(method: &MethodReport, index: usize, map: &DenseMapImages, which: usize) -> Markup {
    let (jpeg, [width, height]) = &map.views[which];
    let color = format!("color:var({})", Ink::method(method.name, index).variable());
    let from = ["from above", "from a corner"][which];
    html! {
        figure {
            img width=(width) height=(height) alt=(format!("the map of {} {from}", method.name))
                src=(format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg)));
            figcaption {
                b style=(color) { (method.name) } " " (from)
                @if which == 0 {
                    ": " (map.keyframes) " keyframes, " (map.occupied) " voxels of " (map.resolution_m) " m occupied"
                }
            }
        }
    }
}
