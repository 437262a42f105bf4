//! Without a screen: a line an event, and the verdict at the end.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use protocol::dialect::TD_TOUCHDOWN_LIMITS_DATA;
use protocol::log::recorder::RecorderError;

use crate::model::Model;
use crate::model::motor::KeepAway;
use crate::model::vehicle::Verdict;
use crate::view::number::fixed;
use crate::view::touchdown::verdict_word;

/// Prints events as they come.
#[derive(Debug, Default)]
pub struct Lines {
    seen: u64,
    closed: bool,
}

impl Lines {
    /// Nothing printed yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// What was said so far was shown elsewhere.
    pub fn from_now_on(model: &Model) -> Self {
        Self { seen: model.events.total(), closed: false }
    }

    /// Nobody reads them.
    pub fn closed() -> Self {
        Self { seen: 0, closed: true }
    }

    /// The next model's events are counted from its first.
    pub fn begin_anew(&mut self) {
        self.seen = 0;
    }

    /// Prints the events that were not printed yet. A reader that has gone away ends the lines, not the flight.
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
        self.closed = print(&text).is_err();
    }
}

/// The last words: the verdict limit by limit, and where the log is.
pub fn closing(model: &Model, interactive: bool, log_path: Result<&Option<PathBuf>, &RecorderError>) {
    if interactive && !super::paper::wait_for_end() {
        // A terminal that takes nothing would hold the program, its port and its line for ever.
        return;
    }
    let mut text = String::new();
    match model.vehicle.verdict {
        Some(verdict) => text.push_str(&verdict_table(&verdict.value, model.vehicle.limits.as_ref())),
        None if !interactive => text.push_str("no landing verdict\n"),
        None => {}
    }
    // The last thing said before somebody walks up to it.
    if let Some(away) = KeepAway::of(&model.vehicle) {
        let _ = writeln!(text, "{}", away.words());
    }
    if model.log.dropped > 0 {
        let _ = writeln!(text, "log: {} records dropped", model.log.dropped);
    }
    if let Ok(Some(path)) = log_path {
        let _ = writeln!(text, "log: {}", path.display());
    }
    // The exit code says it even if nobody reads this.
    let _ = print(&text);
}

fn verdict_table(verdict: &Verdict, limits: Option<&TD_TOUCHDOWN_LIMITS_DATA>) -> String {
    let mut text = String::from("landing verdict, against the vehicle's limits\n");
    for row in verdict.touchdown.rows(limits) {
        let word = if row.kept { "ok" } else { "NO" };
        let value = fixed(row.value, 3);
        let _ = writeln!(
            text,
            "  {word} {:<6} {value:>9} {:<6} limit {} {}",
            row.name, row.unit, row.limit, row.unit
        );
    }
    let (word, _) = verdict_word(verdict.landed);
    let _ = writeln!(text, "{word}");
    text
}

fn print(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}
