//! Tests that a strict verification passes the whole log of a flight and nothing else: whatever is
//! changed, cut, left out, exchanged, repeated or taken from another flight, although every
//! checksum is right.

use std::path::Path;
use std::sync::LazyLock;

use flight::vehicle::mission::StartPoint;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::record::{
    METADATA_RUN, METADATA_SCHEMA, TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START, TOPIC_ESTIMATE, TOPIC_VERDICT,
};
use protocol::log::v1::LandingVerdict;
use replay::info::info;
use replay::recover::{Recovered, recover};
use replay::verify::{Verification, VerifyReport, verify, verify_strictly};

use crate::command_line::{replay, run};
use crate::flown::only;
use crate::from_power_up::{Flown, armed_and_started};
use crate::tampered::Held;

/// A whole flight from the pad, and another one.
static PAD: LazyLock<[Held; 2]> = LazyLock::new(|| {
    [(StartPoint::Pad, 2_600), (StartPoint::Apogee, 1_200)]
        .map(|(start, at)| Held::read(&Flown::from(start, &armed_and_started(at), &[]).log()))
});

fn pad() -> Held {
    PAD[0].clone()
}

fn on_disk<T>(held: &Held, check: impl FnOnce(&Path) -> T) -> T {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("flight.mcap");
    held.write(&path);
    check(&path)
}

fn strictly(held: &Held) -> VerifyReport {
    on_disk(held, |path| only(verify_strictly(path).unwrap()))
}

fn loosely(held: &Held) -> VerifyReport {
    on_disk(held, |path| only(verify(path).unwrap()))
}

fn passes(report: &VerifyReport) -> bool {
    report.outcome == Verification::Identical && report.is_all_compared()
}

/// T+ of the frame in which it comes back has the same bits whenever the flight was released.
#[test]
fn a_computer_that_restarts_in_flight_is_flown_again_bit_for_bit() {
    for (fault, release) in
        [("reboot:1.5@descent", 2_600), ("reboot:1.5@descent", 2_611), ("reboot:0.7@coast+1", 2_605)]
    {
        let flown = Flown::from(StartPoint::Pad, &armed_and_started(release), &[fault]);
        let report = only(verify_strictly(&flown.log()).unwrap());
        assert!(passes(&report), "{fault}: {report:?}");
    }
}

/// A sensor that is silent or broken says NaN, and a lidar that is disturbed a range below zero.
#[test]
fn a_sensor_that_dies_is_no_impossible_input() {
    for fault in
        ["gyro-out@descent", "accelerometer-nan@powered", "gnss-nan@descent", "lidar-noise:20@descent"]
    {
        let flown = Flown::from(StartPoint::Apogee, &armed_and_started(1_200), &[fault]);
        let report = only(verify_strictly(&flown.log()).unwrap());
        assert!(passes(&report), "{fault}: {report:?}");
    }
}

#[test]
fn sensor_state_from_the_pad_is_not_recorded_and_that_is_reported() {
    let flown = Flown::from(StartPoint::Pad, &armed_and_started(2_600), &["gnss-stuck@pad"]);
    let report = only(verify_strictly(&flown.log()).unwrap());
    assert_eq!((report.outcome, report.is_all_compared()), (Verification::Identical, false), "{report:?}");
    let why = report.part("metadata").and_then(|part| part.why.clone()).unwrap_or_default();
    assert!(why.starts_with("cannot be flown again: ") && why.contains("gnss-stuck@pad"), "{why}");
}

/// Changes the frames that are wanted.
fn with_frames(mut change: impl FnMut(u64, &mut ComputerFrame)) -> Held {
    let mut held = pad();
    for message in held.messages.iter_mut().filter(|message| message.is_frame()) {
        let mut frame = ComputerFrame::decode(message.data.as_slice()).unwrap();
        change(frame.input.frame, &mut frame);
        message.data = frame.encode_to_vec();
    }
    held
}

#[test]
fn a_complete_flight_passes_and_lists_what_was_compared() {
    let report = strictly(&pad());
    assert!(passes(&report), "{report:?}");
    for (name, least) in
        [("inputs", 5_000), ("outputs", 5_000), ("digests", 5_000), ("estimates", 2_500), ("starts", 2)]
    {
        let part = report.part(name).unwrap();
        assert!(part.compared >= least && part.compared == part.recorded, "{part:?}");
    }
    assert_eq!(report.part("verdict").map(|part| part.compared), Some(1));
    let truth = report.part("truth").unwrap();
    assert!(truth.compared == 0 && truth.recorded > 0 && !truth.follows, "{truth:?}");
    // Without --strict the verdict is not compared, and the answer states it.
    let report = loosely(&pad());
    assert_eq!((report.outcome, report.is_all_compared()), (Verification::Identical, false));
}

