//! The detector on a thread of its own, so that it runs beside feature extraction.
//!
//! In: one image a frame. Out: its boxes, waited for in the same frame, so that the result does not depend on timing; or taken when they
//! are ready, so that no frame waits.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;

use crate::detection::{Detection, Detector, DetectorError};
use crate::image::{Image, RgbImage};
use crate::upright::Upright;

type Request = (Arc<RgbImage>, i32, Vec<Detection>);
type Answer = (Result<(), DetectorError>, Seen);

/// What the detector saw in an image.
#[derive(Debug, Default)]
pub struct Seen {
    /// Boxes, best score first.
    pub boxes: Vec<Detection>,
    /// As [`Detector::mask`].
    pub mask: Option<Image<u8>>,
}

/// Runs a [`Detector`] beside the calling thread.
pub struct DetectorThread {
    /// `None` once the thread was told to end.
    requests: Option<SyncSender<Request>>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
    seen: Seen,
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
                let mask = upright.mask(&*detector).cloned();
                if outbox.send((result, Seen { boxes, mask })).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { requests: Some(requests), answers, thread: Some(thread), seen: Seen::default(), busy: false })
    }

    /// Hands over the image of this frame and the roll of its camera, degrees, unless the boxes of an earlier one were not taken yet.
    pub fn start(&mut self, image: &Arc<RgbImage>, roll_deg: i32) {
        if let (Some(requests), false) = (&self.requests, self.busy) {
            // A thread that is gone shows when its boxes are asked for.
            let _ = requests.send((Arc::clone(image), roll_deg, std::mem::take(&mut self.seen.boxes)));
            self.busy = true;
        }
    }

    /// Waits for what was seen in the image handed over last; `None` if it was taken already.
    ///
    /// The error says that the detector could not process the image, or that its thread has ended.
    pub fn finish(&mut self) -> Option<Result<&Seen, DetectorError>> {
        let answer = self.busy.then(|| self.answers.recv().map_err(|_| ended()))?;
        Some(self.take(answer))
    }

    /// What was seen in the image handed over last if it is ready; never waits. Errors as in [`DetectorThread::finish`].
    pub fn poll(&mut self) -> Option<Result<&Seen, DetectorError>> {
        let answer = match self.answers.try_recv() {
            _ if !self.busy => return None,
            Err(TryRecvError::Empty) => return None,
            answer => answer.map_err(|_| ended()),
        };
        Some(self.take(answer))
    }

    fn take(&mut self, answer: Result<Answer, DetectorError>) -> Result<&Seen, DetectorError> {
        self.busy = false;
        let (result, seen) = answer?;
        self.seen = seen;
        result.map(|()| &self.seen)
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
                Ok(seen) => assert_eq!(seen.boxes[0].bbox.x_max, width as f32),
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
        let seen = loop {
            match thread.poll() {
                Some(seen) => break seen.unwrap(),
                None => std::thread::yield_now(),
            }
        };
        assert_eq!(seen.boxes[0].bbox.x_max, 10.0);
        assert!(thread.poll().is_none());
    }
}
