//! Logs: what is written is read again, and the log of a killed recorder can be read.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use prost::Message as _;
use protocol::log::reader::{Damage, LogItem, LogReader};
use protocol::log::record::{
    Direction, Event, EventLevel, RawFrame, Record, TOPIC_EVENTS, TOPIC_OPERATOR, TOPIC_RAW_RX,
    TOPIC_TRUTH_SAMPLE,
};
use protocol::log::recorder::{Recorder, RecorderError};
use protocol::log::writer::{LogHeader, LogWriter};
use protocol::log::{flight_v1, v1};

fn header() -> LogHeader {
    LogHeader {
        writer: "test".to_owned(),
        start_unix_ns: 1_700_000_000_000_000_000,
        run: BTreeMap::from([("seed".to_owned(), "7".to_owned())]),
        profile_toml: Some("name = \"x\"".to_owned()),
        ..LogHeader::default()
    }
}

fn operator(k: u64) -> Record {
    Record::OperatorAction(v1::OperatorAction {
        time_s: k as f64,
        kind: "key".to_owned(),
        detail: format!("{k}"),
    })
}

fn written(records: &[Record]) -> Vec<u8> {
    let mut writer = LogWriter::new(Cursor::new(Vec::new()), &header()).unwrap();
    for (k, record) in records.iter().enumerate() {
        writer.write(record, k as u64 * 1_000_000).unwrap();
        if k % 10 == 9 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap().into_inner()
}

struct Contents {
    messages: Vec<(String, Vec<u8>)>,
    metadata: Vec<String>,
    attachments: Vec<String>,
    damage: Option<Damage>,
}

fn read(bytes: &[u8]) -> Contents {
    let mut reader = LogReader::new(bytes);
    let mut contents =
        Contents { messages: Vec::new(), metadata: Vec::new(), attachments: Vec::new(), damage: None };
    while let Some(item) = reader.next_item().unwrap() {
        match item {
            LogItem::Message { channel_id, data, .. } => {
                contents.messages.push((reader.channel(channel_id).unwrap().topic.clone(), data));
            }
            LogItem::Metadata { name, .. } => contents.metadata.push(name),
            LogItem::Attachment { name, .. } => contents.attachments.push(name),
            LogItem::Library(_) | LogItem::DataEnd => {}
        }
    }
    contents.damage = reader.damage().cloned();
    contents
}

#[test]
fn a_complete_log_is_read_as_written() {
    let frame = RawFrame {
        direction: Direction::Rx,
        endpoint: "ground",
        link: "udpin:x:1".to_owned(),
        bytes: vec![0xFD, 1, 2],
    };
    let event = Event { level: EventLevel::Fatal, name: "vehicle".to_owned(), message: "abort".to_owned() };
    let truth = flight_v1::TruthSample { fins_actual_rad: vec![0.5; 4], ..flight_v1::TruthSample::default() };
    let bytes = written(&[
        operator(1),
        Record::RawFrame(frame),
        Record::Event(event),
        Record::TruthSample(Box::new(truth.clone())),
    ]);
    let contents = read(&bytes);
    assert_eq!(contents.damage, None);
    assert_eq!(contents.metadata, ["build", "schema", "run"]);
    assert_eq!(contents.attachments, ["profile.toml", "touchdown.xml"]);
    let topics: Vec<_> = contents.messages.iter().map(|(topic, _)| topic.as_str()).collect();
    assert_eq!(topics, [TOPIC_OPERATOR, TOPIC_RAW_RX, TOPIC_EVENTS, TOPIC_TRUTH_SAMPLE, "/tf"]);
    assert_eq!(contents.messages[1].1, [0xFD, 1, 2]);
    assert_eq!(flight_v1::TruthSample::decode(contents.messages[3].1.as_slice()).unwrap(), truth);
}

/// An encoder may drop a field that equals its default, and -0.0 equals 0.0; our schema must
/// prevent that.
#[test]
fn both_zeros_and_every_nan_survive() {
    for bits in
        [0.0f64.to_bits(), (-0.0f64).to_bits(), f64::NAN.to_bits(), 0x7FF0_0000_0000_0001, u64::MAX, 1]
    {
        let limit = v1::LimitResult { value: f64::from_bits(bits), ..v1::LimitResult::default() };
        let truth = flight_v1::TruthSample {
            fins_actual_rad: vec![f64::from_bits(bits)],
            ..flight_v1::TruthSample::default()
        };
        let limit = v1::LimitResult::decode(limit.encode_to_vec().as_slice()).unwrap();
        let truth = flight_v1::TruthSample::decode(truth.encode_to_vec().as_slice()).unwrap();
        assert_eq!(limit.value.to_bits(), bits);
        assert_eq!(truth.fins_actual_rad[0].to_bits(), bits);
    }
}

#[test]
fn a_cut_log_contains_everything_flushed_before_the_cut() {
    let records: Vec<_> = (0..100).map(operator).collect();
    let bytes = written(&records);
    let whole: Vec<_> = read(&bytes).messages;
    let mut most = 0;
    for cut in 0..bytes.len() {
        let contents = read(&bytes[..cut]);
        assert_eq!(contents.messages[..], whole[..contents.messages.len()], "cut at {cut}");
        assert!(contents.messages.len() >= most, "a longer file contains fewer messages");
        most = contents.messages.len();
        if cut < 8 {
            assert_eq!(contents.damage, Some(Damage::NotMcap), "cut at {cut}");
        }
        if most < 100 {
            assert!(contents.damage.is_some(), "cut at {cut}");
        }
    }
    assert_eq!(most, 100);
}

#[test]
fn other_files_are_reported_as_not_mcap() {
    for foreign in [&b""[..], b"\x89PNG\r\n\x1a\n and more", b"time,altitude\n0,15\n"] {
        let contents = read(foreign);
        assert_eq!(contents.damage, Some(Damage::NotMcap));
        assert!(contents.messages.is_empty());
    }
}

#[test]
fn a_recorder_never_overwrites_and_ends_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flight.mcap");
    let recorder = Recorder::create(&path, false, &header()).unwrap();
    for k in 0..20_000 {
        recorder.record(operator(k), k);
    }
    let other = Recorder::create(&path, false, &header()).unwrap();
    assert_eq!(other.finish().unwrap(), folder.path().join("flight-2.mcap"));
    for device in ["/dev/null", "/dev/stdout"] {
        let refused = Recorder::create(Path::new(device), false, &header());
        assert!(matches!(refused, Err(RecorderError::Create { path, .. }) if path == Path::new(device)));
    }
    assert_eq!(recorder.finish().unwrap(), path);
    recorder.finish().unwrap();
    assert_eq!(recorder.dropped(), 0);
    recorder.try_record(operator(0), 0);
    assert_eq!(recorder.dropped(), 1, "a record after the end counts as dropped");
    let contents = read(&std::fs::read(&path).unwrap());
    assert_eq!((contents.messages.len(), contents.damage), (20_000, None));
}

/// A flipped bit costs a chunk or the rest of the log, but never changes a message, because
/// checksums protect all of them.
#[test]
fn no_flipped_bit_changes_a_message() {
    let records: Vec<_> = (0..12).map(operator).collect();
    let good = written(&records);
    let whole = read(&good);
    assert_eq!((whole.messages.len(), whole.damage), (12, None));
    for place in 0..good.len() {
        for bit in 0..8 {
            let mut bytes = good.clone();
            bytes[place] ^= 1 << bit;
            let found = read(&bytes).messages;
            let changed = found.iter().find(|message| !whole.messages.contains(message));
            assert_eq!(changed, None, "bit {bit} of byte {place}");
        }
    }
}
