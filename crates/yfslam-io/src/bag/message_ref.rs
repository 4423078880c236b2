//! One message of an open bag.

use std::fmt;
use std::sync::Arc;

use super::Bag;
use crate::error::{Error, Result};

/// One message of an open bag. Messages of one topic are numbered from 0.
#[derive(Clone, Debug)]
pub struct MessageRef {
    bag: Arc<Bag>,
    topic: usize,
    index: usize,
}

impl MessageRef {
    /// Reads the serialised message into `bytes` and drops their old content.
    ///
    /// # Errors
    /// The bag cannot be read, or the part of it that holds the message is damaged.
    pub fn read(&self, bytes: &mut Vec<u8>) -> Result<()> {
        bytes.clear();
        Err(Error::content(&self.bag.path, "bags are not read yet", "unpack it"))
    }
}

impl PartialEq for MessageRef {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bag, &other.bag) && (self.topic, self.index) == (other.topic, other.index)
    }
}

impl Eq for MessageRef {}

impl fmt::Display for MessageRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "message {} of topic {} in {}", self.index, self.topic, self.bag.path.display())
    }
}
