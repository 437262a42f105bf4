//! A recorded flight, prepared for the report and seen in the plane of its landing.
//!
//! The plans are not in the log, so the flight computer is run again on its inputs, bit for bit, to get them. Plans are
//! made in the frame of the moving air; here they are converted to the ground.

use campaign::figure::Span;
use flight::computer::findings::Findings;
use flight::computer::pilot::{FRAMES_PER_PLAN, Pilot};
use flight::estimation::estimator::{AidStatus, Aids, Estimate};
use flight::guidance::powered::ControlLevel;
use flight::guidance::powered::{Plane, PoweredReport};
use flight::rules::phase::Phase;
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::RigidState;
use flight::vehicle::thrust_curve::ThrustCurve;
use flight_log::logged::{state_from_log, vector_from_log};
use nalgebra::Vector3;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::flight_v1;

use super::chart::{Chart, Line};
use crate::controller::{LoggedComputer, NewPlans};
use crate::info::{Info, PhaseSpan};
use crate::log::Recording;

/// Prediction times at which predictions are compared with the flight, s.
pub(super) const AHEAD_S: [f64; 2] = [0.1, 0.5];

/// A plan that ends this far below the ground ends on it, m.
const GROUND_M: f64 = 0.05;

const PLANS_DRAWN: usize = 8;

/// Records of the world this close to a frame belong to the same moment, s.
const SAME_MOMENT_S: f64 = 1e-4;

/// The state of the flight at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Vehicle time, s.
    pub(super) time_s: f64,
    pub(super) phase: Option<Phase>,
    /// x, z, theta, u, w, q.
    pub(super) state: [f64; 6],
}

/// The simulated world at one time.
#[derive(Debug, Clone)]
pub(super) struct Plant {
    pub(super) sample: Sample,
    pub(super) fins_rad: Vec<f64>,
    pub(super) thrust_n: f64,
    pub(super) mass_kg: f64,
    pub(super) in_contact: bool,
}

/// What the flight computer estimated and decided at a planning frame.
#[derive(Debug, Clone)]
pub(super) struct Decision {
    /// The estimated state.
    pub(super) sample: Sample,
    /// The index of the control level.
    pub(super) level: u32,
    pub(super) iterations: usize,
    /// The touchdown that a plan made at this frame predicts: time from now, s, and state.
    pub(super) touchdown: Option<(f64, [f64; 6])>,
}

/// A summary of one plan.
#[derive(Debug, Clone)]
pub(super) struct PlanSample {
    /// Vehicle time of its frame, s.
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
    pub(super) gimbal_rate_rad_s: f64,
    pub(super) fin_rate_deg_s: f64,
    /// Thrust expected at a time since the ignition command, s to N.
    pub(super) expected_n: Box<dyn Fn(f64) -> f64>,
}

