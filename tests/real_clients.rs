//! Other people's MAVLink clients against the real vehicle process: they decide what MAVLink is, not we.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use e2e::{Clients, Program, Running, SerialLine, Signal, free_port, program, raw_frames_of};

fn vehicle(folder: &Path, arguments: &[&str]) -> Running {
    let mut command = program(Program::OnboardSim);
    Running::start(
        command.args(["fly", "--stay", "--log", "flight.mcap"]).args(arguments).current_dir(folder),
    )
}

/// Runs a client to its end against a vehicle that waits for it (`udpin`) or calls it (`udpout`).
fn against(kind: &str, client: impl FnOnce(Clients, u16) -> Command) {
    let Some(clients) = Clients::installed() else { return };
    let folder = tempfile::tempdir().unwrap();
    let port = free_port();
    let _vehicle = vehicle(folder.path(), &["--mavlink", &format!("{kind}:127.0.0.1:{port}")]);
    let ended = Running::to_end(client(clients, port).env("PYTHONUNBUFFERED", "1"));
    assert_eq!(ended.code, Some(0), "{}", ended.output);
    assert!(ended.output.contains("ALL OK"), "{}", ended.output);
}

#[test]
fn val_pymavlink_is_answered_as_the_standard_says() {
    against("udpin", |clients, port| {
        let mut command = clients.python("pymavlink", "pymavlink_client.py");
        command.arg(port.to_string());
        command
    });
}

/// Over UDP, and over a radio's serial line.
#[test]
fn val_pymavlink_flies_a_rocket_and_aborts_its_descent() {
    let Some(clients) = Clients::installed() else { return };
    let port = free_port();
    let line = SerialLine::new(57_600);
    let client = || clients.python("pymavlink", "pymavlink_rocket.py");
    let (mut over_udp, mut over_serial) = (client(), client());
    over_udp.arg(port.to_string());
    over_serial.args([line.far.display().to_string(), "57600".to_owned()]);
    let links = [format!("udpin:127.0.0.1:{port}"), format!("serial:{}:57600", line.near.display())];
    for (link, client) in links.iter().zip([over_udp, over_serial]) {
        let folder = tempfile::tempdir().unwrap();
        let vehicle = vehicle(folder.path(), &["--profile", "mk2", "--mavlink", link]);
        let mut client = client;
        let ended = Running::to_end(client.env("PYTHONUNBUFFERED", "1"));
        assert_eq!(ended.code, Some(0), "{link}: {}", ended.output);
        assert!(ended.output.contains("ALL OK"), "{link}: {}", ended.output);
        vehicle.signal(Signal::SIGTERM);
        let flight = vehicle.wait();
        assert_eq!(flight.code, Some(4), "{link}: {}", flight.output);
        assert!(flight.output.contains("parachute deployed"), "{link}: {}", flight.output);
    }
}

#[test]
fn val_pymavlink_two_grounds_are_each_answered_for_themselves() {
    against("udpin", |clients, port| {
        let mut command = clients.python("pymavlink", "two_grounds.py");
        command.arg(port.to_string());
        command
    });
}

#[test]
fn val_mavsdk_native_finds_reads_arms_and_terminates() {
    against("udpout", |clients, port| {
        let mut command = clients.python("mavsdk-native", "mavsdk_native.py");
        command.arg(port.to_string());
        command
    });
}

#[test]
fn val_mavsdk_with_its_server_finds_reads_arms_and_terminates() {
    against("udpout", |clients, port| {
        let mut command = clients.python("mavsdk-grpc", "mavsdk_grpc.py");
        command.args([port.to_string(), free_port().to_string()]);
        command
    });
}

#[test]
fn val_node_mavlink_reads_arms_and_terminates() {
    against("udpout", |clients, port| {
        let mut command = clients.node("node_client.mjs");
        command.arg(port.to_string());
        command
    });
}

