//! `onboard-sim`: the guidance with its NMPC against a simulated vehicle, on MAVLink.

mod cli;

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{Parser, Subcommand};
use flight::profile::BUILTIN;
use onboard_sim::fly::{FlightSummary, FlyOptions, Outcome, Speed, fly_observed, load_profile, log_header};
use onboard_sim::landability::{self, Axis};
use onboard_sim::paper;
use onboard_sim::vehicle::{DeadlinePolicy, VehicleEvent};
use protocol::key_file::KeyFile;
use protocol::log::recorder::Recorder;
use protocol::transport::Endpoint;
use tokio::sync::watch;

/// Flies the landing controller against a simulated vehicle and streams MAVLink 2.
#[derive(Parser)]
#[command(version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Fly one flight.
    ///
    /// Without --mavlink the vehicle arms and starts itself; with it, it waits for a ground station.
    ///
    /// Exit codes: 0 landed inside every limit; 1 error; 2 usage; 3 ended outside a limit; 4 refused or aborted;
    /// 5 stopped before its end.
    Fly(FlyArguments),
    /// Map where a landing inside the touchdown limits exists, over two quantities.
    Landability(LandabilityArguments),
    /// Fly a mission many times, from apogee to the ground, each time with another vehicle, motor and day.
    Campaign(cli::campaign::CampaignArguments),
    /// Repeat the landing paper's experiments: its Tables 3 to 6 beside ours, and its equations as printed.
    Paper {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Make a signing key: a new file that only you can read, for --key of vehicle and ground.
    Keygen {
        /// The file; an existing one is not overwritten.
        #[arg(value_name = "FILE")]
        file: PathBuf,
    },
    /// List the built-in profiles, or print one as a file to start from.
    Profiles {
        /// Print this profile's TOML.
        #[arg(long, value_name = "NAME")]
        show: Option<String>,
    },
}

#[derive(clap::Args)]
struct LandabilityArguments {
    /// Built-in profile or TOML file.
    #[arg(long, default_value = "paper-calibrated", value_name = "NAME|FILE")]
    profile: String,
    /// Columns: QUANTITY=FROM:TO:COUNT. Quantities: thrust-to-weight, height (m), speed (m/s), tilt (deg), rate
    /// (deg/s), lateral-speed (m/s), thrust-scale.
    #[arg(long, default_value = "thrust-to-weight=0.9:1.5:41", value_name = "AXIS")]
    x: Axis,
    /// Rows, in the same form.
    #[arg(long, default_value = "height=5:35:31", value_name = "AXIS")]
    y: Axis,
    /// Write the cells as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the map as a picture.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Cells computed at the same time; the map does not depend on it.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
}

#[derive(clap::Args)]
struct FlyArguments {
    /// Built-in profile or TOML file.
    #[arg(long, default_value = "paper-calibrated", value_name = "NAME|FILE")]
    profile: String,
    /// Link to serve: udpout:HOST:PORT, udpin:ADDRESS:PORT, tcpin:ADDRESS:PORT, tcpout:HOST:PORT or
    /// serial:DEVICE:BAUD; may be given more than once.
    #[arg(long, value_name = "LINK")]
    mavlink: Vec<Endpoint>,
    /// Sign every frame with this key, and act on nothing that is not signed with it. See keygen.
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Log to write (MCAP). An existing file is not overwritten.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Seed of the profile's dispersions.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Speed of simulated time: a factor, or max.
    #[arg(long, default_value = "1")]
    speed: Speed,
    /// Arm and start without a ground station, also with --mavlink.
    #[arg(long)]
    auto_start: bool,
    /// Keep serving the links after the flight, until interrupted.
    #[arg(long)]
    stay: bool,
    /// Do not apply a controller output that took longer than its sample, as hardware would not.
    #[arg(long)]
    enforce_deadline: bool,
}

fn main() -> ExitCode {
    match run(Arguments::parse()) {
        Ok(code) => code,
        Err(error) => {
            // Nothing is left to do if even this cannot be written.
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            ExitCode::from(1)
        }
    }
}

fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    match arguments.command {
        Command::Landability(arguments) => map_landability(&arguments),
        Command::Campaign(arguments) => cli::campaign::run(&arguments),
        Command::Paper { json } => repeat_paper(json),
        Command::Keygen { file } => {
            KeyFile::create(&file)?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Profiles { show } => profiles(show.as_deref()),
        Command::Fly(arguments) => {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
            runtime.block_on(fly(arguments))
        }
    }
}

fn map_landability(arguments: &LandabilityArguments) -> anyhow::Result<ExitCode> {
    let profile = load_profile(&arguments.profile)?.profile;
    let (x, y) = (arguments.x, arguments.y);
    anyhow::ensure!(x.quantity != y.quantity, "both axes vary {}; choose two quantities", x.quantity.name());
    let jobs =
        arguments.jobs.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let count = x.count * y.count;
    let shown = (count / 20).max(1);
    let map = landability::map(&profile, x, y, jobs, &|done| {
        if done.is_multiple_of(shown) || done == count {
            // Talk goes to standard error; nobody may be listening.
            let _ = write!(
                std::io::stderr(),
                "\r{done} of {count} cells{}",
                if done == count { "\n" } else { "" }
            );
        }
    });
    map.write_table(&mut std::io::stdout().lock())?;
    if let Some(path) = &arguments.csv {
        write_file(path, |out| map.write_csv(out))?;
    }
    if let Some(path) = &arguments.svg {
        write_file(path, |out| landability::write_svg(&map, &profile.name, out))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn write_file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> anyhow::Result<()> {
    let written = File::create(path).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.flush()
    });
    written.with_context(|| format!("cannot write {}", path.display()))
}

