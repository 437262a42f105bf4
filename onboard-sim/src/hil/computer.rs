//! The flight computer's process: it answers frames until it is stopped.

use flight::guidance::baseline::Law;
use flight::vehicle::mission::Mission;
use hil::computer::{Counts, RemoteComputer};
use hil::start::{Pace, Start};
use protocol::dialect::{HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, MavState, MavType};
use protocol::mission::MissionHash;

use super::assembly::{FrameAssembly, ToComputer};
use super::messages::of_answer;

/// A flight computer at the end of a link, messages in and messages out.
#[derive(Debug, Clone)]
pub struct ComputerEnd {
    mission: Mission,
    hash: MissionHash,
    assembly: FrameAssembly,
    flying: Option<(Start, RemoteComputer)>,
    /// The flight before this one, whose start may still come late.
    flown: Option<u32>,
}

/// What is told to whoever watches the process.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A flight has begun.
    Began { flight_id: u32, pace: Pace },
    /// A flight has ended, because another one begins.
    Ended { flight_id: u32, counts: Counts },
    /// A world with another mission asks.
    OtherMission { theirs: MissionHash, ours: MissionHash },
}

impl ComputerEnd {
    /// A computer that waits for its first flight.
    pub fn new(mission: &Mission, mission_toml: &str) -> Self {
        let hash = MissionHash::of(mission_toml);
        Self { mission: mission.clone(), hash, assembly: FrameAssembly::default(), flying: None, flown: None }
    }

    /// Takes a message. Adds what is to be sent to `out`; returns what is to be told.
    pub fn take(&mut self, message: &MavMessage, out: &mut Vec<MavMessage>) -> Vec<Event> {
        match self.assembly.take(message) {
            None => Vec::new(),
            Some(ToComputer::Start(start, theirs)) => self.start(&start, theirs, out),
            Some(ToComputer::Frame { flight_id, frame, readings }) => {
                if let Some((start, computer)) = &mut self.flying
                    && let Some(answer) = computer.take(flight_id, frame, &readings)
                {
                    out.extend(of_answer(&answer, start.pace));
                }
                Vec::new()
            }
        }
    }

    fn start(&mut self, start: &Start, theirs: MissionHash, out: &mut Vec<MavMessage>) -> Vec<Event> {
        if theirs != self.hash {
            return vec![Event::OtherMission { theirs, ours: self.hash }];
        }
        if let Some((known, computer)) = &mut self.flying
            && known.flight_id == start.flight_id
        {
            if let Some(answer) = computer.start_again(start) {
                out.extend(of_answer(&answer, start.pace));
            }
            return Vec::new();
        }
        if self.flown == Some(start.flight_id) {
            return Vec::new();
        }
        let mut events = Vec::new();
        if let Some((start, computer)) = &self.flying {
            self.flown = Some(start.flight_id);
            events.push(Event::Ended { flight_id: start.flight_id, counts: *computer.counts() });
        }
        let computer = RemoteComputer::new(&self.mission, Law::Nmpc, start);
        out.extend(of_answer(computer.answer(), start.pace));
        self.flying = Some((*start, computer));
        events.push(Event::Began { flight_id: start.flight_id, pace: start.pace });
        events
    }

    /// The heartbeat, which tells a world that listens where its computer is.
    pub fn heartbeat(&self) -> MavMessage {
        let phase = self.flying.as_ref().map_or(0, |(_, computer)| computer.answer().phase.index());
        MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            custom_mode: u32::from(phase),
            mavtype: MavType::MAV_TYPE_ROCKET,
            autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
            base_mode: MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED,
            system_status: match self.flying {
                Some(_) => MavState::MAV_STATE_ACTIVE,
                None => MavState::MAV_STATE_STANDBY,
            },
            mavlink_version: 3,
        })
    }

    /// The number of the present flight, and what became of its frames.
    pub fn counts(&self) -> Option<(u32, &Counts)> {
        self.flying.as_ref().map(|(start, computer)| (start.flight_id, computer.counts()))
    }

    /// Frames of which a part was lost.
    pub fn broken(&self) -> u64 {
        self.assembly.broken()
    }
}
