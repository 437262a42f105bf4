//! Checks whether the controller makes the recorded decisions again, bit for bit.
//!
//! [`verify`] builds the flight computer from the mission in the log and runs it on every recorded input. It compares every
//! field of the output, the digest of the memory, what the pilot thought, and the computer at its release with the record.
//! The inputs themselves are judged: some cannot be. [`verify_strictly`] also flies a simulated flight again, closed loop,
//! and compares its measurements and its verdict. The answer lists what was compared and what was not; truth, events and
//! measured times are not.
//!
//! A vehicle's log has every frame from power-up on, so self-test, arming, countdown, gate and abort are compared as well. A
//! frame in flight is a *frame* and counts from the release; a log of a flight that begins there has only frames, and the
//! report says so.
//!
//! The computer remembers its plan, so a frame can be re-executed only if every frame before it can be. The comparison
//! ends at a gap, and the report says so.
//!
//! A log joined by other tools may hold several flights; each has its own report. A flight without comparisons is never
//! identical, and a flight whose record ends before the flight did is reported as cut.
//!
//! For a divergence, the report says how it grows from frame to frame. If a whole file is verified, it also says whether
//! the landing would end differently: only for this, the flight is simulated from the first frame that differs.

mod again;
mod baseline;
pub mod book;
mod difference;
pub mod explain;
mod flight;
mod inputs;
mod parts;

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use self::flight::FlightVerifier;
pub use self::flight::{Consequence, Unread};
use anyhow::{Result, bail};
use difference::Tally;
pub use difference::{
    Divergence, FieldDifference, FieldValue, Growth, GrowthStep, differences, ulp_distance,
};
pub use parts::Part;
use parts::print_parts;
use protocol::log::reader::Damage;
use protocol::log::record::{SCHEMA_VERSION, TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START, TOPIC_VERDICT};
use serde::Serialize;

use crate::cli::{Outcome, answer, say, warn_of_cut, warn_of_damage};
use crate::controller::FrameError;
use crate::log::{
    BuildComparison, Cut, Entry, FlightLog, Flights, Head, LogError, LoggedFlight, Recording, VerdictFacts,
};
use crate::print::{counted, print_json, shown};

/// The topics that a verification reads.
const VERIFIED: [&str; 3] = [TOPIC_COMPUTER_START, TOPIC_COMPUTER_FRAME, TOPIC_VERDICT];

/// Verifies a log file: one report on each of its flights, or one report if it has none.
///
/// # Errors
/// The file is not a flight log or cannot be read. A log that cannot be replayed is a report, not an error.
pub fn verify(path: &Path) -> Result<Vec<VerifyReport>, LogError> {
    let mut log = FlightLog::open(path)?.decoding(&VERIFIED);
    let mut reports = verify_log(&mut log, || {
        // Another tool may have moved the attachments to the end of the file, after the messages.
        let mut whole = FlightLog::open(path)?;
        while whole.next_entry()?.is_some() {}
        Ok(whole.head().clone())
    })?;
    let read = reports.iter().map(|report| report.frames_recorded).sum();
    // A recovered log is read to its end; what is lost is not in it.
    let unread = !matches!(log.damage(), Some(Damage::Recovered(_)));
    for report in reports.iter_mut().filter(|report| unread && report.damage.is_some()) {
        report.unread = Some(Unread::of(path, read, log.last_log_time_ns()));
    }
    // A log that is too long to be flown again, or has several flights, has still been compared.
    if let [report] = reports.as_mut_slice()
        && let Some(first) = &report.first_divergence
        && let Ok(recording) = Recording::open(path)
    {
        report.consequence = Some(Consequence::of(&recording, first.in_flight.then_some(first.frame)));
    }
    Ok(reports)
}

