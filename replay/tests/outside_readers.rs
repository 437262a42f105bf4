//! The files that replay writes, read by other programs: `mcap`, `pymcap-cli`, pandas, polars, pyarrow, pymavlink.
//!
//! Ignored, because they need Python packages: `tests/outside/setup.sh` says how to run them.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

#[path = "replay/simulated.rs"]
mod simulated;

use std::path::{Path, PathBuf};
use std::process::Command;

use replay::export::{TableFormat, export_tables, export_tlog};
use replay::log::FlightLog;
use replay::recover::recover;
use replay::refly::{ReflyOptions, refly_flight, write_log};

use simulated::{DISPERSED, NOMINAL, WITH_FRAMES};

/// A program of the environment with the outside readers.
fn outside(program: &str) -> Command {
    let directory = std::env::var("OUTSIDE_READERS").unwrap();
    Command::new(Path::new(&directory).join("bin").join(program))
}

fn script(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/outside").join(name)
}

fn said(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    said
}

fn hex(number: f64) -> String {
    let output = said(outside("python").arg("-c").arg(format!("print(float('{number:?}').hex())")));
    output.trim().to_owned()
}

/// The recorder's log, one flown again and one recovered.
fn logs() -> Vec<PathBuf> {
    let recording = NOMINAL.recording();
    let options = ReflyOptions::default();
    let (report, flight) = refly_flight(&recording, &options).unwrap();
    let again = NOMINAL.beside("again.mcap");
    write_log(&again, &recording, &options, &report, &flight).unwrap();
    let cut = NOMINAL.beside("cut.mcap");
    let bytes = std::fs::read(&NOMINAL.log).unwrap();
    // In the middle of the messages.
    std::fs::write(&cut, &bytes[..bytes.len() * 4 / 5]).unwrap();
    let recovered = NOMINAL.beside("recovered.mcap");
    recover(&cut, &recovered).unwrap();
    vec![NOMINAL.log.clone(), DISPERSED.log.clone(), WITH_FRAMES.log.clone(), again, recovered]
}

#[test]
#[ignore = "needs Python packages: see tests/outside/setup.sh"]
fn logs_are_read_by_mcap_and_pass_pymcap_doctor_and_rerun_check() {
    for log in logs() {
        let read = said(outside("python").arg(script("read_mcap.py")).arg(&log));
        assert!(read.contains("/vehicle/truth "), "{read}");
        said(outside("pymcap-cli").arg("doctor").arg(&log));
        let checked = said(outside("rerun").args(["mcap", "check"]).arg(&log));
        assert!(
            checked.lines().any(|line| line.starts_with("ok ") && line.contains("/vehicle/truth")),
            "{checked}"
        );
        assert!(!checked.lines().any(|line| line.starts_with("error")), "{checked}");
        let recording = replay::log::Recording::open(&log).unwrap();
        assert!(read.contains(&format!("/controller/tick {}\n", recording.ticks.len())), "{read}");
        let command_rad = recording.ticks.last().unwrap().output.gimbal_command_rad;
        assert!(read.contains(&format!("gimbal {}\n", hex(command_rad))), "{read}");
    }
}

#[test]
#[ignore = "needs Python packages: see tests/outside/setup.sh"]
fn parquet_is_read_by_pandas_polars_and_pyarrow() {
    let directory = NOMINAL.beside("parquet");
    let mut log = FlightLog::open(&NOMINAL.log).unwrap();
    let files = export_tables(&mut log, TableFormat::Parquet, &directory).unwrap();
    let recording = NOMINAL.recording();
    let last = recording.truth.last().unwrap();
    for (column, value) in [("state.x_m", last.state.x_m), ("fin_2_actual_rad", last.fin_actual_rad[1])] {
        let path = directory.join("vehicle_truth.parquet");
        let columns = files.iter().find(|file| file.path == path).unwrap().columns;
        let read = said(outside("python").arg(script("read_tables.py")).arg(&path).arg(column));
        for reader in ["pandas", "polars", "pyarrow"] {
            let line = format!("{reader} {} {columns} {}\n", recording.truth.len(), hex(value));
            assert!(read.contains(&line), "{line} is not in\n{read}");
        }
    }
}

#[test]
#[ignore = "needs Python packages: see tests/outside/setup.sh"]
fn a_tlog_is_read_by_pymavlink() {
    let path = WITH_FRAMES.beside("flight.tlog");
    export_tlog(&|| FlightLog::open(&WITH_FRAMES.log), None, &path).unwrap();
    let read = said(outside("python").arg(script("read_tlog.py")).arg(&path).env("MAVLINK20", "1"));
    for name in ["HEARTBEAT", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED"] {
        let line = read.lines().find(|line| line.starts_with(name)).unwrap();
        let count: u32 = line.rsplit(' ').next().unwrap().parse().unwrap();
        assert!(count >= 10, "{read}");
    }
}
