//! Asks every command about a log of every mission from each of its starts, and which settings of a
//! mission act in a flight.

use std::collections::BTreeMap;
use std::process::Command;

use avionics::log::frame::phase_of;
use flight::rules::phase::Phase;
use flight::vehicle::mission::StartPoint;
use flight::vehicles::mission::BUILTIN;
use protocol::log::computer_v1::ComputerFrame;
use replay::cli::Answer as _;
use replay::controller::AgainError;
use replay::evaluate::evaluate;
use replay::info::info;
use replay::settings::Setting;
use replay::verify::explain::explain;
use sim::dispersion::Dispersion;
use sim::recipe::Recipe;

use crate::command_line::run;
use crate::simulated::{Simulated, simulate_recipe, to_nobody};
use crate::station::station_log;
use crate::test_missions::TEST_MISSIONS;

/// An exit code, and what the answer says; what begins with `!` is what it does not say.
type Answer = (i32, &'static [&'static str]);

/// A command, and how it answers about a landing, about an abort before the burn, and about a start
/// that was refused.
struct Row {
    command: &'static str,
    landed: Answer,
    aborted: Answer,
    refused: Answer,
}

const fn row(command: &'static str, landed: Answer, aborted: Answer, refused: Answer) -> Row {
    Row { command, landed, aborted, refused }
}

/// What no answer says: a vehicle flies in space.
const NEVER: [&str; 6] = [" plane ", " plane.", " plane,", "Across it", "undefined", "panicked"];

const NO_FLIGHT: Answer = (1, &["has no frames of a flight computer after its release"]);
const NO_BOOK: Answer = (5, &["no book in these logs: only a ground station writes one"]);
const IDENTICAL: Answer = (0, &["{frames} of {frames} frames identical\n", "!INCOMPLETE", "!DIVERGED"]);
const UNFLOWN: Answer =
    (0, &["{frames} of {frames} frames identical of an INCOMPLETE flight: ends on the pad", "!DIVERGED"]);
const TABLES: Answer = (0, &["computer_frame.", ": {frames} rows of "]);
const RECEIVED_ONLY: Answer = (5, &["nothing was compared: it has no frames of a flight computer"]);
const COMPLETE: Answer = (0, &["the log was whole: nothing is lost", "!warning"]);

const REPLAY: &str = env!("CARGO_BIN_EXE_replay");

