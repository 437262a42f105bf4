//! Prepares a flight from apogee for the report, seen in the plane of its landing.
//!
//! The plans are not in the log, so the flight computer is run again on its inputs, bit for bit, to get them. The data
//! that the sections read for a planar landing (records of the plant, ticks, plans) are derived from this flight: each
//! planning frame becomes a tick. Plans are made in the frame of the moving air; here they are converted to the ground.

use flight::computer::pilot::{FRAMES_PER_PLAN, Pilot};
use flight::estimation::estimator::Estimate;
use flight::guidance::controller::ControlLevel;
use flight::guidance::powered::{Plane, PoweredReport};
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::RigidState;
use flight::vehicle::thrust_curve::ThrustCurve;
use nalgebra::Vector3;
use protocol::log::{flight_v1, v1};
use tick_log::pilot::{state_from_log, vector_from_log};
use tick_log::state_to_log;

use super::track::{
    AHEAD_S, EstimateError, Flight, GimbalAxis, InSpace, PLANS_DRAWN, PlanSample, Vehicle, above_ground,
    phase_of, track_of,
};
use crate::controller::{LoggedPilot, NewPlans, Replayed as _};
use crate::log::Recording;

/// Records of the world this close to a frame belong to the same moment, s.
const SAME_MOMENT_S: f64 = 1e-4;

/// The flight computer's estimate and plan at a planning frame.
struct Thought {
    frame: u64,
    time_s: f64,
    phase: u32,
    level: u32,
    estimate: Option<Estimate>,
    burning_s: f64,
    impulse_scale: f64,
    inferred_n: f64,
    /// If a plan was made at this frame: the solution, its path, and the time between path points, s.
    plan: Option<(PoweredReport, Vec<PlanarState>, f64)>,
}

/// The flight, seen in the plane of its landing.
pub(super) fn flight(mut recording: Recording) -> Flight {
    let Some((mission, curve, thoughts, pilot)) = run_again(&recording) else {
        // Without mission, start or frames the sections report what is missing.
        return Flight::new(recording, Vec::new());
    };
    let nil = Vector3::zeros();
    let plane = pilot.plane().copied().unwrap_or_else(|| Plane::choose(&nil, &nil, &nil));
    let truth: Vec<v1::PlantTruth> =
        recording.world.iter().map(|sample| plant(sample, &recording.frames, &plane)).collect();
    let ignition_s = pilot.ignited_at_s();
    let ticks = thoughts.iter().map(|thought| tick(thought, &recording.world, &plane)).collect();
    let plans = plans(&thoughts, &plane);
    let gimbal =
        [("Gimbal pitch", 0), ("Gimbal yaw", 1)].map(|(name, axis)| gimbal(name, axis, &recording.world));
    let impulse_n_s: f64 = recording
        .world
        .windows(2)
        .map(|pair| 0.5 * (pair[0].thrust_n + pair[1].thrust_n) * (pair[1].time_s - pair[0].time_s))
        .sum();
    let burnt_out = recording.world.last().is_some_and(|last| last.thrust_n <= 0.0);
    let in_air = |time_s: f64| recording.verdict.as_ref().is_none_or(|verdict| time_s <= verdict.time_s);
    let from_apogee = InSpace {
        plane: plane_in_words(pilot.plane()),
        across_m: recording
            .world
            .iter()
            .map(|sample| (sample.time_s, place(sample).dot(&plane.across)))
            .collect(),
        errors: thoughts
            .iter()
            .filter(|thought| in_air(thought.time_s))
            .filter_map(|thought| error(thought.estimate.as_ref()?, thought.time_s, &recording.world))
            .collect(),
        // On the way up nothing estimates the wind.
        wind_m_s: thoughts
            .iter()
            .filter(|thought| phase_of(thought.phase).is_some_and(|phase| !phase.before_apogee()))
            .filter_map(|thought| {
                let wind = thought.estimate.as_ref()?.wind_m_s;
                Some((thought.time_s, [wind.x, -wind.y]))
            })
            .collect(),
        inferred_scales: pilot
            .motor()
            .ignition_s()
            .map(|_| (pilot.motor().impulse_scale(), pilot.motor().burn_time_stretch())),
        true_impulse_scale: (burnt_out && impulse_n_s > 0.0).then(|| impulse_n_s / curve.total_impulse_n_s()),
    };
    recording.truth = truth;
    recording.ticks = ticks;
    if let Some(verdict) = &mut recording.verdict {
        // In the same plane as everything else.
        let contact = recording.truth.iter().rfind(|truth| truth.time_s <= verdict.time_s);
        verdict.state = contact.map_or(verdict.state, |truth| truth.state);
    }
    let (teller, track) = track_of(&recording);
    Flight {
        vehicle: Some(vehicle(&mission, curve)),
        from_apogee: Some(from_apogee),
        gimbal: gimbal.into(),
        inferred_n: thoughts
            .iter()
            .filter(|thought| thought.burning_s > 0.0)
            .map(|thought| (thought.time_s, thought.inferred_n))
            .collect(),
        plans,
        teller,
        track,
        ignition_s,
        touchdown_s: recording.contact_s(),
        recording,
    }
}

