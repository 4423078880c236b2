//! The detector on a thread of its own, so that it runs beside feature extraction.
//!
//! In: one image a frame. Out: its boxes, joined in the same frame: the result does not depend on timing.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use crate::detection::{Detection, Detector, DetectorError};
use crate::image::RgbImage;

type Answer = (Result<(), DetectorError>, Vec<Detection>);

/// Runs a [`Detector`] beside the calling thread.
pub struct DetectorThread {
    /// `None` once the thread was told to end.
    requests: Option<SyncSender<(Arc<RgbImage>, Vec<Detection>)>>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
    buffer: Vec<Detection>,
}

impl DetectorThread {
    /// Starts the thread.
    ///
    /// # Errors
    /// If the operating system grants no thread.
    pub fn spawn(mut detector: Box<dyn Detector>) -> std::io::Result<Self> {
        let (requests, inbox) = sync_channel::<(Arc<RgbImage>, Vec<Detection>)>(1);
        let (outbox, answers) = sync_channel(1);
        let thread = std::thread::Builder::new().name("detector".to_owned()).spawn(move || {
            for (image, mut boxes) in inbox {
                let result = detector.detect(&image, &mut boxes);
                if outbox.send((result, boxes)).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { requests: Some(requests), answers, thread: Some(thread), buffer: Vec::new() })
    }

    /// Hands over the image of this frame. Each start is followed by one [`DetectorThread::finish`].
    pub fn start(&mut self, image: &Arc<RgbImage>) {
        if let Some(requests) = &self.requests {
            // A thread that is gone shows in `finish`.
            let _ = requests.send((Arc::clone(image), std::mem::take(&mut self.buffer)));
        }
    }

    /// Waits for the boxes of the image handed over last.
    ///
    /// # Errors
    /// If the detector could not process the image, or its thread has ended.
    pub fn finish(&mut self) -> Result<&[Detection], DetectorError> {
        let (result, boxes) =
            self.answers.recv().map_err(|_| DetectorError("the detector's thread has ended".to_owned()))?;
        self.buffer = boxes;
        result.map(|()| self.buffer.as_slice())
    }
}

impl Drop for DetectorThread {
    fn drop(&mut self) {
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the detector was reported by its thread already.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::BoundingBox;

    struct Widths;

    impl Detector for Widths {
        fn class_names(&self) -> &[String] {
            &[]
        }

        fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
            out.clear();
            let bbox = BoundingBox { x_max: image.width() as f32, ..Default::default() };
            out.push(Detection { class: 0, score: 1.0, bbox });
            if image.width() == 13 { Err(DetectorError("unlucky width".to_owned())) } else { Ok(()) }
        }
    }

    #[test]
    fn each_answer_belongs_to_its_image_and_an_error_ends_nothing() {
        let mut thread = DetectorThread::spawn(Box::new(Widths)).unwrap();
        for width in 10..16 {
            thread.start(&Arc::new(RgbImage::new(width, 2)));
            match thread.finish() {
                Ok(boxes) => assert_eq!(boxes[0].bbox.x_max, width as f32),
                Err(_) => assert_eq!(width, 13),
            }
        }
    }
}
