//! The paper's vehicle falling with its fins held still, in space (its section 2, Fig. 5); and
//! whether it settles, over the tilt at the start and the opening of the fins, with the static
//! margin that explains it.
//!
//! A cell of that map is one fall from rest for each of [`ROLLS_DEG`]: the lifts of the fins are a
//! couple that helps in one plane and harms in the other, so the direction of the tilt counts. The
//! tilt repeats after half a turn.

use core::f64::consts::FRAC_PI_2;

use flight::vehicle::airframe::Airframe;
use flight::vehicle::rigid::RigidState;
use flight::vehicle::site::Site;
use flight::vehicle::thrust_curve::ThrustCurve;
use nalgebra::{UnitQuaternion, Vector3};
use onboard_sim::run::in_parallel;
use sim::world::balance::Balance;
use sim::world::{Actuators, Truth, World};

use super::PaperError;

/// The paper gives no height for its fall. This is the apogee of our missions with its airframe.
pub(crate) const HEIGHT_M: f64 = 300.0;
/// Centre of gravity above the nozzle (Table 1: `X_CG - X_THR`), m.
pub(crate) const CG_STATION_M: f64 = 0.52;
/// The same by the other reading of "25 % of the rocket's length, as the engine represents the
/// large majority of the total mass": a quarter of the length from the nozzle, m. Table 1 has it a
/// quarter from the nose.
pub(crate) const HEAVY_TAIL_STATION_M: f64 = 0.175;
/// Steps between two samples.
const SAMPLE_STEPS: u64 = 20;

/// The paper's vehicle: Table 1 and section 2.1.
#[derive(Debug, Clone)]
pub(crate) struct Vehicle {
    airframe: Airframe,
    /// It never burns; its mass is part of the vehicle's.
    motor: ThrustCurve,
}

/// One moment of a fall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    pub(crate) time_s: f64,
    /// Centre of gravity, height above the ground under the feet's contact, m.
    pub(crate) position_m: Vector3<f64>,
    pub(crate) velocity_m_s: Vector3<f64>,
    /// Angle between the tail and the velocity: 0 in a straight tail-first fall, pi nose first,
    /// rad.
    pub(crate) angle_to_wind_rad: f64,
    /// Angle between the nose and the vertical, rad.
    pub(crate) tilt_rad: f64,
}

impl Vehicle {
    /// The vehicle with our own airframe's parts that the paper leaves out (legs, servos,
    /// parachute), which do not act in a passive fall.
    ///
    /// # Errors
    /// A built-in file is missing: a defect of the build.
    pub(crate) fn new() -> Result<Self, PaperError> {
        let text = include_str!("../../../../flight/tests/missions/mk2-h53.toml");
        let mut airframe = flight::vehicles::mission::from_toml(text, "mk2-h53")?.airframe;
        airframe.mass.loaded_kg = 3.0;
        airframe.mass.loaded_cg_station_m = CG_STATION_M;
        airframe.mass.loaded_pitch_inertia_kg_m2 = 0.12;
        let legs = &mut airframe.legs;
        (legs.foot_station_m, legs.stiffness_n_m, legs.damping_n_s_m, legs.crush) =
            (-0.06, 2_000.0, 45.0, None);
        let motor = flight::vehicles::motors::builtin(&airframe.motor)?;
        Ok(Self { airframe, motor })
    }

    /// The same vehicle with its centre of gravity at another station, m above the nozzle.
    #[must_use]
    pub(crate) fn with_cg_at(mut self, station_m: f64) -> Self {
        self.airframe.mass.loaded_cg_station_m = station_m;
        self
    }

    /// Its airframe.
    pub(crate) fn airframe(&self) -> &Airframe {
        &self.airframe
    }

