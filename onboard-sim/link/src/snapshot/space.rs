//! The rocket's state at one instant, for telemetry: what its flight computer believes.

use flight::computer::pilot::{FRAMES_PER_PLAN, Pilot, touchdown_from_below_m, touchdown_m};
use flight::estimation::estimator::Estimate;
use flight::guidance::powered::{ControlLevel, Plane, PoweredReport};
use flight::rules::outputs::Line;
use flight::rules::phase::Phase;
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::airframe::MassModel;
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::mission::{Mission, StartPoint};
use flight::vehicle::rigid::RigidState;
use nalgebra::{Vector2, Vector3};

use super::{
    AscentFacts, BatteryFacts, Booster, Chute, ControllerFacts, DescentFacts, EstimatorFacts, Known, Motion,
    Path, Prediction, SensorFacts, Snapshot, violations,
};

/// Under a parachute that carries the fall is slower than this, m/s (canopies are sized for 6, an open fall is 20 to 40),
/// and more than this share of the weight is felt: right after apogee the fall is slow, too, but free.
const CARRIED_M_S: f64 = 10.0;
const CARRIED_WEIGHTS: f64 = 0.5;

/// What is known of it beside its computer's memory.
#[derive(Debug, Clone, Copy)]
pub struct InSpace<'a> {
    pub known: Known<'a>,
    pub mission: &'a Mission,
    /// Where the gimbal is (pitch, yaw), rad.
    pub gimbal_rad: [f64; 2],
    /// Where the fins are, rad.
    pub fins_rad: [f64; 4],
    pub sensors: Option<SensorFacts>,
    /// `None` where its voltage is not measured.
    pub battery: Option<BatteryFacts>,
    /// What the rehearsal found, where there was one.
    pub rehearsed: Option<&'a PoweredReport>,
    /// The parachute was thrown out, in this phase or before it.
    pub parachute_ejected: bool,
    /// How long the last plan took, s.
    pub took_s: f64,
}

