//! No page shows a command that its program would refuse: every command of ours, in a block of code
//! or in a sentence, is given to the program with `--help` at its end, so that it is read and not
//! run ([`crate::pages_run`] runs those in blocks). And a figure that stands on two pages is the
//! same on both.

use std::fs;
use std::path::{Path, PathBuf};

use e2e::{Program, Running, program};

/// Our programs, as a page names them.
pub(crate) const PROGRAMS: [(&str, Program); 3] =
    [("ground", Program::Ground), ("onboard-sim", Program::OnboardSim), ("replay", Program::Replay)];

/// Pages whose blocks are drawings, or about earlier releases.
const NO_COMMANDS: [&str; 2] = ["ARCHITECTURE.md", "CHANGELOG.md"];

/// Every other page, except in folders that hold no sources.
fn pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the workspace") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() && !name.starts_with('.') && name != "target" {
            pages(&path, found);
        } else if path.extension().is_some_and(|end| end == "md") && !NO_COMMANDS.contains(&name) {
            found.push(path);
        }
    }
}

/// The lines of a page's blocks of code, without comments.
pub(crate) fn lines_of_code(page: &str) -> Vec<String> {
    let mut inside = false;
    let mut lines = Vec::new();
    for line in page.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
        } else if inside {
            let code = line.split(" #").next().unwrap_or_default().trim();
            lines.push(code.trim_start_matches("- run: ").to_owned());
        }
    }
    lines
}

/// What a page's sentences have in backticks.
fn code_in_sentences(page: &str) -> Vec<String> {
    let outside = page.split("```").step_by(2);
    let spans = outside.flat_map(|text| text.split('`').skip(1).step_by(2));
    // `onboard-sim …` on a page stands for all commands.
    spans.filter(|span| !span.contains('…')).map(|span| span.replace('\n', " ")).collect()
}

/// The commands of a line: several after a semicolon or `&&`, one after a pipe.
pub(crate) fn commands_of(line: &str) -> Vec<(Program, Vec<String>)> {
    let parts = line.split([';', '|']).flat_map(|part| part.split("&&"));
    let words_of = |part: &str| -> Vec<String> {
        let words = part.split_whitespace().map(|word| word.trim_matches('"').to_owned());
        // What follows is not of the program: where output goes.
        words.take_while(|word| !word.starts_with('>') && !word.starts_with("2>")).collect()
    };
    parts
        .filter_map(|part| {
            let words = words_of(part);
            let first = words.iter().position(|word| !matches!(word.as_str(), "if" | "!"))?;
            let named = words[first].trim_start_matches("target/release/");
            let (_, program) = PROGRAMS.into_iter().find(|(name, _)| *name == named)?;
            Some((program, words[first + 1..].to_vec()))
        })
        .collect()
}

#[test]
fn every_command_on_a_page_is_understood_by_its_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = Vec::new();
    pages(&root, &mut found);
    found.sort();
    let (mut commands, mut refused) = (0, Vec::new());
    for page in found {
        let text = fs::read_to_string(&page).expect("a page");
        let in_blocks = lines_of_code(&text).into_iter().map(|line| (line, false));
        for (line, in_sentence) in
            in_blocks.chain(code_in_sentences(&text).into_iter().map(|span| (span, true)))
        {
            for (which, words) in commands_of(&line) {
                commands += 1;
                let answer = Running::to_end(program(which).args(&words).arg("--help"));
                // A sentence may name an option without its value.
                let is_named = in_sentence && answer.output.contains("a value is required for");
                if answer.code != Some(0) && !is_named {
                    refused.push(format!("{}: {line}\n{}", page.display(), answer.output));
                }
            }
        }
    }
    assert!(commands > 100, "only {commands} commands were found");
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

/// The commands that a help lists, without `help` itself.
pub(crate) fn listed_commands(help: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = lines.take_while(|line| !line.is_empty()).filter(|line| !line.starts_with("   "));
    names
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect()
}

/// The examples of a help: behind `Example:`, or the lines below `Examples:`.
fn examples(help: &str) -> Vec<&str> {
    let one = help.lines().filter_map(|line| line.strip_prefix("Example: "));
    let several = help.lines().skip_while(|line| *line != "Examples:").skip(1);
    one.chain(several.take_while(|line| !line.is_empty())).collect()
}

