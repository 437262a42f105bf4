//! `replay refly`.

use std::path::PathBuf;

use anyhow::{Context as _, Result, anyhow};
use clap::{Args, ValueEnum};
use flight::rules::phase::Phase;
use replay::log::{Clock, ClockTime, Recording};
use replay::output::{Destination, Overwrite};
use replay::print::{print_json, print_refly};
use replay::refly::{FaultChanges, From, Law, ReflyOptions, StartAt, refly_flight, write_log};
use replay::settings::Setting;

use super::settings::SettingArguments;
use super::{Answer, answer, warn_of_what_is_missing};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    #[command(flatten)]
    how: FlownHow,
    /// Begin at this frame instead of the landing's first.
    #[arg(long, value_name = "N", conflicts_with_all = ["at", "phase"])]
    tick: Option<u64>,
    /// Begin at this time in seconds, on the clock that its name says: T+12.9 or 12.9 (since the release), boot:19.8
    /// (since power-up), log:19.7 (since the first record).
    #[arg(long, value_name = "TIME", conflicts_with = "phase")]
    at: Option<ClockTime>,
    /// Begin with this phase, as in POWERED.
    #[arg(long, value_name = "PHASE", value_parser = phase_named)]
    phase: Option<Phase>,
    /// Write the flight as a new log.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Replace an existing file, but never the log that is flown again.
    #[arg(long, requires = "log")]
    force: bool,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

/// How a flight is flown again, wherever it begins.
#[derive(Debug, Args)]
pub(super) struct FlownHow {
    #[command(flatten)]
    pub(super) settings: SettingArguments,
    /// Another setting of the plant only, which the controller does not know about. For example
    /// airframe.motor=G33, truth.wind_m_s=7, truth.impulse_scale=0.97. May be given more than once.
    #[arg(long, value_name = "PATH=VALUE")]
    plant: Vec<Setting>,
    /// The recorded state to begin from.
    #[arg(long, value_enum, default_value_t = Origin::Truth)]
    from: Origin,
    /// The controller that flies.
    #[arg(long, value_enum, default_value_t = Controller::AsRecorded)]
    controller: Controller,
    /// Another fault, NAME[:VALUE]@WHEN as in gnss-out@5; may be given more than once. The flight is
    /// flown with it from its beginning.
    #[arg(long = "fault", value_name = "FAULT")]
    faults: Vec<String>,
    /// Leave out a recorded fault, by its name or in full; `all` for every one.
    #[arg(long, value_name = "FAULT")]
    without_fault: Vec<String>,
    /// Seed of the plant's dispersions instead of the recorded one.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Origin {
    /// The simulated plant's state.
    Truth,
    /// The controller's estimate: the plant begins where the estimate was.
    Estimate,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Controller {
    /// As recorded.
    AsRecorded,
    /// The pilot itself.
    Nmpc,
    /// Ignition and fins at times fixed in advance.
    OpenLoop,
    /// The nose swings to waste thrust.
    Oscillating,
}

impl FlownHow {
    pub(super) fn options(&self, start: StartAt) -> Result<ReflyOptions> {
        Ok(ReflyOptions {
            start,
            from: match self.from {
                Origin::Truth => From::Truth,
                Origin::Estimate => From::Estimate,
            },
            settings: self.settings.all()?,
            plant_settings: self.plant.clone(),
            law: match self.controller {
                Controller::AsRecorded => Law::AsRecorded,
                Controller::Nmpc => Law::Nmpc,
                Controller::OpenLoop => Law::OpenLoop,
                Controller::Oscillating => Law::Oscillating,
            },
            seed: self.seed,
            faults: FaultChanges { with: self.faults.clone(), without: self.without_fault.clone() },
        })
    }
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let recording = Recording::open(&self.file)?;
        let start = match (self.tick, self.at, self.phase) {
            (Some(tick), ..) => StartAt::Tick(tick),
            (_, Some(time), _) => StartAt::Time(flight_time_s(&recording, time)?),
            (.., Some(phase)) => StartAt::Phase(phase),
            _ => StartAt::Landing,
        };
        warn_of_what_is_missing(&recording);
        let options = self.how.options(start)?;
        let (report, flight) = refly_flight(&recording, &options)?;
        if let Some(path) = &self.log {
            let destination = Destination { path, overwrite: Overwrite::if_forced(self.force) };
            write_log(destination, &recording, &options, &report, &flight)?;
        }
        answer(|output| if self.json { print_json(&report, output) } else { print_refly(&report, output) })?;
        Ok(Answer::Given)
    }
}

fn flight_time_s(recording: &Recording, time: ClockTime) -> Result<f64> {
    let converted = recording.clocks.convert(time, Clock::Flight);
    let name = &recording.name;
    converted.map(|time| time.time_s).with_context(|| {
        format!("--at {time}: {name} does not say when its T+0 was on that clock; give the time as T+SECONDS")
    })
}

fn phase_named(given: &str) -> Result<Phase> {
    let known = Phase::ALL.into_iter().find(|phase| phase.name().eq_ignore_ascii_case(given));
    known.ok_or_else(|| {
        let names: Vec<&str> = Phase::ALL.iter().map(|phase| phase.name()).collect();
        anyhow!("no phase `{given}`; there are {}", names.join(", "))
    })
}
