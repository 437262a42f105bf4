//! Tests the campaign's command line, and that a logged flight can be flown again from its log alone.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Output};

use avionics::log::frame::{input_from_log, output_to_log};
use avionics::log::logged::state_from_log;
use flight::computer::Computer;
use prost::Message as _;
use protocol::log::computer_v1::{ComputerFrame, ComputerStart};
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{ATTACHMENT_PROFILE, TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START};

fn campaign(directory: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_onboard-sim");
    Command::new(program).current_dir(directory).arg("campaign").args(arguments).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_campaign_without_a_flight_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let refused = campaign(directory.path(), &["--flights", "0", "--out", "c"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("0 is not in 1.."), "{}", stderr(&refused));
    assert!(!directory.path().join("c").exists());
}

#[test]
fn a_file_that_has_the_name_of_the_lock_keeps_its_content() {
    let directory = tempfile::tempdir().unwrap();
    let lock = directory.path().join("lock");
    fs::write(&lock, "notes").unwrap();
    let flown = campaign(directory.path(), &["--flights", "1", "--out", "."]);
    assert_eq!(flown.status.code(), Some(0), "{}", stderr(&flown));
    assert_eq!(fs::read_to_string(lock).unwrap(), "notes");
}

/// With sensors, a fault that affects the estimator, and a restart in the middle.
#[test]
fn a_logged_flight_flies_again_bit_for_bit() {
    let directory = tempfile::tempdir().unwrap();
    let flown = campaign(
        directory.path(),
        &["--only", "3", "--out", "k.mcap", "--fault", "gnss-out@6", "--fault", "reboot:0.1@descent+2"],
    );
    assert!(matches!(flown.status.code(), Some(0 | 3)), "{}", stderr(&flown));

    let mut reader = LogReader::new(File::open(directory.path().join("k.mcap")).unwrap());
    let (mut toml, mut start, mut frames) = (None, None, Vec::new());
    while let Some(item) = reader.next_item().unwrap() {
        match item {
            LogItem::Attachment { name, data } if name == ATTACHMENT_PROFILE => {
                toml = Some(String::from_utf8(data).unwrap());
            }
            LogItem::Message { channel_id, data, .. } => {
                let topic = &reader.channel(channel_id).unwrap().topic;
                if topic == TOPIC_COMPUTER_START {
                    start = Some(ComputerStart::decode(data.as_slice()).unwrap());
                } else if topic == TOPIC_COMPUTER_FRAME {
                    frames.push(ComputerFrame::decode(data.as_slice()).unwrap());
                }
            }
            _ => {}
        }
    }
    assert_eq!(reader.damage(), None);
    assert!(frames.len() > 2000, "{} frames", frames.len());

    let (mission, start) =
        (flight::vehicles::mission::from_toml(&toml.unwrap(), "log").unwrap(), start.unwrap());
    let believed = state_from_log(&start.believed);
    let mut computer = Computer::at_power_up(&mission, &believed).released(0);
    let (mut expected_frame, mut restarts) = (1, 0);
    for frame in &frames {
        let number = frame.input.frame;
        if number > expected_frame {
            // The computer was dead and came back at the end of the frame before this one.
            computer.restart((number - 1) as f64 * 5.0 * 1e-3);
            restarts += 1;
        }
        let input = input_from_log(&frame.input).unwrap();
        let output = computer.step(&input.input());
        assert_eq!(output_to_log(&output, &computer), frame.output, "frame {number}");
        assert_eq!(computer.digest(), frame.state_digest, "frame {number}");
        expected_frame = number + 1;
    }
    assert_eq!(restarts, 1);
}

#[test]
fn a_wrong_request_is_refused_with_the_reason() {
    let directory = tempfile::tempdir().unwrap();
    for (arguments, words) in [
        (&["--out", "x", "--dispersion", "windy"][..], "neither a built-in set of dispersions"),
        (&["--out", "x", "--mission", "mk9"], "neither a built-in mission (mk2"),
        (&["--out", "x", "--shard", "3/2"], "I/N"),
        (&["--out", "x", "--fault", "gnss@5"], "no fault is named"),
        (&["--only", "1", "--jobs", "2"], "cannot be used with"),
        (&[], "--out"),
        (&["merge", "nowhere", "--out", "x"], "nowhere"),
    ] {
        let refused = campaign(directory.path(), arguments);
        assert!(!refused.status.success() && stderr(&refused).contains(words), "{}", stderr(&refused));
    }
    let scenario = "name = \"dark\"\nfaults = [\"no-light@0\"]\nexpected = \"inhibit\"";
    fs::write(directory.path().join("dark.toml"), scenario).unwrap();
    let dark = campaign(directory.path(), &["--only", "0", "--scenario", "dark.toml"]);
    assert!(String::from_utf8_lossy(&dark.stdout).contains("expected to inhibit: it did"), "{dark:?}");
    assert_eq!(dark.status.code(), Some(0));
}
