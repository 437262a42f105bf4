//! The crew: the operators at the screens that can command, and the two people who arm and start
//! together.

use std::fmt;
use std::time::Duration;

use protocol::dialect::{TD_CREW_DATA, TdAct, TdRole};
use serde::{Deserialize, Serialize};

use super::{Model, why_not_seat, words};

/// How long a countdown may continue without a commanding screen that answers. The vehicle must
/// hold 1 s after the last one has left: the rest is for the hold and its latency.
pub const UNATTENDED_MAX: Duration = Duration::from_millis(800);

/// The seats at commanding screens: the station's own screen and the attached ones without
/// `--watch`, as long as their terminals answer.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Crew {
    seats: Vec<Seat>,
    /// The screens that could command if a person saw them.
    silent: Vec<(Seat, Silence)>,
    /// When the last one left; `None` while one is there.
    absent_since: Option<Duration>,
    /// When the next hold is to be sent; `None` while no hold is needed.
    pub(crate) hold_due: Option<Duration>,
    /// Why this station holds the countdown, until another one runs.
    pub(crate) held_because: Option<String>,
    /// The event that a hold comes too late was reported.
    pub(crate) too_late_reported: bool,
}

impl Crew {
    /// Sets the present seats, and the screens that do not answer: they have been silent for
    /// [`UNATTENDED_MAX`] already.
    pub fn set_seats(&mut self, seats: Vec<Seat>, silent: Vec<(Seat, Silence)>, now: Duration) {
        if !seats.is_empty() {
            self.absent_since = None;
        } else if !silent.is_empty() {
            self.absent_since = Some(now.saturating_sub(UNATTENDED_MAX));
        } else if !self.seats.is_empty() {
            self.absent_since = Some(now);
        }
        (self.seats, self.silent) = (seats, silent);
    }

    pub fn seats(&self) -> &[Seat] {
        &self.seats
    }

    pub fn silent(&self) -> &[(Seat, Silence)] {
        &self.silent
    }

    /// The first word of each operator's name, or the screen, each once.
    pub fn names(&self) -> Vec<String> {
        let name = |seat: &Seat| match seat.operator.split_whitespace().next() {
            Some(name) => name.to_owned(),
            None => seat.to_string(),
        };
        let mut names: Vec<String> = self.seats.iter().map(name).collect();
        names.sort();
        names.dedup();
        names
    }

    /// Whether no commanding screen has been there for too long.
    pub fn is_absent(&self, now: Duration) -> bool {
        self.absent_since.is_some_and(|at| now.saturating_sub(at) >= UNATTENDED_MAX)
    }

    /// A sentence that names who can command.
    pub fn words(&self) -> String {
        let listed = |seats: &[Seat]| seats.iter().map(Seat::to_string).collect::<Vec<_>>().join("; ");
        let there = match &self.seats[..] {
            [] => "no commanding screen".to_owned(),
            seats => format!("at the controls: {}", listed(seats)),
        };
        match &self.silent[..] {
            [] => there,
            silent => {
                let each = silent.iter().map(|(seat, why)| format!("{seat} {why}")).collect::<Vec<_>>();
                format!("{there}; does not count: {}", each.join("; "))
            }
        }
    }

    /// Why no screen counts, on the screen of `ours`; `None` if one does, or there is none.
    pub(crate) fn silence(&self, ours: &Seat) -> Option<String> {
        let (seat, why) = self.silent.first().filter(|_| self.seats.is_empty())?;
        Some(if seat == ours { format!("this screen {why}") } else { format!("{seat} {why}") })
    }
}

/// Why a screen does not count: no person can see it, or command at it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Silence {
    /// The terminal answers no query.
    #[default]
    NoAnswer,
    /// It has too few columns or rows.
    TooSmall,
    TmuxWithoutClient,
    /// tmux shows the past of the pane, and takes the keys.
    TmuxCopyMode,
    /// tmux shows another window, or another pane that is zoomed.
    TmuxElsewhere,
}

impl fmt::Display for Silence {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::NoAnswer => "does not answer",
            Self::TooSmall => "is too small",
            Self::TmuxWithoutClient => "is not shown (tmux has no client)",
            Self::TmuxCopyMode => "is not shown (tmux is in copy mode)",
            Self::TmuxElsewhere => "is not shown (tmux shows another pane)",
        })
    }
}

// A seat: a screen of the station and the operator who sits at it.

