//! Measures what the ground station costs on a real terminal, and how long an abort takes from the
//! key to the wire.
//!
//! `cargo bench -p e2e --bench terminal`. The programs and the terminal are real: a pseudo-terminal
//! of 80 by 24 cells, whose other end types keys and counts the bytes written to it. For the abort,
//! a vehicle made of one socket reports a landing at the usual rates, so that the screen is drawn
//! ten times a second. Each time runs from the write of the chord's last key to the arrival of the
//! datagram with the command.

use std::io::Write as _;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use e2e::{BareGround, Bound, Program, Running, Terminal, now, program};
use protocol::command::{CommandAnswer, CommandRequest};
use protocol::dialect::{
    ATTITUDE_QUATERNION_DATA, HEARTBEAT_DATA, LOCAL_POSITION_NED_DATA, MavAutopilot, MavCmd, MavMessage,
    MavModeFlag, MavResult, MavType, TD_FLIGHT_STATUS_DATA, TdPhase,
};
use protocol::frame::{Encoder, Framer};
use protocol::identity::VEHICLE;

type Failure = Box<dyn std::error::Error + Send + Sync>;

const SIZE: (u16, u16) = (80, 24);
const TRIALS: u32 = 200;
/// How long the cost on the pad is measured.
const IDLE: Duration = Duration::from_secs(30);
const FLIGHTS: u32 = 3;
/// An abort that takes longer was not sent.
const GIVEN_UP_AFTER: Duration = Duration::from_secs(5);

/// A way to type the chord that aborts.
struct Hand {
    name: &'static str,
    reports_repeats: bool,
    keys: [&'static [u8]; 2],
    /// The least time between the two keys.
    pause: Duration,
}

const HANDS: [Hand; 4] = [
    Hand {
        name: "any terminal, Ctrl-X Enter",
        reports_repeats: false,
        keys: [b"\x18", b"\r"],
        pause: Duration::from_millis(40),
    },
    Hand {
        name: "any terminal, Ctrl-X twice",
        reports_repeats: false,
        keys: [b"\x18", b"\x18"],
        pause: Duration::from_millis(150),
    },
    // Ctrl-X as kitty's protocol encodes it; Enter is unchanged.
    Hand {
        name: "repeats reported, Ctrl-X Enter",
        reports_repeats: true,
        keys: [b"\x1b[120;5u", b"\r"],
        pause: Duration::from_millis(40),
    },
    Hand {
        name: "repeats reported, Ctrl-X twice",
        reports_repeats: true,
        keys: [b"\x1b[120;5u", b"\x1b[120;5u"],
        pause: Duration::from_millis(150),
    },
];

fn ground(folder: &tempfile::TempDir, reports_repeats: bool) -> Terminal {
    let mut command = program(Program::Ground);
    command
        .args(["--connect", "udpin:127.0.0.1:0", "--log", "ground.mcap"])
        .env("XDG_RUNTIME_DIR", folder.path())
        .current_dir(folder.path());
    Terminal::start(&command, SIZE, reports_repeats)
}

/// Sends what a landing vehicle sends, until `stop` is set.
fn send_telemetry(socket: &UdpSocket, ground: SocketAddr, stop: &AtomicBool) {
    let mut encoder = Encoder::new(VEHICLE);
    for count in 0_u32.. {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        let time_boot_ms = count * 40;
        let mut messages = vec![
            MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
                time_boot_ms,
                q1: 0.7,
                q3: 0.7 + (count % 50) as f32 * 1e-3,
                ..ATTITUDE_QUATERNION_DATA::default()
            }),
            MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA {
                time_boot_ms,
                z: -15.0 + (count % 100) as f32 * 0.1,
                ..LOCAL_POSITION_NED_DATA::default()
            }),
        ];
        if count % 3 == 0 {
            messages.push(MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
                time_boot_ms,
                phase: TdPhase::TD_PHASE_POWERED,
                ..TD_FLIGHT_STATUS_DATA::default()
            }));
        }
        if count % 25 == 0 {
            let custom_mode = TdPhase::TD_PHASE_POWERED as u32;
            messages.push(MavMessage::HEARTBEAT(HEARTBEAT_DATA {
                custom_mode,
                mavtype: MavType::MAV_TYPE_ROCKET,
                autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
                ..HEARTBEAT_DATA::default()
            }));
        }
        for message in messages {
            // A ground that does not listen yet receives the next message.
            let _ = socket.send_to(encoder.encode(&message).as_bytes(), ground);
        }
        std::thread::sleep(Duration::from_millis(40));
    }
}

/// Waits for an abort of the ground; `None` if it does not come in time.
fn wait_for_abort(socket: &UdpSocket) -> Result<Option<Instant>, Failure> {
    let mut datagram = [0; 2048];
    let deadline = now() + GIVEN_UP_AFTER;
    loop {
        let left = deadline.saturating_duration_since(now());
        if left.is_zero() {
            return Ok(None);
        }
        socket.set_read_timeout(Some(left))?;
        let Ok((count, from)) = socket.recv_from(&mut datagram) else { continue };
        let heard_at = now();
        let mut framer = Framer::new();
        framer.push_datagram(&datagram[..count]);
        while let Some(frame) = framer.next_frame() {
            let Some(request) = CommandRequest::from_frame(&frame) else { continue };
            if request.command == MavCmd::MAV_CMD_DO_FLIGHTTERMINATION as u16 {
                let answer = CommandAnswer::to(&request, MavResult::MAV_RESULT_ACCEPTED);
                // Its sequence numbers are not counted.
                if let Some(frame) = answer.encode(&mut Encoder::new(VEHICLE)) {
                    socket.send_to(frame.as_bytes(), from)?;
                }
                return Ok(Some(heard_at));
            }
        }
    }
}

