//! Writes small bags of rosbag2 in SQLite, for tests, after the description of its file format. Pages are small, so that rows overflow.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, reason = "a test may")]

use super::bags::Message;

const PAGE: usize = 512;

/// Writes a bag: a page of the schema, one of topics, one that leads to the messages, and the pages of each message.
pub fn db3_bag(messages: &[Message]) -> Vec<u8> {
    let mut topics: Vec<(&str, String)> = Vec::new();
    for message in messages {
        if !topics.iter().any(|(topic, _)| *topic == message.topic) {
            topics.push((&message.topic, message.type_name.replace('/', "/msg/")));
        }
    }
    let mut file = File { pages: vec![Vec::new(); 3] };
    let table = |name: &'static str, root: u8, sql: &'static str| {
        record(&[
            Value::Text("table"),
            Value::Text(name),
            Value::Text(name),
            Value::Int(i64::from(root)),
            Value::Text(sql),
        ])
    };
    let schema = [
        table(
            "topics",
            2,
            "CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL)",
        ),
        table(
            "messages",
            3,
            "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL)",
        ),
    ];
    let topic = |(topic, type_name): &(&str, String)| {
        record(&[Value::Null, Value::Text(topic), Value::Text(type_name), Value::Text("cdr")])
    };
    let rows: Vec<Vec<u8>> = topics.iter().map(topic).collect();
    file.leaf(1, &schema);
    file.leaf(2, &rows);
    let mut children = Vec::new();
    for (index, message) in messages.iter().enumerate() {
        let topic = topics.iter().position(|(topic, _)| *topic == message.topic).unwrap() as i64 + 1;
        let row =
            record(&[Value::Null, Value::Int(topic), Value::Int(message.received_ns), Value::Blob(&message.bytes)]);
        file.pages.push(Vec::new());
        let number = file.pages.len();
        children.push((number as u32, index as u64 + 1));
        file.leaf(number, &[row]);
    }
    let last = children.pop().unwrap();
    let cells: Vec<Vec<u8>> =
        children.iter().map(|(page, row)| [&page.to_be_bytes()[..], &varint(*row)].concat()).collect();
    file.pages[2] = page(0, 5, &last.0.to_be_bytes(), &cells);
    file.pages.concat()
}

struct File {
    pages: Vec<Vec<u8>>,
}

impl File {
    /// Writes a page of rows, and the pages to which they overflow.
    fn leaf(&mut self, number: usize, rows: &[Vec<u8>]) {
        let mut cells = Vec::new();
        for (index, row) in rows.iter().enumerate() {
            let (most, per_page) = (PAGE - 35, PAGE - 4);
            let least = (PAGE - 12) * 32 / 255 - 23;
            let fitting = least + row.len().saturating_sub(least) % per_page;
            let local = if row.len() <= most {
                row.len()
            } else if fitting <= most {
                fitting
            } else {
                least
            };
            let mut cell = [varint(row.len() as u64), varint(index as u64 + 1), row[..local].to_vec()].concat();
            let rest: Vec<&[u8]> = row[local..].chunks(per_page).collect();
            let first = self.pages.len() as u32 + 1;
            if !rest.is_empty() {
                cell.extend(first.to_be_bytes());
            }
            for (part, next) in rest.iter().zip(first + 1..) {
                let next = if next - first < rest.len() as u32 { next } else { 0 };
                let mut page = [&next.to_be_bytes()[..], part].concat();
                page.resize(PAGE, 0);
                self.pages.push(page);
            }
            cells.push(cell);
        }
        self.pages[number - 1] = page(if number == 1 { 100 } else { 0 }, 13, &[], &cells);
    }
}

fn page(head: usize, kind: u8, right: &[u8], cells: &[Vec<u8>]) -> Vec<u8> {
    let mut page = vec![0; PAGE];
    if head > 0 {
        page[..16].copy_from_slice(b"SQLite format 3\0");
        page[16..18].copy_from_slice(&(PAGE as u16).to_be_bytes());
        page[56..60].copy_from_slice(&1u32.to_be_bytes());
    }
    page[head] = kind;
    page[head + 3..head + 5].copy_from_slice(&(cells.len() as u16).to_be_bytes());
    page[head + 8..head + 8 + right.len()].copy_from_slice(right);
    let pointers = head + 8 + right.len();
    let mut end = PAGE;
    for (index, cell) in cells.iter().enumerate() {
        end -= cell.len();
        page[end..end + cell.len()].copy_from_slice(cell);
        page[pointers + 2 * index..pointers + 2 * index + 2].copy_from_slice(&(end as u16).to_be_bytes());
        assert!(pointers + 2 * cells.len() <= end, "the rows do not fit a page");
    }
    page
}

enum Value<'a> {
    Null,
    Int(i64),
    Text(&'a str),
    Blob(&'a [u8]),
}

fn record(values: &[Value<'_>]) -> Vec<u8> {
    let (mut head, mut body) = (Vec::new(), Vec::new());
    for value in values {
        match value {
            Value::Null => head.extend(varint(0)),
            Value::Int(value) => {
                head.extend(varint(6));
                body.extend(value.to_be_bytes());
            }
            Value::Text(text) => {
                head.extend(varint(text.len() as u64 * 2 + 13));
                body.extend(text.as_bytes());
            }
            Value::Blob(bytes) => {
                head.extend(varint(bytes.len() as u64 * 2 + 12));
                body.extend(*bytes);
            }
        }
    }
    // The heads of these tests have less than 127 bytes, so that their length takes one.
    [varint(head.len() as u64 + 1), head, body].concat()
}

fn varint(value: u64) -> Vec<u8> {
    let groups = (1..9).find(|groups| value >> (7 * groups) == 0).unwrap();
    (0..groups).rev().map(|group| (value >> (7 * group)) as u8 & 127 | if group > 0 { 128 } else { 0 }).collect()
}
