//! Decodes one kind of image ahead of its use, in order, on a worker thread.

use std::sync::Arc;
use std::time::{Duration, Instant};

use yfslam::unstable::Worker;

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
    worker: Worker<usize, Decoded<T>>,
    /// Number of entries, and of those that were handed to the thread.
    entries: usize,
    requested: usize,
}

impl<T: Send + Sync + 'static> PrefetchQueue<T> {
    /// Starts to decode `entries`; up to `look_ahead` decoded images wait in the queue.
    pub fn start(
        name: &'static str,
        entries: Arc<[FrameEntry]>,
        look_ahead: usize,
        mut decode: impl FnMut(&FrameEntry) -> std::result::Result<T, FrameFault> + Send + 'static,
    ) -> Result<Self> {
        let count = entries.len();
        let run = move |index: usize| {
            let started = Instant::now();
            let image = decode(entries.get(index)?).map(Arc::new);
            Some(Decoded { image, took: started.elapsed() })
        };
        let worker = Worker::spawn(name, look_ahead + 1, |_| run).map_err(|error| {
            Error::argument(
                format!("cannot start a decoder thread: {error}"),
                "raise the limit of threads for this user",
            )
        })?;
        let mut queue = Self { worker, entries: count, requested: 0 };
        (0..=look_ahead).for_each(|_| queue.request());
        Ok(queue)
    }

    /// Hands the next entry to the thread, if there is one.
    fn request(&mut self) {
        if self.requested < self.entries {
            // A thread that has ended is noticed when its answer is awaited.
            self.worker.send(self.requested);
            self.requested += 1;
        }
    }

    /// Returns the next image; waits until it is decoded.
    pub fn next(&mut self) -> Decoded<T> {
        let decoded = self.worker.wait();
        self.request();
        decoded.unwrap_or(Decoded { image: Err(FrameFault::DecoderStopped), took: Duration::ZERO })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn entries(count: i64) -> Arc<[FrameEntry]> {
        let entry = |t| FrameEntry { timestamp_ns: t, color: std::path::PathBuf::from("c").into(), paired_image: None };
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
