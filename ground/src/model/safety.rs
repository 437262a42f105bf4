//! Safety of people: the landing motor, holds, aborts and their effect, and how a flight ended.

use std::time::Duration;

use protocol::dialect::{
    TD_CREW_DATA, TD_FLIGHT_STATUS_DATA, TdAbortEffect, TdChute, TdHold, TdInterlock, TdLanding, TdLatch,
    TdLimit, TdMotor, TdPhase,
};
use protocol::log::record::EventLevel;
use serde::{Deserialize, Serialize};

use super::dead_reckoning::{is_silent, may_have_left, predict_position};
use super::{CommandKind, Event, Model, Role, Sample, Seat, Speaker, Vehicle, Verdict, is_on_pad, role_name};

/// Why people must stay away, the worst reason first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Danger {
    /// The motor has not ignited, and only software inhibits it.
    Live,
    /// The same after the waiting time: a person may approach to insert the pin.
    LiveWaited,
    /// The motor burns, or ignition is commanded.
    Burning,
    /// After a flight the vehicle reports nothing about the motor.
    NotReported,
    /// The motor is burnt out and still hot.
    Hot,
    /// The waiting time after an abort on the pad.
    Wait,
}

/// Why people must stay away from the vehicle, and for how long.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeepAway {
    pub danger: Danger,
    /// For how long, s; `None` while it is unknown.
    pub wait_s: Option<u16>,
}

impl KeepAway {
    /// The present warning. `None` while a vehicle is being prepared, and while it flies as
    /// planned. A waiting time runs on without the link: a burnt motor only cools.
    pub fn of(vehicle: &Vehicle, now: Duration) -> Option<Self> {
        Self::reported(vehicle, now).or_else(|| vehicle.away_before(now))
    }

    /// The warning that follows from the vehicle's status.
    fn reported(vehicle: &Vehicle, now: Duration) -> Option<Self> {
        let sample = vehicle.status.as_ref()?;
        let status = &sample.value;
        let reported_s = (status.approach_wait_s != u16::MAX).then_some(status.approach_wait_s);
        let passed_s = u16::try_from(sample.age(now).as_secs()).unwrap_or(u16::MAX);
        let wait_s = reported_s.map(|reported_s| reported_s.saturating_sub(passed_s));
        let danger = match status.motor {
            _ if !concerns(status) => return None,
            TdMotor::TD_MOTOR_LIVE if wait_s == Some(0) && !vehicle.in_flight() => Danger::LiveWaited,
            TdMotor::TD_MOTOR_LIVE => Danger::Live,
            TdMotor::TD_MOTOR_BURNING => Danger::Burning,
            TdMotor::TD_MOTOR_HOT if wait_s != Some(0) || !sample.is_stale(now) => Danger::Hot,
            TdMotor::TD_MOTOR_UNKNOWN if !is_on_pad(status.phase) => Danger::NotReported,
            TdMotor::TD_MOTOR_UNKNOWN | TdMotor::TD_MOTOR_PIN_IN | TdMotor::TD_MOTOR_BURNT
                if wait_s != Some(0) =>
            {
                Danger::Wait
            }
            _ => return None,
        };
        Some(Self { danger, wait_s })
    }

    /// Whether one person may approach, to insert the pin.
    pub fn is_for_the_pin(self) -> bool {
        self.danger == Danger::LiveWaited
    }

    /// What to do.
    fn headline(self) -> &'static str {
        if self.is_for_the_pin() { "ONE PERSON: PIN IN" } else { "DO NOT APPROACH" }
    }

    /// What to do, for how long, and the reason.
    pub fn sentence(&self) -> String {
        format!("{}{}", self.headline(), self.reason())
    }

    /// For how long, and the reason: the text after the headline.
    pub fn reason(&self) -> String {
        let left = self.wait_s.filter(|left_s| *left_s > 0);
        let left = left.map_or_else(String::new, |left_s| format!(" for {left_s} s"));
        match self.danger {
            Danger::Live => format!("{left}: LIVE MOTOR"),
            Danger::LiveWaited => ": the motor is LIVE, and the waiting time is over".to_owned(),
            Danger::Burning => format!("{left}: MOTOR BURNING"),
            Danger::NotReported => format!("{left}: MOTOR NOT REPORTED: treat it as live"),
            Danger::Hot => format!("{left}: MOTOR HOT, burnt out"),
            Danger::Wait => format!("{left}: the waiting time runs"),
        }
    }
}

