//! The topics of a bag, gathered from the connections of its files.

use std::collections::HashMap;

use crate::message::MessageType;
use crate::message::wire::Wire;

/// Most connections that are listed; it bounds the memory that a forged bag can request.
const MAX_CONNECTIONS: usize = 1 << 16;

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Name, such as `/camera/color/image_raw`.
    pub name: String,
    /// Name of the type of its messages.
    pub type_name: String,
    /// The type, if it is understood.
    pub kind: Option<MessageType>,
    /// How its messages are serialised; `None` if it is not understood.
    pub wire: Option<Wire>,
    /// Number of messages.
    pub messages: u64,
}

/// The topics of a bag, and which connection of which file belongs to which.
#[derive(Clone, Debug, Default)]
pub struct Topics {
    list: Vec<Topic>,
    by_connection: HashMap<(u32, u32), usize>,
    /// Messages of connections that are described after they are counted.
    counted_before: HashMap<(u32, u32), u64>,
}

impl Topics {
    pub fn list(&self) -> &[Topic] {
        &self.list
    }

    /// Adds a connection of a file; several may be of one topic.
    pub fn add(&mut self, file: u32, connection: u32, name: &str, type_name: &str, wire: Option<Wire>) {
        if self.by_connection.len() >= MAX_CONNECTIONS {
            return;
        }
        let found = self.list.iter().position(|t| t.name == name && t.type_name == type_name && t.wire == wire);
        let index = found.unwrap_or_else(|| {
            let kind = MessageType::of(type_name);
            self.list.push(Topic { name: name.into(), type_name: type_name.into(), kind, wire, messages: 0 });
            self.list.len() - 1
        });
        self.by_connection.entry((file, connection)).or_insert(index);
        if let Some(messages) = self.counted_before.remove(&(file, connection)) {
            self.count(file, connection, messages);
        }
    }

    /// Returns the index of the topic of a connection.
    pub fn of(&self, file: u32, connection: u32) -> Option<usize> {
        self.by_connection.get(&(file, connection)).copied()
    }

    /// Counts messages of a connection.
    pub fn count(&mut self, file: u32, connection: u32, messages: u64) {
        let total = match self.of(file, connection).and_then(|index| self.list.get_mut(index)) {
            Some(topic) => &mut topic.messages,
            None if self.counted_before.len() < MAX_CONNECTIONS => {
                self.counted_before.entry((file, connection)).or_default()
            }
            None => return,
        };
        *total = total.saturating_add(messages);
    }
}
