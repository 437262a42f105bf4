//! No page shows a command that its program would refuse: every command of ours, in a block of code or in a sentence, is given
//! to the program with `--help` at its end, so that it is read and not run ([`crate::pages_run`] runs those in blocks). And a
//! figure that stands on two pages is the same on both.

use std::fs;
use std::path::{Path, PathBuf};

use e2e::{Program, Running, program};

/// Our programs, as a page names them.
const PROGRAMS: [(&str, Program); 3] =
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

/// The commands of a line: several after a semicolon or `&&`, one after a pipe, one in the quotes of `sbatch`.
pub(crate) fn commands_of(line: &str) -> Vec<(Program, Vec<String>)> {
    let parts = line.split([';', '|', '\'']).flat_map(|part| part.split("&&"));
    let words_of = |part: &str| -> Vec<String> {
        // Slurm and GNU parallel fill in a number.
        let filled_in = |word: &str| word.replace("$SLURM_ARRAY_TASK_ID", "1").replace("{}", "1");
        let words = part.split_whitespace().map(|word| filled_in(word.trim_matches('"')));
        // What follows is not of the program: parallel's list, or where output goes.
        words.take_while(|word| word != ":::" && !word.starts_with('>') && !word.starts_with("2>")).collect()
    };
    parts
        .filter_map(|part| {
            let words = words_of(part);
            let first = words.iter().position(|word| !matches!(word.as_str(), "parallel" | "if" | "!"))?;
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
    assert!(commands > 110, "only {commands} commands were found");
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

/// The commands that a help lists, without `help` itself.
fn listed_commands(help: &str) -> Vec<String> {
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
    upright: u32,
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
        let [flights, stands, upright, envelope, table_2] = counts[..] else { panic!("{row}") };
        let (mission, dispersion) = (mission.to_owned(), dispersion.to_owned());
        Rate { mission, dispersion, flights, stands, upright, envelope, table_2 }
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

#[test]
fn the_landing_rates_on_the_pages_are_the_measured_ones() {
    let (readme, mk3) = (page("README.md"), page("MK3.md"));
    for rate in rates().iter().filter(|rate| matches!(rate.dispersion.as_str(), "field" | "real")) {
        let of = if rate.flights == 1_000 { "1,000".to_owned() } else { rate.flights.to_string() };
        let row = cells(&readme, &format!("`{}` |", rate.mission));
        let column = if rate.dispersion == "field" { 2 } else { 3 };
        let Rate { stands, envelope, table_2, .. } = rate;
        assert_eq!(row[column], format!("{stands}, {envelope}, {table_2} of {of}"), "README.md: {rate:?}");
    }
    for dispersion in ["field", "real", "harsh", "real-harsh"] {
        for mission in ["mk2", "mk3"] {
            let row = cells(&mk3, &format!("`{dispersion}`, {mission} |"));
            let Rate { flights, stands, upright, envelope, table_2, .. } = rate(mission, dispersion);
            let told = [stands, upright, envelope, table_2]
                .map(|count| format!("{} ({})", percent(count, flights), interval(count, flights)));
            assert_eq!(row[1..], told, "MK3.md {dispersion}, {mission}");
        }
    }
}

/// Every figure of a sentence about rates in the text of a page.
#[test]
fn what_the_pages_say_of_landing_rates_agrees_with_the_measured_ones() {
    let [field, real, harsh, real_harsh] =
        ["field", "real", "harsh", "real-harsh"].map(|dispersion| rate("mk2", dispersion));
    let readme = prose("README.md");
    let [field_3, real_3] = ["field", "real"].map(|dispersion| rate("mk3", dispersion));
    let both = |before: &str, [field, real]: [u32; 2]| {
        let [field, real] = [interval(field, field_3.flights), interval(real, real_3.flights)];
        format!("{before} in `field` {field} %, in `real` {real} %")
    };
    for words in [
        both("95 % intervals of mk3: stands", [field_3.stands, real_3.stands]),
        both("envelope", [field_3.envelope, real_3.envelope]),
        format!("`field` {} %, `real` {} %", interval(field.stands, 1_000), interval(real.stands, 1_000)),
        format!("`harsh` {} of {}", harsh.stands, harsh.flights),
        format!("`real-harsh` {} of {}", real_harsh.stands, real_harsh.flights),
    ] {
        assert!(readme.contains(&words), "README.md does not say: {words}");
    }
    // What other errors are worth is measured on MK3.md's flights.
    let study = |first: &str| -> u32 {
        let cell = cells(&page("MK3.md"), first).swap_remove(1);
        let count = cell.split(':').next().and_then(|count| count.parse().ok());
        count.unwrap_or_else(|| panic!("{first}: {cell}"))
    };
    let (known, as_real) = (study("both |"), study("as in `real` |"));
    assert!(readme.contains(&format!("{known} of 300 `real` flights instead of {as_real}")));
    let exact = study("errors of the sensors beyond those of `field`");
    let mk3 = page("MK3.md");
    let nothing = mk3.lines().find_map(|line| line.strip_prefix("| nothing | ")?.split_once(':'));
    let (nothing, _) = nothing.expect("the same flights with every error");
    assert!(readme.contains(&format!("exact sensors ({exact} instead of {nothing})")));
    let safety = prose("SAFETY.md");
    let said: Vec<&str> =
        safety.split(". ").filter(|sentence| sentence.contains("landing rate of")).collect();
    assert!(!said.is_empty(), "SAFETY.md gives no landing rate");
    for sentence in said {
        for figure in [percent(field.stands, field.flights), percent(real.stands, real.flights)] {
            assert!(sentence.contains(&figure), "SAFETY.md: {figure} is missing in: {sentence}");
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
    let page = fs::read_to_string(root.join("SAFETY.md")).expect("the page");
    let mut sources = String::new();
    sources_below(&root, &mut sources);
    let is_name = |word: &&str| word.matches('_').count() > 2 && !word.contains([' ', '.', '/']);
    let named: Vec<&str> = page.split('`').skip(1).step_by(2).filter(is_name).collect();
    assert!(named.len() > 25, "only {named:?}");
    let missing: Vec<&&str> = named.iter().filter(|name| !sources.contains(&format!("fn {name}("))).collect();
    assert!(missing.is_empty(), "no such tests: {missing:?}");
}
