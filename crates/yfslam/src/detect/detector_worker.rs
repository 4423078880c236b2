//! The detector on a thread of its own, beside feature extraction.
//!
//! In: an image. Out: its detections, joined within the frame, or polled when they may be late. One image is under way at most.

use std::sync::Arc;

use crate::detect::{Detection, Detector, DetectorError, RollCompensation};
use crate::image::{Image, RgbImage};
use crate::worker::Worker;

/// An image, the roll of its camera in degrees, and the buffer for its detections.
type Request = (Arc<RgbImage>, i32, Vec<Detection>);
type Answer = (Result<(), DetectorError>, DetectorOutput);

/// What a detector found in one image.
#[derive(Debug, Default)]
pub(crate) struct DetectorOutput {
    /// The detections, best score first.
    pub detections: Vec<Detection>,
    /// The mask of a detector that segments.
    pub mask: Option<Image<u8>>,
}

/// Runs a detector on a thread.
pub(crate) struct DetectorWorker {
    worker: Worker<Request, Answer>,
    output: DetectorOutput,
    busy: bool,
}

impl DetectorWorker {
    /// Starts the thread.
    ///
    /// # Errors
    /// If the operating system grants no thread.
    pub(crate) fn spawn(mut detector: Box<dyn Detector>) -> std::io::Result<Self> {
        let mut compensation = RollCompensation::default();
        let detect = move |(image, roll_deg, mut detections): Request| {
            let result = compensation.detect(&mut *detector, &image, roll_deg, &mut detections);
            let mask = compensation.mask(&*detector).cloned();
            Some((result, DetectorOutput { detections, mask }))
        };
        Ok(Self { worker: Worker::spawn("detector", 1, |_| detect)?, output: DetectorOutput::default(), busy: false })
    }

    /// Hands over an image, unless one is under way.
    pub(crate) fn start(&mut self, image: &Arc<RgbImage>, roll_deg: i32) {
        if !self.busy && self.worker.is_alive() {
            // A thread that has ended is noticed when its answer is awaited.
            self.worker.send((Arc::clone(image), roll_deg, std::mem::take(&mut self.output.detections)));
            self.busy = true;
        }
    }

    /// Waits for the detections of the image under way; `None` if there is none.
    pub(crate) fn finish(&mut self) -> Option<Result<&DetectorOutput, DetectorError>> {
        if !self.busy {
            return None;
        }
        let answer = self.worker.wait();
        Some(self.take(answer))
    }

    /// Returns the detections of the image under way if they are ready.
    pub(crate) fn poll(&mut self) -> Option<Result<&DetectorOutput, DetectorError>> {
        if !self.busy {
            return None;
        }
        match self.worker.poll() {
            None if self.worker.is_alive() => None,
            answer => Some(self.take(answer)),
        }
    }

    fn take(&mut self, answer: Option<Answer>) -> Result<&DetectorOutput, DetectorError> {
        self.busy = false;
        let ended = || DetectorError("the detector's thread has ended".to_owned());
        let (result, output) = answer.ok_or_else(ended)?;
        self.output = output;
        result.map(|()| &self.output)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, sync_channel};

    use super::*;
    use crate::detect::BoundingBox;

    /// Returns one box as wide as the image; fails at a width of 13 px.
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
        let mut worker = DetectorWorker::spawn(Box::new(Widths)).unwrap();
        for width in 10..16 {
            worker.start(&Arc::new(RgbImage::new(width, 2)), 0);
            match worker.finish().unwrap() {
                Ok(output) => assert_eq!(output.detections[0].bbox.x_max, width as f32),
                Err(_) => assert_eq!(width, 13),
            }
            assert!(worker.finish().is_none() && worker.poll().is_none(), "each answer is given once");
        }
    }

    struct Slow(Receiver<()>);

    impl Detector for Slow {
        fn class_names(&self) -> &[String] {
            &[]
        }

        fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
            self.0.recv().map_err(|_| DetectorError("the test has ended".to_owned()))?;
            Widths.detect(image, out)
        }
    }

    #[test]
    fn polling_never_waits_and_gives_the_detections_of_the_image_that_was_started() {
        let (go, gate) = sync_channel(1);
        let mut worker = DetectorWorker::spawn(Box::new(Slow(gate))).unwrap();
        for width in 10..13 {
            worker.start(&Arc::new(RgbImage::new(width, 2)), 0);
            assert!(worker.poll().is_none());
        }
        go.send(()).unwrap();
        let output = loop {
            match worker.poll() {
                Some(output) => break output.unwrap(),
                None => std::thread::yield_now(),
            }
        };
        assert_eq!(output.detections[0].bbox.x_max, 10.0);
        assert!(worker.poll().is_none());
    }
}
