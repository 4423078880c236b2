//! Live operation: frames that come when they come, from a camera, a topic, a pipe, or a recording that is played at real time.
//!
//! ```text
//! camera thread ──newest_queue──► LiveSource ──► LiveSession ──► Step: what happened, with pose and latency
//!                 drops older       Arrival         │ ClockGuard   time stamps ascend; jumps are bridged
//!                 frames, counted                   │ Watchdog     a camera is silent, or is back
//!                                                   │ Slam
//!                                                   └─► Health     state, rates, latencies, drops, why lost
//! ```
//!
//! The crate has no sockets, files or threads, and reads no clock: the caller passes the time, so that every test is exact.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod clock_guard;
mod health;
mod meters;
mod newest_queue;
mod session;
mod source;
mod watchdog;

pub use clock_guard::{Admission, ClockEvent, ClockGuard};
pub use health::{Health, LiveState};
pub use meters::{LatencyMeter, RateMeter};
pub use newest_queue::{NewestReceiver, NewestSender, Taken, newest_queue};
pub use session::{LiveSession, Step};
pub use source::{Arrival, LiveSource};
pub use watchdog::{CameraEvent, Watchdog};
