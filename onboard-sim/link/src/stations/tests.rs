//! Tests which stations are heard and remembered, and how a countdown survives a bad link.

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

/// The reports sent at a time, by addressee.
fn told(stations: &mut Stations, time_s: f64) -> Vec<(Address, TD_UPLINK_DATA)> {
    let read = |message| match message {
        MavMessage::TD_UPLINK(uplink) => {
            let to = Address { system_id: uplink.target_system, component_id: uplink.target_component };
            (to, uplink)
        }
        other => panic!("{other:?}"),
    };
    stations.due(time_s).into_iter().map(read).collect()
}

#[test]
fn any_accepted_frame_counts_for_the_age_and_a_heartbeat_alone_proves_the_uplink() {
    let mut stations = Stations::default();
    assert_eq!(stations.age_s(GROUND, 1.0), None);
    stations.accepted(&command_from(GROUND), 1.0);
    assert_eq!(stations.age_s(GROUND, 1.5), Some(0.5));
    assert_eq!(stations.uplink(GROUND, 1.5), Uplink::NeverHeard);
    stations.accepted(&beat_from(GROUND), 2.0);
    stations.accepted(&command_from(GROUND), 3.0);
    assert_eq!(stations.age_s(GROUND, 3.5), Some(0.5));
    assert_eq!(stations.uplink(GROUND, 3.5), Uplink::Heard { age_s: 1.5 });
    assert_eq!(stations.uplink(station(7), 3.5), Uplink::NeverHeard);
    assert_eq!(stations.best_uplink(4.0), Uplink::Heard { age_s: 2.0 });
}

/// It is accepted unsigned, so it must not count: otherwise anybody without the key could keep a dead uplink alive.
#[test]
fn a_radio_s_report_proves_nothing_whatever_address_it_names() {
    let mut stations = Stations::default();
    stations.accepted(&frame_from(GROUND, &MavMessage::RADIO_STATUS(RADIO::default())), 1.0);
    assert_eq!(stations.age_s(GROUND, 1.0), None);
}

#[test]
fn before_any_accepted_frame_everybody_gets_the_reason_of_refusals() {
    let mut stations = Stations::default();
    let [(to, uplink)] = &told(&mut stations, 0.0)[..] else { panic!("one message") };
    assert_eq!(*to, EVERYBODY);
    assert_eq!((uplink.accepted_age_ms, uplink.refused_age_ms), (u16::MAX, u16::MAX));
    assert_eq!(uplink.refusal, TdFrameRefusal::TD_FRAME_REFUSAL_NONE);
    stations.refused(GROUND, Rejection::Wrong, 0.25);
    let [(_, uplink)] = &told(&mut stations, 0.5)[..] else { panic!("one message") };
    assert_eq!((uplink.accepted_age_ms, uplink.refused_age_ms, uplink.refused_count), (u16::MAX, 250, 1));
    assert_eq!(uplink.refusal, TdFrameRefusal::TD_FRAME_REFUSAL_WRONG_KEY);
    assert_eq!((uplink.refused_system, uplink.refused_component), (255, 190));
}

#[test]
fn each_station_is_told_its_own_age_twice_a_second() {
    let mut stations = Stations::default();
    let mut messages = 0;
    for frame in 0..500 {
        let time_s = 0.02 * f64::from(frame);
        if frame % 5 == 0 {
            stations.accepted(&beat_from(GROUND), time_s);
        }
        if frame == 100 {
            stations.accepted(&beat_from(station(7)), time_s);
            stations.set_commander(Some((station(7), None)));
        }
        for (to, uplink) in told(&mut stations, time_s) {
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
    stations.accepted(&beat_from(GROUND), 0.0);
    for _ in 0..70_000 {
        stations.refused(GROUND, Rejection::Unsigned, 1.0);
    }
    let [(_, uplink)] = &told(&mut stations, 1_000.0)[..] else { panic!("one message") };
    assert_eq!((uplink.accepted_age_ms, uplink.refused_age_ms), (65_534, 65_534));
    assert_eq!(uplink.refused_count, u16::MAX);
}

#[test]
fn a_flood_of_strangers_pushes_out_no_station_that_has_proved_itself() {
    let mut stations = Stations::default();
    stations.accepted(&beat_from(GROUND), 0.0);
    stations.accepted(&command_from(station(7)), 0.0);
    stations.set_commander(Some((station(7), None)));
    for system_id in 8..=250 {
        stations.accepted(&command_from(station(system_id)), 1.0);
        assert!(stations.known.len() <= MAX_STATIONS);
    }
    assert_eq!(stations.age_s(GROUND, 1.0), Some(1.0));
    assert_eq!(stations.age_s(station(7), 1.0), Some(1.0), "it armed the vehicle");
    assert_eq!(stations.age_s(station(250), 1.0), Some(0.0), "the free place went round");
    // A minute after its last heartbeat the entry of a station is free.
    stations.accepted(&beat_from(station(9)), 30.0);
    stations.accepted(&beat_from(station(10)), 59.0);
    assert_eq!(stations.age_s(station(10), 59.0), None, "all three are proven, or armed it");
    stations.accepted(&beat_from(station(10)), 61.0);
    assert_eq!((stations.age_s(GROUND, 61.0), stations.age_s(station(10), 61.0)), (None, Some(0.0)));
}

/// The probability of a run of lost frames of this length, among frames lost independently with a given probability.
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

/// A ground station sends ten heartbeats a second while a vehicle is armed. On a link that loses every second frame, a
/// countdown is then held by chance less than once in a thousand; at one heartbeat a second it would happen often.
#[test]
fn with_half_the_frames_lost_a_countdown_is_held_less_than_once_in_a_thousand() {
    const LOST: f64 = 0.5;
    const RATE_HZ: f64 = 10.0;
    // One frame fewer, to allow for a frame that comes a little late.
    let silent_frames = (UPLINK_SILENT_S * RATE_HZ) as usize - 1;
    // The longest countdown that is flown is 5 s; half a minute is safe, too.
    for countdown_s in [5.0, 30.0] {
        let frames = ((countdown_s + UPLINK_SILENT_S) * RATE_HZ) as usize;
        let chance = chance_of_a_run(frames, silent_frames, LOST);
        assert!(chance < 1e-3, "{chance} in {countdown_s} s");
    }
    assert!(chance_of_a_run(5 + 2, 2, LOST) > 0.5);
}
