//! Roll compensation: the image of a rolled camera is turned upright for the detector, because networks detect people who stand
//! better than people who lie.
//!
//! In: poses of the camera, and an image. Out: the roll of the camera; detections and mask in the frame of the image, made in an
//! upright copy of it.

use nalgebra::Vector3;

use crate::detect::{BoundingBox, Detection, Detector, DetectorError};
use crate::geometry::Pose;
use crate::image::{Image, RgbImage};

/// Greatest length of the longer side of the upright copy, px: more than the input of the network has.
const MAX_SIDE_PX: f32 = 448.0;
/// Colour of the corners that the image does not fill: the grey with which networks of this kind are trained.
const PADDING: [u8; 3] = [114; 3];
/// Step in which the roll is rounded, degrees, so that methods whose poses differ little get the same copy.
const STEP_DEG: f64 = 5.0;
/// Least length of the gravity direction's component in the image plane; below it the camera is directed up or down and roll is
/// undefined.
const MIN_DOWN: f64 = 0.5;
/// Number of frames from which the gravity direction is used.
const MIN_FRAMES: usize = 30;

/// The gravity direction in the world, as the mean of the image's downward direction: a camera is upright on average.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GravityDirection {
    /// Sum of the downward directions of the images, in the world.
    sum: Vector3<f64>,
    frames: usize,
}

impl GravityDirection {
    /// Adds a frame with pose `t_cam_world`.
    pub(crate) fn add(&mut self, t_cam_world: &Pose) {
        self.sum += t_cam_world.rotation.inverse() * Vector3::y();
        self.frames += 1;
    }

    /// Returns the clockwise roll of a camera at `t_cam_world`, in steps of 5°. It is 0 up to `limit_deg`, during the first frames,
    /// and where the camera is directed so far up or down that roll is undefined.
    pub(crate) fn roll_deg(&self, t_cam_world: &Pose, limit_deg: f64) -> i32 {
        let down = t_cam_world.rotation * self.sum / self.frames.max(1) as f64;
        if self.frames < MIN_FRAMES || down.xy().norm() < MIN_DOWN {
            return 0;
        }
        let roll = libm::atan2(down.x, down.y).to_degrees();
        if roll.abs() > limit_deg { ((roll / STEP_DEG).round() * STEP_DEG) as i32 } else { 0 }
    }
}

/// Runs a detector on upright copies of the images of a rolled camera. The memory of the copy is reused.
#[derive(Debug, Default)]
pub struct RollCompensation {
    copy: RgbImage,
    /// Mask of the last image, if the image was turned.
    mask: Option<Image<u8>>,
}

impl RollCompensation {
    /// Detects objects as [`Detector::detect`] does, in an image whose camera is rolled clockwise by `roll_deg` degrees: the
    /// downward direction of the world points by this angle from the bottom to the right of the image. A box is the bounding box of
    /// the ellipse inscribed in the turned box, which fits people better than the turned box itself.
    ///
    /// # Errors
    /// Those of the detector.
    pub fn detect(
        &mut self,
        detector: &mut dyn Detector,
        image: &RgbImage,
        roll_deg: i32,
        out: &mut Vec<Detection>,
    ) -> Result<(), DetectorError> {
        self.mask = None;
        let Some(transform) = RollTransform::new(image, roll_deg) else { return detector.detect(image, out) };
        transform.copy_upright(image, &mut self.copy);
        detector.detect(&self.copy, out)?;
        for detection in out.iter_mut() {
            detection.bbox = transform.box_in_image(&detection.bbox);
        }
        out.retain(|detection| detection.bbox.area() > 0.0);
        self.mask = detector.mask().map(|mask| transform.mask_in_image(mask, image));
        Ok(())
    }

    /// Returns the mask as [`Detector::mask`] does, for the last image of `detector`.
    pub fn mask<'a>(&'a self, detector: &'a dyn Detector) -> Option<&'a Image<u8>> {
        self.mask.as_ref().or_else(|| detector.mask())
    }
}

/// The similarity between an upright copy and its image: position from the centre, in the image = M · that in the copy.
struct RollTransform {
    sin: f32,
    cos: f32,
    /// Pixels of the image per pixel of the copy.
    scale: f32,
    /// Centre of the image, px.
    middle: [f32; 2],
    /// Centre of the copy, px.
    copy_middle: [f32; 2],
    /// Width and height of the copy, px.
    copy_size: [usize; 2],
}

impl RollTransform {
    /// Returns the transform, `None` if the image need not be turned.
    fn new(image: &RgbImage, roll_deg: i32) -> Option<Self> {
        if roll_deg == 0 || image.data().is_empty() {
            return None;
        }
        let (sin, cos) = libm::sincosf((roll_deg as f32).to_radians());
        let [width, height] = [image.width(), image.height()].map(|side| side as f32);
        let turned_size = [width * cos.abs() + height * sin.abs(), width * sin.abs() + height * cos.abs()];
        let scale = (turned_size[0].max(turned_size[1]) / MAX_SIDE_PX).max(1.0);
        let copy_size = turned_size.map(|side| (side / scale).ceil() as usize);
        let copy_middle = copy_size.map(|side| side as f32 / 2.0);
        Some(Self { sin, cos, scale, middle: [width / 2.0, height / 2.0], copy_middle, copy_size })
    }

