//! The planar vehicle's state at one instant: it knows the truth.

use flight::rules::verdict::LandingVerdict;
use sim::plane::PlanarFlight;

use vehicle_link::snapshot::violations;

use super::{ControllerFacts, Motion, Path, Prediction, Snapshot, Vehicle};

impl Vehicle {
    pub(super) fn snapshot_in_plane(&self, flight: &PlanarFlight) -> Snapshot {
        let (plant, plane) = (flight.plant(), flight.plane());
        let output = plane.output();
        let planned = output.filter(|output| output.plan.len > 0);
        // The flight's clock stops when the flight does.
        let until_s = self.judged().map_or(self.time_s(), |judged| judged.impact.time_s);
        Snapshot {
            since_zero_s: plane.ignited_at_s().map(|at_s| until_s - at_s),
            gimbal_rad: [plant.gimbal_rad(), (0.0, 0.0)],
            fins_rad: plant.fins_rad(),
            thrust_n: plant.thrust_n(),
            controller: output.map(|output| ControllerFacts {
                tick: output.tick,
                cost: output.solver.cost,
                kkt_stationarity: output.solver.kkt_stationarity,
                kkt_feasibility: output.solver.kkt_feasibility,
                iterations: output.solver.iterations,
                level: output.level,
                status: output.solver.status,
            }),
            prediction: planned.map(|output| {
                let end = &output.predicted_touchdown;
                let judged = LandingVerdict::judge_plan(plane.limits(), &end.state);
                Prediction {
                    time_to_go_s: end.time_from_now_s,
                    state: end.state,
                    violations: violations(&judged),
                }
            }),
            path: output.and_then(|output| {
                let states = output.plan.used_states();
                Path::through(states.len(), |node| (states[node].x_m, states[node].z_m))
            }),
            solve_time_s: self.tick_took_s,
            thrust_scale: plane.thrust_scale(),
            gimbal_limit_rad: plane.profile().gimbal.limit_rad(),
            site: plane.profile().site,
            // Its air has one density: it says no altitude.
            ..self.known().standing(Motion::from(&plant.state()), *plane.limits())
        }
    }
}
