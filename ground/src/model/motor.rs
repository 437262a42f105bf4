//! Whether anybody may walk up to the vehicle, by what it reports of its landing motor; and why its countdown was held.

use protocol::dialect::{TD_FLIGHT_STATUS_DATA, TdHold, TdInterlock, TdMotor, TdPhase};

use super::vehicle::{Vehicle, is_on_pad};

/// Why nobody may come near, the worst first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Danger {
    /// Not lit, and nothing but software keeps it from it.
    Live,
    /// The same, and the time for which nobody may come near has passed: whoever puts the pin in may.
    LiveWaited,
    /// Commanded to light, or burning.
    Burning,
    /// After a flight nothing was reported of it.
    NotReported,
    /// Burnt out, and hot.
    Hot,
    /// After an abort on the pad.
    Wait,
}

/// What keeps people away from the vehicle, and for how long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeepAway {
    /// Why.
    pub danger: Danger,
    /// For how long, s; `None` while that cannot be said.
    pub wait_s: Option<u16>,
}

impl KeepAway {
    /// What it says now. `None` where people are where they should be: beside a vehicle that is made ready, and
    /// on the ground below one that flies as it should.
    pub fn of(vehicle: &Vehicle) -> Option<Self> {
        let status = &vehicle.status.as_ref()?.value;
        let approach_s = (status.approach_wait_s != u16::MAX).then_some(status.approach_wait_s);
        let wait_s = approach_s.map(|wait_s| wait_s.max(status.pad_wait_s));
        let danger = match status.motor {
            _ if !concerns(status) => return None,
            TdMotor::TD_MOTOR_LIVE if wait_s == Some(0) && !vehicle.in_flight() => Danger::LiveWaited,
            TdMotor::TD_MOTOR_LIVE => Danger::Live,
            TdMotor::TD_MOTOR_BURNING => Danger::Burning,
            TdMotor::TD_MOTOR_HOT => Danger::Hot,
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

    /// For the crew, with the time.
    pub fn words(&self) -> String {
        let until = match self.wait_s {
            Some(wait_s) if wait_s > 0 => format!(" for {wait_s} s"),
            _ => String::new(),
        };
        match self.danger {
            Danger::Live => format!("LIVE MOTOR: do not approach{until}"),
            Danger::LiveWaited => "LIVE MOTOR: do not approach, but to put the pin in".to_owned(),
            Danger::Burning => "MOTOR BURNING: do not approach".to_owned(),
            Danger::NotReported => "MOTOR NOT REPORTED: take it for live, do not approach".to_owned(),
            Danger::Hot => format!("MOTOR HOT: burnt out, do not touch{until}"),
            Danger::Wait => format!("STAY OFF THE PAD{until}"),
        }
    }
}

/// Whether it matters to people on the ground: the flight is over, or goes otherwise than it should, or a wait runs.
fn concerns(status: &TD_FLIGHT_STATUS_DATA) -> bool {
    let amiss = TdInterlock::TD_INTERLOCK_ABORT_LATCHED
        | TdInterlock::TD_INTERLOCK_NO_LIGHT
        | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    match status.phase {
        TdPhase::TD_PHASE_TOUCHDOWN | TdPhase::TD_PHASE_SAFED | TdPhase::TD_PHASE_CHUTE => true,
        // Whoever arms and starts it is told by other words.
        TdPhase::TD_PHASE_PAD_ARMED => false,
        // Before a flight the motor is inhibited as it should be.
        phase if is_on_pad(phase) => {
            let latched = status.interlocks.contains(TdInterlock::TD_INTERLOCK_ABORT_LATCHED);
            latched || status.approach_wait_s > 0 || status.pad_wait_s > 0
        }
        _ => status.interlocks.intersects(amiss),
    }
}

/// Why the countdown was held and what follows from it; `None` while it is not held.
pub fn hold_words(vehicle: &Vehicle, armed_here: bool) -> Option<String> {
    let status = &vehicle.status.as_ref()?.value;
    let whom = if armed_here { "this station" } else { "its station" };
    let why = match status.hold {
        TdHold::TD_HOLD_NONE => return None,
        TdHold::TD_HOLD_UPLINK_SILENT => format!("the vehicle did not hear {whom} for 2 s"),
        TdHold::TD_HOLD_COMMANDED => "a station asked for it".to_owned(),
    };
    let held = status.phase == TdPhase::TD_PHASE_PAD_ARMED;
    held.then(|| format!("HOLD: {why}; start anew; disarms in {} s", status.hold_left_s))
}
