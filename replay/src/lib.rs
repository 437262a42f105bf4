//! Answers questions about flight logs after the flight: what is in a log, whether the controller
//! of this build makes the recorded decisions again, what it would have done with other settings,
//! and how flights differ.
//!
//! In reading order:
//!
//! * [`Cli`] and [`cli`]: the command line. A command is one file with its arguments and its answer
//!   ([`cli::Answer`]: data and text), and its line here.
//! * [`log`]: opens a log and streams its records in bounded memory, or holds one flight.
//! * [`info`]: describes what is in a log, how complete it is and what can be done with it.
//! * [`findings`]: what went wrong in a flight, causes first.
//! * [`controller`]: builds the flight computer that a log's frames came from.
//! * [`verify`]: runs every frame again on its recorded input and compares the results bit for bit;
//!   explains one, and proves the books of ground stations.
//! * [`settings`]: other settings for a recorded flight, named as in its mission.
//! * [`evaluate`](mod@evaluate): runs the controller alone with other settings on recorded inputs
//!   (open loop).
//! * [`refly`](mod@refly): flies the flight again in simulation from a chosen moment (closed loop).
//! * [`fit`](mod@fit): estimates vehicle, motor and weather from flights, with intervals, and
//!   predicts the next day.
//! * [`table`]: reads a log as tables; [`compare`](mod@compare): compares flights signal by signal.
//! * [`report`](mod@report): writes a flight as one HTML page.
//! * [`import`](mod@import): flights of other programs as logs.
//! * [`export`]: writes a log as CSV, and the flown path for maps; [`recover`](mod@recover):
//!   repairs a damaged log.
//! * [`output`](onboard_sim::files): writes files completely or not at all, each new one under a
//!   name that is free.
//! * [`print`](mod@print): what answers have in common: columns, two verdicts beside each other.

pub mod cli;
pub mod compare;
pub mod controller;
pub use onboard_sim::files as output;
pub mod evaluate;
pub mod export;
pub mod findings;
pub mod fit;
pub mod import;
pub mod info;
pub mod log;
pub mod print;
pub mod recover;
pub mod refly;
pub mod report;
pub mod settings;
pub mod table;
pub mod verify;

use anyhow::Result;
use clap::{CommandFactory as _, Parser, Subcommand};
use protocol::program::{EXIT_CODES, Exit, Manual, Shown};

