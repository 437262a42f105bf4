//! Tests the command lines of `motors` and `card`: their files, their refusals, and that what they write is flown.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn run(directory: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_onboard-sim");
    Command::new(program).current_dir(directory).args(arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn names(directory: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// The built-in motor F10; its header is line 11.
const F10: &str = include_str!("../flight/vehicles/motors/Apogee_F10.eng");

#[test]
fn motors_of_a_folder_are_ranked_into_files_that_are_not_overwritten() {
    let directory = tempfile::tempdir().unwrap();
    let folder = directory.path().join("motors");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("F10.eng"), F10).unwrap();
    fs::write(folder.join("grams.eng"), F10.replace("0.0407 0.0841", "40.7 84.1")).unwrap();
    let arguments = [
        "motors",
        "--mission",
        "mini-f10",
        "--from",
        "motors",
        "--best",
        "1",
        "--flights",
        "1",
        "--csv",
        "motors.csv",
    ];
    let ranked = run(directory.path(), &arguments);
    assert_eq!(ranked.status.code(), Some(0), "{}", stderr(&ranked));
    let table = stdout(&ranked);
    assert!(table.lines().nth(1).unwrap().contains("Apogee F10"), "{table}");
    assert!(table.contains("line 11: propellant mass is '40.7 kg"), "{table}");
    assert!(stderr(&ranked).contains("2 of 2 motors") && stderr(&ranked).contains("1 of 1 flights"));
    let csv = fs::read_to_string(directory.path().join("motors.csv")).unwrap();
    assert_eq!(csv.lines().count(), 3, "{csv}");
    assert_eq!(names(directory.path()), ["motors", "motors.csv"], "nothing unfinished is left");
    let again = run(directory.path(), &arguments);
    assert_eq!(again.status.code(), Some(1));
    assert!(stderr(&again).contains("motors.csv exists already; --force replaces it"), "{}", stderr(&again));
    let forced = run(directory.path(), &[&arguments[..], &["--force", "--jobs", "1"]].concat());
    assert_eq!(forced.status.code(), Some(0), "{}", stderr(&forced));
    assert_eq!(fs::read_to_string(directory.path().join("motors.csv")).unwrap(), csv, "on any threads");
}

#[test]
fn a_folder_without_motors_and_a_wrong_value_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let refused = |arguments: &[&str]| {
        let output = run(directory.path(), arguments);
        assert_ne!(output.status.code(), Some(0), "{arguments:?}");
        stderr(&output)
    };
    assert!(refused(&["motors", "--from", "."]).contains(". holds no file that ends in .eng, .rse or .json"));
    assert!(refused(&["motors", "--from", "no.eng"]).contains("cannot read no.eng"));
    fs::write(directory.path().join("list.json"), "{}").unwrap();
    assert!(refused(&["motors", "--from", "list.json"]).contains("list.json: not a list of motors"));
    assert!(refused(&["motors", "--ballast", "1"]).contains("`1` is not FROM:TO"));
    assert!(refused(&["motors", "--tube", "90"]).contains("--tube 90: must be above 0 and up to 74 mm"));
    assert!(refused(&["card", "--wind", "3,40"]).contains("--wind 40: must be 0 to 30 m/s"));
    assert!(
        refused(&["card", "--wind-from", "400"]).contains("`400` is not a direction of 0 to 360 degrees")
    );
    assert!(refused(&["card", "--mass", "0"]).contains("--mass 0: a mass in kg above 0"));
    assert!(refused(&["card", "--motor", "Z9"]).contains("--motor Z9: neither a motor file nor one of the "));
    let none = refused(&["motors", "--mission", "mini-f10", "--tube", "10"]);
    assert!(none.contains("mini-f10 lands on none of these motors"), "{none}");
    let heavy = refused(&["card", "--mission", "mini-f10", "--mass", "0.6"]);
    assert!(heavy.contains("--mass 0.6: the airframe without its motor weighs 0.746 kg and the motor 0.084"));
    assert_eq!(names(directory.path()), ["list.json"]);
}

#[test]
fn a_card_is_written_whole_shows_what_is_left_and_names_no_rate_of_two_flights() {
    let directory = tempfile::tempdir().unwrap();
    let few = ["--flights", "2", "--hazard-flights", "3"];
    let arguments = [&["card", "--mission", "mk2", "--wind", "6,0", "--wind-from", "225"], &few[..]].concat();
    let written = run(directory.path(), &arguments);
    assert_eq!(written.status.code(), Some(0), "{}", stderr(&written));
    let progress = stderr(&written);
    assert!(progress.contains("12 of 12 flights\n"), "{progress}");
    let card = directory.path().join("card");
    assert_eq!(names(&card), ["card.html", "card.txt", "mission.toml"], "no heavier mk2 stands more");
    let mission = fs::read_to_string(card.join("mission.toml")).unwrap();
    assert_eq!(mission, include_str!("../flight/vehicles/missions/mk2.toml"), "byte for byte");
    let text = fs::read_to_string(card.join("card.txt")).unwrap();
    for expected in [
        "Range safety: mk2, mission ",
        "no radius, no rate and no wind to fly in. Do not fly by this card.",
        "--dispersion real --wind 0,6 --seed 1 --flights 2 --hazard-flights 3",
        "landing motor lit ",
        "Book of station 1 ______ : ______ - ",
        "signature",
        "Landing card: mk2, mission ",
        "3.100 kg",
        "Highest point above the pad",
        "[ ] Weigh the vehicle",
    ] {
        assert!(text.contains(expected), "{expected} in\n{text}");
    }
    assert!(!text.contains(" of 2:") && !text.contains("kinder"), "{text}");
    assert!(stdout(&written).starts_with(&text));
    let html = fs::read_to_string(card.join("card.html")).unwrap();
    assert!(html.contains("<td>3.100 kg</td>") && html.ends_with("</html>\n"), "{html}");

    let again = run(directory.path(), &arguments);
    assert_eq!(again.status.code(), Some(1));
    assert!(stderr(&again).contains("card.html exists already; --force"), "{}", stderr(&again));
}

