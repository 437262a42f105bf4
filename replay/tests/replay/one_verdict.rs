//! Tests that every answer says the same of how a flight ended.

use flight::rules::verdict::Landing;
use replay::info::info;
use replay::report::report;

use crate::command_line::{replay, run};
use crate::from_apogee::{self, LANDED, Logged};
use crate::simulated::MK2;

/// The sentence of `info`, after checking that text and page say it, too.
fn said_alike(log: &std::path::Path) -> String {
    let ending = info(log).unwrap().ending.unwrap();
    let (code, stdout, _) = run(&mut replay("info", log));
    assert!(code == 0 && stdout.contains(&format!("verdict     {ending}")), "{ending}: {stdout}");
    let page = report(log, None).unwrap().html;
    assert!(page.contains(&format!("\">{ending}</p>")), "{ending}");
    ending
}

#[test]
fn both_verdicts_are_known_and_only_broken_limits_are_shown() {
    for log in [&LANDED.log, &MK2.log] {
        let verdict = info(log).unwrap().verdict.unwrap();
        let names = |limits: &[replay::log::VerdictLimit]| -> Vec<String> {
            limits.iter().map(|limit| limit.name.clone()).collect()
        };
        let of_legs = ["vertical speed", "lateral speed", "tilt", "rotation rate"];
        assert_eq!(names(&verdict.envelope), of_legs);
        assert_eq!(names(&verdict.table_2), [&["distance", "height"], &of_legs[..]].concat());
        assert_eq!(names(&verdict.borne), ["stroke used", "leg load"]);
        let ending = said_alike(log);
        let Landing { stands, envelope, table_2, .. } = verdict.landing;
        for (word, holds) in [
            ("STANDS UNDAMAGED", stands),
            ("inside the design envelope of its legs", envelope),
            ("inside Table 2", table_2),
        ] {
            assert_eq!(ending.contains(word), holds, "{ending}");
        }
        let (_, stdout, _) = run(&mut replay("info", log));
        let broken =
            |limits: &[replay::log::VerdictLimit]| limits.iter().filter(|limit| !limit.passed).count();
        let broken = broken(&verdict.envelope) + broken(&verdict.table_2);
        assert_eq!(stdout.matches("is OUTSIDE").count(), broken, "{stdout}");
        // One screen of a console.
        let rows: usize = stdout.lines().map(|line| line.chars().count().div_ceil(80).max(1)).sum();
        assert!(rows <= 25, "{rows} rows: {stdout}");
    }
}

fn aborted(fault: &str) -> Logged {
    from_apogee::fly(&[fault])
}

#[test]
fn an_abort_and_a_parachute_are_called_that() {
    let ending = said_alike(&aborted("abort@3").log);
    assert_eq!(ending, "ABORTED, then DOWN UNDER THE PARACHUTE, not landed");
    let ending = said_alike(&aborted("no-light@0").log);
    assert!(ending.starts_with("DOWN UNDER THE PARACHUTE") || ending.starts_with("NOT LANDED: "), "{ending}");
}

/// A start that the vehicle refuses is no flight; the log says why.
#[test]
fn a_refused_start_is_called_that() {
    use protocol::log::record::{Event, EventLevel, Record};
    use protocol::log::writer::{LogHeader, LogWriter};
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("refused.mcap");
    let header = LogHeader { writer: "test".to_owned(), ..LogHeader::default() };
    let mut log = LogWriter::new(std::fs::File::create(&path).unwrap(), &header).unwrap();
    let event = Event {
        level: EventLevel::Info,
        name: "vehicle".to_owned(),
        message: "REFUSED: pin: in, must be out".to_owned(),
    };
    log.write(&Record::Event(event), 0).unwrap();
    log.finish().unwrap();
    assert_eq!(said_alike(&path), "REFUSED: pin: in, must be out");
}
