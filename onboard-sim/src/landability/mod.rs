//! Maps where a landing exists, over two quantities of the start or the motor.
//!
//! Every cell is one cold solve of the profile's landing problem, from both bent initial guesses. A cell lands if the
//! plan converges and ends inside the touchdown limits (Table 2 of the landing paper). Cells are independent, so the
//! map does not depend on how many of them are computed at the same time.

mod axis;
mod picture;

use std::io::{self, Write};
use std::sync::atomic::{AtomicUsize, Ordering};

use flight::guidance::landing::landing_problem;
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::profile::Profile;
use nmpc::SolveStatus;

pub use axis::{Axis, AxisError, Quantity};
pub use picture::svg;

/// The result of one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Whether a landing exists, and if not, why.
    pub finding: Finding,
    /// Speed at the end of the plan, m/s; the lower bound if nothing was planned.
    pub touchdown_speed_m_s: f64,
}

/// Whether a landing exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// A converged plan ends inside every limit.
    Lands,
    /// The best plan found ends outside a limit.
    Misses,
    /// A bound proves that no plan lands.
    NotLandable,
}

impl Finding {
    /// All of them, in their order.
    const ALL: [Self; 3] = [Self::Lands, Self::Misses, Self::NotLandable];

    /// Red, green and blue; also different in grey: light, middle, dark.
    fn colour(self) -> [u8; 3] {
        match self {
            Self::Lands => [0x7f, 0xc9, 0x7f],
            Self::Misses => [0xe6, 0xa2, 0x3c],
            Self::NotLandable => [0x5b, 0x4b, 0x6b],
        }
    }

    /// One word, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lands => "lands",
            Self::Misses => "misses",
            Self::NotLandable => "not landable",
        }
    }

    fn sign(self) -> char {
        match self {
            Self::Lands => '#',
            Self::Misses => 'o',
            Self::NotLandable => '.',
        }
    }
}

/// A map: cells row by row, the first row at the lowest value of `y`.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Columns.
    pub x: Axis,
    /// Rows.
    pub y: Axis,
    /// `x.count` times `y.count` cells.
    pub cells: Vec<Cell>,
}

/// Computes a map on `jobs` threads; `progress` is called with the cells done, from any of them.
pub fn map(profile: &Profile, x: Axis, y: Axis, jobs: usize, progress: &(dyn Fn(usize) + Sync)) -> Map {
    let count = x.count * y.count;
    let next = AtomicUsize::new(0);
    let done = AtomicUsize::new(0);
    let work = || {
        let mut found = Vec::new();
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            if place >= count {
                return found;
            }
            found.push((place, cell(profile, x.value(place % x.count), y.value(place / x.count), x, y)));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1);
        }
    };
    let mut found: Vec<(usize, Cell)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (1..jobs.max(1)).map(|_| scope.spawn(work)).collect();
        let mut found = work();
        for worker in workers {
            // A worker can only fail by a panic, which the scope propagates.
            found.extend(worker.join().unwrap_or_default());
        }
        found
    });
    found.sort_by_key(|(place, _)| *place);
    Map { x, y, cells: found.into_iter().map(|(_, cell)| cell).collect() }
}

fn cell(profile: &Profile, x_value: f64, y_value: f64, x: Axis, y: Axis) -> Cell {
    let mut profile = profile.clone();
    let mut thrust_scale = 1.0;
    for (axis, value) in [(x, x_value), (y, y_value)] {
        axis.quantity.apply(value, &mut profile, &mut thrust_scale);
    }
    let limits = TouchdownLimits::from_profile(&profile);
    let initial = profile.start.planar_state();
    let problem = landing_problem(&profile, initial, 0.0, profile.nmpc.horizon_steps, thrust_scale);
    let solution = nmpc::solve(&problem, None);
    if solution.status == SolveStatus::NotLandable {
        return Cell {
            finding: Finding::NotLandable,
            touchdown_speed_m_s: solution.best_touchdown_speed_m_s,
        };
    }
    let Some(end) = solution.states.last() else {
        return Cell { finding: Finding::Misses, touchdown_speed_m_s: f64::NAN };
    };
    let landed = LandingVerdict::judge_plan(&limits, end).landed();
    let lands = landed && solution.status == SolveStatus::Converged;
    Cell {
        finding: if lands { Finding::Lands } else { Finding::Misses },
        touchdown_speed_m_s: end.speed_m_s(),
    }
}

impl Map {
    /// Number of cells with this finding.
    pub fn count(&self, finding: Finding) -> usize {
        self.cells.iter().filter(|cell| cell.finding == finding).count()
    }

    /// The map as text: one character for each cell, the highest row first.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn write_table(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "# lands   o best plan misses a limit   . proved not landable")?;
        writeln!(out, "{:>10}", self.y.quantity.label())?;
        for (row, cells) in self.cells.chunks(self.x.count).enumerate().rev() {
            let signs: String = cells.iter().map(|cell| cell.finding.sign()).collect();
            writeln!(out, "{:>10.3} |{signs}", self.y.value(row))?;
        }
        writeln!(out, "{:>10} +{}", "", "-".repeat(self.x.count))?;
        writeln!(
            out,
            "{:>10}  {:.3} to {:.3} {}",
            "",
            self.x.value(0),
            self.x.value(self.x.count - 1),
            self.x.quantity.label()
        )?;
        writeln!(
            out,
            "{} of {} cells land, {} miss, {} are proved not landable",
            self.count(Finding::Lands),
            self.cells.len(),
            self.count(Finding::Misses),
            self.count(Finding::NotLandable)
        )
    }

    /// The map as CSV: one row for each cell.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn write_csv(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(
            out,
            "{},{},finding,touchdown_speed_m_s",
            self.x.quantity.column(),
            self.y.quantity.column()
        )?;
        for (place, cell) in self.cells.iter().enumerate() {
            let (x_value, y_value) = (self.x.value(place % self.x.count), self.y.value(place / self.x.count));
            writeln!(out, "{x_value},{y_value},{},{}", cell.finding.name(), cell.touchdown_speed_m_s)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small_map(jobs: usize) -> Map {
        let profile = vehicles::profile::builtin("paper-calibrated").unwrap();
        let x = Axis { quantity: Quantity::ThrustToWeight, from: 0.95, to: 1.2, count: 6 };
        let y = Axis { quantity: Quantity::Height, from: 11.0, to: 19.0, count: 5 };
        map(&profile, x, y, jobs, &|_| ())
    }

    #[test]
    fn the_map_does_not_depend_on_the_number_of_jobs() {
        assert_eq!(small_map(1), small_map(3));
    }

    /// 33.3 N from 15 m lands (thrust to weight 1.13); 30 N (1.02) and less than the weight do not.
    #[test]
    fn val_hand_integration_and_study_agree_with_the_map() {
        let profile = vehicles::profile::builtin("paper-calibrated").unwrap();
        let weight_n = profile.vehicle.mass_kg * profile.environment.gravity_m_s2;
        let at = |thrust_n: f64| {
            let x = Axis { quantity: Quantity::ThrustToWeight, from: thrust_n / weight_n, to: 2.0, count: 1 };
            let y = Axis { quantity: Quantity::Height, from: 15.0, to: 15.0, count: 1 };
            map(&profile, x, y, 1, &|_| ()).cells[0]
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
        assert!(svg(&map, "paper-calibrated").unwrap().contains("Where paper-calibrated can land"));
    }
}
