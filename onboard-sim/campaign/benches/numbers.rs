//! What each chosen number decides: how many flights land with half and with twice its value. `numbers.csv` beside this file
//! has a row for each number, and keeps what was found and at which commit.
//!
//! `cargo bench -p campaign --bench numbers -- settle_s HARD_M_S` measures two rows; without names it measures all that can be
//! halved, in hours. It flies a clone of the last commit: what is not committed is not measured.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what cannot be cloned, built or flown ends the program"
)]
#![expect(clippy::print_stdout, reason = "the rows are its output")]

use std::collections::BTreeMap;
use std::process::{Command, Stdio};
use std::{env, fs};

use campaign::run::in_parallel;
use sha2::{Digest as _, Sha256};
use sim::recipe::Recipe;
use sim::sortie::Sortie;

const HERE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/numbers.csv");
const CLONE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/numbers");
const BUILT: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/numbers-target");
const SET: &str = "real";
const SEED: u64 = 78;
const FLIGHTS: u64 = 160;

#[derive(serde::Serialize, serde::Deserialize)]
struct Row {
    file: String,
    constant: String,
    value: String,
    halved: String,
    unchanged: String,
    doubled: String,
    commit: String,
    elsewhere: String,
}

fn main() {
    let asked: Vec<String> = env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if let Some(mission) = asked.first().and_then(|first| first.strip_prefix("fly=")) {
        return println!("{}", flown(mission));
    }
    let text = fs::read_to_string(TABLE).unwrap();
    let notes: String = text.split_inclusive('\n').take_while(|line| line.starts_with('#')).collect();
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let mut rows: Vec<Row> = reader.deserialize().map(Result::unwrap).collect();
    let _ = fs::remove_dir_all(CLONE);
    told(Command::new("git").args(["clone", "--quiet", "--shared", HERE, CLONE])).unwrap();
    let commit = told(Command::new("git").args(["-C", CLONE, "rev-parse", "--short", "HEAD"])).unwrap();
    let mut unchanged = BTreeMap::new();
    for at in 0..rows.len() {
        let row = &mut rows[at];
        let wanted = if asked.is_empty() { !row.halved.is_empty() } else { asked.contains(&row.constant) };
        if !wanted {
            continue;
        }
        let file = row.file.strip_prefix("onboard-sim/flight/vehicles/missions/");
        let mission = file.map_or("mk2", |file| file.trim_end_matches(".toml")).to_owned();
        let path = format!("{CLONE}/{}", row.file);
        let source = fs::read_to_string(&path).unwrap();
        let (before, value, after) =
            parts(&source, &row.constant).unwrap_or_else(|| panic!("{} has no {}", row.file, row.constant));
        let as_it_is = unchanged.entry(mission.clone()).or_insert_with(|| built_and_flown(&mission).unwrap());
        let [halved, doubled] = [0.5, 2.0].map(|factor| {
            fs::write(&path, [before, &scaled(value, factor), after].concat()).unwrap();
            match built_and_flown(&mission) {
                Some(flown) if flown == *as_it_is => "same".to_owned(),
                Some(flown) => landings(&flown),
                None => "refused".to_owned(),
            }
        });
        fs::write(&path, &source).unwrap();
        println!("{} = {value}: {halved}, {doubled}; {} unchanged", row.constant, landings(as_it_is));
        (row.value, row.commit) = (value.to_owned(), commit.clone());
        (row.halved, row.unchanged, row.doubled) = (halved, landings(as_it_is), doubled);
        let mut writer = csv::Writer::from_writer(notes.clone().into_bytes());
        for row in &rows {
            writer.serialize(row).unwrap();
        }
        fs::write(TABLE, writer.into_inner().unwrap()).unwrap();
    }
}

/// How many flights of a mission land, and a hash of how each of them ends.
fn flown(mission: &str) -> String {
    let recipe = Recipe { seed: SEED, ..Recipe::built_in(mission, SET).unwrap() };
    let numbers: Vec<u64> = (0..FLIGHTS).collect();
    let ends = in_parallel(&numbers, |number| Sortie::new(&recipe, *number).unwrap().run(), &|_| {});
    let landed = ends.iter().filter(|end| end.landing.stands).count();
    let hash = Sha256::digest(format!("{ends:?}"));
    format!("{landed} {:016x}", hash.first_chunk().map_or(0, |bytes| u64::from_be_bytes(*bytes)))
}

/// [`flown`] by this program as the clone builds it; `None` if it does not build or the mission is refused.
fn built_and_flown(mission: &str) -> Option<String> {
    let bench = ["bench", "--quiet", "-p", "campaign", "--bench", "numbers", "--", &format!("fly={mission}")];
    told(Command::new(env!("CARGO")).args(bench).current_dir(CLONE).env("CARGO_TARGET_DIR", BUILT))
}

fn told(command: &mut Command) -> Option<String> {
    let output = command.stderr(Stdio::inherit()).output().unwrap();
    output.status.success().then(|| String::from_utf8(output.stdout).unwrap().trim().to_owned())
}

fn landings(flown: &str) -> String {
    flown.split(' ').take(1).collect()
}

/// What stands before, in and after the value of `const NAME: type = value;` in Rust, or of a `section.key` in TOML.
fn parts<'a>(source: &'a str, constant: &str) -> Option<(&'a str, &'a str, &'a str)> {
    let (section, name) = constant.rsplit_once('.').unwrap_or(("", constant));
    let (declared, key) = (format!("const {name}: "), format!("{name} = "));
    let (mut here, mut at) = ("", 0);
    for line in source.split_inclusive('\n') {
        here = line.strip_prefix('[').and_then(|header| header.split(']').next()).unwrap_or(here);
        if line.contains(&declared) || (line.starts_with(&key) && here == section) {
            let value = line.split_once(" = ")?.1.trim_end().trim_end_matches(';');
            let from = at + line.find(" = ")? + " = ".len();
            return Some((&source[..from], value, &source[from + value.len()..]));
        }
        at += line.len();
    }
    None
}

/// A value times a factor, a whole number rounded up; of a range about 1 the distances from 1.
fn scaled(value: &str, factor: f64) -> String {
    let number = |text: &str| text.parse::<f64>().unwrap();
    if let Some(range) = value.strip_prefix('[') {
        let ends = range.trim_end_matches(']').split(", ").map(|end| 1.0 + factor * (number(end) - 1.0));
        format!("{:?}", ends.collect::<Vec<_>>())
    } else if value.parse::<u64>().is_ok() {
        (factor * number(value)).ceil().to_string()
    } else {
        format!("{:?}", factor * number(value))
    }
}
