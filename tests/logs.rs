//! Logs with flipped bits, killed recorders and other CPUs.

use std::path::Path;
use std::process::Command;

use e2e::{Bound, Ended, Program, Running, Signal, frames_of, program};
use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;

/// The C library then chooses its mathematical functions as on a processor without these
/// instructions. Nothing else does: our solver asks the processor itself.
/// `onboard-sim/lab/cortex-m7/emulate` runs on a processor that has no such instructions.
const OTHER_C_LIBRARY: (&str, &str) = ("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4");

fn fly(folder: &Path, log: &str, environment: Option<(&str, &str)>) -> Ended {
    let mut command = program(Program::OnboardSim);
    command
        .args(["fly", "--seed", "3", "--speed", "max", "--log", log])
        .current_dir(folder)
        .envs(environment);
    Running::to_end(&mut command)
}

fn verify(log: &Path, environment: Option<(&str, &str)>) -> Ended {
    Running::to_end(program(Program::Replay).arg("verify").arg(log).envs(environment))
}

#[test]
fn the_same_flight_with_other_functions_of_the_c_library_is_identical_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let here = fly(folder.path(), "here.mcap", None);
    let there = fly(folder.path(), "there.mcap", Some(OTHER_C_LIBRARY));
    assert_eq!((here.code, there.code), (Some(0), Some(0)), "{}\n{}", here.output, there.output);
    let bits = |log: &str| -> Vec<_> {
        let mut frames = frames_of(&folder.path().join(log));
        // The free space on the disk is not the flight's.
        for frame in &mut frames {
            frame.input.log.space_bytes = 0;
        }
        frames.iter().map(ComputerFrame::encode_to_vec).collect()
    };
    let (here, there) = (bits("here.mcap"), bits("there.mcap"));
    assert!(here.len() > 5_000);
    assert_eq!(here, there);
    for environment in [None, Some(OTHER_C_LIBRARY)] {
        let verified = verify(&folder.path().join("here.mcap"), environment);
        assert_eq!(verified.code, Some(0), "{}", verified.output);
        let all = format!("{0} of {0} frames identical", here.len());
        assert!(verified.output.contains(&all), "{}", verified.output);
    }
}

#[test]
fn a_refused_flight_leaves_no_log() {
    let folder = tempfile::tempdir().unwrap();
    let link = "udpin:127.0.0.1:0";
    for refused in [["--key", "none.key"], ["--mavlink", "udpin:192.0.2.1:5"]] {
        let mut command = program(Program::OnboardSim);
        command.args(["fly", "--mavlink", link, "--log", "flight.mcap"]).args(refused);
        let ended = Running::to_end(command.current_dir(folder.path()));
        assert_eq!(ended.code, Some(1), "{}", ended.output);
        assert!(!folder.path().join("flight.mcap").exists(), "{refused:?}: {}", ended.output);
    }
}

#[test]
fn a_killed_recorder_loses_a_fraction_of_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = program(Program::OnboardSim);
    // In real time: on a busy machine the writer is late, too.
    command.args(["fly", "--start", "apogee", "--log", "killed.mcap"]).current_dir(folder.path());
    let mut flight = Running::start(&mut command);
    // The vehicle is killed as soon as it reports that its motor has burnt out.
    let line = flight.wait_for_line("burn-out");
    let burnt_out_s: f64 =
        line.split_whitespace().next().and_then(|time_s| time_s.parse().ok()).expect("a time");
    flight.signal(Signal::SIGKILL);
    flight.wait();
    let log = folder.path().join("killed.mcap");
    let last = frames_of(&log).last().cloned().expect("frames");
    assert!(last.input.time_s >= burnt_out_s - 0.5, "{} s of {burnt_out_s}", last.input.time_s);
    let verified = verify(&log, None);
    assert!(verified.output.contains("identical"), "{}", verified.output);
    assert_eq!(verified.code, Some(0), "{}", verified.output);
}

#[test]
fn a_file_that_is_no_log_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("picture.mcap");
    std::fs::write(&picture, b"\x89PNG\r\n\x1a\n and so on").unwrap();
    let refused = verify(&picture, None);
    assert_eq!(refused.code, Some(1), "{}", refused.output);
    assert!(
        refused.output.contains("not a flight log") && refused.output.contains("picture.mcap"),
        "{}",
        refused.output
    );
}

/// By default, a write beyond the limit ends a program without a word.
#[test]
fn a_limit_of_the_file_size_ends_the_log_and_not_the_flight() {
    let folder = tempfile::tempdir().unwrap();
    let limited = |command: &Command, kib: u32| {
        let mut shell = Command::new("bash");
        shell.args(["-c", &format!("ulimit -f {kib}; exec \"$@\""), "bash"]).arg(command.get_program());
        shell.args(command.get_args()).current_dir(folder.path());
        shell
    };
    let mut flight = program(Program::OnboardSim);
    flight.args(["fly", "--start", "pad", "--seed", "3", "--speed", "max", "--log", "flight.mcap"]);
    let flown = Running::to_end(&mut limited(&flight, 2_000));
    assert_eq!(flown.code, Some(1), "{}", flown.output);
    for words in ["its legs", "flight.mcap", "its log is incomplete"] {
        assert!(flown.output.contains(words), "{words}: {}", flown.output);
    }
    let mut vehicle = program(Program::OnboardSim);
    vehicle.args(["fly", "--start", "pad", "--speed", "1", "--mavlink", "udpin:127.0.0.1:0"]);
    let mut vehicle = Running::start(&mut vehicle);
    let link = format!("udpout:127.0.0.1:{}", vehicle.bound_port(Bound::Udp));
    let mut station = program(Program::Ground);
    station.args(["--auto", "--connect", &link, "--log", "station.mcap"]);
    let station = Running::to_end(&mut limited(&station, 200));
    assert!(station.output.contains("the log has failed") && station.code == Some(1), "{}", station.output);
    assert!(station.output.contains("its legs"), "to the end: {}", station.output);
}
