//! Which checks run at the rates that are heard, and which cannot.

use std::collections::VecDeque;

use serde::Serialize;

use super::flag::Check;

/// Messages that a rate is taken over.
const COUNTED: usize = 32;

/// How often a message is heard.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Rate {
    heard_s: VecDeque<f64>,
}

impl Rate {
    /// Notes a message by the vehicle's time, s. A copy counts once; an earlier time begins anew.
    pub(super) fn note(&mut self, time_s: f64) {
        match self.heard_s.back() {
            Some(last_s) if time_s < *last_s => self.heard_s.clear(),
            Some(last_s) if time_s <= *last_s => return,
            _ => {}
        }
        if self.heard_s.len() >= COUNTED {
            self.heard_s.pop_front();
        }
        self.heard_s.push_back(time_s);
    }

    /// Messages per second; 0 before the second one.
    pub(super) fn hz(&self) -> f64 {
        let span_s = self.heard_s.front().zip(self.heard_s.back()).map_or(0.0, |(first, last)| last - first);
        if span_s > 0.0 { (self.heard_s.len() - 1) as f64 / span_s } else { 0.0 }
    }
}

/// The rates of the messages that the checks use.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Rates {
    pub(super) attitude: Rate,
    pub(super) position: Rate,
    pub(super) descent: Rate,
    pub(super) gimbal: Rate,
    pub(super) fins: Rate,
}

/// Whether a check runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    pub check: Check,
    pub runs: bool,
    /// The messages it uses, with their rates; and, if it does not run, what is missing.
    pub words: String,
}

impl Rates {
    /// Every check: the messages it needs, and at least how often. Below 2 Hz a motor burns out between two angles of the
    /// gimbal; below 4 Hz half a second has no two accelerations; the turning is seen between two attitudes that both lie
    /// within a quarter of a second after a gimbal's message.
    fn needs(&self, check: Check) -> Vec<(&'static str, &Rate, f64)> {
        let attitude = ("ATTITUDE_QUATERNION", &self.attitude);
        let position = ("LOCAL_POSITION_NED", &self.position);
        let descent = ("TD_DESCENT", &self.descent);
        let gimbal = ("TD_GIMBAL", &self.gimbal);
        let fins = ("TD_FINS", &self.fins);
        let needs = |(name, rate), hz| (name, rate, hz);
        match check {
            Check::MotorStrength => vec![needs(descent, 1.0)],
            Check::Thrust => vec![needs(position, 4.0), needs(attitude, 4.0)],
            Check::Gimbal => vec![needs(gimbal, 2.0)],
            Check::Turning => vec![needs(attitude, 6.0), needs(gimbal, 2.0)],
            Check::Fins => vec![needs(fins, 1.0)],
            Check::Ignition => vec![needs(descent, 1.0), needs(fins, 1.0)],
        }
    }

    /// What runs for a vehicle in space, or for the planar one.
    pub(super) fn coverage(&self, in_space: bool) -> Vec<Coverage> {
        let of = |check: Check| {
            let needs = self.needs(check);
            let heard = |(name, rate, _): &(&str, &Rate, f64)| format!("{name} {:.1} Hz", rate.hz());
            let missing = needs.iter().find(|(_, rate, hz)| rate.hz() < *hz);
            let rates = needs.iter().map(heard).collect::<Vec<_>>().join(", ");
            let plain = matches!(check, Check::Gimbal | Check::Fins);
            let words = match missing {
                _ if !in_space && !plain => "needs a mission in space".to_owned(),
                Some((name, _, hz)) => format!("{rates}; {name} is needed at {hz} Hz"),
                None => rates,
            };
            Coverage { check, runs: missing.is_none() && (in_space || plain), words }
        };
        Check::ALL.into_iter().map(of).collect()
    }
}

/// What no telemetry at 57,600 baud carries, so that only the vehicle's own log can be checked for it.
pub const NOT_CARRIED: [&str; 3] = [
    "every decision bit for bit: needs the sensors' samples at 200 Hz (verify the vehicle's own log)",
    "the gimbal's command: it is renewed at 200 Hz from a plan that is not sent; here it is only held against the angle",
    "a landing solved again: needs the motor's burn time and the solver's warm start, which are not sent",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_without_its_messages_says_so() {
        let mut rates = Rates::default();
        for number in 0..20 {
            rates.gimbal.note(0.25 * f64::from(number));
            rates.attitude.note(0.25 * f64::from(number));
        }
        let coverage = rates.coverage(true);
        let of = |check| coverage.iter().find(|coverage| coverage.check == check).unwrap();
        assert!(of(Check::Gimbal).runs && of(Check::Gimbal).words == "TD_GIMBAL 4.0 Hz");
        assert!(!of(Check::Turning).runs && of(Check::Turning).words.contains("needed at 6 Hz"));
        assert!(!of(Check::Thrust).runs && of(Check::Thrust).words.contains("LOCAL_POSITION_NED 0.0 Hz"));
        assert!(
            !rates.coverage(false).iter().any(|coverage| coverage.runs && coverage.check == Check::Thrust)
        );
    }
}
