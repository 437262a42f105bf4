//! The output of a run: a full screen or lines, and the closing lines.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Context as _;
use protocol::background::Background;
use protocol::log::record::EventLevel;
use protocol::log::recorder::RecorderError;
use protocol::program::{Exit, is_quiet};
use serde_json::json;

use super::screen::Screen;
use crate::config::Config;
use crate::model::{Ending, Event, FlightSoFar, Model, Silence, Speaker, Verdict};
use crate::update::{Action, Msg};
use crate::view::headline;
use crate::view::panels::limit_rows;
use crate::view::widgets::fixed;

/// The output of a run: a full screen, or lines without one.
pub(super) struct Output {
    pub(super) screen: Option<Box<Screen>>,
    pub(super) lines: Lines,
}

impl Output {
    /// Opens a full screen if a person sits at the terminal, otherwise lines.
    ///
    /// # Errors
    /// The terminal cannot be prepared.
    pub(super) fn open(interactive: bool, config: &Config) -> anyhow::Result<Self> {
        let screen = interactive.then(|| Screen::open(config).map(Box::new)).transpose()?;
        Ok(Self { screen, ..Self::lines(Lines::default()) })
    }

    /// Lines without a screen.
    pub(super) fn lines(lines: Lines) -> Self {
        Self { screen: None, lines }
    }

    pub(super) fn redraw_at(&self) -> Option<Duration> {
        self.screen.as_ref().map(|screen| screen.pace.redraw_at())
    }

    /// The next input of the person at the terminal; waits for ever without one.
    pub(super) async fn input(&mut self) -> Msg {
        match &mut self.screen {
            Some(screen) => screen.input().await,
            None => std::future::pending().await,
        }
    }

    /// Whether a person can see the screen; see [`Screen::answers`].
    pub(super) fn answers(&mut self, now: Duration) -> Result<(), Silence> {
        self.screen.as_mut().map_or(Err(Silence::NoAnswer), |screen| screen.answers(now))
    }

    pub(super) fn mark_message(&mut self, msg: &Msg, model: &Model) {
        if let Some(screen) = &mut self.screen {
            screen.pace.mark_message(msg, model);
        }
    }

    pub(super) fn mark_changed(&mut self) {
        if let Some(screen) = &mut self.screen {
            screen.pace.mark_changed();
        }
    }

    /// Executes an action of a screen.
    pub(super) fn act(&mut self, action: &Action, model: &mut Model, now: Duration) {
        let Some(screen) = &mut self.screen else { return };
        match action {
            Action::Redraw => screen.clear(),
            Action::NextTheme => {
                screen.theme.palette = screen.theme.palette.next();
                screen.pace.mark_changed();
            }
            Action::Bell => screen.bell(),
            Action::CallOut(text) if screen.call_out(text) => {
                model.warn(now, "the voice command has ended; nothing is called out any more");
            }
            _ => {}
        }
    }

    /// Lets time pass for the model's view of the terminal.
    pub(super) fn pass(&mut self, model: &mut Model, now: Duration) {
        model.repeats_reported = self.screen.as_mut().is_some_and(|screen| screen.reports_repeats());
        model.screen_late = self.screen.as_ref().map_or(Duration::ZERO, |screen| screen.pace.late(now));
    }

    /// Shows the present state; `model_now` is the same moment on the model's clock.
    pub(super) fn show(&mut self, model: &Model, now: Duration, model_now: Duration) -> anyhow::Result<()> {
        match &mut self.screen {
            Some(screen) => screen.show(model, now, model_now).context("drawing on the terminal")?,
            None => self.lines.show(model),
        }
        Ok(())
    }
}

// Output without a screen: one line per event, and the verdict at the end.

/// Prints events as they come.
#[derive(Debug, Default)]
pub struct Lines {
    seen: u64,
    closed: bool,
    /// Texts that found no room since the last one that did.
    lost: u64,
    /// Prints in a thread: a full pipe must delay neither the link nor the screen.
    printer: Option<Background<u64, bool>>,
}

impl Lines {
    /// Prints only new events; the earlier ones were shown on a screen.
    pub fn new_events_only(model: &Model) -> Self {
        Self { seen: model.events.total(), closed: false, lost: 0, printer: None }
    }

    /// Prints nothing: the output has no reader.
    pub fn closed() -> Self {
        Self { seen: 0, closed: true, lost: 0, printer: None }
    }

    /// Prints the new events. Once the output has no reader, printing stops and the flight
    /// continues.
    pub fn show(&mut self, model: &Model) {
        if self.closed || is_quiet() || self.seen == model.events.total() {
            return;
        }
        let mut text = String::new();
        let shown = |event: &&Event| !model.settings.demonstration || is_of_the_flight(event);
        for event in model.events.since(self.seen).filter(shown) {
            let (time_s, speaker, mark) = (event.at.as_secs_f64(), event.speaker, event.mark());
            // Writing into a String cannot fail.
            let _ = writeln!(text, "{time_s:9.3}  {speaker:<7}  {mark}{}", event.text);
        }
        self.seen = model.events.total();
        if self.lost > 0 {
            text.insert_str(0, &format!("{} messages were not printed: the output is blocked\n", self.lost));
        }
        if self.printer.is_none() {
            self.printer = Background::start("lines").ok();
        }
        let Some(printer) = &self.printer else { return };
        let has_room = printer.queue(self.seen, move || print(text.as_bytes()).is_ok());
        self.lost = if has_room { 0 } else { self.lost + 1 };
        self.closed = std::iter::from_fn(|| printer.outcome()).any(|is_read| !is_read);
    }
}

