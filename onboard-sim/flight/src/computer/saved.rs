//! Power-up of the computer, the state that it saves in every frame in memory that survives a
//! reset, and resuming from it.
//!
//! A reset (a watchdog, a voltage dip) erases everything else. A computer that restarts
//!
//! * on the pad, not released, behaves as after power-up and reports so: not armed, no countdown.
//!   Only an abort stays latched;
//! * in the air flies on: phase, latches, motor and the last commands are restored, and the last
//!   estimate is extrapolated over the lost time. Estimator, plan and gimbal loop start again.
//!   Under power it therefore holds the nose upright until its next plan.
//!
//! [`Saved::read`] rejects incomplete bytes. A board stores two records and writes them
//! alternately: a reset during one write leaves the other intact.

use alloc::boxed::Box;
use serde::{Deserialize, Serialize};

use super::digest::checksum;
use super::messages::{MotorWatch, Readiness, Severity};
use super::pad::{PadWatch, SelfTest};
use super::pad_check::PadCheck;
use super::pilot::{Pilot, SavedPilot};
use super::table::PhaseTable;
use super::{Commands, Computer, CrewMemory, FRAME_S, LogState, Release, SensedInput, flight_time_s};
use crate::estimation::estimator::StartUncertainty;
use crate::estimation::estimator::alignment::ImuCalibration;
use crate::estimation::sensor_watch::SensorWatch;
use crate::estimation::spikes::SpikeFilter;
use crate::guidance::powered::ControlLevel;
use crate::rules::outputs::Outputs;
use crate::rules::phase::{Event, Interlocks, Latch, Mode};
use crate::vehicle::mission::{ArmingLimits, Mission, StartPoint};
use crate::vehicle::rigid::RigidState;

/// Longest outage after which the saved state is restored, s. After a longer one the computer
/// powers up normally: it was switched off by a person, and no fall of this length can be saved.
pub const LONGEST_RESET_S: f64 = 10.0;

/// Bytes of the checksum before the record.
const CHECKSUM_BYTES: usize = 8;

/// State that survives a reset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    frame: u64,
    /// Vehicle time of the frame, s.
    time_s: f64,
    mode: Mode,
    latch: Option<Latch>,
    /// Present after the release; the vehicle may still be on its rail with its ascent igniter
    /// energised.
    in_the_air: Option<InTheAir>,
}

/// The additional state of a released computer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct InTheAir {
    release: Release,
    commands: Commands,
    level: ControlLevel,
    pilot: SavedPilot,
}

/// Why the bytes are not a valid saved state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SavedError {
    #[error("{found} bytes; a record has at least {CHECKSUM_BYTES} and at most {}", Saved::MOST_BYTES)]
    Length { found: usize },
    #[error("the checksum is wrong: the record was not written whole")]
    Checksum,
    #[error("the record is of another build")]
    Layout,
}

impl Saved {
    /// Maximum length of a record, bytes. A test measures it.
    pub const MOST_BYTES: usize = 1536;

    /// Number of the frame after which the state was saved.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// Writes the record; returns its bytes.
    ///
    /// # Errors
    /// The record does not fit, which a test excludes.
    pub fn write<'a>(&self, into: &'a mut [u8; Self::MOST_BYTES]) -> Result<&'a [u8], SavedError> {
        let (sum, record) = into.split_at_mut(CHECKSUM_BYTES);
        let room = record.len();
        let bytes = match postcard::to_slice(self, record) {
            Ok(written) => {
                sum.copy_from_slice(&checksum(written).to_le_bytes());
                written.len()
            }
            Err(_) => return Err(SavedError::Length { found: room }),
        };
        Ok(&into[..CHECKSUM_BYTES + bytes])
    }

    /// Reads a record.
    ///
    /// # Errors
    /// The bytes are not a complete record of this build.
    pub fn read(bytes: &[u8]) -> Result<Self, SavedError> {
        let found = bytes.len();
        let (sum, record) = bytes
            .split_first_chunk::<CHECKSUM_BYTES>()
            .filter(|_| found <= Self::MOST_BYTES)
            .ok_or(SavedError::Length { found })?;
        if u64::from_le_bytes(*sum) != checksum(record) {
            return Err(SavedError::Checksum);
        }
        postcard::from_bytes(record).map_err(|_layout| SavedError::Layout)
    }
}

impl Computer {
    /// The state to save after a frame.
    pub fn saved(&self) -> Saved {
        let mode = *self.table.mode();
        let in_the_air = self.release.map(|release| InTheAir {
            release,
            commands: self.commands,
            level: self.level,
            pilot: self.pilot.saved(),
        });
        let latch = self.table.latch();
        Saved { frame: self.input.frame, time_s: self.table.time_s, mode, latch, in_the_air }
    }