/// Rows run in this order: some read a file that an earlier row wrote.
const TABLE: [Row; 16] = [
    row(
        "info --again {log}",
        (0, &["verdict     STANDS UNDAMAGED", "its mission {mission}\n", "complete    yes", " plans; CPU"]),
        (0, &["verdict     ABORTED", "abort of the crew", "its mission {mission}\n", "complete    yes"]),
        (
            0,
            &[
                "verdict     REFUSED: controller warm",
                "its mission {mission}\n",
                "not ready: controller warm",
            ],
        ),
    ),
    row(
        "info {log} --json",
        (0, &["\"profile\": \"{mission}\"", "\"stands\": true"]),
        (0, &["\"profile\": \"{mission}\"", "\"stands\": false"]),
        (0, &["\"profile\": \"{mission}\"", "REFUSED: controller warm"]),
    ),
    row("verify {log} --strict", IDENTICAL, IDENTICAL, (3, UNFLOWN.1)),
    row(
        "verify {log} --explain {planned}",
        (0, &["POWERED", ": the judge ", "now: identical bit for bit", "\nflown ", "\njudge ", "m north"]),
        (0, &["this frame plans no landing; no frame of this log does", "now: identical bit for bit"]),
        NO_FLIGHT,
    ),
    row("verify {log} --book", NO_BOOK, NO_BOOK, NO_BOOK),
    row(
        "evaluate {log} --set powered.weights.theta=333",
        (
            0,
            &[
                "open loop",
                "with powered.weights.theta=333\n",
                "!no command differs",
                "!with nothing changed",
            ],
        ),
        (0, &["no command differs: powered.weights.theta=333 did not act in this flight"]),
        NO_FLIGHT,
    ),
    row(
        "refly {log}",
        (
            0,
            &["closed loop", " recorded frames identical", "stands undamaged", "the verdict does not change"],
        ),
        (1, &["no frame of a landing to start from"]),
        NO_FLIGHT,
    ),
    row(
        "compare {log} {log}",
        (0, &["is like", "are identical", "stands undamaged"]),
        (0, &["is like", "are identical", "not landed"]),
        (3, &["is NOT like", "is of an INCOMPLETE flight"]),
    ),
    row(
        "report {log} --out -",
        (0, &["STANDS UNDAMAGED", "{mission}", "Place, north up", "!NaN"]),
        (0, &["ABORTED", "{mission}", "abort of the crew", "!NaN"]),
        (0, &["REFUSED: controller warm", "{mission}", "!NaN"]),
    ),
    row("export {log} --out {dir}/csv", TABLES, TABLES, TABLES),
    row(
        "info {dir}/station.mcap",
        (0, &["verdict     STANDS UNDAMAGED"]),
        (0, &["verdict     ABORTED"]),
        (0, &["verdict     NOT FLOWN: the log ends in PAD_IDLE"]),
    ),
    row("verify {dir}/station.mcap", RECEIVED_ONLY, RECEIVED_ONLY, RECEIVED_ONLY),
    row(
        "fit {log}",
        (0, &["{mission} with ", "thrust_scale", "gimbal_delay"]),
        (0, &["{mission} with ", "drag_per_mass_scale"]),
        (1, &["has no frames of a flight computer"]),
    ),
    row("recover {log} {dir}/whole.mcap", COMPLETE, COMPLETE, COMPLETE),
    row("verify {dir}/whole.mcap", IDENTICAL, IDENTICAL, UNFLOWN),
    row("recover {log} {dir}/whole.mcap", COMPLETE, COMPLETE, COMPLETE),
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Ends {
    Landed,
    Aborted,
    Refused,
}

/// A flight with its log.
struct Case {
    mission: &'static str,
    name: String,
    ends: Ends,
    flown: Simulated,
    /// Of the log.
    frames: u64,
    /// A frame that plans, in the middle of the burn; without a burn the frame in the middle of the
    /// flight.
    planned: u64,
}

impl Case {
    fn fly(mission: &'static str, start: StartPoint, fault: Option<&str>, ends: Ends) -> Self {
        let fly = |seed| {
            let recipe = recipe(mission).starting_at(start).unwrap();
            let faults = fault.iter().map(|fault| fault.parse().unwrap()).collect();
            to_nobody(|link| simulate_recipe(Recipe { faults, seed, ..recipe }, &[link]))
        };
        // Not every flight lands: a gate may stay shut.
        let stands = |flown: &Simulated| info(&flown.log).unwrap().verdict.unwrap().landing.stands;
        let flown = match ends {
            Ends::Landed => (1..=4).map(fly).find(stands).expect("one flight in four lands"),
            Ends::Aborted | Ends::Refused => fly(1),
        };
        let recording = flown.recording();
        let burns = |frame: &&ComputerFrame| phase_of(&frame.output) == Some(Phase::Powered);
        let mut middle: Vec<&ComputerFrame> = recording.frames.iter().filter(burns).collect();
        if middle.is_empty() {
            middle = recording.frames.iter().collect();
        }
        let planned = middle.get(middle.len() / 2).map_or(0, |frame| {
            let number = recording.release_frame + frame.input.frame;
            explain(&recording, number).unwrap().nearest_planned.unwrap_or(number)
        });
        let frames = info(&flown.log).unwrap().frames.unwrap().last;
        let name = format!("{mission} from {} with {fault:?}", start.name());
        station_log(&flown.log, "station.mcap");
        Self { mission, name, ends, flown, frames, planned }
    }

    /// What is wrong in the answer to a row.
    fn check(&self, row: &Row) -> Vec<String> {
        let names: BTreeMap<&str, String> = BTreeMap::from([
            ("{log}", self.flown.log.display().to_string()),
            ("{dir}", self.flown.log.parent().unwrap().display().to_string()),
            ("{mission}", self.mission.to_owned()),
            ("{frames}", self.frames.to_string()),
            ("{planned}", self.planned.to_string()),
        ]);
        let fill = |text: &str| names.iter().fold(text.to_owned(), |text, (name, is)| text.replace(name, is));
        let mut command = Command::new(REPLAY);
        let (code, stdout, stderr) = run(command.args(row.command.split(' ').map(fill)));
        let (expected, says) = match self.ends {
            Ends::Landed => row.landed,
            Ends::Aborted => row.aborted,
            Ends::Refused => row.refused,
        };
        let said = stdout.clone() + &stderr;
        let mut wrong = Vec::new();
        if code != expected {
            wrong.push(format!("exit code {code} and not {expected}"));
        }
        for text in says.iter().copied().map(fill) {
            match text.strip_prefix('!') {
                Some(text) if said.contains(text) => wrong.push(format!("says {text:?}")),
                None if !said.contains(&text) => wrong.push(format!("does not say {text:?}")),
                _ => {}
            }
        }
        wrong.extend(NEVER.iter().filter(|text| said.contains(**text)).map(|text| format!("says {text:?}")));
        if self.ends != Ends::Refused && expected == 0 && said.contains("warning") {
            wrong.push("warns of a whole log".to_owned());
        }
        if row.command.ends_with("--json")
            && let Err(error) = serde_json::from_str::<serde_json::Value>(&stdout)
        {
            wrong.push(error.to_string());
        }
        let answer: String = said.chars().take(2_000).collect();
        wrong.iter().map(|wrong| format!("{}: {}: {wrong}:\n{answer}", self.name, row.command)).collect()
    }
}

/// A built-in mission, or one that only tests fly, in `field`.
fn recipe(mission: &str) -> Recipe {
    let mut missions = BUILTIN.iter().chain(&TEST_MISSIONS);
    let mission = *missions.find(|(available, _)| *available == mission).unwrap();
    Recipe::from_texts(mission, ("field", Dispersion::builtin_toml("field").unwrap())).unwrap()
}

/// A mission's flights from each of its starts. Those that are let go by a drone refuse to be
/// dropped from where their apogee would be: it is too low for a plan.
fn flights(mission: &'static str) -> Vec<Case> {
    let recipe = recipe(mission);
    let own = recipe.mission.start.at;
    let starts = [StartPoint::Apogee, StartPoint::Pad, StartPoint::Drone];
    let has = starts.into_iter().filter(|start| recipe.clone().starting_at(*start).is_ok());
    has.map(|start| {
        let refused = own == StartPoint::Drone && start == StartPoint::Apogee;
        Case::fly(mission, start, None, if refused { Ends::Refused } else { Ends::Landed })
    })
    .collect()
}

/// Does work for each item side by side.
fn side_by_side<T: Send, R: Send>(
    items: impl IntoIterator<Item = T>,
    work: impl Fn(T) -> Vec<R> + Sync,
) -> Vec<R> {
    std::thread::scope(|scope| {
        let work = &work;
        let threads: Vec<_> = items.into_iter().map(|item| scope.spawn(move || work(item))).collect();
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    })
}

#[test]
fn every_command_answers_about_every_mission() {
    let mut cases = side_by_side(BUILTIN.iter().chain(&TEST_MISSIONS), |(mission, _)| flights(mission));
    let faults = [("abort@3", Ends::Aborted), ("lidar-out@3", Ends::Landed)];
    cases.extend(faults.map(|(fault, ends)| Case::fly("mk3", StartPoint::Apogee, Some(fault), ends)));
    assert_eq!(cases.len(), 16, "7 from apogee, 2 from the pad, 5 below a drone, 2 with a fault");
    let wrong = side_by_side(&cases, |case| TABLE.iter().flat_map(|row| case.check(row)).collect());
    assert!(wrong.is_empty(), "{} answers are wrong:\n{}", wrong.len(), wrong.join("\n\n"));
}

/// Limits that the flight keeps away from: changed by half they change no command. With this value
/// each of them acts.
const DO_NOT_ACT: [(&str, f64, &str); 15] = [
    ("ignition.late_s", 0.0, "the band of heights has room for igniters that are late by half as much again"),
    (
        "powered.contact_quiet_s",
        3.0,
        "a nose that leans by less than what a foot may touch with is held as it is",
    ),
    ("powered.max_passes", 100.0, "no tick needs as much work"),
    ("powered.max_solves", 1.0, "no tick needs a third one"),
    ("powered.weights.q", 100.0, "no factor changes a zero"),
    ("powered.weights.u", 100.0, "no factor changes a zero"),
    ("powered.weights.w", 100.0, "no factor changes a zero"),
    ("powered.weights.z", 100.0, "no factor changes a zero"),
    ("powered.upright_lean_max_deg", 0.1, "at the end of a plan there is little velocity to be lost"),
    ("powered.homing.near_m", 100.0, "what lands farther out comes as near as its reach allows"),
    (
        "powered.landing_miss",
        1e-9,
        "every plan that converges ends in its box; the level is reported and steers nothing",
    ),
    ("powered.latest_after_s", 0.1, "no plan ends so late"),
    ("powered.solver.max_iterations", 2.0, "no solve needs as many"),
    ("aim.disturbance_max_rad_s2", 0.1, "nothing turns the vehicle as hard"),
    ("ignition.arm_before_s", 1.0, "it is armed when the fall is predicted, which is later"),
];

/// The numbers of a section times a factor. Of the scales in a list it is their distance from 1
/// that is multiplied.
fn changed(prefix: &str, value: &toml::Value, factor: f64) -> Vec<Setting> {
    let scaled = |number: f64| number * factor;
    let value = match value {
        toml::Value::Table(table) => {
            return table
                .iter()
                .flat_map(|(key, value)| changed(&format!("{prefix}.{key}"), value, factor))
                .collect();
        }
        toml::Value::Float(number) => scaled(*number).into(),
        toml::Value::Integer(number) => (scaled(*number as f64) as i64).into(),
        toml::Value::Array(scales) => scales
            .iter()
            .map(|scale| toml::Value::from(1.0 + scaled(scale.as_float().unwrap() - 1.0)))
            .collect::<Vec<_>>()
            .into(),
        _ => return Vec::new(),
    };
    vec![Setting { path: prefix.to_owned(), value, at_s: None }]
}

/// A setting that nothing reads would be accepted, and change nothing without a word.
#[test]
fn a_setting_of_the_landing_acts_or_is_reported_as_inactive() {
    let recipe = Recipe::built_in("mk3", "real").unwrap().starting_at(StartPoint::Pad).unwrap();
    let mission = toml::Table::try_from(&recipe.mission).unwrap();
    let flown = simulate_recipe(recipe, &[]);
    let recording = flown.recording();
    let of = |factor: f64| {
        let sections = ["powered", "aim", "descent", "ignition"];
        sections
            .into_iter()
            .flat_map(|section| changed(section, &mission[section], factor))
            .collect::<Vec<_>>()
    };
    let settings: Vec<(Setting, Setting)> = of(1.5).into_iter().zip(of(1.0 / 1.5)).collect();
    assert!(settings.len() > 45, "{}", settings.len());
    let idle = side_by_side(settings.chunks(settings.len().div_ceil(4)), |settings| {
        let mut idle = Vec::new();
        for (more, less) in settings {
            let acts = |setting: &Setting| {
                let report = match evaluate(&recording, std::slice::from_ref(setting)) {
                    Ok(report) => report,
                    Err(refusal @ (AgainError::Frame(_) | AgainError::Setting(_))) => {
                        let key = setting.path.rsplit('.').next().unwrap();
                        assert!(refusal.to_string().contains(key), "{refusal}");
                        return None;
                    }
                    Err(refusal) => panic!("{setting}: {refusal}"),
                };
                let said = report.sentences().join("\n");
                let acts = report.frames.iter().any(|frame| {
                    let (recorded, evaluated) = (&frame.recorded, &frame.evaluated);
                    recorded.gimbal_rad != evaluated.gimbal_rad
                        || recorded.fins_rad != evaluated.fins_rad
                        || recorded.phase != evaluated.phase
                });
                let inactive = format!("no command differs: {} ", report.settings.join(" "));
                assert_eq!(said.contains(&inactive), !acts, "{said}");
                Some(acts)
            };
            let found = [acts(more), acts(less)];
            assert!(found != [None, None], "{more}, {less}: neither is accepted");
            if !found.contains(&Some(true)) {
                idle.push(more.path.clone());
            }
        }
        idle
    });
    // Which of these act in one flight depends on the flight.
    let unnamed: Vec<_> =
        idle.iter().filter(|path| DO_NOT_ACT.iter().all(|(known, ..)| known != path)).collect();
    assert!(unnamed.is_empty(), "{unnamed:?}");
    let unread = side_by_side(DO_NOT_ACT, |(path, acts, _)| {
        let set = Setting { path: path.to_owned(), value: acts.into(), at_s: None };
        let report = evaluate(&recording, &[set]).unwrap();
        let differs = report.frames.iter().any(|frame| frame.recorded != frame.evaluated);
        if differs { Vec::new() } else { vec![path] }
    });
    assert_eq!(unread, [""; 0], "no value of these changes anything: nothing reads them");
}
