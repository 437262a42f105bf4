//! The vehicle's state at one instant, for telemetry.

use flight::verdict::LandingVerdict;

use super::Vehicle;
use crate::craft::{ControllerFacts, Craft as _, Motion, Path, Prediction, Snapshot, bits, violations};

impl Vehicle {
    pub(super) fn state_now(&self) -> Snapshot {
        let time_s = self.time_s();
        let on_pad = self.mode.phase.on_pad();
        let output = self.output.as_ref();
        let planned = output.filter(|output| output.plan.len > 0);
        Snapshot {
            time_s,
            phase: self.mode.phase,
            interlocks: self.mode.interlocks,
            countdown_s: self.mode.countdown_remaining_s(time_s),
            // The flight's clock stops when the flight does.
            since_ignition_s: self.ignition_sample.map(|sample| {
                let until_s = self.verdict.map_or(time_s, |judged| judged.impact.time_s);
                until_s - sample as f64 * self.profile.nmpc.sample_time_s
            }),
            pad_wait_s: self.mode.pad_wait_remaining_s(time_s),
            motor: self.mode.motor_status(time_s),
            approach_wait_s: self.mode.approach_wait_s(time_s),
            held: self.mode.held(time_s),
            checks_failed: if on_pad {
                bits(self.arming_checks().iter().map(|check| !check.passed))
            } else {
                0
            },
            abort_effect: self.abort_effect(),
            motion: Motion::from(&self.plant.state()),
            gimbal_rad: [self.plant.gimbal_rad(), (0.0, 0.0)],
            fins_rad: self.plant.fins_rad(),
            thrust_n: self.plant.thrust_n(),
            controller: output.map(|output| ControllerFacts {
                tick: output.tick,
                cost: output.solver.cost,
                kkt_stationarity: output.solver.kkt_stationarity,
                kkt_feasibility: output.solver.kkt_feasibility,
                iterations: output.solver.iterations,
                level: output.level,
                status: output.solver.status,
            }),
            prediction: planned.map(|output| Prediction {
                time_to_go_s: output.predicted_touchdown.time_from_now_s,
                state: output.predicted_touchdown.state,
                violations: violations(&LandingVerdict::judge_plan(
                    &self.limits,
                    &output.predicted_touchdown.state,
                )),
            }),
            path: output.and_then(|output| {
                let states = output.plan.used_states();
                Path::through(states.len(), |node| (states[node].x_m, states[node].z_m))
            }),
            solve_time_s: self.solve_time_s,
            deadline_s: self.profile.nmpc.sample_time_s,
            thrust_scale: self.thrust.scale(),
            limits: self.limits,
            gimbal_limit_rad: self.profile.gimbal.limit_rad(),
            judged: self.verdict,
            descent: None,
            estimator: None,
            sensors: None,
            site: self.profile.site,
            // Its air has one density: it says no altitude.
            pad_altitude_m: 0.0,
        }
    }
}