/// How long the last lines may take at the end.
const PRINTED_WITHIN: Duration = Duration::from_secs(1);
/// Set once the output is blocked: printing to it would wait for ever.
static STUCK: AtomicBool = AtomicBool::new(false);

impl Drop for Lines {
    fn drop(&mut self) {
        if self.printer.as_ref().is_some_and(|printer| !printer.wait(PRINTED_WITHIN)) {
            STUCK.store(true, Ordering::Release);
        }
    }
}

/// Whether an event is about the flight rather than about its commands: the reader of a
/// demonstration without a screen wants to see the flight. The log has every event.
fn is_of_the_flight(event: &Event) -> bool {
    let of_interest = ["demonstration", "live values", "phase ", Ending::Stands.word()];
    let by_ground = event.speaker == Speaker::Ground && event.level == EventLevel::Info;
    let of_the_solver = event.text.starts_with("controller level");
    (!by_ground || of_interest.iter().any(|words| event.text.starts_with(words))) && !of_the_solver
}

/// A path that is the same wherever it is read.
pub(super) fn absolute(path: &str) -> String {
    std::path::absolute(path).map_or_else(|_no_folder| path.to_owned(), |path| path.display().to_string())
}

/// The first output of a station without a screen: its links, its log, and the next commands.
pub(super) fn greeting(model: &Model) -> String {
    let link = &model.settings.link_name;
    let log = model.settings.log_path.as_deref().map_or_else(|| "none".to_owned(), absolute);
    format!("link: {link}\nlog: {log}\ntype next: ground attach (a screen), ground stop (the end)\n")
}

/// Prints the closing lines: the verdict limit by limit, and where the log is.
pub fn closing(model: &Model, on_screen: bool, log: Result<&Option<PathBuf>, &RecorderError>, now: Duration) {
    if on_screen && !crate::app::screen::wait_for_end() {
        // A blocked terminal would keep the program and its link open for ever.
        return;
    }
    let mut text = String::new();
    match model.vehicle.verdict() {
        Some(verdict) => text.push_str(&verdict_table(model, &verdict.value, now)),
        None if !on_screen => text.push_str("no landing verdict\n"),
        None => {}
    }
    // The last warning before a person approaches the vehicle.
    if let Some(words) = headline::banner(model, now) {
        let _ = writeln!(text, "{}", words.sentence());
    }
    if model.vehicle.reset_in_flight {
        text.push_str("the flight computer was RESET IN FLIGHT\n");
    }
    if model.vehicle.log_has_stopped() {
        text.push_str("the vehicle's own log has stopped: it does not have the whole flight\n");
    }
    if model.log.dropped > 0 {
        let _ = writeln!(text, "log: {} records dropped", model.log.dropped);
    }
    if let Ok(Some(path)) = log {
        if let Some(head) = model.book.short() {
            let signed = if model.book.is_signed { "signed" } else { "not signed (--key)" };
            let confirmed = model.book.confirmed;
            let _ = writeln!(text, "book: {head}, {signed}; the vehicle confirmed {confirmed} entries");
        }
        let _ = writeln!(text, "log: {}", path.display());
    }
    // The exit code is decided even if this cannot be printed.
    let _ = print(text.as_bytes());
}

/// How the flight ended and where the log is, for programs.
pub(super) fn ended(model: &Model, exit: Exit, log: Option<&PathBuf>, now: Duration) -> String {
    let FlightSoFar { started, refusal, verdict, error, .. } = &model.outcome;
    let ending = Ending::of(&model.vehicle, now).map(|ending| ending.sentence(&model.vehicle));
    let ended = json!({
        "exit_code": exit as u8, "started": started, "stands": verdict.map(|(stands, _)| stands), "ending": ending,
        "refusal": refusal.as_ref().map(|(words, _)| words), "error": error, "log": log,
    });
    format!("{ended:#}\n")
}

fn verdict_table(model: &Model, verdict: &Verdict, now: Duration) -> String {
    let under_parachute = Ending::of(&model.vehicle, now) == Some(Ending::UnderParachute);
    let against =
        if under_parachute { "under the parachute" } else { "against the design envelope of its legs" };
    let mut text = format!("touchdown, {against}\n");
    for row in limit_rows(&verdict.touchdown, model.vehicle.limits().as_ref(), under_parachute) {
        let word = if row.is_met { "ok" } else { "NO" };
        let value = fixed(row.value, 3);
        let _ = writeln!(text, "  {word} {:<8} {value:>9} {:<6} {}", row.name, row.unit, row.limit);
    }
    if let Some(ending) = Ending::of(&model.vehicle, now) {
        let _ = writeln!(text, "{}", ending.sentence(&model.vehicle));
    }
    text
}

/// Writes to standard output.
///
/// # Errors
/// It cannot be written.
pub(super) fn print(bytes: &[u8]) -> anyhow::Result<()> {
    anyhow::ensure!(!STUCK.load(Ordering::Acquire), "standard output takes no more");
    let mut out = std::io::stdout().lock();
    out.write_all(bytes).and_then(|()| out.flush()).context("writing to standard output")
}
