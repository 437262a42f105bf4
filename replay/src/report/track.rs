//! A recorded flight, prepared for the report.

use std::path::Path;

use flight::rules::phase::Phase;
use flight::vehicle::profile::Profile;
use protocol::log::v1;

use crate::log::{Entry, FlightLog, LogError, Recording};

/// Prediction times at which predictions are compared with the flight, s.
pub(super) const AHEAD_S: [f64; 2] = [0.1, 0.5];

/// A plan that ends this far below the ground ends on it, m.
const GROUND_M: f64 = 0.05;

pub(super) const PLANS_DRAWN: usize = 8;

/// The state of the flight at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Vehicle time, s.
    pub(super) time_s: f64,
    pub(super) phase: Option<Phase>,
    /// x, z, theta, u, w, q.
    pub(super) state: [f64; 6],
}

/// A summary of one tick's plan.
#[derive(Debug, Clone)]
pub(super) struct PlanSample {
    /// Vehicle time of the tick, s.
    pub(super) time_s: f64,
    /// The state predicted for each of [`AHEAD_S`].
    pub(super) ahead: [Option<[f64; 6]>; 2],
    /// The plan in the pitch plane, for plans that are drawn.
    pub(super) path: Vec<(f64, f64)>,
}

/// Source of the vehicle's states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Teller {
    Plant,
    Estimate,
    Telemetry,
    Nobody,
}

/// Facts about the vehicle for the report.
pub(super) struct Vehicle {
    pub(super) gravity_m_s2: f64,
    /// Before ignition, N.
    pub(super) weight_n: f64,
    /// Half of the nominal thrust, N: from there on the motor counts as lit.
    pub(super) half_thrust_n: f64,
    pub(super) gimbal_limit_deg: f64,
    pub(super) gimbal_rate_rad_s: Option<f64>,
    pub(super) fin_rate_deg_s: f64,
    /// Thrust expected at a time since the ignition command, s to N.
    pub(super) expected_n: Box<dyn Fn(f64) -> f64>,
}

impl Vehicle {
    fn of(profile: &Profile) -> Self {
        let motor = profile.motor;
        Self {
            gravity_m_s2: profile.environment.gravity_m_s2,
            weight_n: profile.vehicle.mass_kg * profile.environment.gravity_m_s2,
            half_thrust_n: 0.5 * profile.motor.thrust_n,
            gimbal_limit_deg: profile.gimbal.limit_deg,
            gimbal_rate_rad_s: profile.gimbal.rate_limit_rad_s(),
            fin_rate_deg_s: profile.fins.rate_limit_deg_s,
            expected_n: Box::new(move |since_s| motor.thrust_at_n(since_s)),
        }
    }
}

/// Commanded and actual gimbal angles, rad.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct GimbalAxis {
    pub(super) name: &'static str,
    /// Vehicle time, s, and angle, rad.
    pub(super) commanded: Vec<(f64, f64)>,
    pub(super) actual: Vec<(f64, f64)>,
}

/// Data that only a flight from apogee has.
#[derive(Debug, Clone, Default)]
pub(super) struct InSpace {
    /// Impulse and burn time divided by their certified values, as estimated at the end.
    pub(super) inferred_scales: Option<(f64, f64)>,
    /// True impulse divided by the certified impulse.
    pub(super) true_impulse_scale: Option<f64>,
    /// The plane of the landing in words, as in `124 deg from north`.
    pub(super) plane: String,
    /// Direction across it: the vehicle's place along this direction, m, over vehicle time, s.
    pub(super) across_m: Vec<(f64, f64)>,
    /// Estimate less truth, from the release to contact.
    pub(super) errors: Vec<EstimateError>,
    /// The estimated wind at each planning frame: vehicle time, s, then towards north and east, m/s.
    pub(super) wind_m_s: Vec<(f64, [f64; 2])>,
}

/// Estimate less truth at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct EstimateError {
    /// North, east, up.
    pub(super) position_m: [f64; 3],
    /// North, east, up.
    pub(super) velocity_m_s: [f64; 3],
    /// Angle between the estimated and the true direction of the nose.
    pub(super) nose_rad: f64,
}