impl InSpace<'_> {
    /// The state now.
    pub fn snapshot(&self) -> Snapshot {
        let (computer, mission) = (self.known.computer, self.mission);
        let pilot = computer.pilot();
        let limits = TouchdownLimits::of_the_legs(mission);
        let mass = MassModel::new(&mission.airframe.mass, pilot.curve().propellant_mass_kg());
        let cg_m = mission.airframe.above_feet_m(mass.at(0.0).cg_station_m);
        let hanging_m = computer.stance().hanging_m.filter(|height_m| height_m.is_finite());
        let believed = RigidState {
            position_m: Vector3::z() * hanging_m.unwrap_or(cg_m),
            ..computer.believed_on_the_pad()
        };
        let commands = computer.commands();
        let standing = Snapshot {
            gimbal_rad: core::array::from_fn(|axis| (commands.gimbal_rad[axis], self.gimbal_rad[axis])),
            fins_rad: (commands.fins_rad, self.fins_rad),
            controller: self.rehearsed.map(|report| facts(0, ControlLevel::Rehearsal, report)),
            gimbal_limit_rad: mission.airframe.gimbal.limit_rad(),
            sensors: self.sensors,
            site: mission.site,
            pad_altitude_m: mission.pad_altitude_m,
            battery: self.battery,
            ..self.known.standing(Motion::in_space(&believed, cg_m, &Vector2::zeros()), limits)
        };
        let flying = computer.released_at_s().zip(computer.flown()).zip(pilot.estimate());
        match flying {
            None => standing,
            Some(((released_at_s, flown), estimate)) => {
                let since = Airborne {
                    released_at_s,
                    frame: flown.frame,
                    flight_s: flown.time_s,
                    level: computer.level(),
                    estimate,
                    mass: &mass,
                };
                self.flying(pilot, &since, &standing)
            }
        }
    }

    fn flying(&self, pilot: &Pilot, since: &Airborne<'_>, standing: &Snapshot) -> Snapshot {
        let &Airborne { released_at_s, frame, flight_s, level, estimate, mass } = since;
        let motor = pilot.motor();
        let burn = motor.burn(pilot.curve());
        let burning_s = pilot.burning_s(flight_s);
        let burnt_kg = burning_s.map_or(0.0, |burning_s| burn.burnt_kg(burning_s));
        let feet_m = self.mission.airframe.above_feet_m(mass.at(burnt_kg).cg_station_m);
        let planned =
            pilot.powered().planned().filter(|_| self.known.computer.mode().phase.in_landing_burn());
        let until_s = self.known.judged.map_or(flight_s, |judged| judged.impact.time_s - released_at_s);
        let sigmas = &estimate.sigmas;
        Snapshot {
            since_zero_s: Some(until_s),
            motion: Motion::in_space(&estimate.state, feet_m, &estimate.wind_m_s),
            thrust_n: burning_s.map_or(0.0, |burning_s| burn.thrust_n(burning_s)),
            controller: Some(facts(frame / FRAMES_PER_PLAN, level, pilot.report())),
            prediction: planned.and_then(|planned| {
                let landing_miss = self.mission.powered.landing_miss;
                prediction(pilot, estimate, planned, flight_s, landing_miss, &standing.limits)
            }),
            path: planned.and_then(|planned| path_from_the_east(pilot, estimate, planned)),
            solve_time_s: self.took_s,
            thrust_scale: motor.impulse_scale(),
            descent: Some(self.descent(pilot, estimate, feet_m)),
            // Where the truth is the estimate there is no estimator to speak of.
            estimator: standing.sensors.map(|_| EstimatorFacts {
                health: estimate.health,
                horizontal_sigma_m: sigmas.position_m.xy().max(),
                height_sigma_m: sigmas.position_m.z,
            }),
            ..standing.clone()
        }
    }

    fn descent(&self, pilot: &Pilot, estimate: &Estimate, feet_m: f64) -> DescentFacts {
        let phase = self.known.computer.mode().phase;
        let prediction = pilot.prediction();
        let (place, velocity) = (&estimate.state.position_m, &estimate.state.velocity_m_s);
        let height_m = place.z - feet_m;
        let rising = phase.before_apogee();
        let motor = pilot.motor();
        let deciding = phase.in_descent();
        let weights_felt = estimate.specific_force_m_s2.norm() / self.mission.gravity_m_s2;
        let carried = velocity.z.abs() < CARRIED_M_S && weights_felt > CARRIED_WEIGHTS;
        // Where a parachute takes it is known once it drifts with the wind.
        let awaits_chute = if rising {
            self.known.computer.mode().interlocks.abort_latched
        } else {
            phase == Phase::Chute && !carried
        };
        let touchdown = match (awaits_chute, rising) {
            (true, _) => Vector2::repeat(f64::NAN),
            (false, true) => touchdown_from_below_m(place, velocity),
            (false, false) => touchdown_m(place, velocity, height_m),
        };
        DescentFacts {
            height_m,
            vertical_m_s: velocity.z,
            band_m: prediction.ignition.band.map(|band| (band.low_m, band.high_m)),
            chosen_m: prediction.ignition.chosen_m,
            commit_height_m: prediction.commit_height_m,
            ignition_in_s: prediction.ignition.command_in_s.filter(|_| deciding),
            // North is x, east is against y.
            wind_m_s: [estimate.wind_m_s.x, -estimate.wind_m_s.y],
            drag_scale: motor.air_scale(),
            thrust_scale: motor.impulse_scale(),
            touchdown_m: [touchdown.x, -touchdown.y],
            chute: match phase {
                Phase::Chute if carried => Chute::Open,
                Phase::Chute => Chute::Fired,
                // Also on the ground, after a descent under it.
                _ if self.parachute_ejected => Chute::Open,
                _ => Chute::Stowed,
            },
            ascent: self.ascent(pilot, phase),
        }
    }

    /// The way up of a flight from the pad.
    fn ascent(&self, pilot: &Pilot, phase: Phase) -> Option<AscentFacts> {
        if self.mission.start.at != StartPoint::Pad {
            return None;
        }
        let computer = self.known.computer;
        let attached = computer.flown().is_some_and(|flown| flown.booster_attached);
        let booster = match (attached, computer.commands().outputs.is_on(Line::Separation)) {
            (true, false) => Booster::Attached,
            (true, true) => Booster::Separating,
            (false, _) => Booster::Separated,
        };
        Some(AscentFacts { booster, apogee: pilot.apogee_ahead(phase), over: !phase.before_apogee() })
    }
}

/// A rocket in the air, or on the ground after its flight.
#[derive(Clone, Copy)]
struct Airborne<'a> {
    released_at_s: f64,
    /// Number of the frame since then.
    frame: u64,
    /// Time since then, s.
    flight_s: f64,
    level: ControlLevel,
    estimate: &'a Estimate,
    mass: &'a MassModel,
}

/// The plan's end over the ground; the plan itself moves with the wind.
fn prediction(
    pilot: &Pilot,
    estimate: &Estimate,
    (states, step_s): (&[PlanarState], f64),
    flight_s: f64,
    landing_miss: f64,
    limits: &TouchdownLimits,
) -> Option<Prediction> {
    let guidance = pilot.powered();
    let whole_s = states.len().saturating_sub(1) as f64 * step_s;
    let mut state = Plane::over_ground(states.last()?, along_m_s(estimate, guidance.plane()?), whole_s);
    // A plan that misses its end by no more than this counts as a landing: it ends on the ground.
    if state.z_m.abs() <= landing_miss {
        state.z_m = 0.0;
    }
    Some(Prediction {
        time_to_go_s: guidance.left_s(flight_s)?,
        state,
        violations: violations(&LandingVerdict::judge_plan(limits, &state)),
    })
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
