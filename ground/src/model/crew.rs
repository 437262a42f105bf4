//! Who sits at the screens of this station that can command.

use std::time::Duration;

use super::seat::Seat;

/// A countdown goes on without a commanding screen for this long at most.
pub const ALONE_MAX: Duration = Duration::from_secs(5);

/// The commanding screens: the station's own, and attached ones that do not only watch.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Crew {
    seats: Vec<Seat>,
    /// When the last one went.
    gone_at: Option<Duration>,
    /// When the hold is asked for next; `None` while it is not asked for.
    pub(crate) hold_due: Option<Duration>,
}

impl Crew {
    /// These are there now.
    pub fn sit(&mut self, seats: Vec<Seat>, now: Duration) {
        if !seats.is_empty() {
            self.gone_at = None;
        } else if !self.seats.is_empty() {
            self.gone_at = Some(now);
        }
        self.seats = seats;
    }

    /// Who is there.
    pub fn seats(&self) -> &[Seat] {
        &self.seats
    }

    /// Their names, short.
    pub fn names(&self) -> Vec<String> {
        let name = |seat: &Seat| match seat.operator.split_whitespace().next() {
            Some(name) => name.to_owned(),
            None => seat.to_string(),
        };
        self.seats.iter().map(name).collect()
    }

    /// Whether the last one has been gone for too long.
    pub fn is_gone(&self, now: Duration) -> bool {
        self.gone_at.is_some_and(|at| now.saturating_sub(at) >= ALONE_MAX)
    }

    /// Who commands, in words.
    pub fn words(&self) -> String {
        if self.seats.is_empty() {
            return "nobody commands".to_owned();
        }
        let seats: Vec<String> = self.seats.iter().map(Seat::to_string).collect();
        format!("at the controls: {}", seats.join("; "))
    }
}
