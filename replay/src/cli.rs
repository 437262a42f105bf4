//! The command line: reads the question and gives it to its room, and what all answers have in common.
//!
//! A command is one file with its arguments, its answer as data and its printing, and a line in [`Command`].

use std::io::{self, IsTerminal as _, Write};
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result, ensure};
use clap::{CommandFactory as _, Parser, Subcommand};

use crate::info::Completeness;
use crate::log::{Cut, Gap, Recording};
use crate::output::{Destination, NewFile, Overwrite};
use crate::verify::Verification;
use crate::{compare, evaluate, export, fit, info, recover, refly, report, verify};

/// The answer is no: the controller decides differently from the record, or flights differ by more than is tolerated.
const EXIT_NO: u8 = 1;
/// There is no answer: wrong usage, an unreadable file, not a flight log, or not replayable.
pub const EXIT_NO_ANSWER: u8 = 2;

/// Describes flight logs, runs their flights again, and compares them.
///
/// Answers go to standard output, warnings and errors to standard error.
///
/// Exit codes:
///   0  success: the log is described, or every tick that could be read is identical
///   1  verify: some tick differs, or with --strict not the whole flight was compared; with --baseline some flight
///      got worse, lands no longer, diverged or is missing; with --book a book is broken, or its end is not proven;
///      compare: more differs or is missing than is tolerated, or the verdicts differ;
///      fit: NO-GO
///   2  no answer: wrong usage, the file cannot be read or is no flight log, or verify cannot re-execute
///      some tick (no ticks, no profile, ticks missing) and all others are identical;
///      or a file would be overwritten and --force is not given
///
/// A damaged log is used up to the damage, with a warning and exit code 0, except by verify --strict (implied by
/// --junit) and by compare.
#[derive(Debug, Parser)]
#[command(
    name = "replay",
    version,
    about,
    long_about,
    verbatim_doc_comment,
    after_help = "Example: replay verify flight.mcap"
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Describes a log: grade, run, build, phases, verdict, ticks, channels, damage.
    #[command(after_help = "Example: replay info flight.mcap")]
    Info(info::Ask),
    /// Runs the flight computer of a log again and compares its decisions bit for bit.
    ///
    /// The flight computer is built from the profile in the log and run on the recorded inputs from power-up on. If the
    /// log has no frames from power-up, only the controller ticks are compared. All fields of the output and the digest
    /// of the memory are compared; measured times are not. For a divergence the report says how it grows, and whether
    /// the landing would end differently (simulated from the first tick that differs).
    ///
    /// With --explain one recorded tick is solved again: cost, residuals, active constraints, warm against cold start,
    /// predicted path. With --baseline a directory of flights is held against one: every flight verified, flown again,
    /// and compared; exit code 0 if none got worse, 1 if some did, 2 without an answer. With --book the books of ground
    /// stations are proven (who did what when), or the first broken link is named.
    #[command(
        after_help = "Examples:\n  replay verify flight.mcap\n  replay verify flight.mcap --explain 2040\n  replay verify logs --baseline baseline.json --junit=season.xml\n  replay verify --book ground.mcap vehicle.mcap"
    )]
    Verify(verify::Ask),
    /// Open loop: what the controller alone would have commanded with other settings, on the recorded inputs.
    #[command(after_help = "Example: replay evaluate flight.mcap --set powered.weights.theta=90@6.5")]
    Evaluate(evaluate::Ask),
    /// Closed loop: flies the flight again in simulation from a chosen moment, with other settings.
    ///
    /// The flight is flown again from its start with the recorded draw up to that moment, because a log does not hold the
    /// internal states of gusts, servos and sensors; the record is not used afterwards. The answer says how many recorded
    /// frames were reproduced: with nothing changed, all of a simulated flight, bit for bit.
    ///
    /// With --vary flights are flown with many settings, which are ranked by the worst flight's margin. With --flip the
    /// smallest change of one setting is looked for that turns landed into not landed, or back.
    #[command(
        after_help = "Examples:\n  replay refly flight.mcap --plant truth.impulse_scale=0.99\n  replay refly flight.mcap --without-fault gnss-out\n  replay refly a.mcap b.mcap --vary powered.weights.theta=50:110:7\n  replay refly a.mcap --flip truth.impulse_scale --of-plant --lowest 0.9 --highest 1.1"
    )]
    Refly(refly::Ask),
    /// Compares flights signal by signal: RMS, maximum and when; verdicts side by side; added and missing signals.
    ///
    /// Signals are named as in an export. Exit code 1 if a tolerance is exceeded or the verdicts differ.
    #[command(after_help = "Example: replay compare old.mcap new.mcap")]
    Compare(compare::Ask),
    /// Writes a flight as one HTML page with its pictures inside: no script, no network.
    #[command(after_help = "Example: replay report flight.mcap")]
    Report(report::Ask),
    /// Writes a log's content as CSV, Parquet, .tlog, a Rerun recording or frames for a board; makes a log of a .tlog.
    ///
    /// A log of a .tlog has telemetry only: nothing can be re-executed.
    #[command(
        after_help = "Examples:\n  replay export flight.mcap --to parquet --output tables\n  replay export flight.tlog"
    )]
    Export(export::Ask),
    /// Recovers a whole log from a damaged one, and says what was kept and what time span is lost.
    #[command(after_help = "Example: replay recover cut.mcap whole.mcap")]
    Recover(recover::Ask),
    /// Finds drag, thrust, delays, gimbal, wind and sensor errors of flights, with 95 % intervals, and says what it cannot find.
    ///
    /// Only sensor samples, commands, feedback and the flight computer's estimates are used. Scales are over the data of the
    /// mission in the log, per mass: weigh the vehicle. Several logs are also put together. A burn on a test stand (CSV) is
    /// compared with its motor's certified curve.
    ///
    /// With --day a motor lot, an airframe and a site are learnt from all flights so far, and mission and dispersions of the
    /// next day are written. With --flights that day is simulated with motors that the lot may have, and the landing rate
    /// gets an interval: GO (exit code 0) if the probability of a rate below the limit is at most the risk that is taken,
    /// NO-GO (exit code 1) if not.
    #[command(
        after_help = "Examples:\n  replay fit flight.mcap --write-mission better.toml\n  replay fit stand.csv --motor H45W\n  replay fit fits.json --mission mk2 --day day --flights 1000"
    )]
    Fit(fit::Ask),
    /// Prints a shell's completions.
    #[command(after_help = "Example: replay completions bash")]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Prints the manual page (roff).
    #[command(after_help = "Example: replay man")]
    Man,
}

