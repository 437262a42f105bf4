//! The run loop: a vehicle, its clock, its links and its log.

mod board;
mod links;
mod load;
mod pace;
mod recording;
mod saved_abort;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::recipe::RecipeError;
use avionics::board::stream::OnTheAir;
use flight::computer::FRAME_S;
use flight::computer::messages::Severity;
use flight::rules::phase::Phase;
pub use flight::vehicle::mission::StartPoint;
pub use flight::vehicles::mission::DEFAULT as DEFAULT_MISSION;
use protocol::crew_file::{CrewFile, CrewFileError, Mode};
use protocol::hub::LinkEvent;
use protocol::key_file::KeyFileError;
use protocol::log::recorder::Recorder;
use protocol::log::v1::LandingVerdict;
use protocol::transport::LinkAddress;
use tokio::sync::watch;

pub use self::board::{BoardError, OnBoard, OnTheWire};
pub(crate) use self::links::Delayed;
use self::links::{Links, operators_of, people_of};
use self::load::AutoStart;
pub use self::load::load_flight;
pub use self::pace::Lateness;
use self::pace::{Pace, Waiting};
use self::recording::{Offer, log_state, nanoseconds, note, record};
use self::saved_abort::SavedAbort;
use crate::wire::endpoint::{self, VehicleEndpoint, VehicleKind};
use crate::wire::solve_times::SolveTimes;
use crate::wire::vehicle::{Judged, RocketFlight, Vehicle, VehicleEvent};

/// How fast simulated time runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// This many times real time.
    Factor(f64),
    /// As fast as the machine can. On its pad with a crew a vehicle is never faster than real time,
    /// because it judges its uplink by the age of the last heartbeat.
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

/// The options of a flight.
pub struct FlyOptions {
    /// The flight.
    pub flight: RocketFlight,
    /// MAVLink system id of the vehicle.
    pub system_id: u8,
    /// Links to serve; may be empty.
    pub links: Vec<LinkAddress>,
    /// The key for signing every frame, if any.
    pub key_file: Option<PathBuf>,
    /// The people who may command, with a key.
    pub crew: Option<CrewFile>,
    /// Log to write into.
    pub recorder: Option<Recorder>,
    /// Its identity and budgets on the wire.
    pub on_the_wire: OnTheWire,
    /// Speed of simulated time.
    pub speed: Speed,
    /// Arm and start without waiting for a ground station.
    pub auto_start: bool,
    /// End once the flight is over, SAFED or not; otherwise serve the links until stopped. After an
    /// abort on the pad the links are always served: the crew must see the countdown of the waiting
    /// time.
    pub exit_when_safed: bool,
    /// Folder with the pipes of a board whose flight computer decides every frame, too, and
    /// receives the crew's commands by radio; then there are no links and no automatic start.
    pub board: Option<PathBuf>,
    /// Position of the pin, at each change; it is out at first.
    pub pin_out: Option<watch::Receiver<bool>>,
    /// Keeps an abort on the pad through a power cycle.
    pub abort_file: Option<PathBuf>,
    /// Receives the vehicle's time every frame, for other writers of the same log.
    pub log_clock: Option<LogClock>,
}

/// The vehicle's time in its log: one log has one clock, however fast the simulation runs.
#[derive(Debug, Clone, Default)]
pub struct LogClock(Arc<AtomicU64>);

