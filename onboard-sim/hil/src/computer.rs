//! The computer's end of the wire: a flight computer that is told of frames in whatever order they arrive.
//!
//! What becomes of a frame:
//!
//! | frame | in lockstep | in real time |
//! |---|---|---|
//! | the next one | flown and answered | flown and answered |
//! | the last one again | answered again, not flown | answered again, not flown |
//! | an older one | ignored | ignored |
//! | one that leaves out up to [`MOST_HELD`] frames | ignored: the world sends the missing one again | the missing frames are flown with the last inertial sample and nothing else, then this one |
//! | one that leaves out more | ignored | ignored: the flight is over |
//! | one of another flight | ignored | ignored |

use flight::computer::pilot::Sensed;
use flight::computer::saved::Saved;
use flight::computer::{Computer, Input, LogState, Output, flight_time_s};
use flight::estimation::estimator::Measurements;
use flight::guidance::baseline::Law;
use flight::rules::arming::Uplink;
use flight::rules::phase::Phase;
use flight::vehicle::mission::Mission;

use crate::carried::{CarriedCommands, CarriedReadings, Wire};
use crate::readings::{Feedback, Readings};
use crate::start::{Pace, Start};

/// In real time at most this many lost frames in a row are flown: 5 s.
pub const MOST_HELD: u64 = 1000;

/// The answer to a frame. The start is answered as frame 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    pub flight_id: u32,
    pub frame: u64,
    pub commands: CarriedCommands,
    pub phase: Phase,
    /// Digest of the computer's memory.
    pub digest: u64,
    /// Lost frames of this flight that were flown with the last inertial sample.
    pub held: u64,
}

/// What became of the frames of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Frames flown as they came.
    pub flown: u64,
    /// Lost frames that were flown with the last inertial sample.
    pub held: u64,
    /// Frames that came again and were answered again.
    pub repeated: u64,
    /// Frames that came after a later one was flown.
    pub late: u64,
    /// Frames that left out one that this computer waits for.
    pub ahead: u64,
    /// Frames and starts of another flight.
    pub foreign: u64,
}

/// A flight computer at the end of a wire.
#[derive(Debug, Clone)]
pub struct RemoteComputer {
    wire: Wire,
    start: Start,
    computer: Computer,
    last: Option<Readings>,
    /// What was saved before a reset, until the first frame after it.
    saved: Option<Saved>,
    answer: Answer,
    counts: Counts,
}

impl RemoteComputer {
    /// The computer of a flight, which has just started.
    pub fn new(mission: &Mission, law: Law, start: &Start) -> Self {
        let computer = Computer::at_power_up(mission, law, &start.believed).released();
        let answer = Answer {
            flight_id: start.flight_id,
            frame: 0,
            commands: CarriedCommands::narrow(computer.commands()),
            phase: computer.mode().phase,
            digest: computer.digest(),
            held: 0,
        };
        let counts = Counts::default();
        Self { wire: Wire::new(mission), start: *start, computer, last: None, saved: None, answer, counts }
    }

    /// The computer of a flight that was under way when this machine was reset: it goes on from what was saved. In lockstep the
    /// world waits, and the next frame is flown as if nothing were lost but the estimator; in real time the frames until then
    /// are gone.
    pub fn resumed(mission: &Mission, law: Law, start: &Start, saved: &Saved) -> Self {
        let mut resumed = Self::new(mission, law, start);
        resumed.saved = Some(saved.clone());
        resumed.answer.frame = saved.frame();
        resumed
    }

    /// What is kept through a reset, after each frame.
    pub fn saved(&self) -> Saved {
        self.computer.saved()
    }

    /// The start has come again: it is answered as long as no frame is flown.
    pub fn start_again(&mut self, start: &Start) -> Option<Answer> {
        if start.flight_id != self.start.flight_id {
            self.counts.foreign += 1;
            return None;
        }
        self.counts.repeated += 1;
        (self.answer.frame == 0).then_some(self.answer)
    }

    /// A whole frame has arrived. Returns the answer, if there is one.
    pub fn take(&mut self, flight_id: u32, frame: u64, carried: &CarriedReadings) -> Option<Answer> {
        if flight_id != self.start.flight_id {
            self.counts.foreign += 1;
            return None;
        }
        self.wake(frame);
        if self.saved.is_some() {
            self.counts.ahead += 1;
            return None;
        }
        let flown = self.answer.frame;
        if frame <= flown {
            let again = frame == flown && frame > 0;
            *(if again { &mut self.counts.repeated } else { &mut self.counts.late }) += 1;
            return again.then_some(self.answer);
        }
        let missing = frame - flown - 1;
        match (missing, self.start.pace, self.last) {
            (0, ..) => {}
            (1..=MOST_HELD, Pace::RealTime, Some(last)) => self.hold(&last, missing),
            _ => {
                self.counts.ahead += 1;
                return None;
            }
        }
        let readings = self.wire.widen(carried);
        self.counts.flown += 1;
        self.fly(frame, &readings);
        self.last = Some(readings);
        Some(self.answer)
    }

