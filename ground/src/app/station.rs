//! The run loop of a station: link, log, clock, signals, screen and attached screens around the
//! model.

use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use futures_util::future::OptionFuture;
use protocol::book::{CLOSED, Line};
use protocol::dialect::MavMessage;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::recorder::Recorder;
use protocol::log::v1::OperatorAction;
use tokio::time::{MissedTickBehavior, interval};

use super::background::{Background, Outcome, Target};
use super::clock::{Clock, LogTime, Signals};
use super::files::{LogFiles, LogWatch, SignatureFile, StationBook};
use super::next_log::NextLog;
use super::output::{Lines, Output};
use super::position::Locator;
use super::server::{Server, ServerEvent, hello};
use super::wire::Wire;
use super::{files, programs, screen, stations};
use crate::attach::{ToScreen, ToStation};
use crate::demo::Demo;
use crate::model::{BookLine, ChecklistEntry, LogHealth, Model, Seat, Settings, Silence, role_name};
use crate::update::{Action, Msg, update};

/// How often the end of the closed book is sent to the vehicle, because a frame may be lost.
const BOOK_END_REPEATS: usize = 3;
const TICK: Duration = Duration::from_millis(100);
/// How often link rates are reported; they are means over ten seconds.
const REPORT_EVERY: Duration = Duration::from_secs(1);

/// A station: its model, its links and everything that the run loop keeps beside them.
pub(super) struct Station {
    pub(super) model: Model,
    pub(super) wire: Wire,
    pub(super) clock: Clock,
    pub(super) log_time: LogTime,
    pub(super) recorder: Option<Recorder>,
    pub(super) background: Background,
    pub(super) log_watch: LogWatch,
    pub(super) demo: Option<Demo>,
    /// The receiver of the station's own position.
    pub(super) locator: Option<Locator>,
    pub(super) output: Output,
    /// The socket path that was given, if any.
    pub(super) socket: Option<PathBuf>,
    pub(super) server: Option<Server>,
    /// The attached screens.
    pub(super) screens: Vec<Attached>,
    /// Whether the local screen answers.
    pub(super) local_screen: Answers,
    pub(super) alarm_command: Option<String>,
    /// Why the newest alarm command could not be started, if so.
    pub(super) alarm_failure: Option<Receiver<Option<std::io::Error>>>,
    /// A file for the next run could not be written, which was reported.
    pub(super) not_saved: bool,
    /// The report that is being written: its path, or why there is none.
    pub(super) report: Option<Receiver<Result<String, String>>>,
    /// The record of every action with its operator; `None` without a log.
    pub(super) book: Option<StationBook>,
    /// The file of the checklist's signatures; `None` without a checklist.
    pub(super) signatures: Option<Arc<Mutex<SignatureFile>>>,
    /// Number of signatures of this run.
    pub(super) signed: u64,
    /// When the links are reported next.
    pub(super) report_at: Duration,
    pub(super) next_log: NextLog,
}

/// An attached screen.
#[derive(Debug)]
pub(super) struct Attached {
    pub(super) seat: Seat,
    /// It only watches.
    pub(super) watch: bool,
    answers: Answers,
}

/// Ticks without an answer after which a screen does not count; together they are `UNATTENDED_MAX`.
const SILENT_AFTER: u8 = 8;

/// Whether a screen's terminal answers.
#[derive(Debug, Default)]
pub(super) struct Answers {
    ever: bool,
    /// Ticks without an answer. A station that stood still has counted none meanwhile.
    silence: u8,
    why: Silence,
}

impl Answers {
    fn is_silent(&self) -> bool {
        self.silence >= SILENT_AFTER
    }

    fn tick(&mut self) {
        self.silence = self.silence.saturating_add(1);
    }

    fn note(&mut self, answer: Result<(), Silence>) {
        match answer {
            Ok(()) => *self = Self { ever: true, ..Self::default() },
            Err(Silence::NoAnswer) => {}
            Err(why) => self.why = why,
        }
    }
}

/// The next step of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Next {
    Go,
    LeaveScreen,
    Quit,
}

