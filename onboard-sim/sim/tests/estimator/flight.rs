//! A prescribed flight: from apogee down in wind, with ignition in time, through an S-turn to the
//! ground. Its attitude is a function of time and its thrust a function of height and speed, so it
//! needs no controller and no estimator.

use core::f64::consts::TAU;

use flight::estimation::estimator::{
    Estimate, Estimator, EstimatorConfig, GRAVITY_M_S2, Measurements, StartUncertainty, VehicleNow,
};
use flight::vehicle::mission::{LeverArms, SensorPlaces};
use flight::vehicle::rigid::{RigidState, upright};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use sim::world::sensors::{SensorParams, SensorTruth, Sensors, start_with_errors};

const MS_S: f64 = 1e-3;
const CG_OVER_FEET_M: f64 = 0.6;
const DENSITY_KG_M3: f64 = 1.2;
const MASS_KG: f64 = 3.1;
const FIN_DRAG_AREA_M2: f64 = 0.031;
const CROSSFLOW_AREA_M2: f64 = 0.09;
/// The motor is ignited when a stop above the ground needs this deceleration, m/s^2.
const STOPPING_M_S2: f64 = 7.0;

/// What differs between flights.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scene {
    pub(crate) seed: u64,
    /// Wind at the start height; it decreases with the 1/7 power of height.
    pub(crate) wind_m_s: Vector2<f64>,
    /// What becomes of the measurements at a time, s.
    pub(crate) faults: fn(f64, &mut Measurements),
    pub(crate) sensors: SensorParams,
    /// The true force of the air divided by the force in the estimator's model.
    pub(crate) air_scale: f64,
}

/// The truth, the frame's measurements and the estimate after it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) time_s: f64,
    pub(crate) truth: RigidState,
    pub(crate) wind_m_s: Vector2<f64>,
    pub(crate) burning: bool,
    pub(crate) vehicle: VehicleNow,
    pub(crate) measurements: Measurements,
    pub(crate) estimate: Estimate,
    pub(crate) nees: f64,
}

impl Frame {
    pub(crate) fn velocity_error_m_s(&self) -> Vector3<f64> {
        self.estimate.state.velocity_m_s - self.truth.velocity_m_s
    }

    /// The turn about the world's axes from the estimated to the true attitude, rad.
    pub(crate) fn turn_error_rad(&self) -> Vector3<f64> {
        (self.truth.world_from_body * self.estimate.state.world_from_body.inverse()).scaled_axis()
    }
}

impl Scene {
    /// Wind of about 3 m/s from a direction that depends on the seed.
    pub(crate) fn of(seed: u64) -> Self {
        let (sin, cos) = libm::sincos(seed as f64);
        let wind_m_s = Vector2::new(cos, sin) * (2.0 + (seed % 4) as f64);
        Self {
            seed,
            wind_m_s,
            faults: |_, _| {},
            sensors: SensorParams::default(),
            air_scale: 1.0 + 0.1 * libm::sin(2.4 * seed as f64),
        }
    }

    pub(crate) fn start() -> RigidState {
        let mut state = RigidState::upright(260.0);
        state.velocity_m_s = Vector3::new(4.0, -3.0, 0.0);
        state.world_from_body = attitude(0.0);
        state
    }

    pub(crate) fn estimator(&self) -> Estimator {
        let uncertainty = StartUncertainty::at_apogee();
        let believed = start_with_errors(&Self::start(), &uncertainty, self.seed);
        Estimator::new(&EstimatorConfig::default(), &uncertainty, 0.0, &believed)
    }

