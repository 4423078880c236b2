//! Images between numpy and the core.
//!
//! In: arrays of any strides. Out: packed images, or an exception that names type and shape of the array and those that are needed.

use std::sync::Arc;

use numpy::ndarray::ArrayView2;
use numpy::{PyArray2, PyArray3, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use yfslam::{DepthImage, Image, RgbImage};

use crate::arrays::array;
use crate::error::failure;

/// Most rows or columns of an image; a larger array is a mistake.
const MAX_SIDE: usize = 16_384;

/// Returns the colour image of a uint8 array, height × width × 3 (red, green, blue) or height × width (grey).
///
/// # Errors
/// The type or the shape is another one.
pub fn color(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Arc<RgbImage>> {
    const NEEDED: &str = "uint8 of shape (height, width, 3), red, green, blue, or (height, width), grey";
    let array = untyped(value, name, NEEDED)?;
    if let Ok(rgb) = value.extract::<PyReadonlyArray3<'_, u8>>() {
        let view = rgb.as_array();
        let (height, width, channels) = view.dim();
        if channels != 3 || !is_size(width, height) {
            return Err(wrong_shape(array, name, NEEDED));
        }
        // Not the method of the array, which also takes Fortran's order for packed.
        let pixels: Vec<[u8; 3]> = match view.as_slice() {
            Some(packed) => packed.as_chunks::<3>().0.to_vec(),
            None => {
                let pixel = |row: usize, column: usize| std::array::from_fn(|c| view[[row, column, c]]);
                (0..height).flat_map(|row| (0..width).map(move |column| pixel(row, column))).collect()
            }
        };
        return image(width, height, pixels);
    }
    if let Ok(gray) = value.extract::<PyReadonlyArray2<'_, u8>>() {
        let view = gray.as_array();
        let (height, width) = view.dim();
        if !is_size(width, height) {
            return Err(wrong_shape(array, name, NEEDED));
        }
        return image(width, height, view.iter().map(|&gray| [gray; 3]).collect());
    }
    Err(wrong(array, name, NEEDED, "uint8"))
}

/// Returns the depth image of a uint16 array in units of `scale` metres, or of a float32 array in metres; both height × width.
///
/// # Errors
/// The type or the shape is another one, or the scale of a uint16 array is missing.
pub fn depth(value: &Bound<'_, PyAny>, scale: Option<f64>) -> PyResult<Arc<DepthImage>> {
    const NEEDED: &str = "uint16 (with depth_scale) or float32 (metres) of shape (height, width)";
    let array = untyped(value, "depth", NEEDED)?;
    if let Ok(units) = value.extract::<PyReadonlyArray2<'_, u16>>() {
        let view = units.as_array();
        let (height, width) = view.dim();
        if !is_size(width, height) {
            return Err(wrong_shape(array, "depth", NEEDED));
        }
        let Some(scale) = scale else {
            return Err(PyValueError::new_err(
                "depth is uint16, but its unit is unknown: pass depth_scale, in metres per unit, to track() or Slam(), or make the \
                 camera with it; 0.001 for millimetres, 1 / 5000 for TUM",
            ));
        };
        let metres_per_unit = scale as f32;
        if !(metres_per_unit > 0.0 && metres_per_unit.is_finite()) {
            let text = format!("depth_scale is {scale}; give metres per unit, such as 0.001 for millimetres");
            return Err(PyValueError::new_err(text));
        }
        let raw = plane(width, height, values(&view))?;
        return Ok(Arc::new(DepthImage { raw, metres_per_unit }));
    }
    if let Ok(metres) = value.extract::<PyReadonlyArray2<'_, f32>>() {
        let view = metres.as_array();
        let (height, width) = view.dim();
        if !is_size(width, height) {
            return Err(wrong_shape(array, "depth", NEEDED));
        }
        return DepthImage::from_f32(&values(&view), width, height, width).map(Arc::new).map_err(failure);
    }
    Err(wrong(array, "depth", NEEDED, "uint16 or float32"))
}

/// Returns the mask of movable objects of a uint8 or bool array, height × width: 0 where there is none.
///
/// # Errors
/// The type or the shape is another one.
pub fn mask(value: &Bound<'_, PyAny>) -> PyResult<Arc<Image<u8>>> {
    const NEEDED: &str = "uint8 or bool of shape (height, width), 0 where nothing can move";
    let array = untyped(value, "mask", NEEDED)?;
    let (height, width, pixels): (usize, usize, Vec<u8>) = if let Ok(mask) = value.extract::<PyReadonlyArray2<'_, u8>>()
    {
        let view = mask.as_array();
        (view.dim().0, view.dim().1, view.iter().copied().collect())
    } else if let Ok(mask) = value.extract::<PyReadonlyArray2<'_, bool>>() {
        let view = mask.as_array();
        (view.dim().0, view.dim().1, view.iter().map(|&moves| u8::from(moves)).collect())
    } else {
        return Err(wrong(array, "mask", NEEDED, "uint8 or bool"));
    };
    if is_size(width, height) { image(width, height, pixels) } else { Err(wrong_shape(array, "mask", NEEDED)) }
}

/// Returns a colour image as height × width × 3.
pub fn color_array<'py>(py: Python<'py>, image: &RgbImage) -> PyResult<Bound<'py, PyArray3<u8>>> {
    array(py, [image.height(), image.width(), 3], image.data().as_flattened().to_vec())
}

/// Returns an image of one channel as height × width.
pub fn plane_array<'py, T: numpy::Element + Copy>(
    py: Python<'py>,
    image: &Image<T>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    array(py, [image.height(), image.width()], image.data().to_vec())
}

fn is_size(width: usize, height: usize) -> bool {
    (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height)
}

/// Returns the elements row by row; in one piece where they lie so.
fn values<T: Copy>(view: &ArrayView2<'_, T>) -> Vec<T> {
    view.as_slice().map_or_else(|| view.iter().copied().collect(), <[T]>::to_vec)
}

fn image<T: Copy + Default>(width: usize, height: usize, pixels: Vec<T>) -> PyResult<Arc<Image<T>>> {
    plane(width, height, pixels).map(Arc::new)
}

fn plane<T: Copy + Default>(width: usize, height: usize, pixels: Vec<T>) -> PyResult<Image<T>> {
    Image::from_vec(width, height, pixels)
        .ok_or_else(|| PyValueError::new_err("the array does not have the number of elements of its shape"))
}

fn untyped<'a, 'py>(
    value: &'a Bound<'py, PyAny>,
    name: &str,
    needed: &str,
) -> PyResult<&'a Bound<'py, PyUntypedArray>> {
    value.cast::<PyUntypedArray>().map_err(|_| {
        let kind = value.get_type().name().map_or_else(|_| "something else".to_owned(), |name| name.to_string());
        PyTypeError::new_err(format!("{name} is {kind}, but must be a numpy array: {needed}"))
    })
}

/// Returns the exception for an array of another type or another number of dimensions.
fn wrong(array: &Bound<'_, PyUntypedArray>, name: &str, needed: &str, types: &str) -> PyErr {
    let dtype = array.dtype().to_string();
    if types.split(" or ").any(|known| known == dtype) {
        return wrong_shape(array, name, needed);
    }
    PyTypeError::new_err(format!("{name} has dtype {dtype}, but must be {needed}; convert it, such as with .astype()"))
}

fn wrong_shape(array: &Bound<'_, PyUntypedArray>, name: &str, needed: &str) -> PyErr {
    PyValueError::new_err(format!("{name} has shape {:?}, but must be {needed}", array.shape()))
}