/// The latency of each abort that was sent. On a busy machine two Ctrl-X may arrive as if the key
/// was held, and then no abort is sent.
fn abort_latency(hand: &Hand) -> Result<Vec<Duration>, Failure> {
    let folder = tempfile::tempdir()?;
    let mut terminal = ground(&folder, hand.reports_repeats);
    let port = terminal.bound_port(Bound::Udp);
    let socket = UdpSocket::bind("127.0.0.1:0")?;
    let stop = Arc::new(AtomicBool::new(false));
    let sender = {
        let (socket, stop) = (socket.try_clone()?, Arc::clone(&stop));
        let to = SocketAddr::from(([127, 0, 0, 1], port));
        std::thread::Builder::new()
            .name("vehicle".to_owned())
            .spawn(move || send_telemetry(&socket, to, &stop))?
    };
    // The ground receives the vehicle and draws it for a while.
    std::thread::sleep(Duration::from_secs(3));
    let mut latencies = Vec::new();
    for trial in 0..TRIALS {
        // The pauses spread the keys over the periods of screen and clock.
        std::thread::sleep(Duration::from_millis(u64::from(trial * 37 % 100)));
        terminal.type_bytes(hand.keys[0]);
        std::thread::sleep(hand.pause + Duration::from_millis(u64::from(trial * 13 % 20)));
        let typed_at = now();
        terminal.type_bytes(hand.keys[1]);
        let heard_at = wait_for_abort(&socket)?;
        latencies.extend(heard_at.map(|at| at.saturating_duration_since(typed_at)));
        // The answer arrives before the next chord begins.
        std::thread::sleep(Duration::from_millis(100));
    }
    stop.store(true, Ordering::Relaxed);
    sender.join().map_err(|_panic| "the vehicle's thread has panicked")?;
    Ok(latencies)
}

/// What a program used and wrote in a time.
#[derive(Default)]
struct Cost {
    time: Duration,
    processor: Duration,
    bytes: u64,
}

impl Cost {
    fn add(&mut self, terminal: &Terminal, (since, processor, bytes): (Instant, Duration, u64)) {
        self.time += now().saturating_duration_since(since);
        self.processor += terminal.processor_time().saturating_sub(processor);
        self.bytes += terminal.written() - bytes;
    }

    fn print(&self, name: &str) -> std::io::Result<()> {
        let seconds = self.time.as_secs_f64();
        writeln!(
            std::io::stdout(),
            "{name:<28} {seconds:5.1} s: processor {:.2} %, terminal {:.0} B/s",
            self.processor.as_secs_f64() / seconds * 100.0,
            self.bytes as f64 / seconds
        )
    }
}

fn cost_so_far(terminal: &Terminal) -> (Instant, Duration, u64) {
    (now(), terminal.processor_time(), terminal.written())
}

/// Flies a real flight, armed and started by typed keys, and adds up what the screen cost on the
/// pad and during the landing.
fn fly(idle: &mut Cost, landing: &mut Cost, watched: Duration) -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let mut watch = BareGround::new();
    let mut terminal = ground(&folder, false);
    let port = terminal.bound_port(Bound::Udp);
    let mut vehicle = program(Program::OnboardSim);
    vehicle.args(["fly", "--stay", "--mavlink", &format!("udpout:127.0.0.1:{port}")]);
    let _vehicle = Running::start(vehicle.args(["--mavlink", &watch.link()]).current_dir(folder.path()));
    watch.wait_until_ready();
    std::thread::sleep(Duration::from_secs(2));
    let before = cost_so_far(&terminal);
    std::thread::sleep(watched);
    idle.add(&terminal, before);
    terminal.type_by_hand(b"AARM\r");
    // The ground offers the start once a heartbeat says armed; it receives that heartbeat when we
    // do.
    watch.wait_for("an armed heartbeat", |_, message| match message {
        Some(MavMessage::HEARTBEAT(beat)) => {
            beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED).then_some(())
        }
        _ => None,
    });
    std::thread::sleep(Duration::from_millis(500));
    terminal.type_bytes(b"S");
    std::thread::sleep(Duration::from_millis(200));
    terminal.type_bytes(b"\r");
    watch.wait_for_phase(TdPhase::TD_PHASE_POWERED);
    let before = cost_so_far(&terminal);
    watch.wait_for_phase(TdPhase::TD_PHASE_TOUCHDOWN);
    landing.add(&terminal, before);
    Ok(())
}

fn main() -> Result<(), Failure> {
    let (mut idle, mut landing) = (Cost::default(), Cost::default());
    for _ in 0..FLIGHTS {
        fly(&mut idle, &mut landing, IDLE / FLIGHTS)?;
    }
    idle.print("on the pad")?;
    landing.print("landing")?;
    for hand in HANDS {
        let mut latencies = abort_latency(&hand)?;
        latencies.sort();
        if latencies.is_empty() {
            return Err(format!("{}: no abort came", hand.name).into());
        }
        let at = |percent: usize| latencies[(latencies.len() - 1) * percent / 100];
        writeln!(
            std::io::stdout(),
            "{:<28} {} of {TRIALS} chords sent: median {:.1?}, 99 % within {:.1?}, worst {:.1?}",
            hand.name,
            latencies.len(),
            at(50),
            at(99),
            at(100)
        )?;
    }
    Ok(())
}
