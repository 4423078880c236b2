//! HTML pages.

mod dense;
mod map3d;
mod page;
mod tables;
pub mod tables_page;
