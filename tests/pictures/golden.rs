//! Compares pictures with reviewed reference pictures, `tests/golden/NAME.png`.
//!
//! `CAGEWORK_BLESS=1 cargo test -p cagework-tests --test pictures` rewrites the references: review each one before
//! committing it. A picture that differs is written to `target/pictures/NAME.png`.

use std::path::{Path, PathBuf};

use cagework_gpu::Session;
use image::RgbaImage;

/// Width and height of all pictures, pixels.
pub(crate) const SIZE: [u32; 2] = [320, 240];

/// Largest allowed difference of two pictures, in 255ths, averaged over pixels and channels. Other adapters round
/// colours differently and have other sample positions, which moves edges by a fraction of a pixel.
const MEAN_TOLERANCE: f64 = 1.0;

/// A pixel counts as different if a channel differs by more than this, in 255ths.
const PIXEL_TOLERANCE: u8 = 40;

/// Largest allowed fraction of the picture's pixels that differ. Adapters rasterise lines and points differently, which
/// changes pixels at edges; 1 % of a picture is about half of its pixels at edges.
const MAX_DIFFERENT_FRACTION: f64 = 0.01;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Draws a session's picture and compares it with the reference.
#[track_caller]
pub(crate) fn assert_picture(session: &mut Session, name: &str) {
    let rgba = pollster::block_on(session.picture(SIZE, 1.0)).expect("the picture is drawn");
    let picture = RgbaImage::from_raw(SIZE[0], SIZE[1], rgba).expect("four bytes a pixel");
    let golden = root().join("golden").join(format!("{name}.png"));
    if std::env::var_os("CAGEWORK_BLESS").is_some() {
        picture.save(&golden).expect("the golden picture is written");
        return;
    }
    let expected = image::open(&golden)
        .unwrap_or_else(|e| panic!("{}: {e}; CAGEWORK_BLESS=1 makes it", golden.display()))
        .into_rgba8();
    if let Some(difference) = difference(&picture, &expected) {
        let actual = write_picture(&picture, name);
        panic!(
            "{name} differs from {}: {difference}\nthe picture is in {}",
            golden.display(),
            actual.display()
        );
    }
}

/// Writes a picture to `target/pictures`.
fn write_picture(picture: &RgbaImage, name: &str) -> PathBuf {
    let folder = root().join("../target/pictures");
    std::fs::create_dir_all(&folder).expect("the folder is made");
    let path = folder.join(format!("{name}.png"));
    picture.save(&path).expect("the picture is written");
    path
}

/// Describes how two pictures differ; `None` if they are equal within the tolerances.
fn difference(a: &RgbaImage, b: &RgbaImage) -> Option<String> {
    if a.dimensions() != b.dimensions() {
        return Some(format!("{:?} pixels instead of {:?}", a.dimensions(), b.dimensions()));
    }
    let differences: Vec<[u8; 4]> =
        a.pixels().zip(b.pixels()).map(|(a, b)| std::array::from_fn(|k| a.0[k].abs_diff(b.0[k]))).collect();
    let mean =
        differences.iter().flatten().map(|&d| f64::from(d)).sum::<f64>() / (4 * differences.len()) as f64;
    let different = differences.iter().filter(|d| d.iter().any(|&c| c > PIXEL_TOLERANCE)).count();
    let fraction = different as f64 / differences.len() as f64;
    (mean > MEAN_TOLERANCE || fraction > MAX_DIFFERENT_FRACTION).then(|| {
        format!(
            "mean {mean:.2} of 255 (at most {MEAN_TOLERANCE}), {:.2} % of the pixels differ (at most {} %)",
            100.0 * fraction,
            100.0 * MAX_DIFFERENT_FRACTION
        )
    })
}

#[test]
fn differences_above_a_tolerance_are_detected() {
    let grey = |value| RgbaImage::from_pixel(100, 100, image::Rgba([value, value, value, 255]));
    assert_eq!(difference(&grey(100), &grey(101)), None);
    assert!(difference(&grey(100), &grey(102)).is_some_and(|d| d.starts_with("mean 1.5")));
    let mut other = grey(100);
    for x in 0..100 {
        other.put_pixel(x, 50, image::Rgba([150, 100, 100, 255]));
    }
    assert_eq!(difference(&grey(100), &other), None);
    other.put_pixel(3, 51, image::Rgba([150, 100, 100, 255]));
    assert!(difference(&grey(100), &other).is_some_and(|d| d.contains("1.01 %")));
    assert!(difference(&grey(1), &RgbaImage::new(2, 2)).is_some());
}