fn place(sample: &flight_v1::TruthSample) -> Vector3<f64> {
    vector_from_log(&sample.state.position_m)
}

/// The plane's direction; a flight without a landing has none, and is seen from the west.
fn plane_in_words(plane: Option<&Plane>) -> String {
    // East is against y.
    match plane {
        None => "the plane of north and up, because no landing was planned".to_owned(),
        Some(plane) => {
            let deg = libm::atan2(-plane.along.y, plane.along.x).to_degrees();
            format!("the vertical plane of the landing, {:.0} deg from north to east", deg.rem_euclid(360.0))
        }
    }
}

/// Estimate less truth at the moment of an estimate; `None` without a record of the world then.
fn error(estimate: &Estimate, time_s: f64, world: &[flight_v1::TruthSample]) -> Option<EstimateError> {
    let place = world.partition_point(|sample| sample.time_s < time_s - SAME_MOMENT_S);
    let sample = world.get(place).filter(|sample| (sample.time_s - time_s).abs() < SAME_MOMENT_S)?;
    let truth = state_from_log(&sample.state);
    // East is against y.
    let to_ground = |vector: Vector3<f64>| [vector.x, -vector.y, vector.z];
    let cosine = estimate.state.nose_in_world().dot(&truth.nose_in_world());
    Some(EstimateError {
        position_m: to_ground(estimate.state.position_m - truth.position_m),
        velocity_m_s: to_ground(estimate.state.velocity_m_s - truth.velocity_m_s),
        nose_rad: libm::acos(cosine.clamp(-1.0, 1.0)),
    })
}

/// Runs the flight computer again and returns its estimate and plan at every tenth frame; `None` if the log lacks
/// records.
fn run_again(recording: &Recording) -> Option<(Mission, ThrustCurve, Vec<Thought>, Pilot)> {
    let (start, frames) = recording.replayable_frames().ok()?;
    let toml = recording.profile_toml().ok()?;
    let mut controller = LoggedPilot::recorded(toml, start, &recording.head.run, &[]).ok()?;
    let mission = controller.pilot().mission().clone();
    let curve = mission.motor_curve.clone();
    let (mut thoughts, mut plans) = (Vec::new(), NewPlans::default());
    for recorded in frames {
        let again = controller.run_again(recorded).ok()?;
        if !recorded.input.frame.is_multiple_of(FRAMES_PER_PLAN) {
            continue;
        }
        let (pilot, time_s) = (controller.pilot(), recorded.input.time_s);
        let plan = plans.made(pilot, again.output.level);
        thoughts.push(Thought {
            frame: recorded.input.frame,
            time_s,
            phase: again.output.phase,
            level: again.output.level,
            estimate: pilot.estimate().copied(),
            burning_s: pilot.burning_s(time_s).unwrap_or(0.0),
            impulse_scale: pilot.motor().impulse_scale(),
            inferred_n: pilot.motor().predict(&curve, time_s, time_s).thrust_n,
            plan: plan.map(|(states, step_s)| (*pilot.report(), states.to_vec(), step_s)),
        });
    }
    Some((mission, curve, thoughts, controller.pilot().clone()))
}

fn vehicle(mission: &Mission, curve: ThrustCurve) -> Vehicle {
    let airframe = &mission.airframe;
    let weight_n = airframe.mass.loaded_kg * mission.gravity_m_s2;
    let delay_s = mission.ignition.delay_s;
    Vehicle {
        gravity_m_s2: mission.gravity_m_s2,
        weight_n,
        half_thrust_n: 0.5 * curve.total_impulse_n_s() / curve.burn_time_s(),
        gimbal_limit_deg: airframe.gimbal.limit_deg,
        gimbal_rate_rad_s: Some(airframe.gimbal.servo.rate_rad_s()),
        fin_rate_deg_s: airframe.fins.servo.rate_rad_s().to_degrees(),
        expected_n: Box::new(move |since_s| curve.thrust_at_n(since_s - delay_s)),
    }
}

/// The state in the plane, relative to the ground; altitude is the height of the feet.
fn in_plane(plane: &Plane, state: &RigidState, height_m: f64) -> PlanarState {
    PlanarState { z_m: height_m, ..plane.project(state, 0.0, 0.0) }
}

impl Thought {
    /// The wind along the plane of this frame's plan, m/s.
    fn wind_m_s(&self, plane: &Plane) -> f64 {
        self.estimate.as_ref().map_or(0.0, |estimate| estimate.wind_m_s.push(0.0).dot(&plane.along))
    }
}

