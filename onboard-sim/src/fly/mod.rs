//! The run loop: a craft, its clock, its links and its log.

mod autopilot;
mod boot;
mod links;
mod load;
mod pace;
mod radio;
mod recording;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use flight::mission::MissionError;
use flight::phase::Phase;
use flight::profile::ProfileError;
use protocol::key_file::KeyFileError;
use protocol::log::recorder::Recorder;
use protocol::transport::Endpoint;
use tokio::sync::watch;

use self::autopilot::AutoPilot;
pub use self::boot::OnTheWire;
use self::links::{Heard, Links};
pub use self::load::{LoadedFlight, LoadedProfile, builtins, load_planar, load_profile, log_header};
pub use self::pace::Lateness;
use self::pace::{Pace, Waiting};
pub(crate) use self::radio::Delayed;
use self::recording::{log_state, nanoseconds, note, record};
use crate::craft::{Craft, Judged};
use crate::endpoint::VehicleEndpoint;
use crate::solve_times::SolveTimes;
use crate::streams::Standard;
use crate::vehicle::{DeadlinePolicy, VehicleError, VehicleEvent};

/// How fast simulated time runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// This many times real time.
    Factor(f64),
    /// As fast as the machine can. On its pad with a crew a vehicle is never faster than real time, however fast it is to
    /// be: its uplink is judged by the age of what it heard.
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
    pub profile: LoadedFlight,
    /// MAVLink system id of the vehicle.
    pub system_id: u8,
    /// Links to serve; none is allowed.
    pub links: Vec<Endpoint>,
    /// The key that every frame is to be signed with; none is allowed.
    pub key_file: Option<PathBuf>,
    /// Log to write into.
    pub recorder: Option<Recorder>,
    /// What it is on the wire beside what it does.
    pub on_the_wire: OnTheWire,
    /// Seed of the dispersions.
    pub seed: u64,
    /// Speed of simulated time.
    pub speed: Speed,
    /// Arm and start without waiting for a ground station.
    pub auto_start: bool,
    /// End once the flight is over, SAFED or not; otherwise keep serving the links until told to stop. After an abort on
    /// the pad links are served in any case: the crew has to see the wait run down.
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
    #[error("no profile `{given}`: not a file, and the built-in ones are {}", load::builtin_names())]
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
    /// The mission is wrong.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The mission flies from apogee, where only a start at ignition will do.
    #[error(
        "{name} flies from apogee; this takes a profile that starts at ignition: {}",
        load::planar_names()
    )]
    FromApogee {
        /// The mission.
        name: String,
    },
    /// Late outputs are not dropped in flights from apogee.
    #[error("{name}: deadlines are enforced in profiles that start at ignition only")]
    DeadlinePolicy {
        /// The mission.
        name: String,
    },
    /// The flight from apogee cannot be set up.
    #[error(transparent)]
    Rocket(#[from] campaign::fly::FlyError),
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

/// How a flight ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// Inside every limit; from apogee: inside what the legs take.
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
    pub judged: Option<Judged>,
    /// The same by the landing paper's Table 2, where the former goes by what the legs take.
    pub judged_by_table_2: Option<Judged>,
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

/// Flies, reporting nothing but the summary. See [`fly_observed`].
///
/// # Errors
/// As [`fly_observed`].
pub async fn fly(options: FlyOptions, stop: watch::Receiver<bool>) -> Result<FlightSummary, FlyError> {
    Box::pin(fly_observed(options, stop, |_, _| ())).await
}

/// The vehicle's end of its links, as ordered.
fn endpoint_of(options: &FlyOptions, standard: &'static [Standard]) -> VehicleEndpoint {
    let endpoint = match options.key_file {
        Some(_) => VehicleEndpoint::sending_signed(standard),
        None => VehicleEndpoint::sending(standard),
    };
    let capacities_bytes_s: Vec<u32> =
        options.links.iter().map(|link| options.on_the_wire.capacity_bytes_s(link)).collect();
    let endpoint = endpoint
        .of_system(options.system_id)
        .booted(options.on_the_wire.boot_number.get())
        .over_links(&capacities_bytes_s);
    if options.auto_start { endpoint.starting_by_itself() } else { endpoint }
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
    let mut craft = options.profile.craft(options.seed, options.deadline_policy)?;
    let craft: &mut dyn Craft = craft.as_mut();
    craft.pull_pin();
    let mut links =
        Links::open(&options.links, options.key_file.as_deref(), options.recorder.clone()).await?;
    let mut endpoint = endpoint_of(&options, craft.standard());
    let crewed = !options.links.is_empty() && !options.auto_start;
    let (mut heard, mut sent) = (Delayed::default(), Delayed::default());
    let mut solve_times = SolveTimes::default();
    let mut pilot = AutoPilot { wanted: options.auto_start, refused: None };
    let mut pace = Pace::new(options.speed, craft.frame_s());
    let mut log_state_due_s = 0.0;
    let mut dropped = 0;

    let stopped = loop {
        if craft.time_s() >= log_state_due_s {
            craft.set_log_state(log_state(options.recorder.as_ref()));
            log_state_due_s += 1.0;
        }
        let arrived = links.receive(craft.time_s());
        for heard in heard.pass(arrived, craft.time_s(), craft.radio()) {
            match heard {
                Heard::Frame(link, frame) => endpoint.on_frame(link, &frame, craft),
                Heard::Rejected(frame, why) => endpoint.on_rejected(&frame, why),
            }
        }
        endpoint.watch_the_uplink(craft);
        pilot.act(craft);
        let stopwatch = pace.clock();
        let events = craft.advance_frame(&mut || stopwatch.elapsed());
        let time_s = craft.time_s();
        if let Some(clock) = &options.log_clock {
            clock.set(nanoseconds(time_s));
        }
        for event in &events {
            endpoint.on_event(event);
            observe(time_s, event);
            match event {
                VehicleEvent::Tick(tick) => solve_times.add(tick.solve_time_s, tick.deadline_s),
                VehicleEvent::Planned { took_s, deadline_s, .. } => solve_times.add(*took_s, *deadline_s),
                _ => {}
            }
        }
        if let Some(recorder) = &options.recorder {
            record(recorder, craft, &events);
        }
        let leaving = endpoint.poll(craft);
        for outgoing in sent.pass(leaving, time_s, craft.radio()) {
            links.send(&outgoing, time_s);
        }
        if links.dropped() > dropped {
            dropped = links.dropped();
            note(options.recorder.as_ref(), time_s, &format!("{dropped} frames found no room on their link"));
        }
        let over = craft.is_over() || pilot.refused.is_some();
        let aborted_on_the_pad = craft.phase().on_pad() && craft.aborted() && !options.links.is_empty();
        if over
            && !aborted_on_the_pad
            && options.exit_when_safed
            && pace.has_lingered(!options.links.is_empty())
        {
            break false;
        }
        let waiting = match () {
            () if over => Waiting::Over,
            () if crewed && craft.phase().on_pad() => Waiting::Crew,
            () => Waiting::Nobody,
        };
        tokio::select! {
            () = pace.wait(waiting) => {}
            changed = stop.changed() => {
                // A stop sender that is gone can ask for nothing any more; the flight ends with its owner.
                if changed.is_err() || *stop.borrow() { break true; }
            }
        }
    };
    links.close(craft.time_s());
    let outcome = match (craft.judged().map(|judged| judged.landed), pilot.refused) {
        // An abort stays an abort, however the vehicle came down; the verdict stands beside it.
        _ if craft.aborted() => Outcome::Aborted,
        (Some(true), _) => Outcome::Landed,
        (None, Some(reason)) => Outcome::Refused(reason),
        (None, None) if stopped => Outcome::Stopped,
        // Judged so, or given up: it never came down.
        (Some(false) | None, _) => Outcome::OutsideLimits,
    };
    Ok(FlightSummary {
        outcome,
        judged: craft.judged(),
        judged_by_table_2: craft.judged_by_table_2(),
        phase: craft.phase(),
        time_s: craft.time_s(),
        solve_times,
        lateness: pace.into_lateness(),
        tx_bytes: links.tx_bytes,
    })
}
