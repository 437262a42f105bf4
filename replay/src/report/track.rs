//! A recorded flight, prepared for the report.
//!
//! The plans are not in the log, so the flight computer is run again on its inputs, bit for bit, to
//! get them.

use avionics::log::frame::phase_of;
use avionics::log::logged::state_from_log;
use flight::computer::pilot::{FRAMES_PER_PLAN, Pilot};
use flight::estimation::estimator::Estimate;
use flight::guidance::powered::Plan;
use flight::rules::phase::Phase;
use flight::vehicle::rigid::RigidState;
use nalgebra::UnitQuaternion;
use protocol::dialect::TdPhase;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::flight_v1::{self as v1, TruthSample};
use protocol::log::v1::Telemetry;
use protocol::reported::FlightEvent;

use crate::controller::new_plan;
use crate::findings;
use crate::info::{Info, PhaseSpan, RESET};
use crate::log::Recording;

/// Records of the world this close to a frame belong to the same moment, s.
const SAME_MOMENT_S: f64 = 1e-4;

/// Position north and east of the pad, and height of the feet, m; level and vertical speed, m/s;
/// tilt, rad; rotation rate without roll, rad/s.
pub(super) type State = [f64; 7];

/// Values over time, s on the report's axis.
pub(super) type Series = Vec<(f64, f64)>;

/// A stretch of the time axis with its name, and the class of its ground in the page's style.
#[derive(Debug, Clone)]
pub(super) struct Span {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) name: String,
    pub(super) shade: &'static str,
}

/// The state of the flight at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Vehicle time, s.
    pub(super) time_s: f64,
    pub(super) phase: Option<Phase>,
    pub(super) state: State,
    /// From body to world; telemetry has none.
    pub(super) attitude: Option<UnitQuaternion<f64>>,
}

/// What the flight computer, run again, makes of a planning frame.
pub(super) struct Decision {
    pub(super) time_s: f64,
    pub(super) phase: Option<Phase>,
    pub(super) estimate: Option<Estimate>,
    pub(super) state: Option<State>,
    /// The index of the control level.
    pub(super) level: u32,
    pub(super) iterations: usize,
    /// Inferred while the motor burns, N.
    pub(super) thrust_n: Option<f64>,
    /// The plan that was made in this frame.
    pub(super) plan: Option<Plan>,
}

/// The part of a flight that a picture shows.
#[derive(Debug, Clone, Copy)]
pub(super) enum Part {
    /// From a second before the landing burn to a second after it; all of a flight without one.
    Burn,
    /// Up to contact.
    Air,
    Whole,
}

/// A recorded flight and what the report derives from it.
pub(super) struct Flight {
    pub(super) recording: Recording,
    /// At the end; `None` for a log without frames that can be run again, such as that of a ground
    /// station.
    pub(super) pilot: Option<Pilot>,
    /// At the planning frames.
    pub(super) decisions: Vec<Decision>,
    /// Where the track comes from, in a sentence; `None` if there is none.
    pub(super) source: Option<&'static str>,
    pub(super) track: Vec<Sample>,
    /// As its computer reports them; none if it did not.
    pub(super) events: Vec<FlightEvent>,
    /// Command to the landing motor, vehicle time, s.
    pub(super) ignition_s: Option<f64>,
    /// Contact, vehicle time, s.
    pub(super) touchdown_s: Option<f64>,
    /// T+0 on the clock of the track, s; `None` if the log does not connect the two.
    zero_s: Option<f64>,
    /// Where the findings begin, T+, s.
    pub(super) signs: Vec<f64>,
    /// What pictures show them.
    pub(super) shown: Vec<&'static str>,
    pub(super) spans: Vec<Span>,
}

