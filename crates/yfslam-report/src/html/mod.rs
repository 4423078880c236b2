//! HTML pages.

mod dense;
mod page;
mod tables;
pub mod tables_page;
