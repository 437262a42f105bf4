//! Cuts a log: a span of its time, and some of its topics, as a new log.
//!
//! What a record means may hang on all before it: the flight computer remembers, and an entry of a book is proven by those
//! before it. So the topics of both are kept from the beginning ([`CHAINED`]), unless they are left out, and a cut log is
//! verified as far as it goes. Metadata and attachments are kept, and the log's run facts say what it was cut from. A
//! message is kept unchanged or not at all.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::Result;
use avionics::log::frame::phase_of;
use flight::rules::phase::Phase;
use mcap::records::Metadata;
use protocol::log::record::{
    METADATA_RUN, TOPIC_BOOK, TOPIC_BOOK_HEAD, TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START,
};
use protocol::program::Exit;
use serde::Serialize;

use crate::cli::{Answer, give};
use crate::log::{Clock, ClockTime, Entry, FlightLog, LogError, Moment};
use crate::output::WriteError;
use crate::print::counted;
use crate::recover::{Kept, Records, Rescue};

/// A record of these says nothing without those before it.
const CHAINED: [&str; 4] = [TOPIC_COMPUTER_START, TOPIC_COMPUTER_FRAME, TOPIC_BOOK, TOPIC_BOOK_HEAD];
/// The run fact that says what a log was cut from.
pub(crate) const CUT_FROM: &str = "cut_from";

