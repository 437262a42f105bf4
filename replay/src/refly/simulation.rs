//! Flies the simulated plant and the flight computer from the start to the ground.

use std::collections::BTreeMap;

use flight::computer::Computer;
use flight::computer::plane::{Moment, PlanarLaw, PlanarTick, Plane, PlaneError};
use flight::rules::phase::Phase;
use flight::rules::verdict::TouchdownLimits;
use flight::vehicle::profile::Profile;
use protocol::log::record::Record;
use protocol::log::v1;
use sim::outside::{Flown, Outside, Unwatched};
use sim::plane::PlanarFlight;
use sim::plane::draw::Draw;
use sim::plane::plant::{Plant, STEP_S};
use tick_log::{tick_to_log, verdict_to_log};

use super::Law;
use super::start::Start;
use crate::controller::LoggedController;
use crate::settings::Schedule;

/// A vehicle that is not down by then will not come down, s.
const LONGEST_S: f64 = 60.0;

/// One tick, flown again.
#[derive(Debug, Clone, PartialEq)]
pub struct ReflownTick {
    /// Input, output and digest; the measured times are zero.
    pub record: v1::ControllerTick,
}

/// A re-flown flight.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReflownFlight {
    /// The recorded ticks before the start, executed again.
    pub before: Vec<v1::ControllerTick>,
    pub ticks: Vec<ReflownTick>,
    /// The plant, once a frame.
    pub truth: Vec<v1::PlantTruth>,
    /// All records of a flight from apogee, with vehicle times, s.
    pub records: Vec<(f64, Record)>,
    /// Facts that its log has in addition to those of the recorded flight.
    pub run: BTreeMap<String, String>,
    /// The landing verdict; `None` if it did not come down.
    pub verdict: Option<v1::LandingVerdict>,
}

/// The flight at its start. `profile` is for the flight computer, `plant_profile` for the plant.
pub(super) fn at_start(
    profile: &Profile,
    plant_profile: &Profile,
    draw: &Draw,
    controller: &LoggedController,
    start: &Start,
    law: Law,
) -> Result<PlanarFlight, PlaneError> {
    let fins_told_rad = start.fins_commanded_rad.unwrap_or([profile.fins.deployed_rad(); 4]);
    let moment = Moment { controller: controller.state().clone(), input: start.input, fins_told_rad };
    let upright = law == Law::Stabiliser || start.input.degraded;
    let law = if upright { PlanarLaw::Upright } else { PlanarLaw::Nmpc };
    let computer = Computer::at_moment(profile, &moment, law)?;
    let plant = plant_at_start(profile, plant_profile, draw, start, &computer);
    Ok(PlanarFlight::at_moment(computer, plant, *draw, TouchdownLimits::from_profile(profile)))
}

/// The plant stays in its rig until the start, so that its clock and its motor have the recorded state.
fn plant_at_start(
    profile: &Profile,
    plant_profile: &Profile,
    draw: &Draw,
    start: &Start,
    computer: &Computer,
) -> Plant {
    let sample_s = profile.nmpc.sample_time_s;
    let steps = |time_s: f64| ((time_s / sample_s).round() * (sample_s / STEP_S).round()) as u64;
    let lit_at = computer.plane().and_then(Plane::ignited_at_s).map(steps);
    let mut plant = Plant::new(plant_profile, draw);
    plant.command(start.gimbal_rad, start.fins_rad);
    let until = steps(start.input.time_s);
    for step in 0..until {
        if lit_at == Some(step) {
            plant.ignite();
        }
        plant.step();
    }
    if lit_at == Some(until) {
        plant.ignite();
    }
    plant.release(start.plant);
    plant
}

/// Flies to the ground. Timed settings change the controller in flight.
pub(super) fn fly(flight: &mut PlanarFlight, mut schedule: Option<Schedule<Profile>>) -> ReflownFlight {
    let mut flown = ReflownFlight::default();
    let began_s = flight.time_s();
    let deadline_s = flight.deadline_s();
    let kept = |flown: &mut ReflownFlight, frame: Flown| {
        let tick = frame.output.and_then(|output| output.tick);
        flown.ticks.extend(tick.map(|tick| reflown(&tick, deadline_s)));
    };
    reconfigure(flight, schedule.as_mut(), began_s);
    let first = flight.step_with(&Outside::NOBODY, &mut Unwatched);
    kept(&mut flown, first);
    while flight.time_s() - began_s < LONGEST_S {
        let next_s = flight.time_s() + flight.frame_s();
        reconfigure(flight, schedule.as_mut(), next_s);
        let frame = flight.step_with(&Outside::NOBODY, &mut Unwatched);
        flown.truth.push(tick_log::plant_truth(flight));
        // The controller's output in the frame of the touchdown has no effect.
        if flight.computer().mode().phase == Phase::Touchdown {
            let judged = flight.judge();
            flown.verdict =
                judged.map(|(impact, verdict)| verdict_to_log(impact.time_s, &impact.state, &verdict));
            break;
        }
        kept(&mut flown, frame);
    }
    flown
}

fn reconfigure(flight: &mut PlanarFlight, schedule: Option<&mut Schedule<Profile>>, time_s: f64) {
    if let Some(profile) = schedule.and_then(|schedule| schedule.due(time_s)) {
        flight.reconfigure_controller(profile);
    }
}

fn reflown(tick: &PlanarTick, deadline_s: f64) -> ReflownTick {
    let PlanarTick { input, output, state_digest } = tick;
    ReflownTick { record: tick_to_log(input, output, *state_digest, 0.0, deadline_s) }
}
