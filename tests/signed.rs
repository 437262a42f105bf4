//! Signed links between the real processes.

use std::path::Path;

use e2e::{Bound, Ended, Program, Running, program};

fn keygen(folder: &Path, name: &str) -> Ended {
    Running::to_end(program(Program::OnboardSim).args(["keygen", name]).current_dir(folder))
}

fn fly(folder: &Path, key: &str, link: &str) -> Running {
    let mut command = program(Program::OnboardSim);
    Running::start(command.args(["fly", "--mavlink", link, "--key", key]).current_dir(folder))
}

#[test]
fn with_one_key_they_land_and_remember_their_timestamps() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(keygen(folder.path(), "flight.key").code, Some(0));
    assert_eq!(keygen(folder.path(), "flight.key").code, Some(1), "a key is not overwritten");
    let mut station = program(Program::Ground);
    station
        .args(["--connect", "udpin:127.0.0.1:0", "--key", "flight.key"])
        .args(["--headless", "--auto", "--log", "ground.mcap"])
        .current_dir(folder.path());
    let mut station = Running::start(&mut station);
    let link = format!("udpout:127.0.0.1:{}", station.bound_port(Bound::Udp));
    let flight = fly(folder.path(), "flight.key", &link);
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!((station.code, flight.code), (Some(0), Some(0)), "{}\n{}", station.output, flight.output);
    for user in ["vehicle", "ground"] {
        let stamps = folder.path().join(format!("flight.key.{user}.stamps"));
        let text = std::fs::read_to_string(stamps).unwrap();
        assert!(text.starts_with("ours ") && text.contains("heard "), "{text}");
    }
    let bytes = std::fs::read(folder.path().join("ground.mcap")).unwrap();
    let key = std::fs::read_to_string(folder.path().join("flight.key")).unwrap();
    let raw: Vec<u8> =
        (0..64).step_by(2).map(|at| u8::from_str_radix(&key[at..at + 2], 16).unwrap()).collect();
    for secret in [key.trim().as_bytes(), &raw] {
        assert!(!bytes.windows(secret.len()).any(|window| window == secret), "a key in the log");
    }
}

#[test]
fn with_another_key_nothing_is_believed_on_either_side() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["vehicle.key", "other.key"] {
        assert_eq!(keygen(folder.path(), name).code, Some(0));
    }
    let mut flight = fly(folder.path(), "vehicle.key", "udpin:127.0.0.1:0");
    let link = format!("udpout:127.0.0.1:{}", flight.bound_port(Bound::Udp));
    for key in [Some("other.key"), None] {
        let mut station = program(Program::Ground);
        station
            .args(["--connect", &link, "--headless", "--auto", "--log", "none"])
            .args(["--timeout-s", "8"])
            .args(key.iter().flat_map(|key| ["--key", key]))
            .current_dir(folder.path());
        let station = Running::to_end(&mut station);
        assert_ne!(station.code, Some(0), "{}", station.output);
        if key.is_some() {
            // The ground's counters, in words.
            assert!(station.output.contains("wrongly signed"), "{}", station.output);
            assert!(!station.output.contains("PAD_IDLE"), "{}", station.output);
        } else {
            // A ground without a key sees the vehicle, is not obeyed, and is told why.
            assert!(station.output.contains("refused: unsigned"), "{}", station.output);
        }
    }
    flight.signal(e2e::Signal::SIGTERM);
    let flight = flight.wait();
    assert_eq!(flight.code, Some(5), "nothing was armed or aborted: {}", flight.output);
    assert!(!flight.output.contains("PAD_ARMED"), "{}", flight.output);
}

#[test]
fn a_key_that_others_can_read_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(keygen(folder.path(), "open.key").code, Some(0));
    let open = std::os::unix::fs::PermissionsExt::from_mode(0o644);
    std::fs::set_permissions(folder.path().join("open.key"), open).unwrap();
    let flight = fly(folder.path(), "open.key", "udpout:127.0.0.1:1").wait();
    assert_eq!(flight.code, Some(1), "{}", flight.output);
    assert!(flight.output.contains("chmod 600 open.key"), "{}", flight.output);
    let mut station = program(Program::Ground);
    station.args(["--connect", "udpin:127.0.0.1:0", "--key", "open.key", "--log", "none"]);
    let station = Running::to_end(station.current_dir(folder.path()));
    assert_eq!(station.code, Some(1), "{}", station.output);
    assert!(station.output.contains("chmod 600 open.key"), "{}", station.output);
}
