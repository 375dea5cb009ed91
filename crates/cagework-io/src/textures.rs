//! Sizes of encoded images, and which of a model's images are decoded: a few kilobytes can encode gigabytes of pixels.

use std::mem::discriminant;

use thiserror::Error;

use crate::look::{Look, LookImage};

/// Limit on the longer side of a drawn texture, pixels. [`MAX_DRAWN_PIXELS`] allows 16 textures of 2048 x 2048 pixels.
const MAX_SIDE: u32 = 2048;
/// Limit on an image, pixels (8192 x 8192): 256 MiB when decoded.
const MAX_PIXELS: u64 = 1 << 26;
/// Limit on all images of a model together, pixels. A browser decodes that many in about 5 s.
const MAX_TOTAL_PIXELS: u64 = 1 << 29;
/// Limit on all drawn textures together, pixels: 256 MiB, and a third more on the GPU for mipmaps.
const MAX_DRAWN_PIXELS: u64 = 1 << 26;

/// Smallest remaining part of the budget [`MAX_DRAWN_PIXELS`], pixels. With less, the textures of an additional model
/// are not decoded.
const MIN_DRAWN_PIXELS: u64 = 1 << 18;

/// Why an image is not decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
enum TextureError {
    #[error("its size cannot be read: the image is damaged")]
    Damaged,
    #[error("it has {width} x {height} pixels, more than the limit of {MAX_PIXELS}: make it smaller")]
    TooLarge { width: u32, height: u32 },
    #[error("the textures have more than {MAX_TOTAL_PIXELS} pixels in total: make them smaller")]
    Total,
    #[error("the images of the file overlap: export the file again")]
    Overlap,
    #[error("the textures of the models fill the limit of {MAX_DRAWN_PIXELS} pixels: make them smaller")]
    Full,
}

/// Which images of some models are decoded, and the size at which they are drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TexturePlan {
    /// Longer side of a drawn texture, pixels; larger images are scaled down.
    pub side: u32,
    /// Whether each image is decoded. `[n_models][n_images]`
    pub admitted: Vec<Vec<bool>>,
    /// Reasons why images are not decoded, each with the name of the first affected image.
    pub notices: Vec<String>,
}

impl TexturePlan {
    /// Plans the textures of models that are drawn together. `used`: pixels of the drawn textures of other models that
    /// are already open.
    #[must_use]
    pub fn new(looks: &[&Look], used: u64) -> Self {
        let budget = MAX_DRAWN_PIXELS.saturating_sub(used);
        // Textures that would be scaled down beyond recognition are not decoded.
        let mut left = if budget < MIN_DRAWN_PIXELS { 0 } else { MAX_TOTAL_PIXELS };
        let mut sizes = Vec::new();
        let mut refused: Vec<(&str, TextureError, usize)> = Vec::new();
        let mut admitted = Vec::new();
        for look in looks {
            let mut own = Vec::new();
            for image in &look.images {
                let answer = image.admit(&mut left).map_err(|error| match error {
                    TextureError::Total if budget < MIN_DRAWN_PIXELS => TextureError::Full,
                    other => other,
                });
                own.push(answer.is_ok());
                match answer {
                    Ok(size) => sizes.push(size),
                    Err(error) => {
                        let is_same = |other: &TextureError| discriminant(other) == discriminant(&error);
                        match refused.iter_mut().find(|(_, other, _)| is_same(other)) {
                            Some((_, _, more)) => *more += 1,
                            None => refused.push((&image.name, error, 0)),
                        }
                    }
                }
            }
            admitted.push(own);
        }
        let notice = |(name, error, more): (&str, TextureError, usize)| match more {
            0 => format!("texture '{name}' is not drawn: {error}"),
            _ => format!("texture '{name}' is not drawn ({more} more likewise): {error}"),
        };
        let notices = refused.into_iter().map(notice).collect();
        let drawn = |side: u32| -> u64 { sizes.iter().map(|&size| pixels(scaled(size, side))).sum() };
        let mut side = MAX_SIDE;
        while side > 1 && drawn(side) > budget {
            side /= 2;
        }
        Self { side, admitted, notices }
    }
}

