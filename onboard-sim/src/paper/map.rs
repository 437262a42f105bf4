//! Whether a plan exists that lands the paper's vehicle.
//!
//! Every cell is one cold solve of its problem with a settled end, from both bent initial guesses. A cell lands if the plan
//! converges and ends inside Table 2.

use campaign::map::{Axis, Cell, Finding, Map, MapError, Quantity, map_of};
use nmpc::paper::{HORIZON, THRUST_N, model, settled, start};
use nmpc::{Problem, SolveStatus};

use super::cases::broken;

/// What it can be mapped over.
const POSSIBLE: &[Quantity] = &[
    Quantity::ThrustToWeight,
    Quantity::Height,
    Quantity::Speed,
    Quantity::Tilt,
    Quantity::Rate,
    Quantity::LateralSpeed,
    Quantity::ThrustScale,
];

/// Computes the map over `x` and `y`; `progress` is called with the cells done, from any thread.
///
/// # Errors
/// The axes do not suit the paper's vehicle.
pub(crate) fn map(axes: [Axis; 2], progress: &(dyn Fn(usize) + Sync)) -> Result<Map, MapError> {
    map_of(("the paper's vehicle", POSSIBLE), axes, progress, |x, y| Ok(cell(axes, [x, y])))
}

fn cell(axes: [Axis; 2], values: [f64; 2]) -> Cell {
    let (mut initial, mut thrust_n, mut thrust_scale) = (start(), THRUST_N, 1.0);
    for (axis, value) in axes.into_iter().zip(values) {
        match axis.quantity {
            Quantity::ThrustToWeight => {
                let params = model().params;
                thrust_n = value * params.mass_kg * params.gravity_m_s2;
            }
            Quantity::Height => initial.z_m = value,
            Quantity::Speed => initial.u_m_s = -value,
            Quantity::Tilt => initial.theta_rad = (90.0 + value).to_radians(),
            Quantity::Rate => initial.q_rad_s = value.to_radians(),
            Quantity::LateralSpeed => initial.w_m_s = value,
            Quantity::ThrustScale => thrust_scale = value,
            // Not among those that are possible.
            Quantity::IgnitionHeight | Quantity::Wind => {}
        }
    }
    let thrust_n = vec![thrust_scale * thrust_n; HORIZON];
    let solution = nmpc::solve(&Problem { thrust_n, ..settled(initial, HORIZON) }, None);
    if solution.status == SolveStatus::NotLandable {
        return Cell {
            finding: Finding::NotLandable,
            touchdown_speed_m_s: solution.best_touchdown_speed_m_s,
        };
    }
    let Some(end) = solution.states.last() else {
        return Cell { finding: Finding::Misses, touchdown_speed_m_s: f64::NAN };
    };
    let lands = broken(end).is_empty() && solution.status == SolveStatus::Converged;
    Cell {
        finding: if lands { Finding::Lands } else { Finding::Misses },
        touchdown_speed_m_s: end.speed_m_s(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use campaign::map::svg;
    use campaign::run::threads;

    fn small_map(jobs: usize) -> Map {
        let x = Axis { quantity: Quantity::ThrustToWeight, from: 0.95, to: 1.2, count: 6 };
        let y = Axis { quantity: Quantity::Height, from: 11.0, to: 19.0, count: 5 };
        threads(Some(jobs)).unwrap().install(|| map([x, y], &|_| ())).unwrap()
    }

    #[test]
    fn the_map_does_not_depend_on_the_number_of_jobs() {
        assert_eq!(small_map(1), small_map(3));
    }

    /// 33.3 N from 15 m lands (thrust to weight 1.13); 30 N (1.02) and less than the weight do not.
    #[test]
    fn val_hand_integration_and_study_agree_with_the_map() {
        let weight_n = model().params.mass_kg * model().params.gravity_m_s2;
        let at = |thrust_n: f64| {
            let x = Axis { quantity: Quantity::ThrustToWeight, from: thrust_n / weight_n, to: 2.0, count: 1 };
            let y = Axis { quantity: Quantity::Height, from: 15.0, to: 15.0, count: 1 };
            map([x, y], &|_| ()).unwrap().cells[0]
        };
        assert_eq!(at(33.3).finding, Finding::Lands);
        assert_eq!(at(30.0).finding, Finding::NotLandable);
        assert!((at(30.0).touchdown_speed_m_s - 4.3).abs() < 0.05);
        assert_eq!(at(25.0).finding, Finding::NotLandable);
    }

    #[test]
    fn table_and_csv_hold_every_cell() {
        let map = small_map(2);
        let (mut table, mut csv) = (Vec::new(), Vec::new());
        map.write_table(&mut table).unwrap();
        map.write_csv(&mut csv).unwrap();
        let [table, csv] = [table, csv].map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(csv.lines().count(), 31);
        assert!(csv.starts_with("thrust_to_weight,height_m,finding,touchdown_speed_m_s\n"));
        let signs = table.lines().filter_map(|line| line.split_once('|')).map(|(_, signs)| signs.len());
        assert_eq!(signs.sum::<usize>(), 30);
        assert!(svg(&map, "a title").unwrap().contains("a title"));
    }
}
