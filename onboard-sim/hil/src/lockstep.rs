//! The world's end of the wire in lockstep: one frame at a time, sent again until it is answered.
//!
//! A lost, late, doubled or reordered frame or answer, and a link that is unplugged and plugged in again, cost time and
//! change nothing else. Only a computer that stays silent for [`Patience::give_up_after`], or that has lost the flight
//! because it was restarted, ends the flight.

use core::time::Duration;

/// How long the world waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// A frame without an answer is sent again after this time.
    pub send_again_after: Duration,
    /// After this time without an answer the flight is given up.
    pub give_up_after: Duration,
}

/// What the world does now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Due {
    /// It waits until this time.
    Wait(Duration),
    /// It sends the frame again.
    SendAgain,
    /// It ends the flight.
    GiveUp,
}

/// What an answer is to the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Heard {
    /// The answer that it waits for.
    Awaited,
    /// An answer to an earlier frame: late or doubled.
    Old,
    /// An answer to a frame that was not sent.
    NeverAsked,
}

/// What happened on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Frames that were answered.
    pub answered: u64,
    /// Frames that were sent again.
    pub sent_again: u64,
    /// Answers that were late or doubled.
    pub old: u64,
    /// Answers to frames that were not sent.
    pub never_asked: u64,
}

/// The frame that the world waits for.
#[derive(Debug, Clone)]
pub struct Lockstep {
    patience: Patience,
    frame: u64,
    answered: bool,
    first_sent: Duration,
    last_sent: Duration,
    counts: Counts,
}

impl Lockstep {
    /// The start of a flight was sent at this time; it is answered as frame 0.
    pub fn started(patience: Patience, now: Duration) -> Self {
        let counts = Counts::default();
        Self { patience, frame: 0, answered: false, first_sent: now, last_sent: now, counts }
    }

    /// The next frame was sent; returns its number. The one before it must have been answered.
    pub fn sent_next(&mut self, now: Duration) -> u64 {
        debug_assert!(self.answered, "frame {} is not answered", self.frame);
        (self.frame, self.answered) = (self.frame + 1, false);
        (self.first_sent, self.last_sent) = (now, now);
        self.frame
    }

    /// An answer to a frame has arrived.
    pub fn heard(&mut self, frame: u64) -> Heard {
        if frame > self.frame {
            self.counts.never_asked += 1;
            return Heard::NeverAsked;
        }
        if frame < self.frame || self.answered {
            self.counts.old += 1;
            return Heard::Old;
        }
        self.counts.answered += 1;
        self.answered = true;
        Heard::Awaited
    }

    /// What is due at this time. [`Due::SendAgain`] counts as done.
    pub fn due(&mut self, now: Duration) -> Due {
        if self.waited(now) >= self.patience.give_up_after {
            return Due::GiveUp;
        }
        let again_at = self.last_sent + self.patience.send_again_after;
        if now < again_at {
            return Due::Wait(again_at.min(self.first_sent + self.patience.give_up_after));
        }
        self.last_sent = now;
        self.counts.sent_again += 1;
        Due::SendAgain
    }

    /// How long the frame that was sent last has been on its way.
    pub fn waited(&self, now: Duration) -> Duration {
        now.saturating_sub(self.first_sent)
    }

    /// The frame that was sent last.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    pub fn counts(&self) -> &Counts {
        &self.counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Patience =
        Patience { send_again_after: Duration::from_millis(100), give_up_after: Duration::from_secs(1) };

    fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    #[test]
    fn a_frame_is_sent_again_until_it_is_answered() {
        let mut world = Lockstep::started(PATIENCE, ms(0));
        assert_eq!(world.due(ms(99)), Due::Wait(ms(100)));
        assert_eq!(world.due(ms(100)), Due::SendAgain);
        assert_eq!(world.due(ms(150)), Due::Wait(ms(200)));
        assert_eq!(world.due(ms(250)), Due::SendAgain);
        assert_eq!(world.heard(0), Heard::Awaited);
        assert_eq!(world.sent_next(ms(260)), 1);
        assert_eq!(world.due(ms(300)), Due::Wait(ms(360)));
        assert_eq!(world.counts().sent_again, 2);
    }

    #[test]
    fn a_silent_computer_ends_the_flight() {
        let mut world = Lockstep::started(PATIENCE, ms(0));
        world.heard(0);
        world.sent_next(ms(500));
        assert_eq!(world.due(ms(1480)), Due::SendAgain);
        assert_eq!(world.due(ms(1490)), Due::Wait(ms(1500)), "no longer than until it gives up");
        assert_eq!(world.due(ms(1500)), Due::GiveUp);
        assert_eq!(world.waited(ms(1500)), ms(1000), "not since the start of the flight");
    }

    #[test]
    fn late_doubled_and_impossible_answers_are_counted_and_ignored() {
        let mut world = Lockstep::started(PATIENCE, ms(0));
        world.heard(0);
        world.sent_next(ms(1));
        assert_eq!(world.heard(0), Heard::Old);
        assert_eq!(world.heard(2), Heard::NeverAsked);
        assert_eq!(world.heard(1), Heard::Awaited);
        assert_eq!(world.heard(1), Heard::Old);
        assert_eq!(*world.counts(), Counts { answered: 2, sent_again: 0, old: 2, never_asked: 1 });
    }
}
