//! The zero of a rising function.

/// A zero is found this closely, in the unit of the argument.
const CLOSE: f64 = 1e-4;
/// Largest number of values asked for; about eight are usual.
const MOST_VALUES: usize = 60;

/// Where a function that rises from below zero at `low` passes zero, by false position; the value of an end that stays
/// twice is halved (the Illinois rule; Dowell and Jarratt, BIT 11, 1971). `None` if it is below zero at `high`; `low` if it
/// is above zero there.
pub(super) fn root(value_at: impl Fn(f64) -> f64, low: f64, high: f64) -> Option<f64> {
    let (mut below, mut above) = ((low, value_at(low)), (high, value_at(high)));
    if below.1 >= 0.0 {
        return Some(low);
    }
    if above.1 < 0.0 {
        return None;
    }
    let mut last_was_below = None;
    for _ in 0..MOST_VALUES {
        if above.0 - below.0 < CLOSE {
            break;
        }
        let at = below.0 - below.1 * (above.0 - below.0) / (above.1 - below.1);
        let value = value_at(at);
        if value.abs() < CLOSE {
            return Some(at);
        }
        let is_below = value < 0.0;
        let again = last_was_below == Some(is_below);
        if is_below {
            below = (at, value);
            above.1 *= if again { 0.5 } else { 1.0 };
        } else {
            above = (at, value);
            below.1 *= if again { 0.5 } else { 1.0 };
        }
        last_was_below = Some(is_below);
    }
    Some(above.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zero_is_found_and_its_absence_too() {
        assert!((root(|x| x * x * x - 8.0, 0.0, 300.0).unwrap() - 2.0).abs() < 2e-4);
        assert!((root(|x| if x < 3.0 { -1.0 } else { 1.0 }, 0.0, 5.0).unwrap() - 3.0).abs() < 2e-4);
        assert_eq!(root(|_| -1.0, 0.0, 1.0), None);
        assert_eq!(root(|_| 1.0, 0.0, 1.0), Some(0.0));
    }
}
