//! Image files: colour, depth, masks.

use yfslam::{DepthImage, Image, RgbImage};
use yfslam_io::decode::{
    DecodeError, ImageSize, decode_color, decode_depth, decode_depth_image, decode_mask, decode_photo,
};

use super::MOST_PIXELS;

/// The size that the images of the corpus have.
pub const SIZE: ImageSize = ImageSize { width: 16, height: 12 };

/// Decodes with an expected size, and without one if the image says that it is small. A large one would only take time.
fn both(decode: &mut dyn FnMut(Option<ImageSize>) -> Result<(), DecodeError>) -> bool {
    match decode(Some(SIZE)) {
        Ok(()) => decode(None).is_ok(),
        Err(DecodeError::WrongSize { found, .. }) if found.width.saturating_mul(found.height) <= MOST_PIXELS => {
            decode(None).is_ok()
        }
        Err(_) => false,
    }
}

/// A colour image: PNG, JPEG or PNM.
pub fn color(bytes: &[u8]) -> bool {
    let mut image = RgbImage::default();
    let accepted = both(&mut |expected| decode_color(bytes, expected, &mut image));
    if accepted {
        assert_eq!(image.data().len(), image.width() * image.height());
        assert!(decode_photo(bytes).is_ok(), "an image that is accepted is refused as a photo");
    }
    accepted
}

/// A depth image: PNG, PGM or NumPy, and TIFF and OpenEXR where their features are on.
pub fn depth(bytes: &[u8]) -> bool {
    let (mut raw, mut image) = (Image::default(), DepthImage::default());
    let integers = both(&mut |expected| decode_depth(bytes, expected, &mut raw));
    let any = both(&mut |expected| decode_depth_image(bytes, expected, 1000.0, &mut image));
    assert!(any || !integers, "integers that are accepted as such are refused as depth");
    if any {
        assert!(image.metres_per_unit.is_finite() && image.metres_per_unit > 0.0);
        assert!(image.raw.data().iter().all(|depth| *depth != u16::MAX) || !integers);
    }
    any
}

/// A mask in PNG.
pub fn mask(bytes: &[u8]) -> bool {
    let mut image = Image::default();
    both(&mut |expected| decode_mask(bytes, expected, &mut image))
}
