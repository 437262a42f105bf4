//! Tests following a log that is being written, and two flights in one recording.

use std::io::Write as _;

use replay_rerun::{
    ExportError, Overwrite, Towards, entity, export_file, export_file_with, follow_file, send_file,
};

use crate::logs::{TICKS, folder, in_the_third_chunk, write_apogee_log, write_log, write_telemetry_log};
use crate::read_back::Recording;

/// A log that grows by a tenth each time its reader waits has the recording of the whole log, and its layout is there before
/// the flight.
#[test]
fn a_log_is_followed_while_it_is_written() {
    for write in [|path: &_| write_log(path, true), write_apogee_log, write_telemetry_log] {
        let (folder, log, rrd) = folder();
        write(&log);
        let whole = folder.path().join("whole.rrd");
        let afterwards = export_file(&log, &whole, Overwrite::Never).unwrap();
        let bytes = std::fs::read(&log).unwrap();
        std::fs::remove_file(&log).unwrap();
        let (mut written, mut seen_early) = (0, false);
        let wait = || {
            if written == bytes.len() {
                return false;
            }
            seen_early |= rrd.metadata().is_ok_and(|file| file.len() > 0);
            let until = (written + bytes.len() / 10).min(bytes.len());
            let mut file = std::fs::File::options().create(true).append(true).open(&log).unwrap();
            file.write_all(&bytes[written..until]).unwrap();
            written = until;
            true
        };
        let followed = follow_file(&log, Towards::File(&rrd, Overwrite::Never), wait).unwrap();
        assert_eq!(followed, afterwards);
        assert!(seen_early, "the recording begins with the log");
        let (live, whole) = (Recording::read(&rrd), Recording::read(&whole));
        for path in [entity::ROCKET, entity::PREDICTED, entity::EVENTS, "plots/altitude_m/true"] {
            assert_eq!(live.rows(path), whole.rows(path), "{path}");
        }
        assert_eq!(live.ids, whole.ids);
        assert_eq!((live.layouts, whole.layouts), (2, 1));
    }
}

#[test]
fn a_log_that_stops_growing_is_recorded_as_far_as_it_goes() {
    let (_folder, log, rrd) = folder();
    write_log(&log, true);
    let bytes = std::fs::read(&log).unwrap();
    std::fs::write(&log, &bytes[..in_the_third_chunk(&bytes)]).unwrap();
    let followed = follow_file(&log, Towards::File(&rrd, Overwrite::Never), || false).unwrap();
    assert!(followed.damage.is_some() && followed.ticks < TICKS, "{followed:?}");
    assert_eq!(Recording::read(&rrd).rows("plots/fins_mean_deg/replayed"), followed.ticks as usize);
    let again = follow_file(&log, Towards::File(&rrd, Overwrite::Never), || false).unwrap_err();
    assert!(matches!(again, ExportError::Exists { .. }), "{again}");
}

/// The second flight has the first one's views and clock, and its own entities.
#[test]
fn two_flights_lie_in_one_recording() {
    let (folder, log, rrd) = folder();
    let other = folder.path().join("other.mcap");
    write_log(&log, true);
    write_log(&other, false);
    let alone = folder.path().join("alone.rrd");
    export_file(&other, &alone, Overwrite::Never).unwrap();
    let (own, of_other) = export_file_with(&log, &other, &rrd, Overwrite::Never).unwrap();
    assert_eq!((own.ticks, of_other.ticks), (TICKS, TICKS));
    let (both, alone) = (Recording::read(&rrd), Recording::read(&alone));
    assert_eq!((both.ids.len(), both.layouts), (1, 1));
    for path in [entity::LEVEL, entity::PHASE, "plots/fins_mean_deg/replayed"] {
        let beside = entity::beside(path);
        assert!(alone.rows(path) > 0 && both.rows(path) > 0, "{path}");
        assert_eq!(both.rows(&beside), alone.rows(path), "{beside}");
        let clock = entity::TIMELINE_FLIGHT_TIME;
        assert_eq!(both.times(&beside, clock), alone.times(path, clock), "{beside}");
    }
    let refused = export_file_with(&log, &other, &other, Overwrite::Always).unwrap_err();
    assert!(matches!(refused, ExportError::IsTheLog { .. }), "{refused}");
}

#[test]
fn without_a_viewer_nothing_is_sent_and_it_is_said() {
    let (_folder, log, _) = folder();
    write_log(&log, true);
    // Port 1 is reserved, and nothing listens there.
    let error = send_file(&log, "rerun+http://127.0.0.1:1/proxy").unwrap_err();
    assert!(error.to_string().contains("no Rerun viewer takes the recording"), "{error}");
    let error = send_file(&log, "somewhere").unwrap_err();
    assert!(matches!(error, ExportError::Record(_)), "{error}");
}
