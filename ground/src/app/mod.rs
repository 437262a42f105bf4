//! The run loops and everything that touches the outside: terminal, links, log file, clock, signals, sockets.

mod again;
pub mod alarm_command;
pub mod attached;
mod book;
mod checklist;
pub mod clock;
mod download;
mod key_ring;
pub mod lines;
pub mod log;
mod operator;
mod output;
pub mod pace;
mod places;
pub mod print;
pub mod replaying;
mod report;
pub mod screen;
pub mod server;
pub mod signals;
mod station;
pub mod stations;
mod terminal_writer;
pub mod voice;
mod watchers;
pub mod wire;

use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::IsTerminal as _;
use std::time::Duration;

use anyhow::Context as _;
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;
use protocol::mission::MissionHash;
use protocol::transport::LinkAddress;
use simulated_vehicle::fly::load_flight;

use crate::cli::{Cli, Command, LogChoice, Seconds};
use crate::config::Config;
use crate::demo::{Demo, DemoOptions, LogClock};
use crate::exit::{self, Exit};
use crate::model::seat::Seat;
use crate::model::{Model, Role, Settings};
use crate::update::update;
use again::Again;
use attached::Viewer;
use clock::{Clock, LogTime};
use key_ring::KeyRing;
use log::LogGuard;
use output::Output;
use server::{Server, hello};
use station::Station;
use watchers::Watchers;
use wire::Wire;

const AUTO_TIME_LIMIT: Duration = Duration::from_mins(2);

/// Runs the ground station until its end.
///
/// # Errors
/// A socket, a file or the terminal failed, or the profile is wrong.
pub fn run(cli: &Cli) -> anyhow::Result<Exit> {
    match &cli.command {
        Some(Command::Config { command }) => return print::config(cli, command),
        Some(Command::Completions { shell }) => return print::completions(*shell),
        Some(Command::Man) => return print::manual(),
        _ => {}
    }
    let config = Config::load(cli.config.as_deref())?.overridden_by(cli);
    let mut cli = cli.clone();
    config.fill(&mut cli);
    let (cli, config) = (&cli, &config);
    let dumb = std::env::var_os("TERM").is_none_or(|term| term.is_empty() || term == "dumb");
    let interactive = std::io::stdout().is_terminal() && !cli.headless && !dumb;
    let socket = cli.socket.as_deref();
    let operator = operator::operator(cli.operator.as_deref());
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().context("making the run loop")?;
    runtime.block_on(async {
        match (&cli.command, &cli.replay) {
            (Some(Command::Status), _) => stations::list().await,
            (Some(Command::Stop { force }), _) => stations::stop(socket, *force, operator).await,
            (Some(Command::Attach { watch, from }), _) => {
                let viewer = Viewer {
                    // Nobody can command through a feed.
                    watch: *watch || from.is_some(),
                    feed: from.clone(),
                    operator,
                    keys: config.keys.clone(),
                    talk: config.talk(),
                };
                attached::session(socket, &viewer, config, interactive).await
            }
            (Some(Command::Download { name, to }), _) => download::alone::run(cli, name.as_deref(), to).await,
            (Some(Command::Daemon), _) => session(cli, config, false, operator).await,
            (_, Some(path)) => replaying::session(cli, path, config, interactive).await,
            (_, None) => session(cli, config, interactive, operator).await,
        }
    })
}

