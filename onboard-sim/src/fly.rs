//! The run loop: a vehicle, its clock, its links and its log.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use flight::arming;
use flight::phase::Phase;
use flight::profile::{BUILTIN, Profile, ProfileError};
use flight::verdict::LandingVerdict;
use protocol::frame::Framer;
use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record};
use protocol::log::recorder::Recorder;
use protocol::log::v1;
use protocol::log::writer::LogHeader;
use protocol::transport::{Endpoint, Received, Transport};
use tokio::sync::watch;

use crate::endpoint::VehicleEndpoint;
use crate::plant::Impact;
use crate::scatter::draw;
use crate::solve_times::SolveTimes;
use crate::vehicle::{
    DeadlinePolicy, LogState, Request, Severity, Snapshot, Vehicle, VehicleError, VehicleEvent,
};

/// How fast simulated time runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// This many times real time.
    Factor(f64),
    /// As fast as the machine can; in real time only while the vehicle waits for its crew.
    Max,
}

impl std::str::FromStr for Speed {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        if given == "max" {
            return Ok(Self::Max);
        }
        match given.parse::<f64>() {
            Ok(factor) if (0.01..=1000.0).contains(&factor) => Ok(Self::Factor(factor)),
            _ => Err(format!(
                "speed `{given}`: must be `max` or a factor from 0.01 to 1000"
            )),
        }
    }
}

/// What to fly.
pub struct FlyOptions {
    /// A built-in profile's name, or a path to a TOML file.
    pub profile_name_or_path: String,
    /// Links to serve; none is allowed.
    pub links: Vec<Endpoint>,
    /// Log to write into.
    pub recorder: Option<Recorder>,
    /// Seed of the dispersions.
    pub seed: u64,
    /// Speed of simulated time.
    pub speed: Speed,
    /// Arm and start without waiting for a ground station.
    pub auto_start: bool,
    /// End once the flight is over; otherwise keep serving the links until told to stop.
    pub exit_when_safed: bool,
    /// What a late controller output leads to.
    pub deadline_policy: DeadlinePolicy,
}

/// Why a flight could not be run.
#[derive(Debug, thiserror::Error)]
pub enum FlyError {
    /// No such profile.
    #[error(
        "no profile `{given}`: not a file, and the built-in ones are {}",
        builtin_names()
    )]
    NoProfile {
        /// What was asked for.
        given: String,
    },
    /// The profile's file cannot be read.
    #[error("profile {path}: {source}")]
    ReadProfile {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The profile is wrong.
    #[error(transparent)]
    Profile(#[from] ProfileError),
    /// The profile cannot be simulated.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// A link cannot be opened.
    #[error("link {link}: {source}")]
    Link {
        /// The link.
        link: String,
        /// What the system said.
        source: std::io::Error,
    },
}

fn builtin_names() -> String {
    BUILTIN
        .iter()
        .map(|(name, _)| *name)
        .collect::<Vec<_>>()
        .join(", ")
}

/// How a flight ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// Inside every limit.
    Landed,
    /// On the ground, outside a limit.
    OutsideLimits,
    /// Aborted before or without a landing.
    Aborted,
    /// Arming or starting was refused.
    Refused(String),
    /// Stopped from outside before its end.
    Stopped,
}

/// What a flight came to.
#[derive(Debug, Clone, PartialEq)]
pub struct FlightSummary {
    /// How it ended.
    pub outcome: Outcome,
    /// Contact and its judgement, if there was one.
    pub verdict: Option<(Impact, LandingVerdict)>,
    /// Last phase.
    pub phase: Phase,
    /// Simulated time, s.
    pub time_s: f64,
    /// Controller ticks and how long they took.
    pub solve_times: SolveTimes,
    /// Bytes sent on every link.
    pub tx_bytes: u64,
}

/// Reads a profile by built-in name or path; returns its text too, for the log.
///
/// # Errors
/// There is no such profile, or it is wrong: the message names the key.
pub fn load_profile(name_or_path: &str) -> Result<(Profile, String), FlyError> {
    if let Some(text) = Profile::builtin_toml(name_or_path) {
        return Ok((Profile::from_toml(text, name_or_path)?, text.to_owned()));
    }
    if !Path::new(name_or_path).exists() {
        return Err(FlyError::NoProfile {
            given: name_or_path.to_owned(),
        });
    }
    let text = std::fs::read_to_string(name_or_path).map_err(|source| FlyError::ReadProfile {
        path: name_or_path.to_owned(),
        source,
    })?;
    Ok((Profile::from_toml(&text, name_or_path)?, text))
}

