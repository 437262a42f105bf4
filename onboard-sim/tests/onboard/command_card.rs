//! Tests the command lines of `check`, `card` and `hazard`: their answers, files and refusals, and
//! that what they write is flown.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

pub(crate) fn run(directory: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_onboard-sim");
    Command::new(program).current_dir(directory).args(arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The answer of a command with `--json`.
fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", stderr(output)))
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
const F10: &str = include_str!("../../flight/vehicles/motors/Apogee_F10.eng");

#[test]
fn a_check_answers_with_its_worst_word_and_names_motors_that_cannot_be_used() {
    let directory = tempfile::tempdir().unwrap();
    let folder = directory.path().join("motors");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("F10.eng"), F10).unwrap();
    fs::write(folder.join("grams.eng"), F10.replace("0.0407 0.0841", "40.7 84.1")).unwrap();
    let none = ["--flights", "0", "--from", "motors"];
    let good = run(directory.path(), &[&["check", "mk3"], &none[..]].concat());
    assert_eq!(good.status.code(), Some(0), "{}", stderr(&good));
    let page = stdout(&good);
    assert!(page.starts_with("mk3: 3.700 kg on HP-H45W") && !page.contains("flights"), "{page}");
    let words = stderr(&good);
    assert!(words.contains("grams.eng: line 11: propellant mass is '40.7 kg"), "{words}");
    let quiet = run(directory.path(), &[&["-q", "check", "mk3"], &none[..]].concat());
    assert_eq!((stdout(&quiet), stderr(&quiet)), (stdout(&good), String::new()));
    let mk3 = include_str!("../../flight/vehicles/missions/mk3.toml");
    fs::write(directory.path().join("heavy.toml"), mk3.replace("loaded_kg = 3.7", "loaded_kg = 5.0"))
        .unwrap();
    let answer = json(&run(directory.path(), &[&["check", "mk3", "--json"], &none[..]].concat()));
    let rows = answer["rows"].as_array().unwrap();
    assert!(page.ends_with(&format!("\n{}\n", answer["verdict"].as_str().unwrap())), "{answer}");
    assert!(rows.iter().all(|row| page.contains(row["found"].as_str().unwrap())), "{answer}");
    let heavy = run(directory.path(), &[&["check", "heavy.toml"], &none[..]].concat());
    assert_eq!(heavy.status.code(), Some(3), "{}", stderr(&heavy));
    let page = stdout(&heavy);
    assert!(page.contains("no    impulse    too heavy for its motor") && page.ends_with("\nno\n"), "{page}");
    fs::write(directory.path().join("weak.toml"), mk3.replace("force_n = 90.0", "force_n = 10.0")).unwrap();
    let weak = run(directory.path(), &["check", "weak.toml"]);
    assert_eq!(weak.status.code(), Some(1));
    assert!(stderr(&weak).contains("airframe.legs.crush.force_n = 10: must"), "{}", stderr(&weak));
}

#[test]
fn a_folder_without_motors_and_a_wrong_value_are_named() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("list.json"), "{}").unwrap();
    for (arguments, words) in [
        (["check", "mk3", "--from", "no.eng"], "no.eng: cannot be read"),
        (["check", "mk3", "--from", "list.json"], "list.json: not a list of motors"),
        (
            ["card", "--wind", "3,40", "--seed=1"],
            "'40' for '--wind <M/S,...>': must be a number from 0 to 30",
        ),
        (["card", "--wind-from", "400", "--seed=1"], "`400` is not a direction of 0 to 360 degrees"),
        (["fly", "--speed", "0", "--seed=1"], "speed `0`: must be `max` or a factor"),
    ] {
        let output = run(directory.path(), &arguments);
        assert_ne!(output.status.code(), Some(0), "{arguments:?}");
        assert!(stderr(&output).contains(words), "{arguments:?}: {}", stderr(&output));
    }
    let empty = tempfile::tempdir().unwrap();
    let refused = run(empty.path(), &["check", "mk3", "--from", "."]);
    assert!(stderr(&refused).contains(". holds no file that ends in .eng, .rse or .json"), "{refused:?}");
    assert_eq!(names(directory.path()), ["list.json"]);
}

