//! The vehicle as its telemetry shows it. Every value carries the time at which it was received.

use std::collections::BTreeMap;
use std::time::Duration;

use mavlink::{MavlinkVersion, Message as _, MessageData};
use protocol::dialect::{
    HEARTBEAT_DATA, MavMessage, TD_DESCENT_DATA, TD_FINDING_DATA, TD_FLIGHT_STATUS_DATA,
    TD_TOUCHDOWN_LIMITS_DATA, TdChute, TdInterlock, TdLanding, TdPhase, TdRole,
};
use protocol::mission::MissionHash;
use protocol::motion::Degrees;
use protocol::reported::ReportedState;

use super::{
    Attitude, BodySpeed, Boot, Deflection, KeepAway, Motion, NorthEastUp, PadCheck, ReportedChecks,
    ReportedEvents, Touchdown, Trend,
};

/// A value older than this is marked as stale.
pub const STALE_AFTER: Duration = Duration::from_millis(1_500);

/// A value and when it was received.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<T> {
    pub value: T,
    /// Time of reception, since the start of the run.
    pub received_at: Duration,
}

impl<T> Sample<T> {
    pub fn new(value: T, now: Duration) -> Self {
        Self { value, received_at: now }
    }

    /// Converts the value; its time stays.
    pub fn map<U>(self, read: impl FnOnce(&T) -> U) -> Sample<U> {
        Sample { value: read(&self.value), received_at: self.received_at }
    }

    /// Time since it was received.
    pub fn age(&self, now: Duration) -> Duration {
        now.saturating_sub(self.received_at)
    }

    /// Whether it is too old to count as current.
    pub fn is_stale(&self, now: Duration) -> bool {
        self.age(now) > STALE_AFTER
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heartbeat {
    /// Whether the vehicle reports that it is armed: the only source for it.
    pub armed: bool,
    /// The phase, unless its number is unknown.
    pub phase: Option<TdPhase>,
    /// `MAV_STATE_FLIGHT_TERMINATION`.
    pub terminated: bool,
}

/// Gimbal in both planes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gimbal {
    pub pitch: Deflection,
    pub yaw: Deflection,
}

/// The predicted end of the controller's plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Time from the report to the touchdown.
    pub time_to_go_s: f64,
    /// The predicted state at touchdown.
    pub touchdown: Touchdown,
}

/// The vehicle's battery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    pub volts: f64,
    /// Remaining charge, percent; `None` if the vehicle does not estimate it.
    pub percent: Option<u8>,
}

/// `TD_MISSION`: the mission that it flies, and where the flight begins if it reports that.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FlownMission {
    pub hash: MissionHash,
    pub name: String,
    pub start: Option<&'static str>,
    /// Burns of the landing motor's lot that confirm the curve which the mission expects.
    pub motor_burns: u8,
}

impl FlownMission {
    /// As in `mk2 from pad`.
    pub fn in_words(&self) -> String {
        let start = self.start.map_or_else(String::new, |start| format!(" from {start}"));
        format!("{}{start}", self.name)
    }
}

/// The vehicle's own verdict on its landing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    pub landing: TdLanding,
    /// The state at contact.
    pub touchdown: Touchdown,
}

/// The last value of everything that the vehicle reports.
#[derive(Debug, Clone, Default)]
pub struct Vehicle {
    /// The payload of the last message of each id, for [`Vehicle::last`].
    pub(super) payloads: BTreeMap<u32, Sample<Vec<u8>>>,
    pub heartbeat: Option<Sample<Heartbeat>>,
    pub status: Option<Sample<TD_FLIGHT_STATUS_DATA>>,
    /// Its texts about its arming checks.
    pub(super) checks: ReportedChecks,
    pub attitude: Option<Sample<Attitude>>,
    pub motion: Option<Sample<Motion>>,
    /// The state for the log's record.
    pub reported: ReportedState,
    /// `GLOBAL_POSITION_INT`: height above the pad and climb, for a vehicle that sends no local
    /// position.
    pub hud: Option<Sample<Motion>>,
    /// Where its pad is on the Earth: by `HOME_POSITION`, before that by its two positions.
    pub pad: Option<Degrees>,
    pub prediction: Option<Sample<Prediction>>,
    /// `TD_PREDICTED_PATH`: x and altitude, m.
    pub path: Option<Sample<Vec<(f64, f64)>>>,
    /// `TD_OPERATOR`: role and name, by the number of the key.
    pub operators: BTreeMap<u8, (TdRole, String)>,
    /// `TD_PAD_CHECK`: the last check on the pad.
    pub pad_check: Option<PadCheck>,
    pub events: ReportedEvents,
    /// `TD_FINDING`: what went wrong in its flight, as the vehicle reports it.
    pub findings: Findings,
    /// The recent change of its velocity.
    pub trend: Trend,
    /// The path it flew: positions north, east and up from the pad, m, oldest first.
    pub flown: Vec<NorthEastUp>,
    /// Its flight computer was reset in this flight.
    pub reset_in_flight: bool,
    pub left_pad_at: Option<Duration>,
    /// The present boot of the vehicle.
    pub boot: Boot,
    /// The warning before a power cycle, and its time: a waiting time runs on through a boot.
    pub(crate) before: Option<Sample<KeepAway>>,
    /// The heartbeat of a vehicle with another autopilot under this id.
    pub foreign: Option<Sample<HEARTBEAT_DATA>>,
}

