//! The border to C: all pointers, and nothing else that is unsafe.
//!
//! The types here stand for arguments of exported functions. Their values come from C alone, whose side of the contract is in `yfslam.h`:
//! a pointer is null or valid for what it points to, for as long as the call lasts, and handles come from this library and are not used
//! after they were freed. Everything that this module can check, it checks: null, alignment, sizes that overflow.
#![allow(unsafe_code, reason = "this is the layer that turns pointers of C into references")]

use std::ffi::{CStr, c_char, c_void};
use std::marker::PhantomData;
use std::mem::MaybeUninit;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::error::{self, Failure, Result, Status};

/// Calls `f` and returns its status; a panic becomes [`Status::Internal`].
pub fn guarded(f: impl FnOnce() -> Result) -> i32 {
    let status = match guarded_value(f) {
        Some(Ok(())) => Status::Ok,
        Some(Err(failure)) => error::keep(failure),
        None => error::keep(Failure::internal("a fault of the library; please report it")),
    };
    status as i32
}

/// Calls `f`; `None` after a panic.
pub fn guarded_value<T>(f: impl FnOnce() -> T) -> Option<T> {
    // What a panic has left half done is behind a lock that tells so, or belongs to the caller, who gets an error.
    catch_unwind(AssertUnwindSafe(f)).ok()
}

/// Defines exported functions.
macro_rules! export {
    ($($(#[$meta:meta])* fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block)*) => {
        /// The names of the functions of this file, for the test that compares them with the header.
        #[cfg(test)]
        pub const NAMES: &[&str] = &[$(stringify!($name)),*];
        $(
            $(#[$meta])*
            // The names begin with yfslam_, so that they are those of no other library.
            #[allow(unsafe_code, reason = "an exported name")]
            #[unsafe(no_mangle)]
            pub extern "C" fn $name($($arg: $type),*) $(-> $result)? $body
        )*
    };
}
pub(crate) use export;

/// A structure of C that begins with its size, or that has a fixed layout. Only fields that may hold any bits: numbers and pointers.
///
/// # Safety
/// The type is `repr(C)`, begins with a `u32` of its size, and all zeros and any other bits are a value of it.
pub unsafe trait Sized32: Copy {}

/// A text; null stands for none.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub struct Text<'a>(*const c_char, PhantomData<&'a c_char>);

impl<'a> Text<'a> {
    pub const NONE: Self = Self(std::ptr::null(), PhantomData);

    /// Returns the text; `None` for null.
    pub fn get(self, name: &str) -> Result<Option<&'a str>> {
        if self.0.is_null() {
            return Ok(None);
        }
        // SAFETY: not null, so by the contract a text that ends with a zero byte and outlives the call.
        let text = unsafe { CStr::from_ptr(self.0) };
        text.to_str().map(Some).map_err(|_| Failure::argument(format!("{name} is not text in UTF-8")))
    }

    /// Returns the text, which must be there.
    pub fn required(self, name: &str) -> Result<&'a str> {
        self.get(name)?.ok_or_else(|| Failure::argument(format!("{name} is NULL")))
    }
}

/// A structure that C gives.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub struct In<'a, T>(*const T, PhantomData<&'a T>);

impl<T: Sized32> In<'_, T> {
    /// Returns the structure; fields that the caller's version does not have are zero. `None` for null.
    pub fn get(self, name: &str) -> Result<Option<T>> {
        if self.0.is_null() {
            return Ok(None);
        }
        let size = self.0.cast::<u32>();
        check_aligned(self.0, name)?;
        // SAFETY: not null and aligned, and each structure begins with its size.
        let size = unsafe { size.read() } as usize;
        if size < size_of::<u32>() {
            return Err(no_size(name));
        }
        let mut value = MaybeUninit::<T>::zeroed();
        let common = size.min(size_of::<T>());
        // SAFETY: the caller's structure has `size` bytes and ours has its own size; both are different memory.
        unsafe { std::ptr::copy_nonoverlapping(self.0.cast::<u8>(), value.as_mut_ptr().cast::<u8>(), common) };
        // SAFETY: all bytes are set, and any bits are a value of the type.
        Ok(Some(unsafe { value.assume_init() }))
    }

    /// Returns the structure, which must be there.
    pub fn required(self, name: &str) -> Result<T> {
        self.get(name)?.ok_or_else(|| Failure::argument(format!("{name} is NULL")))
    }
}

/// A place for a structure that C gets.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub struct Out<'a, T>(*mut T, PhantomData<&'a mut T>);

impl<T: Sized32> Out<'_, T> {
    /// Checks that a structure can be written here.
    pub fn check(self, name: &str) -> Result {
        if self.0.is_null() {
            return Err(Failure::argument(format!("{name} is NULL")));
        }
        check_aligned(self.0, name)?;
        // SAFETY: not null and aligned, and each structure begins with its size.
        let size = unsafe { self.0.cast::<u32>().read() } as usize;
        if size < size_of::<u32>() { Err(no_size(name)) } else { Ok(()) }
    }

    /// Writes what the caller's version has of the structure, behind its size.
    pub fn set(self, name: &str, value: &T) -> Result {
        self.check(name)?;
        // SAFETY: `check` has seen that it is not null and aligned.
        let size = unsafe { self.0.cast::<u32>().read() } as usize;
        let (head, common) = (size_of::<u32>(), size.min(size_of::<T>()));
        let from = std::ptr::from_ref(value).cast::<u8>();
        // SAFETY: the caller's structure has `size` bytes and ours its own size, so `common` are in both, and they are different memory.
        unsafe { std::ptr::copy_nonoverlapping(from.add(head), self.0.cast::<u8>().add(head), common - head) };
        Ok(())
    }
}

