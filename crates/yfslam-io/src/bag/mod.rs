//! Bags: recordings of messages in one file.

mod message_ref;

pub use message_ref::MessageRef;

/// A bag that is open for reading.
#[derive(Debug)]
pub struct Bag {
    path: std::path::PathBuf,
}
