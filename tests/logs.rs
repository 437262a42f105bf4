//! Logs with flipped bits, killed recorders and other CPUs.

use std::path::Path;

use e2e::{Ended, Program, Running, Signal, program, rewrite_log, ticks_of};
use prost::Message as _;

/// The C library then chooses its mathematical functions as on a processor without these instructions. Nothing else does:
/// our solver asks the processor itself. `onboard-sim/board/emulate` runs on a processor that has no such instructions.
const OTHER_C_LIBRARY: (&str, &str) = ("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4");

fn fly(folder: &Path, log: &str, environment: Option<(&str, &str)>) -> Ended {
    let mut command = program(Program::OnboardSim);
    command
        .args(["fly", "--profile", "paper-dispersed", "--seed", "3", "--speed", "max", "--log", log])
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
        let ticks = ticks_of(&folder.path().join(log));
        ticks
            .into_iter()
            .map(|tick| (tick.input.encode_to_vec(), tick.output.encode_to_vec(), tick.state_digest))
            .collect()
    };
    let (here, there) = (bits("here.mcap"), bits("there.mcap"));
    assert!(here.len() > 50);
    assert_eq!(here, there);
    for environment in [None, Some(OTHER_C_LIBRARY)] {
        let verified = verify(&folder.path().join("here.mcap"), environment);
        assert_eq!(verified.code, Some(0), "{}", verified.output);
        let all = format!("{0} of {0} ticks identical", bits("here.mcap").len());
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
fn one_flipped_bit_in_one_output_is_found_at_its_tick() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(fly(folder.path(), "good.mcap", None).code, Some(0));
    let bad = folder.path().join("bad.mcap");
    rewrite_log(&folder.path().join("good.mcap"), &bad, |ticks| {
        assert_eq!(ticks[30].input.tick, 30);
        let output = &mut ticks[30].output;
        output.gimbal_command_rad = f64::from_bits(output.gimbal_command_rad.to_bits() ^ 1);
    });
    let verified = verify(&bad, None);
    assert_eq!(verified.code, Some(1), "{}", verified.output);
    assert!(
        verified.output.contains("first at tick 30 ") && verified.output.contains("gimbal_command_rad"),
        "{}",
        verified.output
    );
}

#[test]
fn a_killed_recorder_loses_a_fraction_of_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--log", "killed.mcap"]).current_dir(folder.path());
    let mut flight = Running::start(&mut command);
    // The vehicle is killed as soon as it reports that its motor has burnt out.
    flight.wait_for_line("burn-out");
    flight.signal(Signal::SIGKILL);
    flight.wait();
    let log = folder.path().join("killed.mcap");
    let last = ticks_of(&log).last().cloned().expect("ticks");
    assert!(last.input.time_since_ignition_s >= 4.5, "{} s", last.input.time_since_ignition_s);
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
    assert_eq!(refused.code, Some(2), "{}", refused.output);
    assert!(
        refused.output.contains("not a flight log") && refused.output.contains("picture.mcap"),
        "{}",
        refused.output
    );
}