fn pixels([width, height]: [u32; 2]) -> u64 {
    u64::from(width) * u64::from(height)
}

/// Size of an image after scaling its longer side down to `side`; smaller images keep their size.
fn scaled(size: [u32; 2], side: u32) -> [u32; 2] {
    let longer = size[0].max(size[1]).max(side);
    size.map(|n| (u64::from(n) * u64::from(side)).div_ceil(u64::from(longer)) as u32)
}

impl LookImage {
    /// Returns the size of the image if it may be decoded. Subtracts its pixels from `left`, the number of pixels that
    /// may still be decoded.
    fn admit(&self, left: &mut u64) -> Result<[u32; 2], TextureError> {
        if self.bytes.is_empty() {
            return Err(TextureError::Overlap);
        }
        let [width, height] = self.size().ok_or(TextureError::Damaged)?;
        let pixels = pixels([width, height]);
        if pixels > MAX_PIXELS {
            return Err(TextureError::TooLarge { width, height });
        }
        *left = left.checked_sub(pixels).ok_or(TextureError::Total)?;
        Ok([width, height])
    }

    /// Reads width and height from the image's header, pixels; `None` if the header is damaged.
    #[must_use]
    pub fn size(&self) -> Option<[u32; 2]> {
        let bytes = &self.bytes;
        let size = match self.mime.as_str() {
            // The offsets follow PNG (third edition), section 11.2.1, and KTX 2.0, section 3.
            "image/png" if part::<4>(bytes, 12)? == *b"IHDR" => [16, 20].map(|at| u32_be(bytes, at)),
            "image/ktx2" => [20, 24].map(|at| part(bytes, at).map(u32::from_le_bytes)),
            "image/jpeg" => return jpeg_size(bytes),
            "image/webp" => return webp_size(bytes),
            _ => return None,
        };
        let [Some(width), Some(height)] = size else { return None };
        Some([width, height])
    }
}

fn part<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

fn u32_be(bytes: &[u8], at: usize) -> Option<u32> {
    part(bytes, at).map(u32::from_be_bytes)
}

/// Reads the size of a JPEG from its start-of-frame segment (ITU-T T.81, B.1 and B.2.2).
fn jpeg_size(bytes: &[u8]) -> Option<[u32; 2]> {
    let mut at = 2;
    loop {
        at += bytes.get(at..)?.iter().position(|&b| b == 0xff)?;
        at += bytes.get(at..)?.iter().position(|&b| b != 0xff)?;
        let marker = *bytes.get(at)?;
        at += 1;
        match marker {
            0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf => {
                let [height, width] = [3, 5].map(|k| part(bytes, at + k).map(u16::from_be_bytes));
                return Some([width?.into(), height?.into()]);
            }
            0x00 | 0x01 | 0xd0..=0xd8 => {}
            _ => at += usize::from(u16::from_be_bytes(part(bytes, at)?)),
        }
    }
}

