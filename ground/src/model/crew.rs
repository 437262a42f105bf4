//! The crew: who sits at the screens that can command.

use std::time::Duration;

use super::seat::Seat;

/// How long a countdown may continue without a commanding screen.
pub const UNATTENDED_MAX: Duration = Duration::from_secs(2);

/// The seats at commanding screens: the station's own screen and the attached ones without `--watch`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Crew {
    seats: Vec<Seat>,
    /// When the last one left; `None` while somebody is there.
    gone_at: Option<Duration>,
    /// When the next hold is to be sent; `None` while no hold is needed.
    pub(crate) hold_due: Option<Duration>,
    /// It was said that a hold comes too late.
    pub(crate) too_late_told: bool,
}

impl Crew {
    /// Sets who is there now.
    pub fn set_seats(&mut self, seats: Vec<Seat>, now: Duration) {
        if !seats.is_empty() {
            self.gone_at = None;
        } else if !self.seats.is_empty() {
            self.gone_at = Some(now);
        }
        self.seats = seats;
    }

    pub fn seats(&self) -> &[Seat] {
        &self.seats
    }

    /// The first word of each operator's name, or the screen.
    pub fn names(&self) -> Vec<String> {
        let name = |seat: &Seat| match seat.operator.split_whitespace().next() {
            Some(name) => name.to_owned(),
            None => seat.to_string(),
        };
        self.seats.iter().map(name).collect()
    }

    /// Whether no commanding screen has been there for too long.
    pub fn is_gone(&self, now: Duration) -> bool {
        self.gone_at.is_some_and(|at| now.saturating_sub(at) >= UNATTENDED_MAX)
    }

    /// A sentence that says who can command.
    pub fn words(&self) -> String {
        if self.seats.is_empty() {
            return "nobody commands".to_owned();
        }
        let seats: Vec<String> = self.seats.iter().map(Seat::to_string).collect();
        format!("at the controls: {}", seats.join("; "))
    }
}