/// Verifies a log file, and flies a simulated flight again. That takes the time of another flight.
///
/// # Errors
/// As [`verify`].
pub fn verify_strictly(path: &Path) -> Result<Vec<VerifyReport>, LogError> {
    let mut reports = verify(path)?;
    let [report] = reports.as_mut_slice() else {
        let why = "a file with several flights is not flown again";
        for report in &mut reports {
            report.explain_what_is_left(why);
        }
        return Ok(reports);
    };
    if report.outcome != Verification::Identical {
        report.explain_what_is_left("what differs or is not whole is not flown again");
        return Ok(reports);
    }
    let count = |name: &str| report.part(name).map_or(0, |part| part.recorded);
    let simulated = count("truth") > 0;
    let [mut verdict, mut facts] = ONLY_STRICTLY.map(|name| Part::of(name, count(name)));
    again::compare(path, simulated, &mut verdict, &mut facts);
    for part in [verdict, facts] {
        report.replace(part);
    }
    Ok(reports)
}

/// Verifies a log that is being read. `whole_head` is called for the log's whole head if its first frame comes before
/// its profile.
///
/// # Errors
/// As [`verify`].
pub fn verify_log<R: Read>(
    log: &mut FlightLog<R>,
    whole_head: impl Fn() -> Result<Head, LogError>,
) -> Result<Vec<VerifyReport>, LogError> {
    let mut flights = Flights::default();
    let mut computers: Vec<FlightVerifier> = Vec::new();
    // An unreadable record before the first flight may have been its beginning.
    let mut unreadable = None;
    while let Some(stamped) = log.next_entry()? {
        if flights.note(&stamped) {
            computers.push(FlightVerifier::new(!computers.is_empty(), unreadable.take()));
        }
        let Some(computer) = computers.last_mut() else {
            if let Entry::Unreadable { reason } = stamped.entry {
                unreadable.get_or_insert(reason);
            }
            continue;
        };
        computer.take(stamped, log, &whole_head)?;
    }
    if computers.is_empty() {
        computers.push(FlightVerifier::new(false, unreadable));
    }
    let of = computers.len();
    let mut reports = Vec::new();
    for (place, computer) in computers.into_iter().enumerate() {
        let flight = (of > 1).then_some(FlightPlace { number: place + 1, of });
        let cut = flights.found().get(place).and_then(LoggedFlight::cut);
        // Damage ends the reading, so it belongs to the last flight.
        let damage = log.damage().filter(|_| place + 1 == of).map(ToString::to_string);
        let head = log.head();
        let facts = FileFacts {
            file: log.name().to_owned(),
            flight,
            cut,
            damage,
            counted: log.is_counted(),
            build: head.compare_build(),
            schema: (!head.is_of_this_schema()).then(|| head.schema_version().unwrap_or("none").to_owned()),
            profile: head.run.get("profile").cloned(),
        };
        reports.push(computer.into_report(facts));
    }
    Ok(reports)
}

/// The result of a verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verification {
    /// The flight is whole, has frames, and all that was compared is identical.
    Identical,
    /// The log is damaged, ends before its flight did or lacks a part, and what could be compared is identical.
    IdenticalReadablePart,
    /// Something differs.
    Diverged,
    /// Nothing differs, and an input cannot be.
    Impossible,
    /// Some frame could not be re-executed, and all others are identical.
    NotReplayable,
}

impl Verification {
    /// The answer. If `strict`, only a whole flight is identical.
    fn answer(self, strict: bool) -> Outcome {
        match self {
            Self::Identical => Outcome::Given,
            Self::IdenticalReadablePart => Outcome::Decided { yes: !strict },
            Self::Impossible | Self::Diverged => Outcome::Decided { yes: false },
            Self::NotReplayable => Outcome::NotAll,
        }
    }
}

