//! One thread that decodes one kind of image, in order, held back by a bounded channel.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use super::FrameFault;
use crate::error::{Error, Result};
use crate::sequence::FrameEntry;

/// One image as its thread hands it over.
pub struct Decoded<T> {
    /// The image, or why there is none.
    pub image: std::result::Result<Arc<T>, FrameFault>,
    /// Time of reading and decoding.
    pub took: Duration,
}

/// A thread that decodes one kind of image, in order.
pub struct Lane<T> {
    /// `None` only while dropping.
    images: Option<Receiver<Decoded<T>>>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + Sync + 'static> Lane<T> {
    /// Starts to decode `entries`; up to `look_ahead` images wait to be taken.
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
                "raise the limit of threads of this user",
            )
        })?;
        Ok(Self { images: Some(images), thread: Some(thread) })
    }

    /// Waits for the next image.
    pub fn next(&mut self) -> Decoded<T> {
        let received = self.images.as_ref().and_then(|images| images.recv().ok());
        received.unwrap_or(Decoded { image: Err(FrameFault::DecoderStopped), took: Duration::ZERO })
    }
}

impl<T> Drop for Lane<T> {
    fn drop(&mut self) {
        self.images = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the decoder has been reported as `DecoderStopped` already.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn entries(count: i64) -> Arc<[FrameEntry]> {
        let entry = |t| FrameEntry { timestamp_ns: t, color_path: "c".into(), companion: None };
        (0..count).map(entry).collect()
    }

    #[test]
    fn no_more_is_decoded_than_the_look_ahead_allows_and_a_drop_ends_the_thread() {
        let decoded = Arc::new(AtomicUsize::new(0));
        let count = decoded.clone();
        let mut lane = Lane::start("test", entries(1000), 3, move |entry| {
            count.fetch_add(1, Ordering::SeqCst);
            Ok(entry.timestamp_ns)
        })
        .unwrap();
        for expected in 0..10 {
            assert_eq!(*lane.next().image.unwrap(), expected);
        }
        // Ten taken, three waiting, one in the hands of the thread.
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(decoded.load(Ordering::SeqCst), 14);
        drop(lane);
        assert_eq!(Arc::strong_count(&decoded), 1, "the thread and its decoder are gone");
    }

    #[test]
    fn a_panic_of_a_decoder_becomes_a_fault_of_every_frame_left() {
        let mut lane = Lane::start("test", entries(3), 1, |entry| match entry.timestamp_ns {
            0 => Ok(()),
            _ => panic!("a defect of the decoder"),
        })
        .unwrap();
        assert!(lane.next().image.is_ok());
        assert!(matches!(lane.next().image, Err(FrameFault::DecoderStopped)));
        assert!(matches!(lane.next().image, Err(FrameFault::DecoderStopped)));
    }
}