impl LogClock {
    /// A clock at zero.
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
    /// No mission of that name.
    #[error("no mission `{given}`: not a file, and the built-in ones are {}", load::builtin_names())]
    NoMission {
        /// The requested name.
        given: String,
    },
    /// The mission's file cannot be read.
    #[error("cannot read the mission {path}")]
    ReadMission {
        path: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// The mission is wrong.
    #[error(transparent)]
    Recipe(#[from] RecipeError),
    /// The mission's field cannot be used.
    #[error(transparent)]
    Field(#[from] protocol::field::FieldError),
    /// The flight cannot be set up.
    #[error(transparent)]
    Rocket(#[from] crate::sortie::SetUpError),
    /// The key cannot be used.
    #[error(transparent)]
    Key(#[from] KeyFileError),
    /// The crew cannot be used.
    #[error(transparent)]
    Crew(#[from] CrewFileError),
    /// Operators' frames are checked by their keys, and the vehicle signs with the key that all
    /// share.
    #[error("a crew needs --key, the key that vehicle and stations share")]
    CrewWithoutKey,
    /// Two people cannot be replaced by a program.
    #[error("a two-person crew arms and starts by hand: without --auto, and with --mavlink")]
    CrewWithoutHands,
    /// The board failed, or decided differently.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// A link cannot be opened.
    #[error(transparent)]
    Link(#[from] protocol::links::OpenError),
}

/// How a flight ended.
#[derive(Debug, Clone, PartialEq)]
pub enum FlightEnd {
    /// It stands undamaged.
    Landed,
    /// It is on the ground, and does not.
    NotLanded,
    /// Aborted before or without a landing.
    Aborted,
    /// Arming or starting was refused.
    Refused(String),
    /// Stopped from outside before its end.
    Stopped,
}

/// Summary of a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct FlightSummary {
    pub outcome: FlightEnd,
    /// Contact and its verdict, if there was one.
    pub judged: Option<Judged>,
    /// The verdict as it is in the log: every limit, and how the flight ended. Its time counts from
    /// the release.
    pub verdict: Option<LandingVerdict>,
    /// Last phase.
    pub phase: Phase,
    /// Simulated time, s.
    pub time_s: f64,
    /// Plans and how long they took.
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

/// The vehicle's endpoint, set up from the options.
fn endpoint_of(options: &FlyOptions) -> VehicleEndpoint {
    let endpoint = match (&options.crew, &options.key_file) {
        (Some(_), _) => VehicleEndpoint::sending_to_crew(VehicleKind::Simulated),
        (None, Some(_)) => VehicleEndpoint::sending_signed(VehicleKind::Simulated),
        (None, None) => VehicleEndpoint::new(VehicleKind::Simulated),
    };
    let capacities_bytes_s: Vec<u32> =
        options.links.iter().map(|link| options.on_the_wire.capacity_bytes_s(link)).collect();
    let endpoint = endpoint
        .of_system(options.system_id)
        .booted(options.on_the_wire.boot_number.get())
        .with_uid(options.on_the_wire.uid.get())
        .over_links(&capacities_bytes_s);
    if options.auto_start { endpoint.starting_by_itself() } else { endpoint }
}

/// The vehicle, powered up, with its crew and with its pin out.
fn vehicle_of(options: &FlyOptions, was_aborted: bool) -> Result<Vehicle, FlyError> {
    let mut vehicle = options.flight.vehicle()?;
    if was_aborted {
        vehicle = vehicle.aborted_before(0.0);
    }
    if let Some(crew) = &options.crew {
        if options.key_file.is_none() {
            return Err(FlyError::CrewWithoutKey);
        }
        if options.auto_start && crew.mode == Mode::TwoPerson {
            return Err(FlyError::CrewWithoutHands);
        }
        let people = people_of(crew, options.on_the_wire.boot_number.get());
        vehicle = vehicle.with_crew(people, operators_of(crew));
    }
    // The crew pulls the pin by hand; the simulation does it when the program starts.
    vehicle.set_pin_out(true);
    Ok(vehicle)
}

fn receive(endpoint: &mut VehicleEndpoint, path: endpoint::Path, event: &LinkEvent, vehicle: &Vehicle) {
    match event {
        LinkEvent::Frame(frame) => endpoint.on_frame(path, frame, &vehicle.state()),
        LinkEvent::Copy(frame) => endpoint.on_copy(path, frame, &vehicle.state()),
        LinkEvent::Rejected(frame, why) => endpoint.on_rejected(frame, *why),
        _ => {}
    }
}

/// Moves the pin as requested; in flight, where it is out of reach, returns the reason why not.
fn move_pin(pin_out: Option<&mut watch::Receiver<bool>>, vehicle: &mut Vehicle) -> Option<String> {
    let pin_out = pin_out.filter(|pin| pin.has_changed().unwrap_or(false))?;
    let out = *pin_out.borrow_and_update();
    let on_the_ground =
        vehicle.phase().on_pad() || matches!(vehicle.phase(), Phase::Touchdown | Phase::Safed);
    if on_the_ground {
        vehicle.set_pin_out(out);
    }
    (!on_the_ground).then(|| "the pin was not moved: out of reach in flight".to_owned())
}

fn on_board(folder: &Path, options: &FlyOptions) -> Result<OnBoard, FlyError> {
    let recipe = &options.flight.recipe;
    let on_the_air = OnTheAir {
        mission: recipe.mission.name.clone(),
        system_id: u32::from(options.system_id),
        boot_number: options.on_the_wire.boot_number.get(),
        budget_bytes_s: options.on_the_wire.serial_bytes_s,
        uid: options.on_the_wire.uid.get().into(),
    };
    Ok(OnBoard::open(folder, &recipe.mission_toml, on_the_air)?)
}

/// How a flight has ended.
fn outcome_of(vehicle: &Vehicle, refused: Option<String>, stopped: bool) -> FlightEnd {
    match (vehicle.judged().map(|judged| judged.landing.stands), refused) {
        // An abort stays an abort, whatever the landing; the verdict is reported separately.
        _ if vehicle.aborted() => FlightEnd::Aborted,
        (Some(true), _) => FlightEnd::Landed,
        (None, Some(reason)) => FlightEnd::Refused(reason),
        (None, None) if stopped => FlightEnd::Stopped,
        // It is damaged, or the vehicle never landed.
        (Some(false) | None, _) => FlightEnd::NotLanded,
    }
}

/// Flies; `observe` is called with the simulated time and each thing the vehicle reports.
///
/// The outcome depends only on the flight, an abort before it, and the inputs on the links and at
/// the pin, not on the speed, the machine or the clock.
///
/// # Errors
/// The flight cannot be simulated, or a link cannot be opened.
pub async fn fly_observed(
    mut options: FlyOptions,
    mut stop: watch::Receiver<bool>,
    mut observe: impl FnMut(f64, &VehicleEvent) + Send,
) -> Result<FlightSummary, FlyError> {
    let (mut saved_abort, was_aborted) = SavedAbort::open(options.abort_file.take());
    let mut vehicle = vehicle_of(&options, was_aborted)?;
    let mut links = Links::open(
        &options.links,
        options.key_file.as_deref(),
        options.crew.as_ref(),
        options.recorder.clone(),
    )
    .await?;
    let mut endpoint = endpoint_of(&options);
    let mut on_board = options.board.as_deref().map(|folder| on_board(folder, &options)).transpose()?;
    // A crew may be received here, or on the board's radio.
    let served = !options.links.is_empty() || on_board.is_some();
    let crewed = served && !options.auto_start;
    let (mut uplink_radio, mut sent) = (Delayed::default(), Delayed::default());
    let mut solve_times = SolveTimes::default();
    let mut starter = AutoStart { wanted: options.auto_start, refused: None, requested: false, held: None };
    let mut pace = Pace::new(options.speed, FRAME_S);
    let mut log_state_due_s = 0.0;
    let (mut dropped, mut offer) = (0, Offer::default());

    let stopped = loop {
        if vehicle.time_s() >= log_state_due_s {
            vehicle.set_log_state(log_state(options.recorder.as_ref()));
            log_state_due_s += 1.0;
        }
        let warnings = [move_pin(options.pin_out.as_mut(), &mut vehicle), saved_abort.save(&vehicle)];
        for text in warnings.into_iter().flatten() {
            observe(vehicle.time_s(), &VehicleEvent::text(Severity::Warning, &text));
        }
        let arrived = links.receive(vehicle.time_s());
        for text in links.down.drain(..) {
            observe(vehicle.time_s(), &VehicleEvent::text(Severity::Warning, &text));
        }
        for (path, event) in uplink_radio.pass(arrived, vehicle.time_s(), vehicle.radio()) {
            receive(&mut endpoint, path, &event, &vehicle);
        }
        let requests = starter.requests(&vehicle);
        let (events, answers) = match &mut on_board {
            Some(on_board) => (on_board.step(&mut vehicle)?, Vec::new()),
            None => endpoint::step(&mut endpoint, &mut vehicle, &requests),
        };
        starter.on_answers(&answers);
        let time_s = vehicle.time_s();
        if let Some(clock) = &options.log_clock {
            clock.set(nanoseconds(time_s));
        }
        for event in &events {
            observe(time_s, event);
            if let VehicleEvent::Planned(timing) = event {
                solve_times.add(timing.solve_time_s, timing.deadline_s);
            }
        }
        if let Some(recorder) = &options.recorder {
            record(recorder, &vehicle, &events);
            offer.step(recorder, &vehicle, &mut endpoint);
        }
        let leaving = endpoint.poll(&vehicle.state());
        for outgoing in sent.pass(leaving, time_s, vehicle.radio()) {
            links.send(&outgoing, time_s);
        }
        links.send_what_waits(time_s);
        if links.dropped() > dropped {
            dropped = links.dropped();
            note(options.recorder.as_ref(), time_s, &format!("{dropped} frames found no room on their link"));
        }
        let over = vehicle.is_over() || starter.refused.is_some();
        let aborted_on_the_pad = vehicle.phase().on_pad() && vehicle.aborted() && served;
        if over && !aborted_on_the_pad && options.exit_when_safed && pace.has_lingered(served) {
            break false;
        }
        let waiting = if over {
            Waiting::Over
        } else if crewed && vehicle.phase().on_pad() {
            Waiting::Crew
        } else {
            Waiting::Nobody
        };
        tokio::select! {
            () = pace.wait(waiting) => {}
            changed = stop.changed() => {
                // If the sender of the stop signal is dropped, the flight ends.
                if changed.is_err() || *stop.borrow() { break true; }
            }
        }
    };
    links.close(vehicle.time_s());
    if let Some(reason) = &starter.refused {
        note(options.recorder.as_ref(), vehicle.time_s(), &format!("REFUSED: {reason}"));
    }
    let outcome = outcome_of(&vehicle, starter.refused, stopped);
    Ok(FlightSummary {
        outcome,
        judged: vehicle.judged(),
        verdict: vehicle.verdict_record(),
        phase: vehicle.phase(),
        time_s: vehicle.time_s(),
        solve_times,
        lateness: pace.lateness,
        tx_bytes: links.tx_bytes,
    })
}
