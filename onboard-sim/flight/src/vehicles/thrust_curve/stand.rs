//! The table of a test stand: the columns `time` and `thrust`, each with its unit.

use alloc::vec::Vec;
use alloc::{format, vec};

use crate::vehicle::thrust_curve::{ThrustCurve, ThrustPoint};
use crate::vehicles::table::{self, TableError};

use super::{ThrustCurveError, checked, rasp};

/// A motor burns while it has this share of its highest thrust (NFPA 1125).
const BURNS: f64 = 0.05;
/// Most points of a curve.
const POINTS_MAX: usize = 100;

/// The rows of a table: time, s, and thrust, N.
///
/// # Errors
/// [`TableError`] names the line, the column and what would be accepted.
pub fn read_stand(text: &str) -> Result<Vec<(f64, f64)>, TableError> {
    let mut rows: Vec<(f64, f64)> = Vec::new();
    for row in table::rows(text, &[("time", "s"), ("thrust", "n")], 2)? {
        let (line, [Some(time_s), Some(thrust_n)]) = row? else { continue };
        if rows.last().is_some_and(|last| time_s <= last.0) {
            let required = "times must increase from row to row";
            return Err(TableError::bad(line, "time", &format!("{time_s} s"), required));
        }
        rows.push((time_s, thrust_n));
    }
    Ok(rows)
}

/// A motor burnt on a stand. The head is that of a RASP file: name, diameter in mm, length in mm,
/// delays, propellant in kg, total mass in kg, maker. The rows before the burn give the zero of the
/// load cell.
///
/// # Errors
/// [`ThrustCurveError`] names the line, the field and what would be accepted.
pub fn from_stand(head: &str, text: &str) -> Result<ThrustCurve, ThrustCurveError> {
    let (mut data, line) = rasp::parse(head)?;
    let rows = read_stand(text)?;
    let peak_n = rows.iter().map(|row| row.1).fold(0.0, f64::max);
    let burns = |row: &(f64, f64)| row.1 > BURNS * peak_n;
    if let (Some(first), Some(last)) = (rows.iter().position(burns), rows.iter().rposition(burns)) {
        let Some((begins_s, _)) = first.checked_sub(1).and_then(|before| rows.get(before)).copied() else {
            let required = "the first row must be from before the burn: it gives the zero of the load cell";
            return Err(TableError::bad(1, "thrust", &format!("{} N at once", rows[0].1), required).into());
        };
        // Just before, the thrust rises already.
        let quiet = &rows[..first.div_ceil(2)];
        let zero_n = quiet.iter().map(|row| row.1).sum::<f64>() / quiet.len() as f64;
        let ends_s = rows.get(last + 1).map_or(2.0 * rows[last].0 - rows[last - 1].0, |row| row.0);
        let burn = rows[first..=last].iter().map(|row| (row.0 - begins_s, (row.1 - zero_n).max(0.0)));
        let whole = |inside: Vec<_>| [vec![(0.0, 0.0)], inside, vec![(ends_s - begins_s, 0.0)]].concat();
        let burn: Vec<(f64, f64)> = burn.collect();
        let mean = |block: &[(f64, f64)]| {
            let sum = block.iter().fold((0.0, 0.0), |sum, row| (sum.0 + row.0, sum.1 + row.1));
            (sum.0 / block.len() as f64, sum.1 / block.len() as f64)
        };
        let means = whole(burn.chunks(burn.len().div_ceil(POINTS_MAX)).map(mean).collect());
        // The corners that the means cut off.
        let scale = impulse_n_s(&whole(burn)) / impulse_n_s(&means);
        data.points.extend(means.iter().map(|(time_s, thrust_n)| ThrustPoint {
            time_s: libm::round(1e4 * time_s) / 1e4,
            thrust_n: libm::round(1e3 * scale * thrust_n) / 1e3,
        }));
    }
    checked((data, line))
}

/// Below straight lines between points of time, s, and thrust, N.
fn impulse_n_s(points: &[(f64, f64)]) -> f64 {
    points.windows(2).map(|pair| 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "ours 38 200 P 0.12 0.3 the club";

    /// A trapezium of 120 N s: 1 s up to 40 N, 2 s level, 1 s down, from 0.7 s on, by a load cell
    /// with a zero of 0.5 N: it is above 5 % of 40.5 N from 0.038 s to 3.962 s, which leaves out
    /// 0.06 N s.
    #[test]
    fn val_hand_a_burn_becomes_a_motor() {
        let thrust_n = |time_s: f64| 0.5 + (40.0 * time_s).min(40.0 * (4.0 - time_s)).clamp(0.0, 40.0);
        let table = (0..3_000)
            .map(|row| f64::from(row) * 2e-3)
            .fold(alloc::string::String::from("time_ms;thrust_kgf\n"), |table, time_s| {
                table + &format!("{};{}\n", 1e3 * time_s, thrust_n(time_s - 0.7) / 9.806_65)
            });
        let motor = from_stand(HEAD, &table).unwrap();
        assert!((motor.total_impulse_n_s() - 119.94).abs() < 0.05, "{}", motor.total_impulse_n_s());
        assert!((motor.burn_time_s() - 3.924).abs() < 0.005, "{}", motor.burn_time_s());
        assert!(motor.points().len() <= POINTS_MAX + 2);
        assert!((motor.thrust_at_n(2.0) - 40.0).abs() < 0.05, "{}", motor.thrust_at_n(2.0));
        let again = super::super::from_rasp(&super::super::to_rasp(&motor)).unwrap();
        assert_eq!((again.points(), again.name()), (motor.points(), "ours"));
    }

    #[test]
    fn a_wrong_table_is_named() {
        for (head, text, wrong) in [
            (
                HEAD,
                "time_s,thrust_n\n0,0\n0,2\n",
                "line 3: time is '0 s'; times must increase from row to row",
            ),
            (
                HEAD,
                "time_s,thrust_n\n0,30\n1,40\n",
                "line 1: thrust is '30 N at once'; the first row must be from before",
            ),
            (HEAD, "time_s,thrust_n\n0,0\n1,0\n", "thrust is missing"),
            ("ours 38 200 P 0.4 0.3", "", "line 1: propellant mass is '0.4 kg of 0.3 kg'"),
            ("ours 3.8 200 P 0.12 0.3", "time_s,thrust_n\n0,0\n1,40\n4,1\n", "line 1: diameter is '3.8 mm'"),
        ] {
            let error = alloc::string::ToString::to_string(&from_stand(head, text).unwrap_err());
            assert!(error.starts_with(wrong), "{error}");
        }
    }
}
