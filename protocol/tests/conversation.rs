//! Commands, texts and link statistics, on a simulated clock.

use std::time::Duration;

use proptest::prelude::*;
use protocol::command::{CommandAnswer, CommandEvent, CommandRequest, CommandSender, Resend};
use protocol::dialect::{HEARTBEAT_DATA, MavCmd, MavMessage, MavResult, MavSeverity};
use protocol::frame::{Encoder, Frame};
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::link_stats::LinkStats;
use protocol::text::{Reassembler, chunks, printable};

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const ABORT: MavCmd = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;

fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

fn answer(command: MavCmd, result: MavResult) -> CommandAnswer {
    CommandAnswer { command: command as u16, result: result as u8, detail: 0, target: GROUND }
}

/// Polls for `seconds` without an answer; returns the times of sending and the events.
fn unanswered(resend: Resend, seconds: u64) -> (Vec<u64>, Vec<CommandEvent>) {
    let mut sender = CommandSender::new(0);
    sender.submit(VEHICLE, ARM, [1.0; 7], resend, ms(0));
    let times = (0..seconds * 100).map(|tick| tick * 10).filter(|now| !sender.poll(ms(*now)).is_empty());
    (times.collect(), sender.take_events())
}

#[test]
fn a_command_for_one_moment_is_sent_once_and_given_up() {
    let (times, events) = unanswered(Resend::Never, 5);
    assert_eq!(times, [0]);
    assert_eq!(events.last(), Some(&CommandEvent::TimedOut { command: 400, attempts: 1 }));
}

#[test]
fn an_ordinary_command_is_sent_again_three_times_half_a_second_apart() {
    let (times, events) = unanswered(Resend::Times(3), 5);
    assert_eq!(times, [0, 500, 1000, 1500]);
    assert_eq!(events.last(), Some(&CommandEvent::TimedOut { command: 400, attempts: 4 }));
}

#[test]
fn an_abort_is_sent_until_it_is_withdrawn() {
    let mut sender = CommandSender::new(0);
    let ticket = sender.submit(VEHICLE, ABORT, [1.0; 7], Resend::UntilWithdrawn, ms(0));
    let mut confirmations = Vec::new();
    for now in (0..200_000).step_by(50) {
        for message in sender.poll(ms(now)) {
            let MavMessage::COMMAND_LONG(command) = message else { panic!("{message:?}") };
            confirmations.push(command.confirmation);
        }
    }
    // It is sent twenty times a second as long as it is not accepted.
    assert_eq!(confirmations.len(), 20 * 200);
    assert_eq!(&confirmations[..3], &[0, 1, 2]);
    assert_eq!(confirmations.last(), Some(&255), "the count of resends does not overflow");
    sender.on_answer(&answer(ABORT, MavResult::MAV_RESULT_ACCEPTED), ms(200_000));
    assert!(sender.is_pending(ABORT), "an answer does not end it");
    sender.withdraw_one(ticket, ms(200_100));
    assert!(sender.poll(ms(300_000)).is_empty() && sender.due_at().is_none());
}

#[test]
fn a_command_in_progress_gets_three_more_seconds_and_no_resend() {
    let mut sender = CommandSender::new(0);
    sender.submit(VEHICLE, ARM, [0.0; 7], Resend::Times(3), ms(0));
    assert_eq!(sender.poll(ms(0)).len(), 1);
    sender.on_answer(&answer(ARM, MavResult::MAV_RESULT_IN_PROGRESS), ms(100));
    assert!(sender.poll(ms(3_000)).is_empty());
    assert!(sender.is_pending(ARM));
    assert!(sender.poll(ms(3_200)).is_empty());
    assert!(matches!(sender.take_events().last(), Some(CommandEvent::TimedOut { .. })));
}

#[test]
fn the_answer_to_an_unknown_command_is_decoded_again() {
    let mut encoder = Encoder::new(VEHICLE);
    let request = CommandRequest {
        source: GROUND,
        target: VEHICLE,
        command: 65_000,
        params: [0.0; 7],
        confirmation: 0,
    };
    let frame = CommandAnswer::to(&request, MavResult::MAV_RESULT_UNSUPPORTED).encode(&mut encoder).unwrap();
    assert!(frame.decode().is_err(), "the dialect does not know 65000");
    let read = CommandAnswer::from_frame(&frame).unwrap();
    assert_eq!((read.command, read.target, read.result_words()), (65_000, GROUND, "unsupported"));
}

#[test]
fn an_address_accepts_its_ids_and_the_broadcast() {
    let of = |system_id, component_id| Address { system_id, component_id };
    for target in [of(0, 0), of(1, 0), of(0, 1), of(1, 1)] {
        assert!(VEHICLE.accepts(target), "{target:?}");
    }
    for target in [of(2, 1), of(1, 2), of(255, 0)] {
        assert!(!VEHICLE.accepts(target), "{target:?}");
    }
}

#[test]
fn a_missing_chunk_is_marked_after_the_timeout() {
    let text = "a".repeat(50) + &"b".repeat(50) + &"c".repeat(20);
    let parts = chunks(MavSeverity::MAV_SEVERITY_WARNING, &text, 7);
    assert_eq!(parts.len(), 3);
    let mut reassembler = Reassembler::default();
    assert!(reassembler.push(VEHICLE, &parts[2], ms(0)).is_empty());
    assert!(reassembler.push(VEHICLE, &parts[0], ms(10)).is_empty());
    assert!(reassembler.expire(ms(1_900)).is_empty());
    let late = reassembler.expire(ms(2_100));
    assert_eq!(late[0].text, "a".repeat(50) + "[...]" + &"c".repeat(20));
    assert_eq!(late[0].severity, 4);
}