/// How an answer turned out.
pub enum Answer {
    /// There is an answer.
    Given,
    /// Some of the logs could not be read.
    NotAll,
    /// A bit-for-bit comparison. If `strict`, it must cover the whole flight.
    Verified { outcome: Verification, strict: bool },
    /// Yes or no.
    Decided { yes: bool },
}

impl Answer {
    /// The exit code of the program.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Given | Self::Decided { yes: true } => 0,
            Self::Decided { yes: false } => EXIT_NO,
            Self::NotAll => EXIT_NO_ANSWER,
            Self::Verified { outcome, strict } => match outcome {
                Verification::Identical => 0,
                Verification::IdenticalReadablePart if !strict => 0,
                Verification::IdenticalReadablePart | Verification::Diverged => EXIT_NO,
                Verification::NotReplayable => EXIT_NO_ANSWER,
            },
        }
    }
}

impl Cli {
    /// Answers the question.
    ///
    /// # Errors
    /// There is no answer.
    pub fn run(self) -> Result<Answer> {
        match self.command {
            Command::Info(ask) => ask.run(),
            Command::Verify(ask) => ask.run(),
            Command::Evaluate(ask) => ask.run(),
            Command::Refly(ask) => ask.run(),
            Command::Compare(ask) => ask.run(),
            Command::Report(ask) => ask.run(),
            Command::Export(ask) => ask.run(),
            Command::Recover(ask) => ask.run(),
            Command::Fit(ask) => ask.run(),
            Command::Completions { shell } => {
                let mut script = Vec::new();
                clap_complete::generate(shell, &mut Self::command(), "replay", &mut script);
                answer(|output| output.write_all(&script))?;
                Ok(Answer::Given)
            }
            Command::Man => {
                answer(|output| clap_mangen::Man::new(Self::command()).render(output))?;
                Ok(Answer::Given)
            }
        }
    }
}