fn repeat_paper(json: bool) -> anyhow::Result<ExitCode> {
    let rows = paper::experiments()?;
    let printed = paper::as_printed()?;
    let mut out = std::io::stdout().lock();
    if json {
        writeln!(out, "{:#}", paper::to_json(&rows, &printed))?;
    } else {
        paper::write_tables(&mut out, &rows, &printed)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn profiles(show: Option<&str>) -> anyhow::Result<ExitCode> {
    let mut out = std::io::stdout().lock();
    if let Some(name) = show {
        out.write_all(load_profile(name)?.toml.as_bytes())?;
        return Ok(ExitCode::SUCCESS);
    }
    for (name, _) in BUILTIN {
        writeln!(out, "{name:<20} {}", load_profile(name)?.profile.summary)?;
    }
    Ok(ExitCode::SUCCESS)
}

async fn fly(arguments: FlyArguments) -> anyhow::Result<ExitCode> {
    let profile = load_profile(&arguments.profile)?;
    let recorder = match &arguments.log {
        None => None,
        Some(path) => {
            let header = log_header("onboard-sim", &profile, arguments.seed, unix_ns());
            Some(Recorder::create(path, &header)?)
        }
    };
    let options = FlyOptions {
        profile,
        auto_start: arguments.auto_start || arguments.mavlink.is_empty(),
        links: arguments.mavlink,
        key_file: arguments.key,
        recorder: recorder.clone(),
        seed: arguments.seed,
        speed: arguments.speed,
        exit_when_safed: !arguments.stay,
        deadline_policy: if arguments.enforce_deadline {
            DeadlinePolicy::Enforce
        } else {
            DeadlinePolicy::Observe
        },
        log_clock: None,
    };
    let (stop, stopped) = watch::channel(false);
    tokio::spawn(async move {
        interrupted().await;
        let _ = stop.send(true);
    });
    let flown = Box::pin(fly_observed(options, stopped, report_event)).await;
    let log_path = recorder.as_ref().map(Recorder::finish).transpose();
    let summary = flown?;
    print_summary(&summary)?;
    if let Some(path) = log_path.context("the flight is over, but its log is not whole")? {
        writeln!(std::io::stdout(), "log {}", path.display())?;
    }
    Ok(exit_code(&summary.outcome))
}

/// Waits for Ctrl-C or a request to terminate.
async fn interrupted() {
    use tokio::signal::unix::{SignalKind, signal};
    let Ok(mut terminate) = signal(SignalKind::terminate()) else {
        let _ = tokio::signal::ctrl_c().await;
        return;
    };
    tokio::select! {
        _ = tokio::signal::ctrl_c() => {}
        _ = terminate.recv() => {}
    }
}

fn report_event(time_s: f64, event: &VehicleEvent) {
    let words = match event {
        VehicleEvent::Text { text, .. } => text.clone(),
        VehicleEvent::PhaseChanged { from, to } => format!("phase {} to {}", from.name(), to.name()),
        VehicleEvent::Tick(_) | VehicleEvent::Verdict { .. } => return,
    };
    // A closed pipe must not end a flight.
    let _ = writeln!(std::io::stdout(), "{time_s:8.2} s  {words}");
}

fn print_summary(summary: &FlightSummary) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    if let Some((impact, verdict)) = &summary.verdict {
        writeln!(out, "touchdown at {:.3} s:", impact.time_s)?;
        for limit in &verdict.results {
            let mark = if limit.passed { "ok  " } else { "FAIL" };
            writeln!(
                out,
                "  {mark} {:<12} {:9.4} {:<5} (limit {} to {})",
                limit.name, limit.value, limit.unit, limit.lowest, limit.highest
            )?;
        }
    }
    if let Some([median_s, p99_s, worst_s]) = summary.solve_times.quantiles_s() {
        writeln!(
            out,
            "controller ticks: median {:.3} ms, p99 {:.3} ms, worst {:.3} ms, {} over their deadline",
            1e3 * median_s,
            1e3 * p99_s,
            1e3 * worst_s,
            summary.solve_times.missed()
        )?;
    }
    if let Some([median, p99, worst]) = summary.lateness.quantiles() {
        writeln!(out, "frames began late by: median {median:?}, p99 {p99:?}, worst {worst:?}")?;
    }
    match &summary.outcome {
        Outcome::Landed => writeln!(out, "LANDED inside every limit")?,
        Outcome::OutsideLimits => writeln!(out, "NOT LANDED: outside a limit")?,
        Outcome::Aborted => writeln!(out, "ABORTED in {}", summary.phase.name())?,
        Outcome::Refused(reason) => writeln!(out, "REFUSED: {reason}")?,
        Outcome::Stopped => writeln!(out, "STOPPED in {}", summary.phase.name())?,
    }
    Ok(())
}

fn exit_code(outcome: &Outcome) -> ExitCode {
    ExitCode::from(match outcome {
        Outcome::Landed => 0,
        Outcome::OutsideLimits => 3,
        Outcome::Aborted | Outcome::Refused(_) => 4,
        Outcome::Stopped => 5,
    })
}

#[expect(clippy::disallowed_methods, reason = "a log says when it was begun")]
fn unix_ns() -> u64 {
    let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since_epoch.map_or(0, |since| u64::try_from(since.as_nanos()).unwrap_or(u64::MAX))
}