/// Why frames were not compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Obstacle {
    /// No frame of a flight computer in the log.
    #[error(
        "it has no frames of a flight computer that this build knows: replay needs the log of the vehicle or of the demonstration, not of a ground station"
    )]
    NoComputer,
    /// No profile in the log.
    #[error("it has no attachment profile.toml, and without the profile the controller cannot be built")]
    NoProfile,
    /// This build cannot use the profile in the log.
    #[error("its profile cannot be used by this build: {reason}")]
    ProfileUnreadable {
        /// What is wrong with the profile.
        reason: String,
    },
    /// The log does not begin with the first frame.
    #[error(
        "it begins with frame {first}, and the frames before it are missing: what the flight computer remembered then is unknown"
    )]
    BeginningMissing {
        /// The first frame in the log.
        first: u64,
    },
    /// Frames are missing.
    #[error(
        "after frame {after} comes frame {before}: what the flight computer remembered there is unknown, and nothing behind the gap was compared"
    )]
    Gap {
        /// The last frame before the gap.
        after: u64,
        /// The first frame after the gap.
        before: u64,
    },
    /// A record cannot be read.
    #[error("a record cannot be read: {reason}")]
    Unreadable { reason: String },
    /// A flight computer was released, and none of its frames follow.
    #[error("it has a record /computer/start and no frame of the flight computer behind it")]
    NoFrames,
    /// There are frames of a flight computer, and no record of what it was built from.
    #[error("it has frames of the flight computer and no record /computer/start before them to begin from")]
    NoStart,
    /// The log's contents are of another version.
    #[error("it says that its contents have version {found}; this build reads {SCHEMA_VERSION}")]
    Schema {
        /// What the log says.
        found: String,
    },
    /// A frame cannot be given to this build's flight computer.
    #[error("{0}")]
    Frame(#[from] FrameError),
}

/// As text.
impl Serialize for Obstacle {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// The place of a flight in a log that holds several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct FlightPlace {
    /// Its number, from 1.
    pub number: usize,
    /// Number of flights.
    pub of: usize,
}

/// Facts about a flight's record besides its frames.
pub(super) struct FileFacts {
    pub(super) file: String,
    pub(super) flight: Option<FlightPlace>,
    pub(super) cut: Option<Cut>,
    pub(super) damage: Option<String>,
    /// The log says how many records it has.
    pub(super) counted: bool,
    pub(super) build: BuildComparison,
    /// The version of its contents, if this build does not read it.
    pub(super) schema: Option<String>,
    /// The profile that its run facts name.
    pub(super) profile: Option<String>,
}

/// The report on one flight.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerifyReport {
    /// The log.
    pub file: String,
    /// The place of the flight, if the log holds several.
    pub flight: Option<FlightPlace>,
    /// The result of a verification.
    pub outcome: Verification,
    /// Whether the frames begin at power-up, and not at the release.
    pub from_power_up: bool,
    /// What was compared, and what was not.
    pub parts: Vec<Part>,
    /// The log says how many records it has. Otherwise nothing shows that the last ones are missing.
    pub counted: bool,
    /// Frames that could be read.
    pub frames_recorded: u64,
    /// Frames that were re-executed and compared.
    pub frames_compared: u64,
    /// Frames identical in every bit.
    pub frames_identical: u64,
    pub frames_different: u64,
    /// Frames in flight that were compared.
    pub frames_in_flight: u64,
    /// Fields that differ, over all frames.
    pub fields_different: u64,
    /// The numbers of the first and the last frame compared.
    pub span: Option<(u64, u64)>,
    /// Vehicle time from the first frame compared to the last, s.
    pub flight_s: Option<f64>,
    /// The first frame that differs.
    pub first_divergence: Option<Divergence>,
    /// How the divergence grows.
    pub growth: Option<Growth>,
    /// Whether the landing would end differently; only for whole files.
    pub consequence: Option<Consequence>,
    /// Why not every frame was compared.
    pub obstacle: Option<Obstacle>,
    /// Where the record ends, if that is before the end of the flight.
    pub cut: Option<Cut>,
    /// Why the log could not be read to its end.
    pub damage: Option<String>,
    /// The part that was not read because of the damage; only for files.
    pub unread: Option<Unread>,
    /// Comparison of the build that wrote the log with this one.
    pub build: BuildComparison,
}

