//! The SQLite storage of rosbag2: a table of topics, and one of messages.

use super::compression::is_packed;
use super::file::{BagFile, Position};
use super::sqlite::{Database, Row, Value, columns};
use super::walk::{HEAD_BYTES, Need, Stop, Walk};
use crate::message::wire::Wire;

/// Goes through the messages of a file.
pub fn walk(walk: &mut Walk<'_>, file: &BagFile) -> Result<(), Stop> {
    let database = Database::open(file).ok_or(Stop::Damaged(0))?;
    let (topics, messages) = database.table("topics").zip(database.table("messages")).ok_or(Stop::Damaged(0))?;
    let index = |names: &[String], name: &str| names.iter().position(|other| other == name).ok_or(Stop::Damaged(0));
    let of_topic = [index(&topics.1, "id")?, index(&topics.1, "name")?, index(&topics.1, "type")?];
    let format = index(&topics.1, "serialization_format")?;
    database.rows(topics.0, &mut |row| {
        let Some(payload) = database.payload(row.at, row.payload_length.min(1 << 20)) else { return Ok(()) };
        let values = columns(&payload).unwrap_or_default();
        let [id, name, type_name] = of_topic.map(|index| values.get(index).copied());
        let text = |value: Option<Value>| value.and_then(|value| value.text(&payload)).unwrap_or_default();
        let wire = (text(values.get(format).copied()) == "cdr").then_some(Wire::Cdr);
        let id = number(id, &payload, row.number);
        if let Some(id) = id.and_then(|id| u32::try_from(id).ok()) {
            walk.topics.add(walk.file, id, &text(name), &text(type_name), wire);
        }
        Ok(())
    })?;
    let of_message = [index(&messages.1, "topic_id")?, index(&messages.1, "timestamp")?, index(&messages.1, "data")?];
    database.rows(messages.0, &mut |row| message(walk, &database, &row, of_message))
}

/// Returns an integer; SQLite stores a primary key as the number of its row.
fn number(value: Option<Value>, payload: &[u8], row: i64) -> Option<i64> {
    Some(value?.integer(payload).unwrap_or(row))
}

fn message(walk: &mut Walk<'_>, database: &Database<'_>, row: &Row, of_message: [usize; 3]) -> Result<(), Stop> {
    let damaged = || Stop::Damaged(row.at);
    let values = columns(&row.local).ok_or_else(damaged)?;
    let [topic, time, data] = of_message.map(|index| values.get(index).copied());
    let integer = |value: Option<Value>| value.and_then(|value| value.integer(&row.local)).ok_or_else(damaged);
    let (connection, time_ns) = (u32::try_from(integer(topic)?).unwrap_or(u32::MAX), integer(time)?);
    let data = data.ok_or_else(damaged)?;
    walk.count(connection, time_ns);
    let Some((topic, need)) = walk.need(connection) else { return Ok(()) };
    let length = u32::try_from(data.length).map_err(|_| damaged())?;
    let position = Position { file: walk.file, length, chunk: Position::NO_CHUNK, offset: row.at };
    let read = |wanted: u64| {
        let payload = database.payload(row.at, data.offset + wanted)?;
        payload.get(data.offset as usize..).map(<[u8]>::to_vec)
    };
    let head = data.length.min(HEAD_BYTES as u64);
    let mut bytes = read(if need == Need::Head { head } else { data.length }).ok_or_else(damaged)?;
    if need == Need::Head && is_packed(&bytes) {
        bytes = read(data.length).ok_or_else(damaged)?;
    }
    walk.deliver(topic, need, time_ns, position, bytes)
}

/// Reads the message of the row at this byte.
pub fn read(file: &BagFile, at: u64, length: u32, bytes: &mut Vec<u8>) -> Option<()> {
    let database = Database::open(file)?;
    let payload = database.payload(at, u64::MAX)?;
    // The message is the only column of bytes.
    let value = columns(&payload)?.into_iter().find(|value| value.is_blob() && value.length == u64::from(length))?;
    bytes.clear();
    bytes.extend(payload.get(value.offset as usize..)?.get(..length as usize)?);
    Some(())
}
