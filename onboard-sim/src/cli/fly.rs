//! `onboard-sim fly`: one flight, over MAVLink links or without them.

use std::io::{BufRead as _, Write as _};
use std::num::{NonZeroU16, NonZeroU32};
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use flight::computer::messages::CrewMessage;
use flight::rules::verdict::Landing;
use flight::vehicle::mission::StartPoint;
use protocol::background::survive_file_size_limit;
use protocol::crew_file::CrewFile;
use protocol::identity::{LARGEST_BOOT_NUMBER, NETWORK_BUDGET_BYTES_S, RADIO_BUDGET_BYTES_S, VEHICLE};
use protocol::log::recorder::Recorder;
use protocol::log::v1::LimitResult;
use protocol::program::{Exit, in_range, is_quiet};
use protocol::transport::LinkAddress;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::getpgrp;
use rustix::termios::tcgetpgrp;
use serde_json::{Value, json};
use sim::fault::{TimedFault, how_to_write};
use sim::wire::fly::{FlightEnd, FlightSummary, FlyOptions, OnTheWire, Speed, fly_observed};
use sim::wire::vehicle::{RocketFlight, VehicleEvent};
use tokio::sync::watch;

use super::{WINDS_M_S, WindsFile, in_wind, logging, notify, recipe};

#[derive(Args)]
#[command(
    after_help = "With --mavlink, type `pin in` or `pin out` and Enter: the pin that a crew moves by hand. It is out at first.\n\
    An abort on the pad is kept beside FILE of --uid-file, else of --key, else of --log (FILE.aborted): switched off and on, the\n\
    vehicle refuses arming until 60 s have passed, and asks for the pin."
)]
pub(crate) struct FlyArguments {
    /// Built-in mission or TOML file.
    #[arg(long, alias = "profile", default_value = flight::vehicles::mission::DEFAULT, value_name = "NAME|FILE")]
    mission: String,
    /// Link to serve: udpout:HOST:PORT, udpin:ADDRESS:PORT, tcpin:ADDRESS:PORT, tcpout:HOST:PORT or
    /// serial:DEVICE:BAUD; may be given more than once.
    #[arg(long, value_name = "LINK")]
    mavlink: Vec<LinkAddress>,
    /// MAVLink system id of the vehicle: each vehicle on one link needs its own.
    #[arg(long, default_value_t = VEHICLE.system_id, value_name = "ID", value_parser = in_range(1..=u8::MAX))]
    sysid: u8,
    /// Sign every frame with this key, and ignore frames that are not signed with it. See keygen.
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// People who may command, each with a key of their own (TOML; see docs/crew.md): arming and
    /// start by one or by two of them. Needs --key, which all share.
    #[arg(long, value_name = "FILE", requires = "key")]
    crew: Option<PathBuf>,
    /// Budget of a network link, bytes per second, 2000 to 1000000: 2000 if a radio carries it on.
    /// Above 2000, attitude, speed, battery, mode and GNSS go out in the messages of other ground
    /// stations, too, and the place more often than every 2 s.
    #[arg(long, value_name = "BYTES_S", default_value_t = NETWORK_BUDGET_BYTES_S,
        value_parser = in_range(RADIO_BUDGET_BYTES_S..=1_000_000))]
    network_budget: u32,
    /// Budget of a serial link, bytes per second, 2000 to 1000000: what the radio behind it
    /// carries, and at most four fifths of what its baud rate does.
    #[arg(long, value_name = "BYTES_S", default_value_t = RADIO_BUDGET_BYTES_S,
        value_parser = in_range(RADIO_BUDGET_BYTES_S..=1_000_000))]
    serial_budget: u32,
    /// Number of this boot on the wire, 1 to 16777215, instead of a random one.
    #[arg(long, value_name = "NUMBER", value_parser = boot_number)]
    boot_number: Option<NonZeroU32>,
    /// Keep the vehicle's unique id, a random number, in this file, so that a station knows the
    /// vehicle again after a power cycle. Without it each start is another vehicle.
    #[arg(long, value_name = "FILE")]
    uid_file: Option<PathBuf>,
    /// Log to write (MCAP), or `none`, as without this option. An existing file is kept: the log
    /// then gets the next free name, and says so.
    #[arg(long, value_name = "FILE|none")]
    log: Option<PathBuf>,
    /// Seed of the dispersions.
    #[arg(long, default_value_t = 1, value_parser = in_range(0..=u64::MAX))]
    seed: u64,
    /// Which flight of the seed, as in campaign --only.
    #[arg(long, default_value_t = 0, value_name = "NUMBER", value_parser = in_range(0..=u64::MAX))]
    flight: u64,
    /// Where the flight begins: pad, apogee or drone, if the mission has that start [default: the
    /// mission's].
    #[arg(long, value_name = "START")]
    start: Option<StartPoint>,
    /// Built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh, wild) or
    /// TOML file.
    #[arg(long, default_value = "field", value_name = "NAME|FILE")]
    dispersion: String,
    /// Mean wind 10 m above the ground, m/s, instead of the set's.
    #[arg(long, value_name = "M_S", conflicts_with = "winds_file", value_parser = in_range(WINDS_M_S))]
    wind: Option<f64>,
    #[command(flatten)]
    winds_aloft: WindsFile,
    /// Break something; may be repeated.
    #[arg(long = "fault", value_name = "FAULT", long_help = format!("Break something; may be given more than once. Write {}", how_to_write()))]
    faults: Vec<TimedFault>,
    /// Speed of simulated time: a factor, or max. On the pad with a crew, at most real time: the
    /// vehicle judges its uplink by the age of the last heartbeat. --auto waits for no crew.
    #[arg(long, default_value = "1")]
    speed: Speed,
    /// Arm and start without a ground station, also with --mavlink.
    #[arg(long)]
    auto: bool,
    /// Keep serving the links after the flight, until interrupted; after an abort on the pad they
    /// are served anyway.
    #[arg(long)]
    stay: bool,
    /// The flight computer of a board decides every frame, too, over the pipes `frames` and
    /// `answers` in this folder, and speaks MAVLink on its own radio
    /// (onboard-sim/lab/cortex-m7/emulate). A frame that it decides otherwise ends the flight.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["mavlink", "key", "auto"])]
    board: Option<PathBuf>,
    /// Print how the flight ended and where its log is, as one JSON object, and nothing else.
    #[arg(long)]
    json: bool,
}

