//! Two signed stations against the real vehicle process over UDP: arming and start take both.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::net::UdpSocket;
use std::path::Path;
use std::time::{Duration, Instant};

use e2e::{PATIENCE, Program, Running, Signal, keygen, program, signing_clock};
use protocol::command::CommandAnswer;
use protocol::dialect::{
    COMMAND_LONG_DATA, HEARTBEAT_DATA, MavCmd, MavMessage, MavResult, TD_FLIGHT_STATUS_DATA, TdHold, TdPhase,
};
use protocol::frame::{Encoder, Frame};
use protocol::hub::{Hub, News, Received};
use protocol::identity::{Address, VEHICLE};
use protocol::signing::{Key, Memory, Signing};

const CREW: &str = r#"
mode = "two-person"
[[operator]]
name = "Ann"
role = "range-safety"
link = 1
key = "ann.key"
[[operator]]
name = "Bob"
role = "flight"
link = 2
key = "bob.key"
"#;

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const START: MavCmd = MavCmd::MAV_CMD_MISSION_START;

/// An operator's station on one UDP socket.
struct Station {
    socket: UdpSocket,
    hub: Hub,
    encoder: Encoder,
    us: Address,
    beats_at: Option<Instant>,
    began: Instant,
}

impl Station {
    fn new(folder: &Path, vehicle: &str, (number, key): (u8, &str)) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(vehicle.trim_start_matches("udpout:")).unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
        let read =
            |name| Key::from_hex(std::fs::read_to_string(folder.join(name)).unwrap().trim_end()).unwrap();
        let (shared, own) = (read("flight.key"), read(key));
        let signing = Signing::new(shared, Memory::default()).as_operator(number, own);
        let us = Address { system_id: 256_u16.wrapping_sub(u16::from(number)) as u8, component_id: 190 };
        let hub = Hub::new(1, Some(signing));
        Self { socket, hub, encoder: Encoder::new(us), us, beats_at: None, began: Self::now() }
    }

    fn send(&mut self, message: &MavMessage) {
        let frame = self.encoder.encode(message);
        let bytes = self.hub.bytes_for(0, &frame, signing_clock());
        // Before the vehicle listens, the system may refuse.
        let _ = self.socket.send(&bytes);
    }

    fn command(&mut self, command: MavCmd, confirms: f32) {
        self.send(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            command,
            param1: 1.0,
            param3: confirms,
            target_system: VEHICLE.system_id,
            target_component: VEHICLE.component_id,
            ..COMMAND_LONG_DATA::default()
        }));
    }

    /// A heartbeat if one is due, and every frame that has arrived.
    fn heard(&mut self) -> Vec<Frame> {
        let due = self.beats_at.is_none_or(|at| at.elapsed() >= Duration::from_millis(100));
        if due {
            self.beats_at = Some(Self::now());
            self.send(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        }
        let mut datagram = [0; 2048];
        let Ok(count) = self.socket.recv(&mut datagram) else { return Vec::new() };
        let from = ([127, 0, 0, 1], 1).into();
        let received = Received::Datagram { from, bytes: datagram[..count].to_vec() };
        let news = self.hub.take(0, received, self.began.elapsed(), signing_clock());
        let frames = news.into_iter().filter_map(|news| match news {
            News::Frame(frame) => Some(frame),
            _ => None,
        });
        frames.collect()
    }

    #[expect(clippy::disallowed_methods, reason = "a real process is waited for")]
    fn now() -> Instant {
        Instant::now()
    }
}

/// Both stations speak until one of them hears what is wanted.
fn wait_for<T>(
    stations: &mut [Station; 2],
    what: &str,
    mut wanted: impl FnMut(usize, Address, &Frame) -> Option<T>,
) -> T {
    let began = Station::now();
    while began.elapsed() < PATIENCE {
        for (place, station) in stations.iter_mut().enumerate() {
            for frame in station.heard() {
                if let Some(found) = wanted(place, station.us, &frame) {
                    return found;
                }
            }
        }
    }
    panic!("no {what} within the time limit");
}

fn answer(stations: &mut [Station; 2], of: usize, command: MavCmd) -> CommandAnswer {
    wait_for(stations, "answer", |place, us, frame| {
        let answer = CommandAnswer::from_frame(frame)?;
        (place == of && answer.command == command as u16 && answer.target == us).then_some(answer)
    })
}

fn status(stations: &mut [Station; 2], what: &str, wanted: impl Fn(&TD_FLIGHT_STATUS_DATA) -> bool) {
    wait_for(stations, what, |_, _, frame| match frame.decode() {
        Ok(MavMessage::TD_FLIGHT_STATUS(status)) if wanted(&status) => Some(()),
        _ => None,
    });
}

const ANN: usize = 0;
const BOB: usize = 1;

#[test]
fn two_signed_stations_arm_and_start_together_and_one_aborts() {
    let folder = tempfile::tempdir().unwrap();
    for key in ["flight.key", "ann.key", "bob.key"] {
        assert_eq!(keygen(folder.path(), key).code, Some(0));
    }
    std::fs::write(folder.path().join("crew.toml"), CREW).unwrap();
    let mut command = program(Program::OnboardSim);
    command
        .args([
            "fly",
            "--mavlink",
            "udpin:127.0.0.1:0",
            "--key",
            "flight.key",
            "--crew",
            "crew.toml",
            "--stay",
        ])
        .args(["--boot-number", "7"])
        .current_dir(folder.path());
    let mut flight = Running::start(&mut command);
    let link = flight.udp_link();
    let mut stations =
        [(1, "ann.key"), (2, "bob.key")].map(|operator| Station::new(folder.path(), &link, operator));
    status(&mut stations, "a vehicle that is ready", |status| {
        status.phase == TdPhase::TD_PHASE_PAD_IDLE && status.checks_failed.is_empty()
    });
    for command in [ARM, START] {
        stations[BOB].command(command, 0.0);
        let asked = answer(&mut stations, BOB, command);
        assert_eq!(asked.result, MavResult::MAV_RESULT_TEMPORARILY_REJECTED as u8);
        assert!(asked.detail > 0, "the number of the ask");
        // Bob cannot confirm what he asks himself.
        stations[BOB].command(command, asked.detail as f32);
        let own = answer(&mut stations, BOB, command);
        assert_eq!(own.result, MavResult::MAV_RESULT_DENIED as u8);
        stations[ANN].command(command, asked.detail as f32);
        assert_eq!(answer(&mut stations, ANN, command).result, MavResult::MAV_RESULT_ACCEPTED as u8);
    }
    // Nobody taps.
    status(&mut stations, "a hold", |status| status.hold == TdHold::TD_HOLD_TAP_OVERDUE);
    stations[BOB].command(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 0.0);
    let aborted = answer(&mut stations, BOB, MavCmd::MAV_CMD_DO_FLIGHTTERMINATION);
    assert_eq!(aborted.result, MavResult::MAV_RESULT_ACCEPTED as u8);
    flight.signal(Signal::SIGTERM);
    let flight = flight.wait();
    for words in [
        "FLIGHT Bob asks to arm: RANGE SAFETY or PAD must confirm within 10 s",
        "arm: asked by FLIGHT Bob, confirmed by RANGE SAFETY Ann",
        "start: asked by FLIGHT Bob, confirmed by RANGE SAFETY Ann",
        "no tap of RANGE SAFETY Ann for 2 s",
        "FLIGHT Bob aborts",
    ] {
        assert!(flight.output.contains(words), "{words}: {}", flight.output);
    }
}