/// Writes an answer to standard output. A reader that closes the pipe early is not an error.
pub(crate) fn answer(
    write: impl FnOnce(&mut io::BufWriter<io::StdoutLock<'static>>) -> io::Result<()>,
) -> Result<()> {
    let mut output = io::BufWriter::new(io::stdout().lock());
    match write(&mut output).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error).context("standard output"),
        _ => Ok(()),
    }
}

/// Writes a new file; an existing one is kept.
pub(crate) fn write_new(path: &Path, text: &str) -> Result<()> {
    refuse_existing(path)?;
    NewFile::create(Destination { path, overwrite: Overwrite::Never }, Path::new(""))
        .and_then(|mut file| {
            file.write_all(text.as_bytes())?;
            file.commit()
        })
        .with_context(|| format!("{}: cannot be written", path.display()))
}

/// Refuses a path where a file is, before the work for it is done.
pub(crate) fn refuse_existing(path: &Path) -> Result<()> {
    ensure!(
        path.symlink_metadata().is_err(),
        "{}: exists already, and nothing is overwritten",
        path.display()
    );
    Ok(())
}

/// The text of a built-in, or of a file.
pub(crate) fn text_of(name: &str, builtin: &[(&str, &str)], what: &str) -> Result<String> {
    if let Some((_, text)) = builtin.iter().find(|(known, _)| *known == name) {
        return Ok((*text).to_owned());
    }
    std::fs::read_to_string(name).with_context(|| {
        let known = builtin.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        format!("'{name}' is neither a built-in {what} ({known}) nor a readable file")
    })
}

/// A flag that the first Ctrl-C (or a request to terminate) sets, so that what was found is still printed. The second
/// one ends the program.
pub(crate) fn stop_on_interrupt() -> Result<Arc<AtomicBool>> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::flag;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, i32::from(EXIT_NO_ANSWER), Arc::clone(&stop))
            .and_then(|_| flag::register(signal, Arc::clone(&stop)))
            .context("cannot wait for Ctrl-C")?;
    }
    Ok(stop)
}

/// Writes a line to standard error; a closed standard error is ignored.
pub(crate) fn say(text: &str) {
    let _ = writeln!(io::stderr(), "replay: {text}");
}

/// Warns about damage, a missing end of the flight and missing ticks.
pub(crate) fn warn_of_what_is_missing(recording: &Recording) {
    if let Some(Gap { after, before }) = recording.gap() {
        let name = &recording.name;
        say(&format!(
            "warning: {name}: after tick {after} comes tick {before}; nothing after the gap was run again"
        ));
    }
    warn_of_damage(&recording.name, recording.damage.as_deref());
    warn_of_cut(&recording.name, recording.cut.as_ref());
}

/// Warns about the damage and the missing end of a log that was described.
pub(crate) fn warn_of_completeness(name: &str, found: &Completeness) {
    warn_of_damage(name, found.damage.as_deref());
    warn_of_cut(name, found.cut.as_ref());
}

/// Warns that only the part of a log before its damage is used.
pub(crate) fn warn_of_damage(file: &str, damage: Option<&str>) {
    if let Some(damage) = damage {
        say(&format!("warning: {file} is damaged: {damage}; what can be read was used"));
    }
}

/// Warns that a flight was not recorded to its end.
pub(crate) fn warn_of_cut(file: &str, cut: Option<&Cut>) {
    if let Some(cut) = cut {
        say(&format!("warning: {file}: the flight {cut}"));
    }
}

/// How many work at the same time: as many as asked for, or as there are processors.
pub(crate) fn jobs(asked: Option<NonZeroUsize>) -> NonZeroUsize {
    asked.or_else(|| std::thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN)
}

/// Shows progress about twenty times on a terminal, elsewhere only at the end.
pub(crate) fn show_progress(done: usize, flights: usize) {
    let mut output = io::stderr();
    let ended = done == flights;
    if ended || (output.is_terminal() && done.is_multiple_of((flights / 20).max(1))) {
        let end = if ended { "\n" } else { "" };
        // Progress goes to standard error, which may be closed.
        let _ = write!(output, "\rreplay: {done} of {flights} flights{end}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arguments_of_every_command_are_sound() {
        Cli::command().debug_assert();
    }
}