    /// The fall from rest in still air, from [`HEIGHT_M`] to the ground, with the nose turned away
    /// from the vertical: pitch and yaw about body y and z, rad. It ends early when `over` says so
    /// of a sample.
    ///
    /// # Errors
    /// The world cannot be built: a defect of the build.
    pub(crate) fn fall(
        &self,
        opening_rad: f64,
        [pitch_rad, yaw_rad]: [f64; 2],
        over: impl Fn(&Moment) -> bool,
    ) -> Result<Vec<Moment>, PaperError> {
        let upright = RigidState::upright(HEIGHT_M);
        let turned = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, pitch_rad, yaw_rad));
        let start = RigidState { world_from_body: upright.world_from_body * turned, ..upright };
        let truth = Truth { gust_scale: 0.0, ..Truth::default() };
        let world = World::new(&Site::default(), &self.airframe, &self.motor, &truth, &start, 0)?;
        let mut world = world.with_fins_at(opening_rad.min(FRAC_PI_2));
        let held = Actuators { fins_rad: [opening_rad; 4], ..Actuators::NONE };
        let mut fall = vec![moment(&world)];
        while world.touchdown().is_none() && world.height_m() > 0.0 {
            world.step(&held);
            if world.steps().is_multiple_of(SAMPLE_STEPS) {
                let now = moment(&world);
                fall.push(now);
                if over(&now) {
                    break;
                }
            }
        }
        Ok(fall)
    }
}

fn moment(world: &World) -> Moment {
    let state = world.state();
    let tail = -state.nose_in_world();
    let velocity = state.velocity_m_s;
    let down = Vector3::new(0.0, 0.0, -1.0);
    let wind = if velocity.norm_squared() > 0.0 { velocity } else { down };
    Moment {
        time_s: world.time_s(),
        position_m: state.position_m,
        velocity_m_s: velocity,
        angle_to_wind_rad: libm::atan2(tail.cross(&wind).norm_squared().sqrt(), tail.dot(&wind)),
        tilt_rad: state.tilt_rad(),
    }
}

/// Directions of the tilt about the body's axis, degrees.
pub(crate) const ROLLS_DEG: [f64; 4] = [0.0, 45.0, 90.0, 135.0];
/// Tilts at the start, degrees.
pub(crate) const TILTS_DEG: [f64; 14] =
    [2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 22.0, 24.0, 26.0, 28.0];
/// Openings of the fins, degrees: 0 closed, 90 fully open.
pub(crate) const OPENINGS_DEG: [f64; 10] = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0];
/// Angles to the wind at which the static margin is given, degrees.
pub(crate) const ANGLES_DEG: [f64; 6] = [1.0, 4.0, 8.0, 12.0, 16.0, 20.0];

/// How the falls of a cell end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fate {
    /// Whatever the direction of the tilt, the tail ends nearer to the wind than it began.
    Settles,
    /// In some directions only.
    DependsOnRoll,
    /// In no direction.
    Flips,
}

impl Fate {
    /// All of them, in their order.
    pub(crate) const ALL: [Self; 3] = [Self::Settles, Self::DependsOnRoll, Self::Flips];

    /// For tables and legends.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Settles => "settles",
            Self::DependsOnRoll => "depends on the direction",
            Self::Flips => "flips",
        }
    }

    /// One character, for maps of text.
    pub(crate) fn sign(self) -> char {
        match self {
            Self::Settles => '#',
            Self::DependsOnRoll => 'o',
            Self::Flips => '.',
        }
    }
}

/// The map and the margins.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stability {
    /// Centre of gravity, m above the nozzle.
    pub(crate) cg_station_m: f64,
    /// Row by row: a row for each of [`OPENINGS_DEG`], a column for each of [`TILTS_DEG`].
    pub(crate) fates: Vec<Fate>,
    /// Centre of pressure above the centre of gravity, m, positive is stable: for each of
    /// [`OPENINGS_DEG`] and [`ANGLES_DEG`], the least and the most over the direction of the angle.
    pub(crate) margins_m: Vec<[[f64; 2]; ANGLES_DEG.len()]>,
}

impl Stability {
    /// Flies every cell of a vehicle with this centre of gravity, m above the nozzle.
    ///
    /// # Errors
    /// The vehicle cannot be built.
    pub(crate) fn new(cg_station_m: f64) -> Result<Self, PaperError> {
        let vehicle = Vehicle::new()?.with_cg_at(cg_station_m);
        let cells: Vec<(f64, f64)> =
            OPENINGS_DEG.iter().flat_map(|opening| TILTS_DEG.iter().map(|tilt| (*opening, *tilt))).collect();
        let fly = |(opening_deg, tilt_deg): &(f64, f64)| fate(&vehicle, *opening_deg, *tilt_deg);
        let fates = in_parallel(&cells, fly, &|_| ()).into_iter().collect::<Result<_, _>>()?;
        let balance = Balance::new(vehicle.airframe());
        let margins_m = OPENINGS_DEG
            .map(|opening_deg| {
                ANGLES_DEG.map(|angle_deg| margin_m(&balance, opening_deg, angle_deg, cg_station_m))
            })
            .to_vec();
        Ok(Self { cg_station_m, fates, margins_m })
    }