/// A recorded flight and what the report derives from it.
pub(super) struct Flight {
    pub(super) recording: Recording,
    pub(super) vehicle: Option<Vehicle>,
    pub(super) from_apogee: Option<InSpace>,
    pub(super) gimbal: Vec<GimbalAxis>,
    /// Vehicle time, s, and thrust as estimated in flight, N.
    pub(super) inferred_n: Vec<(f64, f64)>,
    pub(super) plans: Vec<PlanSample>,
    pub(super) teller: Teller,
    pub(super) track: Vec<Sample>,
    /// Command to the landing motor, vehicle time, s.
    pub(super) ignition_s: Option<f64>,
    /// Contact, vehicle time, s.
    pub(super) touchdown_s: Option<f64>,
}

impl Flight {
    pub(super) fn new(recording: Recording, plans: Vec<PlanSample>) -> Self {
        let (teller, track) = track_of(&recording);
        let lit = |tick: &&v1::ControllerTick| phase_of(tick.input.phase).is_some_and(Phase::in_landing_burn);
        let ignition_s = recording
            .ticks
            .iter()
            .find(lit)
            .map(|tick| tick.input.time_s - tick.input.time_since_ignition_s)
            .or_else(|| {
                let burning = |sample: &&Sample| sample.phase.is_some_and(Phase::in_landing_burn);
                track.iter().find(burning).map(|sample| sample.time_s)
            });
        let vehicle = recording.profile().ok().as_ref().map(Vehicle::of);
        let inferred_n = match (&vehicle, ignition_s) {
            (Some(vehicle), Some(ignition_s)) => {
                let inferred = |tick: &v1::ControllerTick| {
                    let input = &tick.input;
                    (input.time_s, input.thrust_scale * (vehicle.expected_n)(input.time_s - ignition_s))
                };
                let burning = recording.ticks.iter().filter(|tick| tick.input.time_s >= ignition_s);
                burning.map(inferred).collect()
            }
            _ => Vec::new(),
        };
        Self {
            vehicle,
            from_apogee: None,
            gimbal: vec![gimbal_of(&recording)],
            inferred_n,
            touchdown_s: recording.contact_s(),
            ignition_s,
            plans,
            teller,
            track,
            recording,
        }
    }

    /// Time on the report's axes, s: since ignition, or vehicle time without one.
    pub(super) fn axis_s(&self, time_s: f64) -> f64 {
        time_s - self.ignition_s.unwrap_or(0.0)
    }

    /// The name of the time axis.
    pub(super) fn axis_name(&self) -> &'static str {
        if self.ignition_s.is_some() { "s since ignition" } else { "s of vehicle time" }
    }

    /// Whether a time is shown in the pictures: from a second before the landing to a second after its end.
    pub(super) fn is_shown(&self, time_s: f64) -> bool {
        let from_s = self.ignition_s.unwrap_or(f64::NEG_INFINITY) - 1.0;
        let until_s = self.touchdown_s.unwrap_or(f64::INFINITY) + 1.0;
        (from_s..=until_s).contains(&time_s)
    }

    /// Ignition and touchdown, for the pictures.
    pub(super) fn marks(&self) -> Vec<(f64, &'static str)> {
        let ignition = self.ignition_s.map(|at_s| (self.axis_s(at_s), "ignition"));
        let touchdown = self.touchdown_s.map(|at_s| (self.axis_s(at_s), "touchdown"));
        ignition.into_iter().chain(touchdown).collect()
    }

    /// Whether the vehicle is still in the air at a time.
    pub(super) fn is_before_contact(&self, time_s: f64) -> bool {
        self.touchdown_s.is_none_or(|touchdown_s| time_s <= touchdown_s)
    }

    /// The state at a time, between samples; `None` outside.
    pub(super) fn state_at(&self, time_s: f64) -> Option<[f64; 6]> {
        const SAME_S: f64 = 1e-6;
        let behind = self.track.partition_point(|sample| sample.time_s < time_s - SAME_S);
        let after = self.track.get(behind)?;
        if (after.time_s - time_s).abs() <= SAME_S {
            return Some(after.state);
        }
        let before = self.track.get(behind.checked_sub(1)?)?;
        let share = (time_s - before.time_s) / (after.time_s - before.time_s);
        Some(core::array::from_fn(|i| before.state[i] + share * (after.state[i] - before.state[i])))
    }
}

