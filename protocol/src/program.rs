//! Common parts of the three programs: exit codes, and alternative forms of their command lines.

use std::ffi::OsString;
use std::fmt::Display;
use std::io::{self, Write as _};
use std::ops::RangeInclusive;
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgMatches, Args, ColorChoice, Command, Subcommand};
use clap_complete::Shell;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// It stands undamaged, is identical, or is done; or the crew closed the screen before a flight
    /// began.
    Yes = 0,
    /// Something failed: a file, a socket, the simulator.
    Error = 1,
    /// The command line was not understood.
    Usage = 2,
    /// The flight ended otherwise, decisions differ, more differs than is tolerated.
    No = 3,
    /// Arming or start was refused, or the flight was aborted.
    RefusedOrAborted = 4,
    /// The end of the flight was not received, or not every request could be answered.
    NotSeen = 5,
}

impl Exit {
    /// The answer to a question.
    pub fn of(yes: bool) -> Self {
        if yes { Self::Yes } else { Self::No }
    }

    /// How a command line ended that was not run: help and version are an answer. Prints it; if
    /// no one reads it, nothing is lost.
    pub fn unread(message: &clap::Error) -> Self {
        let _ = message.print();
        if message.use_stderr() { Self::Usage } else { Self::Yes }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// The exit codes as `--help` of each program lists them.
pub const EXIT_CODES: &str = "\
Exit codes:
  0  yes: it stands undamaged, all is the same, it is done; or a screen closed before a flight
  1  an error: a file, a socket, the simulator
  2  the command line was not understood
  3  the answer is no: it does not stand, decisions differ, outside tolerance, NO-GO
  4  refused or aborted
  5  not seen to the end, or not all could be answered";

/// What every command takes.
#[derive(Debug, Clone, Copy, Args)]
pub struct Shown {
    /// Colours; auto: on a terminal, unless NO_COLOR is set.
    #[arg(
        long,
        global = true,
        value_name = "WHEN",
        default_value = "auto",
        hide_short_help = true,
        help_heading = "Output"
    )]
    pub color: ColorChoice,
    /// Leave out progress, warnings and what happens on the way: answers and errors alone.
    #[arg(short, long, global = true, hide_short_help = true, help_heading = "Output")]
    pub quiet: bool,
}

static QUIET: AtomicBool = AtomicBool::new(false);

/// Whether --quiet was given to this process.
pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Reads the command line of this process. Help and errors are coloured as it asks for, too.
///
/// # Errors
/// It is not understood, or asks for help or the version.
pub fn read(program: Command) -> Result<ArgMatches, clap::Error> {
    let given: Vec<OsString> = std::env::args_os().collect();
    let mut words =
        given.iter().filter_map(|word| word.to_str()).skip_while(|word| !word.starts_with("--color"));
    let first = words.next().unwrap_or_default();
    let when = first.strip_prefix("--color=").or_else(|| words.next());
    let color = when.and_then(|when| when.parse().ok()).unwrap_or_default();
    let name = program.get_name().to_owned();
    let program = program
        .mut_subcommand("completions", |its| its.after_help(format!("Example: {name} completions bash")))
        .mut_subcommand("man", |its| its.after_help(format!("Example: {name} man")));
    let mut program = with_negative_numbers(program.color(color));
    let given = parsed(&mut program, &given)?;
    QUIET.store(given.get_flag("quiet"), Ordering::Relaxed);
    Ok(given)
}

/// Parses the words. An unknown command's error suggests every command that is one letter or one
/// swap of two away: the likeness by which `clap` suggests has no result for `fyl`.
fn parsed(program: &mut Command, words: &[OsString]) -> Result<ArgMatches, clap::Error> {
    program.try_get_matches_from_mut(words).map_err(|mut error| {
        let Some(ContextValue::String(unknown)) = error.get(ContextKind::InvalidSubcommand) else {
            return error;
        };
        let parent =
            words.iter().fold(&*program, |command, word| command.find_subcommand(word).unwrap_or(command));
        let names = parent.get_subcommands().map(Command::get_name);
        let near = names.filter(|name| strsim::osa_distance(name, unknown) == 1).map(str::to_owned);
        let near: Vec<String> = near.collect();
        if !near.is_empty() {
            error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(near));
        }
        error
    })
}

/// Lets every option take a negative number, so that its error names the option and its range; an
/// unknown option is an error as before.
fn with_negative_numbers(mut program: Command) -> Command {
    for command in program.get_subcommands_mut() {
        *command = with_negative_numbers(std::mem::take(command));
    }
    program.mut_args(|option| {
        let takes_value = option.get_action().takes_values() && !option.is_positional();
        option.allow_negative_numbers(takes_value)
    })
}