    /// Fills the copy by bilinear interpolation.
    fn copy_upright(&self, image: &RgbImage, copy: &mut RgbImage) {
        let [columns, rows] = self.copy_size;
        copy.resize(columns, rows);
        let (right, bottom) = (image.width() as f32 - 1.0, image.height() as f32 - 1.0);
        for row in 0..rows {
            let y = row as f32 + 0.5 - self.copy_middle[1];
            for (column, pixel) in copy.row_mut(row).iter_mut().enumerate() {
                let [u, v] = self.to_image([column as f32 + 0.5 - self.copy_middle[0], y]).map(|at| at - 0.5);
                *pixel = if u > -0.5 && v > -0.5 && u < right + 0.5 && v < bottom + 0.5 {
                    bilinear(image, u.clamp(0.0, right), v.clamp(0.0, bottom))
                } else {
                    PADDING
                };
            }
        }
    }

    /// Returns a mask of the copy in the frame of the image.
    fn mask_in_image(&self, mask: &Image<u8>, image: &RgbImage) -> Image<u8> {
        let mut turned = Image::new(image.width(), image.height());
        let Self { sin, cos, scale, middle, copy_middle, .. } = self;
        for row in 0..image.height() {
            let dy = (row as f32 + 0.5 - middle[1]) / scale;
            for (column, pixel) in turned.row_mut(row).iter_mut().enumerate() {
                let dx = (column as f32 + 0.5 - middle[0]) / scale;
                let (x, y) = (copy_middle[0] + cos * dx - sin * dy, copy_middle[1] + sin * dx + cos * dy);
                *pixel = mask.get(x.max(0.0) as usize, y.max(0.0) as usize).copied().unwrap_or(0);
            }
        }
        turned
    }

    /// Returns the position in the image, px, of a position relative to the centre of the copy.
    fn to_image(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let Self { sin, cos, scale, middle, .. } = self;
        [middle[0] + scale * (cos * x + sin * y), middle[1] + scale * (cos * y - sin * x)]
    }

    /// Returns a box of the copy in the frame of the image, clipped to the image.
    fn box_in_image(&self, bbox: &BoundingBox) -> BoundingBox {
        let BoundingBox { x_min, y_min, x_max, y_max } = bbox;
        let [mx, my] = self.copy_middle;
        let [x, y] = self.to_image([(x_min + x_max) / 2.0 - mx, (y_min + y_max) / 2.0 - my]);
        let [a, b] = [(x_max - x_min) / 2.0 * self.scale, (y_max - y_min) / 2.0 * self.scale];
        let reach = [libm::hypotf(a * self.cos, b * self.sin), libm::hypotf(a * self.sin, b * self.cos)];
        let clip = |at: f32, axis: usize| at.clamp(0.0, 2.0 * self.middle[axis]);
        BoundingBox {
            x_min: clip(x - reach[0], 0),
            y_min: clip(y - reach[1], 1),
            x_max: clip(x + reach[0], 0),
            y_max: clip(y + reach[1], 1),
        }
    }
}

