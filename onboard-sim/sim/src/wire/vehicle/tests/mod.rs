//! The vehicles as their crew meets them: arming, countdown, landing, and an abort in every phase
//! they pass.

mod check;
mod countdown;
mod pad;
mod space;

use std::ops::{Deref, DerefMut};

use flight::computer::FRAME_S;
use flight::computer::crew::{Answer, CrewCommand, Request};
use flight::rules::phase::Phase;

use super::*;
use avionics::link::telemetry;
use avionics::link::vehicle::{Identity, VehicleKind};
use mavlink::MessageData as _;
use protocol::dialect::{MavMessage, TD_DESCENT_DATA, TdBooster};

/// Descent data sent to the crew.
fn descent(vehicle: &Vehicle) -> TD_DESCENT_DATA {
    let identity = Identity { kind: VehicleKind::Simulated, boot_number: 1, uid: 0 };
    match telemetry::message(TD_DESCENT_DATA::ID, &vehicle.state(), identity) {
        Some(MavMessage::TD_DESCENT(descent)) => descent,
        other => panic!("{other:?} instead of the descent"),
    }
}

/// A vehicle, with its events that no test has read yet.
pub(crate) struct Rocket {
    vehicle: Vehicle,
    unread: Vec<VehicleEvent>,
}

impl Deref for Rocket {
    type Target = Vehicle;

    fn deref(&self) -> &Vehicle {
        &self.vehicle
    }
}

impl DerefMut for Rocket {
    fn deref_mut(&mut self) -> &mut Vehicle {
        &mut self.vehicle
    }
}

impl Rocket {
    fn descent(&self) -> TD_DESCENT_DATA {
        descent(self)
    }

    /// A vehicle whose pin is out and whose log runs.
    pub(crate) fn of(mut vehicle: Vehicle) -> Self {
        vehicle.set_log_state(LogState { running: true, space_bytes: u64::MAX });
        vehicle.set_pin_out(true);
        Self { vehicle, unread: Vec::new() }
    }

    /// A frame with a request of the vehicle's programme.
    pub(crate) fn request(&mut self, command: CrewCommand) -> Answer {
        let VehicleStep { events, mut answers } = self.vehicle.step(&[Request::of_the_programme(command)]);
        self.unread.extend(events);
        answers.remove(0)
    }

    fn advance(&mut self) -> Vec<VehicleEvent> {
        let mut events = std::mem::take(&mut self.unread);
        events.extend(self.vehicle.step(&[]).events);
        events
    }

    fn run_until(&mut self, mut done: impl FnMut(&Vehicle) -> bool) -> Vec<VehicleEvent> {
        let mut events = Vec::new();
        for _ in 0..30_000 {
            if done(&self.vehicle) {
                return events;
            }
            events.extend(self.advance());
        }
        panic!("still {:?} at {} s", self.phase(), self.time_s());
    }

    /// Armed and started as far as it takes.
    fn run_to(mut self, phase: Phase) -> Self {
        self.run_until(|vehicle| vehicle.state().checks_failed() == 0 && vehicle.phase() == Phase::PadIdle);
        if phase == Phase::PadIdle {
            return self;
        }
        assert_eq!(self.request(CrewCommand::Arm), Answer { ending: Ending::Accepted, reason: None });
        if phase == Phase::PadArmed {
            return self;
        }
        assert_eq!(self.request(CrewCommand::Start).ending, Ending::Accepted);
        self.run_until(|vehicle| vehicle.phase() == phase);
        self
    }
}

use flight::computer::crew::Ending;

fn phases(events: &[VehicleEvent]) -> Vec<Phase> {
    let to = |event: &VehicleEvent| match event {
        VehicleEvent::Message(CrewMessage::PhaseChanged { to, .. }) => Some(*to),
        _ => None,
    };
    events.iter().filter_map(to).collect()
}

fn has_text(events: &[VehicleEvent], words: &str) -> bool {
    events.iter().any(|event| matches!(event, VehicleEvent::Message(CrewMessage::Text { text, .. }) if text.contains(words)))
}
