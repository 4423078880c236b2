//! What the page receives: packets of JSON and numbers.
//!
//! ```text
//! length of the rest u32 │ length of the JSON u32 │ JSON │ parts, one after the other
//! ```
//!
//! Numbers are little-endian. The JSON has the name of the packet as `kind`, and name and length of the parts, bytes, as `parts`.

use std::sync::Arc;

use serde_json::{Value, json};

/// A packet as it is sent, shared by all viewers.
pub type Packet = Arc<[u8]>;

/// A packet and its number, which ascends.
#[derive(Clone)]
pub struct Numbered {
    pub number: u64,
    pub packet: Packet,
}

/// Builds a packet.
pub struct PacketBuilder {
    head: Value,
    parts: Vec<Value>,
    bytes: Vec<u8>,
}

impl PacketBuilder {
    /// Begins a packet with the content of its JSON, an object.
    pub fn new(kind: &str, mut head: Value) -> Self {
        head["kind"] = kind.into();
        Self { head, parts: Vec::new(), bytes: Vec::new() }
    }

    /// Adds a part.
    pub fn part(mut self, name: &str, bytes: &[u8]) -> Self {
        self.parts.push(json!([name, bytes.len()]));
        self.bytes.extend(bytes);
        self
    }

    /// Adds numbers.
    pub fn floats(self, name: &str, values: impl IntoIterator<Item = f32>) -> Self {
        let bytes: Vec<u8> = values.into_iter().flat_map(f32::to_le_bytes).collect();
        self.part(name, &bytes)
    }

    /// Returns the packet.
    pub fn build(mut self) -> Packet {
        self.head["parts"] = self.parts.into();
        let head = self.head.to_string();
        let length = |bytes: usize| u32::try_from(bytes).unwrap_or(u32::MAX).to_le_bytes();
        let all = [&length(4 + head.len() + self.bytes.len()), &length(head.len()), head.as_bytes(), &self.bytes];
        all.concat().into()
    }
}

/// Returns the seconds since the first frame.
pub fn seconds(stamp_ns: i64, start_ns: i64) -> f64 {
    stamp_ns.saturating_sub(start_ns) as f64 / 1e9
}
