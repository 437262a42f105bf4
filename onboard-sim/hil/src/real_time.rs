//! The world's end of the wire in real time: it waits for nothing, and acts on the newest answer.
//!
//! The servos keep the last position that was commanded. A current (igniters, separation) flows only while answers come:
//! after [`CURRENT_FRAMES`] frames without one it stops.

use flight::computer::Commands;
use flight::rules::phase::Phase;

use crate::computer::Answer;

/// Without an answer for this many frames no current flows any more: 100 ms.
pub const CURRENT_FRAMES: u64 = 20;

/// What happened on the wire.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counts {
    /// Frames of the world by the age of the answer that they were moved by, in frames; the last holds all older ones.
    /// An age of 1 is the best: the answer to the frame before.
    pub by_age: [u64; OLDEST + 1],
    /// Answers that came after a newer one, or twice.
    pub old: u64,
}

/// Ages of this many frames and more are counted together.
pub const OLDEST: usize = 8;

/// The newest answer.
#[derive(Debug, Clone)]
pub struct RealTime {
    newest: Answer,
    counts: Counts,
}

impl RealTime {
    /// The flight begins with the answer to its start.
    pub fn started(answer: &Answer) -> Self {
        Self { newest: *answer, counts: Counts { by_age: [0; OLDEST + 1], old: 0 } }
    }

    /// An answer of this flight has arrived.
    pub fn heard(&mut self, answer: &Answer) {
        if answer.frame > self.newest.frame {
            self.newest = *answer;
        } else {
            self.counts.old += 1;
        }
    }

    /// What moves the world in the frame with this number.
    pub fn commands(&mut self, frame: u64) -> Commands {
        let age = frame.saturating_sub(self.newest.frame);
        self.counts.by_age[usize::try_from(age).map_or(OLDEST, |age| age.min(OLDEST))] += 1;
        let commands = self.newest.commands;
        if age > CURRENT_FRAMES { commands.without_currents().widen() } else { commands.widen() }
    }

    /// The phase that the computer last told.
    pub fn phase(&self) -> Phase {
        self.newest.phase
    }

    /// The frame that was answered last.
    pub fn answered(&self) -> u64 {
        self.newest.frame
    }

    /// Lost frames that the computer flew with the last inertial sample.
    pub fn held(&self) -> u64 {
        self.newest.held
    }

    pub fn counts(&self) -> &Counts {
        &self.counts
    }
}

#[cfg(test)]
mod tests {
    use flight::computer::pilot::BoosterCommands;

    use super::*;
    use crate::carried::CarriedCommands;

    fn answer(frame: u64, pitch_quarter_turns: f32) -> Answer {
        let commands = CarriedCommands {
            gimbal_quarter_turns: [pitch_quarter_turns, 0.0],
            fins_quarter_turns: [0.5; 4],
            ignite: true,
            parachute: false,
            booster: BoosterCommands::default(),
        };
        Answer { flight_id: 1, frame, commands, phase: Phase::Ignition, digest: 0, held: 0 }
    }

    #[test]
    fn the_newest_answer_counts_and_older_ones_are_ignored() {
        let mut world = RealTime::started(&answer(0, 0.0));
        world.heard(&answer(2, 0.02));
        world.heard(&answer(1, 0.01));
        world.heard(&answer(2, 0.02));
        assert_eq!(world.commands(3), answer(2, 0.02).commands.widen());
        assert_eq!((world.counts().old, world.answered()), (2, 2));
        assert_eq!(world.counts().by_age[1], 1);
    }

    #[test]
    fn without_answers_the_servos_stay_and_currents_end() {
        let mut world = RealTime::started(&answer(0, 0.03));
        assert!(world.commands(CURRENT_FRAMES).ignite);
        let later = world.commands(CURRENT_FRAMES + 1);
        assert!(!later.ignite);
        let kept = answer(0, 0.03).commands.widen();
        assert_eq!((later.gimbal_rad, later.fins_rad), (kept.gimbal_rad, kept.fins_rad));
        assert_eq!(world.counts().by_age[OLDEST], 2);
    }
}
