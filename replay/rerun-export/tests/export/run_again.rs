//! Tests what running the controller again adds: paths that are not in the log, and decisions next to the recorded
//! ones.

use std::path::Path;

use flight::rules::phase::Phase;
use protocol::log::record::Record;
use protocol::log::writer::LogWriter;
use replay_rerun::{Overwrite, entity, export_file};

use crate::flown::MK2;
use crate::logs::first_frames;
use crate::read_back::Recording;

fn exported(log: &Path, rrd: &Path) -> Recording {
    export_file(log, rrd, Overwrite::Always).unwrap();
    Recording::read(rrd)
}

#[test]
fn a_flight_from_apogee_has_its_planned_paths() {
    let recording = exported(&MK2.log, &MK2.beside("paths.rrd"));
    let log = MK2.recording();
    let burning = log.frames.iter().filter(|tick| tick.output.phase == u32::from(Phase::Powered.index()));
    let most = burning.filter(|tick| tick.input.frame.is_multiple_of(10)).count();
    let paths = recording.rows(entity::PREDICTED);
    assert!(20 < paths && paths <= most + 2, "{paths} of {most}");
    assert_eq!(recording.rows(entity::PREDICTED_TOUCHDOWN), paths);
    assert!(recording.is_static(entity::FIRST_PLAN));
    // All but the one that clears the last path when the plan is finished.
    let ticks = recording.times(entity::PREDICTED, entity::TIMELINE_TICK);
    assert!(ticks.iter().rev().skip(1).all(|tick| tick % 10 == 0), "{ticks:?}");
    assert!(recording.rows("plots/solve_time_ms/controller") == log.timings.len());
}

#[test]
fn repeated_decisions_are_plotted_with_the_recorded_ones() {
    let recording = exported(&MK2.log, &MK2.beside("again.rrd"));
    let frames = MK2.recording().frames.len();
    for path in
        ["plots/gimbal_pitch_deg/replayed", "plots/gimbal_yaw_deg/replayed", "plots/fins_mean_deg/replayed"]
    {
        assert_eq!(recording.rows(path), frames, "{path}");
    }
    assert_eq!(recording.rows(entity::LEVEL_REPLAYED), recording.rows(entity::LEVEL));
    assert!(recording.rows(entity::LEVEL) > 0);
    assert_eq!(recording.rows(entity::REPLAY), 0, "nothing differs");
}

/// A record that differs from the controller's decision, followed by lost frames.
#[test]
fn the_text_says_where_the_rerun_differs_and_ends() {
    let path = MK2.beside("forged.mcap");
    let (header, start, frames) = first_frames(40);
    let mut writer = LogWriter::new(std::fs::File::create(&path).unwrap(), &header).unwrap();
    writer.write(&Record::ComputerStart(Box::new(start)), 0).unwrap();
    for mut tick in frames {
        if tick.input.frame == 20 {
            tick.output.fins_rad[0] += 0.1;
        }
        if tick.input.frame == 30 {
            // The file already exists.
            tick.input.frame = 29;
        }
        let time_ns = (tick.input.time_s * 1e9).round() as u64;
        writer.write(&Record::ComputerFrame(Box::new(tick)), time_ns).unwrap();
    }
    writer.finish().unwrap();
    let recording = exported(&path, &MK2.beside("forged.rrd"));
    assert_eq!(recording.rows(entity::REPLAY), 2);
    assert_eq!(recording.times(entity::REPLAY, entity::TIMELINE_TICK), [20, 29]);
    assert_eq!(recording.rows("plots/fins_mean_deg/replayed"), 29);
}
