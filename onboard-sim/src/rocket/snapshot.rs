//! The rocket's state at one instant, for telemetry: what its flight computer believes.

use flight::burn::Burn;
use flight::controller::ControlLevel;
use flight::dynamics::PlanarState;
use flight::estimator::Estimate;
use flight::phase::Phase;
use flight::pilot::{FRAMES_PER_PLAN, Pilot, touchdown_m};
use flight::powered::{Plane, PoweredReport};
use flight::verdict::LandingVerdict;
use nalgebra::Vector2;

use super::{Air, FRAME_S, Rocket};
use crate::craft::{
    Chute, ControllerFacts, Craft as _, DescentFacts, EstimatorFacts, Motion, Path, Prediction, Snapshot,
    bits, violations,
};

/// Under a parachute that carries the fall is slower than this, m/s (canopies are sized for 6, an open fall is 20 to 40),
/// and more than this share of the weight is felt: right after apogee the fall is slow, too, but free.
const CARRIED_M_S: f64 = 10.0;
const CARRIED_WEIGHTS: f64 = 0.5;

impl Rocket {
    pub(super) fn state_now(&self) -> Snapshot {
        let time_s = self.time_s();
        let standing = self.standing(time_s);
        match &self.air {
            None => {
                let checks = self.arming_checks();
                Snapshot { checks_failed: bits(checks.iter().map(|check| !check.passed)), ..standing }
            }
            Some(air) => self.flying(air, standing),
        }
    }

    /// On the pad, and what does not depend on where it is.
    fn standing(&self, time_s: f64) -> Snapshot {
        let (command, gimbal_rad, fins_rad) = self.pad.actuators();
        let cg_m = self.flight.order.mission.airframe.above_feet_m(self.mass.at(0.0).cg_station_m);
        let mut believed = self.pad.believed();
        believed.position_m.z = cg_m;
        Snapshot {
            time_s,
            phase: self.mode.phase,
            interlocks: self.mode.interlocks,
            countdown_s: self.mode.countdown_remaining_s(time_s),
            since_ignition_s: None,
            pad_wait_s: self.mode.pad_wait_remaining_s(time_s),
            motor: self.mode.motor_status(time_s),
            approach_wait_s: self.mode.approach_wait_s(time_s),
            held: self.mode.held(time_s),
            checks_failed: 0,
            abort_effect: self.abort_effect(),
            motion: Motion::in_space(&believed, cg_m, &Vector2::zeros()),
            gimbal_rad: core::array::from_fn(|axis| (command.gimbal_rad[axis], gimbal_rad[axis])),
            fins_rad: (command.fins_rad, fins_rad),
            thrust_n: 0.0,
            controller: self
                .rehearsal
                .over()
                .map(|rehearsed| facts(0, ControlLevel::Rehearsal, &rehearsed.report)),
            prediction: None,
            path: None,
            solve_time_s: 0.0,
            deadline_s: FRAME_S,
            thrust_scale: 1.0,
            limits: self.limits.legs,
            gimbal_limit_rad: self.flight.order.mission.airframe.gimbal.limit_rad(),
            judged: self.judged(),
            descent: None,
            estimator: None,
            sensors: self.watch.facts(self.frame),
            site: self.flight.order.mission.site,
            pad_altitude_m: self.flight.order.mission.pad_altitude_m,
        }
    }

    fn flying(&self, air: &Air, standing: Snapshot) -> Snapshot {
        let flight = air.sortie.flight();
        let pilot = flight.pilot();
        let flight_s = standing.time_s - air.released_at_s;
        let (Some(estimate), Some(output)) = (pilot.estimate(), flight.output()) else { return standing };
        let motor = pilot.motor();
        let burn = Burn {
            curve: &self.curve,
            impulse_scale: motor.impulse_scale(),
            time_scale: motor.burn_time_stretch(),
        };
        let burning_s = pilot.burning_s(flight_s);
        let burnt_kg = burning_s.map_or(0.0, |burning_s| burn.burnt_kg(burning_s));
        let feet_m = self.flight.order.mission.airframe.above_feet_m(self.mass.at(burnt_kg).cg_station_m);
        let (gimbal_rad, fins_rad) = (flight.world().gimbal_rad(), flight.world().fins_rad());
        let planned = pilot.powered().planned().filter(|_| self.mode.phase.in_landing_burn());
        let until_s = self.judged().map_or(flight_s, |judged| judged.impact.time_s - air.released_at_s);
        let sigmas = &estimate.sigmas;
        Snapshot {
            since_ignition_s: pilot.ignited_at_s().map(|ignited_at_s| until_s - ignited_at_s),
            motion: Motion::in_space(&estimate.state, feet_m, &estimate.wind_m_s),
            gimbal_rad: core::array::from_fn(|axis| (output.gimbal_rad[axis], gimbal_rad[axis])),
            fins_rad: (output.fins_rad, fins_rad),
            thrust_n: burning_s.map_or(0.0, |burning_s| burn.thrust_n(burning_s)),
            controller: Some(facts(flight.frame() / FRAMES_PER_PLAN, output.level, pilot.report())),
            prediction: planned.and_then(|planned| self.prediction(pilot, estimate, planned, flight_s)),
            path: planned.and_then(|planned| path_from_the_east(pilot, estimate, planned)),
            solve_time_s: air.took_s,
            thrust_scale: motor.impulse_scale(),
            descent: Some(self.descent(pilot, estimate, feet_m)),
            // Where the truth is the estimate there is no estimator to speak of.
            estimator: standing.sensors.map(|_| EstimatorFacts {
                health: estimate.health,
                horizontal_sigma_m: sigmas.position_m.xy().max(),
                height_sigma_m: sigmas.position_m.z,
            }),
            ..standing
        }
    }

