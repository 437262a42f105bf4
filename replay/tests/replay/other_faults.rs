//! Tests counterfactuals: a flight flown again with other faults is the flight that had those
//! faults.

use replay::info::info;
use replay::log::{Moment, Recording};
use replay::refly::{FaultChanges, ReflyOptions, refly, refly_flight, write_log};
use replay::report::report;
use replay::verify::{Verification, verify};

use crate::command_line::{data, refusal, replay, run};
use crate::flown::only;
use crate::from_apogee::{self, LANDED};

fn changed(with: &[&str], without: &[&str]) -> ReflyOptions {
    let owned = |given: &[&str]| given.iter().map(|text| (*text).to_owned()).collect();
    ReflyOptions {
        faults: FaultChanges { with: owned(with), without: owned(without) },
        ..ReflyOptions::default()
    }
}

/// Adding a fault to the healthy flight, and leaving it out of the broken one, give each other's
/// verdict bit for bit.
#[test]
fn the_same_flight_with_and_without_a_fault() {
    const FAULTS: [&str; 2] = ["weak-motor:0.8@ignition", "gnss-out@5"];
    let broken = from_apogee::fly(&FAULTS);
    let (healthy, broken) = (Recording::open(&LANDED.log).unwrap(), Recording::open(&broken.log).unwrap());
    assert_ne!(healthy.verdict, broken.verdict);
    for start in [None, Some(Moment::Frame(1))] {
        let without = ReflyOptions { start, ..changed(&[], &["weak-motor", "gnss-out@5"]) };
        let report = refly(&broken, &without).unwrap();
        assert_eq!(report.reflown, healthy.verdict, "{start:?}");
        assert!(report.recorded.is_some() && report.faults == without.faults);
        let with = ReflyOptions { start, ..changed(&FAULTS, &[]) };
        assert_eq!(refly(&healthy, &with).unwrap().reflown, broken.verdict);
    }
    let report = refly(&broken, &changed(&[], &["all"])).unwrap();
    assert_eq!(report.reflown, healthy.verdict);
    assert_eq!(
        report.verdict_changed,
        Some(healthy.verdict.unwrap().landing.stands != broken.verdict.unwrap().landing.stands)
    );
}

/// Its log says which faults it was flown with, and verifies.
#[test]
fn a_counterfactual_is_a_log_that_verifies() {
    let recording = Recording::open(&LANDED.log).unwrap();
    let options = changed(&["fin-stuck:1@3"], &[]);
    let (_, flown) = refly_flight(&recording, &options).unwrap();
    let path = LANDED.beside("fault.mcap");
    write_log(&path, &recording, &flown).unwrap();
    assert_eq!(only(verify(&path).unwrap()).outcome, Verification::Identical);
    assert_eq!(Recording::open(&path).unwrap().head.run["faults"], "fin-stuck:1@3");
}

#[test]
fn a_fault_that_cannot_be_is_refused_with_what_could() {
    for (arguments, words) in [
        (["--without-fault", "gnss-out"], "no fault `gnss-out` to leave out; it was flown with no faults"),
        (["--fault", "gnss-gone@5"], "fault `gnss-gone@5`"),
    ] {
        let refused = refusal(replay("refly", &LANDED.log).args(arguments));
        assert!(refused.contains(words), "{refused}");
    }
    let (code, report) = data(replay("refly", &LANDED.log).args(["--fault", "no-light@0"]));
    assert_eq!((code, &report["faults"]["with"][0]), (0, &"no-light@0".into()));
    assert_eq!(report["verdict_changed"], true);
}

/// What broke is the first finding, in the description as text and as JSON; a landing with nothing
/// broken has none.
#[test]
fn a_description_lists_findings_in_order_of_time() {
    for (fault, words) in [
        ("gnss-out@3", "GNSS lost for "),
        ("gimbal-jams:4@powered", "gimbal pitch 10.8 deg from where its commands take it, at 3.7 deg"),
        ("weak-motor:0.8@ignition", "landing motor's impulse 0.8"),
    ] {
        let broken = from_apogee::fly(&[fault]);
        let found = info(&broken.log).unwrap().findings.unwrap();
        assert!(found[0].words.starts_with(words), "{found:?}");
        let (_, stdout, _) = run(&mut replay("info", &broken.log));
        assert!(stdout.contains(&format!("findings    T+{:.2} s {words}", found[0].since_s)), "{stdout}");
        let (_, json) = data(&mut replay("info", &broken.log));
        assert_eq!(json["findings"][0]["words"], found[0].words);
    }
    let cut = LANDED.beside("cut.mcap");
    let whole = std::fs::read(&LANDED.log).unwrap();
    std::fs::write(&cut, &whole[..whole.len() / 2]).unwrap();
    for (log, none) in [(&LANDED.log, "none\n"), (&cut, "none up to where the record ends\n")] {
        assert_eq!(info(log).unwrap().findings, Some(Vec::new()));
        let (_, stdout, _) = run(&mut replay("info", log));
        assert!(stdout.contains(&format!("\nfindings    {none}")), "{stdout}");
    }
}

/// A vehicle that is not cleared to fly has said why.
#[test]
fn a_wait_that_ends_on_the_pad_has_findings() {
    let crew = crate::from_power_up::armed_and_started(60_000);
    let waited = crate::from_power_up::Flown::from(
        flight::vehicle::mission::StartPoint::Pad,
        &crew[..1],
        &["gnss-out@pad+1"],
    );
    let log = waited.log();
    let found = info(&log).unwrap().findings.unwrap();
    let lost = found.iter().find(|finding| finding.words.contains("no GNSS fix")).expect("GNSS is lost");
    assert!(lost.since().to_string().starts_with("log "), "{found:?}");
    // The report has the same on the same clock.
    let page = report(&log).unwrap().html;
    assert!(
        page.contains(&format!("<b>{:.2}</b>", lost.since())) && !page.contains("Nothing was looked for")
    );
}

/// Findings on the pad of a flight that was armed twice come before those in the air.
#[test]
fn findings_begin_on_the_pad() {
    let mut crew = crate::from_power_up::armed_and_started(1_200);
    crew.extend(crate::from_power_up::armed_and_started(2_400).split_off(1));
    let flown = crate::from_power_up::Flown::from(
        flight::vehicle::mission::StartPoint::Pad,
        &crew,
        &["reboot:0.2@pad+7", "gimbal-stuck@powered"],
    );
    let found = info(&flown.log()).unwrap().findings.unwrap();
    assert!(found.is_sorted_by_key(|finding| finding.since_s), "{found:?}");
    let restart = found.iter().find(|finding| finding.words.contains("has restarted")).expect("it restarts");
    assert!(restart.since().to_string().starts_with("T-"), "{found:?}");
    assert!(found.last().unwrap().since_s > 0.0, "{found:?}");
}

/// A log whose decisions this build does not make has no findings, because they would be about
/// other commands.
#[test]
fn findings_are_not_looked_for_where_the_decisions_are_not_made_again() {
    let path = LANDED.beside("otherwise.mcap");
    let mut held = crate::tampered::Held::read(&LANDED.log);
    let message = held.messages.iter_mut().rfind(|message| message.is_frame()).unwrap();
    let mut frame =
        <protocol::log::computer_v1::ComputerFrame as prost::Message>::decode(message.data.as_slice())
            .unwrap();
    frame.output.fins_rad[0] += 0.1;
    message.data = prost::Message::encode_to_vec(&frame);
    held.write(&path);
    assert_eq!(info(&path).unwrap().findings, None);
}
