//! A ground station that a test controls. It sends requests that the real ground station would
//! never send.

use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use protocol::command::CommandAnswer;
use protocol::dialect::{
    COMMAND_LONG_DATA, HEARTBEAT_DATA, MavAutopilot, MavCmd, MavMessage, MavType, TD_FLIGHT_STATUS_DATA,
    TdPhase,
};
use protocol::frame::{Encoder, Frame, Framer};
use protocol::identity::{GROUND, VEHICLE};
use protocol::text::printable;

use crate::time::{left, now};
use crate::{PATIENCE, UdpProxy};

/// It sends heartbeats at this interval while it waits, as a ground station does while a vehicle is
/// armed.
const HEARTBEAT_INTERVAL: Duration = Duration::from_millis(100);

/// The command that arms with param1 = 1 and disarms with 0.
pub const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
/// The command that starts the countdown.
pub const START: MavCmd = MavCmd::MAV_CMD_MISSION_START;
/// The command that aborts with param1 = 1.
pub const ABORT: MavCmd = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
/// MAV_RESULT_ACCEPTED as a number.
pub const ACCEPTED: u8 = 0;

/// A ground station on one UDP socket.
pub struct BareGround {
    socket: UdpSocket,
    vehicle: Option<SocketAddr>,
    framer: Framer,
    encoder: Encoder,
    beats_at: Instant,
    /// Sent in its heartbeats; 0 for none, as other people's ground stations have.
    pub session: u32,
    /// The texts that the vehicle has sent.
    pub texts: Vec<String>,
}

impl Default for BareGround {
    fn default() -> Self {
        Self::new()
    }
}

impl BareGround {
    /// Binds a loopback port, which it keeps.
    pub fn new() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        Self {
            socket,
            vehicle: None,
            framer: Framer::new(),
            encoder: Encoder::new(GROUND),
            beats_at: now(),
            session: 0,
            texts: Vec::new(),
        }
    }

    /// A ground station that sends to the proxy first.
    pub fn through(proxy: &UdpProxy) -> Self {
        Self { vehicle: Some(proxy.ground_address()), ..Self::new() }
    }

    /// The vehicle's link, for `--mavlink`.
    pub fn link(&self) -> String {
        format!("udpout:{}", self.socket.local_addr().expect("bound"))
    }

    /// Waits until `wanted` returns something for a frame.
    pub fn wait_for<T>(
        &mut self,
        what: &str,
        mut wanted: impl FnMut(&Frame, Option<&MavMessage>) -> Option<T>,
    ) -> T {
        let deadline = now() + PATIENCE;
        let mut datagram = [0; 2048];
        loop {
            while let Some(frame) = self.framer.next_frame() {
                let message = frame.decode().ok();
                if let Some(MavMessage::STATUSTEXT(text)) = &message {
                    self.texts.push(printable(text.text.as_slice()).replace('\u{fffd}', ""));
                }
                if let Some(found) = wanted(&frame, message.as_ref()) {
                    return found;
                }
            }
            let wait = left(deadline);
            assert!(!wait.is_zero(), "no {what} within the time limit; received: {:?}", self.texts);
            self.beat_if_due();
            // A time limit of zero would mean no limit.
            let wait = wait.min(left(self.beats_at)).max(Duration::from_millis(1));
            self.socket.set_read_timeout(Some(wait)).expect("a time limit");
            if let Ok((count, from)) = self.socket.recv_from(&mut datagram) {
                self.vehicle = Some(from);
                self.framer.push(&datagram[..count]);
            }
        }
    }

    /// Sends a heartbeat if it is due and the vehicle's address is known.
    fn beat_if_due(&mut self) {
        if !left(self.beats_at).is_zero() {
            return;
        }
        self.beats_at = now() + HEARTBEAT_INTERVAL;
        let Some(vehicle) = self.vehicle else { return };
        let frame = heartbeat_frame(&mut self.encoder, self.session);
        // If the vehicle has ended, the wait for it fails and reports that.
        let _ = self.socket.send_to(frame.as_bytes(), vehicle);
    }

    /// Waits until the vehicle reports this phase.
    pub fn wait_for_phase(&mut self, phase: TdPhase) -> TD_FLIGHT_STATUS_DATA {
        self.wait_for_status(&format!("{phase:?}"), |status| status.phase == phase)
    }

    /// Waits until the vehicle is idle on its pad and all its arming checks pass.
    pub fn wait_until_ready(&mut self) {
        self.wait_for_status("every check passed", |status| {
            status.phase == TdPhase::TD_PHASE_PAD_IDLE && status.checks_failed.is_empty()
        });
    }

    /// Waits until a flight status of the vehicle is as wanted.
    pub fn wait_for_status(
        &mut self,
        what: &str,
        wanted: impl Fn(&TD_FLIGHT_STATUS_DATA) -> bool,
    ) -> TD_FLIGHT_STATUS_DATA {
        self.wait_for(what, |_, message| match message {
            Some(MavMessage::TD_FLIGHT_STATUS(status)) if wanted(status) => Some(status.clone()),
            _ => None,
        })
    }

    /// Waits for a heartbeat of the vehicle.
    pub fn wait_for_heartbeat(&mut self) -> HEARTBEAT_DATA {
        self.wait_for("a heartbeat", |frame, message| match message {
            Some(MavMessage::HEARTBEAT(beat)) if frame.source() == VEHICLE => Some(beat.clone()),
            _ => None,
        })
    }

    /// Sends a command, waits for the answer, and returns its MAV_RESULT.
    pub fn command(&mut self, command: MavCmd, param1: f32) -> u8 {
        self.send_command(command, param1);
        self.wait_for(&format!("an answer to {command:?}"), |frame, _| {
            CommandAnswer::from_frame(frame).filter(|answer| answer.command == command as u16)
        })
        .result
    }

    pub fn send_command(&mut self, command: MavCmd, param1: f32) {
        let frame = command_frame(&mut self.encoder, command, param1);
        self.send(&frame);
    }

    /// A ground station that sends to the vehicle at this address before it has received it.
    pub fn to(vehicle: SocketAddr) -> Self {
        Self { vehicle: Some(vehicle), ..Self::new() }
    }

    /// Sends this command, and waits for the answer as [`BareGround::command`] does.
    pub fn command_with(&mut self, command: COMMAND_LONG_DATA) -> u8 {
        let number = command.command as u16;
        let frame = self.encoder.encode(&MavMessage::COMMAND_LONG(command));
        self.send(&frame);
        self.wait_for("an answer", |frame, _| {
            CommandAnswer::from_frame(frame).filter(|answer| answer.command == number)
        })
        .result
    }

    fn send(&mut self, frame: &Frame) {
        let vehicle = self.vehicle.expect("a received vehicle");
        self.socket.send_to(frame.as_bytes(), vehicle).expect("sent");
    }
}

/// The heartbeat of a ground station; session 0 for none.
pub fn heartbeat_frame(encoder: &mut Encoder, session: u32) -> Frame {
    encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        custom_mode: session,
        mavtype: MavType::MAV_TYPE_GCS,
        autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
        mavlink_version: 3,
        ..HEARTBEAT_DATA::default()
    }))
}

/// A COMMAND_LONG to the vehicle.
pub fn command_frame(encoder: &mut Encoder, command: MavCmd, param1: f32) -> Frame {
    encoder.encode(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        command,
        param1,
        target_system: VEHICLE.system_id,
        target_component: VEHICLE.component_id,
        ..COMMAND_LONG_DATA::default()
    }))
}
