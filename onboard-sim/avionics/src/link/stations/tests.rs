//! Tests which stations are accepted and remembered, and how a countdown survives a bad link.

use protocol::dialect::{COMMAND_LONG_DATA, HEARTBEAT_DATA as BEAT, RADIO_STATUS_DATA as RADIO};
use protocol::frame::Encoder;
use protocol::identity::GROUND;

use flight::rules::phase::UPLINK_SILENT_S;

use super::*;

fn frame_from(address: Address, message: &MavMessage) -> Frame {
    Encoder::new(address).encode(message)
}

fn beat_from(address: Address) -> Frame {
    frame_from(address, &MavMessage::HEARTBEAT(BEAT::default()))
}

fn command_from(address: Address) -> Frame {
    frame_from(address, &MavMessage::COMMAND_LONG(COMMAND_LONG_DATA::default()))
}

fn station(system_id: u8) -> Address {
    Address { system_id, component_id: 190 }
}

/// One path for all.
fn sender(address: Address) -> Sender {
    Sender { address, key: 0, path: Path::from(0) }
}

fn accept(stations: &mut Stations, frame: &Frame, time_s: f64) {
    stations.accepted(frame, &sender(frame.source()), time_s);
}

fn station_of(stations: &Stations, address: Address) -> flight::rules::two_person::Station {
    stations.of(&sender(address))
}

fn age_s(stations: &Stations, address: Address, time_s: f64) -> Option<f64> {
    stations.age_s(station_of(stations, address), time_s)
}

/// The reports sent at a time, by addressee.
fn reports(stations: &mut Stations, time_s: f64) -> Vec<(Address, TD_UPLINK_DATA)> {
    let read = |message| match message {
        MavMessage::TD_UPLINK(uplink) => {
            let to = Address { system_id: uplink.target_system, component_id: uplink.target_component };
            (to, uplink)
        }
        other => panic!("{other:?}"),
    };
    stations.due(1, time_s).into_iter().map(read).collect()
}

#[test]
fn any_accepted_frame_counts_for_the_age_and_a_heartbeat_alone_proves_the_uplink() {
    let mut stations = Stations::default();
    assert_eq!(age_s(&stations, GROUND, 1.0), None);
    accept(&mut stations, &command_from(GROUND), 1.0);
    assert_eq!(age_s(&stations, GROUND, 1.5), Some(0.5));
    assert_eq!(stations.uplink(station_of(&stations, GROUND), 1.5), Uplink::NeverReceived);
    accept(&mut stations, &beat_from(GROUND), 2.0);
    accept(&mut stations, &command_from(GROUND), 3.0);
    assert_eq!(age_s(&stations, GROUND, 3.5), Some(0.5));
    assert_eq!(stations.uplink(station_of(&stations, GROUND), 3.5), Uplink::Received { age_s: 1.5 });
    assert_eq!(stations.uplink(station_of(&stations, station(7)), 3.5), Uplink::NeverReceived);
    assert_eq!(stations.best_uplink(4.0), Uplink::Received { age_s: 2.0 });
}

/// It is accepted unsigned, so it must not count: otherwise a dead uplink could be kept alive
/// without the key.
#[test]
fn a_radio_s_report_proves_nothing_whatever_address_it_names() {
    let mut stations = Stations::default();
    accept(&mut stations, &frame_from(GROUND, &MavMessage::RADIO_STATUS(RADIO::default())), 1.0);
    assert_eq!(age_s(&stations, GROUND, 1.0), None);
}

#[test]
fn before_any_accepted_frame_everybody_gets_the_reason_of_refusals() {
    let mut stations = Stations::default();
    let [(to, uplink)] = &reports(&mut stations, 0.0)[..] else { panic!("one message") };
    assert_eq!(*to, EVERYBODY);
    assert_eq!((uplink.accepted_age_ms, uplink.refused_age_ms), (u16::MAX, u16::MAX));
    assert_eq!(uplink.refusal, TdFrameRefusal::TD_FRAME_REFUSAL_NONE);
    stations.refused(GROUND, Rejection::Wrong, 0.25);
    let [(_, uplink)] = &reports(&mut stations, 0.5)[..] else { panic!("one message") };
    assert_eq!((uplink.accepted_age_ms, uplink.refused_age_ms, uplink.refused_count), (u16::MAX, 250, 1));
    assert_eq!(uplink.refusal, TdFrameRefusal::TD_FRAME_REFUSAL_WRONG_KEY);
    assert_eq!((uplink.refused_system, uplink.refused_component), (255, 190));
}