/// The header of a flight's log.
pub fn log_header(
    writer: &str,
    profile: &Profile,
    profile_toml: &str,
    seed: u64,
    start_unix_ns: u64,
) -> LogHeader {
    let run = BTreeMap::from([
        ("profile".to_owned(), profile.name.clone()),
        ("seed".to_owned(), seed.to_string()),
        ("start_unix_ns".to_owned(), start_unix_ns.to_string()),
    ]);
    LogHeader {
        writer: writer.to_owned(),
        start_unix_ns,
        run,
        profile_toml: Some(profile_toml.to_owned()),
    }
}

/// Flies, reporting nothing but the summary. See [`fly_observed`].
///
/// # Errors
/// As [`fly_observed`].
pub async fn fly(options: FlyOptions, stop: watch::Receiver<bool>) -> Result<FlightSummary, FlyError> {
    fly_observed(options, stop, |_, _| ()).await
}

/// Flies; `observe` is called with the simulated time and each thing the vehicle reports.
///
/// The outcome depends only on profile, seed and what arrives on the links: not on the speed, the machine or
/// the clock (unless deadlines are enforced, which makes it the machine's business).
///
/// # Errors
/// The profile cannot be read or simulated, or a link cannot be opened.
pub async fn fly_observed(
    options: FlyOptions,
    mut stop: watch::Receiver<bool>,
    mut observe: impl FnMut(f64, &VehicleEvent) + Send,
) -> Result<FlightSummary, FlyError> {
    let (profile, _) = load_profile(&options.profile_name_or_path)?;
    let mut vehicle = Vehicle::new(&profile, draw(&profile, options.seed), options.deadline_policy)?;
    vehicle.pull_pin();
    let mut links = Links::open(&options.links, options.recorder.clone()).await?;
    let mut endpoint = VehicleEndpoint::new();
    let mut solve_times = SolveTimes::default();
    let mut pilot = AutoPilot {
        wanted: options.auto_start,
        refused: None,
    };
    let mut pace = Pace::new(options.speed, vehicle.frame_s());
    let mut log_state_due_s = 0.0;

    let stopped = loop {
        if vehicle.time_s() >= log_state_due_s {
            vehicle.set_log_state(log_state(options.recorder.as_ref()));
            log_state_due_s += 1.0;
        }
        for frame in links.receive(vehicle.time_s()) {
            endpoint.on_frame(&frame, &mut vehicle);
        }
        pilot.act(&mut vehicle);
        let stopwatch = pace.clock();
        let events = vehicle.advance_frame(&mut || stopwatch.elapsed());
        let time_s = vehicle.time_s();
        for event in &events {
            endpoint.on_event(event);
            observe(time_s, event);
            if let VehicleEvent::Tick(tick) = event {
                solve_times.add(tick.solve_time_s, tick.deadline_s);
            }
        }
        let snapshot = vehicle.snapshot();
        if let Some(recorder) = &options.recorder {
            record(recorder, &snapshot, &events);
        }
        for frame in endpoint.poll(&snapshot) {
            links.send(frame.as_bytes(), time_s);
        }
        let over = vehicle.is_over() || pilot.refused.is_some();
        if over && options.exit_when_safed && pace.has_lingered(!options.links.is_empty()) {
            break false;
        }
        let waiting = over || (vehicle.phase().on_pad() && vehicle.mode().countdown_end_s.is_none());
        let crewed = !options.links.is_empty() && !options.auto_start;
        tokio::select! {
            () = pace.wait(waiting && (crewed || over)) => {}
            changed = stop.changed() => {
                // A stop sender that is gone can ask for nothing any more; the flight ends with its owner.
                if changed.is_err() || *stop.borrow() { break true; }
            }
        }
    };
    let verdict = vehicle.verdict().copied();
    let outcome = match (&verdict, pilot.refused) {
        (Some((_, verdict)), _) if verdict.landed() && !vehicle.aborted() => Outcome::Landed,
        (Some(_), _) => Outcome::OutsideLimits,
        (None, Some(reason)) => Outcome::Refused(reason),
        (None, None) if vehicle.aborted() => Outcome::Aborted,
        (None, None) => {
            debug_assert!(
                stopped,
                "a flight that is over has a verdict, a refusal or an abort"
            );
            Outcome::Stopped
        }
    };
    Ok(FlightSummary {
        outcome,
        verdict,
        phase: vehicle.phase(),
        time_s: vehicle.time_s(),
        solve_times,
        tx_bytes: links.tx_bytes,
    })
}

