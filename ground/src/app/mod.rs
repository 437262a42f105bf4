//! The run loops and everything that touches the outside: terminal, links, log file, clock,
//! signals, sockets.

mod answers;
pub mod attached;
mod background;
mod backlog;
pub mod clock;
pub mod download;
pub mod files;
mod live;
mod next_log;
pub mod output;
pub mod pace;
mod position;
pub mod programs;
pub mod replaying;
pub mod screen;
pub mod server;
pub mod station;
pub mod stations;
pub mod terminal;
pub mod wire;

use std::collections::BTreeMap;
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::IsTerminal as _;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context as _;
use clap::{ArgMatches, ColorChoice, CommandFactory as _, FromArgMatches as _};
use futures_util::future::OptionFuture;
use protocol::book::BookKey;
use protocol::crew_file::CrewFile;
use protocol::dialect::TdRole;
use protocol::key_file::KeyFile;
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;
use protocol::mission::MissionHash;
use protocol::signing::Signing;
use protocol::transport::LinkAddress;
use sim::recipe::Recipe;
use sim::wire::field::{PAD_FACT, RUN_FACT, field_of, pad_of};
use sim::wire::fly::load_flight;

use crate::attach::OPERATOR_MAX;
use crate::cli::{Cli, Command, ConfigArgs, ConfigCommand, LinkArgs, StationArgs};
use crate::config::{Config, EXAMPLE, usual_path};
use crate::demo::{Demo, DemoOptions, LogClock};
use crate::exit;
use crate::exit::Exit;
use crate::model::{Danger, Degrees, KeyOwner, Model, Role, Seat, Settings, Unfinished, words::printable};
use crate::update::update;
use crate::view::theme::Palette;
use attached::Viewer;
use background::Background;
use clock::{Clock, LogTime};
use files::{LogGuard, LogWatch, newest_place, open_checklist, open_log, other_name, read_unfinished};
use live::Live;
use next_log::NextLog;
use output::{Lines, Output, print};
use position::Locator;
use server::{Server, hello};
use station::{Answers, Station};
use wire::Wire;

const AUTO_TIME_LIMIT: Duration = Duration::from_mins(2);

/// How a station runs, and for how long.
#[derive(Debug, Clone, Copy)]
struct Duty {
    /// It runs on after a flight, and serves screens also in a demonstration.
    is_daemon: bool,
    /// It has a local screen.
    interactive: bool,
    time_limit: Option<Duration>,
    /// It prints one object at its end, and nothing else.
    json: bool,
}

/// Runs the ground station until its end.
///
/// # Errors
/// A socket, a file or the terminal failed, or the mission is wrong.
pub fn run(given: &ArgMatches) -> anyhow::Result<Exit> {
    let cli = Cli::from_arg_matches(given)?;
    let given = given.subcommand().map_or(given, |(_, given)| given);
    let dumb = std::env::var_os("TERM").is_none_or(|term| term.is_empty() || term == "dumb");
    let interactive = std::io::stdout().is_terminal() && !cli.headless && !cli.json && !dumb;
    let load = |args: &ConfigArgs| -> anyhow::Result<Config> {
        let config = Config::load(args.config.as_deref())?;
        let without = (cli.shown.color == ColorChoice::Never).then_some(Palette::None);
        Ok(Config { theme: without.or(config.theme), ..config })
    };
    let printed = |bytes: &[u8]| print(bytes).map(|()| Exit::Yes);
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().context("making the run loop")?;
    match cli.command {
        Some(Command::Config { command: ConfigCommand::Example }) => printed(EXAMPLE.as_bytes()),
        Some(Command::Config { command: ConfigCommand::Check { file } }) => {
            Config::load(file.as_deref())?;
            let file = file.or_else(usual_path).filter(|path| path.exists());
            let none = || "no settings file: the defaults of `ground config example` hold\n".to_owned();
            printed(file.map_or_else(none, |path| format!("{}: valid\n", path.display())).as_bytes())
        }
        Some(Command::Manual(manual)) => manual.print(Cli::command()).context("printing the manual"),
        Some(Command::Status { json }) => runtime.block_on(stations::list(json)),
        Some(Command::Stop { force, socket }) => {
            let config = Config::load(None)?;
            let (socket, who) =
                (socket.socket.or(config.flags.socket.socket), config.flags.link.operator.operator);
            runtime.block_on(stations::stop(socket.as_deref(), force, operator(who.as_deref())))
        }
        Some(Command::Attach(args)) => {
            let config = load(&args.config)?;
            let (socket, who) = (
                args.socket.socket.or(config.flags.socket.socket.clone()),
                args.operator.operator.or(config.flags.link.operator.operator.clone()),
            );
            let viewer = Viewer {
                // Commanding needs keys.
                watch: args.watch || !interactive,
                operator: operator(who.as_deref()),
                talk: config.talk(),
            };
            runtime.block_on(attached::session(socket.as_deref(), &viewer, &config, interactive))
        }
        Some(Command::Download(mut args)) => {
            // Links come from the command line alone.
            args.link = LinkArgs { connect: Vec::new(), ..load(&args.config)?.flags.link };
            args.link.update_from_arg_matches(given)?;
            runtime.block_on(download::run_download(&args))
        }
        Some(Command::Daemon { mut station }) => {
            let config = load(&station.config)?;
            config.fill(&mut station, given, true)?;
            let duty = Duty { is_daemon: true, interactive: false, time_limit: None, json: false };
            runtime.block_on(Box::pin(session(&station, &config, duty)))
        }
        None => {
            let mut station = cli.station;
            let config = load(&station.config)?;
            if let Some(path) = &cli.replay {
                // It shows the vehicle in the log, not the one in the settings.
                let vehicle = station.flags.link.vehicle_sysid.map(|_| station.flags.link.vehicle());
                let replay = replaying::session(path, vehicle, cli.from, &config, interactive);
                return runtime.block_on(replay);
            }
            config.fill(&mut station, given, false)?;
            let duty = Duty { is_daemon: false, interactive, time_limit: cli.timeout_s, json: cli.json };
            runtime.block_on(Box::pin(session(&station, &config, duty)))
        }
    }
}

