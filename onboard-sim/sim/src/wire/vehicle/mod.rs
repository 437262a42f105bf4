//! The simulated vehicle as the crew sees it: a flight that is stepped frame by frame, and the
//! events it reports.
//!
//! This module has the interface that the run loop uses; the radio takes a [`VehicleState`], and
//! the log takes records.
//!
//! It is pure: time is simulated.

mod ground;

use crate::outside::Outside;
use crate::recipe::Recipe;
use crate::sortie::{Radio, SetUpError, Sortie};
use crate::wire::record::LastFrame;
pub use avionics::link::vehicle::{BatteryFacts, Judged, MissionName, VehicleState};
use flight::computer::crew::{Answers, People, Request};
use flight::computer::findings::Findings;
use flight::computer::messages::{CrewMessage, Severity};
use flight::computer::pilot::planner::PLAN_WITHIN_S;
use flight::computer::{Commander, Computer, LogState, SensedInput};
use flight::rules::arming::{Checks, Uplink};
use flight::rules::operator::Operator;
use flight::rules::phase::{Mode, Phase};
use flight::text::text;
use flight::vehicle::mission::StartPoint;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::flight_v1::PilotTiming;
use protocol::log::record::Record;
use protocol::log::v1;

use self::ground::GroundWatch;

/// A flight, by recipe and number.
#[derive(Debug, Clone)]
pub struct RocketFlight {
    pub recipe: Recipe,
    pub number: u64,
}

/// One vehicle, one flight.
#[derive(Clone)]
pub struct Vehicle {
    sortie: Sortie,
    findings: Findings,
    /// A frame of the flight computer was flown in the air just now.
    flown: bool,
    /// External inputs of the next frame, except its requests.
    outside: Outside<'static>,
    operators: Vec<Operator>,
    mission: MissionName,
    ground: GroundWatch,
    /// Input and output of the flight computer in the last frame; `None` if it was dead.
    computer_frame: Option<Box<ComputerFrame>>,
    /// How many frames the flight computer has decided.
    frames_decided: u64,
    last: LastFrame,
}

/// The result of one frame.
#[derive(Debug, Clone, Default)]
pub struct VehicleStep {
    /// Events, in order.
    pub events: Vec<VehicleEvent>,
    /// An answer to each request, in order; none while the flight computer is dead.
    pub answers: Answers,
}

impl Vehicle {
    /// A vehicle powered up on its pad.
    ///
    /// # Errors
    /// The flight cannot be set up.
    pub fn on_the_pad(flight: &RocketFlight) -> Result<Self, SetUpError> {
        Ok(Self {
            sortie: Sortie::on_the_pad(&flight.recipe, flight.number)?,
            findings: Findings::default(),
            flown: false,
            outside: Outside { pin_out: false, log: LogState::default(), ..Outside::NOBODY },
            operators: Vec::new(),
            mission: MissionName::default(),
            ground: GroundWatch::default(),
            computer_frame: None,
            frames_decided: 0,
            last: LastFrame::default(),
        })
    }

    /// Moves the pin that a crew moves by hand.
    pub fn set_pin_out(&mut self, pin_out: bool) {
        self.outside.pin_out = pin_out;
    }

    /// Sets the state of the vehicle's log.
    pub fn set_log_state(&mut self, log: LogState) {
        self.outside.log = log;
    }

    /// Sets the quality of the vehicle's uplink, and the station that armed it, if one did.
    pub fn set_uplink(&mut self, uplink: Uplink, commander: Option<Commander>) {
        (self.outside.uplink, self.outside.commander) = (uplink, commander);
    }

    /// Sets who may command, from power-up on.
    #[must_use]
    pub fn with_crew(self, people: People, operators: Vec<Operator>) -> Self {
        let outside = Outside { people: Some(people), ..self.outside };
        Self { outside, operators, ..self }
    }

    /// Sets the time of an abort on the pad before this power-up, vehicle time, s: at most zero.
    #[must_use]
    pub fn aborted_before(self, at_s: f64) -> Self {
        Self { sortie: self.sortie.aborted_before(at_s), ..self }
    }

    /// Which mission it flies.
    pub fn mission(&self) -> &MissionName {
        &self.mission
    }

    /// Sets the name and the text of the mission that it flies.
    #[must_use]
    pub fn of_mission(self, name: &str, text: &str) -> Self {
        let mission = MissionName::of(name, text, self.sortie.mission());
        Self { mission, ..self }
    }

    /// Advances by one frame, in which these requests are decided.
    pub fn step(&mut self, requests: &[Request]) -> VehicleStep {
        let outside = Outside { requests, ..self.outside };
        let output = self.sortie.step_with(&outside, &mut self.last);
        self.computer_frame = self.last.take();
        self.frames_decided += u64::from(self.computer_frame.is_some());
        let mut events = Vec::new();
        let (mut released, mut answers) = (false, Answers::new());
        if let Some(output) = output {
            events.extend(output.messages.into_iter().map(VehicleEvent::Message));
            if output.planned {
                events.extend(self.planned());
            }
            (released, answers) = (output.released, output.answers);
        }
        let flying = self.computer().released_at_s().is_some();
        self.flown = flying && !released && !self.computer().is_over() && !self.is_over();
        self.findings.note(self.sortie.computer());
        events.extend(self.events_of_the_simulation(released));
        VehicleStep { events, answers }
    }

