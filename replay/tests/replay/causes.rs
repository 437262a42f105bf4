//! The findings of broken flights.

use flight::vehicle::mission::StartPoint;
use replay::info::{Info, info};
use replay::report::report;
use sim::recipe::Recipe;

use crate::command_line::{replay, run};
use crate::from_apogee::fly_recipe;
use crate::simulated::{Simulated, simulate_recipe};

fn recipe(mission: &str, seed: u64, fault: &str) -> Recipe {
    let recipe = Recipe::built_in(mission, "real").unwrap();
    Recipe { seed, faults: vec![fault.parse().unwrap()], ..recipe }
}

fn from_the_pad(seed: u64, fault: &str) -> Simulated {
    simulate_recipe(recipe("mk3", seed, fault).starting_at(StartPoint::Pad).unwrap(), &[])
}

fn words(info: &Info) -> Vec<&str> {
    info.findings.iter().flatten().map(|finding| finding.words.as_str()).collect()
}

/// A computer that is built at the release lacks what the pad left in the recorded one's memory,
/// and decides otherwise.
#[test]
fn the_computer_of_a_log_is_run_from_its_power_up() {
    for (seed, fault, fin) in [(1, "reversed:3@0", "fin 1"), (4, "reversed:5@0", "fin 3")] {
        let flown = from_the_pad(seed, fault);
        let found = info(&flown.log).unwrap();
        assert_eq!(found.not_looked_for, None);
        assert!(words(&found)[0].starts_with(fin), "{seed} {fault}: {found:?}");
        let page = report(&flown.log).unwrap().html;
        assert!(page.contains(&format!("First sign: {fin}")), "{seed} {fault}");
    }
}

/// A computer that was away in the burn measures a weak motor and a late ignition, of any motor.
#[test]
fn a_restart_in_the_burn_is_named_and_not_the_motor() {
    for seed in 1..=6 {
        let flown = fly_recipe(&recipe("mk3", seed, "reboot:0.3@powered"));
        let found = info(&flown.log).unwrap();
        let words = words(&found);
        assert!(words[0].starts_with("flight computer away for 0.3"), "{seed}: {words:?}");
        assert!(words.iter().all(|words| !words.contains("landing motor")), "{seed}: {words:?}");
        // Timeline and end state have it, too.
        let reset = found.phases[0].spans.iter().find(|span| span.phase == "RESET").unwrap();
        assert!((reset.until_s - reset.from_s - 0.3).abs() < 0.02, "{seed}: {reset:?}");
        let ending = found.ending.as_ref().unwrap();
        assert!(ending.ends_with("; after 1 RESET of the flight computer in flight"), "{seed}: {ending}");
        let page = report(&flown.log).unwrap().html;
        assert!(page.contains("<path class=\"reset\"") && page.contains(ending), "{seed}");
    }
}

/// A vehicle that falls over or strikes the ground with its body has a finding, however its limits
/// are.
#[test]
fn no_crash_is_without_a_finding() {
    let mut crashes = 0;
    for (mission, fault) in [("mk3", "gyro-step:25@powered"), ("vlr", "barometer-ramp:5@apogee")] {
        for seed in 1..=4 {
            let flown = fly_recipe(&recipe(mission, seed, fault));
            let found = info(&flown.log).unwrap();
            let verdict = found.verdict.as_ref().unwrap();
            if verdict.landing.upright {
                continue;
            }
            crashes += 1;
            let failure = verdict.ending.strip_prefix("NOT LANDED: ").unwrap();
            let last = *words(&found).last().unwrap();
            assert!(last.starts_with(failure), "{mission} {seed}: {failure}: {found:?}");
        }
    }
    assert!(crashes >= 6, "{crashes}");
}

/// The vehicle's own findings suffice for a landing without any, and a computer that is run again
/// finds the same.
#[test]
fn a_landing_without_a_finding_is_described_without_running_its_computer() {
    let log = &crate::simulated::WITH_FRAMES.log;
    let recorded = info(log).unwrap();
    assert_eq!((words(&recorded), recorded.not_looked_for.as_deref()), (vec![], None));
    assert_eq!(recorded.frames.unwrap().solver_work, None);
    let (code, stdout, stderr) = run(replay("info", log).args(["--again", "--json"]));
    let again: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, again["findings"].as_array().unwrap().len()), (0, 0), "{stderr}");
    assert!(again["frames"]["solver_work"]["plans"].as_u64().unwrap() > 10, "{stdout}");
}

/// A vehicle without its lidar sends one finding, the same as that of its computer run again.
#[test]
fn the_only_finding_that_a_vehicle_sent_is_that_of_its_computer_run_again() {
    let fly = |link| simulate_recipe(recipe("mk3", 6, "lidar-out@descent"), &[link]);
    let flown = crate::simulated::to_nobody(fly);
    let recorded = info(&flown.log).unwrap();
    assert_eq!(recorded.frames.unwrap().solver_work, None, "it was run again");
    let (_, stdout, _) = run(replay("info", &flown.log).args(["--again", "--json"]));
    let again: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    let [found] = again["findings"].as_array().unwrap().as_slice() else { panic!("{again}") };
    assert_eq!(words(&recorded), [found["words"].as_str().unwrap()]);
    let since_s = recorded.findings.as_ref().unwrap()[0].since_s;
    assert!((since_s - found["since_s"].as_f64().unwrap()).abs() < 1e-3, "{since_s}");
}

/// A cell that is empty would look like a healthy flight.
#[test]
fn a_table_of_logs_states_what_was_looked_for() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(&crate::from_apogee::LANDED.log, folder.path().join("a.mcap")).unwrap();
    std::fs::copy(&crate::simulated::WITH_FRAMES.log, folder.path().join("b.mcap")).unwrap();
    crate::station::station_log(&folder.path().join("b.mcap"), "c.mcap");
    let (code, stdout, stderr) = run(replay("info", folder.path()).arg("--json"));
    let flown: Vec<serde_json::Value> = serde_json::from_str(&stdout).unwrap();
    let findings: Vec<&str> = flown.iter().map(|flown| flown["finding"].as_str().unwrap()).collect();
    assert_eq!((code, findings), (0, vec!["none"; 3]), "{stderr}");
}