/// Waiting time for a vehicle that was reset before it reported one, s: the vehicle's longest.
const LONGEST_WAIT_S: u16 = 60;

impl Vehicle {
    /// The waiting time that began before a power cycle or a restart of the station, while it runs.
    pub(crate) fn wait_before(&self, now: Duration) -> Option<KeepAway> {
        let before = self.before?;
        let passed_s = u16::try_from(before.age(now).as_secs()).unwrap_or(u16::MAX);
        let left_s = before.value.wait_s.unwrap_or(LONGEST_WAIT_S).saturating_sub(passed_s);
        (left_s > 0).then_some(KeepAway { wait_s: Some(left_s), ..before.value })
    }

    /// The same, and after it a motor that may be live, until the vehicle reports otherwise.
    fn away_before(&self, now: Duration) -> Option<KeepAway> {
        let live = || {
            let may_be = !matches!(self.before?.value.danger, Danger::Hot | Danger::Wait);
            let motor = self.status.as_ref().map_or(TdMotor::TD_MOTOR_UNKNOWN, |status| status.value.motor);
            let is_open = matches!(motor, TdMotor::TD_MOTOR_LIVE | TdMotor::TD_MOTOR_UNKNOWN);
            let rests = !self.is_armed() && !self.in_flight();
            (may_be && is_open && rests).then_some(KeepAway { danger: Danger::LiveWaited, wait_s: Some(0) })
        };
        self.wait_before(now).or_else(live)
    }

    /// Ends the warning from before once the pin was reported, or the crew has armed since.
    pub(crate) fn end_before(&mut self, now: Duration) {
        let pinned = self.reports(|status| status.motor == TdMotor::TD_MOTOR_PIN_IN);
        if (pinned || self.is_armed()) && self.wait_before(now).is_none() {
            self.before = None;
        } else if pinned && let Some(before) = &mut self.before {
            before.value.danger = Danger::Wait;
        }
    }
}

/// State that must survive the end of the station; it is stored beside the log.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unfinished {
    /// An unconfirmed abort: its time, operator and screen.
    pub abort: Option<String>,
    /// Why people must stay away. For how long is not stored: no clock shows how long the station
    /// was off, so the wait runs again in full.
    pub danger: Option<Danger>,
}

impl Model {
    /// The state that is unfinished now.
    pub fn unfinished(&self, now: Duration) -> Unfinished {
        let abort = match self.commands.of(CommandKind::Abort) {
            Some(track) if track.is_confirmed() => None,
            Some(track) => {
                Some(abort_stamp(self.settings.start_unix_s + track.commanded_at.as_secs(), &track.by))
            }
            None => self.abort_before.clone(),
        };
        Unfinished { abort, danger: KeepAway::of(&self.vehicle, now).map(|away| away.danger) }
    }

    /// Restores the unfinished state of an earlier run.
    pub fn take_unfinished(&mut self, unfinished: Unfinished, now: Duration) {
        self.stored_unfinished = Some(unfinished.clone());
        if let Some(at) = &unfinished.abort {
            let text = format!("an ABORT was requested at {at} and not confirmed");
            self.error(now, text);
        }
        self.abort_before = unfinished.abort;
        self.vehicle.before = unfinished.danger.map(|danger| {
            let danger = if danger == Danger::LiveWaited { Danger::Live } else { danger };
            Sample::new(KeepAway { danger, wait_s: Some(LONGEST_WAIT_S) }, now)
        });
    }
}

/// Time, operator and screen of an abort.
pub fn abort_stamp(unix_s: u64, by: &Seat) -> String {
    let [hour, minute, second] = [unix_s / 3_600 % 24, unix_s / 60 % 60, unix_s % 60];
    format!("{hour:02}:{minute:02}:{second:02} UTC{}", by.in_brackets())
}

/// Whether people may approach a vehicle that is down, or whose countdown was aborted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Approach {
    /// They may not; perhaps one person may, to insert the pin.
    Away(KeepAway),
    /// They may, for this reason.
    May(&'static str),
}