impl Station {
    /// Runs until something asks to quit.
    ///
    /// # Errors
    /// The terminal failed, and the station does not outlive its screen.
    pub(super) async fn run(&mut self) -> anyhow::Result<()> {
        let mut signals = Signals::listen()?;
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        self.report_crew();
        loop {
            let redraw_at = self.output.redraw_at();
            let (demo, server, locator) = (&mut self.demo, &mut self.server, &mut self.locator);
            let wakes_at = self.model.wakes_at();
            let msgs = tokio::select! {
                // The order matters. Keys come before the clock, because a waiting key may show
                // that Ctrl-X is held. The link comes last, because it can be busy all the time.
                biased;
                signal = signals.next() => vec![Msg::Terminate(signal)],
                Some(event) = OptionFuture::from(server.as_mut().map(Server::next)) => self.on_server_event(event),
                msg = self.output.input() => vec![msg],
                () = self.clock.sleep_until(wakes_at) => vec![Msg::Tick],
                Some(failure) = OptionFuture::from(demo.as_mut().map(Demo::ended)) => {
                    vec![Msg::SimulatorEnded(failure)]
                }
                _ = ticks.tick() => {
                    let now = self.clock.now();
                    self.output.pass(&mut self.model, now);
                    self.count_silence(now);
                    self.report_crew();
                    self.take_outcomes();
                    self.tick_msgs()
                }
                () = self.clock.sleep_until(redraw_at) => Vec::new(),
                Some(msg) = OptionFuture::from(locator.as_mut().map(Locator::next)) => vec![msg],
                received = self.wire.receive() => self.wire.take(received),
            };
            let mut next = Next::Go;
            let woken = self.wire.note_awake();
            let report = if self.is_report_due(&msgs) { self.wire.report() } else { Vec::new() };
            for msg in woken.into_iter().chain(report).chain(msgs) {
                let msg = match msg {
                    Msg::Terminate("SIGHUP" | screen::TERMINAL_LOST) if self.outlives_its_screen() => {
                        self.lose_screen(Lines::closed()).await;
                        Msg::ScreenLost
                    }
                    msg => msg,
                };
                self.output.mark_message(&msg, &self.model);
                next = next.max(self.step(msg));
            }
            if next == Next::LeaveScreen {
                self.lose_screen(Lines::new_events_only(&self.model)).await;
                next = self.step(Msg::ScreenQuit);
            }
            let now = self.clock.now();
            if let Err(error) = self.output.show(&self.model, now, now) {
                if !self.outlives_its_screen() {
                    return Err(error);
                }
                self.lose_screen(Lines::closed()).await;
                next = next.max(self.step(Msg::ScreenLost));
            }
            self.report_crew();
            self.rotate_log();
            if next == Next::Quit {
                return Ok(());
            }
        }
    }

    fn count_silence(&mut self, now: Duration) {
        self.screens.iter_mut().for_each(|screen| screen.answers.tick());
        self.local_screen.tick();
        self.local_screen.note(self.output.answers(now));
    }

    /// Reports who can command, if that has changed.
    fn report_crew(&mut self) {
        let local_screen =
            self.output.screen.is_some().then_some((&self.model.settings.seat, &self.local_screen));
        let attached = self.screens.iter().filter(|screen| !screen.watch);
        let all = local_screen.into_iter().chain(attached.map(|screen| (&screen.seat, &screen.answers)));
        let (mut seats, mut silent) = (Vec::new(), Vec::new());
        for (seat, answers) in all {
            if answers.is_silent() {
                silent.push((seat.clone(), answers.why));
            } else if answers.ever {
                seats.push(seat.clone());
            }
        }
        if seats != self.model.crew.seats() || silent != self.model.crew.silent() {
            self.step(Msg::Crew { seats, silent });
        }
    }

    /// Whether to report the links: periodically on a tick, and at once when a link goes up or
    /// down.
    fn is_report_due(&mut self, msgs: &[Msg]) -> bool {
        let now = self.clock.now();
        let due = msgs.iter().any(|msg| match msg {
            Msg::Tick => now >= self.report_at,
            Msg::LinkUp(_) | Msg::LinkDown(_) | Msg::LinkWarning(_) | Msg::StoodStill(_) => true,
            _ => false,
        });
        if due {
            self.report_at = now + REPORT_EVERY;
        }
        due
    }

    /// Whether the station keeps running without its screen: yes with a real vehicle, no for a
    /// demonstration on a terminal.
    fn outlives_its_screen(&self) -> bool {
        self.demo.is_none() || (self.server.is_some() && self.output.screen.is_none())
    }

    /// Continues without the full screen, and serves attached screens from now on.
    async fn lose_screen(&mut self, lines: Lines) {
        self.output = Output::lines(lines);
        if self.server.is_none() {
            // If another station uses the path, this one continues without a socket.
            self.server = Server::open(self.socket.as_deref(), hello(&self.model), 2).await.ok();
            self.publish_checklist();
        }
    }

