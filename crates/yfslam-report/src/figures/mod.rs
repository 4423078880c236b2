//! SVG figures.

pub mod axis;
pub mod bars;
pub mod ink;
mod orientation;
pub mod over_time;
mod path;
mod plot;
pub mod scene;
mod series;
pub mod views;
