//! Formatting of numbers in messages.

/// A count with thousands separators: `15,002`.
pub fn grouped(n: usize) -> String {
    let digits = n.to_string();
    let mut grouped = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// A count with its noun in the singular or plural: `1 edge`, `2 edges`.
pub fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{} {}", grouped(n), if n == 1 { one } else { many })
}

/// Formats a number with `n` decimals; from a million on, with an exponent: `12.35`, `3.00e30`. Zero has no sign.
pub fn decimals(x: impl Into<f64>, n: usize) -> String {
    let x = x.into();
    let text = if x.abs() < 1e6 { format!("{x:.n$}") } else { format!("{x:.n$e}") };
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|b| matches!(b, b'0' | b'.')) => digits.to_owned(),
        _ => text,
    }
}

/// Formats a number in full, in its shortest form: `-1`, `0.25`, `3e38`.
pub fn number(x: f64) -> String {
    let text = format!("{x:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// Formats a size in whole MiB, KiB or bytes, whichever fits first, rounded up: `4 MiB`. For memory that is needed.
pub fn size_rounded_up(bytes: u64) -> String {
    size(bytes, u64::div_ceil)
}

/// Like [`size_rounded_up`], rounded down. For limits.
pub fn size_rounded_down(bytes: u64) -> String {
    size(bytes, |bytes, unit| bytes / unit)
}

fn size(bytes: u64, divide: impl Fn(u64, u64) -> u64) -> String {
    match bytes {
        0..0x400 => counted(bytes as usize, "byte", "bytes"),
        0x400..0x10_0000 => format!("{} KiB", divide(bytes, 0x400)),
        _ => format!("{} MiB", divide(bytes, 0x10_0000)),
    }
}

/// Formats a length with three significant digits.
pub fn three_digits(length: f32) -> String {
    let after_point = 2.0 - length.log10().floor();
    match after_point {
        -4.0..=8.0 => format!("{length:.0$}", after_point.max(0.0) as usize),
        _ => format!("{length:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{decimals, number, size_rounded_down, size_rounded_up, three_digits};

    #[test]
    fn sizes_below_a_mebibyte_are_not_zero() {
        for (bytes, up, down) in [
            (0, "0 bytes", "0 bytes"),
            (1, "1 byte", "1 byte"),
            (1023, "1,023 bytes", "1,023 bytes"),
            (1025, "2 KiB", "1 KiB"),
            (1 << 20, "1 MiB", "1 MiB"),
            ((1 << 20) + 1, "2 MiB", "1 MiB"),
            (4 << 30, "4096 MiB", "4096 MiB"),
        ] {
            assert_eq!((size_rounded_up(bytes).as_str(), size_rounded_down(bytes).as_str()), (up, down));
        }
    }

    #[test]
    fn whole_numbers_have_no_decimals() {
        for (x, text) in [(-1.0, "-1"), (0.25, "0.25"), (1e300, "1e300"), (f64::NAN, "NaN")] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn large_numbers_get_an_exponent_and_zero_no_sign() {
        for (x, text) in [(-0.001, "0.00"), (-999_999.0, "-999999.00"), (1e6, "1.00e6"), (3e38, "3.00e38")] {
            assert_eq!(decimals(x, 2), text);
        }
    }

    #[test]
    fn lengths_have_three_significant_digits() {
        for (length, text) in
            [(0.0213, "0.0213"), (3.79, "3.79"), (50_100.0, "50100"), (2.5e-8, "2.50e-8"), (0.0, "0.00e0")]
        {
            assert_eq!(three_digits(length), text);
        }
    }
}