async fn session(cli: &Cli, config: &Config, interactive: bool, operator: String) -> anyhow::Result<Exit> {
    let clock = Clock::start();
    let demo_options = match &cli.connect[..] {
        [] => Some(DemoOptions::load(&cli.demonstration(), cli.vehicle().system_id)?),
        _ => None,
    };
    let header = match &demo_options {
        Some(options) => options.log_header(clock.start_unix_ns()),
        None => LogHeader {
            writer: "ground".to_owned(),
            start_unix_ns: clock.start_unix_ns(),
            ..LogHeader::default()
        },
    };
    let tlog = cli.tlog.as_ref();
    let tlog = if tlog.is_none() && demo_options.is_some() { Some(&LogChoice::None) } else { tlog };
    let recorder = log::open(cli.log.as_ref(), tlog, &header)?;
    let log_guard = LogGuard::new(recorder.clone());
    let (mut station, mut model, mut wire) =
        match start(cli, config, interactive, operator, (clock, demo_options, recorder)).await {
            Ok(started) => started,
            Err(error) => {
                log_guard.discard();
                return Err(error);
            }
        };
    let ran = station.run(&mut model, &mut wire).await;
    station.close_book(&mut model, &mut wire);
    if let Some(msg) = wire.save_timestamps() {
        update(&mut model, msg, clock.now());
    }
    station.close(&model).await;
    let log_path = log_guard.finish();
    ran?;
    lines::closing(&model, interactive, log_path.as_ref(), clock.now());
    log_path.context("the log")?;
    Ok(exit::decide(&model.outcome, interactive))
}

/// Opens everything that a station needs, except its log.
async fn start(
    cli: &Cli,
    config: &Config,
    interactive: bool,
    operator: String,
    (clock, demo_options, recorder): (Clock, Option<DemoOptions>, Option<Recorder>),
) -> anyhow::Result<(Station, Model, Wire)> {
    let is_daemon = matches!(cli.command, Some(Command::Daemon));
    // The demonstration uses any free port, so that it can run beside a real ground station.
    let mut endpoints = cli.connect.clone();
    if endpoints.is_empty() {
        endpoints.push(LinkAddress::UdpIn("127.0.0.1:0".to_owned()));
    }
    let KeyRing { key, owner, book_key, roles } = KeyRing::open(cli)?;
    let start_unix_s = clock.start_unix_ns() / 1_000_000_000;
    let checklist = cli.checklist.as_deref().map(|path| checklist::open(path, start_unix_s)).transpose()?;
    let mission = cli.mission.as_deref().map(load_flight).transpose()?;
    let vehicle_clock = demo_options.as_ref().map(|_| LogClock::new());
    let log_time = vehicle_clock.clone().map_or(LogTime::Run(clock), LogTime::Vehicle);
    let opened =
        Wire::open((cli.us(), cli.vehicle()), endpoints, key, clock, recorder.clone(), log_time.clone())
            .await;
    let wire = match opened {
        Ok(wire) => wire,
        Err(error) => return Err(stations::explain(error, &cli.connect).await),
    };
    let demo = match (&demo_options, vehicle_clock) {
        (Some(options), Some(vehicle_clock)) => {
            Some(start_demo(options, wire.endpoints().next(), recorder.clone(), vehicle_clock)?)
        }
        _ => None,
    };
    let auto = if is_daemon { cli.auto } else { cli.starts_by_itself(interactive) };
    let links: Vec<String> = wire.endpoints().map(LinkAddress::to_string).collect();
    let mut model = Model::new(Settings {
        link_capacity_bytes_s: capacity_of(&wire),
        vehicle_name: demo.as_ref().map(|_| cli.demonstration().profile.to_owned()),
        log_path: recorder.as_ref().map(|recorder| recorder.path().display().to_string()),
        tlog_path: recorder.as_ref().and_then(Recorder::tlog_path).map(|path| path.display().to_string()),
        us: cli.us(),
        session: drawn_session(),
        vehicle: cli.vehicle(),
        role: Role::Station,
        seat: if interactive { Seat::new(1, operator) } else { Seat::default() },
        key_owner: owner,
        mission: mission.map(|mission| MissionHash::of(mission.toml())),
        crew_roles: roles,
        pad: cli.pad,
        here: cli.here,
        start_unix_s,
        demonstration: demo.is_some(),
        auto,
        // A daemon also keeps running after a flight.
        interactive: interactive || is_daemon,
        keys: config.keys.clone(),
        talk: config.talk(),
        time_limit: cli.timeout_s.map(|Seconds(limit)| limit).or(auto.then_some(AUTO_TIME_LIMIT)),
        ..Settings::on_screen(links.join(" and "))
    });
    announce(&mut model, auto, clock.now());
    let mut signatures = None;
    if let Some((list, file, told)) = checklist {
        model.checklist = Some(list);
        signatures = Some(file);
        for text in told {
            model.warn(clock.now(), text);
        }
    }
    if let Some(place) = places::newest(recorder_folder(recorder.as_ref()), start_unix_s) {
        model.place = Some(place);
        model.info(clock.now(), "the last place of a vehicle is kept from before: page Find");
    }
    let server = serve(cli, &mut model, interactive, &clock).await?;
    let watchers = feed(cli, server.as_ref()).await?;
    if demo.is_some()
        && !is_daemon
        && let Some(line) = stations::running_beside().await
    {
        model.info(clock.now(), line);
    }
    let output = Output::open(interactive, config)?;
    model.repeats_reported = output.reports_repeats();
    let mut station = Station {
        clock,
        log_time,
        recorder,
        log_space: log::SpaceWatch::default(),
        demo,
        output,
        socket: cli.socket.clone(),
        server,
        screens: Vec::new(),
        alarm_command: config.alarm_command.clone(),
        quiet_input: None,
        signatures,
        book: None,
        again: Again::default(),
        _watchers: watchers,
        report: None,
        download: None,
        place_failed: false,
        report_at: Duration::ZERO,
    };
    station.open_book(&model, book_key);
    station.publish_checklist(&model, clock.now());
    station.publish_place(&model, clock.now());
    Ok((station, model, wire))
}