/// What went wrong in the flight, as far as the vehicle's reports have arrived.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Findings {
    /// Number of findings; `None` if not reported. Without findings the vehicle reports 0 after the
    /// flight.
    pub count: Option<u8>,
    /// When each began, s since the release, and a short sentence, by its place.
    arrived: BTreeMap<u8, (f64, String)>,
}

impl Findings {
    /// Takes a message with its text as it can be shown.
    pub(super) fn take(&mut self, message: &TD_FINDING_DATA, words: String) {
        self.count = Some(message.found);
        if message.place < message.found {
            self.arrived.insert(message.place, (f64::from(message.since_s), words));
        }
    }

    /// Those that have arrived, first in time: T+ in seconds and a short sentence.
    pub fn in_time(&self) -> Vec<(f64, &str)> {
        let mut all: Vec<_> = self.arrived.values().map(|(at_s, words)| (*at_s, words.as_str())).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    }
}

impl Vehicle {
    /// The last message of this type. What is converted or put together from several is a field
    /// above.
    pub fn last<M: MessageData>(&self) -> Option<Sample<M>> {
        let payload = self.payloads.get(&M::ID)?;
        let message = M::deser(MavlinkVersion::V2, &payload.value).ok()?;
        Some(Sample::new(message, payload.received_at))
    }

    /// The planned ignition and the estimates that steer the descent.
    pub fn descent(&self) -> Option<Sample<TD_DESCENT_DATA>> {
        self.last()
    }

    /// The design envelope of its legs, and how far its gimbal goes.
    pub fn limits(&self) -> Option<TD_TOUCHDOWN_LIMITS_DATA> {
        self.last().map(|limits| limits.value)
    }

    pub(super) fn store(&mut self, message: &MavMessage, now: Duration) {
        // SYS_STATUS has the flight computer's battery.
        if matches!(message, MavMessage::BATTERY_STATUS(data) if data.id == 0) {
            return;
        }
        let mut payload = [0; 255];
        let len = message.ser(MavlinkVersion::V2, &mut payload);
        self.payloads.insert(message.message_id(), Sample::new(payload[..len].to_vec(), now));
    }

    /// The phase, from the newer of its two sources.
    pub fn phase(&self) -> Option<Sample<TdPhase>> {
        let status = self.status.as_ref().map(|status| Sample::new(status.value.phase, status.received_at));
        let heartbeat = self.heartbeat.and_then(|heartbeat| {
            heartbeat.value.phase.map(|phase| Sample::new(phase, heartbeat.received_at))
        });
        better(status, heartbeat, Duration::ZERO)
    }

    /// The phase without its age.
    pub fn phase_now(&self) -> Option<TdPhase> {
        self.phase().map(|phase| phase.value)
    }

    /// Whether it reports that it is armed; false before its first heartbeat.
    pub fn is_armed(&self) -> bool {
        self.armed().is_some_and(|armed| armed.value)
    }

    /// Whether it is armed, from its heartbeat; `None` before the first.
    pub fn armed(&self) -> Option<Sample<bool>> {
        self.heartbeat.map(|heartbeat| Sample::new(heartbeat.value.armed, heartbeat.received_at))
    }

    /// The vehicle, if it is none of ours: it has another autopilot, and has sent no flight status.
    pub fn as_foreign(&self) -> Option<&Sample<HEARTBEAT_DATA>> {
        self.foreign.as_ref().filter(|_| self.status.is_none())
    }