/// Why nothing was cut.
#[derive(Debug, thiserror::Error)]
pub enum CutError {
    #[error(transparent)]
    Log(#[from] LogError),
    /// The bytes between what can be read are not copied.
    #[error("{name}: is damaged: {damage}; `replay recover` makes a whole log of what can be read")]
    Damaged { name: String, damage: String },
    /// The log does not say when that was.
    #[error("{name}: has no {moment}")]
    NoMoment { name: String, moment: Moment },
    #[error("{name}: {until} is before {from}: nothing lies between")]
    Backwards { name: String, from: Moment, until: Moment },
    /// Nothing is left.
    #[error("{name}: no message is of that time and those topics; it has {}", topics.join(", "))]
    Nothing { name: String, topics: Vec<String> },
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// What of a log is kept.
#[derive(Debug, Clone, Default)]
pub struct Wanted {
    pub from: Option<Moment>,
    pub until: Option<Moment>,
    /// Topics; a `*` at the end matches any rest. Empty for all.
    pub topics: Vec<String>,
}

impl Wanted {
    fn has(&self, topic: &str) -> bool {
        let fits = |pattern: &String| {
            pattern.strip_suffix('*').map_or(pattern == topic, |begin| topic.starts_with(begin))
        };
        self.topics.is_empty() || self.topics.iter().any(fits)
    }
}

/// Report of a cut.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CutOut {
    /// The log that was cut.
    pub input: String,
    pub output: PathBuf,
    /// Messages kept, and those left out.
    pub messages: u64,
    pub left_out: u64,
    /// Messages before the span that were kept because later ones hang on them.
    pub chained: u64,
    /// The flight computer's frames are kept: `verify` runs them again.
    pub can_be_verified: bool,
    /// The book's entries are kept: `verify --book` proves them up to its last signed end.
    pub has_book: bool,
}

/// Cuts a log into a new file.
///
/// # Errors
/// See [`CutError`].
pub fn cut(input: &Path, wanted: &Wanted, output: &Path) -> Result<CutOut, CutError> {
    let name = input.display().to_string();
    let mut records = Records::open(input)?;
    let contents = records.contents()?;
    if let Some(damage) = contents.fault() {
        return Err(CutError::Damaged { name, damage });
    }
    let (from_ns, until_ns) = span_ns(input, wanted)?;
    if let (Some(from), Some(until), true) = (wanted.from, wanted.until, until_ns < from_ns) {
        return Err(CutError::Backwards { name, from, until });
    }
    let (mut chained, mut kept_topics) = (0, BTreeSet::new());
    let mut keeps = |topic: &str, at_ns: u64| {
        let is_before = at_ns < from_ns;
        let is_kept = wanted.has(topic) && at_ns <= until_ns && (!is_before || CHAINED.contains(&topic));
        if is_kept {
            chained += u64::from(is_before);
            if !kept_topics.contains(topic) {
                kept_topics.insert(topic.to_owned());
            }
        }
        is_kept
    };
    let rescue = Rescue::of::<CutError>(output, (&mut records, &contents), &mut keeps)?;
    let Kept { messages, left_out, .. } = rescue.kept();
    if messages == 0 {
        // A topic may have a channel a link.
        let topics: BTreeSet<String> =
            contents.told.channels.values().map(|channel| channel.topic.clone()).collect();
        return Err(CutError::Nothing { name, topics: topics.into_iter().collect() });
    }
    let facts = BTreeMap::from([(CUT_FROM.to_owned(), words_of(&name, wanted))]);
    let output = rescue.finish(&Metadata { name: METADATA_RUN.to_owned(), metadata: facts })?;
    let has = |topics: [&str; 2]| topics.iter().all(|topic| kept_topics.contains(*topic));
    Ok(CutOut {
        input: name,
        output,
        messages,
        left_out,
        chained,
        can_be_verified: has([TOPIC_COMPUTER_START, TOPIC_COMPUTER_FRAME]),
        has_book: has([TOPIC_BOOK, TOPIC_BOOK_HEAD]),
    })
}

/// What a log was cut from, for its run facts.
fn words_of(name: &str, Wanted { from, until, topics }: &Wanted) -> String {
    let from = from.map(|from| format!(", from {from}")).unwrap_or_default();
    let until = until.map(|until| format!(", until {until}")).unwrap_or_default();
    let topics = if topics.is_empty() { String::new() } else { format!(", only {}", topics.join(" ")) };
    format!("{name}{from}{until}{topics}")
}

/// The first and the last time that are kept, ns since the Unix epoch.
fn span_ns(input: &Path, wanted: &Wanted) -> Result<(u64, u64), CutError> {
    let mut log = FlightLog::open(input)?;
    let mut first_ns = None;
    let mut begins: BTreeMap<Phase, u64> = BTreeMap::new();
    let mut frames_ns: [Option<u64>; 2] = [None; 2];
    while let Some(stamped) = log.next_entry()? {
        let at_ns = stamped.log_time_ns;
        first_ns.get_or_insert(at_ns);
        let phase = match &stamped.entry {
            Entry::ComputerFrame(frame) => {
                for (found, moment) in frames_ns.iter_mut().zip([wanted.from, wanted.until]) {
                    if matches!(moment, Some(Moment::Frame(number)) if number == frame.record.input.frame) {
                        found.get_or_insert(at_ns);
                    }
                }
                phase_of(&frame.record.output)
            }
            Entry::Telemetry(telemetry) => {
                telemetry.phase.and_then(|phase| Phase::from_index(u8::try_from(phase).ok()?))
            }
            _ => None,
        };
        if let Some(phase) = phase {
            begins.entry(phase).or_insert(at_ns);
        }
    }
    let first_ns = first_ns.unwrap_or(0);
    let at_ns = |moment: Option<Moment>, frame_ns: Option<u64>, otherwise: u64| {
        let Some(moment) = moment else { return Ok(otherwise) };
        let found = match moment {
            Moment::Frame(_) => frame_ns,
            Moment::Phase(phase) => begins.get(&phase).copied(),
            Moment::Time(time) => {
                log.clocks().convert(time, Clock::Log).map(|ClockTime { time_s, .. }| {
                    // A time before the first record is the beginning.
                    first_ns + (1e9 * time_s.max(0.0)) as u64
                })
            }
        };
        found.ok_or_else(|| CutError::NoMoment { name: log.name().to_owned(), moment })
    };
    Ok((at_ns(wanted.from, frames_ns[0], 0)?, at_ns(wanted.until, frames_ns[1], u64::MAX)?))
}

impl Answer for CutOut {
    fn sentences(&self) -> Vec<String> {
        let Self { input, output, messages, left_out, chained, .. } = self;
        let (messages, output) = (counted(*messages, "message"), output.display());
        let mut lines = vec![format!("{input}: kept {messages}, left out {left_out}; written to {output}")];
        if *chained > 0 {
            lines.push(format!("{chained} of them are older than the span: what comes later hangs on them"));
        }
        let verified = if self.can_be_verified {
            "`replay verify` runs the flight computer again, from its beginning to where this log ends"
        } else {
            "`replay verify` CANNOT run it again: the flight computer's start or its frames are not in it"
        };
        lines.push(verified.to_owned());
        if self.has_book {
            let proven = "`replay verify --book` proves the book up to its last signed end in this log";
            lines.push(proven.to_owned());
        }
        lines
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log.
    file: PathBuf,
    /// The log to write.
    output: PathBuf,
    /// Only these topics; a * at the end matches any rest.
    topics: Vec<String>,
    /// Begin here: T+12.9, boot:19.8, log:19.7, POWERED or frame:1290.
    ///
    /// The frames of the flight computer and the entries of a book are kept from the beginning: what comes later hangs on
    /// them.
    #[arg(long, value_name = "WHERE")]
    from: Option<Moment>,
    /// End here, in the same words.
    #[arg(long, value_name = "WHERE")]
    until: Option<Moment>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        let wanted = Wanted { from: self.from, until: self.until, topics: self.topics };
        give(&cut(&self.file, &wanted, &self.output)?, self.json)
    }
}
