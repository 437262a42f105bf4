//! Tests logs whose messages are not in order of time, which MCAP allows: they are refused, and
//! recovered.

use std::path::Path;

use replay::recover::recover;
use replay::verify::{Verification, verify};

use crate::command_line::{replay, run};
use crate::flown::only;
use crate::from_apogee::LANDED;
use crate::simulated::{MK2, WITH_FRAMES};
use crate::tampered::{Held, LogMessage};

/// The orders that other programs write: one topic after the other, from either end; a later part
/// first; and equal times from the last topic to the first.
fn in_other_orders(held: &Held) -> [Held; 4] {
    let [mut by_topic, mut from_z, mut second_half_first, mut equal_times] = [(); 4].map(|()| held.clone());
    by_topic.messages.sort_by(|a, b| a.topic.cmp(&b.topic));
    from_z.messages.sort_by(|a, b| b.topic.cmp(&a.topic));
    let half = held.messages.len() / 2;
    second_half_first.messages.rotate_left(half);
    equal_times.messages.sort_by(|a, b| (a.log_time_ns, &b.topic).cmp(&(b.log_time_ns, &a.topic)));
    [by_topic, from_z, second_half_first, equal_times]
}

fn assert_refused_as_unordered(log: &Path, directory: &Path) {
    let (page, csv) = (directory.join("page.html"), directory.join("csv"));
    let [page, csv] = [&page, &csv].map(|path| path.to_str().unwrap());
    let questions: [&[&str]; 6] = [
        &["info"],
        &["verify", "--strict"],
        &["evaluate"],
        &["refly"],
        &["report", "--out", page],
        &["export", "--out", csv],
    ];
    for question in questions {
        let (code, stdout, stderr) = run(replay(question[0], log).args(&question[1..]));
        assert_eq!((code, stdout.as_str()), (1, ""), "{question:?}: {stderr}");
        let words = ["is not in order of time", "`replay recover` puts it in order"];
        assert!(words.iter().all(|words| stderr.contains(words)), "{question:?}: {stderr}");
    }
}

#[test]
fn a_log_in_another_order_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("log.mcap");
    for original in [&MK2.log, &LANDED.log, &WITH_FRAMES.log] {
        let held = Held::read(original);
        for other in in_other_orders(&held) {
            other.write(&log);
            assert_refused_as_unordered(&log, directory.path());
        }
    }
}

/// The flight computer's own records are written by one thread: a frame that is late by little is
/// out of order as well.
#[test]
fn a_frame_that_is_a_little_late_is_out_of_order() {
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("log.mcap");
    let mut held = Held::read(&LANDED.log);
    let before = held.messages.len() - 40;
    let late = before + held.messages[before..].iter().position(LogMessage::is_frame).unwrap();
    held.messages[late..late + 12].rotate_left(1);
    held.write(&log);
    assert_refused_as_unordered(&log, directory.path());
}

/// Writers of several threads swap records, which changes nothing.
#[test]
fn records_that_come_a_little_late_are_no_other_order() {
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("log.mcap");
    let mut held = Held::read(&LANDED.log);
    let late = held.messages.iter().position(|message| message.topic == "/events").unwrap();
    let behind = (late + 20).min(held.messages.len() - 1);
    held.messages[late..=behind].rotate_left(1);
    held.write(&log);
    assert_eq!(only(verify(&log).unwrap()).outcome, Verification::Identical);
    let recovery = recover(&log, &directory.path().join("again.mcap")).unwrap();
    assert_eq!(recovery.fault(), None);
}

/// Sorted by time where the numbers of the frames agree with it.
#[test]
fn a_log_in_another_order_is_recovered_in_order() {
    let directory = tempfile::tempdir().unwrap();
    let (log, again) = (directory.path().join("log.mcap"), directory.path().join("again.mcap"));
    let held = Held::read(&MK2.log);
    for (number, other) in in_other_orders(&held).iter().enumerate() {
        other.write(&log);
        let recovery = recover(&log, &again.with_file_name(format!("{number}.mcap"))).unwrap();
        assert!(recovery.fault().unwrap().contains("sorted by time"), "{number}: {recovery:?}");
        assert_eq!(Held::read(&recovery.output).facts(), held.facts(), "{number}");
        assert_eq!(only(verify(&recovery.output).unwrap()).first_divergence, None, "{number}");
    }
}

/// A recorder whose clock is set back in flight: sorted by time, the frames of two stretches would
/// be mixed.
#[test]
fn the_order_of_the_frames_holds_where_a_clock_was_set_back() {
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("log.mcap");
    let mut held = Held::read(&MK2.log);
    let (half, frames) = (held.messages.len() / 2, held.frames() as u64);
    for message in &mut held.messages[half..] {
        message.log_time_ns -= 2_000_000_000;
    }
    held.write(&log);
    let recovery = recover(&log, &directory.path().join("again.mcap")).unwrap();
    assert!(recovery.fault().unwrap().contains("whose order is kept"), "{recovery:?}");
    let report = only(verify(&recovery.output).unwrap());
    assert!(report.first_divergence.is_none() && report.frames_identical == frames, "{report:?}");
}
