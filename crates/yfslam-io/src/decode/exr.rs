//! OpenEXR by the `exr` crate: the channel `Z`, `depth…` or `Y`, else the only one or, where all are equal, the first.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::prelude::*;

use super::depth_values::DepthValues;
use super::{DEPTH_KIND_CURE, DEPTH_SIZE_CURE, DecodeError, ImageSize, MAX_PIXELS, check_size};

/// Most values of all channels that are decoded; it bounds the memory that a forged header can request.
const MAX_SAMPLES: usize = 4 * MAX_PIXELS;

/// Returns the depth values of an image.
pub fn decode_depth(bytes: &[u8], expected: Option<ImageSize>) -> std::result::Result<DepthValues, DecodeError> {
    let damaged = |error: Error| DecodeError::Damaged(error.to_string());
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?;
    for header in &meta.headers {
        let size = header.layer_size;
        let size = ImageSize { width: size.width(), height: size.height() };
        check_size(size, expected, DEPTH_SIZE_CURE)?;
        // Every channel is decoded.
        if header.channels.list.len().saturating_mul(size.width * size.height) > MAX_SAMPLES {
            return Err(DecodeError::TooLarge(size));
        }
    }
    let read = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = read.non_parallel().from_buffered(Cursor::new(bytes)).map_err(damaged)?;
    let layer = &image.layer_data;
    let size = ImageSize { width: layer.size.width(), height: layer.size.height() };
    let channels = &layer.channel_data.list;
    let named = |wanted: &str| {
        channels.iter().find(|channel| {
            let name = channel.name.to_string().to_lowercase();
            name == wanted || name.ends_with(&format!(".{wanted}")) || name.starts_with(&format!("{wanted}."))
        })
    };
    let channel =
        named("z").or_else(|| named("depth")).or_else(|| named("y")).or_else(|| named("r")).or(channels.first());
    let channel = channel.ok_or_else(|| DecodeError::WrongKind {
        found: "an OpenEXR image without channels".into(),
        cure: DEPTH_KIND_CURE,
    })?;
    let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
    if values.len() != size.width * size.height {
        return Err(DecodeError::Damaged("it has another number of pixels than its header".into()));
    }
    Ok(DepthValues { size, values })
}
