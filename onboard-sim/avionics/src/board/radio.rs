//! The crew on a board's radio: MAVLink in and out, between the frames of the flight computer.

use alloc::vec::Vec;

use crate::link::endpoint::{UplinkState, VehicleEndpoint};
use crate::link::vehicle::{BatteryFacts, MissionName, VehicleKind, VehicleState};
use crate::log::frame::LoggedInput;
use crate::log::logged::Logged;
use flight::computer::findings::Findings;
use flight::computer::messages::CrewMessage;
use flight::computer::{Computer, Input, Output, SensedInput};
use flight::rules::outputs::PyroOutput;
use flight::vehicle::mission::Mission;
use protocol::frame::Framer;

use crate::board::stream::{self, OnTheAir};

/// The line to a radio: a UART, a serial device.
pub trait Radio {
    /// Reads received bytes and returns their number; 0 if none. It does not wait.
    fn read(&mut self, into: &mut [u8]) -> usize;

    /// Sends, without waiting: bytes without room are lost, as in the air.
    fn write(&mut self, bytes: &[u8]);
}

/// No radio.
impl Radio for () {
    fn read(&mut self, _: &mut [u8]) -> usize {
        0
    }

    fn write(&mut self, _: &[u8]) {}
}

/// Frames without a byte after which a frame that has begun will not go on: 0.1 s. The longest
/// frame takes half of that at 57,600 baud.
const SILENT_FRAMES: u32 = 20;

/// A board's end of the link.
pub(crate) struct Crewed {
    endpoint: VehicleEndpoint,
    framer: Framer,
    silent_frames: u32,
    name: MissionName,
    findings: Findings,
    parachute_ejected: bool,
    /// For the next frame.
    uplink_state: UplinkState,
}

impl Crewed {
    /// The vehicle at power-up, a rocket in space. `mission` is the mission as flown, and `toml`
    /// its text.
    pub(crate) fn new(kind: VehicleKind, on_the_air: &OnTheAir, mission: &Mission, toml: &str) -> Self {
        let system_id = u8::try_from(on_the_air.system_id).unwrap_or(u8::MAX);
        let endpoint = VehicleEndpoint::new(kind)
            .booted(on_the_air.boot_number)
            .with_uid(u16::try_from(on_the_air.uid).unwrap_or(0))
            .over_links(&[on_the_air.budget_bytes_s])
            .of_system(system_id);
        let name = MissionName::of(&on_the_air.mission, toml, mission);
        Self {
            uplink_state: endpoint.uplink_state(0.0),
            endpoint,
            framer: Framer::new(),
            silent_frames: 0,
            name,
            findings: Findings::default(),
            parachute_ejected: false,
        }
    }

    /// A frame's input with the uplink state and the crew's requests.
    pub(crate) fn with_uplink(&self, input: LoggedInput) -> LoggedInput {
        let UplinkState { uplink, commander, requests } = self.uplink_state.clone();
        LoggedInput { sensed: SensedInput { uplink, commander, ..input.sensed }, requests, ..input }
    }

    /// Communicates with the ground after a frame; returns the radio input of the next one. Never
    /// inline: its stack frame would lie below the flight computer's, which is the largest.
    #[inline(never)]
    pub(crate) fn flown(
        &mut self,
        input: &Input<'_>,
        output: &Output,
        computer: &Computer,
        radio: &mut impl Radio,
    ) -> stream::RadioInput {
        self.findings.note(computer);
        self.parachute_ejected |= output.commands.outputs.is_on(PyroOutput::Parachute);
        let flown = VehicleState {
            computer,
            time_s: input.time_s,
            name: &self.name,
            operators: &[],
            findings: &self.findings,
            battery: input.battery_v.map(|volts| BatteryFacts {
                volts,
                servo_volts: input.servo_battery_v,
                current_a: None,
                left: None,
            }),
            rehearsed: None,
            parachute_ejected: self.parachute_ejected,
            judged: None,
        };
        self.endpoint.on_answers(&output.answers, &flown);
        for message in &output.messages {
            match message {
                CrewMessage::Text { severity, text } => self.endpoint.send_text(*severity, text),
                // Seen by the endpoint itself.
                CrewMessage::PhaseChanged { .. } => {}
            }
        }
        let mut buffer = [0; 512];
        let count = radio.read(&mut buffer);
        if count > 0 {
            self.framer.push(&buffer[..count]);
            self.silent_frames = 0;
        } else {
            self.silent_frames = self.silent_frames.saturating_add(1);
            if self.silent_frames == SILENT_FRAMES {
                self.framer.on_silence();
            }
        }
        while let Some(frame) = self.framer.next_frame() {
            self.endpoint.on_frame(0, &frame, &flown);
        }
        let leaving = self.endpoint.poll(&flown);
        let bytes: Vec<u8> = leaving.iter().flat_map(|outgoing| outgoing.frame.as_bytes()).copied().collect();
        if !bytes.is_empty() {
            radio.write(&bytes);
        }
        self.uplink_state = self.endpoint.uplink_state(input.time_s);
        stream::RadioInput {
            uplink: self.uplink_state.uplink.to_log(),
            commander: self.uplink_state.commander.to_log(),
            requests: self.uplink_state.requests.to_log(),
        }
    }
}
