//! Finds a servo that does not follow its command, from a few messages a second.
//!
//! One message alone shows nothing: a servo that turns towards a new command is as far from it as one that is stuck. (In
//! 60 nominal burns of mk2 and 100 of the F15 3 % of the messages have a gap of more than 2 degrees, 1.5 % of more than 3.)
//! Two messages do, both with a gap: a servo whose command is 3 degrees away turns at 250 degrees a second, so it stands at the very
//! centidegree of a quarter of a second before only by chance: the angles of a burn spread over some 4 degrees, and one of
//! 400 centidegrees, or a neighbour, is hit with a probability of 0.75 %. With 1.5 % of such gaps and 32 pairs of messages
//! in a burn this makes one false flag in 280 flights.
//!
//! A fin is heard twice a second and is commanded in large steps that may come back between two messages, so one pair shows
//! less: 2 of 100 nominal flights had one. Two pairs in a row do.

/// Largest change of the angle of a servo that stands still, degrees: the last digit of a message.
const STANDS_STILL_DEG: f64 = 0.011;
/// What a servo may be off its command at rest, degrees: the play of its linkage, half a degree on either side, and rounding.
const PLAY_DEG: f64 = 0.6;
/// A shorter time between two messages does not tell a standing servo from a turning one, s.
const APART_S: f64 = 0.1;

/// One servo.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct FollowingWatch {
    /// Time, s, command and angle, degrees.
    last: Option<(f64, f64, f64)>,
    /// Pairs of messages in a row in which it stood.
    stood: u32,
    flagged: bool,
}

/// What shows that a servo is stuck.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stuck {
    /// Distance from its command, degrees.
    pub(super) gap_deg: f64,
    /// Pairs of messages in a row.
    pub(super) pairs: u32,
}

impl FollowingWatch {
    /// Takes a command and an angle, degrees. Returns whether the servo is stuck: it stands still although its command is
    /// elsewhere. It says so once.
    pub(super) fn take(
        &mut self,
        time_s: f64,
        commanded_deg: f64,
        measured_deg: f64,
        shown_by: Stuck,
    ) -> bool {
        let Some((then_s, wanted_deg, then_deg)) = self.last else {
            self.last = Some((time_s, commanded_deg, measured_deg));
            return false;
        };
        if time_s - then_s < APART_S {
            return false;
        }
        self.last = Some((time_s, commanded_deg, measured_deg));
        // A servo at its command rests, until the command changes.
        let had_to_turn = (wanted_deg - then_deg).abs() > PLAY_DEG;
        let stands = had_to_turn && (measured_deg - then_deg).abs() < STANDS_STILL_DEG;
        let apart = stands && (commanded_deg - measured_deg).abs() > shown_by.gap_deg;
        self.stood = if apart { self.stood + 1 } else { 0 };
        let stuck = self.stood >= shown_by.pairs;
        let news = stuck && !self.flagged;
        self.flagged |= stuck;
        news
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIMBAL: Stuck = Stuck { gap_deg: 3.0, pairs: 1 };
    const FIN: Stuck = Stuck { gap_deg: 6.0, pairs: 2 };

    #[test]
    fn a_turning_servo_is_not_stuck_however_far_its_command_is() {
        let mut servo = FollowingWatch::default();
        assert!(!servo.take(0.0, 7.0, 0.0, GIMBAL));
        assert!(!servo.take(0.25, -7.0, 6.9, GIMBAL));
        assert!(!servo.take(0.5, 7.0, -6.9, GIMBAL));
    }

    #[test]
    fn a_servo_at_rest_near_its_command_is_not_stuck() {
        let mut servo = FollowingWatch::default();
        assert!(!servo.take(0.0, 0.0, 0.0, GIMBAL));
        assert!(!servo.take(0.25, 0.3, 0.0, GIMBAL));
    }

    #[test]
    fn a_servo_at_rest_whose_command_has_just_changed_is_not_stuck() {
        let mut servo = FollowingWatch::default();
        assert!(!servo.take(0.0, 90.0, 90.0, FIN));
        assert!(!servo.take(0.5, 20.0, 90.0, FIN));
    }

    #[test]
    fn a_stuck_servo_is_found_by_the_second_message_and_said_once() {
        let mut servo = FollowingWatch::default();
        assert!(!servo.take(0.0, -7.0, 3.0, GIMBAL));
        assert!(servo.take(0.25, -7.0, 3.0, GIMBAL));
        assert!(!servo.take(0.5, -7.0, 3.0, GIMBAL));
    }

    #[test]
    fn a_stuck_fin_is_found_by_the_third_message() {
        let mut servo = FollowingWatch::default();
        assert!(!servo.take(0.0, 20.0, 90.0, FIN));
        assert!(!servo.take(0.5, 20.0, 90.0, FIN));
        assert!(servo.take(1.0, 20.0, 90.0, FIN));
    }

    #[test]
    fn a_message_that_is_heard_twice_shows_nothing() {
        let mut servo = FollowingWatch::default();
        assert!(!servo.take(0.0, -7.0, 3.0, GIMBAL));
        assert!(!servo.take(0.0, -7.0, 3.0, GIMBAL));
    }
}
