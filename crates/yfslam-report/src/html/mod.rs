//! HTML pages.

mod dense;
pub mod page;
mod tables;
pub mod tables_page;
