//! One image message of an open bag.

use std::fmt;
use std::sync::Arc;

use super::{Bag, Position};
use crate::error::Result;
use crate::message::MessageType;
use crate::message::wire::Wire;

/// One message of an open bag.
#[derive(Clone, Debug)]
pub struct MessageRef {
    bag: Arc<Bag>,
    topic: usize,
    position: Position,
}

impl MessageRef {
    /// Names the message at a position of the topic with this index.
    pub fn new(bag: Arc<Bag>, topic: usize, position: Position) -> Self {
        Self { bag, topic, position }
    }

    /// Reads the serialised message into `bytes` and drops their old content.
    ///
    /// # Errors
    /// The bag cannot be read, or the part of it that holds the message is damaged.
    pub fn read(&self, bytes: &mut Vec<u8>) -> Result<()> {
        self.bag.read(self.position, bytes)
    }

    /// Returns the name of the topic.
    pub fn topic(&self) -> &str {
        self.bag.topics().get(self.topic).map_or("", |topic| &topic.name)
    }

    /// Returns the type of the message and how it is serialised.
    pub fn kind(&self) -> Option<(MessageType, Wire)> {
        let topic = self.bag.topics().get(self.topic)?;
        topic.kind.zip(topic.wire)
    }
}

impl PartialEq for MessageRef {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bag, &other.bag) && (self.topic, self.position) == (other.topic, other.position)
    }
}

impl Eq for MessageRef {}

impl fmt::Display for MessageRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (path, topic) = (self.bag.path().display(), self.topic());
        write!(f, "{path}: the message of {topic} at byte {}", self.position.begin())
    }
}