#[test]
fn a_card_is_complete_shows_the_time_left_and_gives_no_rate_of_two_flights() {
    let directory = tempfile::tempdir().unwrap();
    let few = ["--flights", "2", "--hazard-flights", "3"];
    let arguments = [&["card", "--mission", "mk2", "--wind", "6,0", "--wind-from", "225"], &few[..]].concat();
    let written = run(directory.path(), &arguments);
    assert_eq!(written.status.code(), Some(0), "{}", stderr(&written));
    let progress = stderr(&written);
    let shown = progress.lines().filter_map(|line| line.strip_suffix(" flights")?.split_once(" of "));
    let ended: Vec<_> = shown.filter(|(done, of)| done == of).collect();
    assert_eq!(ended.len(), 1, "one count for all: {progress}");
    let card = directory.path().join("card");
    assert_eq!(names(&card), ["card.html", "card.txt", "mission.toml"]);
    let mission = fs::read_to_string(card.join("mission.toml")).unwrap();
    assert_eq!(mission, include_str!("../../flight/vehicles/missions/mk2.toml"), "byte for byte");
    let text = fs::read_to_string(card.join("card.txt")).unwrap();
    for expected in [
        "Landing card: mk2, mission ",
        "no radius, no rate and no wind to fly in. Do not fly by this card.",
        "--dispersion real --wind 0,6 --seed 1 --flights 2 --hazard-flights 3",
    ] {
        assert!(text.contains(expected), "{expected} in\n{text}");
    }
    assert!(!text.contains(" of 2:") && !text.contains("kinder"), "{text}");
    assert!(stdout(&written).starts_with(&text));
    let html = fs::read_to_string(card.join("card.html")).unwrap();
    assert!(html.contains("<td>3.100 kg</td>") && html.ends_with("</html>\n"), "{html}");

    let answer = json(&run(directory.path(), &[&arguments[..], &["--json", "--out", "json"]].concat()));
    let stands = &answer["winds"][1]["as_planned"]["stands"]["of"];
    assert_eq!((answer["mission"].as_str(), stands.as_u64()), (Some("mk2"), Some(2)));
    assert!(text.contains(answer["hash"].as_str().unwrap()), "{answer}");
    assert!(answer["winds"][1]["exclusion_m"].is_null() && answer["limit_m_s"].is_null(), "{answer}");
    assert_eq!(names(&directory.path().join("json")), names(&card));

    let stormy = [&["card", "--mission", "mk2", "--wind", "10", "--out", "stormy"], &few[..]].concat();
    let stormy = stdout(&run(directory.path(), &stormy));
    assert!(
        stormy.contains("The code forbids a launch above 8.9 m/s")
            && !stormy.contains("flights were flown in each wind"),
        "{stormy}"
    );

    let again = run(directory.path(), &arguments);
    assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));
    assert_eq!(names(&directory.path().join("card-2")), names(&card));
    let full = Command::new(env!("CARGO_BIN_EXE_onboard-sim"))
        .current_dir(&card)
        .args([&arguments[..], &["--out", "."]].concat())
        .output()
        .unwrap();
    assert_eq!(full.status.code(), Some(1), "{}", stdout(&full));
    assert!(stderr(&full).contains(".: cannot be written: it exists, and no name like it is free"));
    assert_eq!((names(&card).len(), fs::read_to_string(card.join("card.txt")).unwrap()), (3, text));
}

