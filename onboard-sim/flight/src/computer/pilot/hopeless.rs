//! Releases the parachute while there is height for it, if the ignition gate will not open.

use super::{Pilot, PilotInput};
use crate::estimation::estimator::Estimate;
use crate::rules::phase::Phase;

/// A reason that has kept the gate shut for this long, s, will not go away before ignition.
const LASTS_S: f64 = 0.5;
/// The decision is taken this long before the commit height is passed, s.
const BEFORE_COMMIT_S: f64 = 0.1;
/// Beyond this multiple of the gate's limits of tilt and pitch rate, the vehicle tumbles.
const TUMBLING: f64 = 2.0;

impl Pilot {
    /// Whether the gate has been shut for a lasting reason, and this is the last chance for the parachute.
    ///
    /// Lasting reasons are fins that do not answer, an unhealthy estimate, an attitude out of control, and a speed from
    /// which no landing is possible. The operating rules then require the parachute above the commit height.
    pub(super) fn gate_will_not_open(
        &mut self,
        phase: Phase,
        input: &PilotInput,
        estimate: &Estimate,
    ) -> bool {
        let waiting = matches!(phase, Phase::Deploy | Phase::AeroDescent | Phase::LandArmed);
        let limits = &self.known.mission.gate;
        let state = &estimate.state;
        let rate_rad_s = libm::hypot(state.rate_rad_s.y, state.rate_rad_s.z);
        let shut = !self.fins_there(&input.fins_rad)
            || self.fin_watch.any_stuck()
            || !estimate.health.is_good()
            || state.tilt_rad() > TUMBLING * limits.tilt_max_deg.to_radians()
            || rate_rad_s > TUMBLING * limits.pitch_rate_max_deg_s.to_radians()
            || self.outlook.ignition.band.is_none();
        if !(waiting && shut) {
            self.gate_shut_since_s = None;
            return false;
        }
        let since_s = *self.gate_shut_since_s.get_or_insert(input.time_s);
        let feet_m = state.position_m.z - self.known.feet_below_cg_m(&self.known.mass.at(0.0));
        let sinking_m_s = (-state.velocity_m_s.z).max(0.0);
        let above_commit_m = feet_m - self.outlook.commit_height_m;
        // A stuck fin has already been watched for long enough.
        (self.fin_watch.any_stuck() || input.time_s - since_s >= LASTS_S)
            && self.outlook.commit_height_m > 0.0
            && above_commit_m > 0.0
            && above_commit_m < BEFORE_COMMIT_S * sinking_m_s
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector2, Vector3};

    use super::*;
    use crate::computer::pilot::Sensed;
    use crate::computer::pilot::sample::released;
    use crate::estimation::estimator::StartUncertainty;
    use crate::vehicle::rigid::RigidState;

    fn falling(time_s: f64) -> Estimate {
        let mut state = RigidState::upright(250.0 - 38.0 * time_s);
        state.velocity_m_s.z = -38.0;
        Estimate::exact(time_s, state, Vector3::new(9.8, 0.0, 0.0), Vector2::zeros())
    }

    /// Height of the parachute's release in a fall, m, with or without fins that answer.
    fn released_m(fins_answer: bool) -> Option<f64> {
        let mission =
            crate::vehicles::mission::builtin("mk2").expect("a built-in mission").expect("a valid mission");
        let start = RigidState::upright(250.0);
        let mut pilot = Pilot::at_apogee(&mission, 0.0, &start, &StartUncertainty::at_apogee());
        let (mut table, mut fins_rad) = (released(), [0.0; 4]);
        // Down to 80 m: below the commit height, above the ignition.
        (1..900).find_map(|frame| {
            let time_s = frame as f64 * 0.005;
            let estimate = falling(time_s);
            let output = pilot.step(
                &mut table,
                &PilotInput {
                    frame,
                    time_s,
                    sensed: Sensed::Known(estimate),
                    fins_rad,
                    contact: false,
                    igniter_continuity: true,
                    abort: false,
                },
            );
            if fins_answer {
                fins_rad = output.fins_rad;
            }
            output.parachute.then_some(estimate.state.position_m.z)
        })
    }

    #[test]
    fn the_parachute_is_released_in_time_only_if_the_fins_do_not_answer() {
        assert_eq!(released_m(true), None);
        let released_m = released_m(false).expect("the parachute is released");
        // 1.5 times the sum of one second's fall and 20 m of inflation, plus the feet's distance below the centre of
        // gravity.
        assert!((87.0..93.0).contains(&released_m), "{released_m}");
    }
}
