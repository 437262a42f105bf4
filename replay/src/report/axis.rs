//! The axes of a chart: positions of values, and round numbers as labels.

/// One axis of a chart.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    pub(super) from: f64,
    pub(super) to: f64,
    /// Pixels at both ends.
    pub(super) at: (f64, f64),
}

impl Axis {
    pub(super) fn place(&self, value: f64) -> f64 {
        self.at.0 + (value - self.from) / (self.to - self.from) * (self.at.1 - self.at.0)
    }

    /// Round numbers in the axis, five or so, and their decimals.
    pub(super) fn ticks(&self) -> (Vec<f64>, usize) {
        let step = round_step((self.to - self.from) / 5.0);
        let first = (self.from / step).ceil();
        let count = ((self.to - first * step) / step).floor().clamp(0.0, 20.0) as usize;
        let decimals = (-libm::log10(step) + 1e-9).ceil().clamp(0.0, 9.0) as usize;
        ((0..=count).map(|k| (first + k as f64) * step).collect(), decimals)
    }
}

/// 1, 2 or 5 times a power of ten.
fn round_step(rough: f64) -> f64 {
    if !(rough > 0.0 && rough.is_finite()) {
        return 1.0;
    }
    let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let mantissa = rough / power;
    let nice = [1.0, 2.0, 5.0].into_iter().find(|nice| mantissa <= *nice).unwrap_or(10.0);
    nice * power
}

/// The lowest and the highest; a single value is widened.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let bounds = values.fold(None, |bounds: Option<(f64, f64)>, value| {
        Some(bounds.map_or((value, value), |(from, to)| (from.min(value), to.max(value))))
    });
    // A range whose width is not a finite number cannot be drawn.
    let bounds = bounds.filter(|(from, to)| (to - from).is_finite());
    bounds.map(|(from, to)| if to - from > 1e-12 { (from, to) } else { (from - 0.5, to + 0.5) })
}

/// With some room at both ends.
pub(super) fn padded(axis: Axis) -> Axis {
    let room = 0.06 * (axis.to - axis.from);
    Axis { from: axis.from - room, to: axis.to + room, ..axis }
}

/// Widens the axis that has more pixels a unit until both have the same.
pub(super) fn equalise(x: &mut Axis, y: &mut Axis) {
    let scale = |axis: &Axis| (axis.at.1 - axis.at.0).abs() / (axis.to - axis.from);
    let wanted = scale(x).min(scale(y));
    for axis in [x, y] {
        let middle = 0.5 * (axis.from + axis.to);
        let half = 0.5 * (axis.at.1 - axis.at.0).abs() / wanted;
        (axis.from, axis.to) = (middle - half, middle + half);
    }
}

/// A number on an axis.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    // Rounding can give a negative zero.
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        format!("{:.decimals$}", 0.0)
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(from: f64, to: f64) -> Axis {
        Axis { from, to, at: (0.0, 100.0) }
    }

    #[test]
    fn ticks_are_round_and_inside() {
        for (from, to) in [(0.0, 10.0), (-0.37, 0.41), (1e-6, 3e-6), (-250.0, 1e4)] {
            let (ticks, _) = axis(from, to).ticks();
            assert!((3..=11).contains(&ticks.len()), "{from} to {to}: {ticks:?}");
            assert!(ticks.iter().all(|tick| (from - 1e-9..=to + 1e-9).contains(tick)));
        }
        assert_eq!(round_step(0.03).to_bits(), 0.05_f64.to_bits());
        assert_eq!(number(-0.0, 1), "0.0");
    }
}