    pub fn interlocks(&self) -> Option<TdInterlock> {
        self.status.as_ref().map(|status| status.value.interlocks)
    }

    /// Whether its last status says this; false before the first.
    pub fn reports(&self, says: impl FnOnce(&TD_FLIGHT_STATUS_DATA) -> bool) -> bool {
        self.status.as_ref().is_some_and(|status| says(&status.value))
    }

    /// Whether it reports this interlock.
    pub fn shows(&self, interlock: TdInterlock) -> bool {
        self.reports(|status| status.interlocks.contains(interlock))
    }

    /// Whether the landing motor can still ignite: no latch forbids it. Unknown counts as no.
    pub fn may_light(&self) -> bool {
        let never = TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED
            | TdInterlock::TD_INTERLOCK_ABORT_LATCHED
            | TdInterlock::TD_INTERLOCK_NO_LIGHT;
        let chute = self.phase_now() == Some(TdPhase::TD_PHASE_CHUTE);
        !chute && self.interlocks().is_some_and(|locks| !locks.intersects(never))
    }

    /// Whether it has lifted off: a motor may fail to ignite on command.
    pub fn has_lifted(&self) -> bool {
        let is_boosting = self.phase_now() == Some(TdPhase::TD_PHASE_BOOST);
        self.left_pad_at.is_some() && (!is_boosting || self.events.of(TdPhase::TD_PHASE_BOOST).is_some())
    }

    /// Whether it has left the pad and is not yet at rest.
    pub fn in_flight(&self) -> bool {
        self.phase_now().is_some_and(is_flight)
    }

    /// Whether a countdown runs to a release that has not come.
    pub fn counts_down(&self) -> bool {
        self.countdown_s().is_some_and(|left| left.value > 0.0)
    }

    /// Time to release, s (negative after it), if a countdown is reported.
    pub fn countdown_s(&self) -> Option<Sample<f64>> {
        let status = self.status.as_ref()?;
        let known = status.value.countdown_ms != i32::MAX;
        known.then(|| Sample::new(f64::from(status.value.countdown_ms) / 1_000.0, status.received_at))
    }

    /// The time before the release, s, from which on no key and no silence holds the countdown;
    /// `None` if the vehicle does not report it.
    pub fn last_hold_s(&self) -> Option<f64> {
        let reported_ds = self.status.as_ref()?.value.last_hold_ds;
        (reported_ds > 0).then(|| f64::from(reported_ds) / 10.0)
    }

    /// Position and velocity, from the better of its two sources.
    pub fn best_motion(&self) -> Option<Sample<Motion>> {
        better(self.motion, self.hud, STALE_AFTER)
    }

    /// Height above the pad, m: from the position while it is fresh, otherwise from `TD_DESCENT`.
    /// Every part of the screen shows this value.
    pub fn height_m(&self) -> Option<Sample<f64>> {
        better(self.of_motion(|motion| motion.altitude_m), self.of_descent(|d| d.height_m), STALE_AFTER)
    }

    /// Vertical speed, up, m/s; from the same source.
    pub fn vertical_m_s(&self) -> Option<Sample<f64>> {
        let reported = self.of_descent(|descent| descent.vertical_speed_m_s);
        better(self.of_motion(|motion| motion.climb_m_s), reported, STALE_AFTER)
    }

    /// A number of `TD_DESCENT`, while it is estimated.
    pub fn of_descent(&self, pick: fn(&TD_DESCENT_DATA) -> f32) -> Option<Sample<f64>> {
        let descent = self.descent()?;
        let sample = Sample::new(f64::from(pick(&descent.value)), descent.received_at);
        Some(sample).filter(|sample| sample.value.is_finite())
    }

    /// Wind towards north and east, m/s; `None` before it is estimated, and once the parachute is
    /// out, which the estimator does not model.
    pub fn wind_m_s(&self) -> Option<Sample<[f64; 2]>> {
        let of = |d: &TD_DESCENT_DATA| [f64::from(d.wind_x_m_s), f64::from(d.wind_y_m_s)];
        let wind = self.descent().filter(|d| d.value.chute == TdChute::TD_CHUTE_STOWED)?.map(of);
        Some(wind).filter(|wind| wind.value != [0.0; 2])
    }

