//! Other people's programs read the files that replay writes: `mcap`, `pymcap-cli`, Foxglove's
//! `@mcap/core` and application, Rerun, pandas, polars, pyarrow, pymavlink.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

#[path = "../../../replay/tests/replay/from_apogee.rs"]
mod from_apogee;
#[path = "../../../replay/tests/replay/simulated.rs"]
mod simulated;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use clients::{FOXGLOVE, NODE_MCAP, READERS, RERUN, file, found};
use protocol::log::record::{Direction, RawFrame, Record};
use protocol::log::tlog::TlogWriter;
use replay::export::export_tables;
use replay::info::info;
use replay::log::{Entry, FlightLog, Recording};
use replay::recover::recover;
use replay::refly::{ReflyOptions, refly_flight, write_log};

use from_apogee::LANDED;
use simulated::{DISPERSED, MK2, WITH_FRAMES};

fn output_of(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{printed}{}", String::from_utf8_lossy(&output.stderr));
    printed
}

fn hex(number: f64) -> String {
    let print = format!("print(float('{number:?}').hex())");
    output_of(READERS.python().arg("-c").arg(print)).trim().to_owned()
}

/// Logs of the recorder, one flown again, one recovered, and one of a flight from apogee.
static LOGS: LazyLock<Vec<PathBuf>> = LazyLock::new(|| {
    let recording = MK2.recording();
    let options = ReflyOptions::default();
    let (_, flight) = refly_flight(&recording, &options).unwrap();
    let again = MK2.beside("again.mcap");
    write_log(&again, &recording, &flight).unwrap();
    let cut = MK2.beside("cut.mcap");
    let bytes = std::fs::read(&MK2.log).unwrap();
    // This cuts the file in the middle of the messages.
    std::fs::write(&cut, &bytes[..bytes.len() * 4 / 5]).unwrap();
    let recovered = MK2.beside("recovered.mcap");
    recover(&cut, &recovered).unwrap();
    assert!(LANDED.landed);
    let flown = [&MK2, &DISPERSED, &WITH_FRAMES].map(|flight| flight.log.clone());
    flown.into_iter().chain([again, recovered, LANDED.log.clone()]).collect()
});

/// The topic of the flight computer's frames, their number, and the last gimbal command that is not
/// 0, rad.
fn commands(log: &Path) -> (&'static str, usize, f64) {
    let mut log = FlightLog::open(log).unwrap();
    let (mut frames, mut last_rad) = (0, 0.0);
    while let Some(stamped) = log.next_entry().unwrap() {
        if let Entry::ComputerFrame(frame) = stamped.entry {
            frames += 1;
            let command_rad = frame.record.output.gimbal_rad[0];
            last_rad = if command_rad.abs() > 0.0 { command_rad } else { last_rad };
        }
    }
    assert!(last_rad.abs() > 0.0);
    ("/computer/frame", frames, last_rad)
}

#[test]
fn logs_are_read_by_mcap_and_pass_pymcap_doctor() {
    for log in LOGS.iter() {
        let read = output_of(READERS.python().arg(file("readers/read_mcap.py")).arg(log));
        assert!(read.contains("/vehicle/truth3d"), "{read}");
        output_of(READERS.program("pymcap-cli").arg("doctor").arg(log));
        let recording = Recording::open(log).unwrap();
        let (topic, count, command_rad) = commands(log);
        assert!(read.contains(&format!("{topic} {count}\n")), "{read}");
        assert!(read.contains(&format!("gimbal {}\n", hex(command_rad))), "{read}");
        // The recovered log was cut before its verdict.
        assert_eq!(read.contains("/verdict 1\n"), recording.verdict.is_some(), "{read}");
    }
}

/// Foxglove's library decodes every message by the schema in the log, and the values to plot are
/// numbers.
#[test]
fn logs_are_read_by_foxgloves_library() {
    for log in LOGS.iter() {
        let read = output_of(NODE_MCAP.node().arg(file("readers/read_mcap.mjs")).arg(log));
        let (topic, count, _) = commands(log);
        let mut channels = read.lines().map(|line| line.split(' ').collect::<Vec<_>>());
        let of_commands = channels.clone().find(|channel| channel[0] == topic).unwrap();
        assert_eq!(of_commands[2], count.to_string(), "{read}");
        assert!(read.contains("/tf foxglove.FrameTransform"), "{read}");
        // Every channel except the texts of events and operators has something to plot.
        let plottable = |channel: Vec<&str>| {
            let least = match channel[0] {
                "/pilot/timing" => 4,
                "/computer/start" => 6,
                _ => 8,
            };
            channel[3].parse::<u32>().unwrap() >= least
        };
        let wordy = |channel: &Vec<&str>| matches!(channel[0], "/events" | "/operator/actions");
        assert!(channels.all(|channel| wordy(&channel) || plottable(channel)), "{read}");
    }
}

