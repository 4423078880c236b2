//! Reports of evaluated runs: HTML pages with SVG figures, figures as files (SVG, PDF), and tables as plain text, Markdown, LaTeX or CSV.
//!
//! In: the results of one or more methods, as plain data. Out: text. A page needs no other file and no network.
//!
//! ```text
//! html (pages) ─► figures (SVG) ─► content (Report)
//!            └──► table
//! ```
//!
//! | section of the page | of the paper |
//! |---|---|
//! | errors and improvement | Tables 2 to 4, equation 3 |
//! | bars of RMSE and S.D. | Fig. 6 |
//! | trajectory from above and from the side, errors over time | Fig. 5 |
//! | images with static and dynamic features | Fig. 7 |
//! | dense map, if there is one | |
//! | times | Table 5 |
//!
//! The same data give the same bytes. Measured times stand in elements with the attribute `data-timing` only: without them, the page of
//! a run and the page of its repetition are equal.
#![forbid(unsafe_code)]

mod content;
mod evaluation;
mod figures;
mod html;
mod table;

pub use content::{DenseMapImages, Frames, MethodReport, ProcessorTime, Report, Snapshot, Stage, Times};
pub use evaluation::{errors_table, evaluation_table, rpe_errors};
pub use figures::boxes::errors_over_runs;
pub use figures::files::FigureFile;
pub use html::tables_page::{IMPROVEMENT, ORIGIN, PUBLISHED, TableSection, TablesPage};
pub use table::{Table, TableStyle};
