//! Reads how many groups of prefix codes a lossless WebP image (VP8L) has, without decoding its pixels. The image decoder
//! builds the tables of all groups before it decodes a pixel, and a group of a few bytes in the file can take 24 kB.
//!
//! Source: RFC 9649, WebP Image Format, sections 3.4 to 3.8. The section numbers below are of this document.

/// Bits of the image, lowest first.
struct Bits<'a> {
    bytes: &'a [u8],
    /// Position of the next bit.
    next: usize,
}

impl Bits<'_> {
    /// Reads an integer of `n` bits; `None` after the last byte.
    fn take(&mut self, n: u32) -> Option<usize> {
        let mut value = 0;
        for k in 0..n {
            let byte = usize::from(*self.bytes.get(self.next / 8)?);
            value |= (byte >> (self.next % 8) & 1) << k;
            self.next += 1;
        }
        Some(value)
    }

    fn flag(&mut self) -> Option<bool> {
        Some(self.take(1)? == 1)
    }

    /// Reads a length or distance that begins with the prefix `symbol` (3.6.2.2), and returns it.
    fn take_length(&mut self, symbol: usize) -> Option<usize> {
        if symbol < 4 {
            return Some(symbol + 1);
        }
        let n = (symbol - 2) >> 1;
        Some(((2 + (symbol & 1)) << n) + self.take(n as u32)? + 1)
    }
}

/// A canonical prefix code (3.7.2).
#[derive(Default)]
struct PrefixCode {
    /// Number of codes of each length.
    counts: [usize; 16],
    /// Symbols in the order of their codes.
    symbols: Vec<usize>,
}

impl PrefixCode {
    /// The code with these lengths of its symbols, where 0 means that the symbol is not used.
    fn of_lengths(lengths: &[usize]) -> Self {
        let mut code = Self::default();
        for length in 1..16 {
            let before = code.symbols.len();
            code.symbols.extend((0..lengths.len()).filter(|&symbol| lengths[symbol] == length));
            code.counts[length] = code.symbols.len() - before;
        }
        code
    }

