//! A ground station of sockets and frames alone, to ask the vehicle what the real one would never ask.

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

use crate::process::{left, now};
use crate::{Air, PATIENCE};

/// How often it says that it is there while it waits: as a ground station does while a vehicle is armed.
const BEATS_EVERY: Duration = Duration::from_millis(100);

/// A bound UDP port that a vehicle speaks to.
pub struct BareGround {
    socket: UdpSocket,
    vehicle: Option<SocketAddr>,
    framer: Framer,
    encoder: Encoder,
    beats_at: Instant,
    /// Everything the vehicle has said in words.
    pub texts: Vec<String>,
}

impl Default for BareGround {
    fn default() -> Self {
        Self::new()
    }
}

impl BareGround {
    /// Binds a free loopback port.
    ///
    /// # Panics
    /// There is none.
    pub fn new() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        Self {
            socket,
            vehicle: None,
            framer: Framer::new(),
            encoder: Encoder::new(GROUND),
            beats_at: now(),
            texts: Vec::new(),
        }
    }

    /// One that speaks through the air, first.
    ///
    /// # Panics
    /// There is no free port.
    pub fn through(air: &Air) -> Self {
        Self { vehicle: Some(air.ground_address()), ..Self::new() }
    }

    /// What the vehicle is to be given for `--mavlink`.
    ///
    /// # Panics
    /// The socket has no address.
    pub fn link(&self) -> String {
        format!("udpout:{}", self.socket.local_addr().expect("bound"))
    }

    /// Waits until `wanted` says something of a frame.
    ///
    /// # Panics
    /// It never does.
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
            assert!(!wait.is_zero(), "waited in vain for {what}; heard: {:?}", self.texts);
            self.beat_if_due();
            // A time limit of nought would be none.
            let wait = wait.min(left(self.beats_at)).max(Duration::from_millis(1));
            self.socket.set_read_timeout(Some(wait)).expect("a time limit");
            if let Ok((count, from)) = self.socket.recv_from(&mut datagram) {
                self.vehicle = Some(from);
                self.framer.push(&datagram[..count]);
            }
        }
    }

    /// Its heartbeat, once the vehicle has been heard.
    fn beat_if_due(&mut self) {
        if !left(self.beats_at).is_zero() {
            return;
        }
        self.beats_at = now() + BEATS_EVERY;
        let Some(vehicle) = self.vehicle else { return };
        let frame = heartbeat_frame(&mut self.encoder);
        // A vehicle that has ended is waited for in vain, which is what is then said.
        let _ = self.socket.send_to(frame.as_bytes(), vehicle);
    }

    /// Waits until the vehicle reports this phase.
    pub fn wait_for_phase(&mut self, phase: TdPhase) -> TD_FLIGHT_STATUS_DATA {
        self.wait_for(&format!("{phase:?}"), |_, message| match message {
            Some(MavMessage::TD_FLIGHT_STATUS(status)) if status.phase == phase => Some(status.clone()),
            _ => None,
        })
    }

    /// Waits for a heartbeat.
    pub fn wait_for_heartbeat(&mut self) -> HEARTBEAT_DATA {
        self.wait_for("a heartbeat", |frame, message| match message {
            Some(MavMessage::HEARTBEAT(beat)) if frame.source() == VEHICLE => Some(beat.clone()),
            _ => None,
        })
    }

    /// Sends a command and waits for its answer; returns the MAV_RESULT.
    pub fn command(&mut self, command: MavCmd, param1: f32) -> u8 {
        self.send_command(command, param1);
        self.wait_for(&format!("an answer to {command:?}"), |frame, _| {
            CommandAnswer::from_frame(frame).filter(|answer| answer.command == command as u16)
        })
        .result
    }

    /// Sends a command.
    ///
    /// # Panics
    /// The vehicle has not been heard yet.
    pub fn send_command(&mut self, command: MavCmd, param1: f32) {
        let frame = command_frame(&mut self.encoder, command, param1);
        let vehicle = self.vehicle.expect("a vehicle that has been heard");
        self.socket.send_to(frame.as_bytes(), vehicle).expect("sent");
    }
}

/// The heartbeat of a ground station.
pub fn heartbeat_frame(encoder: &mut Encoder) -> Frame {
    encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        mavtype: MavType::MAV_TYPE_GCS,
        autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
        mavlink_version: 3,
        ..HEARTBEAT_DATA::default()
    }))
}

/// COMMAND_LONG to the vehicle.
pub fn command_frame(encoder: &mut Encoder, command: MavCmd, param1: f32) -> Frame {
    encoder.encode(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        command,
        param1,
        target_system: VEHICLE.system_id,
        target_component: VEHICLE.component_id,
        ..COMMAND_LONG_DATA::default()
    }))
}