/// Note on the speed of a flight that waits for a crew.
const PAD_SPEED: &str = "onboard-sim: on the pad a vehicle with a crew runs at real time, because it judges its uplink by the age of \
    the last heartbeat; --auto waits for no crew";

pub(crate) fn run(arguments: FlyArguments) -> anyhow::Result<Exit> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(fly(arguments))
}

impl FlyArguments {
    /// The flight that the options describe.
    fn flight(&self) -> anyhow::Result<RocketFlight> {
        let recipe = recipe(&self.mission, self.start, &self.dispersion, self.seed)?;
        let mut recipe = self.winds_aloft.applied(recipe)?;
        if let Some(wind_m_s) = self.wind {
            recipe = in_wind(&recipe, wind_m_s)?;
        }
        recipe.faults.clone_from(&self.faults);
        Ok(RocketFlight { recipe, number: self.flight })
    }
}

async fn fly(arguments: FlyArguments) -> anyhow::Result<Exit> {
    survive_file_size_limit().context("handling the limit of the file size")?;
    let (flight, as_json_object) = (arguments.flight()?, arguments.json);
    let crew = arguments.crew.as_deref().map(CrewFile::open).transpose()?;
    let log = arguments.log.as_ref().filter(|path| *path != Path::new("none"));
    let recorder = log.map(|path| logging(path, &flight.log_header("onboard-sim", unix_ns()))).transpose()?;
    let drawn = OnTheWire::drawn();
    let uid = arguments.uid_file.as_deref().map(|file| stored_uid(file, drawn.uid)).transpose()?;
    let on_the_wire = OnTheWire {
        boot_number: arguments.boot_number.unwrap_or(drawn.boot_number),
        uid: uid.unwrap_or(drawn.uid),
        network_bytes_s: arguments.network_budget,
        serial_bytes_s: arguments.serial_budget,
    };
    // People may be at it: an automatic flight gives no warning.
    let crewed = !arguments.auto && !arguments.mavlink.is_empty();
    if crewed && !matches!(arguments.speed, Speed::Factor(factor) if factor <= 1.0) {
        notify(PAD_SPEED);
    }
    // Beside the first of these that the vehicle has: they make it the same vehicle when it is
    // switched on again.
    let own = arguments.uid_file.as_ref().or(arguments.key.as_ref()).or(log);
    let abort_file = own.filter(|_| crewed).map(|file| file.with_added_extension("aborted"));
    let options = FlyOptions {
        on_the_wire,
        flight,
        auto_start: arguments.auto || (arguments.mavlink.is_empty() && arguments.board.is_none()),
        system_id: arguments.sysid,
        links: arguments.mavlink,
        key_file: arguments.key,
        crew,
        recorder: recorder.clone(),
        speed: arguments.speed,
        exit_when_safed: !arguments.stay,
        board: arguments.board,
        pin_out: crewed.then(pin_as_typed).transpose()?,
        abort_file,
        log_clock: None,
    };
    let (stop, stopped) = watch::channel(false);
    tokio::spawn(async move {
        interrupted().await;
        let _ = stop.send(true);
    });
    let (mut began, quiet) = (false, as_json_object || is_quiet());
    let observe = |time_s: f64, event: &VehicleEvent| {
        began = true;
        if !quiet {
            report_event(time_s, event);
        }
    };
    let flown = Box::pin(fly_observed(options, stopped, observe)).await;
    if flown.is_err()
        && !began
        && let Some(recorder) = &recorder
    {
        // A key or a link that cannot be opened.
        recorder.discard().with_context(|| format!("{}: cannot be removed", recorder.path().display()))?;
    }
    let log_path = recorder.as_ref().map(Recorder::finish).transpose();
    let summary = flown?;
    let log_path = log_path.context("the flight is over, but its log is incomplete");
    if as_json_object {
        let log = log_path.as_ref().ok().and_then(Option::as_ref);
        writeln!(std::io::stdout(), "{:#}", as_json(&summary, log))?;
        return log_path.map(|_| exit(&summary.outcome));
    }
    print_summary(&summary)?;
    if let Some(path) = log_path? {
        writeln!(std::io::stdout(), "log {}", path.display())?;
    }
    Ok(exit(&summary.outcome))
}