    fn descent(&self, pilot: &Pilot, estimate: &Estimate, feet_m: f64) -> DescentFacts {
        let outlook = pilot.outlook();
        let (place, velocity) = (&estimate.state.position_m, &estimate.state.velocity_m_s);
        let height_m = place.z - feet_m;
        let touchdown = touchdown_m(place, velocity, height_m);
        let motor = pilot.motor();
        let deciding = self.mode.phase.in_descent();
        // Also on the ground, after a descent under it.
        let fired = self.air.as_ref().is_some_and(|air| air.sortie.flight().world().parachute_ejected());
        let weights_felt = estimate.specific_force_m_s2.norm() / self.flight.order.mission.gravity_m_s2;
        let carried = velocity.z.abs() < CARRIED_M_S && weights_felt > CARRIED_WEIGHTS;
        DescentFacts {
            height_m,
            vertical_m_s: velocity.z,
            band_m: outlook.ignition.band.map(|band| (band.low_m, band.high_m)),
            chosen_m: outlook.ignition.chosen_m,
            commit_height_m: outlook.commit_height_m,
            ignition_in_s: outlook.ignition.command_in_s.filter(|_| deciding),
            // North is x, east is against y.
            wind_m_s: [estimate.wind_m_s.x, -estimate.wind_m_s.y],
            drag_scale: motor.air_scale(),
            thrust_scale: motor.impulse_scale(),
            touchdown_m: [touchdown.x, -touchdown.y],
            chute: match self.mode.phase {
                Phase::Chute if carried => Chute::Open,
                Phase::Chute => Chute::Fired,
                _ if fired => Chute::Open,
                _ => Chute::Stowed,
            },
        }
    }

    /// The plan's end over the ground; the plan itself moves with the wind.
    fn prediction(
        &self,
        pilot: &Pilot,
        estimate: &Estimate,
        (states, step_s): (&[PlanarState], f64),
        flight_s: f64,
    ) -> Option<Prediction> {
        let guidance = pilot.powered();
        let whole_s = states.len().saturating_sub(1) as f64 * step_s;
        let mut state = Plane::over_ground(states.last()?, along_m_s(estimate, guidance.plane()?), whole_s);
        // A plan that misses its end by no more than this counts as a landing: it ends on the ground.
        if state.z_m.abs() <= self.flight.order.mission.powered.landing_miss {
            state.z_m = 0.0;
        }
        Some(Prediction {
            time_to_go_s: guidance.left_s(flight_s)?,
            state,
            violations: violations(&LandingVerdict::judge_plan(&self.limits.legs, &state)),
        })
    }
}

/// The wind along the plane, m/s.
fn along_m_s(estimate: &Estimate, plane: &Plane) -> f64 {
    estimate.wind_m_s.push(0.0).dot(&plane.along)
}

/// The plan's path over the ground as it looks from the east, where the path that is flown is seen from too: its plane
/// stands as it happens to.
fn path_from_the_east(
    pilot: &Pilot,
    estimate: &Estimate,
    (states, step_s): (&[PlanarState], f64),
) -> Option<Path> {
    let plane = pilot.powered().plane()?;
    let wind_m_s = along_m_s(estimate, plane);
    let beside_north_m = estimate.state.position_m.dot(&plane.across) * plane.across.x;
    Path::through(states.len(), |node| {
        let state = Plane::over_ground(&states[node], wind_m_s, node as f64 * step_s);
        (state.x_m * plane.along.x + beside_north_m, state.z_m)
    })
}

fn facts(tick: u64, level: ControlLevel, report: &PoweredReport) -> ControllerFacts {
    ControllerFacts {
        tick,
        cost: report.cost,
        kkt_stationarity: report.kkt_stationarity,
        kkt_feasibility: report.kkt_feasibility,
        iterations: u32::try_from(report.iterations).unwrap_or(u32::MAX),
        level,
        status: report.status,
    }
}