    /// Takes up what was saved before a reset, at the first frame after it. The answer to the last frame before it is
    /// lost with the memory: a world that asks for it again is answered with the saved commands.
    fn wake(&mut self, frame: u64) {
        let in_reach =
            |saved: &mut Saved| (saved.frame()..=saved.frame().saturating_add(MOST_HELD)).contains(&frame);
        let Some(saved) = self.saved.take_if(in_reach) else { return };
        let before = frame.saturating_sub(1).max(saved.frame());
        self.computer = self.computer.clone().resumed(&saved, flight_time_s(before));
        self.answer = Answer {
            frame: before,
            commands: CarriedCommands::narrow(self.computer.commands()),
            phase: self.computer.mode().phase,
            digest: self.computer.digest(),
            ..self.answer
        };
    }

    /// Flies lost frames: the vehicle is taken to turn and to accelerate as it did last.
    fn hold(&mut self, last: &Readings, missing: u64) {
        let imu = last.measured.imu;
        let measured = Measurements { imu, pressure_altitude_m: None, gnss: None, lidar_range_m: None };
        let held = Readings { measured, ..*last };
        for _ in 0..missing {
            self.counts.held += 1;
            self.fly(self.answer.frame + 1, &held);
        }
    }

    fn fly(&mut self, frame: u64, readings: &Readings) {
        let output = self.step(frame, readings);
        self.answer = Answer {
            frame,
            commands: CarriedCommands::narrow(&output.commands),
            phase: self.computer.mode().phase,
            digest: self.computer.digest(),
            held: self.counts.held,
            ..self.answer
        };
    }

    fn step(&mut self, frame: u64, readings: &Readings) -> Output {
        let Feedback { gimbal_rad, fins_rad, switches } = readings.feedback;
        self.computer.step(&Input {
            frame,
            time_s: flight_time_s(frame),
            sensed: Sensed::Measured(readings.measured),
            gimbal_rad,
            fins_rad,
            contact: switches.contact,
            igniter_continuity: switches.igniter_continuity,
            booster_attached: switches.booster_attached,
            pin_out: switches.pin_out,
            battery_v: None,
            log: LogState { running: true, space_bytes: u64::MAX },
            uplink: Uplink::NotNeeded,
            commander: None,
            people: None,
            requests: &[],
            rehearsed: None,
        })
    }

    /// The flight that it flies.
    pub fn start(&self) -> &Start {
        &self.start
    }

    /// The answer to the last frame that was flown.
    pub fn answer(&self) -> &Answer {
        &self.answer
    }

    pub fn counts(&self) -> &Counts {
        &self.counts
    }
}

#[cfg(test)]
mod tests {
    use flight::vehicle::rigid::RigidState;

    use super::*;
    use crate::readings::Switches;

    fn computer(pace: Pace) -> RemoteComputer {
        let mission = vehicles::mission::builtin("mk2").unwrap().unwrap();
        let start = Start { flight_id: 7, believed: RigidState::upright(300.0), pace };
        RemoteComputer::new(&mission, Law::Nmpc, &start)
    }

    /// A falling vehicle whose rotation rate tells the frames apart.
    fn frame(number: u64) -> CarriedReadings {
        CarriedReadings {
            gyro_rad_s: [0.0, 1e-3 * number as f32, 0.0],
            specific_force_m_s2: [0.1, 0.0, 0.0],
            pressure_altitude_m: number.is_multiple_of(4).then_some(300.0),
            fix: None,
            range_cm: None,
            gimbal_rad: [0.0; 2],
            fins_rad: [0.0; 4],
            switches: Switches { igniter_continuity: true, pin_out: true, ..Switches::default() },
        }
    }

    /// What the computer remembers after these frames have arrived in this order.
    fn after(pace: Pace, frames: &[u64]) -> RemoteComputer {
        let mut computer = computer(pace);
        for number in frames {
            computer.take(7, *number, &frame(*number));
        }
        computer
    }

    #[test]
    fn doubled_and_old_frames_change_nothing_in_either_pace() {
        for pace in [Pace::Lockstep, Pace::RealTime] {
            let once = after(pace, &[1, 2, 3, 4]);
            let disturbed = after(pace, &[1, 1, 2, 1, 3, 3, 3, 2, 4, 1]);
            assert_eq!(disturbed.answer(), once.answer());
            let counts = disturbed.counts();
            assert_eq!((counts.flown, counts.repeated, counts.late, counts.held), (4, 3, 3, 0));
        }
    }