/// The capacity of the link; with several links, each has its own.
fn capacity_of(wire: &Wire) -> Option<u32> {
    wire.endpoints().next().filter(|_| wire.endpoints().count() == 1).and_then(LinkAddress::capacity_bytes_s)
}

/// A random number other than 0: the standard library's hash keys differ in every process.
fn drawn_session() -> u32 {
    (RandomState::new().build_hasher().finish() as u32).max(1)
}

/// Says what the demonstration is, before anything else.
fn announce(model: &mut Model, auto: bool, now: Duration) {
    if let Some(name) = &model.settings.vehicle_name {
        let by_whom = if auto { "it arms and starts itself" } else { "you arm and start it" };
        let text = format!("demonstration: a simulated vehicle in this program flies {name}; {by_whom}");
        model.info(now, text);
    }
}

/// The folder of the log.
fn recorder_folder(recorder: Option<&Recorder>) -> Option<&std::path::Path> {
    recorder.and_then(|recorder| recorder.path().parent())
}

/// Opens the socket for screens: for a station with a real vehicle and for every daemon. A demonstration on a
/// terminal needs none.
async fn serve(
    cli: &Cli,
    model: &mut Model,
    interactive: bool,
    clock: &Clock,
) -> anyhow::Result<Option<Server>> {
    let is_daemon = matches!(cli.command, Some(Command::Daemon));
    if model.settings.demonstration && !is_daemon {
        return Ok(None);
    }
    let first_screen = if interactive { 2 } else { 1 };
    match Server::open(cli.socket.as_deref(), hello(model), first_screen).await {
        Ok(server) => Ok(Some(server)),
        Err(error) if is_daemon => Err(error),
        // It has its own screen or lines, so it can run without the socket.
        Err(error) => {
            model.warn(clock.now(), format!("no other screen can attach: {error:#}"));
            Ok(None)
        }
    }
}

/// Opens the feed for watchers, if one is wanted.
async fn feed(cli: &Cli, server: Option<&Server>) -> anyhow::Result<Option<Watchers>> {
    match (&cli.watchers, server) {
        (Some(address), Some(server)) => Watchers::open(address, server.shared()).await.map(Some),
        (Some(_), None) => {
            anyhow::bail!(
                "--watchers needs a station that serves screens: one with a link, or `ground daemon`"
            )
        }
        (None, _) => Ok(None),
    }
}

fn start_demo(
    options: &DemoOptions,
    listening: Option<&LinkAddress>,
    recorder: Option<Recorder>,
    log_clock: LogClock,
) -> anyhow::Result<Demo> {
    let Some(LinkAddress::UdpIn(address)) = listening else {
        anyhow::bail!("the demonstration listens on UDP, not on {listening:?}");
    };
    Demo::start(options, LinkAddress::UdpOut(address.clone()), recorder, log_clock)
        .context("starting the simulator")
}
