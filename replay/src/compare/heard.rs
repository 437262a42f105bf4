//! What both logs can have, if one is a ground station's: the station starts after the vehicle, or ends before it.

use std::collections::BTreeMap;

use super::Series;

/// Signals of one log, by name.
type Signals = BTreeMap<String, Series>;

/// The time between the first and the last sample of a log, s.
fn recorded_s(signals: &Signals) -> Option<[f64; 2]> {
    let first = signals.values().filter_map(|series| series.times_s.first().copied()).reduce(f64::min)?;
    let last = signals.values().filter_map(|series| series.times_s.last().copied()).reduce(f64::max)?;
    Some([first, last])
}

/// The time that two logs have in common, in the first's time, s; the second's times are shifted. `None` if there is none.
pub(super) fn common_s(a: &Signals, b: &Signals, shift_s: f64) -> Option<[f64; 2]> {
    let ([from_a, to_a], [from_b, to_b]) = (recorded_s(a)?, recorded_s(b)?);
    let common = [from_a.max(from_b + shift_s), to_a.min(to_b + shift_s)];
    (common[0] < common[1]).then_some(common)
}

/// The signals with what lies within a time. Of the instants at both ends a log may have a part of the messages, so they
/// are left out.
pub(super) fn within(signals: &Signals, [from_s, to_s]: [f64; 2]) -> Signals {
    let part = |(name, series): (&String, &Series)| {
        let kept = series.times_s.partition_point(|time_s| *time_s <= from_s)
            ..series.times_s.partition_point(|time_s| *time_s < to_s);
        let (times_s, values) = (series.times_s.get(kept.clone())?, series.values.get(kept)?);
        let some = Series { times_s: times_s.to_vec(), values: values.to_vec(), whole: series.whole };
        (!times_s.is_empty()).then(|| (name.clone(), some))
    };
    signals.iter().filter_map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(times: &[(&str, &[f64])]) -> Signals {
        let series = |times_s: &[f64]| Series {
            times_s: times_s.to_vec(),
            values: times_s.iter().map(|time_s| 10.0 * time_s).collect(),
            whole: false,
        };
        times.iter().map(|(name, times_s)| ((*name).to_owned(), series(times_s))).collect()
    }

    #[test]
    fn only_the_time_that_both_recorded_is_kept() {
        let vehicle = log(&[("x", &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]), ("start", &[0.0]), ("end", &[5.0])]);
        let station = log(&[("x", &[-8.0, -7.0, -6.0]), ("start", &[]), ("end", &[])]);
        let common = common_s(&vehicle, &station, 9.0);
        assert_eq!(common, Some([1.0, 3.0]));
        assert_eq!(within(&vehicle, [1.0, 3.0]), log(&[("x", &[2.0])]));
        assert_eq!(common_s(&vehicle, &station, 0.0), None);
        assert_eq!(common_s(&vehicle, &Signals::new(), 0.0), None);
        // A time that ends before it begins holds nothing.
        assert_eq!(within(&vehicle, [3.0, 1.0]), Signals::new());
    }
}