impl Approach {
    /// `None` in flight, and while a vehicle is being prepared.
    pub fn of(vehicle: &Vehicle, now: Duration) -> Option<Self> {
        let before = vehicle.away_before(now);
        let Some(status) = vehicle.status.as_ref().map(|status| &status.value) else {
            return before.map(Self::Away);
        };
        if vehicle.in_flight() || !(concerns(status) || before.is_some()) {
            return None;
        }
        Some(match (KeepAway::of(vehicle, now), status.motor) {
            (Some(away), _) => Self::Away(away),
            (None, TdMotor::TD_MOTOR_PIN_IN) => Self::May("the pin is in"),
            (None, TdMotor::TD_MOTOR_BURNT) => Self::May("the motor is burnt out and cool"),
            (None, TdMotor::TD_MOTOR_HOT) => {
                Self::May("the motor is burnt out, and its cooling time is over")
            }
            (None, _) => Self::May("the waiting time is over"),
        })
    }

    /// The largest words of every page.
    pub fn headline(&self) -> &'static str {
        match self {
            Self::Away(away) => away.headline(),
            Self::May(_) => "MAY BE APPROACHED",
        }
    }

    /// The text after the headline: for how long, and the reason.
    pub fn reason(&self) -> String {
        match self {
            Self::Away(away) => away.reason(),
            Self::May(why) => format!(": {why}"),
        }
    }
}

/// Why stopping the station needs confirmation: its screens show when people may approach.
pub fn why_not_stop(model: &Model, now: Duration) -> Option<String> {
    if model.is_at_risk() {
        return Some("the vehicle is armed or in flight".to_owned());
    }
    KeepAway::of(&model.vehicle, now).map(|away| format!("people must keep away, {}", away.sentence()))
}

/// Why quitting has to be confirmed: as for [`why_not_stop`]. A demonstration has no people near
/// its vehicle.
pub fn why_not_quit(model: &Model, now: Duration) -> Option<String> {
    let asks = model.settings.role.why_not_command().is_none();
    let is_near =
        model.is_at_risk() || (model.settings.role == Role::Station && !model.settings.demonstration);
    why_not_stop(model, now).filter(|_| asks && is_near)
}

/// Whether the motor matters to people on the ground: the flight is over or does not go as planned,
/// or a waiting time runs.
fn concerns(status: &TD_FLIGHT_STATUS_DATA) -> bool {
    let amiss = TdInterlock::TD_INTERLOCK_ABORT_LATCHED
        | TdInterlock::TD_INTERLOCK_NO_LIGHT
        | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    match status.phase {
        TdPhase::TD_PHASE_TOUCHDOWN | TdPhase::TD_PHASE_SAFED | TdPhase::TD_PHASE_CHUTE => true,
        // The arming ladder shows this state to the crew.
        TdPhase::TD_PHASE_PAD_ARMED => false,
        // Before a flight the motor is inhibited as planned.
        phase if is_on_pad(phase) => {
            let aborted = TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_PIN_DUE;
            status.interlocks.intersects(aborted) || status.approach_wait_s > 0
        }
        _ => status.interlocks.intersects(amiss),
    }
}

/// Time after which the vehicle detects a loss in the countdown, s: of station, screen, tap or
/// link.
const NOTICED_AFTER_S: f64 = 1.0;

impl Model {
    /// The time before the release, as it is shown here, from which on a hold comes too late, s:
    /// the display is late by the downlink's latency, and a hold takes the uplink's. `None` if the
    /// vehicle does not report it.
    pub fn last_hold_s(&self, vehicle: &Vehicle) -> Option<f64> {
        let round_trip = self.link.round_trip.unwrap_or_default();
        vehicle.last_hold_s().map(|last_s| last_s + round_trip.as_secs_f64())
    }

    /// Whether countdowns run, and a hold comes too late for each.
    pub fn is_past_hold(&self, now: Duration) -> bool {
        let past = |vehicle: &Vehicle| {
            let left_s = vehicle.countdown_s().map(|left| left.value - left.age(now).as_secs_f64());
            left_s.zip(self.last_hold_s(vehicle)).is_some_and(|(left_s, last_s)| left_s <= last_s)
        };
        let mut counted = self.every_vehicle(now).filter(|vehicle| vehicle.counts_down()).peekable();
        counted.peek().is_some() && counted.all(past)
    }

