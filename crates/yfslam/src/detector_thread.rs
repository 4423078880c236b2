//! The detector on a thread of its own, so that it runs beside feature extraction.
//!
//! In: one image a frame. Out: its boxes, waited for in the same frame, so that the result does not depend on timing; or taken when they
//! are ready, so that no frame waits.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;

use crate::detection::{Detection, Detector, DetectorError};
use crate::image::RgbImage;
use crate::upright::Upright;

type Request = (Arc<RgbImage>, i32, Vec<Detection>);
type Answer = (Result<(), DetectorError>, Vec<Detection>);

/// Runs a [`Detector`] beside the calling thread.
pub struct DetectorThread {
    /// `None` once the thread was told to end.
    requests: Option<SyncSender<Request>>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
    buffer: Vec<Detection>,
    /// Whether an image was handed over whose boxes were not taken yet.
    busy: bool,
}

impl DetectorThread {
    /// Starts the thread.
    ///
    /// # Errors
    /// If the operating system grants no thread.
    pub fn spawn(mut detector: Box<dyn Detector>) -> std::io::Result<Self> {
        let (requests, inbox) = sync_channel::<Request>(1);
        let (outbox, answers) = sync_channel(1);
        let thread = std::thread::Builder::new().name("detector".to_owned()).spawn(move || {
            let mut upright = Upright::default();
            for (image, roll_deg, mut boxes) in inbox {
                let result = upright.detect(&mut *detector, &image, roll_deg, &mut boxes);
                if outbox.send((result, boxes)).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { requests: Some(requests), answers, thread: Some(thread), buffer: Vec::new(), busy: false })
    }

    /// Hands over the image of this frame and the roll of its camera, degrees, unless the boxes of an earlier one were not taken yet.
    pub fn start(&mut self, image: &Arc<RgbImage>, roll_deg: i32) {
        if let (Some(requests), false) = (&self.requests, self.busy) {
            // A thread that is gone shows when its boxes are asked for.
            let _ = requests.send((Arc::clone(image), roll_deg, std::mem::take(&mut self.buffer)));
            self.busy = true;
        }
    }

    /// Waits for the boxes of the image handed over last; `None` if they were taken already.
    ///
    /// The error says that the detector could not process the image, or that its thread has ended.
    pub fn finish(&mut self) -> Option<Result<&[Detection], DetectorError>> {
        let answer = self.busy.then(|| self.answers.recv().map_err(|_| ended()))?;
        Some(self.take(answer))
    }

    /// The boxes of the image handed over last if they are ready; never waits. Errors as in [`DetectorThread::finish`].
    pub fn poll(&mut self) -> Option<Result<&[Detection], DetectorError>> {
        let answer = match self.answers.try_recv() {
            _ if !self.busy => return None,
            Err(TryRecvError::Empty) => return None,
            answer => answer.map_err(|_| ended()),
        };
        Some(self.take(answer))
    }

    fn take(&mut self, answer: Result<Answer, DetectorError>) -> Result<&[Detection], DetectorError> {
        self.busy = false;
        let (result, boxes) = answer?;
        self.buffer = boxes;
        result.map(|()| self.buffer.as_slice())
    }
}

fn ended() -> DetectorError {
    DetectorError("the detector's thread has ended".to_owned())
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
            thread.start(&Arc::new(RgbImage::new(width, 2)), 0);
            match thread.finish().unwrap() {
                Ok(boxes) => assert_eq!(boxes[0].bbox.x_max, width as f32),
                Err(_) => assert_eq!(width, 13),
            }
            assert!(thread.finish().is_none() && thread.poll().is_none(), "each answer is given once");
        }
    }

    /// Answers when told to.
    struct Slow(Receiver<()>);

    impl Detector for Slow {
        fn class_names(&self) -> &[String] {
            &[]
        }

        fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
            self.0.recv().map_err(|_| DetectorError("nobody waits".to_owned()))?;
            Widths.detect(image, out)
        }
    }

    #[test]
    fn polling_never_waits_and_gives_the_boxes_of_the_image_that_was_begun() {
        let (go, told) = sync_channel(1);
        let mut thread = DetectorThread::spawn(Box::new(Slow(told))).unwrap();
        for width in 10..13 {
            // Busy with the first: the others are passed over.
            thread.start(&Arc::new(RgbImage::new(width, 2)), 0);
            assert!(thread.poll().is_none());
        }
        go.send(()).unwrap();
        let boxes = loop {
            match thread.poll() {
                Some(boxes) => break boxes.unwrap(),
                None => std::thread::yield_now(),
            }
        };
        assert_eq!(boxes[0].bbox.x_max, 10.0);
        assert!(thread.poll().is_none());
    }
}