/// A place for a new handle.
#[repr(transparent)]
pub struct OutHandle<'a, T>(*mut *mut T, PhantomData<&'a mut T>);

impl<T> OutHandle<'_, T> {
    /// Checks that a handle can be written here.
    pub fn check(&self, name: &str) -> Result {
        if self.0.is_null() { Err(Failure::argument(format!("{name} is NULL"))) } else { check_aligned(self.0, name) }
    }

    /// Hands `value` to C, which gives it back to [`Handle::free`].
    pub fn set(self, name: &str, value: T) -> Result {
        self.check(name)?;
        // SAFETY: not null and aligned, so by the contract a place for a pointer.
        unsafe { self.0.write(Box::into_raw(Box::new(value))) };
        Ok(())
    }
}

/// A handle that this library has given to C.
#[repr(transparent)]
pub struct Handle<'a, T>(*mut T, PhantomData<&'a T>);

impl<'a, T> Handle<'a, T> {
    /// Returns what the handle stands for; `None` for null.
    pub fn get(&self) -> Option<&'a T> {
        // SAFETY: null, or by the contract a handle from `OutHandle::set` that was not freed. Only shared references are made of it.
        unsafe { self.0.as_ref() }
    }

    /// Returns what the handle stands for, which must be there.
    pub fn required(&self, name: &str) -> Result<&'a T> {
        self.get().ok_or_else(|| Failure::argument(format!("{name} is NULL")))
    }

    /// Takes the handle back; nothing for null.
    pub fn free(self) {
        if !self.0.is_null() {
            // SAFETY: by the contract it comes from `OutHandle::set` and is not used again.
            let value = unsafe { Box::from_raw(self.0) };
            // A destructor that panics must not reach C.
            let _ = guarded_value(move || drop(value));
        }
    }
}

/// The rows of an image in memory of C.
#[derive(Clone, Copy)]
pub struct Rows<T> {
    pub pointer: *const T,
    /// Bytes from one row to the next; 0 for packed rows.
    pub stride: usize,
    pub width: usize,
    pub height: usize,
    /// Elements of a pixel.
    pub channels: usize,
}

impl<T: Copy> Rows<T> {
    /// Calls `f` with the elements and the number of elements from one row to the next.
    pub fn read<R>(self, name: &str, f: impl FnOnce(&[T], usize) -> R) -> Result<R> {
        let Self { pointer, stride, width, height, channels } = self;
        check_aligned(pointer, name)?;
        let row = width * channels;
        let (step, rest) = (stride / size_of::<T>(), stride % size_of::<T>());
        let step = if stride == 0 { row } else { step };
        if rest != 0 || step < row {
            let needed = row * size_of::<T>();
            return Err(Failure::argument(format!(
                "the stride of {name} is {stride} bytes, but a row has {needed}; give the bytes from one row to the next, or 0"
            )));
        }
        let length = height.checked_sub(1).and_then(|rows| rows.checked_mul(step)).and_then(|all| all.checked_add(row));
        let fits =
            |length: &usize| length.checked_mul(size_of::<T>()).is_some_and(|bytes| isize::try_from(bytes).is_ok());
        let length = length.filter(fits).ok_or_else(|| Failure::argument(format!("{name} is too large")))?;
        // SAFETY: aligned and, by the contract, valid for all rows; the last one may lack its padding. The length fits an isize.
        Ok(f(unsafe { std::slice::from_raw_parts(pointer, length) }, step))
    }
}

/// Returns the elements at `pointer`; none for null.
pub fn elements<'a, T: Copy>(pointer: *const T, count: usize, name: &str, _call: &'a ()) -> Result<&'a [T]> {
    if pointer.is_null() {
        return if count == 0 { Ok(&[]) } else { Err(Failure::argument(format!("{name} is NULL"))) };
    }
    check_aligned(pointer, name)?;
    if count.checked_mul(size_of::<T>()).is_none_or(|bytes| isize::try_from(bytes).is_err()) {
        return Err(Failure::argument(format!("{name} has {count} elements, which is too many")));
    }
    // SAFETY: aligned and, by the contract, valid for `count` elements while the call lasts; their size fits an isize.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// A function of C that finds people.
pub type DetectorFunction = unsafe extern "C" fn(
    user: *mut c_void,
    rgb: *const u8,
    width: u32,
    height: u32,
    detections: *mut crate::structs::Detection,
    capacity: usize,
    count: *mut usize,
) -> i32;

/// The function with its first argument.
pub struct DetectorCall {
    pub function: DetectorFunction,
    pub user: *mut c_void,
}

// SAFETY: the header says that the function is called on a thread of the library, so its argument may be used there.
unsafe impl Send for DetectorCall {}

impl DetectorCall {
    /// Calls the function; `None` if it fails or returns more detections than there is room for.
    pub fn call<'a>(
        &self,
        rgb: &[u8],
        [width, height]: [u32; 2],
        room: &'a mut [crate::structs::Detection],
    ) -> Option<&'a [crate::structs::Detection]> {
        let mut count = 0;
        // SAFETY: the pointers are valid for the sizes beside them; the function keeps its contract in the header.
        let status = unsafe {
            (self.function)(self.user, rgb.as_ptr(), width, height, room.as_mut_ptr(), room.len(), &raw mut count)
        };
        room.get(..count).filter(|_| status == 0)
    }
}

fn check_aligned<T>(pointer: *const T, name: &str) -> Result {
    if pointer.is_null() {
        return Err(Failure::argument(format!("{name} is NULL")));
    }
    if pointer.is_aligned() { Ok(()) } else { Err(Failure::argument(format!("{name} is not aligned to its elements"))) }
}

fn no_size(name: &str) -> Failure {
    Failure::argument(format!("struct_size of {name} is 0; initialise it with YFSLAM_…_INIT"))
}
