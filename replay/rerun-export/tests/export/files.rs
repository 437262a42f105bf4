//! Tests with files that are damaged, foreign, missing or already there, and with full disks.

use replay::log::FlightLog;
use replay_rerun::survey::Survey;
use replay_rerun::{ExportError, Overwrite, export, export_file};

use crate::logs::{TICKS, folder, write_log};
use crate::read_back::Recording;

#[test]
fn the_readable_part_of_a_cut_log_is_exported() {
    let (_folder, log, rrd) = folder();
    write_log(&log, true);
    let bytes = std::fs::read(&log).unwrap();
    let mut partly = 0;
    for percent in (30..100).step_by(5) {
        std::fs::write(&log, &bytes[..bytes.len() * percent / 100]).unwrap();
        let exported = match export_file(&log, &rrd, Overwrite::Always) {
            Ok(exported) => exported,
            Err(refused) => {
                assert!(refused.to_string().contains("before its first message"), "{percent} %: {refused}");
                assert_eq!(partly, 0, "{percent} %: less of the log could be read");
                continue;
            }
        };
        assert_eq!(
            Recording::read(&rrd).rows("plots/fins_mean_deg/replayed"),
            exported.ticks as usize,
            "{percent} %"
        );
        assert!(exported.damage.is_some() || exported.ticks == TICKS, "{percent} %");
        partly += usize::from((1..TICKS).contains(&exported.ticks));
    }
    assert!(partly > 0);
}

#[test]
fn nothing_is_overwritten_without_force() {
    let (_folder, log, rrd) = folder();
    write_log(&log, true);
    std::fs::write(&rrd, "precious").unwrap();
    let refused = export_file(&log, &rrd, Overwrite::Never).unwrap_err();
    assert!(matches!(refused, ExportError::Exists { .. }));
    assert!(refused.to_string().contains("flight.rrd: already exists"), "{refused}");
    assert_eq!(std::fs::read(&rrd).unwrap(), b"precious");
    let refused = export_file(&log, &log, Overwrite::Always).unwrap_err();
    assert!(matches!(refused, ExportError::IsTheLog { .. }));
    export_file(&log, &rrd, Overwrite::Always).unwrap();
    assert_eq!(Recording::read(&rrd).layouts, 1);
}

#[test]
fn a_file_that_is_not_a_log_is_named_and_leaves_nothing_behind() {
    let (folder, log, rrd) = folder();
    std::fs::write(&log, "time,altitude\n0,15\n").unwrap();
    let error = export_file(&log, &rrd, Overwrite::Never).unwrap_err();
    assert!(error.to_string().contains("flight.mcap: is not a flight log"), "{error}");
    let missing = export_file(&folder.path().join("none.mcap"), &rrd, Overwrite::Never).unwrap_err();
    assert!(missing.to_string().contains("none.mcap: cannot be read"), "{missing}");
    write_log(&log, true);
    let nowhere = folder.path().join("nowhere").join("flight.rrd");
    let error = export_file(&log, &nowhere, Overwrite::Never).unwrap_err();
    assert!(error.to_string().contains("flight.rrd: cannot be written"), "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A full disk is an error, not a short recording.
#[test]
fn a_failing_output_is_an_error() {
    struct Full;
    impl std::io::Write for Full {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            // There is room for the stream's header only.
            if bytes.len() <= 16 { Ok(bytes.len()) } else { Err(std::io::Error::other("no room")) }
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let (_folder, path, _) = folder();
    write_log(&path, true);
    let bytes = std::fs::read(&path).unwrap();
    let survey = Survey::of(bytes.as_slice()).unwrap();
    let mut log = FlightLog::read("flight.mcap".to_owned(), bytes.as_slice()).unwrap();
    let error = export::export(&mut log, &survey, Full).map(|(done, _)| done).unwrap_err();
    assert!(error.to_string().contains("no room"), "{error}");
}