/// The facts about a run with the text of the mission's field, and the position of its pad.
fn field_facts(recipe: &Recipe) -> BTreeMap<String, String> {
    let Degrees { latitude, longitude } = pad_of(&recipe.mission);
    let pad = format!("{latitude},{longitude}");
    let facts = recipe.field.clone().map(|text| [(RUN_FACT, text), (PAD_FACT, pad)]);
    facts.into_iter().flatten().map(|(fact, text)| (fact.to_owned(), text)).collect()
}

async fn session(args: &StationArgs, config: &Config, duty: Duty) -> anyhow::Result<Exit> {
    let clock = Clock::start();
    let demo_options = match &args.flags.link.connect[..] {
        [] => Some(DemoOptions::load(args)?),
        _ => None,
    };
    // A demonstration flies this mission, so it cannot fly another.
    let named = args.flags.mission.as_deref().filter(|_| demo_options.is_none());
    let mission = named.map(load_flight).transpose()?.map(|flight| flight.recipe);
    let live = args.flags.foxglove.map(|at| Live::open(at, args.flags.log.as_ref())).transpose()?;
    let mut header = match &demo_options {
        // It contains both sides.
        Some(options) => options.flight.log_header("ground", clock.start_unix_ns()),
        None => LogHeader {
            run: mission.as_ref().map(field_facts).unwrap_or_default(),
            writer: "ground".to_owned(),
            start_unix_ns: clock.start_unix_ns(),
            ..LogHeader::default()
        },
    };
    header.live = live.as_ref().map(|live| Arc::clone(&live.context));
    let recorder = open_log(args.flags.log.as_ref(), demo_options.is_none(), &header)?;
    let log_guard = LogGuard::new(recorder);
    let next_log = NextLog::new(args, header, Arc::clone(&log_guard.0));
    let mut station =
        match Box::pin(start(args, config, duty, (clock, demo_options, mission), next_log)).await {
            Ok(station) => station,
            Err(error) => {
                log_guard.discard();
                return Err(error);
            }
        };
    if let Some(live) = &live {
        station.model.info(clock.now(), format!("live values for Foxglove: ws://{}", live.at));
    }
    if duty.is_daemon {
        print(output::greeting(&station.model).as_bytes())?;
    }
    let ran = station.run().await;
    station.close_book("the station ends");
    if let Some(msg) = station.wire.save_timestamps() {
        update(&mut station.model, msg, clock.now());
    }
    let model = Box::pin(station.close()).await;
    let log_path = log_guard.finish();
    ran?;
    let exit = exit::decide(&model.outcome, duty.interactive);
    if duty.json {
        let log = log_path.as_ref().ok().and_then(Option::as_ref);
        print(output::ended(&model, exit, log, clock.now()).as_bytes())?;
    } else {
        output::closing(&model, duty.interactive, log_path.as_ref(), clock.now());
    }
    log_path.context("the log")?;
    Ok(exit)
}

