//! Two people who arm and start together, as the vehicle tells it: who asks, who has to confirm or to tap, who commands.

use std::time::Duration;

use protocol::dialect::{TdAct, TdRole};

use super::Model;
use super::permits::why_not_seat;

/// An ask or a tap is shown for this long after the vehicle was last heard of it.
const TOLD_FOR: Duration = Duration::from_secs(3);

/// The operator whose key signs what a station sends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyOwner {
    /// The number of the key, 1 to 15.
    pub number: u8,
    pub name: String,
}

/// An ask that waits for its confirmation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ask {
    pub act: TdAct,
    pub number: u16,
    /// The number of the key of whoever asks.
    pub by: u8,
    pub left: Duration,
}

impl Ask {
    /// As in `asks to arm`.
    pub fn act_name(&self) -> &'static str {
        if self.act == TdAct::TD_ACT_START { "start" } else { "arm" }
    }
}

pub fn role_name(role: TdRole) -> &'static str {
    match role {
        TdRole::TD_ROLE_OBSERVER => "OBSERVER",
        TdRole::TD_ROLE_RANGE_SAFETY => "RANGE SAFETY",
        TdRole::TD_ROLE_FLIGHT => "FLIGHT",
        TdRole::TD_ROLE_PAD => "PAD",
    }
}

impl Model {
    /// How many people an arming and a start take; `None` without operators.
    pub fn people(&self) -> Option<u8> {
        self.vehicle.crew.as_ref().map(|crew| crew.value.people)
    }

    /// The number of the key that this station signs with; 0 without an operator's key.
    pub fn key_number(&self) -> u8 {
        self.settings.key_owner.as_ref().map_or(0, |owner| owner.number)
    }

    /// The number of the key of who sits at this screen; 0 for anybody but its owner.
    pub fn own_number(&self) -> u8 {
        let is_owner = why_not_seat(self, &self.settings.seat).is_none();
        if is_owner || self.settings.seat.screen == 0 { self.key_number() } else { 0 }
    }

    /// The role of an operator, as the vehicle tells it.
    pub fn role_of(&self, number: u8) -> Option<TdRole> {
        self.vehicle.operators.get(&number).map(|(role, _)| *role)
    }

    /// An operator by role and name.
    pub fn operator(&self, number: u8) -> String {
        match self.vehicle.operators.get(&number) {
            Some((role, name)) => format!("{} {name}", role_name(*role)),
            None => format!("operator {number}"),
        }
    }

    /// The ask that waits.
    pub fn ask(&self, now: Duration) -> Option<Ask> {
        let crew = self.vehicle.crew.as_ref().filter(|crew| crew.age(now) <= TOLD_FOR)?;
        let left = Duration::from_millis(crew.value.ask_left_ms.into()).saturating_sub(crew.age(now));
        let waits = crew.value.act != TdAct::TD_ACT_NONE && !left.is_zero();
        waits.then_some(Ask {
            act: crew.value.act,
            number: crew.value.ask_number,
            by: crew.value.asked_by,
            left,
        })
    }

    /// The ask that our operator may confirm.
    pub fn ask_to_confirm(&self, now: Duration) -> Option<Ask> {
        let own = self.key_number();
        let differs = |ask: &Ask| {
            ask.by != own && self.role_of(own).is_some() && self.role_of(own) != self.role_of(ask.by)
        };
        self.ask(now).filter(|_| own > 0).filter(differs)
    }

    /// Who has to tap, and how long is left.
    pub fn tapping(&self, now: Duration) -> Option<(u8, Duration)> {
        let crew = self.vehicle.crew.as_ref().filter(|crew| crew.age(now) <= TOLD_FOR)?;
        let counting = self.vehicle.countdown_s().is_some_and(|left| left.value > 0.0);
        let left = Duration::from_millis(crew.value.tap_left_ms.into()).saturating_sub(crew.age(now));
        (crew.value.tapped_by > 0 && counting).then_some((crew.value.tapped_by, left))
    }

    /// The operator who commands, by the number of their key; `None` if nobody has armed it.
    pub fn commanded_by(&self) -> Option<u8> {
        self.vehicle.crew.as_ref().map(|crew| crew.value.commanded_by).filter(|number| *number > 0)
    }
}