/// The station refuses a vehicle whose mission has another hash.
#[test]
fn the_mission_of_a_card_is_the_one_that_flies_and_another_mass_is_a_proposal() {
    let directory = tempfile::tempdir().unwrap();
    for (name, mission) in flight::vehicles::mission::BUILTIN {
        let few = ["--wind", "0", "--flights", "1", "--hazard-flights", "1", "--dispersion", "none"];
        let card = [&["card", "--mission", name, "--out", name][..], &few].concat();
        let written = run(directory.path(), &card);
        assert_eq!(written.status.code(), Some(0), "{name}: {}", stderr(&written));
        let file = |file: &str| fs::read_to_string(directory.path().join(name).join(file)).unwrap();
        assert_eq!(file("mission.toml"), *mission, "{name}");
        let hash = protocol::mission::MissionHash::of(mission).to_string();
        assert!(file("card.txt").contains(&hash) && file("card.html").contains(&hash), "{name}");
    }
    let proposed = fs::read_to_string(directory.path().join("mk3/proposal.toml")).unwrap();
    assert!(
        proposed.contains("name = \"mk3-hp-h45w\"") && proposed.contains("loaded_kg = 3.925"),
        "{proposed}"
    );
}

#[test]
fn what_cannot_land_gets_no_card_but_the_reason() {
    let directory = tempfile::tempdir().unwrap();
    let refused = run(directory.path(), &["card", "--mission", "mk2", "--motor", "H42", "--mass", "3.1"]);
    assert_eq!(refused.status.code(), Some(1));
    let words = stderr(&refused);
    let expected = "error: Cesaroni H42 (built in): no landing exists at 3.100 kg; it would land at 2.";
    assert!(words.contains(expected) && words.contains("`onboard-sim motors` ranks"), "{words}");
    let overlap = F10.replace("0.31 22.806", "0.1 22.806");
    fs::write(directory.path().join("bad.eng"), overlap).unwrap();
    let broken = run(directory.path(), &["card", "--mission", "mini-f10", "--motor", "bad.eng"]);
    assert!(
        stderr(&broken).contains("--motor bad.eng: line 15: time is '0.1'; times must"),
        "{}",
        stderr(&broken)
    );
    assert_eq!(names(directory.path()), ["bad.eng"]);
}

#[test]
fn the_help_has_an_example() {
    let directory = tempfile::tempdir().unwrap();
    let hazard = stdout(&run(directory.path(), &["hazard", "--help"]));
    assert!(hazard.contains("[default: real]") && hazard.contains("Example: onboard-sim hazard"), "{hazard}");
    for command in ["motors", "card"] {
        let help = stdout(&run(directory.path(), &[command, "--help"]));
        assert!(help.contains(&format!("Example: onboard-sim {command} --mission mini-f10")), "{help}");
        assert!(help.contains("[default: real]"), "{help}");
    }
}

/// What a person acts on says its set, and a set that may be kinder than `real` says that.
#[test]
fn where_a_vehicle_comes_down_is_told_with_set_flights_interval_and_rule() {
    let directory = tempfile::tempdir().unwrap();
    let few = ["hazard", "--profile", "vlr", "--wind", "0,4", "--flights", "1", "--hazard-flights", "2"];
    let hazard = |more: &[&str]| run(directory.path(), &[&few, more].concat());
    let written = hazard(&["--csv", "hazard.csv", "--svg", "hazard.svg"]);
    assert_eq!(written.status.code(), Some(0), "{}", stderr(&written));
    let text = stdout(&written);
    for expected in [
        "vlr from drone",
        "Set `real`, seed 1",
        "0 m/s",
        "4 m/s: nobody within ",
        "at least: too few flights",
        "ballistic",
        "model rocket",
        "NAR Model Rocket Safety Code",
    ] {
        assert!(text.contains(expected), "{expected} in\n{text}");
    }
    let csv = fs::read_to_string(directory.path().join("hazard.csv")).unwrap();
    assert!(
        csv.starts_with(
            "wind_m_s,way,flight,x_m,y_m,downwind_m,across_m,stands,upright,envelope,table_2\n0,as planned,0,"
        ),
        "{csv}"
    );
    let svg = fs::read_to_string(directory.path().join("hazard.svg")).unwrap();
    for expected in [
        "vlr: where it comes down",
        "rule of NAR: 9 m",
        "0 m/s: nobody within at least ",
        "4 m/s: nobody within at least ",
    ] {
        assert!(svg.contains(expected), "{expected} in\n{svg}");
    }
    let again = hazard(&["--csv", "hazard.csv"]);
    assert!(stderr(&again).contains("hazard.csv exists already; --force"), "{}", stderr(&again));
    let kind = stdout(&hazard(&["--dispersion", "field"]));
    assert!(kind.contains("Set `field`, which may be kinder than `real`, seed 1"), "{kind}");
}