    #[test]
    fn a_doubled_frame_is_answered_again_with_the_same_answer() {
        let mut computer = after(Pace::Lockstep, &[1, 2]);
        let answer = *computer.answer();
        assert_eq!(computer.take(7, 2, &frame(2)), Some(answer));
        assert_eq!(computer.take(7, 1, &frame(1)), None);
    }

    #[test]
    fn in_lockstep_a_frame_waits_for_the_one_before_it() {
        let mut computer = after(Pace::Lockstep, &[1, 2]);
        assert_eq!(computer.take(7, 4, &frame(4)), None);
        assert_eq!(computer.answer().frame, 2);
        assert_eq!(computer.take(7, 3, &frame(3)).map(|answer| answer.frame), Some(3));
        assert_eq!(computer.take(7, 4, &frame(4)).map(|answer| answer.frame), Some(4));
        assert_eq!(computer.answer(), after(Pace::Lockstep, &[1, 2, 3, 4]).answer());
        assert_eq!(computer.counts().ahead, 1);
    }

    #[test]
    fn in_real_time_lost_frames_are_flown_with_the_last_inertial_sample() {
        let lost = after(Pace::RealTime, &[1, 2, 5]);
        assert_eq!((lost.answer().frame, lost.answer().held), (5, 2));
        assert_eq!(lost.counts().flown, 3);
        let mut held = frame(2);
        held.pressure_altitude_m = None;
        let mut by_hand = after(Pace::RealTime, &[1, 2]);
        for (number, readings) in [(3, held), (4, held), (5, frame(5))] {
            by_hand.take(7, number, &readings);
        }
        assert_eq!(lost.answer().digest, by_hand.answer().digest);
    }

    #[test]
    fn in_real_time_a_frame_that_was_overtaken_is_lost() {
        let overtaken = after(Pace::RealTime, &[1, 3, 2, 4]);
        assert_eq!(overtaken.answer().digest, after(Pace::RealTime, &[1, 3, 4]).answer().digest);
        assert_eq!((overtaken.counts().late, overtaken.counts().held), (1, 1));
    }

    #[test]
    fn a_gap_that_is_too_long_is_not_flown() {
        let mut computer = after(Pace::RealTime, &[1]);
        assert_eq!(computer.take(7, MOST_HELD + 3, &frame(9)), None);
        assert_eq!(computer.take(7, u64::MAX, &frame(9)), None);
        assert_eq!((computer.answer().frame, computer.counts().ahead), (1, 2));
        assert!(computer.take(7, MOST_HELD + 2, &frame(9)).is_some());
    }

    #[test]
    fn a_computer_that_was_reset_goes_on_from_what_it_saved() {
        for pace in [Pace::Lockstep, Pace::RealTime] {
            let before = after(pace, &(1..=40).collect::<Vec<_>>());
            let mission = vehicles::mission::builtin("mk2").unwrap().unwrap();
            let saved = before.saved();
            let woken = || RemoteComputer::resumed(&mission, Law::Nmpc, before.start(), &saved);
            // The answer to the last frame was lost on the way.
            let again = woken().take(7, 40, &frame(40)).unwrap();
            assert_eq!(
                (again.frame, again.commands, again.phase),
                (40, before.answer().commands, before.answer().phase)
            );
            let mut computer = woken();
            assert_eq!(computer.take(7, 39, &frame(39)), None);
            assert_eq!(computer.take(7, 41 + MOST_HELD, &frame(9)), None, "too late");
            assert_eq!(computer.take(8, 41, &frame(41)), None, "of another flight");
            let answer = computer.take(7, 41, &frame(41)).unwrap();
            assert_eq!((answer.frame, answer.phase), (41, before.answer().phase));
            assert_ne!(
                answer.digest,
                before.clone().take(7, 41, &frame(41)).unwrap().digest,
                "the estimator is new"
            );
            // 0.1 s of frames were sent to a dead computer.
            assert_eq!(woken().take(7, 61, &frame(61)).map(|answer| answer.held), Some(0));
        }
    }

    #[test]
    fn another_flight_is_not_this_one() {
        let mut computer = after(Pace::Lockstep, &[1]);
        assert_eq!(computer.take(8, 2, &frame(2)), None);
        let other = Start { flight_id: 8, ..computer.start };
        assert_eq!(computer.start_again(&other), None);
        assert_eq!(computer.counts().foreign, 2);
    }

    #[test]
    fn the_start_is_answered_again_until_a_frame_is_flown() {
        let mut computer = computer(Pace::Lockstep);
        let start = computer.start;
        assert_eq!(computer.start_again(&start), Some(*computer.answer()));
        computer.take(7, 1, &frame(1));
        assert_eq!(computer.start_again(&start), None);
    }
}
