//! Two vehicles at one station, somebody else's vehicle, two stations under one id, and screens of
//! other people: the real processes, typed at by hand.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::net::UdpSocket;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use e2e::{ABORT, ARM, Bound, Program, Running, START, Signal, Terminal, keygen, program, vehicle};
use protocol::command::CommandRequest;
use protocol::dialect::{
    HEARTBEAT_DATA, MavAutopilot, MavCmd, MavMessage, MavModeFlag, MavType, TIMESYNC_DATA,
};
use protocol::frame::{Encoder, Framer};
use protocol::identity::VEHICLE;

use crate::two_stations::CREW;

const SIZE: (u16, u16) = (100, 30);

/// `ground` with settings and a runtime folder of the test's own.
fn ground(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = program(Program::Ground);
    command
        .args(arguments)
        .envs([("XDG_RUNTIME_DIR", folder), ("XDG_CONFIG_HOME", folder)])
        .current_dir(folder);
    command
}

/// A station on a terminal that listens, and its port.
fn listening(folder: &Path) -> (Terminal, u16) {
    let command = ground(folder, &["--connect", "udpin:127.0.0.1:0", "--log", "none"]);
    let mut terminal = Terminal::start(&command, SIZE, false);
    let port = terminal.bound_port(Bound::Udp);
    (terminal, port)
}

/// A vehicle that only sends heartbeats and answers TIMESYNC, as a foreign one does. It notes what
/// it is commanded.
struct Beating {
    commands: Arc<Mutex<Vec<CommandRequest>>>,
    runs: Arc<AtomicBool>,
}

impl Beating {
    fn start(beat: HEARTBEAT_DATA, port: u16) -> Self {
        let (commands, runs) = (Arc::new(Mutex::new(Vec::new())), Arc::new(AtomicBool::new(true)));
        let (noted, goes_on) = (Arc::clone(&commands), Arc::clone(&runs));
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(("127.0.0.1", port)).unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
        let beats = move || {
            let (mut encoder, mut framer, mut datagram) = (Encoder::new(VEHICLE), Framer::new(), [0; 2048]);
            while goes_on.load(Ordering::Relaxed) {
                let _ = socket.send(encoder.encode(&MavMessage::HEARTBEAT(beat.clone())).as_bytes());
                let Ok(count) = socket.recv(&mut datagram) else { continue };
                framer.push(&datagram[..count]);
                while let Some(frame) = framer.next_frame() {
                    noted.lock().unwrap().extend(CommandRequest::from_frame(&frame));
                    if let Ok(MavMessage::TIMESYNC(asked)) = frame.decode() {
                        let answer = MavMessage::TIMESYNC(TIMESYNC_DATA {
                            tc1: 1,
                            ts1: asked.ts1,
                            target_system: frame.source().system_id,
                            target_component: frame.source().component_id,
                        });
                        let _ = socket.send(encoder.encode(&answer).as_bytes());
                    }
                }
            }
        };
        std::thread::Builder::new().name("foreign vehicle".to_owned()).spawn(beats).unwrap();
        Self { commands, runs }
    }

    fn was_sent(&self, command: MavCmd) -> bool {
        self.commands.lock().unwrap().iter().any(|request| request.is(command))
    }
}

impl Drop for Beating {
    fn drop(&mut self) {
        self.runs.store(false, Ordering::Relaxed);
    }
}