#[test]
fn another_version_of_the_contents_is_no_excuse() {
    for version in ["0", "2", "99", ""] {
        let mut held = with_frames(|_, frame| frame.state_digest = 0);
        held.metadata(METADATA_SCHEMA).insert("version".to_owned(), version.to_owned());
        on_disk(&held, |path| {
            let (code, stdout, _) = run(replay("verify", path).arg("--strict"));
            assert_ne!(code, 0, "{version}: {stdout}");
        });
        let mut held = pad();
        held.metadata(METADATA_SCHEMA).insert("version".to_owned(), version.to_owned());
        assert_eq!(loosely(&held).outcome, Verification::NotReplayable);
    }
}

/// Its frames begin at the release, so what the computer remembers of its pad is unknown, and
/// nothing differs.
#[test]
fn a_flight_without_its_pad_is_incomplete_and_no_divergence() {
    let mut held = pad();
    let released = |data: &[u8]| {
        protocol::log::computer_v1::ComputerStart::decode(data).is_ok_and(|start| start.released)
    };
    let begins = held
        .messages
        .iter()
        .position(|message| message.topic == TOPIC_COMPUTER_START && released(&message.data))
        .unwrap();
    held.messages.drain(..begins);
    held.renumber();
    let report = loosely(&held);
    assert_eq!((report.outcome, report.frames_different), (Verification::IdenticalReadablePart, 0));
    let digests = report.part("digests").unwrap();
    assert!(digests.compared == 0 && digests.why.is_some(), "{digests:?}");
    assert!(!passes(&strictly(&held)));
}

#[test]
fn a_verdict_that_contradicts_itself_is_damage() {
    let changes: [fn(&mut LandingVerdict); 6] = [
        |verdict| verdict.envelope[1].value = f64::NAN,
        |verdict| verdict.landing.stands = !verdict.landing.stands,
        |verdict| verdict.landing.upright = !verdict.landing.upright,
        |verdict| verdict.landing.table_2 = !verdict.landing.table_2,
        |verdict| verdict.envelope.clear(),
        |verdict| verdict.envelope[0].value += 1e6,
    ];
    for change in changes {
        let mut held = pad();
        let message = held.messages.iter_mut().find(|message| message.topic == TOPIC_VERDICT).unwrap();
        let mut verdict = LandingVerdict::decode(message.data.as_slice()).unwrap();
        change(&mut verdict);
        message.data = verdict.encode_to_vec();
        on_disk(&held, |path| {
            let found = info(path).unwrap();
            assert_eq!(found.verdict, None);
            assert!(found.completeness.damage.unwrap().contains("contradicts itself"));
        });
        assert_ne!(loosely(&held).outcome, Verification::Identical);
    }
}

#[test]
fn inputs_that_cannot_be_are_named() {
    type Change = fn(&mut ComputerFrame);
    let flies = pad().messages.iter().filter(|message| message.is_frame()).count() as u64 - 1_500;
    let changes: [(&str, Change); 7] = [
        ("battery", |frame| frame.input.battery_v = Some(1.5e20)),
        ("battery goes from", |frame| {
            frame.input.battery_v = frame.input.battery_v.map(|battery_v| battery_v + 2.0);
        }),
        ("space", |frame| frame.input.log.space_bytes ^= 1 << 54),
        ("the contact has ended", |frame| frame.input.contact = true),
        ("time", |frame| frame.input.time_s = f64::NAN),
        ("pin", |frame| frame.input.pin_out = !frame.input.pin_out),
        ("lidar", |frame| {
            frame.input.measured.lidar_range_m = Some(3e307);
        }),
    ];
    for (name, change) in changes {
        let report = loosely(&with_frames(|number, frame| {
            if number == flies {
                change(frame);
            }
        }));
        let inputs = report.part("inputs").unwrap();
        let why = inputs.why.clone().unwrap_or_default();
        // What begins or ends is seen in this frame or in the next one.
        let places = [flies, flies + 1].map(|number| format!("frame {number}:"));
        let placed = places.iter().any(|place| why.starts_with(place));
        assert!(why.contains(name) && placed, "{name}: {report:?}");
        assert!(matches!(report.outcome, Verification::Impossible | Verification::Diverged), "{name}");
    }
}

