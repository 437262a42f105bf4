//! What the flight computer expects of the next seconds.

use crate::ignition::IgnitionOutlook;

/// Room the parachute needs, times this, is left above the ground.
const COMMIT_MARGIN: f64 = 1.5;

/// Expectations before ignition, made anew five or twenty times a second.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outlook {
    /// The ignition.
    pub ignition: IgnitionOutlook,
    /// Feet's height below which the parachute has no room any more, m.
    pub commit_height_m: f64,
    /// Height of the feet, m.
    pub height_m: f64,
    /// Speed predicted for this moment from the fall alone, m/s.
    pub predicted_speed_m_s: f64,
    /// Where the vehicle would touch down if steered no more, distance from the pad, m.
    pub touchdown_distance_m: f64,
}

/// Height that a parachute needs at a speed: the fall until it is out and the distance it inflates over.
pub(super) fn commit_height_m(speed_m_s: f64, ejection_delay_s: f64, inflation_distance_m: f64) -> f64 {
    COMMIT_MARGIN * (speed_m_s * ejection_delay_s + inflation_distance_m)
}

#[cfg(test)]
mod tests {
    use crate::pilot::sample::{falling, input};
    use crate::pilot::{Pilot, PilotInput};

    /// Whether an abort in the very next frame releases the parachute.
    fn abort_releases(pilot: &mut Pilot, frame: u64) -> bool {
        pilot.step(&PilotInput { abort: true, ..input(frame, 0.0) }).parachute
    }

    #[test]
    fn an_abort_in_the_first_frame_knows_how_high_it_is() {
        let pilot = falling();
        assert!(abort_releases(&mut pilot.clone(), 1));
        assert!(abort_releases(&mut pilot.restarted(0.1), 21));
    }
}