/// Both have the default id, and the station listens.
#[test]
fn two_vehicles_at_one_station_get_nothing_but_an_abort() {
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, port) = listening(folder.path());
    let link = format!("udpout:127.0.0.1:{port}");
    let vehicles = ["one", "two"].map(|name| {
        let folder = folder.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        Running::start(vehicle(&folder, &[&link]).args(["--stay", "--mission", "mk2"]))
    });
    screen.wait_until("two vehicles", |window| {
        let rows = window.rows();
        (rows[0].contains("TWO VEHICLES under id 1") && !window.shows(" GO: ")).then_some(())
    });
    screen.type_until(b"0AARM\r", "cannot arm: TWO VEHICLES under id 1");
    screen.type_bytes(b"\x18\r");
    screen.wait_for("observed yes");
    // The events of both vehicles push it off the few rows of the pad's page.
    screen.type_bytes(b"6");
    screen.wait_for("ABORT goes to every vehicle received under id 1");
    for mut vehicle in vehicles {
        vehicle.wait_for_line("ABORT");
        vehicle.signal(Signal::SIGTERM);
        let ended = vehicle.wait();
        assert_eq!(ended.code, Some(4), "aborted: {}", ended.output);
        assert!(!ended.output.contains("PAD_ARMED"), "{}", ended.output);
    }
}

/// A spare is switched on at the same station while the first one counts down.
#[test]
fn a_second_vehicle_does_not_hide_a_countdown_which_its_station_holds() {
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, port) = listening(folder.path());
    let link = format!("udpout:127.0.0.1:{port}");
    let mut first = Running::start(vehicle(folder.path(), &[&link]).args(["--stay", "--mission", "mk2"]));
    screen.wait_for("every arming check passes");
    screen.type_until(b"0AARM\r", " ARMED ");
    screen.type_until(b"0SSTART\r", "START  commanded");
    screen.wait_for_fact("START", "observed yes");
    let spare = Running::start(vehicle(folder.path(), &[&link]).args(["--stay", "--mission", "mk3"]));
    screen.wait_until("two vehicles and the one that is armed", |window| {
        let rows = window.rows();
        assert!(!window.shows("REBOOTED") && !rows[1].contains(" disarmed "), "{rows:?}");
        // The station holds as soon as it receives both, so the countdown may stand on no screen
        // with two vehicles.
        (rows[0].contains("TWO VEHICLES under id 1") && rows[1].starts_with(" ARMED ")).then_some(())
    });
    first.wait_for_line("hold");
    // A disarm goes to both.
    screen.type_until(b"0D\r", "DISARM");
    first.wait_for_line("PAD_ARMED to PAD_IDLE");
    for vehicle in [first, spare] {
        vehicle.signal(Signal::SIGTERM);
        assert!(!vehicle.wait().output.contains("to BOOST"));
    }
}

/// A copied memory card: one unique id and one boot number.
#[test]
fn two_vehicles_with_one_boot_number_are_two() {
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, port) = listening(folder.path());
    let link = format!("udpout:127.0.0.1:{port}");
    std::fs::write(folder.path().join("uid"), "4711\n").unwrap();
    let copy = ["--stay", "--mission", "mk2", "--boot-number", "42", "--uid-file", "uid"];
    let first = Running::start(vehicle(folder.path(), &[&link]).args(copy));
    screen.wait_for("every arming check passes");
    let second = Running::start(vehicle(folder.path(), &[&link]).args(copy));
    screen.wait_for("TWO VEHICLES under id 1");
    screen.type_until(b"0AARM\r", "cannot arm: TWO VEHICLES under id 1");
    for vehicle in [first, second] {
        vehicle.signal(Signal::SIGTERM);
        assert!(!vehicle.wait().output.contains("PAD_ARMED"));
    }
}

/// What a station that listens commands goes to the vehicle that it shows, and an abort to
/// everybody.
#[test]
fn commands_go_only_to_the_origin_of_the_shown_vehicle() {
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, port) = listening(folder.path());
    // Its heartbeat is like ours, but it has reported no status: no evidence that it is another
    // one.
    let other = Beating::start(
        HEARTBEAT_DATA {
            custom_mode: 1,
            mavtype: MavType::MAV_TYPE_ROCKET,
            autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
            base_mode: MavModeFlag::empty(),
            mavlink_version: 3,
            ..HEARTBEAT_DATA::default()
        },
        port,
    );
    let link = format!("udpout:127.0.0.1:{port}");
    let vehicle = Running::start(vehicle(folder.path(), &[&link]).args(["--stay", "--mission", "mk2"]));
    screen.wait_for("every arming check passes");
    screen.type_until(b"0AARM\r", "ARM acknowledged: accepted");
    assert!(!other.was_sent(ARM), "the other vehicle was armed, too");
    screen.type_bytes(b"\x18\r");
    screen.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    screen.wait_until("the abort at the other vehicle", |_| other.was_sent(ABORT).then_some(()));
    vehicle.signal(Signal::SIGTERM);
    assert_eq!(vehicle.wait().code, Some(4));
}