    /// Resumes a computer that has just powered up after a reset. `time_s` is the vehicle time at
    /// which it resumes, so a board needs a clock that runs through the reset.
    pub fn resume(&mut self, saved: &Saved, time_s: f64) {
        let lost_s = time_s - saved.time_s;
        if !(0.0..=LONGEST_RESET_S).contains(&lost_s) {
            return;
        }
        self.input.frame = saved.frame;
        match &saved.in_the_air {
            Some(flown) => {
                self.table.go_on(saved.mode, saved.latch);
                let words = "the flight computer has restarted IN FLIGHT";
                self.table.report(Severity::Critical, words);
                // This state was already reported.
                let _ = self.motor_watch.update(&saved.mode, saved.time_s);
                self.release = Some(flown.release);
                self.commands = flown.commands;
                self.level = flown.level;
                // Counted in frames, so that T+ has the same bits with and without a pad.
                let frame = libm::round(time_s / FRAME_S) as u64;
                let since_s = flight_time_s(frame.saturating_sub(flown.release.frame));
                self.pilot.resume(&flown.pilot, since_s);
            }
            None => self.wake_on_the_pad(saved, time_s),
        }
    }

    /// Not armed, and without a countdown. The wait after an abort starts again: a shorter wait
    /// would be unsafe for people who approach.
    fn wake_on_the_pad(&mut self, saved: &Saved, time_s: f64) {
        let Interlocks { armed, abort_latched, landing_motor_inhibited, .. } = saved.mode.interlocks;
        let mut mode = Mode::power_up(time_s);
        mode.interlocks = Interlocks { landing_motor_inhibited, abort_latched, ..mode.interlocks };
        mode.aborted_before_s = saved.mode.aborted_before_s;
        self.table.go_on(mode, saved.latch);
        let (severity, words) = if armed {
            (Severity::Warning, "the flight computer has restarted: DISARMED")
        } else {
            (Severity::Notice, "the flight computer has restarted")
        };
        self.table.report(severity, words);
    }

    /// Restarts the computer with the state saved in the last frame.
    pub fn restart(&mut self, time_s: f64) {
        let saved = self.saved();
        *self = Self::at_power_up(self.pilot.mission(), &self.initial_state);
        self.resume(&saved, time_s);
    }
}

// Initial states of a flight computer, at power-up and at its release, and changes of its settings.

impl Computer {
    /// The computer at power-up. `initial_state` is the estimated state at the start of the flight;
    /// on a rail the computer finds its attitude itself.
    pub fn at_power_up(mission: &Mission, initial_state: &RigidState) -> Self {
        let arming = match (mission.start.at, &mission.drop) {
            (StartPoint::Drone, Some(drop)) => ArmingLimits {
                tilt_max_deg: drop.tilt_max_deg,
                rotation_max_deg_s: drop.rotation_max_deg_s,
                speed_max_m_s: drop.speed_max_m_s,
                ..mission.arming
            },
            _ => mission.arming,
        };
        let uncertainty = StartUncertainty::at_start(mission.start.at);
        Self {
            table: PhaseTable::new(0.0),
            pressure: SpikeFilter::default(),
            sensors: SensorWatch::default(),
            pad: PadWatch::default(),
            pilot: Box::new(Pilot::starting(mission, 0.0, initial_state, &uncertainty)),
            initial_state: *initial_state,
            input: SensedInput::default(),
            reported_gate_check: None,
            arming,
            countdown_s: mission.start.countdown_s,
            commands: Commands {
                gimbal_rad: [0.0; 2],
                fins_rad: [mission.airframe.fins.closed_rad(); 4],
                outputs: Outputs::NONE,
            },
            self_test: SelfTest::NotBegun,
            readiness: Readiness::default(),
            rehearsed: None,
            motor_watch: MotorWatch::default(),
            crew: CrewMemory::default(),
            fins_answering: [false; 4],
            fins_zero_rad: [0.0; 4],
            pad_check: PadCheck::default(),
            silent: None,
            release: None,
            level: ControlLevel::Idle,
        }
    }

    /// The same computer after an abort on the pad in an earlier power-up, at this vehicle time, s
    /// (negative).
    #[must_use]
    pub fn aborted_before(mut self, at_s: f64) -> Self {
        let mode = Mode { aborted_before_s: Some(at_s), ..*self.table.mode() };
        self.table.go_on(mode, self.table.latch());
        self
    }

    /// The same computer after it has found its state and the calibration of its inertial unit on
    /// the rail.
    #[must_use]
    pub fn standing(mut self, initial_state: &RigidState, calibration: &ImuCalibration) -> Self {
        self.pilot.stand(initial_state, calibration);
        self
    }

    /// The same computer, released in a frame: for flights without a pad, and for replays from the
    /// release.
    #[must_use]
    pub fn released(mut self, frame: u64) -> Self {
        self.input.frame = frame;
        self.table.time_s = flight_time_s(frame);
        for event in [
            Event::SelfTestPassed,
            Event::PinPulled,
            Event::ArmRequested { checks_passed: true },
            Event::StartRequested { countdown_s: 0.0, checks_passed: true },
        ] {
            // The table accepts these events in this order; a test checks that.
            let _ = self.table.apply(event);
        }
        self.release();
        self.table.take_messages();
        self.motor_watch.update(self.table.mode(), self.table.time_s);
        self.input.log = LogState { running: true, space_bytes: u64::MAX };
        self
    }