    /// Handles an event from the socket.
    fn on_server_event(&mut self, event: ServerEvent) -> Vec<Msg> {
        match event {
            ServerEvent::ScreenJoined { seat, watch } => {
                self.screens.push(Attached { seat, watch, answers: Answers::default() });
            }
            ServerEvent::ScreenLeft(number) => self.screens.retain(|screen| screen.seat.screen != number),
            ServerEvent::FromScreen(by, ToStation::Request(request)) => {
                return vec![Msg::Requested { request, by }];
            }
            ServerEvent::FromScreen(by, ToStation::Here(answer)) => {
                self.screens.iter_mut().filter(|one| one.seat == by).for_each(|one| one.answers.note(answer));
            }
            ServerEvent::FromScreen(by, ToStation::Key(name)) => {
                self.record_operator("key", &by.operator, format!("{name}{}", by.in_brackets()));
            }
            ServerEvent::Question(ToStation::Stop { force, operator }, answer) => {
                let reply = stations::stopping(&self.model, force, self.clock.now());
                let stops = matches!(reply, ToScreen::Stopping { stops: true, .. });
                let ending = if stops { "ends" } else { "refused" };
                self.record_operator("stop", &operator, format!("requested by {operator}: {ending}"));
                // The querying process may have ended; the station ends in any case.
                let _ = answer.send(reply);
                if stops {
                    return vec![Msg::Terminate("ground stop")];
                }
            }
            ServerEvent::Question(_, answer) => {
                let _ = answer.send(ToScreen::Status(stations::of(&self.model, &self.screens)));
            }
            ServerEvent::FromScreen(..) => {}
        }
        Vec::new()
    }

    fn record_operator(&mut self, kind: &str, who: &str, detail: String) {
        let action = OperatorAction { time_s: 0.0, kind: kind.to_owned(), detail: detail.clone() };
        self.record(Record::OperatorAction(action));
        self.enter(&BookLine { kind: kind.to_owned(), who: who.to_owned(), text: detail });
    }

    fn run_alarm_command(&mut self, words: &str) {
        let Some(command) = &self.alarm_command else { return };
        match programs::run_alarm_command(command, words) {
            Ok(failure) => self.alarm_failure = Some(failure),
            Err(error) => self.give_up_alarm_command(&error),
        }
    }

    /// Reports the failure once, because it would happen again.
    fn give_up_alarm_command(&mut self, error: &std::io::Error) {
        self.alarm_command = None;
        let message = format!("the alarm command cannot be started: {error}");
        self.record(Record::Event(Event { level: EventLevel::Warning, name: "ground".to_owned(), message }));
    }

    /// Handles the outcomes of the jobs beside the loop.
    pub(super) fn take_outcomes(&mut self) {
        if let Some(error) = self.alarm_failure.as_ref().and_then(|failure| failure.try_recv().ok()?) {
            self.give_up_alarm_command(&error);
        }
        let now = self.clock.now();
        while let Some(outcome) = self.background.outcome() {
            match outcome {
                Outcome::Written => {}
                Outcome::NotWritten(target, error) => self.report_not_written(target, &error),
                Outcome::LogFiles(found) => {
                    self.recorder.iter().for_each(|present| self.log_watch.take(&found, present, now));
                }
                Outcome::NextLog(next) => self.change_log(next),
            }
        }
        if let Some(log) = self.recorder.clone().filter(|_| self.log_watch.begins()) {
            self.background.queue(Target::LogFiles, move || Outcome::LogFiles(LogFiles::of(&log)));
        }
    }

    fn report_not_written(&mut self, target: Target, error: &anyhow::Error) {
        let now = self.clock.now();
        if let Target::Signature(_) = target {
            self.model.warn(now, format!("the checklist is not stored for a restart: {error:#}"));
        } else if !std::mem::replace(&mut self.not_saved, true) {
            self.model.warn(now, format!("not stored for a restart: {error:#}"));
        }
    }

