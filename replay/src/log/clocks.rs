//! The clocks of a log and how they differ.
//!
//! `T+` counts from the release of the vehicle (the end of its countdown), `boot` from the power-up
//! of its computer, and `log` from the first record. The flight computer's frames and the simulated
//! truth count in T+.

use std::fmt;
use std::str::FromStr;

use flight::rules::phase::Phase;
use protocol::dialect::MavMessage;
use serde::Serialize;

use super::{Entry, StampedEntry};

/// A clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clock {
    /// Since the release.
    Flight,
    /// Since power-up.
    Boot,
    /// Since the first record of the log.
    Log,
}

/// When the clocks of a log were at zero, s after its first record.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Clocks {
    /// T+0.
    pub flight_zero_s: Option<f64>,
    /// Power-up.
    pub boot_zero_s: Option<f64>,
    /// What a ground station calls 0 in its telemetry records.
    pub telemetry_zero_s: Option<f64>,
    /// The sum of the jumps of a station's clock, by the vehicle's.
    pub station_jump: Option<Jump>,
    /// The latest time since power-up that was received, and when that was, s.
    #[serde(skip)]
    last_boot_s: Option<[f64; 2]>,
    /// The release as received over the air, s since power-up: T+0 of a log without frames.
    #[serde(skip)]
    received_release_s: Option<f64>,
}

/// A jump of a clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Jump {
    /// When it jumped last, s after the first record.
    pub at_s: f64,
    pub by_s: f64,
}

/// No link delays a message by more, s.
const DELAY_MAX_S: f64 = 60.0;

/// A time on one of the clocks, as in `T+12.9`, `boot:19.8` or `log:19.7`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockTime {
    pub clock: Clock,
    pub time_s: f64,
}

/// A moment of a flight, as a person names it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moment {
    /// A frame of the flight computer, by its number in the log.
    Frame(u64),
    Time(ClockTime),
    /// The beginning of a phase.
    Phase(Phase),
}

impl FromStr for Moment {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        let number = |text: &str| text.parse().ok().map(Self::Frame);
        let phase = || Phase::ALL.into_iter().find(|phase| phase.name().eq_ignore_ascii_case(given));
        let found = match given.strip_prefix("frame:") {
            Some(text) => number(text),
            None => phase().map(Self::Phase).or_else(|| ClockTime::read(given).map(Self::Time)),
        };
        found.ok_or_else(|| {
            let phases = Phase::ALL.map(Phase::name).join(", ");
            format!(
                "`{given}`: must be a time in seconds, as in T+12.9, boot:19.8 or log:19.7, a phase ({phases}), or frame:NUMBER"
            )
        })
    }
}

impl ClockTime {
    /// `None` if the text is no time.
    pub fn read(given: &str) -> Option<Self> {
        let prefixes = [("T+", Clock::Flight), ("boot:", Clock::Boot), ("log:", Clock::Log)];
        let named = prefixes.iter().find_map(|(prefix, clock)| Some((*clock, given.strip_prefix(prefix)?)));
        let (clock, number) = named.unwrap_or((Clock::Flight, given));
        let time_s = number.trim().parse().ok().filter(|time_s: &f64| time_s.is_finite())?;
        Some(Self { clock, time_s })
    }
}

impl fmt::Display for ClockTime {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (clock, time_s) = match self.clock {
            Clock::Flight if self.time_s < 0.0 => ("T-", -self.time_s),
            Clock::Flight => ("T+", self.time_s),
            Clock::Boot => ("boot ", self.time_s),
            Clock::Log => ("log ", self.time_s),
        };
        write!(out, "{clock}{time_s:.*} s", out.precision().unwrap_or(3))
    }
}