/// Opens everything that a station needs, except its log.
async fn start(
    args: &StationArgs,
    config: &Config,
    duty: Duty,
    (clock, demo_options, mission): (Clock, Option<DemoOptions>, Option<Recipe>),
    mut next_log: NextLog,
) -> anyhow::Result<Station> {
    let Duty { is_daemon, interactive, time_limit, json } = duty;
    let recorder = next_log.guarded().clone();
    let link = &args.flags.link;
    // The demonstration uses any free port, so that it can run beside a real ground station.
    let mut endpoints = link.connect.clone();
    if endpoints.is_empty() {
        endpoints.push(LinkAddress::UdpIn("127.0.0.1:0".to_owned()));
    }
    let KeyRing { key, owner, book_key, roles } = KeyRing::open(link)?;
    next_log.book_key = book_key;
    let start_unix_s = clock.start_unix_ns() / 1_000_000_000;
    let checklist =
        args.flags.checklist.as_deref().map(|path| open_checklist(path, start_unix_s)).transpose()?;
    let recipe = demo_options.as_ref().map(|demo| &demo.flight.recipe);
    let field = recipe.or(mission.as_ref()).and_then(field_of);
    let vehicle_clock = demo_options.as_ref().map(|_| LogClock::new());
    let log_time = vehicle_clock.clone().map_or(LogTime::Run(clock), LogTime::Vehicle);
    let opened =
        Wire::open((link.us(), link.vehicle()), endpoints, key, clock, recorder.clone(), log_time.clone())
            .await;
    let mut wire = stations::explained(opened, &link.connect).await?;
    wire.forward_to(&args.flags.forward)?;
    let demo = demo_options.as_ref().zip(vehicle_clock).map(|(options, vehicle_clock)| {
        Demo::start(options, wire.endpoints().next(), recorder.clone(), vehicle_clock)
    });
    let demo = demo.transpose().context("starting the simulator")?;
    let locator = OptionFuture::from(args.flags.position.clone().map(Locator::open)).await.transpose()?;
    let auto = if is_daemon { args.auto } else { args.starts_by_itself(interactive) };
    let links: Vec<String> = wire.endpoints().map(LinkAddress::to_string).collect();
    let mut model = Model::new(Settings {
        // With several links, each has its own.
        link_capacity_bytes_s: wire.capacity_bytes_s(),
        vehicle_name: demo.as_ref().map(|_| args.mission().to_owned()),
        log_path: recorder.as_ref().map(|recorder| recorder.path().display().to_string()),
        us: link.us(),
        // The standard library's hash keys differ in every process. 0 stands for no session.
        session: (RandomState::new().build_hasher().finish() as u32).max(1),
        vehicle: link.vehicle(),
        role: Role::Station,
        seat: if interactive {
            Seat::new(1, operator(link.operator.operator.as_deref()))
        } else {
            Seat::default()
        },
        key_owner: owner,
        start: args.start.filter(|_| mission.is_some()).map(|start| start.name().to_owned()),
        mission: mission.map(|mission| MissionHash::of(&mission.mission_toml)),
        crew_roles: roles,
        here: config.here,
        field,
        start_unix_s,
        demonstration: demo.is_some(),
        auto,
        // A daemon also keeps running after a flight.
        interactive: interactive || is_daemon,
        talk: config.talk(),
        time_limit: time_limit.or(auto.then_some(AUTO_TIME_LIMIT)),
        ..Settings::on_screen(links.join(" and "))
    });
    let renamed = other_name(args.flags.log.as_ref(), recorder.as_ref().map(Recorder::path));
    announce(&mut model, auto, renamed, clock.now());
    let signatures = checklist.map(|(list, file, notes)| {
        model.checklist = Some(list);
        for text in notes {
            model.warn(clock.now(), text);
        }
        Arc::new(Mutex::new(file))
    });
    restore_unfinished(&mut model, recorder.as_ref(), clock.now());
    let server = serve(args, &mut model, duty, &clock).await?;
    let output = if json { Output::lines(Lines::closed()) } else { Output::open(interactive, config)? };
    let mut station = Station {
        model,
        wire,
        clock,
        log_time,
        recorder,
        background: Background::start("files").context("starting the thread of the files")?,
        log_watch: LogWatch::default(),
        demo,
        locator,
        output,
        socket: args.flags.socket.socket.clone(),
        server,
        screens: Vec::new(),
        alarm_command: config.alarm_command.clone(),
        local_screen: Answers::default(),
        signatures,
        book: None,
        report: None,
        alarm_failure: None,
        not_saved: false,
        signed: 0,
        report_at: Duration::ZERO,
        next_log,
    };
    station.open_book("");
    station.publish_stored();
    Ok(station)
}

/// Reports the demonstration, before anything else, and a log name that differs from the given one.
fn announce(model: &mut Model, auto: bool, renamed: Option<String>, now: Duration) {
    if let Some(name) = &model.settings.vehicle_name {
        let starter = if auto { "it arms and starts itself" } else { "you arm and start it" };
        let text = format!("demonstration: a simulated vehicle in this program flies {name}; {starter}");
        model.info(now, text);
    }
    if let Some(words) = renamed {
        model.warn(now, words);
    }
}

