//! The run loop: everything that touches the world, around a pure model.

pub mod alarm_command;
pub mod attached;
pub mod clock;
pub mod lines;
pub mod log;
pub mod print;
pub mod replaying;
pub mod screen;
pub mod server;
pub mod signals;
pub mod wire;

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context as _;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::recorder::Recorder;
use protocol::log::v1::OperatorAction;
use protocol::log::writer::LogHeader;
use protocol::transport::Endpoint;
use tokio::time::{MissedTickBehavior, interval};

use crate::attach::codec::{Asked, Hello, VERSION};
use crate::attach::place;
use crate::cli::{Cli, Command, LogChoice, Seconds};
use crate::config::Config;
use crate::demo::{Demo, DemoOptions, LogClock};
use crate::exit::{self, Exit};
use crate::model::{LogHealth, Model, Role, Settings};
use crate::update::{Action, Msg, update};
use clock::{Clock, LogTime};
use lines::Lines;
use log::LogGuard;
use screen::Screen;
use server::Server;
use signals::Signals;
use wire::Wire;

const TICK: Duration = Duration::from_millis(100);
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
    let config = Config::load(cli.config.as_deref())?;
    let mut cli = cli.clone();
    config.fill(&mut cli);
    let (cli, config) = (&cli, &config);
    let dumb = std::env::var_os("TERM").is_none_or(|term| term.is_empty() || term == "dumb");
    let interactive = std::io::stdout().is_terminal() && !cli.headless && !dumb;
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().context("making the run loop")?;
    runtime.block_on(async {
        match (&cli.command, &cli.replay) {
            (Some(Command::Attach { watch }), _) => {
                attached::session(&cli.socket_path(), *watch, config, interactive).await
            }
            (Some(Command::Daemon), _) => session(cli, config, false).await,
            (_, Some(path)) => replaying::session(cli, path, config, interactive).await,
            (_, None) if interactive && !cli.demo && station_runs(cli).await => {
                attached::session(&cli.socket_path(), false, config, interactive).await
            }
            (_, None) => session(cli, config, interactive).await,
        }
    })
}

/// A station of this user runs on this machine already.
async fn station_runs(cli: &Cli) -> bool {
    place::connect(&cli.socket_path()).await.is_ok()
}

async fn session(cli: &Cli, config: &Config, interactive: bool) -> anyhow::Result<Exit> {
    let clock = Clock::start();
    let demo_options = match cli.connect {
        None => Some(DemoOptions::load(&cli.profile, cli.seed, cli.speed)?),
        Some(_) => None,
    };
    let header = match &demo_options {
        Some(options) => options.log_header(clock.start_unix_ns()),
        None => LogHeader {
            writer: "ground".to_owned(),
            start_unix_ns: clock.start_unix_ns(),
            ..LogHeader::default()
        },
    };
    // The demonstration takes any free port, so that it runs beside a real ground station.
    let endpoint = cli.connect.clone().unwrap_or_else(|| Endpoint::UdpIn("127.0.0.1:0".to_owned()));
    let tlog = cli.tlog.as_ref();
    let tlog = if tlog.is_none() && demo_options.is_some() { Some(&LogChoice::None) } else { tlog };
    let recorder = log::open(cli.log.as_ref(), tlog, &header)?;
    let log_guard = LogGuard::new(recorder.clone());
    let vehicle_clock = demo_options.as_ref().map(|_| LogClock::new());
    let log_time = vehicle_clock.clone().map_or(LogTime::Run(clock), LogTime::Vehicle);
    let mut wire = Wire::open(endpoint, recorder.clone(), log_time.clone()).await?;
    let demo = match (&demo_options, vehicle_clock) {
        (Some(options), Some(vehicle_clock)) => {
            Some(start_demo(options, wire.endpoint(), recorder.clone(), vehicle_clock)?)
        }
        _ => None,
    };
    let is_daemon = matches!(cli.command, Some(Command::Daemon));
    let auto = if is_daemon { cli.auto } else { cli.starts_by_itself(interactive) };
    let mut model = Model::new(Settings {
        link_name: wire.endpoint().to_string(),
        link_capacity_bytes_s: wire.endpoint().capacity_bytes_s(),
        log_path: recorder.as_ref().map(|recorder| recorder.path().display().to_string()),
        tlog_path: recorder.as_ref().and_then(Recorder::tlog_path).map(|path| path.display().to_string()),
        role: Role::Station,
        auto,
        // A daemon, too, goes on after a flight.
        interactive: interactive || is_daemon,
        time_limit: cli.timeout_s.map(|Seconds(limit)| limit).or(auto.then_some(AUTO_TIME_LIMIT)),
    });
    let output = if interactive {
        let screen = Screen::open(config)?;
        model.repeats_told = screen.tells_repeats();
        Output::Screen(screen)
    } else {
        Output::Lines(Lines::new())
    };
    let socket = cli.socket_path();
    let server = match is_daemon {
        true => Some(Server::open(&socket, hello(&model)).await?),
        // Other screens may watch a real vehicle's station; where one is served already, they watch that.
        false if interactive && demo.is_none() => Server::open(&socket, hello(&model)).await.ok(),
        false => None,
    };
    let alarm_command = config.alarm_command.clone();
    let mut station = Station { clock, log_time, recorder, demo, output, socket, server, alarm_command };
    let ran = station.run(&mut model, &mut wire).await;
    station.close(&model).await;
    let log_path = log_guard.finish();
    ran?;
    lines::closing(&model, interactive, log_path.as_ref());
    log_path.context("the log")?;
    Ok(exit::decide(&model.outcome, interactive))
}