impl Flight {
    /// A recorded flight and the description of its log, which gets its findings here, if its
    /// computer decides again as it did. Without mission, start or frames the sections report what
    /// is missing.
    pub(super) fn of(recording: Recording, info: &mut Info) -> Self {
        let mut decisions = Vec::new();
        let again = findings::run_again(&recording, |computer, recorded, frame| {
            let pilot = computer.pilot();
            if recorded.input.frame.is_multiple_of(FRAMES_PER_PLAN) || frame.output.planned {
                decisions.push(Decision::of(pilot, frame));
            }
        });
        // A part of the flight says nothing of the rest.
        decisions.retain(|_| again.is_ok());
        let pilot = again.as_ref().ok().map(|(computer, _)| computer.pilot().clone());
        let found = again.and_then(|(_, findings)| findings);
        info.note_again(&recording, found);
        let (source, track) = track(&recording, &decisions);
        let is_ignition = |event: &&FlightEvent| event.phase == TdPhase::TD_PHASE_IGNITION;
        let ignited = info.events.iter().find(is_ignition);
        let clocks = &recording.clocks;
        let heard_zero_s = || Some(clocks.flight_zero_s? - clocks.telemetry_zero_s?);
        let zero_s = if source == Some(RECEIVED) { heard_zero_s() } else { Some(0.0) };
        let found = || info.findings.iter().flatten();
        Self {
            ignition_s: ignited.map(|event| event.at_s + zero_s.unwrap_or(0.0)),
            touchdown_s: recording.contact_s(),
            events: info.events.clone(),
            zero_s,
            signs: found().map(|finding| finding.since_s).collect(),
            shown: found().map(|finding| finding.picture).collect(),
            spans: spans(info, zero_s.unwrap_or(0.0)),
            recording,
            pilot,
            decisions,
            source,
            track,
        }
    }

    /// Time on the report's axes, s.
    pub(super) fn axis_s(&self, time_s: f64) -> f64 {
        time_s - self.zero_s.unwrap_or(0.0)
    }

    /// The vehicle time of a place on the report's axes, s.
    pub(super) fn time_s(&self, axis_s: f64) -> f64 {
        axis_s + self.zero_s.unwrap_or(0.0)
    }

