//! The run loop of a station: link, log, clock, signals and whoever looks, around a pure model.

use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Duration;

use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::recorder::Recorder;
use protocol::log::v1::OperatorAction;
use tokio::time::{MissedTickBehavior, interval};

use super::clock::{Clock, LogTime};
use super::lines::Lines;
use super::output::Output;
use super::server::{Server, hello};
use super::signals::Signals;
use super::wire::Wire;
use super::{alarm_command, screen};
use crate::attach::codec::Asked;
use crate::demo::Demo;
use crate::model::{LogHealth, Model};
use crate::update::{Action, Msg, update};

const TICK: Duration = Duration::from_millis(100);
/// Rates and loss are taken over ten seconds: more often says nothing new.
const REPORT_EVERY: Duration = Duration::from_secs(1);

/// What the run loop holds besides model and link.
pub(super) struct Station {
    pub(super) clock: Clock,
    pub(super) log_time: LogTime,
    pub(super) recorder: Option<Recorder>,
    pub(super) demo: Option<Demo>,
    pub(super) output: Output,
    pub(super) socket: PathBuf,
    pub(super) server: Option<Server>,
    pub(super) alarm_command: Option<String>,
    /// What keeps the input quiet where a terminal was.
    pub(super) quiet_input: Option<OwnedFd>,
    /// When the links' figures are told next.
    pub(super) report_at: Duration,
}

impl Station {
    /// Runs until something asks to quit.
    ///
    /// # Errors
    /// The terminal failed, and nothing but it was to be run for.
    pub(super) async fn run(&mut self, model: &mut Model, wire: &mut Wire) -> anyhow::Result<()> {
        let mut signals = Signals::listen()?;
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        loop {
            let redraw_at = self.output.redraw_at();
            let (demo, server) = (&mut self.demo, &mut self.server);
            let wakes_at = model.wakes_at();
            let msgs = tokio::select! {
                // In this order. Keys before the clock: one that waits may show that Ctrl-X is held. The
                // link last: it alone can be busy all the time, and it is read until nothing waits.
                biased;
                signal = signals.next() => vec![Msg::Terminate(signal)],
                asked = server_asks(server) => self.asked(asked),
                msg = self.output.input() => vec![msg],
                () = self.clock.sleep_until(wakes_at) => vec![Msg::Tick],
                failure = demo_ended(demo) => vec![Msg::SimulatorEnded(failure)],
                _ = ticks.tick() => self.tick_msgs(model),
                () = self.clock.sleep_until(redraw_at) => Vec::new(),
                received = wire.receive() => wire.take(received),
            };
            let mut quit = false;
            let report = self.is_report_due(&msgs).then(|| wire.report());
            for msg in report.into_iter().chain(msgs) {
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
            let now = self.clock.now();
            if let Err(gone) = self.output.show(model, now, now) {
                if !self.outlives_its_screen() {
                    return Err(gone);
                }
                self.lose_screen(model).await;
                quit |= self.step(model, wire, Msg::ScreenGone);
            }
            if quit {
                return Ok(());
            }
        }
    }

    /// The links' figures are told with the clock, and at once when a link comes or goes.
    fn is_report_due(&mut self, msgs: &[Msg]) -> bool {
        let now = self.clock.now();
        let due = msgs.iter().any(|msg| match msg {
            Msg::Tick => now >= self.report_at,
            Msg::LinkUp(_) | Msg::LinkDown(_) | Msg::OneLinkDown(_) => true,
            _ => false,
        });
        if due {
            self.report_at = now + REPORT_EVERY;
        }
        due
    }

    /// A real vehicle's link and log go on without a screen; a demonstration is only looked at.
    fn outlives_its_screen(&self) -> bool {
        self.demo.is_none() || (self.server.is_some() && matches!(self.output, Output::Lines(_)))
    }

    /// Goes on without the terminal, and serves screens from now on.
    async fn lose_screen(&mut self, model: &Model) {
        self.output = Output::Lines(Lines::closed());
        if self.quiet_input.is_none() {
            self.quiet_input = screen::quiet_input();
        }
        if self.server.is_none() {
            // Another station may serve there; then this one goes on alone.
            self.server = Server::open(&self.socket, hello(model)).await.ok();
        }
    }

    /// What a screen elsewhere asks for.
    fn asked(&self, asked: Asked) -> Vec<Msg> {
        match asked {
            Asked::Command(kind) => vec![Msg::Requested(kind)],
            Asked::Acknowledge(kind) => vec![Msg::Acknowledged(kind)],
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
    pub(super) async fn close(self, model: &Model) {
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
