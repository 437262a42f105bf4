//! Tests that every answer says the same of how a flight ended.

use flight::rules::verdict::Landing;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1::LimitResult;
use protocol::log::writer::{LogHeader, LogWriter};
use replay::cli::Answer as _;
use replay::info::info;
use replay::report::report;

use crate::from_apogee::{LANDED, fly};
use crate::simulated::MK2;

/// The sentence of `info`, after checking that text and page say it, too.
fn same_ending(log: &std::path::Path) -> String {
    let info = info(log).unwrap();
    let ending = info.ending.clone().unwrap();
    let row = format!("verdict     {ending}");
    assert!(info.sentences().iter().any(|line| line.starts_with(&row)), "{ending}: {info:?}");
    assert!(report(log).unwrap().html.contains(&format!("\">{ending}</h1>")), "{ending}");
    ending
}

#[test]
fn both_verdicts_are_shown_with_broken_limits_only() {
    for log in [&LANDED.log, &MK2.log] {
        let info = info(log).unwrap();
        let verdict = info.verdict.as_ref().unwrap();
        let names =
            |limits: &[LimitResult]| limits.iter().map(|limit| limit.name.clone()).collect::<Vec<_>>();
        let of_legs = ["vertical speed", "lateral speed", "tilt", "rotation rate"];
        assert_eq!(names(&verdict.envelope), of_legs);
        assert_eq!(names(&verdict.table_2), [&["distance", "height"], &of_legs[..]].concat());
        assert_eq!(names(&verdict.borne), ["stroke used", "leg load"]);
        let ending = same_ending(log);
        let Landing { stands, envelope, table_2, .. } = verdict.landing;
        let words = ["STANDS UNDAMAGED", "inside the design envelope of its legs", "inside Table 2"];
        assert_eq!(words.map(|word| ending.contains(word)), [stands, envelope, table_2], "{ending}");
        let said = info.sentences();
        let outside = said.iter().filter(|line| line.contains("is OUTSIDE")).count();
        let limits = verdict.envelope.iter().chain(&verdict.table_2);
        assert_eq!(outside, limits.filter(|limit| !limit.passed).count(), "{said:?}");
        // One screen of a console.
        let rows: usize = said.iter().map(|line| line.chars().count().div_ceil(80).max(1)).sum();
        assert!(rows <= 25, "{rows} rows: {said:?}");
    }
}

#[test]
fn an_abort_and_a_parachute_are_called_that() {
    let ending = same_ending(&fly(&["abort@3"]).log);
    assert_eq!(ending, "ABORTED, then DOWN UNDER THE PARACHUTE, not landed");
    let ending = same_ending(&fly(&["no-light@0"]).log);
    assert!(ending.starts_with("DOWN UNDER THE PARACHUTE") || ending.starts_with("NOT LANDED: "), "{ending}");
}

/// A start that the vehicle refuses is no flight; the log says why.
#[test]
fn a_refused_start_is_called_that() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("refused.mcap");
    let header = LogHeader { writer: "test".to_owned(), ..LogHeader::default() };
    let mut log = LogWriter::new(std::fs::File::create(&path).unwrap(), &header).unwrap();
    let (name, message) = ("vehicle".to_owned(), "REFUSED: pin: in, must be out".to_owned());
    log.write(&Record::Event(Event { level: EventLevel::Info, name, message }), 0).unwrap();
    log.finish().unwrap();
    assert_eq!(same_ending(&path), "REFUSED: pin: in, must be out");
}