impl Vehicle {
    fn of(mission: &Mission) -> Self {
        let (airframe, curve) = (&mission.airframe, mission.motor_curve.clone());
        let delay_s = mission.ignition.delay_s;
        Self {
            gravity_m_s2: mission.gravity_m_s2,
            weight_n: airframe.mass.loaded_kg * mission.gravity_m_s2,
            half_thrust_n: 0.5 * curve.total_impulse_n_s() / curve.burn_time_s(),
            gimbal_limit_deg: airframe.gimbal.limit_deg,
            gimbal_rate_rad_s: airframe.gimbal.servo.rate_rad_s(),
            fin_rate_deg_s: airframe.fins.servo.rate_rad_s().to_degrees(),
            expected_n: Box::new(move |since_s| curve.thrust_at_n(since_s - delay_s)),
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

/// What only the frames of a flight computer tell.
#[derive(Debug, Clone, Default)]
pub(super) struct InSpace {
    /// Impulse and burn time divided by what the mission expected, as estimated at the end.
    pub(super) inferred_scales: Option<(f64, f64)>,
    /// The motor of another curve that the burn turned out to have.
    pub(super) other_curve: Option<String>,
    /// How far the mission expected the two to be off, as standard deviations.
    pub(super) expected_sigmas: (f64, f64),
    /// Burns of its lot that confirm the motor's curve.
    pub(super) motor_burns: u32,
    /// True impulse divided by the expected impulse.
    pub(super) true_impulse_scale: Option<f64>,
    /// The plane of the landing in words, as in `124 deg from north`.
    pub(super) plane: String,
    /// Direction across it: the vehicle's place along this direction, m, over vehicle time, s.
    pub(super) across_m: Vec<(f64, f64)>,
    /// Estimate less truth, from the release to contact.
    pub(super) errors: Vec<EstimateError>,
    /// Test ratios of barometer, satellite velocity and position, and lidar: vehicle time, s, and ratio.
    pub(super) test_ratios: TestRatios,
    /// Of each aid its name, and how many of its measurements were used and refused.
    pub(super) aids: Vec<(&'static str, u32, u32)>,
    /// Standard deviations of height, place, m, and velocity, m/s, at each planning frame.
    pub(super) sigmas: Vec<(f64, [f64; 3])>,
    /// The estimated bias of the gyro at each planning frame, body, rad/s.
    pub(super) gyro_bias_rad_s: Vec<(f64, [f64; 3])>,
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
    /// `None` for a log without frames that can be run again, such as that of a ground station.
    pub(super) in_space: Option<InSpace>,
    pub(super) plant: Vec<Plant>,
    /// At the planning frames.
    pub(super) thoughts: Vec<Decision>,
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
    /// T+0 on the clock of the track, s; `None` if the log does not connect the two.
    pub(super) zero_s: Option<f64>,
    /// Where the findings begin, T+, s.
    pub(super) signs: Vec<f64>,
    pub(super) spans: Vec<Span>,
}

/// What the flight computer, run again, makes of a planning frame.
struct Again {
    time_s: f64,
    phase: u32,
    level: u32,
    estimate: Option<Estimate>,
    burning_s: f64,
    inferred_n: f64,
    /// If a plan was made at this frame: the solution, its path, and the time between path points, s.
    plan: Option<(PoweredReport, Vec<PlanarState>, f64)>,
}

impl Flight {
    /// A recorded flight. Without mission, start or frames the sections report what is missing.
    /// Beside it what its computer shows, if it decides again as it did.
    pub(super) fn of(recording: Recording) -> (Self, Option<Findings>) {
        match RunAgain::on(&recording) {
            None => (Self::heard(recording), None),
            Some(again) => {
                let RunAgain { mission, frames, pilot, test_ratios, findings } = again;
                (Self::told(recording, &mission, &frames, &pilot, test_ratios), findings)
            }
        }
    }

    /// A flight of which only the telemetry of a ground station tells.
    fn heard(recording: Recording) -> Self {
        let mut gimbal = GimbalAxis { name: "Gimbal angle", commanded: Vec::new(), actual: Vec::new() };
        let mut track = Vec::new();
        for told in &recording.telemetry {
            gimbal.commanded.extend(told.gimbal_commanded_rad.map(|rad| (told.time_s, rad)));
            gimbal.actual.extend(told.gimbal_measured_rad.map(|rad| (told.time_s, rad)));
            let state = [told.x_m, told.altitude_m, told.pitch_rad, told.u_m_s, told.w_m_s, told.q_rad_s];
            let state = state.map(|value| value.unwrap_or(f64::NAN));
            track.push(Sample { time_s: told.time_s, phase: told.phase.and_then(phase_of), state });
        }
        track.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let burning = |sample: &&Sample| sample.phase.is_some_and(Phase::in_landing_burn);
        Self {
            vehicle: None,
            in_space: None,
            plant: Vec::new(),
            thoughts: Vec::new(),
            gimbal: vec![gimbal],
            inferred_n: Vec::new(),
            plans: Vec::new(),
            teller: if track.is_empty() { Teller::Nobody } else { Teller::Telemetry },
            ignition_s: track.iter().find(burning).map(|sample| sample.time_s),
            touchdown_s: recording.contact_s(),
            zero_s: None,
            signs: Vec::new(),
            spans: Vec::new(),
            track,
            recording,
        }
    }

    /// A flight whose computer was run again.
    fn told(
        recording: Recording,
        mission: &Mission,
        again: &[Again],
        pilot: &Pilot,
        test_ratios: TestRatios,
    ) -> Self {
        let nil = Vector3::zeros();
        let plane = pilot.plane().copied().unwrap_or_else(|| Plane::choose(&nil, &nil, &nil));
        let world = &recording.world;
        let plant: Vec<Plant> = world.iter().map(|sample| plant(sample, &recording.frames, &plane)).collect();
        let thoughts: Vec<Decision> = again.iter().map(|frame| thought(frame, world, &plane)).collect();
        let known = |samples: Vec<Sample>| Some(samples).filter(|samples| !samples.is_empty());
        let of_plant = known(plant.iter().map(|plant| plant.sample).collect());
        let (teller, track) = match (of_plant, known(thoughts.iter().map(|thought| thought.sample).collect()))
        {
            (Some(track), _) => (Teller::Plant, track),
            (None, Some(track)) => (Teller::Estimate, track),
            (None, None) => (Teller::Nobody, Vec::new()),
        };
        Self {
            vehicle: Some(Vehicle::of(mission)),
            in_space: Some(in_space(&recording, mission, again, pilot, &plane, test_ratios)),
            gimbal: [("Gimbal pitch", 0), ("Gimbal yaw", 1)]
                .map(|(name, axis)| gimbal(name, axis, world))
                .into(),
            inferred_n: again
                .iter()
                .filter(|frame| frame.burning_s > 0.0)
                .map(|frame| (frame.time_s, frame.inferred_n))
                .collect(),
            plans: plans(again, &plane),
            ignition_s: pilot.ignited_at_s(),
            touchdown_s: recording.contact_s(),
            zero_s: Some(0.0),
            signs: Vec::new(),
            spans: Vec::new(),
            plant,
            thoughts,
            teller,
            track,
            recording,
        }
    }

    /// Time on the report's axes, s.
    pub(super) fn axis_s(&self, time_s: f64) -> f64 {
        time_s - self.zero_s.unwrap_or(0.0)
    }

    /// The name of the time axis.
    pub(super) fn axis_name(&self) -> &'static str {
        if self.zero_s.is_some() { "T+, s" } else { "s of the station's clock" }
    }

    /// Lines over time, with what happened and what went wrong.
    pub(super) fn over_time(&self, title: &str, lines: Vec<Line>) -> Chart {
        Chart {
            title: title.to_owned(),
            x_label: self.axis_name(),
            lines,
            marks: self.marks(),
            signs: self.signs.clone(),
            ..Chart::default()
        }
    }

    /// What the description of the log adds: the phases behind the pictures, and where the findings begin.
    pub(super) fn with(mut self, info: &Info) -> Self {
        let clocks = &self.recording.clocks;
        if self.teller == Teller::Telemetry {
            self.zero_s = clocks.flight_zero_s.zip(clocks.telemetry_zero_s).map(|(flight, own)| flight - own);
        }
        let findings = info.findings.iter().flatten();
        self.signs = findings.map(|finding| finding.since_s).filter(|since_s| since_s.is_finite()).collect();
        let spans = info.phases.first().map_or(&[][..], |timeline| &timeline.spans);
        let until_s = |place: usize| spans.get(place + 1).map(|next| next.from_s);
        let span = |(place, span): (usize, &PhaseSpan)| Span {
            from: self.axis_s(span.from_s),
            to: self.axis_s(until_s(place).unwrap_or(span.until_s)),
            name: span.phase.clone(),
            shade: match Phase::ALL.into_iter().find(|phase| phase.name() == span.phase) {
                Some(Phase::Boost | Phase::Ignition | Phase::Powered) => Some(0),
                Some(Phase::Deploy | Phase::AeroDescent | Phase::Chute) => Some(1),
                _ => None,
            },
        };
        self.spans = spans.iter().enumerate().map(span).collect();
        self
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

    /// The last known state before contact.
    pub(super) fn contact(&self) -> Option<[f64; 6]> {
        let contact_s = self.touchdown_s?;
        self.track.iter().rfind(|sample| sample.time_s <= contact_s).map(|sample| sample.state)
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

pub(super) fn phase_of(number: u32) -> Option<Phase> {
    u8::try_from(number).ok().and_then(Phase::from_index)
}

/// What the frames tell beside the plane of the landing.
fn in_space(
    recording: &Recording,
    mission: &Mission,
    again: &[Again],
    pilot: &Pilot,
    plane: &Plane,
    test_ratios: TestRatios,
) -> InSpace {
    let world = &recording.world;
    let impulse_n_s: f64 = world
        .windows(2)
        .map(|pair| 0.5 * (pair[0].thrust_n + pair[1].thrust_n) * (pair[1].time_s - pair[0].time_s))
        .sum();
    let burnt_out = world.last().is_some_and(|last| last.thrust_n <= 0.0);
    let expected_n_s = mission.motor_curve.total_impulse_n_s();
    let known = || again.iter().filter_map(|frame| Some((frame.time_s, frame.estimate?)));
    let in_air = |time_s: f64| recording.verdict.as_ref().is_none_or(|verdict| time_s <= verdict.time_s);
    InSpace {
        plane: plane_in_words(pilot.plane()),
        across_m: world
            .iter()
            .map(|sample| (sample.time_s, vector_from_log(&sample.state.position_m).dot(&plane.across)))
            .collect(),
        errors: again
            .iter()
            .filter(|frame| in_air(frame.time_s))
            .filter_map(|frame| error(frame.estimate.as_ref()?, frame.time_s, world))
            .collect(),
        test_ratios,
        aids: named_aids(pilot.estimator().aids()).map(|(name, aid)| (name, aid.used, aid.refused)).into(),
        sigmas: known()
            .map(|(time_s, estimate)| {
                let (place, velocity) = (&estimate.sigmas.position_m, &estimate.sigmas.velocity_m_s);
                (time_s, [place.z, place.xy().norm(), velocity.norm()])
            })
            .collect(),
        gyro_bias_rad_s: known()
            .map(|(time_s, estimate)| (time_s, estimate.gyro_bias_rad_s.into()))
            .collect(),
        // On the way up nothing estimates the wind.
        wind_m_s: again
            .iter()
            .filter(|frame| phase_of(frame.phase).is_some_and(|phase| !phase.before_apogee()))
            .filter_map(|frame| {
                let wind = frame.estimate.as_ref()?.wind_m_s;
                Some((frame.time_s, [wind.x, -wind.y]))
            })
            .collect(),
        inferred_scales: pilot.motor().ignition_s().map(|_| pilot.scales().into()),
        other_curve: pilot.other_curve().map(str::to_owned),
        expected_sigmas: (mission.motor.impulse_sigma, mission.motor.burn_time_sigma),
        motor_burns: mission.motor_burns(),
        true_impulse_scale: (burnt_out && impulse_n_s > 0.0).then(|| impulse_n_s / expected_n_s),
    }
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

/// Of barometer, satellite velocity and position, and lidar: vehicle time, s, and ratio.
type TestRatios = [Vec<(f64, f64)>; 4];

fn named_aids(aids: &Aids) -> [(&'static str, AidStatus); 4] {
    [
        ("barometer", aids.barometer),
        ("GNSS velocity", aids.gnss_velocity),
        ("GNSS position", aids.gnss_position),
        ("lidar", aids.lidar),
    ]
}

/// What the flight computer makes of the log's frames.
struct RunAgain {
    mission: Mission,
    /// Estimate and plan at every tenth frame.
    frames: Vec<Again>,
    /// At the end.
    pilot: Pilot,
    test_ratios: TestRatios,
    /// What it shows; `None` if it decides otherwise than it did.
    findings: Option<Findings>,
}

impl RunAgain {
    /// Runs the flight computer again; `None` if the log lacks records.
    fn on(recording: &Recording) -> Option<Self> {
        let (start, recorded_frames) = recording.replayable_frames().ok()?;
        let toml = recording.profile_toml().ok()?;
        let mut controller = LoggedComputer::recorded(toml, start, &recording.head.run, &[]).ok()?;
        let mission = controller.pilot().mission().clone();
        let curve: ThrustCurve = mission.motor_curve.clone();
        let (mut frames, mut plans) = (Vec::new(), NewPlans::default());
        let mut test_ratios = TestRatios::default();
        let mut findings = Some(Findings::default());
        for recorded in recorded_frames {
            let frame = controller.run_again(recorded).ok()?;
            findings = findings.filter(|_| frame.output == recorded.output);
            if let Some(findings) = &mut findings {
                findings.note(controller.computer());
            }
            let aids = named_aids(controller.pilot().estimator().aids());
            for ((_, aid), ratios) in aids.iter().zip(&mut test_ratios).filter(|((_, aid), _)| aid.fresh) {
                ratios.push((recorded.input.time_s, aid.test_ratio));
            }
            if !recorded.input.frame.is_multiple_of(FRAMES_PER_PLAN) {
                continue;
            }
            let (pilot, time_s) = (controller.pilot(), recorded.input.time_s);
            let plan = plans.made(pilot, frame.output.level);
            frames.push(Again {
                time_s,
                phase: frame.output.phase,
                level: frame.output.level,
                estimate: pilot.estimate().copied(),
                burning_s: pilot.burning_s(time_s).unwrap_or(0.0),
                inferred_n: pilot.motor().predict(&curve, time_s, time_s).thrust_n,
                plan: plan.map(|(states, step_s)| (*pilot.report(), states.to_vec(), step_s)),
            });
        }
        Some(Self { mission, frames, pilot: controller.pilot().clone(), test_ratios, findings })
    }
}

/// The state in the plane, relative to the ground; altitude is the height of the feet.
fn in_plane(plane: &Plane, state: &RigidState, height_m: f64) -> [f64; 6] {
    PlanarState { z_m: height_m, ..plane.project(state, 0.0, 0.0) }.to_array()
}

impl Again {
    /// The wind along the plane of this frame's plan, m/s.
    fn wind_m_s(&self, plane: &Plane) -> f64 {
        self.estimate.as_ref().map_or(0.0, |estimate| estimate.wind_m_s.push(0.0).dot(&plane.along))
    }
}

fn plant(sample: &flight_v1::TruthSample, frames: &[ComputerFrame], plane: &Plane) -> Plant {
    let behind = frames.partition_point(|frame| frame.input.time_s <= sample.time_s + SAME_MOMENT_S);
    let frame = behind.checked_sub(1).and_then(|place| frames.get(place));
    Plant {
        sample: Sample {
            time_s: sample.time_s,
            phase: phase_of(frame.map_or(0, |frame| frame.output.phase)),
            state: in_plane(plane, &state_from_log(&sample.state), sample.height_m),
        },
        fins_rad: sample.fins_actual_rad.clone(),
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

fn thought(frame: &Again, world: &[flight_v1::TruthSample], plane: &Plane) -> Decision {
    let place = world.partition_point(|sample| sample.time_s < frame.time_s - SAME_MOMENT_S);
    // The feet are below the centre of gravity, as in the record of the world.
    let feet_below_m = world.get(place).map_or(0.0, |sample| sample.state.position_m.z - sample.height_m);
    let state = frame.estimate.as_ref().map_or([0.0; 6], |estimate| {
        in_plane(plane, &estimate.state, estimate.state.position_m.z - feet_below_m)
    });
    let plan = frame.plan.as_ref().map(|(report, ..)| report);
    Decision {
        sample: Sample { time_s: frame.time_s, phase: phase_of(frame.phase), state },
        level: plan.map_or(u32::from(ControlLevel::Idle.index()), |_| frame.level),
        iterations: plan.map_or(0, |report| report.iterations),
        touchdown: plan.map(|report| {
            let in_s = report.touchdown_in_s;
            (in_s, Plane::over_ground(&report.touchdown, frame.wind_m_s(plane), in_s).to_array())
        }),
    }
}

fn plans(again: &[Again], plane: &Plane) -> Vec<PlanSample> {
    let made: Vec<&Again> = again.iter().filter(|frame| frame.plan.is_some()).collect();
    let stride = made.len().div_ceil(PLANS_DRAWN).max(1);
    let sample = |(place, frame): (usize, &&Again)| {
        let (_, states, step_s) = frame.plan.as_ref()?;
        let wind_m_s = frame.wind_m_s(plane);
        let nodes = states.iter().enumerate();
        let states: Vec<[f64; 6]> = nodes
            .map(|(node, state)| Plane::over_ground(state, wind_m_s, node as f64 * step_s).to_array())
            .collect();
        let drawn = place.is_multiple_of(stride);
        Some(PlanSample {
            time_s: frame.time_s,
            ahead: AHEAD_S.map(|ahead_s| between(&states, ahead_s / step_s)),
            // A plan that does not land ends below the ground.
            path: states
                .iter()
                .filter(|_| drawn)
                .map(|state| (state[0], state[1]))
                .take_while(|(_, up_m)| *up_m >= -GROUND_M)
                .collect(),
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