    fn tick_msgs(&mut self) -> Vec<Msg> {
        let health = self.recorder.as_ref().map_or_else(LogHealth::default, |recorder| LogHealth {
            dropped: recorder.dropped(),
            failed: !recorder.is_intact(),
            removed: self.log_watch.removed,
            space: self.log_watch.space,
        });
        let health = (health != self.model.log).then_some(Msg::Log(health));
        let book = self.sign_book(false);
        let written = self.report.as_ref().and_then(|report| report.try_recv().ok()).map(Msg::Report);
        self.report.take_if(|_| written.is_some());
        health.into_iter().chain(book).chain(written).chain([Msg::Tick]).collect()
    }

    /// Applies one message to the model and executes the resulting actions.
    pub(super) fn step(&mut self, msg: Msg) -> Next {
        let now = self.clock.now();
        let mut next = Next::Go;
        self.publish(&msg, now);
        for action in update(&mut self.model, msg, now) {
            match action {
                Action::Send(message) => {
                    let sent = self.wire.send(&message, boot_of(&self.model));
                    self.publish(&sent, now);
                    // Only updates counters; it returns no actions.
                    update(&mut self.model, sent, now);
                }
                Action::Record(record) => {
                    if matches!(record, Record::Event(_)) {
                        self.output.mark_changed();
                    }
                    self.record(record);
                }
                Action::StorePlace(place) => {
                    let target = Target::Position(place.boot);
                    self.save(target, move |folder| files::write_place(folder, &place));
                }
                Action::StoreUnfinished(unfinished) => {
                    let write = move |folder: &Path| files::write_unfinished(folder, &unfinished);
                    self.save(Target::Unfinished, write);
                }
                Action::Enter(line) => self.enter(&line),
                Action::StoreChecklist(entry) => self.store_checklist(&entry),
                Action::RefuseSignature(why) => self.publish(&Msg::SignRefused(why), now),
                Action::SyncLog => {
                    if let Some(recorder) = &self.recorder {
                        recorder.sync_soon();
                    }
                }
                Action::Redraw | Action::NextTheme | Action::Bell | Action::CallOut(_) => {
                    self.output.act(&action, &mut self.model, now);
                }
                Action::Alarm(words) => self.run_alarm_command(&words),
                Action::WriteReport => self.write_report(now),
                Action::MovePin(out) => self.demo.iter().for_each(|demo| demo.move_pin(out)),
                Action::Request(request) => {
                    self.publish(&Msg::Requested { request, by: self.model.settings.seat.clone() }, now);
                }
                Action::LeaveScreen => next = next.max(Next::LeaveScreen),
                Action::Quit => next = Next::Quit,
            }
        }
        next
    }

    fn write_report(&mut self, now: Duration) {
        let Some(log) = self.recorder.as_ref().map(|recorder| recorder.path().to_owned()) else { return };
        match programs::in_a_thread("report", move || programs::write_report(&log)) {
            Ok(writing) => self.report = Some(writing),
            Err(why) => self.model.warn(now, format!("no report: {why}")),
        }
    }

    /// Has a file written into the folder of the log.
    fn save(&mut self, target: Target, write: impl FnOnce(&Path) -> anyhow::Result<()> + Send + 'static) {
        let Some(folder) = self.recorder.as_ref().and_then(|log| log.path().parent()) else { return };
        let folder = folder.to_owned();
        self.queue(target, move || write(&folder));
    }

    /// Queues a file for the disk.
    fn queue(&mut self, target: Target, write: impl FnOnce() -> anyhow::Result<()> + Send + 'static) {
        let write = move || match write() {
            Ok(()) => Outcome::Written,
            Err(error) => Outcome::NotWritten(target, error),
        };
        if !self.background.queue(target, write) {
            self.report_not_written(target, &anyhow::anyhow!("the disk is too slow"));
        }
    }

    /// Sends every screen the state stored before this run: the checklist, the last position, the
    /// unfinished state.
    pub(super) fn publish_stored(&mut self) {
        let now = self.clock.now();
        if let Some(unfinished) = self.model.stored_unfinished.clone() {
            self.publish(&Msg::Unfinished(Box::new(unfinished)), now);
        }
        self.publish_checklist();
        if let Some(place) = self.model.place {
            self.publish(&Msg::Place(Box::new(place)), now);
        }
    }