    /// The radius of the fence of its mission, m; `None` if it has reported none.
    pub fn fence_m(&self) -> Option<f64> {
        self.limits().map(|limits| f64::from(limits.fence_m)).filter(|m| m.is_finite() && *m > 0.0)
    }

    /// A coordinate of the predicted touchdown. At the beginning of the fall, until the vehicle
    /// estimates its ignition band, it follows from a sink rate of nearly zero and is far off: that
    /// counts as not available.
    ///
    /// Under a parachute that does not carry the vehicle yet, a report from before its command is
    /// one of the fall without it.
    pub fn of_touchdown(&self, pick: fn(&TD_DESCENT_DATA) -> f32) -> Option<Sample<f64>> {
        use TdPhase as P;
        let phase = self.phase_now();
        let begins = matches!(phase, Some(P::TD_PHASE_DEPLOY | P::TD_PHASE_AERO_DESCENT));
        let opens = phase == Some(P::TD_PHASE_CHUTE) && self.descent()?.value.chute != TdChute::TD_CHUTE_OPEN;
        let settled = !begins || self.of_descent(|d| d.band_low_m).is_some();
        self.of_descent(pick).filter(|_| settled && !opens)
    }

    /// A number of the position and velocity.
    pub fn of_motion(&self, pick: fn(&Motion) -> f64) -> Option<Sample<f64>> {
        self.best_motion().map(|motion| motion.map(pick))
    }

    /// A number of the attitude.
    pub fn of_attitude(&self, pick: fn(&Attitude) -> f64) -> Option<Sample<f64>> {
        self.attitude.map(|attitude| attitude.map(pick))
    }

    /// The angle between nose and vertical, degrees.
    pub fn tilt_deg(&self) -> Option<Sample<f64>> {
        self.of_attitude(|attitude| attitude.tilt_rad.to_degrees())
    }

    /// Time from now until the planned ignition, s. It counts on between two messages. `None` if
    /// the motor is inhibited, or the time has passed.
    pub fn ignition_in_s(&self, now: Duration) -> Option<Sample<f64>> {
        count_down(self.of_descent(|d| d.time_to_ignition_s).filter(|_| self.may_light())?, now)
    }

    /// Time from now until the predicted touchdown, s; it also counts on between messages.
    pub fn touchdown_in_s(&self, now: Duration) -> Option<Sample<f64>> {
        count_down(self.prediction?.map(|prediction| prediction.time_to_go_s), now)
    }

    /// The speed of the predicted touchdown, m/s.
    pub fn predicted_speed_m_s(&self) -> Option<Sample<f64>> {
        self.prediction.map(|prediction| prediction.map(|p| p.touchdown.speed_m_s()))
    }

    /// Speeds along the body axes, with the age of the older of attitude and velocity.
    pub fn body_speed(&self) -> Option<Sample<BodySpeed>> {
        let (attitude, motion) = (self.attitude?, self.motion?);
        let speed = BodySpeed::of(&attitude.value, &motion.value);
        Some(Sample::new(speed, attitude.received_at.min(motion.received_at)))
    }
}

/// The first of two sources, unless the other is later than it by more than this.
fn better<T>(first: Option<Sample<T>>, other: Option<Sample<T>>, by: Duration) -> Option<Sample<T>> {
    match (first, other) {
        (Some(first), Some(other)) if other.received_at.saturating_sub(first.received_at) > by => Some(other),
        (first, other) => first.or(other),
    }
}

fn count_down(reported_s: Sample<f64>, now: Duration) -> Option<Sample<f64>> {
    let left_s = reported_s.value - reported_s.age(now).as_secs_f64();
    (left_s.is_finite() && left_s >= 0.0).then_some(Sample { value: left_s, ..reported_s })
}

/// Whether a phase lies between leaving the pad and coming to rest.
pub fn is_flight(phase: TdPhase) -> bool {
    (TdPhase::TD_PHASE_BOOST as u32..=TdPhase::TD_PHASE_POWERED as u32).contains(&(phase as u32))
        || phase == TdPhase::TD_PHASE_CHUTE
}

/// Whether the landing motor burns or is being ignited.
pub fn is_burning(phase: TdPhase) -> bool {
    matches!(phase, TdPhase::TD_PHASE_IGNITION | TdPhase::TD_PHASE_POWERED)
}

pub fn is_on_pad(phase: TdPhase) -> bool {
    (phase as u32) <= TdPhase::TD_PHASE_PAD_ARMED as u32
}