fn start_demo(
    options: &DemoOptions,
    listening: &Endpoint,
    recorder: Option<Recorder>,
    log_clock: LogClock,
) -> anyhow::Result<Demo> {
    let Endpoint::UdpIn(address) = listening else {
        anyhow::bail!("the demonstration listens on UDP, not on {listening}");
    };
    Demo::start(options, Endpoint::UdpOut(address.clone()), recorder, log_clock)
        .context("starting the simulator")
}

enum Output {
    Screen(Screen),
    Lines(Lines),
}

struct Station {
    clock: Clock,
    log_time: LogTime,
    recorder: Option<Recorder>,
    demo: Option<Demo>,
    output: Output,
    socket: PathBuf,
    server: Option<Server>,
    alarm_command: Option<String>,
}

impl Station {
    async fn run(&mut self, model: &mut Model, wire: &mut Wire) -> anyhow::Result<()> {
        let mut signals = Signals::listen()?;
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        loop {
            let redraw_at = self.output.redraw_at();
            let (demo, server) = (&mut self.demo, &mut self.server);
            let chord_at = model.abort_chord.acts_at();
            let msgs = tokio::select! {
                // In this order. Keys before the clock: one that waits may show that Ctrl-X is held. The
                // link last: it alone can be busy all the time, and it is read until nothing waits.
                biased;
                signal = signals.next() => vec![Msg::Terminate(signal)],
                asked = server_asks(server) => self.asked(asked),
                msg = self.output.input() => vec![msg],
                () = self.clock.sleep_until(chord_at) => vec![Msg::Tick],
                failure = demo_ended(demo) => vec![Msg::SimulatorEnded(failure)],
                _ = ticks.tick() => self.tick_msgs(model),
                () = self.clock.sleep_until(redraw_at) => Vec::new(),
                received = wire.receive() => wire.take(received),
            };
            let mut quit = false;
            for msg in msgs {
                let msg = match msg {
                    Msg::Terminate("SIGHUP" | screen::GONE) if self.outlives_its_screen() => {
                        self.lose_screen(model).await;
                        Msg::ScreenGone
                    }
                    msg => msg,
                };
                self.output.mark_message(&msg, model);
                quit |= self.step(model, wire, msg);
            }
            self.output.show(model, self.clock.now())?;
            if quit {
                return Ok(());
            }
        }
    }

    /// A real vehicle's link and log go on without a screen; a demonstration is only looked at.
    fn outlives_its_screen(&self) -> bool {
        self.demo.is_none() || (self.server.is_some() && matches!(self.output, Output::Lines(_)))
    }

    /// Goes on without the terminal, and serves screens from now on.
    async fn lose_screen(&mut self, model: &Model) {
        self.output = Output::Lines(Lines::closed());
        if self.server.is_none() {
            // Another station may serve there; then this one goes on alone.
            self.server = Server::open(&self.socket, hello(model)).await.ok();
        }
    }

    /// What a screen elsewhere asks for.
    fn asked(&self, asked: Asked) -> Vec<Msg> {
        match asked {
            Asked::Command(kind) => vec![Msg::Requested(kind)],
            Asked::Acknowledge => vec![Msg::Acknowledged],
            Asked::Parameters => vec![Msg::ParametersWanted],
            Asked::Hello { .. } => Vec::new(),
            Asked::Key(name) => {
                if let Some(recorder) = &self.recorder {
                    let at_ns = self.log_time.now_ns();
                    let action = OperatorAction {
                        time_s: 0.0,
                        kind: "key".to_owned(),
                        detail: format!("{name} (attached screen)"),
                    };
                    recorder.try_record(timed(Record::OperatorAction(action), at_ns), at_ns);
                }
                Vec::new()
            }
        }
    }