    /// The name of the time axis.
    pub(super) fn axis_name(&self) -> &'static str {
        if self.zero_s.is_some() { "T+, s" } else { "s of the station's clock" }
    }

    /// Whether a part of the flight has a time in it.
    pub(super) fn has(&self, part: Part, time_s: f64) -> bool {
        let (from_s, until_s) = (self.ignition_s, self.touchdown_s.unwrap_or(f64::INFINITY));
        match part {
            Part::Burn => from_s.is_none_or(|from_s| from_s - 1.0 <= time_s) && time_s <= until_s + 1.0,
            Part::Air => time_s <= until_s,
            Part::Whole => true,
        }
    }

    /// Whether the landing motor gave thrust.
    pub(super) fn is_ignited(&self) -> bool {
        self.track.iter().any(|sample| sample.phase == Some(Phase::Powered))
    }

    /// A value of each state.
    pub(super) fn flown(&self, value: impl Fn(&State) -> f64) -> Series {
        self.track.iter().map(|sample| (self.axis_s(sample.time_s), value(&sample.state))).collect()
    }

    /// A value of the simulated world.
    pub(super) fn truth(&self, value: impl Fn(&TruthSample) -> Option<f64>) -> Series {
        let world = self.recording.world.iter();
        world.filter_map(|sample| Some((self.axis_s(sample.time_s), value(sample)?))).collect()
    }

    /// A value of the frames.
    pub(super) fn framed(&self, value: impl Fn(&ComputerFrame) -> Option<f64>) -> Series {
        let frames = self.recording.frames.iter();
        frames.filter_map(|frame| Some((self.axis_s(frame.input.time_s), value(frame)?))).collect()
    }

    /// A value of the recorded estimates.
    pub(super) fn estimated(&self, value: impl Fn(&v1::Estimate) -> Option<f64>) -> Series {
        let recorded = self.recording.estimates.iter().filter_map(|(place, estimate)| {
            let frame = self.recording.frames.get(*place)?;
            Some((self.axis_s(frame.input.time_s), value(estimate)?))
        });
        recorded.collect()
    }

    /// A value of the planning frames.
    pub(super) fn decision(&self, value: impl Fn(&Decision) -> Option<f64>) -> Series {
        let decisions = self.decisions.iter();
        decisions.filter_map(|decision| Some((self.axis_s(decision.time_s), value(decision)?))).collect()
    }

    /// A value that a ground station knew.
    pub(super) fn received(&self, value: impl Fn(&Telemetry) -> Option<f64>) -> Series {
        let telemetry = self.recording.telemetry.iter();
        telemetry.filter_map(|sample| Some((self.axis_s(sample.time_s), value(sample)?))).collect()
    }

    /// The record of the world at a time, s, or the first after it.
    pub(super) fn world_at(&self, time_s: f64) -> Option<&TruthSample> {
        let world = &self.recording.world;
        world.get(world.partition_point(|sample| sample.time_s < time_s - SAME_MOMENT_S))
    }

    /// The state in which it came down.
    pub(super) fn contact(&self) -> Option<State> {
        let contact_s = self.touchdown_s?;
        self.track.iter().rfind(|sample| sample.time_s <= contact_s).map(|sample| sample.state)
    }

    /// A value of the states of the first plan.
    pub(super) fn planned_first(&self, value: impl Fn(&State) -> f64) -> Series {
        let made = self.made();
        let Some((_, plan)) = made.first() else { return Series::new() };
        let at_s = |node: usize| self.axis_s(plan.begins_s() + plan.step_s() * node as f64);
        plan.states().iter().enumerate().map(|(node, state)| (at_s(node), value(&planned(state)))).collect()
    }

    /// The plans, with the frames that made them.
    pub(super) fn made(&self) -> Vec<(&Decision, &Plan)> {
        self.decisions.iter().filter_map(|decision| Some((decision, decision.plan.as_ref()?))).collect()
    }
}

impl Decision {
    fn of(pilot: &Pilot, frame: &ComputerFrame) -> Self {
        let (time_s, level) = (frame.input.time_s, frame.output.level);
        let estimate = pilot.estimate().copied();
        let curve = &pilot.mission().motor_curve;
        let burning = pilot.burning_s(time_s).is_some_and(|burning_s| burning_s > 0.0);
        Self {
            time_s,
            phase: phase_of(&frame.output),
            estimate,
            state: estimate.map(|estimate| state_of(&estimate.state, pilot.feet_height_m(&estimate))),
            level,
            iterations: pilot.report().iterations,
            thrust_n: burning.then(|| pilot.motor().predict(curve, time_s, time_s).thrust_n),
            plan: new_plan(pilot, &frame.output).cloned(),
        }
    }
}

/// The phases behind the pictures, of which one begins where the one before it ends.
fn spans(info: &Info, zero_s: f64) -> Vec<Span> {
    let spans = info.phases.first().map_or(&[][..], |timeline| &timeline.spans);
    let span = |(place, span): (usize, &PhaseSpan)| Span {
        from: span.from_s - zero_s,
        to: spans.get(place + 1).map_or(span.until_s, |next| next.from_s) - zero_s,
        name: span.phase.clone(),
        shade: match Phase::ALL.into_iter().find(|phase| phase.name() == span.phase) {
            Some(Phase::Boost | Phase::Powered) => "hot",
            Some(Phase::Deploy | Phase::AeroDescent | Phase::Chute) => "cool",
            None if span.phase == RESET => "reset",
            _ => "",
        },
    };
    spans.iter().enumerate().map(span).collect()
}

/// Values received by a ground station.
const RECEIVED: &str = "From the telemetry of a ground station; the log has no frames.";

