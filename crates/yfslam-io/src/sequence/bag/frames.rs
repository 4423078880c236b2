//! Gathers the time stamps and positions of the images of the chosen topics.

use super::choose::Chosen;
use super::received_note;
use crate::bag::{Bag, Found, Position};
use crate::message::wire::Wire;
use crate::message::{ImageHead, MessageType};

/// Time stamp, ns, topic and position of an image.
type Listed = (i64, usize, Position);

/// The images of the chosen topics.
pub struct Frames {
    lists: Vec<OneTopic>,
    /// Messages whose head cannot be read.
    pub unreadable: usize,
}

struct OneTopic {
    topic: usize,
    frame_id: String,
    images: Vec<Listed>,
    received_ns: Vec<i64>,
    /// Messages in another frame than the first.
    other_frame: usize,
}

impl Frames {
    pub fn new(chosen: &Chosen) -> Self {
        let one = |image: &super::ImageTopic| OneTopic {
            topic: image.topic,
            frame_id: image.head.frame_id.clone(),
            images: Vec::new(),
            received_ns: Vec::new(),
            other_frame: 0,
        };
        Self { lists: chosen.images().map(one).collect(), unreadable: 0 }
    }

    /// Adds an image; its bytes are those of its head.
    pub fn add(&mut self, kind: MessageType, wire: Wire, found: &Found<'_>) {
        let Some(list) = self.lists.iter_mut().find(|list| list.topic == found.topic) else { return };
        match ImageHead::read(kind, wire, found.bytes) {
            Ok(head) => {
                list.images.push((head.stamp_ns, found.topic, found.position));
                list.received_ns.push(found.received_ns);
                list.other_frame += usize::from(head.frame_id != list.frame_id);
            }
            Err(_) => self.unreadable += 1,
        }
    }

    /// Returns what must be said about the messages; uses the times of reception where there are no stamps.
    pub fn notes(&mut self, bag: &Bag) -> Vec<String> {
        let mut notes = Vec::new();
        for list in &mut self.lists {
            let first_ns = list.images.first().map_or(0, |image| image.0);
            if list.images.len() > 1 && list.images.iter().all(|image| image.0 == first_ns) {
                let images = list.images.iter_mut().zip(&list.received_ns);
                images.for_each(|(image, &received_ns)| image.0 = received_ns);
                notes.push(received_note(first_ns));
            }
            list.received_ns = Vec::new();
            // Recorders may write messages of one topic in another order than they were made.
            list.images.sort_by_key(|image| image.0);
            if list.other_frame > 0 {
                let name = bag.topics().get(list.topic).map_or("", |topic| &topic.name);
                notes.push(format!(
                    "{} of {} images of {name} are in another frame than its first, '{}': several cameras may share this topic",
                    list.other_frame,
                    list.images.len(),
                    list.frame_id
                ));
            }
        }
        notes.dedup();
        notes
    }

    /// Returns the time stamps of the colour or left images.
    pub fn stamps_ns(&self) -> Vec<i64> {
        self.lists.first().map_or(Vec::new(), |list| list.images.iter().map(|image| image.0).collect())
    }

    /// Returns the images by topic: colour or left first.
    pub fn into_lists(self) -> impl Iterator<Item = Vec<Listed>> {
        self.lists.into_iter().map(|list| list.images)
    }
}