#[test]
fn each_station_gets_a_report_of_its_age_twice_a_second() {
    let mut stations = Stations::default();
    let mut messages = 0;
    for frame in 0..500 {
        let time_s = 0.02 * f64::from(frame);
        if frame % 5 == 0 {
            accept(&mut stations, &beat_from(GROUND), time_s);
        }
        if frame == 100 {
            accept(&mut stations, &beat_from(station(7)), time_s);
            stations.set_commander(Some((station_of(&stations, station(7)), None)));
        }
        for (to, uplink) in reports(&mut stations, time_s) {
            messages += 1;
            if to == GROUND {
                assert!(uplink.accepted_age_ms <= 100 && uplink.commands == 0, "{uplink:?}");
            } else {
                assert_eq!((to, uplink.commands), (station(7), 1));
                let age_ms = 1000.0 * (time_s - 2.0);
                assert!((f64::from(uplink.accepted_age_ms) - age_ms).abs() <= 1.0, "{uplink:?} at {time_s}");
            }
        }
    }
    // 10 s at 2 Hz, and 8 s of the second station; one more or less by the grid of frames.
    assert!((35..=37).contains(&messages), "{messages}");
}

#[test]
fn ages_and_counts_saturate() {
    let mut stations = Stations::default();
    accept(&mut stations, &beat_from(GROUND), 0.0);
    for _ in 0..70_000 {
        stations.refused(GROUND, Rejection::Unsigned, 1.0);
    }
    let [(_, uplink)] = &reports(&mut stations, 1_000.0)[..] else { panic!("one message") };
    assert_eq!((uplink.accepted_age_ms, uplink.refused_age_ms), (65_534, 65_534));
    assert_eq!(uplink.refused_count, u16::MAX);
}

#[test]
fn a_flood_of_strangers_pushes_out_no_station_that_has_proved_itself() {
    let mut stations = Stations::default();
    accept(&mut stations, &beat_from(GROUND), 0.0);
    accept(&mut stations, &command_from(station(7)), 0.0);
    stations.set_commander(Some((station_of(&stations, station(7)), None)));
    for system_id in 8..=250 {
        accept(&mut stations, &command_from(station(system_id)), 1.0);
        assert!(stations.peers.len() <= MAX_STATIONS);
    }
    assert_eq!(age_s(&stations, GROUND, 1.0), Some(1.0));
    assert_eq!(age_s(&stations, station(7), 1.0), Some(1.0), "it armed the vehicle");
    assert_eq!(age_s(&stations, station(250), 1.0), Some(0.0), "the free place went round");
    // A minute after its last heartbeat the entry of a station is free.
    accept(&mut stations, &beat_from(station(9)), 30.0);
    accept(&mut stations, &beat_from(station(10)), 59.0);
    assert_eq!(age_s(&stations, station(10), 59.0), None, "all three are proven, or armed it");
    accept(&mut stations, &beat_from(station(10)), 61.0);
    assert_eq!((age_s(&stations, GROUND, 61.0), age_s(&stations, station(10), 61.0)), (None, Some(0.0)));
}

/// The probability of a run of lost frames of this length, among frames lost independently with a
/// given probability.
fn chance_of_a_run(frames: usize, run: usize, lost: f64) -> f64 {
    // Probability of each number of trailing lost frames, while no run is complete.
    let mut lost_last = vec![0.0; run];
    lost_last[0] = 1.0;
    let mut complete = 0.0;
    for _ in 0..frames {
        let arrives: f64 = lost_last.iter().sum::<f64>() * (1.0 - lost);
        complete += lost_last[run - 1] * lost;
        for count in (1..run).rev() {
            lost_last[count] = lost_last[count - 1] * lost;
        }
        lost_last[0] = arrives;
    }
    complete
}

#[test]
fn the_probability_of_a_run_equals_that_of_enumerating_all_outcomes() {
    for (frames, run) in [(6, 2), (9, 3), (12, 4)] {
        let with_run = (0_u32..1 << frames).filter(|outcome| {
            let lost = |frame: usize| outcome >> frame & 1 == 1;
            (0..=frames - run).any(|first| (first..first + run).all(lost))
        });
        let share = with_run.count() as f64 / f64::from(1_u32 << frames);
        assert!((chance_of_a_run(frames, run, 0.5) - share).abs() < 1e-12, "{frames}, {run}");
    }
}