/// Returns the interpolated colour at a position inside the rectangle of pixel centres.
fn bilinear(image: &RgbImage, u: f32, v: f32) -> [u8; 3] {
    let (x, y) = (u as usize, v as usize);
    let (fx, fy) = (u - x as f32, v - y as f32);
    let (next_x, next_y) = ((x + 1).min(image.width() - 1), (y + 1).min(image.height() - 1));
    let (upper, lower) = (image.row(y), image.row(next_y));
    std::array::from_fn(|channel| {
        let mix = |row: &[[u8; 3]]| f32::from(row[x][channel]) * (1.0 - fx) + f32::from(row[next_x][channel]) * fx;
        (mix(upper) * (1.0 - fy) + mix(lower) * fy + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    use super::*;

    /// A detector of white pixels: their bounding box and mask.
    #[derive(Default)]
    struct White(Image<u8>);

    impl Detector for White {
        fn mask(&self) -> Option<&Image<u8>> {
            Some(&self.0)
        }

        fn class_names(&self) -> &[String] {
            &[]
        }

        fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
            out.clear();
            let mut bbox = BoundingBox { x_min: f32::MAX, y_min: f32::MAX, x_max: f32::MIN, y_max: f32::MIN };
            for y in 0..image.height() {
                for x in (0..image.width()).filter(|x| image.row(y)[*x][0] > 150) {
                    bbox.x_min = bbox.x_min.min(x as f32);
                    bbox.y_min = bbox.y_min.min(y as f32);
                    bbox.x_max = bbox.x_max.max(x as f32 + 1.0);
                    bbox.y_max = bbox.y_max.max(y as f32 + 1.0);
                }
            }
            out.push(Detection { class: 0, score: 1.0, bbox });
            self.0 = Image::new(image.width(), image.height());
            self.0.data_mut().iter_mut().zip(image.data()).for_each(|(class, pixel)| *class = u8::from(pixel[0] > 150));
            Ok(())
        }
    }

    proptest! {
        /// The image of a rolled camera shows an ellipse that is upright in the world: in the copy the box is that of the upright
        /// ellipse, in the image it bounds the ellipse as shown there.
        #[test]
        fn an_object_is_detected_upright_and_its_box_bounds_it_in_the_image(
            roll in (-36i32..=36).prop_map(|step| step * 5),
            x in 250.0f32..390.0, y in 190.0f32..290.0, a in 20.0f32..60.0, b in 60.0f32..120.0,
        ) {
            let (sin, cos) = (roll as f32).to_radians().sin_cos();
            let mut image = RgbImage::new(640, 480);
            for row in 0..480 {
                for (column, pixel) in image.row_mut(row).iter_mut().enumerate() {
                    let (dx, dy) = (column as f32 + 0.5 - x, row as f32 + 0.5 - y);
                    // Components along right and down of the world.
                    let (right, down) = (cos * dx - sin * dy, sin * dx + cos * dy);
                    if (right / a).powi(2) + (down / b).powi(2) < 1.0 {
                        *pixel = [255; 3];
                    }
                }
            }
            let (mut expected, mut found) = (Vec::new(), Vec::new());
            let (mut plain, mut other) = (White::default(), White::default());
            plain.detect(&image, &mut expected)?;
            let mut upright = RollCompensation::default();
            upright.detect(&mut other, &image, roll, &mut found)?;
            if roll != 0 {
                let mut copy = Vec::new();
                White::default().detect(&upright.copy, &mut copy)?;
                let BoundingBox { x_min, y_min, x_max, y_max } = copy[0].bbox;
                prop_assert!(((y_max - y_min) / (x_max - x_min) / (b / a) - 1.0).abs() < 0.12, "{:?}", copy[0].bbox);
            }
            let mask = upright.mask(&other).map(|mask| mask.data().iter().zip(plain.0.data()));
            let [both, either] = [2, 1].map(|least| mask.clone().unwrap().filter(|(a, b)| **a + **b >= least).count());
            prop_assert!(both as f32 > 0.9 * either as f32, "{both} {either}");
            prop_assert!(found[0].bbox.iou(&expected[0].bbox) > 0.9, "{:?} {:?}", found[0].bbox, expected[0].bbox);
        }

        /// If the camera rolls clockwise, the downward direction turns to the right of the image.
        #[test]
        fn roll_does_not_depend_on_yaw_and_pitch(roll in -170.0f64..170.0, yaw in -3.0f64..3.0, pitch in -0.7f64..0.7) {
            let mut down = GravityDirection::default();
            (0..60).for_each(|_| down.add(&Pose::identity()));
            // Yaw about the vertical axis of the world, then pitch, then roll about the optical axis.
            let turn = |axis: nalgebra::Vector3<f64>, angle: f64| UnitQuaternion::new(axis * angle);
            let (x, y, z) = (nalgebra::Vector3::x(), nalgebra::Vector3::y(), nalgebra::Vector3::z());
            let rotation = turn(z, -roll.to_radians()) * turn(x, pitch) * turn(y, yaw);
            let pose = Pose::from_parts(nalgebra::Translation3::identity(), rotation);
            let found = down.roll_deg(&pose, 20.0);
            prop_assert!(if roll.abs() < 19.9 { found == 0 } else { roll.abs() < 20.1 || (f64::from(found) - roll).abs() <= 2.5 + 1e-9 }, "{found}");
        }
    }

    #[test]
    fn the_roll_of_a_swinging_camera_is_right_after_some_frames() {
        let swinging = |frame: usize| {
            let roll = 25.0 * (frame as f64 / 20.0).cos();
            Pose::from_parts(
                nalgebra::Translation3::identity(),
                UnitQuaternion::new(Vector3::z() * -f64::to_radians(roll)),
            )
        };
        let mut down = GravityDirection::default();
        for frame in 0..300 {
            let found = f64::from(down.roll_deg(&swinging(frame), 0.0));
            assert!(frame >= MIN_FRAMES || found == 0.0, "{found}");
            let roll = 25.0 * (frame as f64 / 20.0).cos();
            assert!(frame < 120 || (found - roll).abs() < 10.0, "{frame}: {found} {roll}");
            down.add(&swinging(frame));
        }
    }

    #[test]
    fn an_empty_image_is_passed_to_the_detector() {
        let mut found = Vec::new();
        RollCompensation::default().detect(&mut White::default(), &RgbImage::default(), 90, &mut found).unwrap();
        assert_eq!(found.len(), 1);
    }
}
