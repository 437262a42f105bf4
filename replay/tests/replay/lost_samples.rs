//! Tests comparisons in which one flight has lost records.

use std::path::{Path, PathBuf};

use protocol::log::record::{TOPIC_COMPUTER_FRAME, TOPIC_TRUTH_SAMPLE};

use crate::command_line::{data, replay, run};
use crate::flown::COMPLETE;
use crate::from_apogee::LANDED;
use crate::simulated::MK2;
use crate::tampered::Held;

/// The log with half of its frames and two thirds of the truth left out: every other frame, first
/// the even and then the odd ones of 40, because a fix comes every 40 frames.
fn thinned(log: &Path, directory: &tempfile::TempDir) -> PathBuf {
    let mut held = Held::read(log);
    let (mut frames, mut truths, mut all_frames) = (0, 0, 0);
    held.retain(|message| {
        all_frames += usize::from(message.topic == TOPIC_COMPUTER_FRAME);
        true
    });
    held.retain(|message| match message.topic.as_str() {
        TOPIC_COMPUTER_FRAME => {
            frames += 1;
            // The last one says that the flight is over.
            let left = all_frames - frames;
            (left + left / 40) % 2 == 0
        }
        TOPIC_TRUTH_SAMPLE => {
            truths += 1;
            truths % 3 == 1
        }
        _ => true,
    });
    let path = directory.path().join("thinned.mcap");
    held.write(&path);
    path
}

#[test]
fn a_flight_that_lost_half_its_frames_is_not_the_same() {
    let directory = tempfile::tempdir().unwrap();
    for log in [&MK2.log, &LANDED.log] {
        let truth = "vehicle_truth3d";
        let (code, stdout, _) = run(replay("compare", log).arg(log));
        assert_eq!(code, 0, "{stdout}");
        let thinned = thinned(log, &directory);
        for (one, other) in [(log, &thinned), (&thinned, log)] {
            let (code, found) = data(replay("compare", one).arg(other));
            let failures = found[0]["failures"].to_string();
            for table in [truth, "computer_frame"] {
                let words = format!("samples of {table} are missing: ");
                assert!(code == 3 && failures.contains(&words), "{failures}");
            }
            let signals = found[0]["signals"].as_array().unwrap();
            let of_truth =
                |signal: &&serde_json::Value| signal["signal"].as_str().unwrap().starts_with(truth);
            let samples = &signals.iter().find(of_truth).unwrap()["samples_of"];
            let [ours, theirs] = [0, 1].map(|of| samples[of].as_f64().unwrap());
            assert!((ours.min(theirs) / ours.max(theirs) - 1.0 / 3.0).abs() < 0.02, "{samples}");
        }
    }
}

/// A signal that one flight has lost altogether.
#[test]
fn a_lost_topic_does_not_pass() {
    let directory = tempfile::tempdir().unwrap();
    let mut held = Held::read(&MK2.log);
    held.retain(|message| message.topic != TOPIC_TRUTH_SAMPLE);
    let path = directory.path().join("no-truth.mcap");
    held.write(&path);
    for (a, b, word) in [(&MK2.log, &path, "missing"), (&path, &MK2.log, "added")] {
        let (code, found) = data(replay("compare", a).arg(b));
        assert!(code == 3 && found[0][word].as_array().unwrap().len() > 10, "{found}");
    }
}

/// Two logs with the same damage agree in everything that could be read, but that is not the whole
/// flight.
#[test]
fn a_damaged_log_does_not_pass() {
    let directory = tempfile::tempdir().unwrap();
    let (at, _) = COMPLETE.synced[6];
    let path = directory.path().join("cut.mcap");
    std::fs::write(&path, &COMPLETE.bytes[..usize::try_from(at).unwrap() + 5]).unwrap();
    let (code, found) = data(replay("compare", &path).arg(&path));
    assert!(code == 3 && found[0]["failures"][0].as_str().unwrap().contains("is damaged"), "{found}");
}