impl VerifyReport {
    fn new(
        facts: FileFacts,
        (frames_recorded, counts): (u64, Tally),
        from_power_up: bool,
        parts: Vec<Part>,
        obstacle: Option<Obstacle>,
    ) -> Self {
        let (first_divergence, growth) = (counts.divergence, counts.growth);
        let FileFacts { file, flight, cut, damage, counted, build, schema: _, profile: _ } = facts;
        let (first, last) = (counts.first, counts.last);
        let mut report = Self {
            file,
            flight,
            outcome: Verification::Identical,
            from_power_up,
            parts,
            counted,
            frames_recorded,
            frames_compared: counts.compared,
            frames_identical: counts.compared - counts.different,
            frames_different: counts.different,
            frames_in_flight: counts.in_flight,
            fields_different: counts.fields_different,
            span: first.zip(last).map(|((first, _), (last, _))| (first, last)),
            flight_s: first.zip(last).map(|((_, first_s), (_, last_s))| last_s - first_s),
            growth: first_divergence.is_some().then_some(growth),
            first_divergence,
            consequence: None,
            obstacle,
            cut,
            damage,
            unread: None,
            build,
        };
        report.conclude();
        report
    }

    /// A part of the record by its name.
    pub fn part(&self, name: &str) -> Option<&Part> {
        self.parts.iter().find(|part| part.name == name)
    }

    /// Puts a part in the place of the one with its name.
    fn replace(&mut self, part: Part) {
        if let Some(place) = self.parts.iter_mut().find(|known| known.name == part.name) {
            *place = part;
        }
        self.conclude();
    }

    /// Says why a strict verification has not compared what only it compares.
    fn explain_what_is_left(&mut self, why: &str) {
        let left = |part: &&mut Part| ONLY_STRICTLY.contains(&part.name) && part.different == 0;
        for part in self.parts.iter_mut().filter(left) {
            part.why = Some(why.to_owned());
        }
    }

    /// Whether every part that follows from the inputs was compared.
    pub fn is_all_compared(&self) -> bool {
        self.parts.iter().all(Part::is_whole)
    }

    fn conclude(&mut self) {
        let different = |part: &&Part| part.different > 0;
        let of_inputs = |part: &Part| part.name == "inputs";
        let whole = |part: &Part| part.is_whole() || ONLY_STRICTLY.contains(&part.name);
        self.outcome = if self.parts.iter().filter(different).any(|part| !of_inputs(part)) {
            Verification::Diverged
        } else if self.parts.iter().filter(different).any(of_inputs) {
            Verification::Impossible
        } else if self.obstacle.is_some() {
            Verification::NotReplayable
        } else if self.damage.is_some() || self.cut.is_some() || !self.parts.iter().all(whole) {
            Verification::IdenticalReadablePart
        } else {
            Verification::Identical
        };
    }
}

/// Parts that only a strict verification compares.
const ONLY_STRICTLY: [&str; 2] = ["verdict", "metadata"];

/// Most fields of the first diverged frame that are shown.
const FIELDS_SHOWN: usize = 5;