/// The track of the best source, and which that is.
fn track(recording: &Recording, decisions: &[Decision]) -> (Option<&'static str>, Vec<Sample>) {
    let frames = &recording.frames;
    let truth = recording.world.iter().map(|sample| {
        let behind = frames.partition_point(|frame| frame.input.time_s <= sample.time_s + SAME_MOMENT_S);
        let frame = behind.checked_sub(1).and_then(|place| frames.get(place));
        let state = state_from_log(&sample.state);
        Sample {
            time_s: sample.time_s,
            phase: frame.and_then(|frame| phase_of(&frame.output)),
            state: state_of(&state, sample.height_m),
            attitude: Some(state.world_from_body),
        }
    });
    let estimated = decisions.iter().filter_map(|decision| {
        let &Decision { time_s, phase, .. } = decision;
        let attitude = decision.estimate.map(|estimate| estimate.state.world_from_body);
        Some(Sample { time_s, phase, state: decision.state?, attitude })
    });
    let received = recording.telemetry.iter().map(|sample| {
        let level_m_s = sample.north_m_s.zip(sample.east_m_s).map(|(north, east)| libm::hypot(north, east));
        let state = [
            sample.north_m,
            sample.east_m,
            sample.altitude_m,
            level_m_s,
            sample.climb_m_s,
            sample.tilt_rad,
            sample.turn_rate_rad_s,
        ];
        let phase = sample.phase.and_then(|phase| Phase::from_index(u8::try_from(phase).ok()?));
        let state = state.map(|value| value.unwrap_or(f64::NAN));
        Sample { time_s: sample.time_s, phase, state, attitude: None }
    });
    let sources: [(&str, Vec<Sample>); 3] = [
        ("From the simulated truth.", truth.collect()),
        ("From the flight computer's estimate; the log has no truth.", estimated.collect()),
        (RECEIVED, received.collect()),
    ];
    let found = sources.into_iter().find(|(_, track)| !track.is_empty());
    let Some((source, mut track)) = found else { return (None, Vec::new()) };
    track.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    (Some(source), track)
}

/// The state of a vehicle whose feet are at a height, m.
fn state_of(state: &RigidState, height_m: f64) -> State {
    let (place, velocity, rate) = (&state.position_m, &state.velocity_m_s, &state.rate_rad_s);
    let level_m_s = libm::hypot(velocity.x, velocity.y);
    // East is against y.
    [place.x, -place.y, height_m, level_m_s, velocity.z, state.tilt_rad(), libm::hypot(rate.y, rate.z)]
}

/// The state at a node of a plan.
pub(super) fn planned(node: &ocp::landing::State) -> State {
    let [north, west, height_m, north_m_s, west_m_s, up_m_s, p, r, p_rate, r_rate] = node;
    let ((sin_p, cos_p), (sin_r, cos_r)) = (libm::sincos(*p), libm::sincos(*r));
    let tilt_rad = libm::atan2(libm::hypot(sin_p, cos_p * sin_r), cos_p * cos_r);
    let level_m_s = libm::hypot(*north_m_s, *west_m_s);
    [*north, -west, *height_m, level_m_s, *up_m_s, tilt_rad, libm::hypot(*p_rate, cos_p * r_rate)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3-4-5 triangles; a nose that leans 30 deg to one side only is tilted by as much.
    #[test]
    fn val_hand_a_node_of_a_plan_is_a_state_over_the_ground() {
        let lean = 30.0_f64.to_radians();
        let [north, east, height_m, level_m_s, up_m_s, tilt_rad, rate] =
            planned(&[7.0, -8.0, 9.0, 3.0, 4.0, -2.0, 0.0, lean, 0.3, 0.4]);
        let exact = [north, east, height_m, level_m_s, up_m_s].map(f64::to_bits);
        assert_eq!(exact, [7.0, 8.0, 9.0, 5.0, -2.0].map(f64::to_bits));
        assert!((tilt_rad - lean).abs() < 1e-12 && (rate - 0.5).abs() < 1e-12, "{tilt_rad} {rate}");
    }
}
