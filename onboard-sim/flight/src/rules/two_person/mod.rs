//! Arming and start by two people of different roles: one asks, another confirms.
//!
//! A state machine of its own: it takes who asks for what and when, and answers. Nothing is armed or started here; the
//! phase table still decides what an agreed request does.
//!
//! An ask has a number, and a confirmation names it: two people who ask at the same moment have not confirmed each
//! other, and a confirmation that was meant for an earlier ask, or is sent again later, confirms nothing. From the
//! agreed start to the release the one who confirmed it taps a key (or the one who asked, if the other is in command: it
//! takes two in the countdown, too); without a tap for [`TAP_WITHIN_S`] the countdown is held. A terminal reports no release of a key, so the taps stand for the hand on a dead-man's switch, which amateur
//! launch sites ask of a second person.

use core::fmt;

use super::operator::Operator;
use crate::computer::memory::remembers;

/// How long an ask waits for its confirmation, s.
pub const CONFIRM_WITHIN_S: f64 = 10.0;

/// The longest time between two taps, s. As long as the silence of a station that holds the countdown.
pub const TAP_WITHIN_S: f64 = 2.0;

/// The number of the n-th ask from 0, never 0: a command without a number confirms nothing.
fn ask_number(first: u16, nth: u16) -> u16 {
    let place = (u32::from(first) + u32::from(nth)) % u32::from(u16::MAX);
    place as u16 + 1
}

/// What takes two people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Act {
    Arm = 1,
    Start = 2,
}

impl Act {
    pub fn name(self) -> &'static str {
        match self {
            Self::Arm => "arm",
            Self::Start => "start",
        }
    }
}

/// A ground station, as the vehicle tells it apart from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Station {
    /// MAVLink system.
    pub system: u8,
    /// MAVLink component.
    pub component: u8,
    /// Which of those that were heard under these ids: every station has another number. 0 in logs from before they were
    /// told apart.
    pub number: u32,
}

impl fmt::Display for Station {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}/{}", self.system, self.component)
    }
}

/// An ask that waits for its confirmation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ask {
    pub act: Act,
    /// A confirmation names it: 1 to 65,535, another one for each ask.
    pub number: u16,
    pub by: Operator,
    pub station: Station,
    pub at_s: f64,
}

impl Ask {
    /// Time left to confirm it, s; not positive once it has lapsed.
    pub fn left_s(&self, time_s: f64) -> f64 {
        self.at_s + CONFIRM_WITHIN_S - time_s
    }

    /// Also false for a time that is not a number.
    fn waits(&self, time_s: f64) -> bool {
        self.left_s(time_s) >= 0.0 && time_s >= self.at_s
    }
}

/// Whose taps keep the countdown running.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tapping {
    pub by: Operator,
    /// The last tap, s.
    pub at_s: f64,
}

impl Tapping {
    /// Time left for the next tap, s; negative once it is overdue.
    pub fn left_s(&self, time_s: f64) -> f64 {
        self.at_s + TAP_WITHIN_S - time_s
    }
}

/// Why a request is not an agreement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refusal {
    /// Observers command nothing.
    Observer,
    /// Another person's ask already waits: it is to be confirmed.
    AnotherAsks(Ask),
    /// Nothing waits for a confirmation, or another number or act does.
    NothingToConfirm,
    /// Nobody confirms their own ask.
    OwnAsk(Ask),
    /// The same role may not confirm.
    SameRole(Ask),
}

/// The answer to a request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reply {
    /// Noted: now somebody of another role has to confirm.
    Asked(Ask),
    /// Two people of different roles have agreed.
    Agreed {
        ask: Ask,
        confirmed_by: Operator,
    },
    Refused(Refusal),
}

/// What is asked, and whose taps are waited for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TwoPerson {
    /// How many asks there were.
    asks: u16,
    ask: Option<Ask>,
    /// The agreed ask that armed the vehicle.
    armed: Option<Ask>,
    tapping: Option<Tapping>,
}

impl TwoPerson {
    /// Asks for an act, or confirms the ask of this number. `first` is where the numbers of the asks begin.
    pub fn request(
        &mut self,
        act: Act,
        confirms: Option<u16>,
        (by, station): (Operator, Station),
        first: u16,
        time_s: f64,
    ) -> Reply {
        if !by.role.may_command() {
            return Reply::Refused(Refusal::Observer);
        }
        let waiting = self.waiting(time_s);
        let Some(number) = confirms else {
            return match waiting {
                Some(ask) if ask.by.number != by.number => Reply::Refused(Refusal::AnotherAsks(ask)),
                // A repeated ask does not wait longer.
                Some(ask) if ask.act == act => Reply::Asked(ask),
                _ => self.ask(act, (by, station), first, time_s),
            };
        };
        let Some(ask) = waiting.filter(|ask| ask.act == act && ask.number == number) else {
            return Reply::Refused(Refusal::NothingToConfirm);
        };
        if ask.by.number == by.number {
            return Reply::Refused(Refusal::OwnAsk(ask));
        }
        if ask.by.role == by.role {
            return Reply::Refused(Refusal::SameRole(ask));
        }
        self.ask = None;
        Reply::Agreed { ask, confirmed_by: by }
    }

    fn ask(&mut self, act: Act, (by, station): (Operator, Station), first: u16, time_s: f64) -> Reply {
        let number = ask_number(first, self.asks);
        let ask = Ask { act, number, by, station, at_s: time_s };
        self.asks = self.asks.wrapping_add(1);
        self.ask = Some(ask);
        Reply::Asked(ask)
    }

    /// The ask that waits for its confirmation.
    pub fn waiting(&self, time_s: f64) -> Option<Ask> {
        self.ask.filter(|ask| ask.waits(time_s))
    }

    /// Takes back what is asked: an abort, a disarm or a hold came.
    pub fn withdraw(&mut self) {
        self.ask = None;
    }

    /// Notes that the agreed ask has armed the vehicle.
    pub fn armed(&mut self, ask: Ask) {
        self.armed = Some(ask);
    }

    /// The ask that armed the vehicle: the one who asked is in command.
    pub fn armed_by(&self) -> Option<Ask> {
        self.armed
    }

    /// The countdown has begun: from now on this operator taps, who is not in command.
    pub fn begin_taps(&mut self, by: Operator, time_s: f64) {
        self.tapping = Some(Tapping { by, at_s: time_s });
    }

    /// Takes a tap; returns whether it counts.
    pub fn tap(&mut self, by: Operator, time_s: f64) -> bool {
        let Some(tapping) = self.tapping.as_mut().filter(|tapping| tapping.by.number == by.number) else {
            return false;
        };
        tapping.at_s = tapping.at_s.max(time_s);
        true
    }

    /// The countdown has ended or is held: no taps are waited for.
    pub fn end_taps(&mut self) {
        self.tapping = None;
    }

    /// Whose taps keep the countdown running.
    pub fn tapping(&self) -> Option<Tapping> {
        self.tapping
    }

    /// The operator whose taps are overdue.
    pub fn lapsed(&self, time_s: f64) -> Option<Operator> {
        // A time that is not a number has lapsed, too.
        let in_time = |tapping: &Tapping| tapping.left_s(time_s) >= 0.0;
        self.tapping.filter(|tapping| !in_time(tapping)).map(|tapping| tapping.by)
    }
}

remembers!(TwoPerson { asks, ask, armed, tapping });

#[cfg(test)]
mod tests;
