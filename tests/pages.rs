//! No page shows a command that its program would refuse: every line of ours in a block of code is given to the program,
//! with `--help` at its end, so that it is read and not run.

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
fn lines_of_code(page: &str) -> Vec<String> {
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

/// The commands of a line: several after a semicolon or `&&`, one after a pipe, one in the quotes of `sbatch`.
fn commands_of(line: &str) -> Vec<(Program, Vec<String>)> {
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
        for line in lines_of_code(&text) {
            for (which, words) in commands_of(&line) {
                commands += 1;
                let answer = Running::to_end(program(which).args(&words).arg("--help"));
                if answer.code != Some(0) {
                    refused.push(format!("{}: {line}\n{}", page.display(), answer.output));
                }
            }
        }
    }
    assert!(commands > 40, "only {commands} commands were found");
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
    assert!(helps > 35, "only {helps} commands were found");
}