/// Describes flight logs, runs their flights again, and compares them.
///
/// Answers go to standard output, warnings and errors to standard error.
///
/// The answer is no, and the exit code 3: of verify, if something differs or cannot be, or with
/// --strict not all that can be compared was; with --book, if a book is broken, or its end is not
/// proven; of compare, if the verdicts differ, signals or samples are missing or a log is damaged,
/// or if a second folder lands less often; of fit, if it is NO-GO. It is 5 if verify cannot run
/// some frame again (no frames, no profile, frames missing) and all others are identical, if no log
/// has a book, and if some of several logs could not be read and the answer of the others is not
/// no.
///
/// A damaged log is used up to the damage, with a warning and exit code 0, except by verify
/// --strict and by compare.
#[derive(Debug, Parser)]
#[command(
    name = "replay",
    version,
    about,
    long_about,
    after_help = format!("Example: replay verify flight.mcap\n\n{EXIT_CODES}")
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    _shown: Shown,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Describes a log: grade, run, build, phases, verdict, frames, channels, damage.
    #[command(after_help = "Example: replay info flight.mcap")]
    Info(info::Args),
    /// Runs the flight computer of a log again and compares its decisions bit for bit.
    ///
    /// The flight computer is built from the profile in the log and run on the recorded inputs,
    /// from power-up or from where the log begins. Outputs, digests of the memory, estimates and
    /// the start at the release are compared, and the inputs are judged; a table says what was
    /// compared. With --strict a simulated flight is also flown again, and its measurements and its
    /// verdict are compared; truth, events and measured times never are.
    ///
    /// With --explain the plan of a recorded frame is solved again and judged: cost, what is
    /// broken, warm against cold start, predicted path. With --book the books of ground stations
    /// are proven (who did what when), or the first broken link is named.
    #[command(
        after_help = "Examples:\n  replay verify flight.mcap\n  replay verify flight.mcap --explain 6400\n  replay verify logs\n  replay verify --book ground.mcap vehicle.mcap"
    )]
    Verify(verify::Args),
    /// Open loop: what the controller alone would have commanded with other settings, on the
    /// recorded inputs.
    #[command(after_help = "Example: replay evaluate flight.mcap --set powered.weights.theta=90@6.5")]
    Evaluate(cli::WithSettings),
    /// Closed loop: flies a flight again from a chosen moment, with other settings.
    ///
    /// The flight is flown again from its start with the recorded draw up to that moment, because a
    /// log does not hold the internal states of gusts, servos and sensors; the record is not used
    /// afterwards. The answer says how many recorded frames were reproduced: with nothing changed,
    /// all of a simulated flight, bit for bit.
    #[command(after_help = "Example: replay refly flight.mcap --plant truth.impulse_scale=0.99")]
    Refly(refly::Args),
    /// Compares flights: the answer in one sentence, then verdicts, signals (RMS, maximum and
    /// when).
    ///
    /// Signals are named as in an export. Exit code 3 if the verdicts differ, if one flight lacks a
    /// signal or samples of a table, or if one log is damaged. Two folders are compared as sets of
    /// flights, paired by seed and number: rates, flips and distributions; exit code 3 if the
    /// second lands less often than chance explains, or lacks a flight.
    #[command(
        after_help = "Examples:\n  replay compare old.mcap new.mcap\n  replay compare old-logs new-logs"
    )]
    Compare(compare::Args),
    /// Writes a flight as one HTML page with its pictures inside: no network, whole without its
    /// script.
    #[command(after_help = "Example: replay report flight.mcap")]
    Report(report::Args),
    /// Writes a log's content as CSV, or the flown path as KML or GPX; replay-rerun writes a Rerun
    /// recording.
    #[command(
        after_help = "Examples:\n  replay export flight.mcap --out tables\n  replay export flight.mcap --out flight.kml"
    )]
    Export(export::Args),
    /// Imports a flight of another program: PX4 (.ulg), ArduPilot (.bin), and .csv of AltOS, CATS,
    /// RocketPy and OpenRocket.
    ///
    /// The log has position from the first sample, velocity and tilt, and the messages of
    /// ArduPilot. `info`, `report`, `compare` and `export` use it; it has no frames of a flight
    /// computer to run again.
    #[command(after_help = "Example: replay import flight.ulg flight.mcap")]
    Import(cli::FromTo),
    /// Recovers a readable log from a damaged one, and reports what was recovered and what time
    /// span is lost.
    #[command(after_help = "Example: replay recover cut.mcap whole.mcap")]
    Recover(cli::FromTo),
    /// Finds drag, thrust, delays, gimbal and wind of flights, with 95 % intervals, and says what
    /// it cannot find.
    ///
    /// Only sensor samples, commands, feedback and the flight computer's estimates are used. Scales
    /// are over the data of the mission in the log, per mass: weigh the vehicle. Several logs are
    /// also put together. A burn on a test stand (CSV) is compared with its motor's certified
    /// curve.
    ///
    /// With --day a motor lot, an airframe and a site are learnt from all flights so far, and
    /// mission and dispersions of the next day are written. With --flights that day is simulated
    /// with motors that the lot may have, and the landing rate gets an interval: GO (exit code 0)
    /// if the probability of a rate below the limit is at most the risk that is taken, NO-GO (exit
    /// code 3) if not.
    #[command(
        after_help = "Examples:\n  replay fit flight.mcap --out ours.toml\n  replay fit stand.csv --motor H45W\n  replay fit fits.json --mission mk3 --day day --flights 1000"
    )]
    Fit(fit::Args),
    #[command(flatten)]
    Manual(Manual),
}

impl Cli {
    /// Runs the command.
    ///
    /// # Errors
    /// There is no answer.
    pub fn run(self) -> Result<Exit> {
        match self.command {
            Command::Info(args) => args.run(),
            Command::Verify(args) => args.run(),
            Command::Evaluate(given) => evaluate::run(&given),
            Command::Refly(args) => args.run(),
            Command::Compare(args) => args.run(),
            Command::Report(args) => args.run(),
            Command::Export(args) => args.run(),
            Command::Import(files) => files.run(import::import),
            Command::Recover(files) => files.run(recover::recover),
            Command::Fit(args) => args.run(),
            Command::Manual(manual) => Ok(manual.print(Self::command())?),
        }
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