/// It answers TIMESYNC, so that its uplink is proven; its mode ACRO has the number of PAD_IDLE.
#[test]
fn a_copter_is_not_armed_and_an_abort_of_it_is_confirmed_first() {
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, port) = listening(folder.path());
    let copter = Beating::start(
        HEARTBEAT_DATA {
            custom_mode: 1,
            mavtype: MavType::MAV_TYPE_QUADROTOR,
            autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode: MavModeFlag::empty(),
            mavlink_version: 3,
            ..HEARTBEAT_DATA::default()
        },
        port,
    );
    screen.wait_until("whose it is", |window| {
        let rows = window.rows();
        (rows[0].contains("NOT A TOUCHDOWN VEHICLE: ArduPilot quadrotor") && rows[1].contains("mode 1"))
            .then_some(())
    });
    screen.wait_for("up 0s");
    screen.type_until(b"0AARM\r", "cannot arm: not a Touchdown vehicle: ArduPilot quadrotor");
    screen.type_until(b"0SSTART\r", "cannot start: not a Touchdown vehicle");
    screen.type_bytes(b"\x18\r");
    screen.wait_for("flight termination CUTS ITS MOTORS");
    assert!(copter.commands.lock().unwrap().is_empty(), "{:?}", copter.commands.lock().unwrap());
    screen.type_by_hand(b"ABORT\r");
    screen.wait_for("ABORT commanded, attempt 1");
    screen.wait_until("the abort at the copter", |_| copter.was_sent(ABORT).then_some(()));
    assert!(!copter.was_sent(ARM) && !copter.was_sent(START));
}

