//! Bags: recordings of the messages of ROS in one file or a folder.
//!
//! ```text
//! file ──open──► topics, with their types and numbers of messages
//!      ──visit──► the messages of some topics, in the order of the file, each with its position
//! position ──read──► the bytes of the message
//! ```
//!
//! Nothing that grows with the length of the bag is kept: the caller keeps the positions that it needs, and a few unpacked chunks wait for
//! their next message. A damaged or unfinished bag is read as far as it goes; [`Bag::notes`] and [`Visited::notes`] say so.

mod compression;
mod db3;
mod fields;
mod file;
mod folder;
mod mcap;
mod message_ref;
mod ros1;
mod sqlite;
mod topics;
mod walk;
pub mod write;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::message::{ImageHead, MessageType};
use compression::unpack_message;
use file::BagFile;
pub use file::Position;
pub use message_ref::MessageRef;
pub use topics::Topic;
use topics::Topics;
use walk::Walk;
pub use walk::{Found, Need};

/// A bag that is open for reading.
#[derive(Debug)]
pub struct Bag {
    path: PathBuf,
    files: Vec<BagFile>,
    topics: Topics,
    span_ns: Option<(i64, i64)>,
    notes: Vec<String>,
}

/// Result of a visit.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Visited {
    /// What could not be read, and why.
    pub notes: Vec<String>,
}

/// Extensions of the files of bags.
const EXTENSIONS: [&str; 4] = ["bag", "active", "mcap", "db3"];

/// Returns whether `path` is a bag: a file that begins like one or is named so, or a folder with the `metadata.yaml` of rosbag2.
pub fn is_bag(path: &Path) -> bool {
    let is_named = || EXTENSIONS.iter().any(|name| path.extension().is_some_and(|extension| extension == *name));
    folder::is_bag_folder(path) || (path.is_file() && (is_named() || file::has_magic(path)))
}

impl Bag {
    /// Opens a bag and lists its topics. A bag without an index is read completely for this.
    ///
    /// # Errors
    /// The file cannot be read, or is not a bag that is understood.
    pub fn open(path: &Path) -> Result<Self> {
        let paths = if path.is_dir() { folder::files(path)? } else { vec![path.to_owned()] };
        let files = paths.iter().map(|path| BagFile::open(path)).collect::<Result<Vec<_>>>()?;
        let mut bag = Self { path: path.into(), files, topics: Topics::default(), span_ns: None, notes: Vec::new() };
        for index in 0..bag.files.len() {
            bag.list_topics(index)?;
        }
        Ok(bag)
    }

    /// Lists the topics of a file from its summary or, if it has none, from all of its messages.
    fn list_topics(&mut self, index: usize) -> Result<()> {
        let Some(file) = self.files.get(index) else { return Ok(()) };
        let before = self.topics.clone();
        let mut visit = |_: Found<'_>| ControlFlow::Continue(());
        let mut walk = Walk::new(index as u32, &mut self.topics, &[], &mut visit);
        if !walk.summary(file)? {
            walk = Walk::new(index as u32, &mut self.topics, &[], &mut visit);
            *walk.topics = before;
            walk.counts = true;
            // Nothing breaks off a visit that only counts.
            let _ = walk.file(file)?;
            let path = file.path().display();
            walk.notes.insert(0, format!("{path} has no index, because its recording did not end properly or a part of it is missing; it was read message by message"));
        }
        let (notes, span_ns) = (walk.notes, walk.span_ns);
        self.notes.extend(notes);
        self.span_ns = match (self.span_ns, span_ns) {
            (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
            (one, other) => one.or(other),
        };
        Ok(())
    }

    /// Returns the file or folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the topics, in the order in which the bag names them.
    pub fn topics(&self) -> &[Topic] {
        self.topics.list()
    }

    /// Returns the times at which the first and the last message were received, ns; `None` if the bag is empty.
    pub fn span_ns(&self) -> Option<(i64, i64)> {
        self.span_ns
    }

    /// Returns what is wrong with the bag as a whole.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Calls `visit` with the messages of the topics that `needs` names by index, in the order of the file, until it breaks.
    ///
    /// # Errors
    /// A file cannot be read. What is damaged is left out and noted.
    pub fn visit(&self, needs: &[Need], visit: &mut dyn FnMut(Found<'_>) -> ControlFlow<()>) -> Result<Visited> {
        let mut topics = self.topics.clone();
        let mut visited = Visited::default();
        for (index, file) in self.files.iter().enumerate() {
            let mut walk = Walk::new(index as u32, &mut topics, needs, visit);
            let flow = walk.file(file)?;
            visited.notes.append(&mut walk.notes);
            if flow.is_break() {
                break;
            }
        }
        Ok(visited)
    }

    /// Returns the encodings or formats of the images, by the index of their topic, from the first message of each.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn encodings(&self) -> Result<BTreeMap<usize, String>> {
        let is_image = |topic: &Topic| {
            topic.wire.is_some() && matches!(topic.kind, Some(MessageType::Image | MessageType::CompressedImage))
        };
        let need = |topic: &Topic| if is_image(topic) { Need::Head } else { Need::Skip };
        let needs: Vec<Need> = self.topics().iter().map(need).collect();
        let awaited = self.topics().iter().filter(|topic| is_image(topic) && topic.messages > 0).count();
        let mut encodings = BTreeMap::new();
        self.visit(&needs, &mut |found| {
            let kind = self.topics().get(found.topic).and_then(|topic| topic.kind.zip(topic.wire));
            if let Some(Ok(head)) = kind.map(|(kind, wire)| ImageHead::read(kind, wire, found.bytes)) {
                let size = head.size.map_or(String::new(), |size| format!(" {size}"));
                encodings.entry(found.topic).or_insert(format!("{}{size}", head.encoding));
            }
            if encodings.len() < awaited { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        })?;
        Ok(encodings)
    }

    /// Reads a message into `bytes` and drops their old content.
    ///
    /// # Errors
    /// The file cannot be read, or the part of it that holds the message is damaged.
    pub fn read(&self, position: Position, bytes: &mut Vec<u8>) -> Result<()> {
        let Some(file) = self.files.get(position.file as usize) else {
            return Err(Error::content(&self.path, "has fewer files than before", "open it again"));
        };
        file.read(position, bytes)?;
        unpack_message(bytes).map_err(|problem| {
            let problem = format!("a message at byte {} cannot be unpacked: {problem}", position.offset);
            Error::content(file.path(), problem, "record or copy the bag again")
        })
    }
}
