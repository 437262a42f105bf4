//! A number for everything a pilot remembers.

use super::known::Known;
use super::{Outlook, Pilot};
use crate::ignition::IgnitionOutlook;
use crate::memory::{Memory, remembers};
use crate::vertical::Band;

impl Pilot {
    /// A number that differs whenever what is remembered differs, to compare a replay with a log.
    ///
    /// It is taken of the bits of everything that decides what the pilot does next. What the mission says is not
    /// remembered but known, and the room that a solve works in holds nothing that the next one reads.
    pub fn digest(&self) -> u64 {
        Memory::digest_of(self)
    }
}

remembers!(Pilot {
    known,
    estimator,
    estimate,
    mode,
    ignited_at_s,
    outlook,
    powered,
    aim_loop,
    fin_share,
    fins_rad,
    fin_watch,
    gimbal_rad,
    gate_refusal,
    gate_shut_since_s,
});

// The mission, its motor and its masses are what a log's profile says; they do not change in flight.
remembers!(Known { motor } but { mission, curve, mass });

remembers!(Outlook { ignition, commit_height_m, height_m, predicted_speed_m_s, touchdown_distance_m });
remembers!(IgnitionOutlook { band, common, chosen_m, onset_height_m, onset_vertical_m_s, command_in_s });
remembers!(Band { low_m, high_m });

#[cfg(test)]
mod tests {
    use crate::pilot::sample::{falling, input};

    #[test]
    fn the_last_bit_of_an_input_is_remembered() {
        let digest_after = |gyro_rad_s: f64| {
            let mut pilot = falling();
            pilot.step(&input(1, gyro_rad_s));
            pilot.digest()
        };
        let rate_rad_s = 0.01_f64;
        assert_eq!(digest_after(rate_rad_s), digest_after(rate_rad_s));
        assert_ne!(digest_after(rate_rad_s), digest_after(f64::from_bits(rate_rad_s.to_bits() + 1)));
    }
}