/// Bob's own station asks, and Bob at a screen of Ann's station cannot confirm; Ann can.
#[test]
fn nobody_is_two_people_through_a_screen_of_the_other_one_s_station() {
    let folder = tempfile::tempdir().unwrap();
    for key in ["flight.key", "ann.key", "bob.key"] {
        assert_eq!(keygen(folder.path(), key).code, Some(0));
    }
    std::fs::write(folder.path().join("crew.toml"), CREW).unwrap();
    let mut fly = vehicle(folder.path(), &["udpin:127.0.0.1:0"]);
    fly.args(["--mission", "mk2", "--stay", "--key", "flight.key", "--crew", "crew.toml"]);
    let mut vehicle = Running::start(&mut fly);
    let link = vehicle.udp_link();
    let laptop = |operator: &str| {
        let laptop = folder.path().join(operator);
        std::fs::create_dir(&laptop).unwrap();
        for file in ["flight.key", "ann.key", "bob.key", "crew.toml"] {
            std::fs::copy(folder.path().join(file), laptop.join(file)).unwrap();
        }
        laptop
    };
    let (anns, bobs) = (laptop("Ann"), laptop("Bob"));
    let joined = ["--connect", &link, "--key", "flight.key", "--crew", "crew.toml", "--log", "none"];
    let mut daemon =
        Running::start(&mut ground(&anns, &[&["daemon", "--operator", "Ann"], &joined[..]].concat()));
    daemon.wait_for_line("PAD_IDLE");
    let own = ground(&bobs, &[&joined[..], &["--operator", "Bob", "--sysid", "254"]].concat());
    let mut bob = Terminal::start(&own, SIZE, false);
    let attach =
        |operator: &str| Terminal::start(&ground(&anns, &["attach", "--operator", operator]), SIZE, false);
    let (mut bob_at_ann_s, mut ann) = (attach("Bob"), attach("Ann"));
    for screen in [&bob, &bob_at_ann_s, &ann] {
        screen.wait_for("every arming check passes");
    }
    // It says so before anything is typed.
    bob_at_ann_s.wait_for("HOLD/ABORT ONLY TWO-PERSON");
    bob_at_ann_s.type_until(b"0AARM\r", "this screen cannot arm: this station signs as Ann");
    for _ in 0..10 {
        bob.type_by_hand(b"0AARM\r");
        let asks = |window: &e2e::Window| window.shows("FLIGHT Bob requests to arm").then_some(());
        if ann.wait_within(Duration::from_secs(3), asks).is_none() {
            continue;
        }
        bob_at_ann_s.type_by_hand(b"0ACONFIRM\r");
        let armed = |window: &e2e::Window| window.shows(" ARMED ").then_some(());
        assert!(bob_at_ann_s.wait_within(Duration::from_secs(2), armed).is_none(), "one person armed it");
        ann.type_by_hand(b"0ACONFIRM\r");
        if ann.wait_within(Duration::from_secs(3), armed).is_some() {
            break;
        }
    }
    ann.wait_for(" ARMED ");
    // Bob may stop it from any screen.
    bob_at_ann_s.type_bytes(b"\x18\r");
    ann.wait_for("ABORT LATCHED");
    vehicle.signal(Signal::SIGTERM);
    let ended = vehicle.wait();
    assert!(ended.output.contains("Ann") && ended.output.contains("Bob"), "{}", ended.output);
    daemon.signal(Signal::SIGTERM);
}

/// The daemon that armed the vehicle is killed under its screen.
#[test]
fn a_screen_whose_daemon_was_killed_claims_nothing_and_stores_an_unsent_abort_until_it_is_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = vehicle(folder.path(), &["udpin:127.0.0.1:0"]);
    let mut vehicle = Running::start(command.args(["--stay", "--mission", "mk2"]));
    let link = vehicle.udp_link();
    let mut daemon =
        Running::start(&mut ground(folder.path(), &["daemon", "--connect", &link, "--log", "none"]));
    daemon.wait_for_line("PAD_IDLE");
    let mut screen = Terminal::start(&ground(folder.path(), &["attach", "--operator", "ann"]), SIZE, false);
    screen.wait_for("every arming check passes");
    screen.type_until(b"0AARM\r", "armed (HEARTBEAT)");
    daemon.signal(Signal::SIGKILL);
    daemon.wait();
    screen.wait_until("that the station is gone, in every line", |window| {
        let rows = window.rows();
        let header = rows[0].contains("NO STATION") && rows[0].contains("STATION GONE");
        let claims = window.shows("armed here") || window.shows("ABORT Ctrl-X");
        (header && !claims && window.shows("ALARM STATION GONE")).then_some(())
    });
    screen.type_bytes(b"\x18\r");
    screen.wait_for("ABORT NOT SENT: no station. The next one sends it; Esc cancels it");
    // Long after the link counts as lost the alarm that is shown is still that of the abort.
    screen.wait_until("six seconds", |window| window.rows()[0].contains("STATION GONE 6s").then_some(()));
    assert!(
        screen.window().row_with("ALARM ABORT NOT SENT").is_some(),
        "{}",
        screen.window().rows().join("\n")
    );
    screen.type_bytes(b"\x1b");
    screen.wait_for("the abort that was not sent is cancelled");
    screen.wait_until("the alarm of the station", |window| {
        (window.shows("ALARM STATION GONE") && window.row_with("ABORT NOT SENT: no station").is_none())
            .then_some(())
    });
    vehicle.signal(Signal::SIGTERM);
    let output = vehicle.wait().output;
    assert!(!output.contains("ABORT"), "{output}");
}

