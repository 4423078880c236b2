//! Decodes one kind of image ahead of its use, in order, on a thread with a bounded queue.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use super::FrameFault;
use crate::error::{Error, Result};
use crate::sequence::FrameEntry;

/// One decoded image.
pub struct Decoded<T> {
    /// The image, or why it cannot be used.
    pub image: std::result::Result<Arc<T>, FrameFault>,
    /// Time for reading and decoding.
    pub took: Duration,
}

/// A queue of images that a thread decodes in order.
pub struct PrefetchQueue<T> {
    /// `None` only while dropping.
    images: Option<Receiver<Decoded<T>>>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + Sync + 'static> PrefetchQueue<T> {
    /// Starts to decode `entries`; up to `look_ahead` decoded images wait in the queue.
    pub fn start(
        name: &str,
        entries: Arc<[FrameEntry]>,
        look_ahead: usize,
        mut decode: impl FnMut(&FrameEntry) -> std::result::Result<T, FrameFault> + Send + 'static,
    ) -> Result<Self> {
        let (sender, images) = sync_channel(look_ahead);
        let run = move || {
            for entry in entries.iter() {
                let started = Instant::now();
                let image = decode(entry).map(Arc::new);
                // The receiver is gone: the stream was dropped.
                if sender.send(Decoded { image, took: started.elapsed() }).is_err() {
                    return;
                }
            }
        };
        let thread = Builder::new().name(name.into()).spawn(run).map_err(|error| {
            Error::argument(
                format!("cannot start a decoder thread: {error}"),
                "raise the limit of threads for this user",
            )
        })?;
        Ok(Self { images: Some(images), thread: Some(thread) })
    }

    /// Returns the next image; waits until it is decoded.
    pub fn next(&mut self) -> Decoded<T> {
        let received = self.images.as_ref().and_then(|images| images.recv().ok());
        received.unwrap_or(Decoded { image: Err(FrameFault::DecoderStopped), took: Duration::ZERO })
    }
}

impl<T> Drop for PrefetchQueue<T> {
    fn drop(&mut self) {
        self.images = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the decoder has already been reported as `DecoderStopped`.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn entries(count: i64) -> Arc<[FrameEntry]> {
        let entry = |t| FrameEntry { timestamp_ns: t, color_path: "c".into(), paired_image: None };
        (0..count).map(entry).collect()
    }

    #[test]
    fn no_more_is_decoded_than_the_look_ahead_allows_and_a_drop_ends_the_thread() {
        let decoded = Arc::new(AtomicUsize::new(0));
        let count = decoded.clone();
        let mut queue = PrefetchQueue::start("test", entries(1000), 3, move |entry| {
            count.fetch_add(1, Ordering::SeqCst);
            Ok(entry.timestamp_ns)
        })
        .unwrap();
        for expected in 0..10 {
            assert_eq!(*queue.next().image.unwrap(), expected);
        }
        // Ten are taken, three wait, and the thread holds one.
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(decoded.load(Ordering::SeqCst), 14);
        drop(queue);
        assert_eq!(Arc::strong_count(&decoded), 1, "the thread and its decoder have ended");
    }

    #[test]
    fn a_panic_of_the_decoder_becomes_a_fault_of_every_remaining_frame() {
        let mut queue = PrefetchQueue::start("test", entries(3), 1, |entry| match entry.timestamp_ns {
            0 => Ok(()),
            _ => panic!("a defect of the decoder"),
        })
        .unwrap();
        assert!(queue.next().image.is_ok());
        assert!(matches!(queue.next().image, Err(FrameFault::DecoderStopped)));
        assert!(matches!(queue.next().image, Err(FrameFault::DecoderStopped)));
    }
}
