//! Tests cutting a log by time and topic, and what of it is still verified.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use replay::cut::{CutError, CutOut, Wanted, cut};
use replay::info::info;
use replay::log::{FlightLog, Recording};
use replay::verify::{Verification, verify};

use crate::command_line::{replay, run};
use crate::flown::only;
use crate::simulated::WITH_FRAMES;

/// A cut of the flight with telemetry.
struct Made {
    _folder: tempfile::TempDir,
    path: PathBuf,
    told: CutOut,
}

fn made(from: Option<&str>, until: Option<&str>, topics: &[&str]) -> Result<Made, CutError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mcap");
    let [from, until] = [from, until].map(|moment| moment.map(|moment| moment.parse().unwrap()));
    let topics = topics.iter().map(|topic| (*topic).to_owned()).collect();
    let told = cut(&WITH_FRAMES.log, &Wanted { from, until, topics }, &path)?;
    Ok(Made { _folder: folder, path, told })
}

/// The time of each message since the first one, s, with its topic.
fn messages(log: &Path) -> Vec<(u64, String)> {
    let mut log = FlightLog::open(log).unwrap();
    let mut found = Vec::new();
    while let Some(stamped) = log.next_entry().unwrap() {
        let topic = log.channel(stamped.channel_id).unwrap().topic.clone();
        found.push((stamped.log_time_ns, topic));
    }
    assert!(log.damage().is_none());
    found
}

#[test]
fn a_span_keeps_what_later_records_hang_on_and_is_verified_to_its_end() {
    let whole = messages(&WITH_FRAMES.log);
    let made = made(Some("POWERED"), Some("TOUCHDOWN"), &[]).unwrap();
    let kept = messages(&made.path);
    assert_eq!(made.told.messages + made.told.left_out, whole.len() as u64);
    assert_eq!(made.told.messages, kept.len() as u64);
    // Every kept message is one of the log, and of the span all are there.
    let first_truth = kept.iter().find(|(_, topic)| topic == "/vehicle/truth3d").unwrap().0;
    let last = kept.iter().map(|(at, _)| *at).max().unwrap();
    let of_the_span = whole.iter().filter(|(at, _)| (first_truth..=last).contains(at)).count() as u64;
    assert_eq!(made.told.messages - made.told.chained, of_the_span);
    let all: BTreeSet<_> = whole.iter().collect();
    assert!(kept.iter().all(|message| all.contains(message)));
    // The frames before it are there, and what the flight computer decided is run again from its power-up.
    assert!(made.told.can_be_verified && made.told.chained > 1_000, "{:?}", made.told);
    let verified = only(verify(&made.path).unwrap());
    assert_eq!(verified.outcome, Verification::IdenticalReadablePart, "it ends before its flight was over");
    let (frames, flown) =
        (Recording::open(&made.path).unwrap().frames, Recording::open(&WITH_FRAMES.log).unwrap().frames);
    assert!(frames.len() < flown.len() && frames[..] == flown[..frames.len()]);
    let described = info(&made.path).unwrap();
    assert!(described.run["cut_from"].contains("from POWERED, until TOUCHDOWN"));
}

#[test]
fn a_log_without_the_frames_says_that_it_cannot_be_verified() {
    let made = made(None, None, &["/mavlink/*", "/events"]).unwrap();
    let topics: BTreeSet<String> = messages(&made.path).into_iter().map(|(_, topic)| topic).collect();
    assert_eq!(topics, BTreeSet::from(["/events", "/mavlink/tx/raw"].map(str::to_owned)));
    assert!(!made.told.can_be_verified && !made.told.has_book);
    assert_eq!(only(verify(&made.path).unwrap()).outcome, Verification::NotReplayable);
    let other = made.path.with_file_name("other.mcap");
    let (code, said, _) = run(replay("cut", &WITH_FRAMES.log).arg(&other).arg("/events"));
    assert_eq!(code, 0);
    assert!(said.contains("`replay verify` CANNOT run it again"), "{said}");
}

#[test]
fn what_cannot_be_cut_is_refused_with_the_reason() {
    let refused = |from, topics: &[&str]| made(from, None, topics).err().unwrap().to_string();
    assert!(refused(Some("BOOST"), &[]).ends_with("has no BOOST"));
    assert!(refused(Some("frame:999999"), &[]).ends_with("has no frame 999999"));
    assert!(
        matches!(made(None, None, &["/nothing"]), Err(CutError::Nothing { topics, .. }) if topics.len() > 3)
    );
    let backwards = made(Some("TOUCHDOWN"), Some("POWERED"), &[]).err().unwrap().to_string();
    assert!(backwards.ends_with("POWERED is before TOUCHDOWN: nothing lies between"), "{backwards}");
    let folder = tempfile::tempdir().unwrap();
    let half = folder.path().join("half.mcap");
    let bytes = std::fs::read(&WITH_FRAMES.log).unwrap();
    std::fs::write(&half, &bytes[..bytes.len() / 2]).unwrap();
    let refused = cut(&half, &Wanted::default(), &folder.path().join("cut.mcap"));
    assert!(matches!(refused, Err(CutError::Damaged { .. })));
}
