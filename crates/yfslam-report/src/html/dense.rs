//! In: pictures of dense maps. Out: the section that shows them, method beside method.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use crate::content::{DenseMap, MethodReport, Report};
use crate::figures::ink::Ink;

/// The section; nothing if no method has a dense map.
pub fn dense(report: &Report) -> Markup {
    let maps: Vec<_> = report.methods.iter().enumerate().filter_map(|(i, m)| Some((i, m, m.dense.as_ref()?))).collect();
    if maps.is_empty() {
        return html! {};
    }
    let one = maps.len() == 1;
    html! {
        section #dense {
            h2 { "Dense map" }
            p.about { "Occupied voxels in their colours, seen from above and from a corner; what is high above the floor is left out." }
            div.pictures.grid[one] {
                div.moment { @for (place, method, map) in &maps { (view(method, *place, map, 0)) } }
                div.moment { @for (place, method, map) in &maps { (view(method, *place, map, 1)) } }
            }
        }
    }
}

fn view(method: &MethodReport, place: usize, map: &DenseMap, which: usize) -> Markup {
    let (png, [width, height]) = &map.views[which];
    let color = format!("color:var({})", Ink::method(method.name, place).variable());
    let from = ["from above", "from a corner"][which];
    html! {
        figure {
            img width=(width) height=(height) alt=(format!("the map of {} {from}", method.name))
                src=(format!("data:image/png;base64,{}", STANDARD.encode(png)));
            figcaption {
                b style=(color) { (method.name) } " " (from)
                @if which == 0 {
                    ": " (map.keyframes) " keyframes, " (map.occupied) " voxels of " (map.resolution_m) " m occupied"
                }
            }
        }
    }
}
