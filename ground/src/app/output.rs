//! The output of a run: a full screen or lines, and the closing lines.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context as _;
use protocol::log::recorder::RecorderError;

use super::programs::VoiceEnded;
use super::screen::Screen;
use crate::config::Config;
use crate::model::Model;
use crate::model::safety::Ending;
use crate::model::vehicle::Verdict;
use crate::update::Msg;
use crate::view::headline;
use crate::view::panels::limit_rows;
use crate::view::widgets::fixed;

/// The output of a run.
pub(super) enum Output {
    Screen(Box<Screen>),
    Lines(Lines),
}

impl Output {
    /// Opens a full screen if a person sits at the terminal, otherwise lines.
    ///
    /// # Errors
    /// The terminal cannot be prepared.
    pub(super) fn open(interactive: bool, config: &Config) -> anyhow::Result<Self> {
        if interactive {
            Screen::open(config).map(|screen| Self::Screen(Box::new(screen)))
        } else {
            Ok(Self::Lines(Lines::new()))
        }
    }

    /// Whether the terminal distinguishes a held key's repeats from presses.
    pub(super) fn reports_repeats(&self) -> bool {
        matches!(self, Self::Screen(screen) if screen.reports_repeats())
    }

    pub(super) fn redraw_at(&self) -> Option<Duration> {
        match self {
            Self::Screen(screen) => Some(screen.redraw_at()),
            Self::Lines(_) => None,
        }
    }

    /// The next input of the person at the terminal; waits for ever without one.
    pub(super) async fn input(&mut self) -> Msg {
        match self {
            Self::Screen(screen) => screen.input().await,
            Self::Lines(_) => std::future::pending().await,
        }
    }

    pub(super) fn mark_message(&mut self, msg: &Msg, model: &Model) {
        if let Self::Screen(screen) = self {
            screen.mark_message(msg, model);
        }
    }

    pub(super) fn mark_changed(&mut self) {
        if let Self::Screen(screen) = self {
            screen.mark_changed();
        }
    }

    pub(super) fn bell(&mut self) {
        if let Self::Screen(screen) = self {
            screen.bell();
        }
    }

    /// Calls a text out. Returns why nothing can be called out any more, once.
    pub(super) fn say(&mut self, text: &str) -> Option<VoiceEnded> {
        match self {
            Self::Screen(screen) => screen.say(text),
            Self::Lines(_) => None,
        }
    }

    pub(super) fn next_theme(&mut self) {
        if let Self::Screen(screen) = self {
            screen.next_theme();
        }
    }

    pub(super) fn clear(&mut self) {
        if let Self::Screen(screen) = self {
            screen.clear();
        }
    }

    /// Starts over with a new model.
    pub(super) fn start_over(&mut self) {
        match self {
            Self::Screen(screen) => screen.mark_changed(),
            Self::Lines(lines) => lines.start_over(),
        }
    }

    /// Shows the present state; `model_now` is the same moment on the model's clock.
    pub(super) fn show(&mut self, model: &Model, now: Duration, model_now: Duration) -> anyhow::Result<()> {
        match self {
            Self::Screen(screen) => screen.show(model, now, model_now).context("drawing on the terminal"),
            Self::Lines(lines) => {
                lines.show(model);
                Ok(())
            }
        }
    }
}

// Output without a screen: one line per event, and the verdict at the end.

/// Prints events as they come.
#[derive(Debug, Default)]
pub struct Lines {
    seen: u64,
    closed: bool,
}

impl Lines {
    /// Prints every event from the first on.
    pub fn new() -> Self {
        Self::default()
    }

    /// Prints only new events; the earlier ones were shown on a screen.
    pub fn new_events_only(model: &Model) -> Self {
        Self { seen: model.events.total(), closed: false }
    }

    /// Prints nothing: nobody reads the output.
    pub fn closed() -> Self {
        Self { seen: 0, closed: true }
    }

    /// Starts at the first event again, because a new model has a new list of events.
    pub fn start_over(&mut self) {
        self.seen = 0;
    }

    /// Prints the new events. If nobody reads the output any more, printing stops and the flight continues.
    pub fn show(&mut self, model: &Model) {
        if self.closed || self.seen == model.events.total() {
            return;
        }
        let mut text = String::new();
        for event in model.events.since(self.seen) {
            let (time_s, speaker, mark) = (event.at.as_secs_f64(), event.speaker.name(), event.mark());
            // Writing into a String cannot fail.
            let _ = writeln!(text, "{time_s:9.3}  {speaker:<7}  {mark}{}", event.text);
        }
        self.seen = model.events.total();
        self.closed = print_all(&text).is_err();
    }
}

/// Prints the closing lines: the verdict limit by limit, and where the log is.
pub fn closing(
    model: &Model,
    interactive: bool,
    log_path: Result<&Option<PathBuf>, &RecorderError>,
    now: Duration,
) {
    if interactive && !crate::app::screen::wait_for_end() {
        // A blocked terminal would keep the program and its link open for ever.
        return;
    }
    let mut text = String::new();
    match model.vehicle.verdict {
        Some(verdict) => text.push_str(&verdict_table(model, &verdict.value, now)),
        None if !interactive => text.push_str("no landing verdict\n"),
        None => {}
    }
    // The last warning before somebody approaches the vehicle.
    if let Some(words) = headline::banner(model, now) {
        let _ = writeln!(text, "{}", words.sentence());
    }
    if model.log.dropped > 0 {
        let _ = writeln!(text, "log: {} records dropped", model.log.dropped);
    }
    if let Ok(Some(path)) = log_path {
        if let Some(head) = model.book.short() {
            let signed = if model.book.is_signed { "signed" } else { "not signed (--key)" };
            let kept = model.book.kept;
            let _ = writeln!(text, "book: {head}, {signed}; the vehicle confirmed {kept} entries");
        }
        let _ = writeln!(text, "log: {}", path.display());
    }
    // The exit code is decided even if nobody reads this.
    let _ = print_all(&text);
}

fn verdict_table(model: &Model, verdict: &Verdict, now: Duration) -> String {
    let mut text = String::from("landing verdict, against the vehicle's limits\n");
    for row in limit_rows(&verdict.touchdown, model.vehicle.limits.as_ref()) {
        let word = if row.kept { "ok" } else { "NO" };
        let value = fixed(row.value, 3);
        let _ = writeln!(
            text,
            "  {word} {:<8} {value:>9} {:<6} limit {} {}",
            row.name, row.unit, row.limit, row.unit
        );
    }
    if let Some(ending) = Ending::of(&model.vehicle, now) {
        let _ = writeln!(text, "{}", ending.sentence(&model.vehicle));
    }
    text
}

fn print_all(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}