/// pymavlink signs, and is believed; whatever is not signed, or not well, is not. The same after a restart.
#[test]
fn val_pymavlink_signatures_are_wanted_and_judged() {
    let Some(clients) = Clients::installed() else { return };
    let folder = tempfile::tempdir().unwrap();
    let key = folder.path().join("flight.key");
    let made = Running::to_end(program(Program::OnboardSim).arg("keygen").arg(&key));
    assert_eq!(made.code, Some(0), "{}", made.output);
    for further in [None, Some("restarted")] {
        let port = free_port();
        let link = format!("udpin:127.0.0.1:{port}");
        let log = if further.is_some() { "second.mcap" } else { "first.mcap" };
        let mut command = program(Program::OnboardSim);
        command.args(["fly", "--stay", "--mavlink", &link, "--log", log, "--key", "flight.key"]);
        let vehicle = Running::start(command.current_dir(folder.path()));
        let mut client = clients.python("pymavlink", "signed_client.py");
        let ended = Running::to_end(client.arg(port.to_string()).arg(&key).args(further));
        assert_eq!(ended.code, Some(0), "{}", ended.output);
        assert!(ended.output.contains("ALL OK"), "{}", ended.output);
        vehicle.signal(e2e::Signal::SIGTERM);
        vehicle.wait();
        assert!(
            raw_frames_of(&folder.path().join(log), "tx").iter().all(|frame| frame[2] == 0),
            "no signatures"
        );
    }
}

/// MAVProxy, driven through its standard input as an operator would.
#[test]
fn val_mavproxy_shows_arms_and_terminates() {
    let Some(clients) = Clients::installed() else { return };
    let folder = tempfile::tempdir().unwrap();
    let port = free_port();
    let mut vehicle = vehicle(folder.path(), &["--mavlink", &format!("udpin:127.0.0.1:{port}")]);
    vehicle.wait_for_line("PAD_IDLE");
    let mut command = clients.program("pymavlink", "mavproxy.py");
    command
        .args(["--master", &format!("udpout:127.0.0.1:{port}"), "--source-system", "255"])
        .args(["--source-component", "190", "--nodtr", "--mav20", "--state-basedir", "."])
        .env("PYTHONUNBUFFERED", "1")
        .env("HOME", folder.path())
        .current_dir(folder.path());
    let (mut operator, mut proxy) = Running::start_with_input(&mut command);
    let types = |operator: &mut std::process::ChildStdin, words: &str| {
        writeln!(operator, "{words}").and_then(|()| operator.flush()).unwrap();
    };
    // Without the declined file request this would take MAVProxy some 11 s more.
    proxy.wait_for_line("Received 23 parameters");
    types(&mut operator, "param show NMPC_W_THETA");
    let shown = proxy.wait_for_line("NMPC_W_THETA");
    assert!(shown.contains("150"), "{shown}");
    types(&mut operator, "param set RATE_FINS 1");
    // MAVProxy sets in the background; it is asked until it has heard the vehicle's answer.
    let is_set = (0..1_000).any(|_| {
        types(&mut operator, "param show RATE_FINS");
        proxy.wait_for_line("RATE_FINS").contains("1.0")
    });
    assert!(is_set, "the rate is set");
    types(&mut operator, "long 300 0");
    proxy.wait_for_line("MISSION_START: DENIED");
    proxy.wait_for_line("start refused: cannot start in PAD_IDLE");
    types(&mut operator, "arm throttle");
    // What HEARTBEAT says, not what was acknowledged.
    proxy.wait_for_line("Mode(2)");
    types(&mut operator, "disarm");
    proxy.wait_for_line("DISARMED");
    types(&mut operator, "long 185 1");
    proxy.wait_for_line("DO_FLIGHTTERMINATION: ACCEPTED");
    types(&mut operator, "arm throttle force");
    proxy.wait_for_line("refused");
    drop(operator);
    drop(proxy);
    vehicle.signal(e2e::Signal::SIGTERM);
    let ended = vehicle.wait();
    assert_eq!(ended.code, Some(4), "{}", ended.output);
}