/// Writes a verification as text.
///
/// # Errors
/// The output failed.
pub fn print_verify(report: &VerifyReport, output: &mut impl Write) -> io::Result<()> {
    let name = name_of(report);
    let VerifyReport { frames_identical, frames_compared, frames_recorded, .. } = report;
    match report.outcome {
        Verification::Identical => {
            writeln!(output, "{name}: {frames_identical} of {frames_compared} frames identical")?;
        }
        Verification::IdenticalReadablePart => {
            let of = if report.damage.is_some() { " of the readable part" } else { "" };
            let what_is_missing = what_is_missing(report);
            writeln!(
                output,
                "{name}: {frames_identical} of {frames_compared} frames identical{of}{what_is_missing}"
            )?;
        }
        Verification::Diverged if report.first_divergence.is_none() => {
            let different = report.parts.iter().filter(|part| part.different > 0);
            let names: Vec<&str> = different.map(|part| part.name).collect();
            writeln!(
                output,
                "{name}: DIVERGED: {frames_identical} of {frames_compared} frames are identical, and not: {}",
                names.join(", ")
            )?;
        }
        Verification::Diverged => {
            let VerifyReport { frames_different, fields_different, .. } = report;
            let fields = counted(*fields_different, "field");
            writeln!(
                output,
                "{name}: DIVERGED: {frames_different} of {frames_compared} frames differ, in {fields}"
            )?;
        }
        Verification::Impossible => {
            writeln!(output, "{name}: IMPOSSIBLE: some recorded inputs cannot be")?;
        }
        Verification::NotReplayable if *frames_compared == 0 => {
            let reason = report.obstacle.as_ref().map(|obstacle| shown(&obstacle.to_string()));
            writeln!(output, "{name}: nothing was compared: {}", reason.unwrap_or_default())?;
        }
        Verification::NotReplayable => writeln!(
            output,
            "{name}: not replayable as a whole: the first {frames_identical} of {frames_recorded} frames are identical"
        )?,
    }
    if let Some(first) = &report.first_divergence {
        print_divergence(first, output)?;
    }
    print_beginning(report, output)?;
    if *frames_compared > 0 {
        print_parts(&report.parts, output)?;
    }
    if !report.counted {
        writeln!(output, "{NOT_COUNTED}")?;
    }
    if let Some(growth) = &report.growth {
        print_growth(growth, output)?;
    }
    if let Some(consequence) = &report.consequence {
        print_consequence(consequence, output)?;
    }
    if let Some(obstacle) = report.obstacle.as_ref().filter(|_| *frames_compared > 0) {
        writeln!(output, "not every frame was compared: {}", shown(&obstacle.to_string()))?;
    }
    if report.outcome != Verification::IdenticalReadablePart {
        let what_is_missing = what_is_missing(report);
        if !what_is_missing.is_empty() {
            writeln!(output, "what was compared is{what_is_missing}")?;
        }
    }
    Ok(())
}

/// Prints from where on the flight computer was run again.
fn print_beginning(report: &VerifyReport, output: &mut impl Write) -> io::Result<()> {
    let VerifyReport { from_power_up, frames_compared, frames_in_flight, flight_s, .. } = report;
    match (frames_compared, flight_s) {
        (0, _) | (_, None) => Ok(()),
        (_, Some(flight_s)) if *from_power_up => {
            writeln!(
                output,
                "from power-up to {flight_s:.3} s after it, {frames_in_flight} of them in flight"
            )
        }
        _ => writeln!(output, "{FRAMES_ALONE}"),
    }
}

/// The remark on a log whose flight computer cannot be run again from power-up on.
const FRAMES_ALONE: &str = "the log has no frames of the flight computer from power-up: arming and countdown, if any, were not run again";

/// The remark on a log without a summary.
const NOT_COUNTED: &str =
    "the log has no summary that counts its records: whether the last of them are missing cannot be known";

/// The file and, if it holds several flights, the flight's number.
fn name_of(report: &VerifyReport) -> String {
    let file = shown(&report.file);
    report
        .flight
        .map_or_else(|| file.clone(), |flight| format!("{file}: flight {} of {}", flight.number, flight.of))
}

/// What is missing from the part of the flight that was read.
fn what_is_missing(report: &VerifyReport) -> String {
    let cut = report.cut.as_ref().map(|cut| format!(" of an INCOMPLETE flight: {cut}"));
    let unread = report.damage.as_ref().map(|damage| {
        let frames = match report.unread.and_then(|unread| unread.frames) {
            Some((unread, all)) => format!("{unread} of {all} frames were not read"),
            None => "how many frames were not read is not known".to_owned(),
        };
        let seconds = report.unread.and_then(|unread| unread.seconds);
        let seconds = seconds.map(|seconds| format!(" ({seconds:.3} s)")).unwrap_or_default();
        format!("; {frames}{seconds}: {}", shown(damage))
    });
    [cut, unread].into_iter().flatten().collect()
}

