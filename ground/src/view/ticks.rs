//! Round numbers for scales: 1, 2 or 5 times a power of ten.

/// The smallest round step that divides a span into at most this many parts.
pub fn step(span: f64, parts_max: usize) -> f64 {
    let least = span / parts_max.max(1) as f64;
    if !(least.is_finite() && least > 0.0) {
        return 1.0;
    }
    let decade = libm::exp10(libm::floor(libm::log10(least)));
    [1.0, 2.0, 5.0].into_iter().map(|step| step * decade).find(|step| *step >= least).unwrap_or(10.0 * decade)
}

/// The multiples of a step from one value to another, ends included.
pub fn multiples(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (libm::ceil(from / step), libm::floor(to / step));
    // A scale of more ticks than columns would be an error of the caller; it must not hang.
    let count = (last - first + 1.0).clamp(0.0, 1_000.0) as u32;
    (0..count).map(move |k| (first + f64::from(k)) * step)
}

/// The decimals that a step needs.
pub fn decimals(step: f64) -> usize {
    (-libm::floor(libm::log10(step))).clamp(0.0, 6.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_few() {
        for (span, parts, expected) in
            [(100.0, 5, 20.0), (90.0, 4, 50.0), (0.7, 5, 0.2), (1.0, 1, 1.0), (301.0, 10, 50.0)]
        {
            assert!((step(span, parts) - expected).abs() < 1e-12, "{span} in {parts}: {}", step(span, parts));
        }
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!((step(odd, 4) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn ticks_are_the_multiples_inside() {
        assert_eq!(multiples(-12.0, 31.0, 10.0).collect::<Vec<_>>(), [-10.0, 0.0, 10.0, 20.0, 30.0]);
        assert_eq!(multiples(1.0, 4.0, 5.0).count(), 0);
        assert_eq!(multiples(0.0, 1e9, 1e-9).count(), 1_000);
        assert_eq!([decimals(0.2), decimals(5.0), decimals(0.05)], [1, 0, 2]);
    }
}
