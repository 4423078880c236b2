//! Figures, as SVG and PDF.

pub mod axis;
pub mod bars;
pub mod boxes;
pub mod files;
pub mod ink;
mod orientation;
pub mod over_time;
mod path;
mod pdf;
mod plot;
pub mod scene;
mod series;
pub mod views;
