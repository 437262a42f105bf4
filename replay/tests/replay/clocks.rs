//! Tests the clocks of a log: one time base in the file, and times given by the name of their
//! clock.

use std::collections::BTreeMap;

use foxglove::messages::FrameTransform;
use prost::Message as _;
use replay::log::{Clock, ClockTime, Entry, FlightLog};

use crate::command_line::{data, replay, run};
use crate::from_apogee::LANDED;
use crate::simulated::MK2;

/// In Foxglove's terms: at any `log_time` the frames, the truth and the transform describe the same
/// moment.
#[test]
fn frames_truth_and_transforms_have_one_time_base() {
    for log in [&MK2.log, &LANDED.log] {
        let mut entries = FlightLog::open(log).unwrap();
        // By log time: the record's own time of frames and of truth, and the height in truth and
        // transform.
        let mut frames: BTreeMap<u64, f64> = BTreeMap::new();
        let mut truth: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
        let mut transforms: BTreeMap<u64, f64> = BTreeMap::new();
        while let Some(stamped) = entries.next_entry().unwrap() {
            let at_ns = stamped.log_time_ns;
            match &stamped.entry {
                Entry::ComputerFrame(frame) => {
                    frames.extend(frame.flight_time_s().map(|time_s| (at_ns, time_s)));
                }
                Entry::World(sample) => drop(truth.insert(at_ns, (sample.time_s, sample.state.position_m.z))),
                _ if entries.channel(stamped.channel_id).is_some_and(|channel| channel.topic == "/tf") => {
                    let transform = FrameTransform::decode(stamped.data.as_slice()).unwrap();
                    let stamp = transform.timestamp.unwrap();
                    let stamp_ns = u64::from(stamp.sec()) * 1_000_000_000 + u64::from(stamp.nsec());
                    assert_eq!(stamp_ns, at_ns, "{}", log.display());
                    transforms.insert(at_ns, transform.translation.unwrap().z);
                }
                _ => {}
            }
        }
        assert!(frames.len() > 50 && truth.len() > 50 && transforms.len() == truth.len());
        let mut both = 0;
        for (at_ns, (time_s, height_m)) in &truth {
            assert_eq!(transforms[at_ns].to_bits(), height_m.to_bits());
            if let Some(frame_s) = frames.get(at_ns) {
                both += 1;
                assert!(
                    (frame_s - time_s).abs() < 1e-6,
                    "{}: frame {frame_s}, truth {time_s}",
                    log.display()
                );
            }
        }
        assert!(both > 50, "{both}");
    }
}

/// The same moment, given on each clock that `info` shows.
#[test]
fn a_flight_is_flown_again_from_a_time_of_any_clock() {
    let recording = MK2.recording();
    let clocks = recording.clocks;
    let moment = ClockTime { clock: Clock::Flight, time_s: 12.0 };
    let frames: Vec<u64> = [Clock::Flight, Clock::Boot, Clock::Log]
        .into_iter()
        .map(|clock| {
            let time_s = clocks.convert(moment, clock).unwrap().time_s;
            let prefix = match clock {
                Clock::Flight => "T+",
                Clock::Boot => "boot:",
                Clock::Log => "log:",
            };
            // Just before the frame, because times in text are rounded.
            let given = format!("{prefix}{:.4}", time_s - 0.002);
            let (_, report) = data(replay("refly", &MK2.log).args(["--at", &given]));
            report["start"]["frame"].as_u64().unwrap()
        })
        .collect();
    assert_eq!(frames, [recording.release_frame + 2400; 3]);
    let boot_s = clocks.convert(moment, Clock::Boot).unwrap().time_s;
    assert!(boot_s > 15.0, "the countdown and the rehearsal come before it: {boot_s}");
    // A campaign's log does not know when its computer was powered up.
    for (log, at, expected, words) in [
        (&LANDED.log, "boot:15", 1, "give the time as T+SECONDS"),
        (&MK2.log, "utc:15", 2, "as in T+12.9, boot:19.8 or log:19.7"),
    ] {
        let (code, _, refused) = run(replay("refly", log).args(["--at", at]));
        assert!(code == expected && refused.contains(words), "{refused}");
    }
}