/// Arms and starts once the checks pass.
struct AutoPilot {
    wanted: bool,
    refused: Option<String>,
}

impl AutoPilot {
    /// The first controller tick has run by then, or never will.
    const PATIENCE_S: f64 = 3.0;

    fn act(&mut self, vehicle: &mut Vehicle) {
        if !self.wanted || self.refused.is_some() || vehicle.phase() != Phase::PadIdle {
            return;
        }
        let refusal = arming::first_refusal(&vehicle.arming_checks());
        match refusal {
            Some(reason) if vehicle.time_s() > Self::PATIENCE_S => self.refused = Some(reason),
            Some(_) => {}
            None => {
                let answers = [vehicle.request(Request::Arm), vehicle.request(Request::Start)];
                self.refused = answers.into_iter().find_map(|answer| answer.reason);
                self.wanted = false;
            }
        }
    }
}

/// The wall clock's part: pacing and timing, and nothing that decides.
struct Pace {
    speed: Speed,
    frame: Duration,
    began: Instant,
    due: Instant,
    over_since: Option<Instant>,
}

impl Pace {
    /// After the flight the links are served this long, so that the verdict arrives.
    const LINGER: Duration = Duration::from_millis(1500);
    /// A machine that slept does not race to catch up.
    const MAX_LAG: Duration = Duration::from_millis(500);

    #[expect(clippy::disallowed_methods, reason = "the run loop owns the clock")]
    fn new(speed: Speed, frame_s: f64) -> Self {
        let now = Instant::now();
        Self {
            speed,
            frame: Duration::from_secs_f64(frame_s),
            began: now,
            due: now,
            over_since: None,
        }
    }

    fn clock(&self) -> Instant {
        self.began
    }

    #[expect(clippy::disallowed_methods, reason = "the run loop owns the clock")]
    fn has_lingered(&mut self, linked: bool) -> bool {
        let now = Instant::now();
        let since = *self.over_since.get_or_insert(now);
        !linked || now.duration_since(since) >= Self::LINGER
    }

    #[expect(clippy::disallowed_methods, reason = "the run loop owns the clock")]
    async fn wait(&mut self, real_time: bool) {
        let factor = match self.speed {
            Speed::Max if real_time => 1.0,
            Speed::Max => {
                tokio::task::yield_now().await;
                self.due = Instant::now();
                return;
            }
            Speed::Factor(factor) => factor,
        };
        self.due += self.frame.div_f64(factor);
        let now = Instant::now();
        if now > self.due + Self::MAX_LAG {
            self.due = now;
        }
        tokio::time::sleep_until(self.due.into()).await;
    }
}

/// The open links, their framing and their raw frames in the log.
struct Links {
    open: Vec<(Transport, Framer, String)>,
    recorder: Option<Recorder>,
    tx_bytes: u64,
}

impl Links {
    async fn open(endpoints: &[Endpoint], recorder: Option<Recorder>) -> Result<Self, FlyError> {
        let mut open = Vec::new();
        for endpoint in endpoints {
            let name = endpoint.to_string();
            let transport = Transport::open(endpoint.clone())
                .await
                .map_err(|source| FlyError::Link {
                    link: name.clone(),
                    source,
                })?;
            open.push((transport, Framer::new(), name));
        }
        Ok(Self {
            open,
            recorder,
            tx_bytes: 0,
        })
    }

    fn receive(&mut self, time_s: f64) -> Vec<protocol::frame::Frame> {
        let mut frames = Vec::new();
        for (transport, framer, name) in &mut self.open {
            while let Some(received) = transport.try_receive() {
                let datagram = matches!(received, Received::Datagram(_));
                match received {
                    Received::Datagram(bytes) | Received::Stream(bytes) => framer.push(&bytes),
                    Received::Up(peer) => {
                        note(self.recorder.as_ref(), time_s, &format!("link {name} up: {peer}"))
                    }
                    Received::Down(why) => note(
                        self.recorder.as_ref(),
                        time_s,
                        &format!("link {name} down: {why}"),
                    ),
                }
                while let Some(frame) = framer.next_frame() {
                    record_raw(
                        self.recorder.as_ref(),
                        Direction::Rx,
                        name,
                        frame.as_bytes(),
                        time_s,
                    );
                    frames.push(frame);
                }
                if datagram {
                    framer.end_of_datagram();
                }
            }
        }
        frames
    }

