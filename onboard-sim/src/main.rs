//! `onboard-sim`: the guidance with its NMPC against a simulated vehicle, on MAVLink.

mod cli;

use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use flight::vehicles::mission;
use onboard_sim::files::text_of;
use protocol::key_file::KeyFile;
use protocol::program::{self, EXIT_CODES, Exit, Manual, Shown};
use protocol::signing::Key;

/// Flies the landing controller against a simulated vehicle and streams MAVLink 2.
#[derive(Parser)]
#[command(
    version,
    arg_required_else_help = true,
    after_help = format!("Example: onboard-sim fly --mission mk3 --log flight.mcap\n\n{EXIT_CODES}")
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    _shown: Shown,
}

#[derive(Subcommand)]
enum Command {
    /// Fly one flight.
    ///
    /// Without --mavlink the vehicle arms and starts itself; with it, it waits for a ground
    /// station.
    ///
    /// Exit code 0 if it stands undamaged, 3 if not, 4 if it was refused or aborted, 5 if it was
    /// stopped.
    #[command(
        after_help = "Examples:\n  onboard-sim fly --mission mk3 --log flight.mcap\n  onboard-sim fly --mavlink udpout:127.0.0.1:14550 --seed 7"
    )]
    Fly(cli::fly::FlyArguments),
    /// Fly a mission many times, from apogee to the ground, each time with another vehicle, motor
    /// and weather.
    #[command(
        after_help = "Example: onboard-sim campaign --mission mk3 --dispersion real --flights 1000 --out mk3-real"
    )]
    Campaign(cli::campaign::CampaignArguments),
    /// Say whether the vehicle of a mission will land, and what to change if not: one page, before
    /// anything is built.
    ///
    /// Exit code 0 if it is ok or tight, 3 if the answer is no.
    #[command(after_help = "Example: onboard-sim check mk3")]
    Check(cli::check::CheckArguments),
    /// Write the sheet that a team takes to the field, and the mission to load; refused for what
    /// cannot land.
    ///
    /// The folder gets card.html and card.txt (the same sheet: its front is for the range safety
    /// officer, its back for whoever prepares the vehicle) and mission.toml (the mission that was
    /// given, byte for byte). In each wind every way in which a flight can end is flown 100 times,
    /// and the farthest ones 400 times: some minutes.
    #[command(after_help = "Example: onboard-sim card --mission vlr --wind-from 270 --out card")]
    Card(cli::card::CardArguments),
    /// Show where a vehicle comes down, in each way that a flight can end: how near people may
    /// stand.
    ///
    /// Landed or not, aborted in each part of the flight, without its landing motor, with its
    /// booster, lifted off by itself, ballistic; and the spent booster. Beside it stands the rule
    /// of a national association; the larger distance counts.
    #[command(after_help = "Example: onboard-sim hazard --mission mk3 --wind 0,3,6 --csv hazard.csv")]
    Hazard(cli::hazard::HazardArguments),
    /// Play the recorded sensors of a real flight to the flight computer: what it would have
    /// decided.
    ///
    /// It prints which arming checks would refuse and why, when lift-off, burnout, separation,
    /// apogee and parachute come, and which measurements are rejected. Nothing is connected, no
    /// crew arms it, no phase is forced.
    ///
    /// Exit code 0 if it saw an apogee, 3 if a separation or a parachute came at more than 30 m/s
    /// upwards, 5 without an apogee.
    #[command(after_help = "Example: onboard-sim playback flight.csv --mission mk3 --out flight.mcap")]
    Playback(cli::playback::PlaybackArguments),
    /// Make a signing key: a new file that only you can read, for --key of vehicle and ground.
    #[command(after_help = "Example: onboard-sim keygen touchdown.key")]
    Keygen {
        /// The file. If it exists there is no second key: give another name.
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// Derive it from a passphrase, read as a line from standard input, as MAVProxy's `signing
        /// key` does (SHA-256).
        ///
        /// Anybody who records one signed frame can try passphrases on it: use six random words or
        /// more.
        #[arg(long)]
        passphrase: bool,
    },
    /// Write a mission file for a rocket of one's own.
    ///
    /// On a terminal it asks for what a club measures, one question a line. With --like it does not
    /// ask.
    #[command(
        after_help = "Examples:\n  onboard-sim new ours\n  onboard-sim new ours --from openrocket.csv --length 0.7\n  onboard-sim new ours --motor stand.csv --motor-data ours 38 200 0.19 0.365"
    )]
    New(cli::new::NewArguments),
    /// List the built-in missions, or print one as a file to start from.
    #[command(alias = "profiles", after_help = "Example: onboard-sim missions --show mk3")]
    Missions {
        /// Print this mission's TOML.
        #[arg(long, value_name = "NAME")]
        show: Option<String>,
    },
    #[command(flatten)]
    Manual(Manual),
}

fn main() -> ExitCode {
    let read = program::read(Arguments::command()).and_then(|given| Arguments::from_arg_matches(&given));
    let ended = read.map_or_else(|message| Ok(Exit::unread(&message)), run);
    ended
        .unwrap_or_else(|error| {
            // If writing fails here, there is nothing left to do.
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            Exit::Error
        })
        .into()
}

fn run(arguments: Arguments) -> anyhow::Result<Exit> {
    match arguments.command {
        Command::Campaign(arguments) => cli::campaign::run(&arguments),
        Command::Check(arguments) => cli::check::run(&arguments),
        Command::Card(arguments) => cli::card::run(&arguments),
        Command::Hazard(arguments) => cli::hazard::run(&arguments),
        Command::Playback(arguments) => cli::playback::run(&arguments),
        Command::Keygen { file, passphrase } => make_key(&file, passphrase),
        Command::New(arguments) => cli::new::run(&arguments),
        Command::Missions { show } => missions(show.as_deref()),
        Command::Fly(arguments) => cli::fly::run(arguments),
        Command::Manual(manual) => Ok(manual.print(Arguments::command())?),
    }
}

fn make_key(file: &Path, of_passphrase: bool) -> anyhow::Result<Exit> {
    if !of_passphrase {
        KeyFile::create(file)?;
        return Ok(Exit::Yes);
    }
    if std::io::stdin().is_terminal() {
        write!(std::io::stderr(), "passphrase, shown as you type it: ")?;
    }
    let mut line = String::new();
    std::io::stdin().read_line(&mut line).context("reading the passphrase")?;
    let passphrase = line.trim_end_matches(['\n', '\r']);
    anyhow::ensure!(!passphrase.is_empty(), "the passphrase is empty");
    KeyFile::create_with(file, &Key::from_passphrase(passphrase))?;
    Ok(Exit::Yes)
}

fn missions(show: Option<&str>) -> anyhow::Result<Exit> {
    let mut out = std::io::stdout().lock();
    if let Some(name) = show {
        out.write_all(text_of(name, mission::BUILTIN, "mission")?.as_bytes())?;
        return Ok(Exit::Yes);
    }
    for (name, text) in mission::BUILTIN {
        writeln!(out, "{name:<20} {}", mission::from_toml(text, name)?.summary)?;
    }
    Ok(Exit::Yes)
}