    /// Effect of a loss of station, screen, tap or link on the countdown, in one sentence.
    pub fn loss_in_words(&self) -> Option<String> {
        let last_s = self.vehicle.last_hold_s()? + NOTICED_AFTER_S;
        Some(format!("What is lost before T-{last_s:.0} s holds the countdown; what is lost later may fly."))
    }
}

/// The operator who held the countdown, or whose silence did.
fn held_by(vehicle: &Vehicle) -> Option<String> {
    let number = vehicle.last::<TD_CREW_DATA>().map(|crew| crew.value.held_by)?;
    let (role, name) = vehicle.operators.get(&number)?;
    Some(format!("{} {name}", role_name(*role)))
}

/// Why the countdown was held and what happens next; `None` while it is not held.
pub fn hold_words(model: &Model) -> Option<String> {
    let (vehicle, armed_here) = (&model.vehicle, model.link.uplink.armed_by_us);
    let status = &vehicle.status.as_ref()?.value;
    let theirs =
        || held_by(vehicle).map_or_else(|| "its station".to_owned(), |who| format!("the station of {who}"));
    let station = if armed_here { "this station".to_owned() } else { theirs() };
    let why = match status.hold {
        TdHold::TD_HOLD_NONE => return None,
        TdHold::TD_HOLD_UPLINK_SILENT => format!("no uplink from {station} for 1 s"),
        TdHold::TD_HOLD_STATION_DEAF => format!("no downlink at {station} for 1 s"),
        TdHold::TD_HOLD_CHECK_FAILED => {
            vehicle.held_for().map_or_else(|| "a check of the vehicle fails".to_owned(), |(_, words)| words)
        }
        TdHold::TD_HOLD_COMMANDED => match model.crew.held_because.clone().filter(|_| armed_here) {
            Some(ours) => ours,
            None => format!("{} requested it", held_by(vehicle).unwrap_or_else(|| "a station".to_owned())),
        },
        TdHold::TD_HOLD_TAP_OVERDUE => {
            let whose = held_by(vehicle).map_or_else(String::new, |who| format!(" of {who}"));
            format!("no tap{whose} for 1 s")
        }
    };
    let held = status.phase == TdPhase::TD_PHASE_PAD_ARMED;
    held.then(|| format!("HOLD: {why}; start again; disarms in {} s", status.hold_left_s))
}

// How a flight ended: one of four ends, each with its word.

/// A vehicle that hits the ground at this speed or faster, m/s, is a wreck: that of a fall from 5
/// m. Its legs withstand 1 m/s, and under an open parachute it comes down at 6 m/s.
const WRECKED_FROM_M_S: f64 = 10.0;
/// Silence after which a vehicle in flight whose fall cannot be predicted is down: 300 m under a
/// parachute take 50 s.
const SURELY_DOWN_AFTER: Duration = Duration::from_mins(2);

/// The ends of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// It stands, undamaged.
    Stands,
    /// It stands, and counts as damaged.
    Upright,
    /// It came down under an open parachute.
    UnderParachute,
    /// It met the ground and did not stay upright.
    Hard,
    /// It is a wreck, or it went silent in flight and must be down.
    Lost,
}

impl Ending {
    /// The words of every screen, and the same in large letters.
    pub fn words(self) -> [&'static str; 2] {
        match self {
            Self::Stands => ["STANDS UNDAMAGED", "STANDS"],
            Self::Upright => ["UPRIGHT"; 2],
            Self::UnderParachute => ["DOWN UNDER THE PARACHUTE", "PARACHUTE"],
            Self::Hard => ["HARD LANDING", "HARD"],
            Self::Lost => ["LOST"; 2],
        }
    }