/// The front of this card is the one in the gallery of docs/README.md; `UPDATE_PICTURES` makes it
/// so.
#[test]
fn regress_the_picture_of_a_card() {
    let directory = tempfile::tempdir().unwrap();
    let written = run(directory.path(), &["card", "--mission", "vlr", "--wind", "3", "--wind-from", "225"]);
    assert_eq!(written.status.code(), Some(0), "{}", stderr(&written));
    let html = fs::read_to_string(directory.path().join("card").join("card.html")).unwrap();
    let between = |from: &str, to: &str| html.split_once(from).unwrap().1.split_once(to).unwrap().0;
    let picture = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 740 900\"><foreignObject width=\"740\" height=\"900\">\
         <body xmlns=\"http://www.w3.org/1999/xhtml\"><style>{} body{{background:#fff;padding:10px}}</style>\n\
         <section>{}</section></body></foreignObject></svg>\n",
        between("<style>", "</style>"),
        between("<section>", "</section>"),
    );
    roxmltree::Document::parse(&picture).unwrap();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/card.svg");
    if std::env::var_os("UPDATE_PICTURES").is_some() {
        fs::write(path, &picture).unwrap();
    }
    assert!(fs::read_to_string(path).unwrap_or_default() == picture, "docs/card.svg is stale");
}

/// `--quiet` leaves the requested result and its path.
#[test]
fn a_new_mission_is_quiet_on_request() {
    let directory = tempfile::tempdir().unwrap();
    for (quiet, lines) in [(&[][..], 1), (&["-q"], 0), (&["-q"], 1)] {
        let made = run(directory.path(), &[&["new", "ours", "--like", "mk3"], quiet].concat());
        assert_eq!((made.status.code(), stderr(&made).lines().count()), (Some(0), lines), "{made:?}");
        if quiet.is_empty() {
            fs::remove_file(directory.path().join("ours.toml")).unwrap();
        }
    }
    assert_eq!(names(directory.path()), ["ours-2.toml", "ours.toml"]);
}

#[test]
fn a_command_that_there_is_not_is_wrong_usage_and_the_commands_are_listed() {
    let wrong = run(Path::new("."), &["man", "land"]);
    assert_eq!((wrong.status.code(), stdout(&wrong)), (Some(2), String::new()));
    assert!(stderr(&wrong).contains("no command `land`, but: fly, campaign, check"), "{}", stderr(&wrong));
    assert_eq!(run(Path::new("."), &["man", "campaign"]).status.code(), Some(0));
    // Nothing reads it.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut unread = Command::new(env!("CARGO_BIN_EXE_onboard-sim"));
    let unread = unread.args(["completions", "bash"]).stdout(writer).output().unwrap();
    assert_eq!((unread.status.code(), stderr(&unread)), (Some(0), String::new()));
}

/// A result for decisions about people names its set, and gives a warning if the set may be milder
/// than `real`.
#[test]
fn the_impact_area_is_reported_with_set_flights_interval_and_rule() {
    let directory = tempfile::tempdir().unwrap();
    let few = ["hazard", "--mission", "vlr", "--wind", "0,4", "--flights", "1", "--hazard-flights", "2"];
    let hazard = |more: &[&str]| run(directory.path(), &[&few, more].concat());
    let written = hazard(&["--csv", "hazard.csv"]);
    assert_eq!(written.status.code(), Some(0), "{}", stderr(&written));
    let text = stdout(&written);
    for expected in [
        "Set `real`, seed 1",
        "4 m/s: nobody within ",
        "at least: too few flights",
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
    let again = hazard(&["--csv", "hazard.csv"]);
    assert!(
        stderr(&again).ends_with("hazard.csv exists and is kept; hazard-2.csv is written\n"),
        "{}",
        stderr(&again)
    );
    // The same in a file, and as JSON.
    assert_eq!(stdout(&hazard(&["--out", "hazard.txt"])), "");
    assert_eq!(fs::read_to_string(directory.path().join("hazard.txt")).unwrap(), text);
    let answer = json(&hazard(&["--json"]));
    let within_m = answer["winds"][1]["exclusion_m"].as_f64().unwrap();
    assert!(text.contains(&format!("4 m/s: nobody within {within_m:.0} m")), "{answer} {text}");
    assert_eq!(answer["winds"][0]["cases"]["as planned"]["flights"], 1);
    let kind = stdout(&hazard(&["--dispersion", "field"]));
    assert!(kind.contains("Set `field`, which may be kinder than `real`, seed 1"), "{kind}");
}