/// A dissector generated from our XML by pymavlink's generator reads every frame of whole flights, and between the two
/// vehicles every message of ours is among them.
#[test]
fn val_wireshark_finds_no_malformed_frame() {
    let Some(clients) = Clients::installed() else { return };
    let folder = tempfile::tempdir().unwrap();
    // Wireshark is run by nobody when the test is run by root.
    let open = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    std::fs::set_permissions(folder.path(), open).unwrap();
    let xml = Path::new(env!("CARGO_MANIFEST_DIR")).join("../protocol/dialect/touchdown.xml");
    let mut generator = clients.program("pymavlink", "mavgen.py");
    generator.args(["--lang", "WLua", "--wire-protocol", "2.0", "-o", "touchdown"]).arg(&xml);
    let generated = Running::to_end(generator.current_dir(folder.path()));
    assert_eq!(generated.code, Some(0), "{}", generated.output);

    // HEARTBEAT, SYS_STATUS, ATTITUDE_QUATERNION, LOCAL_POSITION_NED, VFR_HUD, EXTENDED_SYS_STATE, STATUSTEXT.
    let both = [0, 1, 31, 32, 74, 245, 253];
    let planar = dissected(clients, folder.path(), "paper-calibrated");
    // Besides: ESTIMATOR_STATUS, TD_DESCENT.
    let spatial = dissected(clients, folder.path(), "mk2");
    for (ids, more) in [(&planar, &[][..]), (&spatial, &[230, 54_008])] {
        for id in both.iter().chain(more) {
            assert!(ids.contains(id), "message {id} is in the flight: {ids:?}");
        }
    }
    let text = std::fs::read_to_string(&xml).unwrap();
    let ours = text.split("<message id=\"").skip(1).filter_map(|rest| rest.split('"').next()?.parse().ok());
    let ours: BTreeSet<u32> = ours.collect();
    let seen: BTreeSet<u32> = planar.union(&spatial).copied().collect();
    assert!(!ours.is_empty() && ours.is_subset(&seen), "{ours:?} of ours, {seen:?} seen");
}

/// Flies this profile and has Wireshark read every frame of the vehicle; the messages' numbers.
fn dissected(clients: Clients, folder: &Path, profile: &str) -> BTreeSet<u32> {
    let (log, capture) = (format!("{profile}.mcap"), format!("{profile}.pcap"));
    let flown = Running::to_end(
        program(Program::OnboardSim)
            .args(["fly", "--profile", profile, "--speed", "max", "--auto-start", "--log", &log])
            .args(["--mavlink", &format!("udpout:127.0.0.1:{}", free_port())])
            .current_dir(folder),
    );
    assert_eq!(flown.code, Some(0), "{}", flown.output);
    let frames = raw_frames_of(&folder.join(&log), "tx");
    assert!(frames.len() > 500, "{} frames", frames.len());
    std::fs::write(folder.join(&capture), capture_of(&frames)).unwrap();
    let read = |filter: &[&str]| {
        let mut command = clients.tshark();
        command
            .args(["-r", &capture, "-X", "lua_script:touchdown.lua", "-d", "udp.port==14550,mavlink_proto"])
            .args(filter)
            .current_dir(folder);
        Running::to_end(&mut command).output
    };
    let found = read(&["-Y", "mavlink_proto", "-T", "fields", "-e", "mavlink_proto.msgid"]);
    let ids: Vec<u32> = found.lines().filter_map(|line| line.parse().ok()).collect();
    assert_eq!(ids.len(), frames.len(), "every frame is read");
    let malformed = read(&["-V", "-Y", "_ws.malformed || _ws.lua.error || _ws.expert.severity >= error"]);
    let lines: Vec<&str> = malformed.lines().filter(|line| !line.starts_with("Running as user")).collect();
    assert!(lines.is_empty(), "{}", lines.join("\n"));
    ids.into_iter().collect()
}

/// A libpcap file with one UDP datagram to port 14550 for each frame.
fn capture_of(frames: &[Vec<u8>]) -> Vec<u8> {
    // Magic, version 2.4, zone, accuracy, longest packet, link type 228: IPv4 without anything below it.
    let mut capture = Vec::new();
    for word in [0xa1b2_c3d4_u32, 0x0004_0002, 0, 0, 65_535, 228] {
        capture.extend_from_slice(&word.to_le_bytes());
    }
    for frame in frames {
        let udp_len = 8 + frame.len() as u16;
        let len = u32::from(20 + udp_len);
        for word in [0, 0, len, len] {
            capture.extend_from_slice(&word.to_le_bytes());
        }
        capture.extend_from_slice(&[0x45, 0]);
        capture.extend_from_slice(&(20 + udp_len).to_be_bytes());
        capture.extend_from_slice(&[0, 0, 0, 0, 64, 17, 0, 0, 127, 0, 0, 1, 127, 0, 0, 1]);
        for word in [14_551, 14_550, udp_len, 0] {
            capture.extend_from_slice(&u16::to_be_bytes(word));
        }
        capture.extend_from_slice(frame);
    }
    capture
}