fn plant(sample: &flight_v1::TruthSample, frames: &[flight_v1::PilotTick], plane: &Plane) -> v1::PlantTruth {
    let behind = frames.partition_point(|tick| tick.input.time_s <= sample.time_s + SAME_MOMENT_S);
    let phase = behind.checked_sub(1).and_then(|place| frames.get(place)).map_or(0, |tick| tick.output.phase);
    v1::PlantTruth {
        time_s: sample.time_s,
        phase,
        state: state_to_log(&in_plane(plane, &state_from_log(&sample.state), sample.height_m)),
        gimbal_commanded_rad: sample.gimbal_commanded_rad.first().copied().unwrap_or(0.0),
        gimbal_actual_rad: sample.gimbal_actual_rad.first().copied().unwrap_or(0.0),
        fin_commanded_rad: sample.fins_commanded_rad.clone(),
        fin_actual_rad: sample.fins_actual_rad.clone(),
        thrust_n: sample.thrust_n,
        mass_kg: sample.mass_kg,
        in_contact: sample.in_contact,
    }
}

fn gimbal(name: &'static str, axis: usize, world: &[flight_v1::TruthSample]) -> GimbalAxis {
    let over = |angles: fn(&flight_v1::TruthSample) -> &Vec<f64>| {
        world.iter().filter_map(|sample| Some((sample.time_s, *angles(sample).get(axis)?))).collect()
    };
    GimbalAxis {
        name,
        commanded: over(|sample| &sample.gimbal_commanded_rad),
        actual: over(|sample| &sample.gimbal_actual_rad),
    }
}

fn tick(thought: &Thought, world: &[flight_v1::TruthSample], plane: &Plane) -> v1::ControllerTick {
    let place = world.partition_point(|sample| sample.time_s < thought.time_s - SAME_MOMENT_S);
    // The feet are below the centre of gravity, as in the record of the world.
    let feet_below_m = world.get(place).map_or(0.0, |sample| sample.state.position_m.z - sample.height_m);
    let state = thought.estimate.as_ref().map_or_else(PlanarState::default, |estimate| {
        in_plane(plane, &estimate.state, estimate.state.position_m.z - feet_below_m)
    });
    let mut tick = v1::ControllerTick::default();
    tick.input = v1::ControllerInput {
        tick: thought.frame,
        time_s: thought.time_s,
        phase: thought.phase,
        time_since_ignition_s: thought.burning_s,
        state: state_to_log(&state),
        thrust_scale: thought.impulse_scale,
        ..v1::ControllerInput::default()
    };
    tick.output.level = thought.level;
    if let Some((report, _, _)) = &thought.plan {
        tick.output.solver.status = u32::from(report.status.index());
        tick.output.solver.iterations = u32::try_from(report.iterations).unwrap_or(u32::MAX);
        tick.output.solver.cost = report.cost;
        tick.output.predicted_touchdown.time_from_now_s = report.touchdown_in_s;
        let touchdown = Plane::over_ground(&report.touchdown, thought.wind_m_s(plane), report.touchdown_in_s);
        tick.output.predicted_touchdown.state = state_to_log(&touchdown);
    } else {
        tick.output.level = u32::from(ControlLevel::Idle.index());
    }
    tick
}

fn plans(thoughts: &[Thought], plane: &Plane) -> Vec<PlanSample> {
    let made: Vec<&Thought> = thoughts.iter().filter(|thought| thought.plan.is_some()).collect();
    let stride = made.len().div_ceil(PLANS_DRAWN).max(1);
    let sample = |(place, thought): (usize, &&Thought)| {
        let (_, states, step_s) = thought.plan.as_ref()?;
        let wind_m_s = thought.wind_m_s(plane);
        let nodes = states.iter().enumerate();
        let states: Vec<[f64; 6]> = nodes
            .map(|(node, state)| Plane::over_ground(state, wind_m_s, node as f64 * step_s).to_array())
            .collect();
        let drawn = place.is_multiple_of(stride);
        Some(PlanSample {
            time_s: thought.time_s,
            ahead: AHEAD_S.map(|ahead_s| between(&states, ahead_s / step_s)),
            path: if drawn {
                above_ground(states.iter().map(|state| (state[0], state[1])))
            } else {
                Vec::new()
            },
        })
    };
    made.iter().enumerate().filter_map(sample).collect()
}

/// The state after a number of steps, interpolated between nodes; `None` after the last.
fn between(states: &[[f64; 6]], steps: f64) -> Option<[f64; 6]> {
    let share = steps.fract();
    let (before, after) = (states.get(steps as usize)?, states.get(steps as usize + 1)?);
    Some(core::array::from_fn(|i| (1.0 - share) * before[i] + share * after[i]))
}