/// An operator at a screen. The station numbers its screens from 1.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seat {
    /// The screen's number; 0 for none.
    pub screen: u32,
    /// The operator; empty if unknown.
    pub operator: String,
}

impl Seat {
    pub fn new(screen: u32, operator: impl Into<String>) -> Self {
        Self { screen, operator: operator.into() }
    }

    /// The automatic mode, which has no screen.
    pub fn automatic() -> Self {
        Self::new(0, "automatic mode")
    }

    /// For the end of a text, as in ` (screen 2, anna)`; empty if nothing is known.
    pub fn in_brackets(&self) -> String {
        let words = self.to_string();
        if words.is_empty() { words } else { format!(" ({words})") }
    }
}

impl fmt::Display for Seat {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.screen, self.operator.as_str()) {
            (0, operator) => out.write_str(operator),
            (screen, "") => write!(out, "screen {screen}"),
            (screen, operator) => write!(out, "screen {screen}, {operator}"),
        }
    }
}

// Two people who arm and start together, as the vehicle reports it: who proposes, who has to
// confirm or to tap, who commands.

/// How long a proposal or a tap is shown after the vehicle's last report of it.
const CREW_VALID_FOR: Duration = Duration::from_secs(3);

/// The operator whose key signs a station's frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyOwner {
    /// The number of the key, 1 to 15.
    pub number: u8,
    pub name: String,
}

/// A proposal to arm or start that waits for its confirmation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proposal {
    pub act: TdAct,
    pub number: u16,
    /// The key number of the proposer.
    pub by: u8,
    pub left: Duration,
}

impl Proposal {
    /// As in `requests to arm`.
    pub fn act_name(&self) -> &'static str {
        if self.act == TdAct::TD_ACT_START { "start" } else { "arm" }
    }
}

/// As in `RANGE SAFETY`.
pub fn role_name(role: TdRole) -> String {
    words::without_prefix(&role, "TD_ROLE_").replace('_', " ")
}

impl Model {
    /// How many people must agree to arm and start; `None` without operators.
    pub fn people(&self) -> Option<u8> {
        self.vehicle.last::<TD_CREW_DATA>().map(|crew| crew.value.people)
    }

    /// The number of the key that this station signs with; 0 without an operator's key.
    pub fn key_number(&self) -> u8 {
        self.settings.key_owner.as_ref().map_or(0, |owner| owner.number)
    }

    /// The key number of the operator at this screen; 0 if that is not the key's owner.
    pub fn seat_key(&self) -> u8 {
        let is_owner = why_not_seat(self, &self.settings.seat).is_none();
        if is_owner || self.settings.seat.screen == 0 { self.key_number() } else { 0 }
    }

    /// The role of an operator, as the vehicle reports it.
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

    /// The proposal that waits.
    pub fn proposal(&self, now: Duration) -> Option<Proposal> {
        let crew = self.vehicle.last::<TD_CREW_DATA>().filter(|crew| crew.age(now) <= CREW_VALID_FOR)?;
        let left = Duration::from_millis(crew.value.ask_left_ms.into()).saturating_sub(crew.age(now));
        let TD_CREW_DATA { act, ask_number: number, asked_by: by, .. } = crew.value;
        let waits = act != TdAct::TD_ACT_NONE && !left.is_zero();
        waits.then_some(Proposal { act, number, by, left })
    }

    /// The proposal that our operator may confirm.
    pub fn open_proposal(&self, now: Duration) -> Option<Proposal> {
        let ours = self.key_number();
        let differs = |proposal: &Proposal| {
            proposal.by != ours
                && self.role_of(ours).is_some()
                && self.role_of(ours) != self.role_of(proposal.by)
        };
        self.proposal(now).filter(|_| ours > 0).filter(differs)
    }

    /// Who has to tap, and how long is left.
    pub fn tapping(&self, now: Duration) -> Option<(u8, Duration)> {
        let crew = self.vehicle.last::<TD_CREW_DATA>().filter(|crew| crew.age(now) <= CREW_VALID_FOR)?;
        let left = Duration::from_millis(crew.value.tap_left_ms.into()).saturating_sub(crew.age(now));
        (crew.value.tapped_by > 0 && self.vehicle.counts_down()).then_some((crew.value.tapped_by, left))
    }

    /// The operator who commands, by the number of their key; `None` before an arming.
    pub fn commanded_by(&self) -> Option<u8> {
        self.vehicle.last::<TD_CREW_DATA>().map(|crew| crew.value.commanded_by).filter(|number| *number > 0)
    }
}