/// Every command of every program shows an example, and understands it.
#[test]
fn every_help_has_an_example_that_its_program_understands() {
    let mut helps = 0;
    for (name, which) in PROGRAMS {
        let mut left = vec![Vec::new()];
        while let Some(command) = left.pop() {
            let help = Running::to_end(program(which).args(&command).arg("--help")).output;
            helps += 1;
            left.extend(
                listed_commands(&help).into_iter().map(|next| [command.as_slice(), &[next]].concat()),
            );
            let found = examples(&help);
            assert!(!found.is_empty(), "{name} {command:?} has no example: {help}");
            for example in found {
                let parsed = commands_of(example);
                let [(which, words)] = &parsed[..] else { panic!("{name} {command:?}: {example}") };
                assert!(words.starts_with(&command), "{name} {command:?}: {example} is of another command");
                let answer = Running::to_end(program(*which).args(words).arg("--help"));
                assert_eq!(answer.code, Some(0), "{example}: {}", answer.output);
            }
        }
    }
    assert!(helps > 30, "only {helps} commands were found");
}

/// The text of a page at the root of the workspace.
pub(crate) fn page(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name)).expect(name)
}

/// The same without line breaks.
fn prose(name: &str) -> String {
    page(name).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// How often a mission landed.
#[derive(Debug)]
struct Rate {
    mission: String,
    dispersion: String,
    flights: u32,
    stands: u32,
    envelope: u32,
    table_2: u32,
}

fn rates() -> Vec<Rate> {
    let text = page("onboard-sim/landing_rates.csv");
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        let [mission, dispersion, _seed, ref counts @ .., _commit] = cells[..] else { panic!("{row}") };
        let count = |cell: &&str| cell.parse().unwrap_or_else(|_| panic!("{row}"));
        let counts: Vec<u32> = counts.iter().map(count).collect();
        let [flights, stands, _upright, envelope, table_2] = counts[..] else { panic!("{row}") };
        let (mission, dispersion) = (mission.to_owned(), dispersion.to_owned());
        Rate { mission, dispersion, flights, stands, envelope, table_2 }
    })
    .collect()
}

fn rate(mission: &str, dispersion: &str) -> Rate {
    let found = rates().into_iter().find(|rate| rate.mission == mission && rate.dispersion == dispersion);
    found.unwrap_or_else(|| panic!("no rate of {mission} in {dispersion}"))
}

fn percent(count: u32, of: u32) -> String {
    format!("{:.1} %", 100.0 * f64::from(count) / f64::from(of))
}

/// As in `1,000`.
fn with_separator(count: u32) -> String {
    let (thousands, rest) = (count / 1_000, count % 1_000);
    if thousands == 0 { rest.to_string() } else { format!("{thousands},{rest:03}") }
}

/// Wilson's 95 % interval, as in `88.3 to 92.0`.
fn interval(count: u32, of: u32) -> String {
    let (share, n, z) = (f64::from(count) / f64::from(of), f64::from(of), 1.959_964_f64);
    let middle = share + z * z / (2.0 * n);
    let half = z * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
    let end = |value: f64| 100.0 * value / (1.0 + z * z / n);
    format!("{:.1} to {:.1}", end(middle - half), end(middle + half))
}

/// The cells of the row of a table whose first cell begins with this.
fn cells(page: &str, first: &str) -> Vec<String> {
    let begins = format!("| {first}");
    let row = page.lines().find(|line| line.starts_with(&begins)).unwrap_or_else(|| panic!("no row {first}"));
    row.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()
}