    fn tell_alarm(&mut self, words: &str) {
        let Some(command) = &self.alarm_command else { return };
        if let Err(error) = alarm_command::run(command, words) {
            // Said once: a command that cannot be started now cannot be later.
            let text = format!("the alarm command cannot be started: {error}");
            self.alarm_command = None;
            if let Some(recorder) = &self.recorder {
                let event = Event { level: EventLevel::Warning, name: "ground".to_owned(), message: text };
                recorder.try_record(Record::Event(event), self.log_time.now_ns());
            }
        }
    }

    fn tick_msgs(&self, model: &Model) -> Vec<Msg> {
        let health = self.recorder.as_ref().map_or_else(LogHealth::default, |recorder| LogHealth {
            dropped: recorder.dropped(),
            failed: !recorder.is_running(),
        });
        if health == model.log { vec![Msg::Tick] } else { vec![Msg::Log(health), Msg::Tick] }
    }

    /// One message through the model, and what it wants done. Returns whether to quit.
    fn step(&mut self, model: &mut Model, wire: &mut Wire, msg: Msg) -> bool {
        let now = self.clock.now();
        let mut quit = false;
        if let Some(server) = &mut self.server {
            server.publish(&msg, now);
        }
        for action in update(model, msg, now) {
            match action {
                Action::Send(message) => {
                    let sent = wire.send(&message);
                    if let Some(server) = &mut self.server {
                        server.publish(&sent, now);
                    }
                    // Only counts: it wants nothing done.
                    update(model, sent, now);
                }
                Action::Record(record) => {
                    if matches!(record, Record::Event(_)) {
                        self.output.mark_changed();
                    }
                    if let Some(recorder) = &self.recorder {
                        let at_ns = self.log_time.now_ns();
                        recorder.try_record(timed(record, at_ns), at_ns);
                    }
                }
                Action::SyncLog => {
                    if let Some(recorder) = &self.recorder {
                        recorder.sync_soon();
                    }
                }
                Action::Redraw => self.output.clear(),
                Action::Bell => self.output.bell(),
                Action::Alarm(words) => self.tell_alarm(&words),
                // A station asks nobody.
                Action::Request(_) => {}
                Action::Quit => quit = true,
            }
        }
        quit
    }

    /// The terminal first: whatever comes after may take a while.
    async fn close(self, model: &Model) {
        match self.output {
            Output::Screen(screen) => drop(screen),
            Output::Lines(mut lines) => lines.show(model),
        }
        if let Some(demo) = self.demo {
            demo.stop().await;
        }
    }
}

/// What a record itself says about its time agrees with its stamp.
fn timed(mut record: Record, at_ns: u64) -> Record {
    let at_s = at_ns as f64 * 1e-9;
    match &mut record {
        Record::Telemetry(telemetry) => telemetry.time_s = at_s,
        Record::OperatorAction(action) => action.time_s = at_s,
        _ => {}
    }
    record
}

fn hello(model: &Model) -> Hello {
    let settings = &model.settings;
    Hello {
        version: VERSION,
        auto: settings.auto,
        link_capacity_bytes_s: settings.link_capacity_bytes_s.unwrap_or(0),
        link_name: settings.link_name.clone(),
        log_path: settings.log_path.clone().unwrap_or_default(),
        tlog_path: settings.tlog_path.clone().unwrap_or_default(),
    }
}

async fn server_asks(server: &mut Option<Server>) -> Asked {
    match server {
        Some(server) => server.next().await,
        None => std::future::pending().await,
    }
}

async fn demo_ended(demo: &mut Option<Demo>) -> Option<String> {
    match demo {
        Some(demo) => demo.ended().await,
        None => std::future::pending().await,
    }
}

impl Output {
    fn redraw_at(&self) -> Option<Duration> {
        match self {
            Self::Screen(screen) => Some(screen.redraw_at()),
            Self::Lines(_) => None,
        }
    }

    /// What the person at the terminal does; never, without one.
    async fn input(&mut self) -> Msg {
        match self {
            Self::Screen(screen) => screen.input().await,
            Self::Lines(_) => std::future::pending().await,
        }
    }

    fn mark_message(&mut self, msg: &Msg, model: &Model) {
        if let Self::Screen(screen) = self {
            screen.mark_message(msg, model);
        }
    }

    fn mark_changed(&mut self) {
        if let Self::Screen(screen) = self {
            screen.mark_changed();
        }
    }

    fn bell(&self) {
        if let Self::Screen(screen) = self {
            screen.bell();
        }
    }

    fn clear(&mut self) {
        if let Self::Screen(screen) = self {
            screen.clear();
        }
    }

    fn show(&mut self, model: &Model, now: Duration) -> anyhow::Result<()> {
        match self {
            Self::Screen(screen) => screen.show(model, now).context("drawing on the terminal"),
            Self::Lines(lines) => {
                lines.show(model);
                Ok(())
            }
        }
    }
}