    fn send(&mut self, bytes: &[u8], time_s: f64) {
        for (transport, _, name) in &self.open {
            transport.sender().send(bytes.to_vec());
            self.tx_bytes += bytes.len() as u64;
            record_raw(self.recorder.as_ref(), Direction::Tx, name, bytes, time_s);
        }
    }
}

fn nanoseconds(time_s: f64) -> u64 {
    (1e9 * time_s) as u64
}

fn record_raw(recorder: Option<&Recorder>, direction: Direction, link: &str, bytes: &[u8], time_s: f64) {
    if let Some(recorder) = recorder {
        let frame = RawFrame {
            direction,
            endpoint: "vehicle",
            link: link.to_owned(),
            bytes: bytes.to_vec(),
        };
        recorder.record(Record::RawFrame(frame), nanoseconds(time_s));
    }
}

fn note(recorder: Option<&Recorder>, time_s: f64, words: &str) {
    if let Some(recorder) = recorder {
        let event = Event {
            level: EventLevel::Info,
            name: "vehicle".to_owned(),
            message: words.to_owned(),
        };
        recorder.record(Record::Event(event), nanoseconds(time_s));
    }
}

fn record(recorder: &Recorder, snapshot: &Snapshot, events: &[VehicleEvent]) {
    let time_ns = nanoseconds(snapshot.time_s);
    for event in events {
        let record = match event {
            VehicleEvent::Tick(tick) => Record::from(tick_log::tick_to_log(
                &tick.input,
                &tick.output,
                tick.state_digest,
                tick.solve_time_s,
                tick.deadline_s,
            )),
            VehicleEvent::Verdict { impact, verdict } => Record::LandingVerdict(Box::new(
                tick_log::verdict_to_log(impact.time_s, &impact.state, verdict),
            )),
            VehicleEvent::Text { severity, text } => Record::Event(Event {
                level: match severity {
                    Severity::Info | Severity::Notice => EventLevel::Info,
                    Severity::Warning => EventLevel::Warning,
                    Severity::Error => EventLevel::Error,
                    Severity::Critical => EventLevel::Fatal,
                },
                name: "vehicle".to_owned(),
                message: text.clone(),
            }),
            VehicleEvent::PhaseChanged { from, to } => Record::Event(Event {
                level: EventLevel::Info,
                name: "vehicle".to_owned(),
                message: format!("phase {} to {}", from.name(), to.name()),
            }),
        };
        recorder.record(record, time_ns);
        if matches!(event, VehicleEvent::PhaseChanged { .. }) {
            recorder.sync_soon();
        }
    }
    // The waiting vehicle does not move: once a second is enough to see that.
    let moving = !snapshot.phase.on_pad() && snapshot.phase != Phase::Safed;
    if moving || (snapshot.time_s.fract() < 0.015) {
        recorder.record(Record::PlantTruth(Box::new(truth(snapshot))), time_ns);
    }
}

fn truth(snapshot: &Snapshot) -> v1::PlantTruth {
    v1::PlantTruth {
        time_s: snapshot.time_s,
        phase: u32::from(snapshot.phase.index()),
        state: tick_log::state_to_log(&snapshot.state),
        gimbal_commanded_rad: snapshot.gimbal_rad.0,
        gimbal_actual_rad: snapshot.gimbal_rad.1,
        fin_commanded_rad: snapshot.fins_rad.0.to_vec(),
        fin_actual_rad: snapshot.fins_rad.1.to_vec(),
        thrust_n: snapshot.thrust_n,
        mass_kg: snapshot.mass_kg,
        in_contact: snapshot.in_contact,
    }
}

/// A flight without a log is the operator's choice, not a failed log.
fn log_state(recorder: Option<&Recorder>) -> LogState {
    let Some(recorder) = recorder else {
        return LogState {
            running: true,
            space_bytes: u64::MAX,
        };
    };
    let directory = recorder
        .path()
        .parent()
        .filter(|path| !path.as_os_str().is_empty());
    let space_bytes = fs4::available_space(directory.unwrap_or(Path::new("."))).unwrap_or(0);
    LogState {
        running: recorder.is_running() && recorder.dropped() == 0,
        space_bytes,
    }
}
