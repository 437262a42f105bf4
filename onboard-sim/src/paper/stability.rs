//! Whether the paper's vehicle settles in its fall, over the tilt at the start and the opening of the fins, and the
//! static margin that explains it.
//!
//! A cell is one fall from rest for each of [`ROLLS_DEG`]: the lifts of the fins are a couple that helps in one plane and
//! harms in the other, so the direction of the tilt counts. The tilt repeats after half a turn.

use campaign::work::in_parallel;
use world::balance::Balance;

use super::PaperError;
use super::passive::{Moment, Vehicle};

/// Directions of the tilt about the body's axis, degrees.
pub const ROLLS_DEG: [f64; 4] = [0.0, 45.0, 90.0, 135.0];
/// Tilts at the start, degrees.
pub const TILTS_DEG: [f64; 14] =
    [2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 22.0, 24.0, 26.0, 28.0];
/// Openings of the fins, degrees: 0 closed, 90 fully open.
pub const OPENINGS_DEG: [f64; 10] = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0];
/// Angles to the wind at which the static margin is given, degrees.
pub const ANGLES_DEG: [f64; 6] = [1.0, 4.0, 8.0, 12.0, 16.0, 20.0];

/// How the falls of a cell end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// Whatever the direction of the tilt, the tail ends nearer to the wind than it began.
    Settles,
    /// In some directions only.
    DependsOnRoll,
    /// In no direction.
    Flips,
}

impl Fate {
    /// All of them, in their order.
    pub const ALL: [Self; 3] = [Self::Settles, Self::DependsOnRoll, Self::Flips];

    /// For tables and legends.
    pub fn name(self) -> &'static str {
        match self {
            Self::Settles => "settles",
            Self::DependsOnRoll => "depends on the direction",
            Self::Flips => "flips",
        }
    }

    /// One character, for maps of text.
    pub fn sign(self) -> char {
        match self {
            Self::Settles => '#',
            Self::DependsOnRoll => 'o',
            Self::Flips => '.',
        }
    }
}

/// The map and the margins.
#[derive(Debug, Clone, PartialEq)]
pub struct Stability {
    /// Centre of gravity, m above the nozzle.
    pub cg_station_m: f64,
    /// Row by row: a row for each of [`OPENINGS_DEG`], a column for each of [`TILTS_DEG`].
    pub fates: Vec<Fate>,
    /// Centre of pressure above the centre of gravity, m, positive is stable: for each of [`OPENINGS_DEG`] and
    /// [`ANGLES_DEG`], the least and the most over the direction of the angle.
    pub margins_m: Vec<[[f64; 2]; ANGLES_DEG.len()]>,
}

impl Stability {
    /// Flies every cell of a vehicle with this centre of gravity, m above the nozzle, on `jobs` threads.
    ///
    /// # Errors
    /// The vehicle cannot be built, or a thread not be started.
    pub fn new(cg_station_m: f64, jobs: usize) -> Result<Self, PaperError> {
        let vehicle = Vehicle::new()?.with_cg_at(cg_station_m);
        let cells: Vec<(f64, f64)> =
            OPENINGS_DEG.iter().flat_map(|opening| TILTS_DEG.iter().map(|tilt| (*opening, *tilt))).collect();
        let fly = |(opening_deg, tilt_deg): &(f64, f64)| fate(&vehicle, *opening_deg, *tilt_deg);
        let fates = in_parallel(&cells, jobs, fly, &|_| ())?.into_iter().collect::<Result<_, _>>()?;
        let balance = Balance::new(vehicle.airframe());
        let margins_m = OPENINGS_DEG
            .map(|opening_deg| {
                ANGLES_DEG.map(|angle_deg| margin_m(&balance, opening_deg, angle_deg, cg_station_m))
            })
            .to_vec();
        Ok(Self { cg_station_m, fates, margins_m })
    }

    /// Number of cells with this fate.
    pub fn count(&self, fate: Fate) -> usize {
        self.fates.iter().filter(|found| **found == fate).count()
    }

    /// The fate from a tilt with an opening, each by its place.
    pub fn fate(&self, opening: usize, tilt: usize) -> Fate {
        self.fates[opening * TILTS_DEG.len() + tilt]
    }
}