/// Waits for Ctrl-C or a request to terminate.
async fn interrupted() {
    use tokio::signal::unix::{SignalKind, signal};
    let mut terminate = signal(SignalKind::terminate());
    tokio::select! {
        _ = tokio::signal::ctrl_c() => {}
        Some(()) = async { terminate.as_mut().ok()?.recv().await } => {}
    }
}

fn boot_number(text: &str) -> Result<NonZeroU32, String> {
    let number = text.parse().ok().filter(|number: &NonZeroU32| number.get() <= LARGEST_BOOT_NUMBER);
    number.ok_or_else(|| format!("must be a whole number from 1 to {LARGEST_BOOT_NUMBER}"))
}

/// The unique id in the file; a new file gets the drawn one.
fn stored_uid(file: &Path, drawn: NonZeroU16) -> anyhow::Result<NonZeroU16> {
    let name = file.display();
    match std::fs::read_to_string(file) {
        Ok(text) => text.trim().parse().ok().with_context(|| {
            let most = u16::MAX;
            format!("{name}: `{}` is no unique id; it must be a whole number from 1 to {most}", text.trim())
        }),
        Err(why) if why.kind() == std::io::ErrorKind::NotFound => {
            std::fs::write(file, format!("{drawn}\n"))
                .with_context(|| format!("{name} cannot be written"))?;
            Ok(drawn)
        }
        Err(why) => Err(why).with_context(|| format!("{name} cannot be read")),
    }
}

/// Receives the position of the pin, typed at this program.
fn pin_as_typed() -> std::io::Result<watch::Receiver<bool>> {
    let (pin, moved) = watch::channel(true);
    std::thread::Builder::new().name("pin".to_owned()).spawn(move || read_pin(&pin))?;
    Ok(moved)
}

/// Until the end of standard input. That of a background job is left alone: reading it would stop
/// the job.
fn read_pin(pin: &watch::Sender<bool>) {
    let stdin = std::io::stdin();
    let mut typed = Vec::new();
    loop {
        // Fails only for a signal.
        let _ = poll(&mut [PollFd::new(&stdin, PollFlags::IN)], None);
        if tcgetpgrp(&stdin).is_ok_and(|front| front != getpgrp()) {
            let _ = poll(&mut [], Some(&Timespec { tv_sec: 1, tv_nsec: 0 }));
            continue;
        }
        let mut input = stdin.lock();
        let Ok(chunk @ [_, ..]) = input.fill_buf() else { return };
        typed.extend_from_slice(chunk);
        let length = chunk.len();
        input.consume(length);
        while let Some(end) = typed.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = typed.drain(..=end).collect();
            let words = String::from_utf8_lossy(&line).to_lowercase();
            match words.split_whitespace().collect::<Vec<_>>()[..] {
                ["pin", "in"] => _ = pin.send(false),
                ["pin", "out"] => _ = pin.send(true),
                [] => {}
                _ => _ = writeln!(std::io::stderr(), "type `pin in` or `pin out`, and Enter"),
            }
        }
        // Commands are shorter.
        typed.truncate(100);
    }
}