#[test]
fn frames_missing_behind_the_contact_are_missed() {
    for missing in [1, 10, 300] {
        let mut held = pad();
        let over = held
            .messages
            .iter()
            .position(|message| {
                message.is_frame() && ComputerFrame::decode(message.data.as_slice()).unwrap().output.over
            })
            .unwrap();
        let last = held.messages[..=over]
            .iter()
            .enumerate()
            .rev()
            .filter(|(_, message)| message.is_frame())
            .nth(missing - 1)
            .unwrap()
            .0;
        let mut place = 0;
        held.retain(|message| {
            place += 1;
            place <= last || !(message.is_frame() || message.topic == TOPIC_ESTIMATE)
        });
        let report = loosely(&held);
        assert_eq!(report.outcome, Verification::IdenticalReadablePart, "{missing}: {:?}", report.parts);
        assert!(report.cut.is_some());
    }
}

/// The vehicle gives out such a log: its end says nothing about how much there was.
#[test]
fn without_a_summary_the_answer_states_what_is_unknown() {
    on_disk(&PAD[1], |path| {
        let whole = std::fs::read(path).unwrap();
        let chunks = mcap::Summary::read(&whole).unwrap().unwrap().chunk_indexes;
        let ends = chunks.iter().map(|chunk| chunk.chunk_start_offset + chunk.chunk_length).max().unwrap();
        let bytes = [&whole[..usize::try_from(ends).unwrap()], &protocol::log::writer::ending()].concat();
        std::fs::write(path, bytes).unwrap();
        assert!(!only(verify(path).unwrap()).counted);
        for question in ["verify", "info"] {
            let (_, stdout, _) = run(&mut replay(question, path));
            assert!(stdout.contains("can be known") || stdout.contains("cannot be known"), "{stdout}");
        }
    });
}

/// Whatever a log holds, nothing of it steers the terminal.
#[test]
fn control_characters_of_a_log_are_not_shown() {
    let mut held = PAD[1].clone();
    held.metadata(METADATA_RUN).insert("faults".to_owned(), "\u{1b}[2J\u{9b}31m".to_owned());
    held.metadata(METADATA_RUN).insert("flight".to_owned(), "\u{1b}]0;x\u{7}".to_owned());
    let named = held.messages.iter_mut().find(|message| message.topic == TOPIC_ESTIMATE).unwrap();
    named.topic = "/a\u{1b}[2J".to_owned();
    on_disk(&held, |path| {
        for arguments in
            [&["info"][..], &["info", "--json"], &["verify"], &["evaluate"], &["refly"], &["compare"]]
        {
            let mut command = replay(arguments[0], path);
            if arguments == ["compare"] {
                command.arg(path);
            }
            let (_, stdout, stderr) = run(command.args(&arguments[1..]));
            let steers = |text: &str| text.chars().any(|letter| letter.is_control() && letter != '\n');
            assert!(!steers(&stdout) && !steers(&stderr), "{arguments:?}: {stdout}{stderr}");
        }
    });
}

#[derive(Debug, Clone, Copy)]
enum Harm {
    /// A bit of a start, an estimate, an output, a digest or a verdict.
    Flipped,
    /// A bit of what the run facts or the version of the contents say.
    OtherFacts,
    Cut,
    Dropped,
    Swapped,
    Repeated,
    /// A stretch of another flight.
    Spliced,
    /// A topic has another name.
    Renamed,
    /// A record is far too long.
    Inflated,
}

/// Where the bytes of a message that follow from the inputs begin.
fn follows_from(topic: &str, data: &[u8]) -> Option<usize> {
    match topic {
        TOPIC_COMPUTER_FRAME => {
            let frame = ComputerFrame::decode(data).unwrap();
            // The input comes first, with its tag and its length.
            Some(1 + prost::length_delimiter_len(frame.input.encoded_len()) + frame.input.encoded_len())
        }
        TOPIC_COMPUTER_START | TOPIC_ESTIMATE | TOPIC_VERDICT => Some(0),
        _ => None,
    }
}