impl Clocks {
    /// Notes a record, `since_s` after the first one, and the message of the vehicle in it.
    pub(crate) fn note(&mut self, stamped: &StampedEntry, message: Option<&MavMessage>, since_s: f64) {
        match &stamped.entry {
            Entry::ComputerFrame(frame) => {
                let input = &frame.record.input;
                if frame.since_release != Some(input.frame) {
                    // A flight without a pad has no power-up.
                    self.boot_zero_s.get_or_insert(since_s - input.time_s);
                }
                if let Some(time_s) = frame.flight_time_s() {
                    self.flight_zero_s.get_or_insert(since_s - time_s);
                }
            }
            Entry::Telemetry(telemetry) => {
                self.telemetry_zero_s.get_or_insert(since_s - telemetry.time_s);
            }
            Entry::RawFrame if self.flight_zero_s.is_none() || self.received_release_s.is_some() => {
                if let Some(boot_s) = message.and_then(boot_time_s) {
                    let [last_boot_s, last_s] = self.last_boot_s.unwrap_or([boot_s, since_s]);
                    let by_s = (since_s - last_s) - (boot_s - last_boot_s);
                    // A vehicle that is powered up again begins at 0.
                    if boot_s >= last_boot_s && by_s.abs() > DELAY_MAX_S {
                        let before_s = self.station_jump.map_or(0.0, |jump| jump.by_s);
                        self.station_jump = Some(Jump { at_s: since_s, by_s: before_s + by_s });
                    }
                    self.last_boot_s = Some([boot_s, since_s]);
                    // The message that was delayed least says best when the vehicle was powered up.
                    let zero_s = since_s - boot_s;
                    let zero_s = self.boot_zero_s.map_or(zero_s, |known| known.min(zero_s));
                    self.boot_zero_s = Some(zero_s);
                    // Later ones stand still after the touchdown.
                    self.received_release_s = self.received_release_s.or_else(|| release_s(message?));
                    self.flight_zero_s = self.received_release_s.map(|release_s| zero_s + release_s);
                }
            }
            _ => {}
        }
    }

    /// A time on another clock; `None` if the log does not connect the two.
    pub fn convert(&self, time: ClockTime, clock: Clock) -> Option<ClockTime> {
        if time.clock == clock {
            return Some(time);
        }
        let zero_s = |clock: Clock| match clock {
            Clock::Flight => self.flight_zero_s,
            Clock::Boot => self.boot_zero_s,
            Clock::Log => Some(0.0),
        };
        let log_s = time.time_s + zero_s(time.clock)?;
        Some(ClockTime { clock, time_s: log_s - zero_s(clock)? })
    }

    /// A time and what it is on the other clocks, for people.
    pub fn words(&self, time: ClockTime) -> String {
        let others =
            [Clock::Flight, Clock::Boot, Clock::Log].into_iter().filter(|clock| *clock != time.clock);
        let others: Vec<String> =
            others.filter_map(|clock| self.convert(time, clock)).map(|time| time.to_string()).collect();
        if others.is_empty() { time.to_string() } else { format!("{time} ({})", others.join(", ")) }
    }
}

/// When the vehicle was released, s since power-up, if it was.
fn release_s(message: &MavMessage) -> Option<f64> {
    let MavMessage::TD_FLIGHT_STATUS(status) = message else { return None };
    let release_ms = i64::from(status.time_boot_ms) + i64::from(status.countdown_ms);
    (status.countdown_ms < 0).then_some(release_ms as f64 / 1e3)
}

/// The time since power-up in a message of the vehicle, s, for the messages that are sent most
/// often.
fn boot_time_s(message: &MavMessage) -> Option<f64> {
    use MavMessage as M;
    let time_ms = match message {
        M::TD_FLIGHT_STATUS(data) => data.time_boot_ms,
        M::LOCAL_POSITION_NED(data) => data.time_boot_ms,
        M::ATTITUDE_QUATERNION(data) => data.time_boot_ms,
        _ => return None,
    };
    Some(f64::from(time_ms) / 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_read_with_its_clock_and_converted() {
        let clocks = Clocks { flight_zero_s: Some(6.9), boot_zero_s: Some(-0.1), ..Clocks::default() };
        for (given, flight_s) in [("T+12", 12.0), ("12", 12.0), ("boot:19", 12.0), ("log:18.9", 12.0)] {
            let time = ClockTime::read(given).unwrap();
            let found = clocks.convert(time, Clock::Flight).unwrap();
            assert!((found.time_s - flight_s).abs() < 1e-9, "{given}: {found}");
        }
        for wrong in ["T-1s", "boot 3", "utc:3", "", "log:inf"] {
            assert_eq!(ClockTime::read(wrong), None, "{wrong}");
        }
        let time = ClockTime { clock: Clock::Flight, time_s: 12.0 };
        assert_eq!(clocks.words(time), "T+12.000 s (boot 19.000 s, log 18.900 s)");
        assert_eq!(Clocks::default().words(time), "T+12.000 s");
    }
}