/// Foxglove's application lists every topic with its messages, and plots what it is asked to.
#[test]
fn logs_open_in_foxglove_with_plots() {
    let browser = found(&["chromium", "chromium-browser", "google-chrome"], "chromium");
    let flights = [
        (&MK2, "/vehicle/truth3d.height_m", "/computer/frame.output.gimbal_rad[0]"),
        (&DISPERSED, "/vehicle/truth3d.height_m", "/computer/frame.output.gimbal_rad[1]"),
    ];
    for (flight, height, gimbal) in flights {
        let picture = flight.beside("foxglove.png");
        let mut open = FOXGLOVE.node();
        open.arg(file("readers/open_in_foxglove.mjs")).args([&browser, &flight.log]);
        open.args([height, gimbal]).arg(&picture);
        let shown: serde_json::Value = serde_json::from_str(&output_of(&mut open)).unwrap();
        let words = shown["words"].as_str().unwrap();
        for channel in info(&flight.log).unwrap().channels {
            let listed = format!("{}\n{}\n{}\n", channel.topic, channel.schema, grouped(channel.messages));
            assert!(words.contains(&listed), "{listed} is not in\n{words}");
        }
        let drawn: Vec<u64> =
            shown["pixels"].as_array().unwrap().iter().filter_map(serde_json::Value::as_u64).collect();
        assert!(drawn.len() == 2 && drawn.iter().all(|pixels| *pixels > 300), "{shown}");
        assert_eq!(shown["crashes"].as_array().unwrap().len(), 0, "{shown}");
    }
}

/// A number as Foxglove writes it, with commas between thousands.
fn grouped(count: u64) -> String {
    if count < 1000 { count.to_string() } else { format!("{},{:03}", grouped(count / 1000), count % 1000) }
}

#[test]
fn logs_pass_rerun_mcap_check() {
    for log in LOGS.iter() {
        let checked = output_of(RERUN.program("rerun").args(["mcap", "check"]).arg(log));
        let accepted = |line: &str| line.starts_with("ok ") && line.contains("/vehicle/truth3d");
        assert!(checked.lines().any(accepted), "{checked}");
        assert!(!checked.lines().any(|line| line.starts_with("error")), "{checked}");
    }
}

#[test]
fn a_table_is_read_by_pandas_polars_and_pyarrow() {
    let check = |log: &Path, directory: PathBuf, table: &str, rows: usize, values: &[(&str, f64)]| {
        let mut opened = FlightLog::open(log).unwrap();
        let files = export_tables(&mut opened, &directory).unwrap();
        let path = directory.join(table);
        let columns = files.iter().find(|file| file.path == path).unwrap().columns;
        for (column, value) in values {
            let read = output_of(READERS.python().arg(file("readers/read_tables.py")).arg(&path).arg(column));
            for reader in ["pandas", "polars", "pyarrow"] {
                let line = format!("{reader} {rows} {columns} {}\n", hex(*value));
                assert!(read.contains(&line), "{line} is not in\n{read}");
            }
        }
    };
    let recording = MK2.recording();
    let last = recording.world.last().unwrap();
    let values =
        [("state.position_m.y", last.state.position_m.y), ("fins_actual_2_rad", last.fins_actual_rad[1])];
    check(&MK2.log, MK2.beside("tables"), "vehicle_truth3d.csv", recording.world.len(), &values);
    let recording = Recording::open(&LANDED.log).unwrap();
    let last = recording.world.last().unwrap();
    let values = [("state.position_m.x", last.state.position_m.x), ("height_m", last.height_m)];
    check(&LANDED.log, LANDED.beside("tables"), "vehicle_truth3d.csv", recording.world.len(), &values);
}

#[test]
fn a_tlog_is_read_by_pymavlink() {
    let path = WITH_FRAMES.beside("flight.tlog");
    let mut log = FlightLog::open(&WITH_FRAMES.log).unwrap();
    let mut writer = TlogWriter::new(std::fs::File::create(&path).unwrap(), 0);
    while let Some(stamped) = log.next_entry().unwrap() {
        if stamped.entry == Entry::RawFrame {
            let (link, bytes) = (String::new(), stamped.data);
            let frame = RawFrame { direction: Direction::Rx, endpoint: "ground", link, bytes };
            writer.write(&Record::RawFrame(frame), stamped.log_time_ns).unwrap();
        }
    }
    writer.flush().unwrap();
    let mut command = READERS.python();
    let read = output_of(command.arg(file("readers/read_tlog.py")).arg(&path).env("MAVLINK20", "1"));
    for name in ["HEARTBEAT", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED"] {
        let line = read.lines().find(|line| line.starts_with(name)).unwrap();
        let count: u32 = line.rsplit(' ').next().unwrap().parse().unwrap();
        assert!(count >= 10, "{read}");
    }
}