/// A ground station sends ten heartbeats a second while a vehicle is armed. On a link that loses
/// every fourth frame, a countdown is then held by chance less than once in a thousand.
#[test]
fn with_a_quarter_of_the_frames_lost_a_countdown_is_held_less_than_once_in_a_thousand() {
    const LOST: f64 = 0.25;
    const RATE_HZ: f64 = 10.0;
    // One frame fewer, to allow for a slightly late frame.
    let silent_frames = (UPLINK_SILENT_S * RATE_HZ) as usize - 1;
    // The built-in missions count down for 10 s; half a minute is safe, too.
    for countdown_s in [10.0, 30.0] {
        let frames = ((countdown_s + UPLINK_SILENT_S) * RATE_HZ) as usize;
        let chance = chance_of_a_run(frames, silent_frames, LOST);
        assert!(chance < 1e-3, "{chance} in {countdown_s} s");
    }
}

/// A program with the ids of [`GROUND`], independent of others.
struct Program {
    encoder: Encoder,
    session: u32,
    sender: Sender,
}

impl Program {
    fn new(session: u32, key: u8, link: usize) -> Self {
        let sender = Sender { key, path: Path::from(link), ..sender(GROUND) };
        Self { encoder: Encoder::new(GROUND), session, sender }
    }

    fn on(self, stream: u64) -> Self {
        let path = Path { origin: Some(Origin::Stream(stream)), ..self.sender.path };
        Self { sender: Sender { path, ..self.sender }, ..self }
    }

    fn beat(&mut self) -> Frame {
        let (custom_mode, mavtype) = (self.session, MavType::MAV_TYPE_GCS);
        self.encoder.encode(&MavMessage::HEARTBEAT(BEAT { custom_mode, mavtype, ..BEAT::default() }))
    }

    fn beats(&mut self, stations: &mut Stations, time_s: f64) -> flight::rules::two_person::Station {
        let beat = self.beat();
        stations.accepted(&beat, &self.sender, time_s);
        stations.of(&self.sender)
    }
}

/// A new session is a program that was started again, another key another person, and without a
/// session another socket is another program.
#[test]
fn programs_with_the_same_ids_are_distinguished_and_reported_to_each_other() {
    for (mut one, mut other) in [
        (Program::new(7, 0, 0), Program::new(8, 0, 0)),
        (Program::new(7, 1, 0), Program::new(7, 2, 0)),
        (Program::new(0, 0, 0).on(1), Program::new(0, 0, 0).on(2)),
        (Program::new(7, 0, 0).on(1), Program::new(0, 0, 0).on(2)),
    ] {
        let mut stations = Stations::default();
        let first = one.beats(&mut stations, 0.0);
        assert_eq!(stations.same_ids(first, 0.0), 0);
        let second = other.beats(&mut stations, 0.5);
        assert_ne!(first, second);
        assert_eq!((stations.same_ids(first, 0.5), stations.same_ids(second, 0.5)), (1, 1));
        stations.set_commander(Some((first, None)));
        let reports = reports(&mut stations, 0.5);
        let reports: Vec<_> = reports
            .iter()
            .map(|(to, uplink)| (*to, uplink.session, uplink.commands, uplink.same_id))
            .collect();
        assert_eq!(reports, [(GROUND, one.session, 1, 1), (GROUND, other.session, 0, 1)]);
        // The second continues; the first is in command, and is silent.
        for tenth in 6..80 {
            other.beats(&mut stations, 0.1 * f64::from(tenth));
        }
        assert_eq!(stations.age_s(first, 7.9), Some(7.9));
        assert_eq!(stations.same_ids(second, 7.9), 0, "more than 5 s later");
        // No longer in command, it leaves no trace.
        stations.set_commander(None);
        other.beats(&mut stations, 8.0);
        assert_eq!(stations.peers.len(), 1);
    }
}

#[test]
fn a_program_that_is_started_again_and_again_always_has_a_place() {
    let mut stations = Stations::default();
    for session in 1..50 {
        let from_s = 6.0 * f64::from(session);
        let mut program = Program::new(session, 0, 0);
        program.beats(&mut stations, from_s);
        let station = program.beats(&mut stations, from_s + 1.0);
        assert_eq!(stations.uplink(station, from_s + 1.0), Uplink::Received { age_s: 0.0 }, "{session}");
    }
}