#[test]
fn a_flood_of_unfinished_texts_stays_bounded() {
    let mut reassembler = Reassembler::default();
    let mut shown = 0;
    for id in 1..=1_000 {
        let parts = chunks(MavSeverity::MAV_SEVERITY_INFO, &"x".repeat(120), id);
        shown += reassembler.push(VEHICLE, &parts[0], ms(u64::from(id))).len();
    }
    assert_eq!(shown, 1_000 - Reassembler::MAX_PARTIAL);
}

fn heartbeats(encoder: &mut Encoder, count: usize) -> Vec<Frame> {
    (0..count).map(|_| encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()))).collect()
}

#[test]
fn loss_and_rate_are_those_of_the_last_ten_seconds() {
    let mut stats = LinkStats::default();
    let mut encoder = Encoder::new(VEHICLE);
    // Ten frames a second arrive for 30 s; every fifth is lost during the last ten.
    for (k, frame) in heartbeats(&mut encoder, 300).iter().enumerate() {
        let now = ms(100 * k as u64);
        if k < 200 || k % 5 != 0 {
            stats.on_rx_bytes(frame.as_bytes().len(), now);
            stats.on_frame(frame, now);
        }
    }
    let figures = stats.figures(ms(29_900));
    assert!((figures.loss - 0.2).abs() < 0.01, "{figures:?}");
    assert!((figures.rx_frames_s - 8.0).abs() < 0.5, "{figures:?}");
    assert_eq!(stats.age(VEHICLE, ms(30_900)), Some(ms(1_000)));
    assert_eq!(stats.age(GROUND, ms(30_900)), None);
    let silent = stats.figures(ms(60_000));
    assert!(silent.rx_bytes_s.abs() < f64::EPSILON && silent.loss.abs() < f64::EPSILON);
}

#[test]
fn each_component_has_a_loss_and_each_message_an_age_and_a_rate() {
    let mut stats = LinkStats::default();
    let (vehicle, ground) =
        (heartbeats(&mut Encoder::new(VEHICLE), 100), heartbeats(&mut Encoder::new(GROUND), 100));
    for (k, (of_vehicle, of_ground)) in vehicle.iter().zip(&ground).enumerate() {
        let now = ms(100 * k as u64);
        if k % 4 != 0 {
            stats.on_frame(of_vehicle, now);
        }
        stats.on_frame(of_ground, now);
    }
    let sources = stats.sources(ms(9_900));
    assert_eq!(sources.iter().map(|figures| figures.source).collect::<Vec<_>>(), [VEHICLE, GROUND]);
    assert!((sources[0].loss - 0.25).abs() < 0.02 && sources[1].loss.abs() < f64::EPSILON, "{sources:?}");
    assert!((sources[1].rx_frames_s - 10.0).abs() < 0.5, "{sources:?}");
    let messages: Vec<_> = stats.messages(ms(10_900)).collect();
    assert_eq!(messages.iter().map(|figures| figures.source).collect::<Vec<_>>(), [VEHICLE, GROUND]);
    let ages: Vec<_> = messages.iter().map(|figures| (figures.message_id, figures.age)).collect();
    assert_eq!(ages, [(0, ms(1_000)); 2]);
    // Nine seconds of the last ten: three of four, and all.
    for (figures, sent) in messages.iter().zip([67.5, 90.0]) {
        assert!((figures.rx_frames_s - sent / 9.9).abs() < 0.3, "{figures:?}");
    }
}

#[test]
fn a_frame_that_arrives_late_is_not_lost() {
    let frames = heartbeats(&mut Encoder::new(VEHICLE), 20);
    let mut stats = LinkStats::default();
    for place in [0, 1, 3, 2, 4, 7, 5, 6, 8] {
        stats.on_frame(&frames[place], ms(10 * place as u64));
    }
    assert!(stats.figures(ms(100)).loss.abs() < f64::EPSILON, "{:?}", stats.figures(ms(100)));
}

#[test]
fn a_restarted_sender_is_not_taken_for_loss() {
    let mut stats = LinkStats::default();
    for frame in heartbeats(&mut Encoder::new(VEHICLE), 200) {
        stats.on_frame(&frame, ms(0));
    }
    // From 199 back to 0 is a jump of 56 forwards: below half the range it counts as loss, above it
    // does not.
    for frame in heartbeats(&mut Encoder::new(VEHICLE), 60) {
        stats.on_frame(&frame, ms(1_000));
    }
    assert!(stats.figures(ms(1_000)).loss < 0.2);
}

proptest! {
    #[test]
    fn any_text_survives_its_chunks_in_any_order(
        text in "[ -~äßλ]{0,130}",
        id in 1u16..,
        order in any::<prop::sample::Index>(),
    ) {
        let mut parts = chunks(MavSeverity::MAV_SEVERITY_NOTICE, &text, id);
        let turn = order.index(parts.len());
        parts.rotate_left(turn);
        let mut reassembler = Reassembler::default();
        let shown: Vec<_> = parts.iter().flat_map(|part| reassembler.push(VEHICLE, part, ms(0))).collect();
        prop_assert_eq!(shown.len(), 1);
        prop_assert_eq!(&shown[0].text, &text);
    }

    #[test]
    fn whatever_arrives_becomes_printable(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(printable(&bytes).chars().all(|c| !c.is_control()));
    }
}
