//! The run loop: a vehicle, its clock, its links and its log.

mod autopilot;
mod links;
mod pace;
mod recording;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use flight::phase::Phase;
use flight::profile::{BUILTIN, Profile, ProfileError};
use flight::verdict::LandingVerdict;
use protocol::key_file::KeyFileError;
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;
use protocol::transport::Endpoint;
use tokio::sync::watch;

use self::autopilot::AutoPilot;
use self::links::{Heard, Links};
pub use self::pace::Lateness;
use self::pace::Pace;
use self::recording::{log_state, nanoseconds, note, record};
use crate::endpoint::VehicleEndpoint;
use crate::plant::Impact;
use crate::scatter::draw;
use crate::solve_times::SolveTimes;
use crate::vehicle::{DeadlinePolicy, Vehicle, VehicleError, VehicleEvent};

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
            _ => Err(format!("speed `{given}`: must be `max` or a factor from 0.01 to 1000")),
        }
    }
}

/// What to fly.
pub struct FlyOptions {
    /// What flies.
    pub profile: LoadedProfile,
    /// Links to serve; none is allowed.
    pub links: Vec<Endpoint>,
    /// The key that every frame is to be signed with; none is allowed.
    pub key_file: Option<PathBuf>,
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
    /// Told the vehicle's time every frame, for others who write into the same log.
    pub log_clock: Option<LogClock>,
}

/// The vehicle's time as its log counts it: one log has one clock, however fast the simulation runs.
#[derive(Debug, Clone, Default)]
pub struct LogClock(Arc<AtomicU64>);

impl LogClock {
    /// A clock at nought.
    pub fn new() -> Self {
        Self::default()
    }