    pub fn word(self) -> &'static str {
        self.words()[0]
    }

    /// The end of this flight; `None` while it goes on, or while its end has not been reported.
    pub fn of(vehicle: &Vehicle, now: Duration) -> Option<Self> {
        if let Some(verdict) = vehicle.verdict() {
            return Some(Self::judged(vehicle, &verdict.value));
        }
        let phase = vehicle.phase()?.value;
        match phase {
            TdPhase::TD_PHASE_TOUCHDOWN | TdPhase::TD_PHASE_SAFED => {
                hangs_on_its_chute(vehicle).then_some(Self::UnderParachute)
            }
            _ => is_silent_and_down(vehicle, now).then_some(Self::Lost),
        }
    }

    fn judged(vehicle: &Vehicle, verdict: &Verdict) -> Self {
        let Touchdown { vertical_m_s, .. } = verdict.touchdown;
        match verdict.landing {
            landing if landing.contains(TdLanding::TD_LANDING_STANDS) => Self::Stands,
            _ if hangs_on_its_chute(vehicle) && vertical_m_s.abs() < WRECKED_FROM_M_S => Self::UnderParachute,
            landing if landing.contains(TdLanding::TD_LANDING_UPRIGHT) => Self::Upright,
            _ if verdict.touchdown.speed_m_s() < WRECKED_FROM_M_S => Self::Hard,
            _ => Self::Lost,
        }
    }

    /// The words with the details of this end.
    pub fn sentence(self, vehicle: &Vehicle) -> String {
        let reset = if vehicle.reset_in_flight { ", after a RESET IN FLIGHT" } else { "" };
        format!("{}{reset}{}", self.word(), self.detail(vehicle))
    }

    /// The details of this end: the text after the words.
    pub fn detail(self, vehicle: &Vehicle) -> String {
        let Some(Sample { value: Verdict { landing, touchdown }, .. }) = vehicle.verdict() else {
            let silent = ": it went silent in flight and must be down";
            return if self == Self::Lost { silent.to_owned() } else { String::new() };
        };
        let side = |bit| if landing.contains(bit) { "inside" } else { "outside" };
        let at_contact = || {
            let [envelope, table_2] =
                [TdLanding::TD_LANDING_ENVELOPE, TdLanding::TD_LANDING_TABLE_2].map(side);
            format!(", {envelope} the design envelope of its legs, {table_2} Table 2")
        };
        match self {
            Self::Stands => at_contact(),
            Self::Upright => format!(", damaged{}", at_contact()),
            Self::UnderParachute => format!(", sinking at {:.1} m/s", touchdown.vertical_m_s.abs()),
            Self::Hard => match touchdown.violations() {
                Some(names) => format!(": not upright, outside {names}"),
                None => ": it did not stay upright".to_owned(),
            },
            Self::Lost => format!(": hit the ground at {:.0} m/s", touchdown.speed_m_s()),
        }
    }
}

/// Whether its parachute was open at its last report.
pub(super) fn hangs_on_its_chute(vehicle: &Vehicle) -> bool {
    vehicle.descent().is_some_and(|descent| descent.value.chute == TdChute::TD_CHUTE_OPEN)
}

/// Whether it went silent in flight so long ago that it must have come down.
fn is_silent_and_down(vehicle: &Vehicle, now: Duration) -> bool {
    if let Some(since) = may_have_left(vehicle, now) {
        return since >= SURELY_DOWN_AFTER;
    }
    if !is_silent(vehicle, now) {
        return false;
    }
    let silence = vehicle.phase().map_or(Duration::ZERO, |phase| phase.age(now));
    predict_position(vehicle, now).map_or(silence >= SURELY_DOWN_AFTER, |at| at.is_down)
}

// A state at touchdown, predicted or reached, with the limits that the vehicle found violated.

/// A state at touchdown, predicted or reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touchdown {
    /// Level distance from the target, m.
    pub distance_m: f64,
    /// Height of the feet, m.
    pub height_m: f64,
    /// Vertical speed, up, m/s.
    pub vertical_m_s: f64,
    /// Speed over the ground, m/s.
    pub lateral_m_s: f64,
    /// Angle between nose and vertical, rad.
    pub tilt_rad: f64,
    /// Size of the rotation rate, rad/s.
    pub rate_rad_s: f64,
    /// The limits that the vehicle reports as violated: those of the design envelope of its legs,
    /// and a plan's height.
    pub violated: TdLimit,
}