/// Returns the parser of a number in a range; its error states the range.
pub fn in_range<N>(range: RangeInclusive<N>) -> impl Fn(&str) -> Result<N, String> + Clone
where
    N: FromStr + PartialOrd + Display + Clone,
{
    let kind = if "0.5".parse::<N>().is_ok() { "number" } else { "whole number" };
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("must be a {kind} from {} to {}", range.start(), range.end()))
    }
}

/// Writes to standard output. A reader that closes the pipe early is not an error.
///
/// # Errors
/// It cannot be written.
pub fn print(bytes: &[u8]) -> io::Result<()> {
    let mut output = io::stdout().lock();
    match output.write_all(bytes).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// The commands that print the command line in another form.
#[derive(Debug, Clone, Subcommand)]
pub enum Manual {
    /// Print a shell's completions.
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// Print the manual page (roff) of the program, or of a command.
    Man {
        /// The command, with its subcommand if it has one.
        command: Vec<String>,
    },
}

impl Manual {
    /// Prints it for a program.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn print(&self, mut program: Command) -> io::Result<Exit> {
        let (mut text, name) = (Vec::new(), program.get_name().to_owned());
        match self {
            Self::Completions { shell } => clap_complete::generate(*shell, &mut program, name, &mut text),
            Self::Man { command } => {
                program.build();
                let mut page = &program;
                for word in command {
                    let Some(found) = page.find_subcommand(word) else {
                        let known: Vec<&str> = page.get_subcommands().map(Command::get_name).collect();
                        let words = format!("there is no command `{word}`, but: {}\n", known.join(", "));
                        return Ok(Exit::unread(&clap::Error::raw(ErrorKind::InvalidSubcommand, words)));
                    };
                    page = found;
                }
                let source = format!("{name} {}", program.get_version().unwrap_or_default());
                clap_mangen::Man::new(page.clone()).source(source).render(&mut text)?;
            }
        }
        print(&text).map(|()| Exit::Yes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_number_is_answered_with_its_range() {
        let flights = in_range(1_u64..=100);
        assert_eq!(flights("100"), Ok(100));
        for wrong in ["0", "101", "-5", "1.5", "abc", ""] {
            assert_eq!(flights(wrong), Err("must be a whole number from 1 to 100".to_owned()), "{wrong}");
        }
        for wrong in ["NaN", "-0.1", "inf", "1,5"] {
            assert_eq!(
                in_range(0.0..=50.0)(wrong),
                Err("must be a number from 0 to 50".to_owned()),
                "{wrong}"
            );
        }
    }

    #[test]
    fn a_negative_number_is_a_value_and_an_unknown_option_is_none() {
        let flights = || {
            let option = clap::Arg::new("flights").long("flights").value_parser(in_range(1_u64..=9));
            let fly = Command::new("fly").arg(option).arg(clap::Arg::new("file"));
            with_negative_numbers(Command::new("program").subcommand(fly))
        };
        let refused = |words: &[&str]| flights().try_get_matches_from(words).unwrap_err().to_string();
        let negative = refused(&["program", "fly", "--flights", "-5"]);
        let expected =
            "error: invalid value '-5' for '--flights <flights>': must be a whole number from 1 to 9";
        assert!(negative.starts_with(expected), "{negative}");
        let unknown = refused(&["program", "fly", "-5"]);
        assert!(unknown.starts_with("error: unexpected argument '-5' found"), "{unknown}");
    }

    /// A command with one letter too much, too little or wrong, or with two swapped, is suggested.
    #[test]
    fn a_mistyped_command_is_suggested_however_short_it_is() {
        for (typed, meant) in
            [("fyl", "fly"), ("fl", "fly"), ("flyy", "fly"), ("fiy", "fly"), ("cehck", "check")]
        {
            let config = Command::new("config").subcommands(["check", "fly"].map(Command::new));
            let mut program = Command::new("program")
                .subcommands(["fly", "check", "card"].map(Command::new))
                .subcommand(config);
            for before in [&["program"][..], &["program", "config"]] {
                let words: Vec<OsString> = before.iter().chain([&typed]).map(OsString::from).collect();
                let error = parsed(&mut program, &words).unwrap_err().to_string();
                let expected = format!("a similar subcommand exists: '{meant}'");
                assert!(error.contains(&expected), "{before:?} {typed}: {error}");
            }
        }
        let mut program = Command::new("program").subcommand(Command::new("fly"));
        let unlike = parsed(&mut program, &["program", "sail"].map(OsString::from));
        assert!(!unlike.unwrap_err().to_string().contains("similar"));
    }

    #[test]
    fn the_list_has_every_code() {
        use Exit::{Error, No, NotSeen, RefusedOrAborted, Usage, Yes};
        let listed: Vec<&str> = EXIT_CODES.lines().skip(1).map(str::trim_start).collect();
        for (exit, line) in [Yes, Error, Usage, No, RefusedOrAborted, NotSeen].into_iter().zip(listed) {
            assert!(line.starts_with(&format!("{}  ", exit as u8)), "{line}");
        }
    }
}