/// Restores the state that an earlier run has stored beside its log.
fn restore_unfinished(model: &mut Model, log: Option<&Recorder>, now: Duration) {
    let (folder, unix_s) = (log.and_then(|log| log.path().parent()), model.settings.start_unix_s);
    model.place = newest_place(folder, unix_s);
    if !model.settings.demonstration {
        let unfinished = read_unfinished(folder).unwrap_or_else(|why| {
            let what = "the unfinished state of the last run cannot be read, so people wait";
            model.error(now, format!("{what}: {why:#}"));
            Some(Unfinished { abort: None, danger: Some(Danger::NotReported) })
        });
        if let Some(unfinished) = unfinished {
            model.take_unfinished(unfinished, now);
        }
    }
    if model.place.is_some() {
        model.info(now, "the last position of a vehicle is stored from before: page Find");
    }
}

/// Opens the socket for screens: for a station with a real vehicle and for every daemon. A
/// demonstration on a terminal needs none.
async fn serve(
    args: &StationArgs,
    model: &mut Model,
    Duty { is_daemon, interactive, .. }: Duty,
    clock: &Clock,
) -> anyhow::Result<Option<Server>> {
    if model.settings.demonstration && !is_daemon {
        return Ok(None);
    }
    let first_screen = if interactive { 2 } else { 1 };
    match Server::open(args.flags.socket.socket.as_deref(), hello(model), first_screen).await {
        Ok(server) => Ok(Some(server)),
        Err(error) if is_daemon => Err(error),
        // It has its own screen or lines, so it can run without the socket.
        Err(error) => {
            model.warn(clock.now(), format!("no other screen can attach: {error:#}"));
            Ok(None)
        }
    }
}

// Finds the name of the person at this screen.

/// The given name, otherwise the user.
pub(super) fn operator(named: Option<&str>) -> String {
    let variable = |name| std::env::var(name).ok().filter(|value| !value.is_empty());
    let words = named.map(str::to_owned).or_else(|| variable("USER")).or_else(|| variable("LOGNAME"));
    let words = words.unwrap_or_else(|| "somebody".to_owned());
    printable(&words, OPERATOR_MAX)
}

// The keys of a station: the one that all share, and that of the operator who sits here.

/// A key file with its timestamps, its signing state, and its owner.
pub(super) struct KeyRing {
    pub(super) key: Option<(KeyFile, Signing)>,
    pub(super) owner: Option<KeyOwner>,
    /// Signs the station's book; `None` without a key.
    pub(super) book_key: Option<BookKey>,
    /// The people of the crew by name, with their roles; empty without a crew.
    pub(super) roles: Vec<(String, TdRole)>,
}

impl KeyRing {
    /// Reads the keys. An operator's frames have timestamps of their own, beside their key.
    ///
    /// # Errors
    /// A file cannot be read, others can read it, or the crew has no member of this name.
    pub(super) fn open(link: &LinkArgs) -> anyhow::Result<Self> {
        let Some(shared) = link.key.as_deref() else {
            anyhow::ensure!(link.crew.is_none(), "--crew needs --key, which vehicle and stations share");
            return Ok(Self { key: None, owner: None, book_key: None, roles: Vec::new() });
        };
        let crew = link.crew.as_deref().map(CrewFile::open).transpose()?;
        let people = crew.iter().flat_map(|crew| &crew.members);
        let roles = people.map(|member| (member.name.clone(), member.role)).collect();
        let member = match (&crew, link.operator.operator.as_deref()) {
            (Some(crew), Some(name)) => Some(crew.member(name)?),
            _ => None,
        };
        let Some((member, (number, path))) = member.and_then(|member| Some((member, member.key.as_ref()?)))
        else {
            let book_key = Some(BookKey::of(&KeyFile::read_key(shared)?));
            return Ok(Self { key: Some(KeyFile::open(shared, "ground")?), owner: None, book_key, roles });
        };
        let (file, signing) =
            KeyFile::open(path, "ground").with_context(|| format!("the timestamps of {}", member.name))?;
        let signing = signing.as_operator(*number, KeyFile::read_key(shared)?);
        let book_key = Some(BookKey::of(&KeyFile::read_key(path)?));
        let owner = KeyOwner { number: *number, name: member.name.clone() };
        Ok(Self { key: Some((file, signing)), owner: Some(owner), book_key, roles })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_from_outside_is_printable() {
        assert_eq!(operator(Some("Anna \u{1b}[2J")).chars().filter(|c| c.is_control()).count(), 0);
    }
}