/// The limits of a touchdown in the order of the state: the word on screens and the vehicle's bit.
pub const LIMITS: [(&str, TdLimit); 6] = [
    ("distance", TdLimit::TD_LIMIT_DISTANCE),
    ("height", TdLimit::TD_LIMIT_HEIGHT),
    ("sink", TdLimit::TD_LIMIT_VERTICAL_SPEED),
    ("drift", TdLimit::TD_LIMIT_LATERAL_SPEED),
    ("tilt", TdLimit::TD_LIMIT_TILT),
    ("turn", TdLimit::TD_LIMIT_RATE),
];

impl Touchdown {
    pub fn speed_m_s(&self) -> f64 {
        libm::hypot(self.vertical_m_s, self.lateral_m_s)
    }

    /// The names of the violated limits; `None` if there is none.
    pub fn violations(&self) -> Option<String> {
        let violated = LIMITS.iter().filter(|(_, bit)| self.violated.contains(*bit));
        let names: Vec<&str> = violated.map(|(name, _)| *name).collect();
        (!names.is_empty()).then(|| names.join(", "))
    }
}

// Why the landing motor is inhibited permanently.

/// A text of the vehicle may precede its latch by this long: the text waits for the radio.
const TEXT_APART: Duration = Duration::from_secs(2);
/// How many of the newest events are searched for the text.
const TEXTS_SEARCHED: usize = 100;

/// The cause that the vehicle reports; `None` if it reports none, or only in a text.
pub fn latch_cause(vehicle: &Vehicle) -> Option<&'static str> {
    Some(match vehicle.status.as_ref()?.value.latch {
        TdLatch::TD_LATCH_NONE | TdLatch::TD_LATCH_OTHER => return None,
        TdLatch::TD_LATCH_COMMANDED => COMMANDED,
        TdLatch::TD_LATCH_UNCOMMANDED_LIFTOFF => "uncommanded lift-off",
        TdLatch::TD_LATCH_UNCOMMANDED_RELEASE => "uncommanded release",
        TdLatch::TD_LATCH_NO_SEPARATION => "the booster stayed on",
        TdLatch::TD_LATCH_GATE => "the ignition gate did not open in time",
        TdLatch::TD_LATCH_NO_LIGHT => "the motor gave no thrust",
    })
}

/// Whether it climbs without a command: people near the pad have seconds.
pub fn is_liftoff_by_itself(vehicle: &Vehicle) -> bool {
    let climbs = matches!(vehicle.phase_now(), Some(TdPhase::TD_PHASE_BOOST | TdPhase::TD_PHASE_COAST));
    climbs && vehicle.reports(|status| status.latch == TdLatch::TD_LATCH_UNCOMMANDED_LIFTOFF)
}

/// The latch in words, with its cause; `None` while nothing is latched, and for a motor that did
/// not ignite, which has its own words.
pub fn latch_words(model: &Model) -> Option<String> {
    let vehicle = &model.vehicle;
    let aborted = vehicle.interlocks()?.contains(TdInterlock::TD_INTERLOCK_ABORT_LATCHED);
    let cause = latch_cause(vehicle);
    let no_light = vehicle.reports(|status| status.latch == TdLatch::TD_LATCH_NO_LIGHT);
    let word = match (aborted, cause) {
        (true, _) => "ABORT LATCHED",
        (false, Some(_)) if !no_light => "MOTOR INHIBITED",
        (false, _) => return None,
    };
    let reported = match cause {
        Some(COMMANDED) | None => abort_commanded_by(model).or(cause.map(str::to_owned)),
        Some(cause) => Some(cause.to_owned()),
    };
    let cause = why_gate_stayed_shut(model).or(reported).or_else(|| text_of_the_latch(model));
    Some(cause.map_or_else(|| word.to_owned(), |cause| format!("{word}: {cause}")))
}

/// Cause of an abort whose sender is not known.
const COMMANDED: &str = "commanded by another station";

/// Who commanded the abort: this station, or the sender that the vehicle names.
fn abort_commanded_by(model: &Model) -> Option<String> {
    let ours = model.commands.of(CommandKind::Abort).map(|_| "commanded from here".to_owned());
    let mut texts = model.events.newest(TEXTS_SEARCHED).filter(|event| event.speaker == Speaker::Vehicle);
    let named = texts.find_map(|event| event.text.strip_suffix(" aborts"));
    let words = |sender: &str| match sender.strip_prefix("station ") {
        Some(ids) => format!("by {}", sender_words(model, ids)),
        None => format!("commanded by {sender}"),
    };
    ours.or_else(|| named.map(words))
}

