//! The C functions that `ufbx` calls. In wasm there is no C library.
//!
//! The names and types are those of `ufbx.c`, compiled with `UFBX_NO_LIBC` and `UFBX_NO_STDIO`. As in C, callers pass
//! valid pointers.

#![allow(unsafe_code, reason = "functions that C calls have raw pointers and unmangled names")]

use std::alloc::{Layout, alloc, dealloc, realloc};
use std::cmp::Ordering;
use std::ptr::null_mut;
use std::slice::from_raw_parts;

/// Alignment that `ufbx` expects of memory, bytes.
const ALIGN: usize = 8;

/// Layout of `size` bytes, at least 1; `None` if that is more than half the address space.
fn layout(size: usize) -> Option<Layout> {
    Layout::from_size_align(size.max(1), ALIGN).ok()
}

#[unsafe(no_mangle)]
extern "C" fn ufbx_malloc(size: usize) -> *mut u8 {
    // SAFETY: the layout is not empty.
    layout(size).map_or(null_mut(), |layout| unsafe { alloc(layout) })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_realloc(old: *mut u8, old_size: usize, new_size: usize) -> *mut u8 {
    if old.is_null() {
        return ufbx_malloc(new_size);
    }
    let (Some(layout), Some(new)) = (layout(old_size), layout(new_size)) else { return null_mut() };
    // SAFETY: `old` is from `ufbx_malloc` with `old_size`, which had the same layout.
    unsafe { realloc(old, layout, new.size()) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_free(old: *mut u8, old_size: usize) {
    if let Some(layout) = layout(old_size).filter(|_| !old.is_null()) {
        // SAFETY: `old` is from `ufbx_malloc` with `old_size`, which had the same layout.
        unsafe { dealloc(old, layout) }
    }
}

/// Bytes of an array that C passes.
///
/// # Safety
/// `count` bytes at `start` must be valid.
unsafe fn bytes<'a>(start: *const u8, count: usize) -> &'a [u8] {
    // SAFETY: promised by the caller. C may pass null with a count of zero, Rust's slices may not.
    if count == 0 { &[] } else { unsafe { from_raw_parts(start, count) } }
}

/// The bytes of a C string without its terminator.
///
/// # Safety
/// `text` must end in a zero byte.
unsafe fn string<'a>(text: *const u8) -> &'a [u8] {
    // SAFETY: promised by the caller: all bytes up to the zero byte are valid.
    unsafe { bytes(text, ufbx_strlen(text)) }
}

fn sign(order: Ordering) -> i32 {
    order as i32
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_strlen(text: *const u8) -> usize {
    let mut n = 0;
    // SAFETY: the string ends in a zero byte, so all bytes before it are valid.
    while unsafe { *text.add(n) } != 0 {
        n += 1;
    }
    n
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_memcpy(to: *mut u8, from: *const u8, count: usize) -> *mut u8 {
    // SAFETY: C passes `count` valid bytes each. `copy` also accepts ranges that overlap.
    unsafe { to.copy_from(from, count) };
    to
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_memmove(to: *mut u8, from: *const u8, count: usize) -> *mut u8 {
    // SAFETY: C passes `count` valid bytes each, which may overlap.
    unsafe { to.copy_from(from, count) };
    to
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_memset(to: *mut u8, value: i32, count: usize) -> *mut u8 {
    // SAFETY: C passes `count` valid bytes.
    unsafe { to.write_bytes(value as u8, count) };
    to
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_memchr(start: *const u8, value: i32, count: usize) -> *const u8 {
    // SAFETY: C passes `count` valid bytes.
    let found = unsafe { bytes(start, count) }.iter().position(|&b| b == value as u8);
    found.map_or(null_mut(), |at| start.wrapping_add(at))
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_memcmp(a: *const u8, b: *const u8, count: usize) -> i32 {
    // SAFETY: C passes `count` valid bytes each.
    sign(unsafe { bytes(a, count).cmp(bytes(b, count)) })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_strcmp(a: *const u8, b: *const u8) -> i32 {
    // SAFETY: both strings end in a zero byte.
    sign(unsafe { string(a).cmp(string(b)) })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ufbx_strncmp(a: *const u8, b: *const u8, count: usize) -> i32 {
    for k in 0..count {
        // SAFETY: no byte after a zero byte or after `count` is read.
        let (x, y) = unsafe { (*a.add(k), *b.add(k)) };
        if x != y || x == 0 {
            return sign(x.cmp(&y));
        }
    }
    0
}

/// Defines C functions of numbers.
macro_rules! math {
    ($($name:ident($($x:ident),+) = $value:expr;)+) => {
        $(#[unsafe(no_mangle)] extern "C" fn $name($($x: f64),+) -> f64 { $value })+
    };
}

math! {
    ufbx_sqrt(x) = x.sqrt();
    ufbx_sin(x) = x.sin();
    ufbx_cos(x) = x.cos();
    ufbx_tan(x) = x.tan();
    ufbx_asin(x) = x.asin();
    ufbx_acos(x) = x.acos();
    ufbx_atan(x) = x.atan();
    ufbx_atan2(y, x) = y.atan2(x);
    ufbx_pow(x, y) = x.powf(y);
    ufbx_fmin(x, y) = x.min(y);
    ufbx_fmax(x, y) = x.max(y);
    ufbx_fabs(x) = x.abs();
    ufbx_copysign(x, y) = x.copysign(y);
    ufbx_nextafter(x, y) = if x == y { y } else if x < y { x.next_up() } else { x.next_down() };
    ufbx_rint(x) = x.round_ties_even();
    ufbx_floor(x) = x.floor();
    ufbx_ceil(x) = x.ceil();
}

#[unsafe(no_mangle)]
extern "C" fn ufbx_isnan(x: f64) -> i32 {
    x.is_nan().into()
}
