//! Whether people may approach the vehicle, from what it reports about its landing motor; and why its countdown was
//! held.

use std::time::Duration;

use protocol::dialect::{TD_FLIGHT_STATUS_DATA, TdHold, TdInterlock, TdMotor, TdPhase};

use super::two_person::role_name;
use super::vehicle::{Vehicle, is_on_pad};

/// Why nobody may approach, the worst reason first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Danger {
    /// The motor is not lit, and only software keeps it from lighting.
    Live,
    /// The same after the waiting time: a person may approach to insert the pin.
    LiveWaited,
    /// The motor burns or has been commanded to light.
    Burning,
    /// After a flight the vehicle reports nothing about the motor.
    NotReported,
    /// The motor is burnt out and still hot.
    Hot,
    /// The waiting time after an abort on the pad.
    Wait,
}

/// Why people must stay away from the vehicle, and for how long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeepAway {
    pub danger: Danger,
    /// For how long, s; `None` while it is unknown.
    pub wait_s: Option<u16>,
}

impl KeepAway {
    /// The present warning. `None` while a vehicle is being prepared, and while it flies as planned.
    ///
    /// A waiting time goes on without the link: a burnt motor cools, and nothing can make it worse.
    pub fn of(vehicle: &Vehicle, now: Duration) -> Option<Self> {
        let sample = vehicle.status.as_ref()?;
        let status = &sample.value;
        let told_s = (status.approach_wait_s != u16::MAX).then_some(status.approach_wait_s);
        let passed_s = u16::try_from(sample.age(now).as_secs()).unwrap_or(u16::MAX);
        let wait_s = told_s.map(|told_s| told_s.max(status.pad_wait_s).saturating_sub(passed_s));
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

    /// For how long, and the reason: what follows `do not approach`.
    pub fn reason(&self) -> String {
        let left = self.wait_s.filter(|left_s| *left_s > 0);
        let left = left.map_or_else(String::new, |left_s| format!(" for {left_s} s"));
        match self.danger {
            Danger::Live => format!("{left}: LIVE MOTOR"),
            Danger::LiveWaited => " but to put the pin in: LIVE MOTOR".to_owned(),
            Danger::Burning => format!("{left}: MOTOR BURNING"),
            Danger::NotReported => format!("{left}: MOTOR NOT REPORTED: treat it as live"),
            Danger::Hot => format!("{left}: MOTOR HOT, burnt out"),
            Danger::Wait => format!("{left}: the waiting time runs"),
        }
    }
}

/// Whether people may approach a vehicle that is down, or whose countdown was aborted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Approach {
    DoNot(KeepAway),
    /// They may, for this reason.
    May(&'static str),
}

impl Approach {
    /// `None` in flight, and while a vehicle is being prepared.
    pub fn of(vehicle: &Vehicle, now: Duration) -> Option<Self> {
        let status = &vehicle.status.as_ref()?.value;
        if vehicle.in_flight() || !concerns(status) {
            return None;
        }
        Some(match (KeepAway::of(vehicle, now), status.motor) {
            (Some(away), _) => Self::DoNot(away),
            (None, TdMotor::TD_MOTOR_PIN_IN) => Self::May("the pin is in"),
            (None, TdMotor::TD_MOTOR_BURNT) => Self::May("the motor is burnt out and cool"),
            (None, TdMotor::TD_MOTOR_HOT) => {
                Self::May("the motor is burnt out, and its cooling time is over")
            }
            (None, _) => Self::May("the waiting time is over"),
        })
    }

    /// The words that stand largest on every page.
    pub fn headline(&self) -> &'static str {
        match self {
            Self::DoNot(_) => "DO NOT APPROACH",
            Self::May(_) => "MAY BE APPROACHED",
        }
    }

    /// What follows the headline in a sentence: for how long, and the reason.
    pub fn reason(&self) -> String {
        match self {
            Self::DoNot(away) => away.reason(),
            Self::May(why) => format!(": {why}"),
        }
    }
}

/// Whether the motor matters to people on the ground: the flight is over or does not go as planned, or a waiting time
/// runs.
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
            let latched = status.interlocks.contains(TdInterlock::TD_INTERLOCK_ABORT_LATCHED);
            latched || status.approach_wait_s > 0 || status.pad_wait_s > 0
        }
        _ => status.interlocks.intersects(amiss),
    }
}

/// The operator who held the countdown, or whose silence did.
fn held_by(vehicle: &Vehicle) -> Option<String> {
    let number = vehicle.crew.as_ref().map(|crew| crew.value.held_by)?;
    let (role, name) = vehicle.operators.get(&number)?;
    Some(format!("{} {name}", role_name(*role)))
}

/// Why the countdown was held and what happens next; `None` while it is not held.
pub fn hold_words(vehicle: &Vehicle, armed_here: bool) -> Option<String> {
    let status = &vehicle.status.as_ref()?.value;
    let whom = if armed_here { "this station" } else { "its station" };
    let why = match status.hold {
        TdHold::TD_HOLD_NONE => return None,
        TdHold::TD_HOLD_UPLINK_SILENT if held_by(vehicle).is_some() && !armed_here => {
            format!("the vehicle did not hear {} for 2 s", held_by(vehicle).unwrap_or_default())
        }
        TdHold::TD_HOLD_UPLINK_SILENT => format!("the vehicle did not hear {whom} for 2 s"),
        TdHold::TD_HOLD_COMMANDED => match held_by(vehicle) {
            Some(who) => format!("{who} asked for it"),
            None => "a station asked for it".to_owned(),
        },
        TdHold::TD_HOLD_TAP_OVERDUE => match held_by(vehicle) {
            Some(who) => format!("no tap of {who} for 2 s"),
            None => "no tap for 2 s".to_owned(),
        },
    };
    let held = status.phase == TdPhase::TD_PHASE_PAD_ARMED;
    held.then(|| format!("HOLD: {why}; start anew; disarms in {} s", status.hold_left_s))
}