/// Reads the size of a WebP from its `VP8X` chunk or from its frame (RFC 9649, 2.5 to 2.7, and RFC 6386, 9.1).
fn webp_size(bytes: &[u8]) -> Option<[u32; 2]> {
    let u16_at = |at| part(bytes, at).map(|b| u32::from(u16::from_le_bytes(b)) & 0x3fff);
    match &part::<4>(bytes, 12)? {
        b"VP8X" => {
            let u24_at = |at| part(bytes, at).map(|[a, b, c]| u32::from_le_bytes([a, b, c, 0]) + 1);
            Some([u24_at(24)?, u24_at(27)?])
        }
        b"VP8L" => {
            let bits = u32::from_le_bytes(part(bytes, 21)?);
            Some([bits, bits >> 14].map(|n| (n & 0x3fff) + 1))
        }
        b"VP8 " => Some([u16_at(26)?, u16_at(28)?]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::look::sniff_image;

    fn image(bytes: Vec<u8>) -> LookImage {
        LookImage { name: String::new(), mime: sniff_image(&bytes).unwrap_or_default().to_owned(), bytes }
    }

    fn png(width: u32, height: u32) -> LookImage {
        let head = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
        image([head, width.to_be_bytes().to_vec(), height.to_be_bytes().to_vec()].concat())
    }

    /// Headers of 258 x 772 pixels, written by the encoders of Pillow 13.
    #[test]
    fn sizes_are_read_from_headers() {
        let jpeg = b"\xff\xd8\xff\xe0\0\x10JFIF\0\x01\x01\0\0\x01\0\x01\0\0\xff\xff\xc2\0\x11\x08\x03\x04\x01\x02\x03";
        let lossy = b"RIFF\0\0\0\0WEBPVP8 \0\0\0\0\xf0\xaf\0\x9d\x01\x2a\x02\x01\x04\x03";
        let lossless = b"RIFF\0\0\0\0WEBPVP8L\0\0\0\0\x2f\x01\xc1\xc0\0";
        let extended = b"RIFF\0\0\0\0WEBPVP8X\x0a\0\0\0\x10\0\0\0\x01\x01\0\x03\x03\0";
        let headers = [jpeg.to_vec(), lossy.to_vec(), lossless.to_vec(), extended.to_vec()];
        for found in headers.into_iter().map(image).chain([png(258, 772)]) {
            assert_eq!(found.size(), Some([258, 772]), "{}", found.mime);
            for n in 0..found.bytes.len() {
                let cut = LookImage { bytes: found.bytes[..n].to_vec(), ..found.clone() };
                assert_eq!(cut.size().filter(|_| n < 24), None, "{} cut after {n} bytes", found.mime);
            }
        }
    }

    #[test]
    fn images_beyond_the_limits_are_refused() {
        let plan = |sizes: &[[u32; 2]]| {
            let images = sizes.iter().map(|&[width, height]| png(width, height)).collect();
            TexturePlan::new(&[&Look { images, ..Look::default() }], 0)
        };
        let found = plan(&[[8192, 8192], [8193, 8192], [u32::MAX, u32::MAX], [64, 64]]);
        assert_eq!((found.side, found.admitted), (2048, vec![vec![true, false, false, true]]));
        let reason = "it has 8193 x 8192 pixels, more than the limit of 67108864: make it smaller";
        assert_eq!(found.notices, [format!("texture '' is not drawn (1 more likewise): {reason}")]);
        let many = plan(&[[8192, 8192]; 9]);
        assert_eq!(many.admitted[0], [[true; 8].as_slice(), &[false]].concat());
        assert!(many.notices[0].contains("536870912 pixels in total"), "{:?}", many.notices);
        // 16 textures of 2048 x 2048 pixels reach the limit, so the sides of 17 textures are halved.
        assert_eq!([16, 17, 65].map(|n| plan(&vec![[2048, 2048]; n]).side), [2048, 1024, 512]);
    }

    #[test]
    fn models_share_one_limit() {
        let look = Look { images: vec![png(2048, 2048)], ..Look::default() };
        let side = |used| TexturePlan::new(&[&look], used).side;
        // After 15 textures of 2048 x 2048 pixels there is room for one more, and after 15.5 for one of 1024 x 1024.
        assert_eq!([15 << 22, 31 << 21, (1 << 26) - (1 << 18)].map(side), [2048, 1024, 512]);
        let full = TexturePlan::new(&[&look], MAX_DRAWN_PIXELS);
        assert_eq!(full.admitted, [[false]]);
        assert!(full.notices[0].contains("the limit of 67108864 pixels"), "{:?}", full.notices);
    }
}