/// The ids of a station with the network address or link that the vehicle last reported for one of
/// its commands.
pub fn sender_words(model: &Model, ids: &str) -> String {
    let mut texts = model.events.newest(TEXTS_SEARCHED).filter(|event| event.speaker == Speaker::Vehicle);
    let from = texts.find_map(|event| {
        let (from, _) = event.text.strip_prefix(ids)?.rsplit_once(": ")?;
        from.starts_with(' ').then_some(from)
    });
    format!("{ids}{}", from.unwrap_or_default())
}

/// The check that inhibited ignition: the vehicle's finding, or its text when it abandoned the
/// landing.
fn why_gate_stayed_shut(model: &Model) -> Option<String> {
    let vehicle = &model.vehicle;
    vehicle.status.as_ref().filter(|status| status.value.latch == TdLatch::TD_LATCH_GATE)?;
    let found = vehicle.findings.in_time();
    let found = found.iter().find_map(|(_, words)| words.strip_prefix("ignition gate stayed shut: "));
    let since = vehicle.left_pad_at.unwrap_or_default();
    let of_this_flight = |event: &&Event| event.at >= since && event.speaker == Speaker::Vehicle;
    let mut texts = model.events.newest(TEXTS_SEARCHED).filter(of_this_flight);
    let given_up = || texts.find_map(|event| event.text.strip_prefix("ignition gate closed: "));
    found.or_else(given_up).map(|why| format!("gate stayed shut: {why}"))
}

/// The first error text of the vehicle around its latch, for a cause that is only in a text: later
/// texts are about the consequences.
fn text_of_the_latch(model: &Model) -> Option<String> {
    let since = model.outcome.aborted_at?.saturating_sub(TEXT_APART);
    let mut events = model.events.newest(TEXTS_SEARCHED);
    let found = events.find(|event| {
        let grave = matches!(event.level, EventLevel::Error | EventLevel::Fatal);
        event.speaker == Speaker::Vehicle && grave && event.at >= since && event.at <= since + 2 * TEXT_APART
    });
    found.map(|event| event.text.clone())
}

// Whether an abort that is sent now would arrive too late. The vehicle reports what an abort would
// do at this moment; the command takes time to reach it.

/// The assumed one-way delay before a round trip has been measured: a telemetry radio's usual
/// uplink latency.
const ONE_WAY_UNMEASURED: Duration = Duration::from_millis(250);

/// Why an abort sent now would arrive too late for its reported effect; `None` if it is in time, or
/// if that is unknown.
pub fn abort_too_late(model: &Model, now: Duration) -> Option<&'static str> {
    // A report from before a loss of the link still counts: the time keeps running.
    let offered = model.vehicle.status.as_ref()?.value.abort_effect;
    let chute = offered == TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    let before_ignition = chute
        || matches!(offered, TdAbortEffect::TD_ABORT_EFFECT_BURN | TdAbortEffect::TD_ABORT_EFFECT_IMPACT);
    if !before_ignition {
        return None;
    }
    let descent = model.vehicle.descent()?;
    let d = &descent.value;
    let one_way = model.link.round_trip.map_or(ONE_WAY_UNMEASURED, |round_trip| round_trip / 2);
    // Since the vehicle sent its report, and until the command arrives.
    let passes_s = (descent.age(now) + 2 * one_way).as_secs_f64();
    let left_s = f64::from(d.time_to_ignition_s);
    if left_s.is_finite() && left_s < passes_s {
        return Some("TOO LATE: arrives after ignition, lands here");
    }
    let (above_m, down_m_s) =
        (f64::from(d.height_m) - f64::from(d.commit_height_m), -f64::from(d.vertical_speed_m_s));
    let chute_lost = chute && above_m > 0.0 && down_m_s > 0.0 && above_m < down_m_s * passes_s;
    chute_lost.then_some("TOO LATE for a chute: arrives below the commit height")
}