fn print_divergence(first: &Divergence, output: &mut impl Write) -> io::Result<()> {
    let Divergence { frame, in_flight, time_s, phase, fields_different, .. } = first;
    let place = if *in_flight {
        format!("frame {frame} (T+{time_s:.3} s, {phase})")
    } else {
        format!("frame {frame} ({time_s:.3} s after power-up, {phase})")
    };
    writeln!(output, "first at {place}, {}:", counted(*fields_different as u64, "field"))?;
    for field in first.fields.iter().take(FIELDS_SHOWN) {
        print_field(field, output)?;
    }
    if first.fields_different > FIELDS_SHOWN {
        writeln!(output, "  and {} more", counted((first.fields_different - FIELDS_SHOWN) as u64, "field"))?;
    }
    Ok(())
}

fn print_field(field: &FieldDifference, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "  {}", field.path)?;
    for (name, value) in [("recorded", &field.recorded), ("recomputed", &field.recomputed)] {
        let bits = value.bits().map(|bits| format!("0x{bits:016x}")).unwrap_or_default();
        writeln!(output, "    {}", format!("{name:<10}  {:<24}  {bits}", value.to_string()).trim_end())?;
    }
    if let Some(ulps) = field.ulps {
        writeln!(output, "    apart       {ulps} ULP")?;
    }
    Ok(())
}

/// Prints the first diverged frame, those 1, 2, 4, 8 and so on after it, the worst and the last.
fn print_growth(growth: &Growth, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "how it grows (gimbal command, worst field):")?;
    let doubling = (0..).map(|power| (1_usize << power) - 1).take_while(|place| *place < growth.steps.len());
    let mut shown: Vec<&GrowthStep> = doubling.filter_map(|place| growth.steps.get(place)).collect();
    shown.extend(growth.peak.iter().chain(&growth.last));
    shown.sort_by_key(|step| step.frame);
    shown.dedup_by_key(|step| step.frame);
    for step in shown {
        let ulps = step.worst_ulps.map_or_else(|| "-".to_owned(), |ulps| ulps.to_string());
        writeln!(
            output,
            "  frame {:>5} {:>9.3} s  {:>10.3e} rad  {ulps} ULP in {}",
            step.frame,
            step.time_s,
            step.gimbal_rad,
            counted(step.fields_different as u64, "field")
        )?;
    }
    Ok(())
}

fn print_consequence(consequence: &Consequence, output: &mut impl Write) -> io::Result<()> {
    if let Some(obstacle) = &consequence.obstacle {
        return writeln!(output, "verdict: whether it would change is not known: {}", shown(obstacle));
    }
    let word = |verdict: &Option<VerdictFacts>| {
        verdict.as_ref().map_or("no verdict", |verdict| verdict.landing.word())
    };
    let answer = match consequence.changed {
        Some(true) => "would CHANGE",
        Some(false) => "would not change",
        None => "is not comparable",
    };
    writeln!(
        output,
        "verdict: {answer}: recorded {}, flown on by this build from frame {} (closed loop) {}",
        word(&consequence.recorded),
        consequence.from_frame,
        word(&consequence.reflown)
    )
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The logs, MCAP files, and directories of logs.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Answer in JSON: a report, or a list of reports for several logs.
    #[arg(long)]
    json: bool,
    /// Exit code 1 unless all that can be compared was: damaged logs fail, logs that end before their flight did, and
    /// logs that lack a part. A simulated flight is flown again, and its verdict compared.
    #[arg(long)]
    strict: bool,
    /// Solve the plan of this frame of the only log again, and judge it; or of `all` frames, which takes a minute.
    #[arg(long, value_name = "FRAME|all", conflicts_with = "strict")]
    explain: Option<String>,
    #[command(flatten)]
    held: baseline::Arguments,
    #[command(flatten)]
    book: book::Arguments,
}