    /// Runs the flight until the centre of gravity is 0.1 m above its height at rest.
    pub(crate) fn fly(&self) -> Vec<Frame> {
        let mut estimator = self.estimator();
        let mut sensors = Sensors::new(&self.sensors, &SensorPlaces::default(), self.seed, 1.0)
            .expect("valid sensor parameters");
        let mut state = Self::start();
        let (mut burning, mut ms) = (false, 0_u32);
        let mut frames = Vec::new();
        while state.position_m.z > CG_OVER_FEET_M + 0.1 && ms < 40_000 {
            let time_s = f64::from(ms) * MS_S;
            let wind_m_s = self.wind_m_s * libm::pow(state.position_m.z.max(0.1) / 260.0, 1.0 / 7.0);
            let through_air_m_s = state.velocity_m_s - wind_m_s.push(0.0);
            let next = attitude(time_s + MS_S);
            state.rate_rad_s = (state.world_from_body.inverse() * next).scaled_axis() / MS_S;
            let left_m = (state.position_m.z - CG_OVER_FEET_M).max(0.05);
            let stopping_m_s2 = state.velocity_m_s.z.powi(2) / (2.0 * left_m);
            burning |= stopping_m_s2 > STOPPING_M_S2;
            let mut specific_force_m_s2 = air(&state, &through_air_m_s) * self.air_scale;
            if burning {
                let nose = state.nose_in_world();
                specific_force_m_s2.x = (GRAVITY_M_S2 + stopping_m_s2) / nose.z;
            }
            // The attitude in the middle of the step turns the force.
            let middle = state.world_from_body.slerp(&next, 0.5);
            let gained = middle * specific_force_m_s2 * MS_S - Vector3::z() * (GRAVITY_M_S2 * MS_S);
            state.position_m += (state.velocity_m_s + gained * 0.5) * MS_S;
            state.velocity_m_s += gained;
            state.world_from_body = next;
            ms += 1;
            let truth =
                SensorTruth::of_motion(&state, &specific_force_m_s2, through_air_m_s.norm(), CG_OVER_FEET_M);
            let time_s = f64::from(ms) * MS_S;
            if let Some(mut measurements) = sensors.observe(&truth) {
                (self.faults)(time_s, &mut measurements);
                let vehicle = VehicleNow {
                    mass_kg: MASS_KG,
                    air_density_kg_m3: DENSITY_KG_M3,
                    body_drag_area_m2: 0.0,
                    leg_drag_area_m2: 0.0,
                    fin_drag_area_m2: FIN_DRAG_AREA_M2,
                    fin_lift_area_m2: Vector2::zeros(),
                    fin_ahead_of_cg_m: 0.0,
                    crossflow_area_m2: CROSSFLOW_AREA_M2,
                    motor_burning: burning,
                    levers: LeverArms::default(),
                };
                let estimate = estimator.step(&measurements, &vehicle);
                let nees = estimator.nees_of_motion(&state).unwrap_or(f64::NAN);
                frames.push(Frame {
                    time_s,
                    truth: state,
                    wind_m_s,
                    burning,
                    vehicle,
                    measurements,
                    estimate,
                    nees,
                });
            }
        }
        frames
    }
}

/// Leaning a few degrees on the way down, with a slow roll, and through an S-turn of 16 deg.
fn attitude(time_s: f64) -> UnitQuaternion<f64> {
    let wave = |period_s: f64, amplitude_deg: f64, phase: f64| {
        amplitude_deg.to_radians() * libm::sin(TAU * time_s / period_s + phase)
    };
    let lean = Vector3::new(wave(4.0, 12.0, 0.3), wave(3.1, 10.0, 1.0), 0.0);
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), wave(9.0, 30.0, 0.0));
    UnitQuaternion::from_scaled_axis(lean) * roll * upright()
}

/// Specific force of the air, body axes, m/s^2.
fn air(state: &RigidState, through_air_m_s: &Vector3<f64>) -> Vector3<f64> {
    let in_body = state.world_from_body.inverse() * through_air_m_s;
    let sideways = Vector3::new(0.0, in_body.y, in_body.z);
    let fins = in_body * (FIN_DRAG_AREA_M2 * in_body.norm());
    let body = sideways * (CROSSFLOW_AREA_M2 * sideways.norm());
    (fins + body) * (-DENSITY_KG_M3 / (2.0 * MASS_KG))
}