    /// Number of cells with this fate.
    pub(crate) fn count(&self, fate: Fate) -> usize {
        self.fates.iter().filter(|found| **found == fate).count()
    }

    /// The fate from a tilt with an opening, each by its place.
    pub(crate) fn fate(&self, opening: usize, tilt: usize) -> Fate {
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

/// Least and most over the direction, m. The couple of the lifts goes as the cosine of twice the
/// direction, so its extremes are in the two planes of symmetry.
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
    use super::*;

    /// Terminal speed of a straight fall at sea level under standard gravity, m/s.
    fn terminal_speed_m_s(vehicle: &Vehicle, opening_rad: f64) -> f64 {
        let area_m2 = vehicle.airframe.drag_area_m2(opening_rad);
        libm::sqrt(2.0 * vehicle.airframe.mass.loaded_kg * 9.806_65 / (1.225 * area_m2))
    }

    /// The paper's Fig. 5: fins fully open, 2 degrees of pitch and 1 degree of yaw: passively
    /// stable, and slow.
    #[test]
    fn val_paper_fig_5_the_fall_settles_and_approaches_the_terminal_speed() {
        let vehicle = Vehicle::new().unwrap();
        let start = [2.0_f64.to_radians(), 1.0_f64.to_radians()];
        let fall = vehicle.fall(FRAC_PI_2, start, |_| false).unwrap();
        let (first, last) = (fall[0], fall[fall.len() - 1]);
        assert!((first.angle_to_wind_rad.to_degrees() - 5.0_f64.sqrt()).abs() < 1e-6, "{first:?}");
        let late = fall.iter().filter(|now| now.time_s > last.time_s - 2.0);
        let worst_rad = late.map(|now| now.angle_to_wind_rad).fold(0.0, f64::max);
        assert!(worst_rad < 0.4 * first.angle_to_wind_rad, "{worst_rad}");
        // 39.4 m/s by hand from the drag areas of Eq. 3 and 8.
        let terminal_m_s = terminal_speed_m_s(&vehicle, FRAC_PI_2);
        assert!((terminal_m_s - 39.4).abs() < 0.05, "{terminal_m_s}");
        assert!((last.velocity_m_s.z / -terminal_m_s - 0.995).abs() < 0.01, "{last:?}");
    }

    /// Eq. 8 with `C_xb = 1` by hand; the paper's CFD says "around 80 m/s".
    #[test]
    fn val_paper_eq_8_closed_fins_fall_at_106_m_s() {
        let terminal_m_s = terminal_speed_m_s(&Vehicle::new().unwrap(), 0.0);
        assert!((terminal_m_s - 105.7).abs() < 0.1, "{terminal_m_s}");
    }

    fn place(values: &[f64], value: f64) -> usize {
        values.iter().position(|known| (known - value).abs() < 1e-9).unwrap()
    }

    /// By hand: the moment about the centre of gravity of the open fins, `4 S C_x (0.63 - 0.52) sin
    /// a` with the couple of their lifts `4 S C_z r sin 30 cos 30 sin a` for or against it, over
    /// that of the body, `C_c D L (0.52 - 0.35) sin^2 a`, changes its sign at 11.5 degrees in one
    /// plane and at 20.9 in the other.
    #[test]
    fn val_hand_the_static_margin_explains_where_the_paper_s_vehicle_flips() {
        let stability = Stability::new(CG_STATION_M).unwrap();
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

    /// By hand: the middle of the body, where the air pushes at least, is 0.175 m above this centre
    /// of gravity.
    #[test]
    fn val_hand_with_a_heavy_tail_every_fall_settles() {
        let stability = Stability::new(HEAVY_TAIL_STATION_M).unwrap();
        assert_eq!(stability.count(Fate::Settles), stability.fates.len());
        for [least_m, _] in stability.margins_m.iter().flatten() {
            assert!(*least_m > 0.175 - 1e-9, "{least_m}");
        }
    }
}