/// The result for one log.
type Verified<'a> = (&'a Path, Result<Vec<VerifyReport>, LogError>);

impl Args {
    pub(crate) fn run(self) -> Result<Outcome> {
        if self.book.book {
            return self.book.run(&self.files, self.json);
        }
        if let Some(frame) = &self.explain {
            let [file] = self.files.as_slice() else { bail!("--explain takes one log") };
            return explain::run(file, frame, self.json);
        }
        if let Some(baseline) = &self.held.baseline {
            let [directory] = self.files.as_slice() else { bail!("--baseline takes one directory") };
            return self.held.run(baseline, directory, self.json);
        }
        self.verify()
    }

    fn verify(&self) -> Result<Outcome> {
        let mut files = Vec::new();
        for file in &self.files {
            if file.is_dir() { files.extend(baseline::logs_of(file)?) } else { files.push(file.clone()) }
        }
        let mut answers: Vec<Verified> = Vec::new();
        for file in &files {
            #[expect(clippy::disallowed_methods, reason = "tells the user how fast it was; decides nothing")]
            let started = Instant::now();
            let verified = if self.strict { verify_strictly(file) } else { verify(file) };
            let took = started.elapsed();
            match &verified {
                Ok(reports) => {
                    for report in reports {
                        warn_of_damage(&report.file, report.damage.as_deref());
                        warn_of_cut(&report.file, report.cut.as_ref());
                        warn_of_build(report);
                    }
                    say_speed(reports, took);
                }
                // One unreadable log must not hide the results of the others.
                Err(error) if files.len() > 1 => say(&format!("{error}")),
                Err(_) => {}
            }
            answers.push((file, verified));
        }
        if let [(_, Err(_))] = answers.as_slice()
            && let Some((_, Err(error))) = answers.pop()
        {
            return Err(error.into());
        }
        let reports: Vec<&VerifyReport> =
            answers.iter().filter_map(|(_, verified)| verified.as_ref().ok()).flatten().collect();
        answer(|output| match reports.as_slice() {
            [report] if self.json && answers.len() == 1 => print_json(report, output),
            reports if self.json => print_json(&reports, output),
            reports => reports.iter().try_for_each(|report| print_verify(report, output)),
        })?;
        let all_compared = reports.iter().all(|report| report.is_all_compared());
        let outcome = match worst(&answers) {
            Verification::Identical if self.strict && !all_compared => Verification::IdenticalReadablePart,
            worst => worst,
        };
        Ok(outcome.answer(self.strict))
    }
}

/// The worst result decides: a difference, then no answer, then identical.
fn worst(answers: &[Verified]) -> Verification {
    let rank = |outcome: Verification| match outcome {
        Verification::Identical => 0,
        Verification::IdenticalReadablePart => 1,
        Verification::NotReplayable => 2,
        Verification::Impossible => 3,
        Verification::Diverged => 4,
    };
    let outcomes = answers.iter().flat_map(|(_, verified)| match verified {
        Ok(reports) => reports.iter().map(|report| report.outcome).collect(),
        Err(_) => vec![Verification::NotReplayable],
    });
    outcomes.max_by_key(|outcome| rank(*outcome)).unwrap_or(Verification::NotReplayable)
}

fn warn_of_build(report: &VerifyReport) {
    let differences = &report.build.differences;
    if report.outcome == Verification::Diverged && !differences.is_empty() {
        let facts: Vec<&str> = differences.iter().map(|difference| difference.fact.as_str()).collect();
        say(&format!("note: another build wrote {}; it differs in {}", report.file, facts.join(", ")));
    }
}

fn say_speed(reports: &[VerifyReport], took: Duration) {
    let seconds = took.as_secs_f64();
    let flight_s: f64 = reports.iter().filter_map(|report| report.flight_s).sum();
    if flight_s > 0.0 && seconds > 0.0 {
        say(&format!(
            "{flight_s:.1} s of flight in {seconds:.2} s, {:.0} times real time",
            flight_s / seconds
        ));
    }
}