/// The gimbal angle of the planar landing, else from the telemetry of a ground station.
fn gimbal_of(recording: &Recording) -> GimbalAxis {
    let truth = &recording.truth;
    let mut axis = GimbalAxis {
        name: "Gimbal angle",
        commanded: truth.iter().map(|truth| (truth.time_s, truth.gimbal_commanded_rad)).collect(),
        actual: truth.iter().map(|truth| (truth.time_s, truth.gimbal_actual_rad)).collect(),
    };
    if truth.is_empty() {
        for told in &recording.telemetry {
            axis.commanded.extend(told.gimbal_commanded_rad.map(|rad| (told.time_s, rad)));
            axis.actual.extend(told.gimbal_measured_rad.map(|rad| (told.time_s, rad)));
        }
    }
    axis
}

pub(super) fn phase_of(number: u32) -> Option<Phase> {
    u8::try_from(number).ok().and_then(Phase::from_index)
}

pub(super) fn state_of(state: &v1::PlanarState) -> [f64; 6] {
    [state.x_m, state.z_m, state.theta_rad, state.u_m_s, state.w_m_s, state.q_rad_s]
}

/// The best source in the log: the plant, else the controller's estimate, else the telemetry of a ground station.
pub(super) fn track_of(recording: &Recording) -> (Teller, Vec<Sample>) {
    let sample = |time_s, phase, state| Sample { time_s, phase, state };
    let plant = recording.truth.iter();
    let mut best: (Teller, Vec<Sample>) = (
        Teller::Plant,
        plant.map(|truth| sample(truth.time_s, phase_of(truth.phase), state_of(&truth.state))).collect(),
    );
    if best.1.is_empty() {
        let ticks = recording.ticks.iter();
        best = (
            Teller::Estimate,
            ticks
                .map(|tick| {
                    sample(tick.input.time_s, phase_of(tick.input.phase), state_of(&tick.input.state))
                })
                .collect(),
        );
    }
    if best.1.is_empty() {
        let heard = recording.telemetry.iter();
        let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
        best = (
            Teller::Telemetry,
            heard
                .map(|told| {
                    let numbers =
                        [told.x_m, told.altitude_m, told.pitch_rad, told.u_m_s, told.w_m_s, told.q_rad_s];
                    sample(told.time_s, told.phase.and_then(phase_of), numbers.map(or_nan))
                })
                .collect(),
        );
    }
    if best.1.is_empty() {
        return (Teller::Nobody, Vec::new());
    }
    best.1.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    best
}

/// Summaries of every tick's plan, so that the plans need not be held.
pub(super) fn plans_of(path: &Path) -> Result<Vec<PlanSample>, LogError> {
    let mut log = FlightLog::open(path)?;
    let mut plans = Vec::new();
    while let Some(stamped) = log.next_entry()? {
        if let Entry::Tick(tick) = stamped.entry
            && phase_of(tick.input.phase).is_some_and(Phase::is_landing)
            && !tick.output.plan.states.is_empty()
        {
            plans.push(plan_sample(&tick));
        }
    }
    plans.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let stride = plans.len().div_ceil(PLANS_DRAWN).max(1);
    for (place, plan) in plans.iter_mut().enumerate() {
        if place % stride != 0 {
            plan.path = Vec::new();
        }
    }
    Ok(plans)
}

/// A planned path up to the ground: a plan that does not land ends below it.
pub(super) fn above_ground(path: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    path.take_while(|(_, up_m)| *up_m >= -GROUND_M).collect()
}

fn plan_sample(tick: &v1::ControllerTick) -> PlanSample {
    let plan = &tick.output.plan;
    let node_at = |ahead_s: f64| {
        let node = (ahead_s - plan.starts_in_s) / plan.step_s;
        let whole = node.round();
        let on_node = (node - whole).abs() < 1e-6 && whole >= 0.0;
        on_node.then(|| plan.states.get(whole as usize).map(state_of))?
    };
    PlanSample {
        time_s: tick.input.time_s,
        ahead: AHEAD_S.map(node_at),
        path: above_ground(plan.states.iter().map(|state| (state.x_m, state.z_m))),
    }
}