    /// Changes the mission from now on; the memory is unchanged.
    pub fn reconfigure(&mut self, mission: &Mission) {
        *self.pilot = self.pilot.reconfigured(mission);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::computer::pilot::sample;
    use crate::rules::phase::{Motor, Phase};
    use crate::vehicle::rigid::RigidState;

    fn mission() -> crate::vehicle::mission::Mission {
        crate::vehicles::mission::builtin("mk2").unwrap().unwrap()
    }

    fn powered_up() -> Computer {
        Computer::at_power_up(&mission(), &RigidState::upright(300.0))
    }

    fn resumed(saved: &Saved, time_s: f64) -> Computer {
        let mut computer = powered_up();
        computer.resume(saved, time_s);
        computer
    }

    /// A falling computer after some frames.
    fn falling() -> Computer {
        let mut computer = powered_up().released(0);
        for frame in 1..=40 {
            computer.step(&sample::alone(&sample::input(frame, 0.005 * frame as f64)));
        }
        computer
    }

    fn bytes(computer: &Computer) -> Vec<u8> {
        let mut room = [0; Saved::MOST_BYTES];
        computer.saved().write(&mut room).expect("it fits").to_vec()
    }

    #[test]
    fn a_record_comes_back_bit_for_bit_and_fits() {
        let computer = falling();
        let record = bytes(&computer);
        assert_eq!(Saved::read(&record), Ok(computer.saved()));
        // Room for values that are not present here: ignition, ascent.
        assert!(record.len() < Saved::MOST_BYTES - 100, "{}", record.len());
    }

    #[test]
    fn an_incomplete_record_is_rejected() {
        let record = bytes(&falling());
        for length in 0..record.len() {
            assert!(Saved::read(&record[..length]).is_err(), "{length}");
        }
        for place in 0..record.len() {
            let mut broken = record.clone();
            broken[place] ^= 0x10;
            assert!(Saved::read(&broken).is_err(), "{place}");
        }
        assert_eq!(
            Saved::read(&[0; Saved::MOST_BYTES + 1]),
            Err(SavedError::Length { found: Saved::MOST_BYTES + 1 })
        );
        let mut other = checksum(b"of another build").to_le_bytes().to_vec();
        other.extend(b"of another build");
        assert_eq!(Saved::read(&other), Err(SavedError::Layout));
    }

    #[test]
    fn a_computer_from_its_bytes_is_the_one_that_was_restarted_in_place() {
        let mut here = falling();
        let saved = Saved::read(&bytes(&here)).unwrap();
        let mut there = resumed(&saved, 0.3);
        here.restart(0.3);
        assert_eq!(here.digest(), there.digest());
        for frame in 61..=100 {
            let input = sample::alone(&sample::input(frame, 0.005 * frame as f64));
            assert_eq!(here.step(&input), there.step(&input));
            assert_eq!(here.digest(), there.digest(), "frame {frame}");
        }
    }

    #[test]
    fn a_computer_that_was_off_for_long_is_at_power_up() {
        let saved = falling().saved();
        for time_s in [0.2 + LONGEST_RESET_S + 0.01, 0.1, f64::NAN] {
            assert_eq!(resumed(&saved, time_s).digest(), powered_up().digest(), "{time_s}");
        }
        assert_ne!(resumed(&saved, 0.2 + LONGEST_RESET_S).digest(), powered_up().digest());
    }

    /// In every phase: on the pad only an abort is restored, in the air the complete mode.
    #[test]
    fn every_phase_comes_back_as_stated() {
        for phase in Phase::ALL {
            for released in [false, true] {
                let mut computer = if released { falling() } else { powered_up() };
                let interlocks = Interlocks { armed: true, pin_out: true, ..Interlocks::default() };
                let motor = if phase == Phase::Powered { Motor::Burning } else { Motor::Unlit };
                let mode = Mode { phase, interlocks, motor, countdown_end_s: Some(7.0), ..*computer.mode() };
                computer.table.go_on(mode, None);
                computer.restart(0.25);
                if released {
                    assert_eq!(*computer.mode(), mode);
                } else {
                    assert_eq!(*computer.mode(), Mode::power_up(0.25));
                    let messages = computer.table.take_messages();
                    assert!(format!("{messages:?}").contains("DISARMED"), "{phase:?}: {messages:?}");
                }
            }
        }
    }

    #[test]
    fn an_abort_on_the_pad_stays_latched_through_a_reset() {
        let mut computer = powered_up();
        let interlocks = Interlocks { abort_latched: true, ..Interlocks::default() };
        computer.table.go_on(Mode { interlocks, ..*computer.mode() }, Some(Latch::Commanded));
        computer.restart(0.25);
        assert!(computer.mode().interlocks.abort_latched);
        assert_eq!(computer.latch(), Some(Latch::Commanded));
        assert!(!computer.mode().interlocks.armed);
    }
}
