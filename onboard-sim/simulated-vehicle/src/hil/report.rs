//! What a flight was like on the wire, and how it ended.

use std::fmt;

use hil::lockstep;
use hil::real_time::{self, OLDEST};
use sim::outcome::Outcome;

use crate::fly::Lateness;

/// One flight of hardware in the loop.
#[derive(Debug, Clone, PartialEq)]
pub struct FlightReport {
    pub number: u64,
    /// Frames of the world.
    pub frames: u64,
    /// Frames in which the remote computer decided what the one in this process decided; `None`: not compared.
    pub identical: Option<u64>,
    pub outcome: Outcome,
    pub wire: WireReport,
}

/// What happened between world and computer.
#[derive(Debug, Clone, PartialEq)]
pub enum WireReport {
    Lockstep(lockstep::Counts),
    RealTime(Box<Jitter>),
}

/// Times of a flight in real time.
#[derive(Debug, Clone, PartialEq)]
pub struct Jitter {
    /// How late the world's frames began.
    pub begun_late: Lateness,
    /// Time from the sending of a frame to its answer.
    pub answered_after: Lateness,
    pub counts: real_time::Counts,
    /// Lost frames that the computer flew with the last inertial sample.
    pub held: u64,
    /// Frames of which no answer has come.
    pub unanswered: u64,
}

impl FlightReport {
    /// Whether every frame was the same here and there; `true` if it was not compared.
    pub fn is_identical(&self) -> bool {
        self.identical.is_none_or(|identical| identical == self.frames)
    }
}

/// One line for each flight, and one for its wire.
impl fmt::Display for FlightReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "flight {}: {}", self.number, self.outcome.ending(false))?;
        if let Some(touchdown) = &self.outcome.touchdown {
            let place_m = libm::hypot(touchdown.state.position_m.x, touchdown.state.position_m.y);
            write!(
                out,
                ", {:.3} m/s down, {:.3} m/s across, {:.2} deg, {:.2} deg/s, {place_m:.2} m away",
                -touchdown.vertical_m_s,
                touchdown.lateral_m_s,
                touchdown.tilt_rad.to_degrees(),
                touchdown.rate_rad_s.to_degrees(),
            )?;
        }
        write!(out, "; {} frames", self.frames)?;
        if let Some(identical) = self.identical {
            write!(out, ", {identical} identical with the flight in this process")?;
        }
        match &self.wire {
            WireReport::Lockstep(counts) => {
                write!(out, "; sent again {}, answers late or doubled {}", counts.sent_again, counts.old)
            }
            WireReport::RealTime(jitter) => write!(out, "\n{jitter}"),
        }
    }
}

impl fmt::Display for Jitter {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (what, times) in
            [("frames began late by", &self.begun_late), ("answers came after", &self.answered_after)]
        {
            match times.quantiles() {
                Some([median, p99, worst]) => {
                    writeln!(out, "  {what}: median {median:?}, p99 {p99:?}, worst {worst:?}")?;
                }
                None => writeln!(out, "  {what}: none")?,
            }
        }
        write!(out, "  frames by the age of the commands that moved them:")?;
        for (age, frames) in self.counts.by_age.iter().enumerate().filter(|(_, frames)| **frames > 0) {
            let more = if age == OLDEST { " or more" } else { "" };
            write!(out, " {age}{more}: {frames};")?;
        }
        write!(
            out,
            " frames without an answer: {}; flown by the computer with the last inertial sample: {}; old answers: {}",
            self.unanswered, self.held, self.counts.old
        )
    }
}