/// Without a session, too; frames are lost on either link.
#[test]
fn a_program_over_two_links_is_one_station() {
    for session in [0, 9] {
        let mut stations = Stations::default();
        let mut program = Program::new(session, 0, 0);
        let over = |link: usize| Sender { path: Path::from(link), ..sender(GROUND) };
        let mut number = None;
        for beat in 0..60 {
            let time_s = 0.1 * f64::from(beat);
            let frame = program.beat();
            match beat % 6 {
                0 | 1 => {
                    stations.accepted(&frame, &over(0), time_s);
                    stations.copied(&frame, &over(1));
                }
                2 => stations.accepted(&frame, &over(0), time_s),
                3 => {
                    stations.accepted(&frame, &over(1), time_s);
                    stations.copied(&frame, &over(0));
                }
                4 => stations.accepted(&frame, &over(1), time_s),
                _ => {}
            }
            let stations_by_link = [stations.of(&over(0)), stations.of(&over(1))];
            assert_eq!(stations_by_link[0], stations_by_link[1]);
            assert_eq!(*number.get_or_insert(stations_by_link[0]), stations_by_link[0]);
            assert_eq!(stations.same_ids(stations_by_link[0], time_s), 0);
        }
    }
    // The first heartbeats arrive over one link each: the first copy shows that it is one program.
    let mut stations = Stations::default();
    let mut program = Program::new(0, 0, 0);
    let over = |link: usize| Sender { path: Path::from(link), ..sender(GROUND) };
    stations.accepted(&program.beat(), &over(0), 0.0);
    stations.accepted(&program.beat(), &over(1), 0.1);
    stations.set_commander(Some((stations.of(&over(1)), None)));
    let frame = program.beat();
    stations.accepted(&frame, &over(0), 0.2);
    stations.copied(&frame, &over(1));
    assert_eq!(stations.of(&over(0)), stations.of(&over(1)));
    assert_eq!(stations.armed_by(), Some(stations.of(&over(0))));
    assert_eq!(stations.same_ids(stations.of(&over(0)), 0.2), 0);
}

/// Over a radio both take the same path: the origin of a frame is ambiguous, so only heartbeats
/// keep a station alive.
#[test]
fn a_station_with_a_session_lives_by_its_heartbeats_alone() {
    let mut stations = Stations::default();
    let mut program = Program::new(9, 0, 0);
    let station = program.beats(&mut stations, 0.0);
    accept(&mut stations, &command_from(GROUND), 1.5);
    assert_eq!(station_of(&stations, GROUND), station);
    assert_eq!(stations.age_s(station, 2.0), Some(2.0));
    // Whoever has no session and sends no heartbeats while it works lives by any frame.
    let mut stations = Stations::default();
    accept(&mut stations, &beat_from(GROUND), 0.0);
    accept(&mut stations, &command_from(GROUND), 1.5);
    assert_eq!(age_s(&stations, GROUND, 2.0), Some(0.5));
}

/// A command before the first heartbeat, over a path without heartbeats: no station is proven
/// there.
#[test]
fn a_command_over_an_unknown_path_belongs_to_no_station_with_a_heartbeat() {
    let mut stations = Stations::default();
    let mut program = Program::new(9, 0, 0);
    let station = program.beats(&mut stations, 0.0);
    let elsewhere = Program::new(0, 0, 0).on(4).sender;
    stations.accepted(&command_from(GROUND), &elsewhere, 0.1);
    let other = stations.of(&elsewhere);
    assert_ne!(other, station);
    assert_eq!(stations.uplink(other, 0.1), Uplink::NeverReceived);
    assert_eq!((stations.same_ids(station, 0.1), stations.same_ids(other, 0.1)), (0, 1));
    // Its heartbeat identifies it.
    let mut late = Program::new(10, 0, 0).on(4);
    assert_eq!(late.beats(&mut stations, 0.2), other);
}

#[test]
fn a_station_without_an_entry_is_still_reported_as_a_duplicate() {
    let mut stations = Stations::default();
    let mut one = Program::new(7, 0, 0);
    let first = one.beats(&mut stations, 0.0);
    for system_id in [7, 8] {
        accept(&mut stations, &beat_from(station(system_id)), 0.0);
    }
    let mut other = Program::new(8, 0, 1);
    let second = other.beats(&mut stations, 1.0);
    assert_eq!(second.number, 0);
    assert_eq!((stations.same_ids(first, 1.0), stations.same_ids(second, 1.0)), (1, 1));
    assert_eq!(stations.uplink(second, 1.0), Uplink::NeverReceived);
    assert_eq!(stations.same_ids(first, 6.1), 0);
}
