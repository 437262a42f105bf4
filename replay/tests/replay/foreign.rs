//! Tests files that are not flight logs: the message says what was found and what would be
//! accepted.

use std::collections::BTreeMap;
use std::io::Cursor;

use replay::log::LogError;

use crate::flown::verify_bytes;

fn refusal(bytes: &[u8]) -> String {
    verify_bytes(bytes).unwrap_err().to_string()
}

/// An MCAP file of some other program.
pub(crate) fn foreign_mcap(topic: &str) -> Vec<u8> {
    let mut writer = mcap::WriteOptions::new().library("robot").create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("robot.Pose", "protobuf", b"something").unwrap();
    let channel = writer.add_channel(schema, topic, "protobuf", &BTreeMap::new()).unwrap();
    let header =
        mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, &[1, 2, 3]).unwrap();
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn other_kinds_of_files_are_refused_by_their_first_bytes() {
    assert_eq!(refusal(b""), "test.mcap: is empty; a flight log is an MCAP file");
    assert_eq!(
        refusal(b"\x89PNG\r\n\x1a\n and so on"),
        "test.mcap: is not a flight log: it begins with 89 50 4e 47 0d 0a 1a 0a, \
         and an MCAP file begins with 89 4d 43 41 50 30 0d 0a; `ground --replay` shows a .tlog"
    );
    assert!(matches!(verify_bytes(b"\x89MCAP"), Err(LogError::NotMcap { .. })));
}

#[test]
fn an_mcap_file_of_another_program_is_refused_by_its_topics() {
    let reason = refusal(&foreign_mcap("/pose"));
    for words in ["written by \"robot\"", "the topics /pose", "none of /computer/frame"] {
        assert!(reason.contains(words), "{reason}");
    }
    // Our topic's name alone does not make it ours.
    assert!(matches!(verify_bytes(&foreign_mcap("/computer/frame")), Err(LogError::Foreign { .. })));
}

#[test]
fn the_start_of_a_log_alone_is_refused() {
    assert!(matches!(verify_bytes(b"\x89MCAP0\r\n"), Err(LogError::NothingReadable { .. })));
}