fn fate(vehicle: &Vehicle, opening_deg: f64, tilt_deg: f64) -> Result<Fate, PaperError> {
    let mut settled = 0;
    for roll_deg in ROLLS_DEG {
        let (sin, cos) = libm::sincos(roll_deg.to_radians());
        let tilt_rad = tilt_deg.to_radians();
        let flips = |moment: &Moment| moment.angle_to_wind_rad > core::f64::consts::FRAC_PI_2;
        let fall = vehicle.fall(opening_deg.to_radians(), [tilt_rad * cos, tilt_rad * sin], flips)?;
        settled += usize::from(fall.last().is_some_and(|last| last.angle_to_wind_rad < tilt_rad));
    }
    Ok(match settled {
        0 => Fate::Flips,
        all if all == ROLLS_DEG.len() => Fate::Settles,
        _ => Fate::DependsOnRoll,
    })
}

/// Least and most over the direction, m. The couple of the lifts goes as the cosine of twice the direction, so its
/// extremes are in the two planes of symmetry.
fn margin_m(balance: &Balance, opening_deg: f64, angle_deg: f64, cg_station_m: f64) -> [f64; 2] {
    let of = |roll_deg: f64| {
        let across = balance.across(opening_deg.to_radians(), angle_deg.to_radians(), roll_deg.to_radians());
        across.map_or(f64::NAN, |across| across.centre_of_pressure_m - cg_station_m)
    };
    let (one, other) = (of(0.0), of(90.0));
    [one.min(other), one.max(other)]
}

#[cfg(test)]
mod tests {
    use super::super::passive::{CG_STATION_M, HEAVY_TAIL_STATION_M};
    use super::*;

    fn place(values: &[f64], value: f64) -> usize {
        values.iter().position(|known| (known - value).abs() < 1e-9).unwrap()
    }

    /// By hand: the moment about the centre of gravity of the open fins, `4 S C_x (0.63 - 0.52) sin a` with the couple
    /// of their lifts `4 S C_z r sin 30 cos 30 sin a` for or against it, over that of the body,
    /// `C_c D L (0.52 - 0.35) sin^2 a`, changes its sign at 11.5 degrees in one plane and at 20.9 in the other.
    #[test]
    fn val_hand_the_static_margin_explains_where_the_paper_s_vehicle_flips() {
        let stability = Stability::new(CG_STATION_M, 2).unwrap();
        let open = OPENINGS_DEG.len() - 1;
        for (angle, [least_m, most_m]) in ANGLES_DEG.iter().zip(stability.margins_m[open]) {
            assert_eq!(least_m > 0.0, *angle < 11.5, "{angle} deg: {least_m}");
            assert_eq!(most_m > 0.0, *angle < 20.9, "{angle} deg: {most_m}");
        }
        let open_at = |tilt_deg| stability.fate(open, place(&TILTS_DEG, tilt_deg));
        assert_eq!(open_at(8.0), Fate::Settles);
        assert_eq!(open_at(16.0), Fate::DependsOnRoll);
        assert_eq!(open_at(24.0), Fate::Flips);
        // Closed fins do nothing, and the middle of the body is below the centre of gravity.
        for (tilt, _) in TILTS_DEG.iter().enumerate() {
            assert_eq!(stability.fate(0, tilt), Fate::Flips);
        }
        for [least_m, most_m] in stability.margins_m[0] {
            assert!((least_m + 0.17).abs() < 1e-9 && (most_m + 0.17).abs() < 1e-9);
        }
    }

    /// By hand: the middle of the body, where the air pushes at least, is 0.175 m above this centre of gravity.
    #[test]
    fn val_hand_with_a_heavy_tail_every_fall_settles() {
        let stability = Stability::new(HEAVY_TAIL_STATION_M, 2).unwrap();
        assert_eq!(stability.count(Fate::Settles), stability.fates.len());
        for [least_m, _] in stability.margins_m.iter().flatten() {
            assert!(*least_m > 0.175 - 1e-9, "{least_m}");
        }
    }
}