fn harmed(harm: Harm, place: usize, count: usize) -> Held {
    let mut held = pad();
    let compared: Vec<usize> = (0..held.messages.len())
        .filter(|at| follows_from(&held.messages[*at].topic, &held.messages[*at].data).is_some())
        .collect();
    let at = compared[place % compared.len()];
    let other = compared[(place + count) % compared.len()];
    match harm {
        Harm::Flipped => {
            // Each topic as often as any other.
            let topics = [TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START, TOPIC_ESTIMATE, TOPIC_VERDICT];
            let of_it: Vec<usize> = compared
                .into_iter()
                .filter(|at| held.messages[*at].topic == topics[place % topics.len()])
                .collect();
            let message = &mut held.messages[of_it[place % of_it.len()]];
            let from = follows_from(&message.topic, &message.data).unwrap();
            let byte = from + place % (message.data.len() - from);
            message.data[byte] ^= 1 << (count % 8);
        }
        Harm::OtherFacts => {
            let facts = ["seed", "flight", "profile", "version"];
            let fact = facts[place % facts.len()];
            let name = if fact == "version" { METADATA_SCHEMA } else { METADATA_RUN };
            let value = held.metadata(name).get_mut(fact).unwrap();
            // The lowest bits of a letter or a digit make another one.
            let mut bytes = value.clone().into_bytes();
            let byte = count % bytes.len();
            bytes[byte] ^= 1;
            *value = String::from_utf8(bytes).unwrap();
        }
        Harm::Cut => held.messages.truncate(compared[compared.len() - 1 - place % 3_000]),
        Harm::Dropped => drop(held.messages.drain(at..(at + count).min(held.messages.len()))),
        Harm::Swapped => held.messages.swap(at, other),
        Harm::Repeated => {
            let again = held.messages[at].clone();
            held.messages.insert(at, again);
        }
        Harm::Spliced => {
            let stretch: Vec<_> = PAD[1].messages.iter().skip(place % 5_000).take(count).cloned().collect();
            held.messages.splice(at..(at + count).min(held.messages.len()), stretch);
        }
        Harm::Renamed => {
            let topic = held.messages[at].topic.clone();
            for message in held.messages.iter_mut().filter(|message| message.topic == topic) {
                message.topic.push('x');
            }
        }
        Harm::Inflated => {
            let data = &mut held.messages[at].data;
            data.resize(data.len() + 2_000_000, 0x55);
        }
    }
    if count.is_multiple_of(2) {
        held.renumber();
    }
    held
}

/// What a log holds, whatever its file looks like.
fn messages_in(held: &Held) -> Vec<(&str, u64, &[u8])> {
    let mut messages: Vec<_> = held
        .messages
        .iter()
        .map(|message| (message.topic.as_str(), message.log_time_ns, message.data.as_slice()))
        .collect();
    messages.sort_unstable();
    messages
}

/// Every checksum of these logs is right, so that only their contents show that they are
/// incomplete: strictly none passes, and a recovery recovers exactly the remaining messages.
fn tamper_in_ways(cases: u32) {
    let mut runner = TestRunner::new(ProptestConfig { cases, ..ProptestConfig::default() });
    let harms = vec![
        Harm::Flipped,
        Harm::Flipped,
        Harm::OtherFacts,
        Harm::Cut,
        Harm::Dropped,
        Harm::Swapped,
        Harm::Repeated,
        Harm::Spliced,
        Harm::Renamed,
        Harm::Inflated,
    ];
    let ways = (prop::sample::select(harms), 0_usize..1_000_000, 1_usize..400);
    let ended = runner.run(&ways, |(harm, place, count)| {
        let held = harmed(harm, place, count);
        let unchanged = held
            .messages
            .iter()
            .map(|message| (&message.topic, &message.data))
            .eq(PAD[0].messages.iter().map(|message| (&message.topic, &message.data)));
        let facts = !matches!(harm, Harm::OtherFacts);
        on_disk(&held, |path| {
            let passed = verify_strictly(path).is_ok_and(|reports| reports.iter().all(passes));
            prop_assert!(!passed || (unchanged && facts));
            let recovered = path.with_file_name("recovered.mcap");
            let recovery = recover(path, &recovered).unwrap();
            let Recovered { out_of_order, missing, .. } = recovery.recovered;
            prop_assert!(recovery.fault().is_none() || out_of_order || missing > 0, "{recovery:?}");
            let kept = Held::read(&recovered);
            prop_assert_eq!(messages_in(&kept), messages_in(&held));
            Ok(())
        })
    });
    ended.unwrap();
}

#[test]
fn strict_passes_only_complete_logs() {
    tamper_in_ways(32);
}

#[test]
#[ignore = "takes ten minutes: a thousand ways instead of 32"]
fn strict_passes_only_complete_logs_in_a_thousand_ways() {
    tamper_in_ways(1_000);
}