    /// The event for a frame in which the pilot took over a plan.
    fn planned(&self) -> Option<VehicleEvent> {
        let SensedInput { frame, time_s, .. } = self.computer().flown()?;
        let solve_time_s = self.computer().pilot().report().took_s;
        Some(VehicleEvent::Planned(PilotTiming { frame, time_s, solve_time_s, deadline_s: PLAN_WITHIN_S }))
    }

    /// Events available only in the simulation: the start of the flight, ground contact, the
    /// verdict.
    fn events_of_the_simulation(&mut self, released: bool) -> Vec<VehicleEvent> {
        if !released {
            return self.ground.watch(&self.sortie);
        }
        if self.sortie.mission().start.at != StartPoint::Apogee {
            return Vec::new();
        }
        let height_m = self.sortie.world().height_m();
        let text = format!("the simulation goes on at apogee, {height_m:.0} m up; no ascent is flown");
        vec![VehicleEvent::text(Severity::Notice, &text)]
    }

    /// Its flight computer.
    pub fn computer(&self) -> &Computer {
        self.sortie.computer()
    }

    /// Simulated time since power-up, s.
    pub fn time_s(&self) -> f64 {
        flight::computer::flight_time_s(self.sortie.frame())
    }

    /// The state now, as the radio sends it.
    pub fn state(&self) -> VehicleState<'_> {
        let (sortie, battery) = (&self.sortie, self.sortie.battery());
        VehicleState {
            computer: self.computer(),
            time_s: self.time_s(),
            name: &self.mission,
            operators: &self.operators,
            findings: &self.findings,
            battery: Some(BatteryFacts {
                volts: battery.volts(),
                servo_volts: Some(battery.servo_volts()),
                current_a: Some(battery.current_a()),
                left: Some(battery.charge()),
            }),
            rehearsed: sortie.rehearsed().map(|(_, report)| report),
            parachute_ejected: sortie.world().parachute_ejected_s().is_some(),
            judged: self.judged(),
        }
    }

    /// Phase, latches and countdown.
    pub fn mode(&self) -> &Mode {
        self.computer().mode()
    }

    pub fn phase(&self) -> Phase {
        self.mode().phase
    }

    /// Whether an abort has been accepted.
    pub fn aborted(&self) -> bool {
        self.mode().interlocks.abort_latched
    }

    /// Whether the flight is over: the vehicle lies on the ground and is judged, or was aborted on
    /// the pad.
    pub fn is_over(&self) -> bool {
        self.ground.is_over(self.computer())
    }

    /// The arming checks with the present values.
    pub fn arming_checks(&self) -> Checks {
        self.computer().arming_checks()
    }

    /// The touchdown, once the landing is judged.
    pub fn judged(&self) -> Option<Judged> {
        self.ground.judged()
    }

    /// The simulated radio: its silence and its delay.
    pub fn radio(&self) -> Radio {
        let radio = *self.sortie.radio();
        Radio { silent: radio.silent || self.sortie.computer_is_dead(), ..radio }
    }
}

// The events that a vehicle reports.

/// An event that a vehicle reports.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "nearly all are messages")]
pub enum VehicleEvent {
    Message(CrewMessage),
    /// The pilot took over a plan in this frame.
    Planned(PilotTiming),
    /// The vehicle touched down and its landing was judged.
    Verdict,
}

impl VehicleEvent {
    pub(crate) fn text(severity: Severity, text: &str) -> Self {
        Self::Message(CrewMessage::Text { severity, text: text!("{text}") })
    }
}

// Records of a flight in its log besides its events.

impl Vehicle {
    /// The last frame of the flight computer, and its start records: before its first frame and
    /// after its release. They precede all others, so that a flight begins with the power-up of its
    /// computer.
    pub fn computer_records(&self) -> Vec<Record> {
        let Some(frame) = &self.computer_frame else { return Vec::new() };
        let started = || Record::ComputerStart(Box::new(crate::wire::record::start(self.computer())));
        let powered_up = (self.frames_decided == 1).then(started);
        let released = frame.output.released.then(started);
        powered_up.into_iter().chain([Record::ComputerFrame(frame.clone())]).chain(released).collect()
    }

    /// The other records of the last frame: in flight the estimate, and the truth.
    pub fn records(&self) -> Vec<Record> {
        if self.flown { crate::wire::record::estimate_and_truth(&self.sortie) } else { Vec::new() }
    }

    /// The landing as a log's record, once it is judged. Its time counts from the release, as that
    /// of the frames.
    pub fn verdict_record(&self) -> Option<v1::LandingVerdict> {
        self.judged()?;
        crate::wire::record::verdict(&self.sortie)
    }
}

#[cfg(test)]
mod tests;