/// The vehicle accepts both, as it must. A station that has received before its Enter that it is
/// armed sends nothing, and says so.
#[test]
fn both_of_two_stations_that_arm_at_once_get_an_answer() {
    let folder = tempfile::tempdir().unwrap();
    let mut vehicle = Running::start(vehicle(folder.path(), &["udpin:127.0.0.1:0"]).arg("--stay"));
    let link = vehicle.udp_link();
    let station = |system: &str| {
        let command = ground(folder.path(), &["--connect", &link, "--log", "none", "--sysid", system]);
        Terminal::start(&command, SIZE, false)
    };
    let mut both = [station("255"), station("254")];
    for screen in &both {
        screen.wait_for("every arming check passes");
    }
    for screen in &mut both {
        screen.type_by_hand(b"0AARM");
    }
    for screen in &mut both {
        screen.type_bytes(b"\r");
    }
    for screen in &mut both {
        // On a busy machine keys arrive together.
        screen.confirm_if_prompted(" ARMED ");
    }
    for screen in &mut both {
        let was_typed = screen.wait_until("an answer to ARM", |window| {
            let facts = window.facts_about("ARM");
            let accepted = facts.is_some_and(|facts| facts.contains("acknowledged accepted  observed yes"));
            let answered = accepted || window.shows("cannot arm: armed already");
            answered.then_some(true).or_else(|| window.shows("nothing was done").then_some(false))
        });
        // On a busy machine a key may be taken for one of a paste.
        if !was_typed {
            screen.type_until(b"0AARM\r", "cannot arm: armed already");
        }
    }
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}

/// The one that armed and started is killed in the countdown; the other one's heartbeats, under the
/// same id, do not stand in for it.
#[test]
fn a_second_station_under_the_same_id_neither_commands_nor_sustains_a_countdown() {
    let folder = tempfile::tempdir().unwrap();
    let of = concat!(env!("CARGO_MANIFEST_DIR"), "/../onboard-sim/flight/vehicles/missions/mk2.toml");
    let profile = std::fs::read_to_string(of).unwrap();
    // The second station joins within it, however busy the machine is.
    let slow = profile.replace("[start]\n", "[start]\ncountdown_s = 300.0\n");
    std::fs::write(folder.path().join("slow.toml"), slow).unwrap();
    let mut command = vehicle(folder.path(), &["udpin:127.0.0.1:0"]);
    let mut vehicle = Running::start(command.args(["--stay", "--mission", "slow.toml"]));
    let link = vehicle.udp_link();
    let station =
        || Terminal::start(&ground(folder.path(), &["--connect", &link, "--log", "none"]), SIZE, false);
    let mut one = station();
    one.wait_for("every arming check passes");
    one.type_until(b"0AARM\r", "armed (HEARTBEAT)");
    one.type_until(b"0SSTART\r", "hold until T-2");
    one.wait_for("armed here");
    let mut other = station();
    let never_here =
        |window: &e2e::Window| assert!(!window.shows("armed here"), "{}", window.rows().join("\n"));
    for (screen, is_other) in [(&one, false), (&other, true)] {
        screen.wait_until("that there are two", |window| {
            if is_other {
                never_here(window);
            }
            window.shows("another station uses our id 255/190").then_some(())
        });
    }
    other.type_until(b"0AARM\r", "cannot arm: another station uses our id 255/190");
    one.signal(Signal::SIGKILL);
    other.wait_until("the hold", |window| {
        never_here(window);
        window.shows("HOLD: no uplink from its station for 1 s").then_some(())
    });
    other.type_bytes(b"\x18\r");
    other.wait_until("the abort", |window| {
        never_here(window);
        window.shows("observed yes").then_some(())
    });
    vehicle.signal(Signal::SIGTERM);
    assert!(!vehicle.wait().output.contains("LAND_ARMED"));
}
