//! A file or a name that is not there ends every command in the same way: exit code 1, and one
//! error that names it, with the operating system's reason at most once. The table has each option
//! and each argument that reads a file: the helps are searched for them.

use std::process::Command;

use e2e::{Ended, Running, program};

use crate::pages::{PROGRAMS, listed_commands};

/// A line for each file that a command reads; `MISSING` is the one that is not there.
const LINES: &str = "\
ground --config MISSING
ground --key MISSING
ground --key key --crew MISSING
ground --mission MISSING
ground --mission MISSING --connect udpin:127.0.0.1:0
ground --checklist MISSING
ground --replay MISSING
ground --replay last
ground daemon --config MISSING
ground daemon --key MISSING
ground daemon --key key --crew MISSING
ground daemon --mission MISSING
ground daemon --checklist MISSING
ground attach --config MISSING
ground attach --socket MISSING
ground download --connect udpin:127.0.0.1:0 --config MISSING
ground download --connect udpin:127.0.0.1:0 --key MISSING
ground download --connect udpin:127.0.0.1:0 --key key --crew MISSING
ground download --connect udpin:127.0.0.1:0 --out MISSING
ground stop --socket MISSING
ground config check MISSING
onboard-sim fly --mission MISSING
onboard-sim fly --key MISSING
onboard-sim fly --key key --crew MISSING
onboard-sim fly --dispersion MISSING
onboard-sim fly --winds MISSING
onboard-sim fly --board MISSING
onboard-sim campaign --out new --mission MISSING
onboard-sim campaign --only 3 --mission MISSING
onboard-sim campaign --out new --dispersion MISSING
onboard-sim campaign --out new --winds MISSING
onboard-sim check MISSING
onboard-sim check mk3 --from MISSING
onboard-sim check mk3 --from MISSING.eng
onboard-sim check mk3 --dispersion MISSING
onboard-sim check mk3 --winds MISSING
onboard-sim check mk3 --flights 0 --svg new.svg --parts MISSING
onboard-sim card --mission MISSING
onboard-sim card --dispersion MISSING
onboard-sim card --winds MISSING
onboard-sim hazard --mission MISSING
onboard-sim hazard --dispersion MISSING
onboard-sim hazard --winds MISSING
onboard-sim playback MISSING
onboard-sim playback table.csv --mission MISSING
onboard-sim new new --like MISSING
onboard-sim new new --from MISSING
onboard-sim new new --motor MISSING
onboard-sim new new --motor MISSING --motor-data ours 38 200 0.19 0.365
onboard-sim missions --show MISSING
replay info MISSING
replay info MISSING MISSING.mcap
replay verify MISSING
replay verify MISSING MISSING.mcap
replay verify --strict MISSING
replay verify --book MISSING
replay evaluate MISSING
replay refly MISSING
replay compare MISSING log.mcap
replay compare log.mcap MISSING
replay report MISSING
replay export MISSING --out new
replay export MISSING --out new.kml
replay import MISSING.ulg new.mcap
replay import MISSING.bin new.mcap
replay import MISSING.csv new.mcap
replay recover MISSING new.mcap
replay fit MISSING
replay fit MISSING.json --mission mk3 --day new --flights 10
replay fit burn.csv --motor MISSING
replay fit burn.csv --motor H45W --day new --mission MISSING
replay fit burn.csv --motor H45W --day new --mission mk3 --prior MISSING";

/// Values that name a file which is read, as helps write them.
const READ: [&str; 11] = [
    "<FILE>",
    "<FILES>",
    "<NAME|FILE>",
    "<FILE|last>",
    "<DIR|FILE>",
    "<SENSORS.csv>",
    "<BASELINE>",
    "<OTHERS>",
    "[FILE]",
    "<FOLDER>",
    "<PATH>",
];
/// What a command writes instead.
const WRITTEN: [&str; 8] = [
    "--out",
    "--csv",
    "--svg",
    "--uid-file",
    "--log",
    "onboard-sim keygen",
    "ground --socket",
    "ground daemon --socket",
];

/// The options and arguments of a help that read a file; an argument is "".
fn reading(command: &str, help: &str) -> Vec<String> {
    let entries = help.lines().filter(|line| line.starts_with("  ") && !line.starts_with("          "));
    let found = entries.filter_map(|line| {
        let value =
            line.split_whitespace().find(|word| word.starts_with(['<', '[']))?.trim_end_matches("...");
        let option = line.split_whitespace().find(|word| word.starts_with("--")).unwrap_or_default();
        let is_written = [option, format!("{command} {option}").trim()].iter().any(|it| WRITTEN.contains(it));
        (READ.contains(&value) && !is_written).then(|| option.to_owned())
    });
    found.collect()
}

#[test]
fn a_missing_file_ends_every_command_with_1_and_is_named_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |line: &str| -> Ended {
        let mut words = line.split(' ');
        let named = words.next();
        let (_, which) = PROGRAMS.into_iter().find(|(name, _)| Some(*name) == named).expect("a program");
        let mut command: Command = program(which);
        Running::to_end(command.args(words).current_dir(folder.path()))
    };
    let mut rows = "time,height\n".to_owned();
    rows.extend((0..40).map(|row| format!("{row},{}\n", 400 - (row - 20) * (row - 20))));
    std::fs::write(folder.path().join("table.csv"), rows).expect("written");
    let mut burn = "time_s,thrust_n\n".to_owned();
    burn.extend((0..40).map(|row| format!("{},43\n", f64::from(row) * 0.17)));
    std::fs::write(folder.path().join("burn.csv"), burn).expect("written");
    for line in ["onboard-sim keygen key", "replay import table.csv log.mcap"] {
        let made = run(line);
        assert_eq!(made.code, Some(0), "{line}: {}", made.output);
    }
    for line in LINES.lines() {
        let Ended { code, output } = run(line);
        let errors: Vec<&str> = output.lines().filter(|line| line.starts_with("error: ")).collect();
        let names = line.matches("MISSING").count();
        assert!(code == Some(1) && errors.len() == names.max(1), "{line}: {code:?} {output}");
        for error in errors {
            let is_named = names == 0 || error.contains("MISSING");
            assert!(is_named && error.matches("os error").count() <= 1, "{line}: {error}");
        }
    }
    let left = std::fs::read_dir(folder.path()).expect("the folder").count();
    assert_eq!(left, 4, "a command that failed has written something");
    let mut left: Vec<_> = PROGRAMS.iter().map(|(name, _)| vec![(*name).to_owned()]).collect();
    while let Some(command) = left.pop() {
        let begin = command.join(" ");
        let help = run(&format!("{begin} --help")).output;
        left.extend(listed_commands(&help).into_iter().map(|next| [command.as_slice(), &[next]].concat()));
        for option in reading(&begin, &help) {
            let has_line = LINES.lines().any(|line| {
                let given = line.strip_prefix(&begin);
                given.is_some_and(|given| given.contains("MISSING") && given.contains(&option))
            });
            assert!(has_line, "no line has the missing file of: {begin} {option}");
        }
    }
}