    /// Reads the code of an alphabet of `n` symbols.
    fn read(bits: &mut Bits<'_>, n: usize) -> Option<Self> {
        if bits.flag()? {
            return Self::read_simple(bits, n);
        }
        const ORDER: [usize; 19] = [17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
        let mut lengths = [0; 19];
        let n_lengths = 4 + bits.take(4)?;
        for &symbol in &ORDER[..n_lengths] {
            lengths[symbol] = bits.take(3)?;
        }
        let of_length = Self::of_lengths(&lengths);
        let mut left = match bits.flag()? {
            true => {
                let width = 2 + 2 * bits.take(3)? as u32;
                2 + bits.take(width)?
            }
            false => n,
        };
        let (mut lengths, mut previous) = (Vec::new(), 8);
        while lengths.len() < n && left > 0 {
            left -= 1;
            let (length, times) = match of_length.decode(bits)? {
                16 => (previous, 3 + bits.take(2)?),
                17 => (0, 3 + bits.take(3)?),
                18 => (0, 11 + bits.take(7)?),
                length => (length, 1),
            };
            previous = if length == 0 { previous } else { length };
            lengths.extend(std::iter::repeat_n(length, times));
        }
        (lengths.len() <= n).then(|| Self::of_lengths(&lengths))
    }

    /// Reads the code of one or two symbols of an alphabet of `n`, whose codes have 0 or 1 bits.
    fn read_simple(bits: &mut Bits<'_>, n: usize) -> Option<Self> {
        let two = bits.flag()?;
        let width = if bits.flag()? { 8 } else { 1 };
        let mut code = Self { symbols: vec![bits.take(width)?], ..Self::default() };
        if two {
            code.symbols.push(bits.take(8)?);
        }
        code.counts[1] = code.symbols.len();
        code.symbols.iter().all(|&symbol| symbol < n).then_some(code)
    }

    /// Reads a symbol.
    fn decode(&self, bits: &mut Bits<'_>) -> Option<usize> {
        if let [symbol] = self.symbols[..] {
            return Some(symbol);
        }
        let (mut code, mut first, mut index) = (0, 0, 0);
        for count in &self.counts[1..] {
            code |= bits.take(1)?;
            if code < first + count {
                return self.symbols.get(index + code - first).copied();
            }
            index += count;
            (first, code) = (2 * (first + count), 2 * code);
        }
        None
    }
}

/// Number of bits of the color cache's index, 0 without a cache (3.6.2.3).
fn color_cache(bits: &mut Bits<'_>) -> Option<u32> {
    Some(if bits.flag()? { bits.take(4)? as u32 } else { 0 })
}

/// Reads an image of `n` pixels that has one group of prefix codes: data of a transform, or the group of each block of
/// pixels. Returns the largest number of a group in it (3.7.2.2). Pixels that are copied have numbers that occurred before.
fn largest_group(bits: &mut Bits<'_>, n: usize) -> Option<usize> {
    let cache = color_cache(bits)?;
    let colors = if cache == 0 { 0 } else { 1 << cache };
    let mut codes = Vec::with_capacity(5);
    for symbols in [256 + 24 + colors, 256, 256, 256, 40] {
        codes.push(PrefixCode::read(bits, symbols)?);
    }
    let [green, red, blue, alpha, distance] = &codes[..] else { return None };
    let (mut done, mut largest) = (0, 0);
    while done < n {
        match green.decode(bits)? {
            low @ 0..256 => {
                largest = largest.max(red.decode(bits)? << 8 | low);
                blue.decode(bits)?;
                alpha.decode(bits)?;
                done += 1;
            }
            length @ 256..280 => {
                done += bits.take_length(length - 256)?;
                let symbol = distance.decode(bits)?;
                bits.take_length(symbol)?;
            }
            _ => done += 1,
        }
    }
    Some(largest)
}

/// Number of blocks of 2^`log2` pixels along `size` pixels.
fn blocks(size: usize, log2: usize) -> usize {
    size.div_ceil(1 << log2)
}

/// The data of the first VP8L chunk of a WebP file (2.3).
fn vp8l(file: &[u8]) -> Option<&[u8]> {
    let mut rest = file.get(12..)?;
    loop {
        let (head, body) = rest.split_first_chunk::<8>()?;
        let size = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        if head.starts_with(b"VP8L") {
            return Some(&body[..size.min(body.len())]);
        }
        rest = body.get(size.checked_next_multiple_of(2)?..)?;
    }
}

/// Number of groups of prefix codes of a lossless WebP image, at most 65,536; `None` if its header is damaged.
pub(super) fn n_code_groups(file: &[u8]) -> Option<u64> {
    let mut bits = Bits { bytes: vp8l(file)?, next: 8 };
    let (mut width, height) = (1 + bits.take(14)?, 1 + bits.take(14)?);
    bits.take(4)?;
    let mut done = [false; 4];
    while bits.flag()? {
        let transform = bits.take(2)?;
        if std::mem::replace(&mut done[transform], true) {
            return None;
        }
        match transform {
            // Predictor and color transform.
            0 | 1 => {
                let log2 = 2 + bits.take(3)?;
                largest_group(&mut bits, blocks(width, log2) * blocks(height, log2))?;
            }
            // Subtract green.
            2 => {}
            // Color indexing: several indices of few colors share a pixel.
            _ => {
                let n_colors = 1 + bits.take(8)?;
                largest_group(&mut bits, n_colors)?;
                let log2 = [2, 4, 16].iter().filter(|&&n| n_colors <= n).count();
                width = blocks(width, log2);
            }
        }
    }
    color_cache(&mut bits)?;
    if !bits.flag()? {
        return Some(1);
    }
    let log2 = 2 + bits.take(3)?;
    let largest = largest_group(&mut bits, blocks(width, log2) * blocks(height, log2))?;
    Some(1 + largest as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A WebP file of a VP8L chunk with these bits: numbers, each with its number of bits.
    fn file(numbers: &[(usize, usize)]) -> Vec<u8> {
        let bits: Vec<bool> =
            numbers.iter().flat_map(|&(number, n)| (0..n).map(move |k| number >> k & 1 == 1)).collect();
        let bytes = bits.chunks(8).map(|byte| (0..).zip(byte).map(|(k, &bit)| u8::from(bit) << k).sum());
        let data: Vec<u8> = [0x2f].into_iter().chain(bytes).collect();
        let size = (data.len() as u32).to_le_bytes();
        [b"RIFF\0\0\0\0WEBPXTRA\x01\0\0\0..VP8L", &size[..], &data].concat()
    }

    /// A prefix code of one symbol.
    fn one(symbol: usize) -> Vec<(usize, usize)> {
        vec![(1, 1), (0, 1), (1, 1), (symbol, 8)]
    }

    #[test]
    fn groups_are_counted_behind_all_transforms() {
        // 5 x 4 pixels.
        let size = [(4, 14), (3, 14), (0, 4)];
        // An image of one color: no cache, and five codes of one symbol.
        let plain = [vec![(0, 1)], one(0), one(0), one(0), one(0), one(0)].concat();
        // Predictor with blocks of 4 x 4, subtract green, and 16 colors, two of which share a pixel: 3 x 4 are left.
        let transforms =
            [vec![(1, 1), (0, 2), (0, 3)], plain.clone(), vec![(5, 3), (7, 3), (15, 8)], plain].concat();
        // One block of 4 x 4 pixels. Green is 3 or 0xff, red is 1.
        let green = vec![(1, 1), (1, 1), (1, 1), (3, 8), (0xff, 8)];
        let groups = [vec![(0, 2), (1, 1), (0, 3), (0, 1)], green, one(1), one(0), one(0), one(0)].concat();
        let numbers = [&size[..], &transforms, &groups, &[(1, 1)]].concat();
        assert_eq!(n_code_groups(&file(&numbers)), Some(0x200));
        let without = [&size[..], &[(0, 3), (0, 1)]].concat();
        assert_eq!(n_code_groups(&file(&without)), Some(1));
        // The distance of a copy has one of 40 prefixes.
        let copied = |distance| {
            let codes = [one(0), one(0), one(0), one(0), one(distance)].concat();
            n_code_groups(&file(&[&size[..], &[(1, 1), (0, 2), (0, 3), (0, 1)], &codes, &[(0, 3)]].concat()))
        };
        assert_eq!((copied(39), copied(40)), (Some(1), None));
        let twice = [&size[..], &[(5, 3), (5, 3)]].concat();
        assert_eq!(n_code_groups(&file(&twice)), None);
        assert_eq!(n_code_groups(b"RIFF\0\0\0\0WEBP"), None);
    }
}
