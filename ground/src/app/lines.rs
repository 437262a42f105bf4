//! Output without a screen: one line per event, and the verdict at the end.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use protocol::log::recorder::RecorderError;

use crate::model::Model;
use crate::model::ending::Ending;
use crate::model::vehicle::Verdict;
use crate::view::banner;
use crate::view::limit_rows::limit_rows;
use crate::view::number::fixed;

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
        self.closed = print(&text).is_err();
    }
}

/// Prints the closing lines: the verdict limit by limit, and where the log is.
pub fn closing(
    model: &Model,
    interactive: bool,
    log_path: Result<&Option<PathBuf>, &RecorderError>,
    now: Duration,
) {
    if interactive && !super::terminal_writer::wait_for_end() {
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
    if let Some(words) = banner::of(model, now) {
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
    let _ = print(&text);
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

fn print(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}