/// Each built-in mission has its row on the README.
#[test]
fn the_landing_rates_on_the_pages_are_the_measured_ones() {
    let (missions, mk3) = (page("README.md"), page("docs/build-mk3.md"));
    for rate in rates().iter().filter(|rate| matches!(rate.dispersion.as_str(), "field" | "real")) {
        let row = cells(&missions, &format!("`{}` |", rate.mission));
        let column = if rate.dispersion == "field" { 2 } else { 3 };
        let [stands, envelope, of] = [rate.stands, rate.envelope, rate.flights].map(with_separator);
        assert_eq!(row[column], format!("{stands}, {envelope}, {} of {of}", rate.table_2), "{rate:?}");
    }
    for dispersion in ["field", "real", "harsh", "real-harsh"] {
        for mission in ["mk2", "mk3"] {
            let row = cells(&mk3, &format!("`{dispersion}`, {mission} |"));
            let Rate { flights, stands, envelope, .. } = rate(mission, dispersion);
            let told = [stands, envelope]
                .map(|count| format!("{} ({})", percent(count, flights), interval(count, flights)));
            assert_eq!(row[1..], told, "docs/build-mk3.md {dispersion}, {mission}");
        }
    }
    let Rate { flights, stands, .. } = rate("mk3", "wild");
    let wild = format!("{stands} of {flights} stand");
    assert!(
        prose("docs/build-mk3.md").replace(',', "").contains(&wild),
        "docs/build-mk3.md does not say: {wild}"
    );
}

/// Every figure of a sentence about rates on the page for the range safety officer.
#[test]
fn the_landing_rates_of_the_safety_page_agree_with_the_measured_ones() {
    let [field, real] = ["field", "real"].map(|dispersion| rate("mk2", dispersion));
    let safety = prose("docs/safety.md");
    let said: Vec<&str> =
        safety.split(". ").filter(|sentence| sentence.contains("landing rate of")).collect();
    assert!(!said.is_empty(), "docs/safety.md gives no landing rate");
    for sentence in said {
        for figure in [percent(field.stands, field.flights), percent(real.stands, real.flights)] {
            assert!(sentence.contains(&figure), "docs/safety.md: {figure} is missing in: {sentence}");
        }
        assert_eq!(sentence.matches(" %").count(), 2, "another figure in: {sentence}");
    }
}

/// The text of all sources.
fn sources_below(folder: &Path, found: &mut String) {
    for entry in fs::read_dir(folder).expect("a folder of the workspace") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() && !name.starts_with('.') && name != "target" {
            sources_below(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") {
            found.push_str(&fs::read_to_string(&path).expect("a source"));
        }
    }
}

/// A promise to the range safety officer is held by a test, which its page names in backticks.
#[test]
fn every_test_that_the_safety_page_names_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(root.join("docs/safety.md")).expect("the page");
    let mut sources = String::new();
    sources_below(&root, &mut sources);
    let is_name = |word: &&str| word.matches('_').count() > 2 && !word.contains([' ', '.', '/']);
    let named: Vec<&str> = page.split('`').skip(1).step_by(2).filter(is_name).collect();
    assert!(named.len() > 25, "only {named:?}");
    let missing: Vec<&&str> = named.iter().filter(|name| !sources.contains(&format!("fn {name}("))).collect();
    assert!(missing.is_empty(), "no such tests: {missing:?}");
}

/// The README begins with its picture, then names what its readers search for, and stays short.
#[test]
fn the_readme_begins_with_the_words_that_its_readers_search_for() {
    let readme = page("README.md");
    let mut parts = readme.split("\n\n").skip(1);
    assert!(parts.next().is_some_and(|part| part.starts_with("![")), "the picture is not first");
    let first: String = parts.take(2).flat_map(|part| [part, "\n"]).collect();
    let first = first.split_whitespace().collect::<Vec<_>>().join(" ");
    for word in [
        "flight computer",
        "telemetry ground station",
        "flight-log replay",
        "MAVLink 2",
        "UDP, TCP and serial",
        "aerodynamic descent on four fins",
        "landing burn by nonlinear model predictive control (NMPC)",
        "20 times a second",
        "ratatui",
        "SSH",
        "MCAP",
        "Nothing has flown: all numbers are simulated.",
    ] {
        assert!(first.contains(word), "the first two paragraphs do not say `{word}`:\n{first}");
    }
    let is_prose = |line: &&str| !["|", "![", "```"].iter().any(|begin| line.starts_with(begin));
    let words = readme.lines().filter(is_prose).flat_map(str::split_whitespace).count();
    assert!(words < 500, "{words} words beside tables and pictures");
}
