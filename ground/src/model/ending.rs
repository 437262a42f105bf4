//! How a flight ended: one of four ends, each with its word.

use std::time::Duration;

use protocol::dialect::{TdChute, TdPhase};

use super::dead_reckoning::{is_unheard, may_have_left, predict_position};
use super::touchdown::are_of_legs;
use super::vehicle::{Vehicle, Verdict};

/// A vehicle that hits the ground at this speed or faster, m/s, is a wreck: that of a fall from 5 m. Its legs withstand
/// 1 m/s, and under an open parachute it comes down at 6 m/s.
const WRECKED_FROM_M_S: f64 = 10.0;
/// After this long without a word, a vehicle in flight whose fall cannot be predicted is down: 300 m under a parachute
/// take 50 s.
const SURELY_DOWN_AFTER: Duration = Duration::from_mins(2);

/// The four ends of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// It stands, inside every limit.
    Landed,
    /// It came down under an open parachute.
    UnderParachute,
    /// It met the ground outside a limit.
    Hard,
    /// It is a wreck, or it fell silent in flight and must be down.
    Lost,
}

impl Ending {
    /// The word that every screen uses.
    pub fn word(self) -> &'static str {
        match self {
            Self::Landed => "LANDED",
            Self::UnderParachute => "DOWN UNDER THE PARACHUTE",
            Self::Hard => "HARD LANDING",
            Self::Lost => "LOST",
        }
    }

    /// The end of this flight; `None` while it goes on, or while nothing has been told of its end.
    pub fn of(vehicle: &Vehicle, now: Duration) -> Option<Self> {
        if let Some(verdict) = vehicle.verdict {
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
        let (along_m_s, across_m_s) = (verdict.touchdown.u_m_s, verdict.touchdown.w_m_s);
        if verdict.landed {
            Self::Landed
        } else if hangs_on_its_chute(vehicle) && along_m_s.abs() < WRECKED_FROM_M_S {
            Self::UnderParachute
        } else if libm::hypot(along_m_s, across_m_s) < WRECKED_FROM_M_S {
            Self::Hard
        } else {
            Self::Lost
        }
    }

    /// The word with what is known of this end.
    pub fn sentence(self, vehicle: &Vehicle) -> String {
        format!("{}{}", self.word(), self.detail(vehicle))
    }

    /// What is known of this end: what follows the word.
    pub fn detail(self, vehicle: &Vehicle) -> String {
        let verdict = vehicle.verdict.map(|verdict| verdict.value);
        let speed_m_s = verdict.map(|verdict| libm::hypot(verdict.touchdown.u_m_s, verdict.touchdown.w_m_s));
        match (self, verdict) {
            (Self::Landed, _) if vehicle.limits.as_ref().is_some_and(are_of_legs) => {
                " inside every limit of the legs".to_owned()
            }
            (Self::Landed, _) => " inside every limit".to_owned(),
            (Self::UnderParachute, Some(verdict)) => {
                format!(", sinking at {:.1} m/s", verdict.touchdown.u_m_s.abs())
            }
            (Self::Hard, Some(verdict)) => match verdict.touchdown.violations() {
                Some(names) => format!(": outside {names}"),
                None => ": it did not stay upright".to_owned(),
            },
            (Self::Lost, Some(_)) => format!(": hit the ground at {:.0} m/s", speed_m_s.unwrap_or_default()),
            (Self::Lost, None) => ": it fell silent in flight and must be down".to_owned(),
            (Self::UnderParachute | Self::Hard, None) => String::new(),
        }
    }
}

/// Whether its parachute was open when last told.
fn hangs_on_its_chute(vehicle: &Vehicle) -> bool {
    vehicle.descent.as_ref().is_some_and(|descent| descent.value.chute == TdChute::TD_CHUTE_OPEN)
}

/// Whether it fell silent in flight so long ago that it must have come down.
fn is_silent_and_down(vehicle: &Vehicle, now: Duration) -> bool {
    if let Some(since) = may_have_left(vehicle, now) {
        return since >= SURELY_DOWN_AFTER;
    }
    if !is_unheard(vehicle, now) {
        return false;
    }
    let silence = vehicle.phase().map_or(Duration::ZERO, |phase| phase.age(now));
    predict_position(vehicle, now).map_or(silence >= SURELY_DOWN_AFTER, |at| at.is_down)
}
