//! The live view: a page that shows what a SLAM system does while it is running.
//!
//! ```text
//! frame, Tracked, Slam ──View::show──► newest state ──encoder thread──► packets ──server──► page (WebGL 2)
//!                                      a small copy      JPEG, points     one thread a viewer
//! ```
//!
//! In: every frame with its result. Out: answers to the page, which asks for what is newer than what it has. A slow viewer misses frames; it
//! never delays the run. Without a viewer nothing is copied or encoded.
//!
//! The server binds to the loopback interface unless the caller gives another address. It answers only requests that name it by an address of
//! the machine, and refuses requests of pages of other origins.
#![forbid(unsafe_code)]

mod address;
mod align;
mod cells;
mod encoder;
mod guard;
mod map;
mod moment;
mod packet;
mod request;
mod server;
mod shared;
mod view;

pub use address::Address;
pub use view::{View, ViewOptions};

/// Draws points and lines with WebGL 2: the function `yfScene`, which pages of reports use, too.
pub static SCENE_SCRIPT: &str = include_str!("page/scene.js");

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