    /// Opens the book of this log, if there is one. `after` names the log before it.
    pub(super) fn open_book(&mut self, after: &str) {
        if self.recorder.is_none() {
            return;
        }
        let Settings { us, vehicle, key_owner, mission, .. } = &self.model.settings;
        let owner = key_owner.as_ref().map_or_else(
            || "no operator's key".to_owned(),
            |owner| format!("key {} of {}", owner.number, owner.name),
        );
        let mission = mission.map_or_else(|| "any mission".to_owned(), |hash| format!("mission {hash}"));
        let about = format!(
            "station {}/{}, vehicle system {}, {owner}, {mission}{after}",
            us.system_id, us.component_id, vehicle.system_id
        );
        let (book, first) = StationBook::open(self.next_log.book_key.clone(), &about, self.clock.unix_ns());
        self.book = Some(book);
        self.record(first);
        for (who, role) in self.model.settings.crew_roles.clone() {
            self.enter(&BookLine { kind: "crew".to_owned(), who, text: role_name(role) });
        }
    }

    fn enter(&mut self, line: &BookLine) {
        let BookLine { kind, who, text } = line;
        let line = Line { unix_ns: self.clock.unix_ns(), kind, who, text };
        if let Some(record) = self.book.as_mut().map(|book| book.enter(&line)) {
            self.record(record);
        }
    }

    /// Signs the end of the book and records it, if it is due, or at once.
    fn sign_book(&mut self, at_once: bool) -> Option<Msg> {
        let now = self.clock.now();
        let book = self.book.as_mut()?;
        let is_signed = book.key.is_some();
        let (head, record) = book.sign(now, at_once)?;
        self.record(record);
        Some(Msg::Book { head, is_signed })
    }

    /// Closes the book. Its end is sent to the vehicle without waiting for an answer.
    pub(super) fn close_book(&mut self, why: &str) {
        let (kind, text) = (CLOSED.to_owned(), why.to_owned());
        self.enter(&BookLine { kind, who: String::new(), text });
        let Some(msg) = self.sign_book(true) else { return };
        self.book = None;
        self.step(msg);
        let Some(head) = self.model.book.head else { return };
        let head = MavMessage::TD_BOOK_HEAD(head.message(self.model.settings.vehicle));
        for _ in 0..BOOK_END_REPEATS {
            self.wire.send(&head, boot_of(&self.model));
        }
    }

    /// Writes a record into the log, with the present time inside it too.
    fn record(&self, mut record: Record) {
        let Some(recorder) = &self.recorder else { return };
        let at_ns = self.log_time.now_ns();
        let at_s = at_ns as f64 * 1e-9;
        match &mut record {
            Record::Telemetry(telemetry) => telemetry.time_s = at_s,
            Record::OperatorAction(action) => action.time_s = at_s,
            _ => {}
        }
        recorder.try_record(record, at_ns);
    }

    /// Sends a message to every screen.
    fn publish(&mut self, msg: &Msg, now: Duration) {
        if let Some(server) = &mut self.server {
            server.publish(msg, now);
        }
    }

    /// Stores a change of the checklist, and shows it on every screen.
    fn store_checklist(&mut self, entry: &ChecklistEntry) {
        if let Some(file) = self.signatures.clone() {
            let entry = entry.clone();
            self.signed += 1;
            self.queue(Target::Signature(self.signed), move || {
                file.lock().unwrap_or_else(PoisonError::into_inner).add(&entry)
            });
        }
        self.publish_checklist();
    }

    /// Sends every screen the checklist.
    fn publish_checklist(&mut self) {
        if let Some(list) = self.model.checklist.clone() {
            self.publish(&Msg::Checklist(Box::new(list)), self.clock.now());
        }
    }

    /// Restores the terminal first, because the rest may take a while. Returns the last state.
    pub(super) async fn close(self) -> Model {
        let Self { mut model, background, demo, next_log, mut output, clock, .. } = self;
        // Lets the socket send its last answers.
        tokio::task::yield_now().await;
        let had_screen = output.screen.take().is_some();
        for outcome in background.finish() {
            match outcome {
                Outcome::NotWritten(_, error) => {
                    model.warn(clock.now(), format!("not stored for the next run: {error:#}"));
                }
                // Its files are empty.
                Outcome::NextLog(Ok(Some(log))) => _ = log.discard(),
                Outcome::Written | Outcome::LogFiles(_) | Outcome::NextLog(_) => {}
            }
        }
        if !had_screen {
            output.lines.show(&model);
        }
        if let Some(demo) = demo {
            demo.stop().await;
        }
        // The end of the log before is written, too.
        let _ = next_log.ending.map(|ending| ending.recv());
        model
    }
}

/// The boot that the screens show; 0 if the vehicle has reported none.
fn boot_of(model: &Model) -> u32 {
    model.vehicle.boot.number().unwrap_or(0)
}
