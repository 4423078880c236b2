//! The detector on its own thread, in parallel with feature extraction.
//!
//! In: an image. Out: its detections, waited for within the frame, or polled when they may arrive later. At most one image is
//! processed at a time.

use std::sync::Arc;

use crate::detect::{Detection, Detector, DetectorError, RollCompensation};
use crate::image::{Image, RgbImage};
use crate::worker::Worker;

/// An image, the roll of its camera in degrees, and the buffer for its detections.
type Request = (Arc<RgbImage>, i32, Vec<Detection>);
/// The result of the detector, and its output.
type Answer = (Result<(), DetectorError>, DetectorOutput);

/// The output of a detector for one image.
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
    /// If the operating system cannot start a thread.
    pub(crate) fn spawn(mut detector: Box<dyn Detector>) -> std::io::Result<Self> {
        let mut compensation = RollCompensation::default();
        let detect = move |(image, roll_deg, mut detections): Request| {
            let result = compensation.detect(&mut *detector, &image, roll_deg, &mut detections);
            let mask = compensation.mask(&*detector).cloned();
            Some((result, DetectorOutput { detections, mask }))
        };
        Ok(Self { worker: Worker::spawn("detector", 1, |_| detect)?, output: DetectorOutput::default(), busy: false })
    }

    /// Starts the detector on an image, unless another one is being processed.
    pub(crate) fn start(&mut self, image: &Arc<RgbImage>, roll_deg: i32) {
        if !self.busy && self.worker.is_alive() {
            // If the thread has ended, `finish` reports it.
            self.worker.send((Arc::clone(image), roll_deg, std::mem::take(&mut self.output.detections)));
            self.busy = true;
        }
    }

    /// Waits for the detections of the image that was started; `None` if there is none.
    pub(crate) fn finish(&mut self) -> Option<Result<&DetectorOutput, DetectorError>> {
        if !self.busy {
            return None;
        }
        let answer = self.worker.wait();
        Some(self.take(answer))
    }

    /// Returns the detections of the image that was started if they are ready.
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

    /// A detector that returns one box as wide as the image and fails at a width of 13 px.
    struct Widths;

    impl Detector for Widths {
        fn class_names(&self) -> &[String] {
            &[]
        }

        fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
            out.clear();
            let bbox = BoundingBox { x_max: image.width() as f32, ..Default::default() };
            out.push(Detection { class: 0, score: 1.0, bbox });
            if image.width() == 13 { Err(DetectorError("width of 13 px".to_owned())) } else { Ok(()) }
        }
    }

    #[test]
    fn each_answer_belongs_to_its_image_and_an_error_does_not_end_the_worker() {
        let mut worker = DetectorWorker::spawn(Box::new(Widths)).unwrap();
        for width in 10..16 {
            worker.start(&Arc::new(RgbImage::new(width, 2)), 0);
            match worker.finish().unwrap() {
                Ok(output) => assert_eq!(output.detections[0].bbox.x_max, width as f32),
                Err(_) => assert_eq!(width, 13),
            }
            assert!(worker.finish().is_none() && worker.poll().is_none(), "each answer is returned once");
        }
    }

    /// A detector that waits for the test.
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
    fn polling_never_waits_and_returns_the_detections_of_the_image_that_was_started() {
        let (resume, waiting) = sync_channel(1);
        let mut worker = DetectorWorker::spawn(Box::new(Slow(waiting))).unwrap();
        for width in 10..13 {
            worker.start(&Arc::new(RgbImage::new(width, 2)), 0);
            assert!(worker.poll().is_none());
        }
        resume.send(()).unwrap();
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
