//! The paper's vehicle falling with its fins held still, in space (its section 2, Fig. 5).

use core::f64::consts::FRAC_PI_2;

use flight::vehicle::airframe::Airframe;
use flight::vehicle::rigid::RigidState;
use flight::vehicle::thrust_curve::ThrustCurve;
use nalgebra::{UnitQuaternion, Vector3};
use world::{Actuators, Truth, World};

use super::PaperError;

/// The paper gives no height for its fall. This is the apogee of our missions with its airframe.
pub const HEIGHT_M: f64 = 300.0;
/// Centre of gravity above the nozzle (Table 1: `X_CG - X_THR`), m.
pub const CG_STATION_M: f64 = 0.52;
/// The same by the other reading of "25 % of the rocket's length, as the engine represents the large majority of the total
/// mass": a quarter of the length from the nozzle, m. Table 1 has it a quarter from the nose.
pub const HEAVY_TAIL_STATION_M: f64 = 0.175;
/// Sea level, kg/m^3, and standard gravity, m/s^2.
const DENSITY_KG_M3: f64 = 1.225;
const GRAVITY_M_S2: f64 = 9.806_65;
/// Steps between two samples.
const SAMPLE_STEPS: u64 = 20;

/// The paper's vehicle: Table 1 and section 2.1.
#[derive(Debug, Clone)]
pub struct Vehicle {
    airframe: Airframe,
    /// It is never lit; its mass is part of the vehicle's.
    motor: ThrustCurve,
}

/// One moment of a fall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    pub time_s: f64,
    /// Centre of gravity, height above the ground under the feet's contact, m.
    pub position_m: Vector3<f64>,
    pub velocity_m_s: Vector3<f64>,
    /// Angle between the tail and the velocity: 0 in a straight tail-first fall, pi nose first, rad.
    pub angle_to_wind_rad: f64,
    /// Angle between the nose and the vertical, rad.
    pub tilt_rad: f64,
}

impl Vehicle {
    /// The vehicle with our own airframe's parts that the paper leaves out (legs, servos, parachute), which do not act
    /// in a passive fall.
    ///
    /// # Errors
    /// A built-in file is missing: a defect of the build.
    pub fn new() -> Result<Self, PaperError> {
        let mut airframe = vehicles::airframe::builtin("mk2-h53")?;
        airframe.mass.loaded_kg = 3.0;
        airframe.mass.loaded_cg_station_m = CG_STATION_M;
        airframe.mass.loaded_pitch_inertia_kg_m2 = 0.12;
        let motor = vehicles::motors::builtin(&airframe.motor)?;
        Ok(Self { airframe, motor })
    }

    /// The same vehicle with its centre of gravity at another station, m above the nozzle.
    #[must_use]
    pub fn with_cg_at(mut self, station_m: f64) -> Self {
        self.airframe.mass.loaded_cg_station_m = station_m;
        self
    }

    /// Its airframe.
    pub fn airframe(&self) -> &Airframe {
        &self.airframe
    }

    /// Terminal speed of a straight fall at sea level, m/s.
    pub fn terminal_speed_m_s(&self, opening_rad: f64) -> f64 {
        let area_m2 = self.airframe.drag_area_m2(opening_rad);
        libm::sqrt(2.0 * self.airframe.mass.loaded_kg * GRAVITY_M_S2 / (DENSITY_KG_M3 * area_m2))
    }

    /// The fall from rest in still air, from [`HEIGHT_M`] to the ground, with the nose turned away from the vertical:
    /// pitch and yaw about body y and z, rad. It ends early when `over` says so of a sample.
    ///
    /// # Errors
    /// The world cannot be built: a defect of the build.
    pub fn fall(
        &self,
        opening_rad: f64,
        [pitch_rad, yaw_rad]: [f64; 2],
        over: impl Fn(&Moment) -> bool,
    ) -> Result<Vec<Moment>, PaperError> {
        let upright = RigidState::upright(HEIGHT_M);
        let turned = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, pitch_rad, yaw_rad));
        let start = RigidState { world_from_body: upright.world_from_body * turned, ..upright };
        let truth = Truth { gust_scale: 0.0, ..Truth::default() };
        let world = World::new(&self.airframe, &self.motor, &truth, &start, 0)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's Fig. 5: fins fully open, 2 degrees of pitch and 1 degree of yaw: passively stable, and slow.
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
        let terminal_m_s = vehicle.terminal_speed_m_s(FRAC_PI_2);
        assert!((terminal_m_s - 39.4).abs() < 0.05, "{terminal_m_s}");
        assert!((last.velocity_m_s.z / -terminal_m_s - 0.995).abs() < 0.01, "{last:?}");
    }

    /// Eq. 8 with `C_xb = 1` by hand; the paper's CFD says "around 80 m/s".
    #[test]
    fn val_paper_eq_8_closed_fins_fall_at_106_m_s() {
        let terminal_m_s = Vehicle::new().unwrap().terminal_speed_m_s(0.0);
        assert!((terminal_m_s - 105.7).abs() < 0.1, "{terminal_m_s}");
    }
}