    /// Time since the vehicle's power-up, ns.
    pub fn now_ns(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    fn set(&self, time_ns: u64) {
        self.0.store(time_ns, Ordering::Relaxed);
    }
}

/// Why a flight could not be run.
#[derive(Debug, thiserror::Error)]
pub enum FlyError {
    /// No such profile.
    #[error("no profile `{given}`: not a file, and the built-in ones are {}", builtin_names())]
    NoProfile {
        /// What was asked for.
        given: String,
    },
    /// The profile's file cannot be read.
    #[error("cannot read the profile {path}")]
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
    /// The key is not used.
    #[error(transparent)]
    Key(#[from] KeyFileError),
    /// A link cannot be opened.
    #[error("cannot open the link {link}")]
    Link {
        /// The link.
        link: String,
        /// What the system said.
        source: std::io::Error,
    },
}

fn builtin_names() -> String {
    BUILTIN.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
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
    /// How late frames began.
    pub lateness: Lateness,
    /// Bytes sent on every link.
    pub tx_bytes: u64,
}

/// A profile and the text it was read from. The log's header and the flight both come from one reading.
#[derive(Debug, Clone)]
pub struct LoadedProfile {
    /// The profile.
    pub profile: Profile,
    /// Its text, for the log.
    pub toml: String,
}

/// Reads a profile by built-in name or path.
///
/// # Errors
/// There is no such profile, or it is wrong: the message names the key.
pub fn load_profile(name_or_path: &str) -> Result<LoadedProfile, FlyError> {
    let toml = match Profile::builtin_toml(name_or_path) {
        Some(text) => text.to_owned(),
        None if !Path::new(name_or_path).exists() => {
            return Err(FlyError::NoProfile { given: name_or_path.to_owned() });
        }
        None => std::fs::read_to_string(name_or_path)
            .map_err(|source| FlyError::ReadProfile { path: name_or_path.to_owned(), source })?,
    };
    Ok(LoadedProfile { profile: Profile::from_toml(&toml, name_or_path)?, toml })
}

/// The header of a flight's log.
pub fn log_header(writer: &str, loaded: &LoadedProfile, seed: u64, start_unix_ns: u64) -> LogHeader {
    let run = BTreeMap::from([
        ("profile".to_owned(), loaded.profile.name.clone()),
        ("seed".to_owned(), seed.to_string()),
        ("start_unix_ns".to_owned(), start_unix_ns.to_string()),
    ]);
    LogHeader {
        writer: writer.to_owned(),
        start_unix_ns,
        run,
        profile_toml: Some(loaded.toml.clone()),
        scenario_toml: None,
    }
}

/// Flies, reporting nothing but the summary. See [`fly_observed`].
///
/// # Errors
/// As [`fly_observed`].
pub async fn fly(options: FlyOptions, stop: watch::Receiver<bool>) -> Result<FlightSummary, FlyError> {
    Box::pin(fly_observed(options, stop, |_, _| ())).await
}

/// Flies; `observe` is called with the simulated time and each thing the vehicle reports.
///
/// The outcome depends only on profile, seed and what arrives on the links: not on the speed, the machine or
/// the clock (unless deadlines are enforced, which makes it the machine's business).
///
/// # Errors
/// The profile cannot be simulated, or a link cannot be opened.
pub async fn fly_observed(
    options: FlyOptions,
    mut stop: watch::Receiver<bool>,
    mut observe: impl FnMut(f64, &VehicleEvent) + Send,
) -> Result<FlightSummary, FlyError> {
    let profile = &options.profile.profile;
    let mut vehicle = Vehicle::new(profile, draw(profile, options.seed), options.deadline_policy)?;
    vehicle.pull_pin();
    let mut links =
        Links::open(&options.links, options.key_file.as_deref(), options.recorder.clone()).await?;
    let mut endpoint =
        if options.key_file.is_some() { VehicleEndpoint::signed() } else { VehicleEndpoint::new() };
    let mut solve_times = SolveTimes::default();
    let mut pilot = AutoPilot { wanted: options.auto_start, refused: None };
    let mut pace = Pace::new(options.speed, vehicle.frame_s());
    let mut log_state_due_s = 0.0;
    let mut dropped = 0;

    let stopped = loop {
        if vehicle.time_s() >= log_state_due_s {
            vehicle.set_log_state(log_state(options.recorder.as_ref()));
            log_state_due_s += 1.0;
        }
        for heard in links.receive(vehicle.time_s()) {
            match heard {
                Heard::Frame(frame) => endpoint.on_frame(&frame, &mut vehicle),
                Heard::Rejected(frame, why) => endpoint.on_rejected(&frame, why),
            }
        }
        pilot.act(&mut vehicle);
        let stopwatch = pace.clock();
        let events = vehicle.advance_frame(&mut || stopwatch.elapsed());
        let time_s = vehicle.time_s();
        if let Some(clock) = &options.log_clock {
            clock.set(nanoseconds(time_s));
        }
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
        for frame in endpoint.poll(&vehicle, &snapshot) {
            links.send(&frame, time_s);
        }
        if links.dropped() > dropped {
            dropped = links.dropped();
            note(options.recorder.as_ref(), time_s, &format!("{dropped} frames found no room on their link"));
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
    links.close(vehicle.time_s());
    let verdict = vehicle.verdict().copied();
    let outcome = match (&verdict, pilot.refused) {
        // An abort stays an abort, however the vehicle came down; the verdict stands beside it.
        _ if vehicle.aborted() => Outcome::Aborted,
        (Some((_, verdict)), _) if verdict.landed() => Outcome::Landed,
        (Some(_), _) => Outcome::OutsideLimits,
        (None, Some(reason)) => Outcome::Refused(reason),
        (None, None) => {
            debug_assert!(stopped, "a flight that is over has a verdict, a refusal or an abort");
            Outcome::Stopped
        }
    };
    Ok(FlightSummary {
        outcome,
        verdict,
        phase: vehicle.phase(),
        time_s: vehicle.time_s(),
        solve_times,
        lateness: pace.into_lateness(),
        tx_bytes: links.tx_bytes,
    })
}