fn report_event(time_s: f64, event: &VehicleEvent) {
    let words = match event {
        VehicleEvent::Message(CrewMessage::Text { text, .. }) => text.to_string(),
        VehicleEvent::Message(CrewMessage::PhaseChanged { from, to }) => {
            format!("phase {} to {}", from.name(), to.name())
        }
        VehicleEvent::Planned(_) | VehicleEvent::Verdict => return,
    };
    // A closed pipe must not end a flight.
    let _ = writeln!(std::io::stdout(), "{time_s:8.2} s  {words}");
}

fn print_summary(summary: &FlightSummary) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    if let (Some(judged), Some(verdict)) = (&summary.judged, &summary.verdict) {
        let boot_s = judged.time_s;
        writeln!(out, "touchdown at T+{:.3} s, {boot_s:.3} s since power-up", verdict.time_s)?;
        let [_, _, envelope, table_2] = Landing::WORDS;
        for (title, limits) in
            [("borne", &verdict.borne), (envelope, &verdict.envelope), (table_2, &verdict.table_2)]
        {
            writeln!(out, "{title}:")?;
            print_limits(&mut out, limits)?;
        }
    }
    if let Some([median_s, p99_s, worst_s]) = summary.solve_times.quantiles_s() {
        writeln!(
            out,
            "plans: median {:.3} ms, p99 {:.3} ms, worst {:.3} ms, {} over their deadline",
            1e3 * median_s,
            1e3 * p99_s,
            1e3 * worst_s,
            summary.solve_times.missed()
        )?;
    }
    if let Some(quantiles) = summary.lateness.quantiles() {
        let [median_ms, p99_ms, worst_ms] = quantiles.map(|late| 1e3 * late.as_secs_f64());
        writeln!(
            out,
            "frames began late by: median {median_ms:.1} ms, p99 {p99_ms:.1} ms, worst {worst_ms:.1} ms"
        )?;
    }
    let ending = summary.verdict.as_ref().and_then(|verdict| verdict.ending.as_deref());
    match (&summary.outcome, ending) {
        (FlightEnd::Refused(reason), _) => writeln!(out, "REFUSED: {reason}")?,
        (_, Some(ending)) => writeln!(out, "{ending}")?,
        (FlightEnd::Aborted, None) => writeln!(out, "ABORTED in {}", summary.phase.name())?,
        (FlightEnd::Stopped, None) => writeln!(out, "STOPPED in {}", summary.phase.name())?,
        (FlightEnd::Landed | FlightEnd::NotLanded, None) => {
            writeln!(out, "NOT LANDED: it did not come down")?;
        }
    }
    Ok(())
}

/// How a flight ended and where its log is, for programs.
fn as_json(summary: &FlightSummary, log: Option<&PathBuf>) -> Value {
    let refusal = if let FlightEnd::Refused(reason) = &summary.outcome { Some(reason) } else { None };
    json!({
        "exit_code": exit(&summary.outcome) as u8, "phase": summary.phase.name(), "time_s": summary.time_s, "refusal": refusal,
        "verdict": summary.verdict, "log": log,
    })
}

/// Rounds away the error of converting degrees to radians and back.
fn round(limit: f64) -> f64 {
    (1e9 * limit).round() / 1e9
}

fn print_limits(out: &mut impl std::io::Write, limits: &[LimitResult]) -> std::io::Result<()> {
    for limit in limits {
        let mark = if limit.passed { "ok  " } else { "FAIL" };
        writeln!(
            out,
            "  {mark} {:<14} {:9.4} {:<5} (limit {} to {})",
            limit.name,
            limit.value,
            limit.unit,
            round(limit.minimum),
            round(limit.maximum)
        )?;
    }
    Ok(())
}

fn exit(outcome: &FlightEnd) -> Exit {
    match outcome {
        FlightEnd::Landed => Exit::Yes,
        FlightEnd::NotLanded => Exit::No,
        FlightEnd::Aborted | FlightEnd::Refused(_) => Exit::RefusedOrAborted,
        FlightEnd::Stopped => Exit::NotSeen,
    }
}

#[expect(clippy::disallowed_methods, reason = "a log says when it was begun")]
fn unix_ns() -> u64 {
    let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since_epoch.map_or(0, |since| u64::try_from(since.as_nanos()).unwrap_or(u64::MAX))
}
