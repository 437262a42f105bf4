//! Flies one flight of a campaign and collects the values of its row.

use flight::guidance::powered::ControlLevel;
use flight::rules::phase::Phase;
use flight::vehicle::mission::LegLimits;
use ocp::Status;
use sim::outcome::by_envelope;
use sim::outside::{Outside, Unwatched, Watch};
use sim::recipe::Recipe;
use sim::sortie::{SetUpError, Sortie};
use sim::world::FirstContact;

use crate::row::Row;

/// Fraction of the gimbal's travel from which a command counts as at its stop.
const AT_STOP_SHARE: f64 = 0.999;
/// Time since thrust onset at which the filter has processed most of the burn, and the plan can
/// still use its estimate, s.
const MOTOR_ESTIMATED_S: f64 = 3.0;

/// Frames between two looks at the consistency of the estimate.
const NEES_EVERY: u64 = 10;

/// A running flight, and the values collected for its row.
pub struct Tally {
    flight: Sortie,
    /// Values available before the end.
    so_far: Row,
    /// Sum over frames, and their number.
    nees_of_motion: (f64, u32),
    burning_frames: u64,
    saturated_frames: u64,
}

impl Tally {
    /// Flight `number` of a recipe, before its release.
    ///
    /// # Errors
    /// The flight cannot be set up.
    pub fn new(recipe: &Recipe, number: u64) -> Result<Self, SetUpError> {
        Ok(Self {
            flight: Sortie::new(recipe, number)?,
            so_far: Row { number, ..Row::default() },
            nees_of_motion: (0.0, 0),
            burning_frames: 0,
            saturated_frames: 0,
        })
    }

    pub fn flight(&self) -> &Sortie {
        &self.flight
    }

    /// The flight, for a caller that asks for an abort.
    pub fn flight_mut(&mut self) -> &mut Sortie {
        &mut self.flight
    }

    /// Flies one frame. Returns `false` when the flight is over.
    pub fn step(&mut self) -> bool {
        self.step_watched(&mut Unwatched)
    }

    /// Flies one frame, which somebody watches.
    pub fn step_watched(&mut self, watch: &mut dyn Watch) -> bool {
        let decided = self.flight.step_with(&Outside::NOBODY, watch);
        self.count(decided.is_some_and(|output| output.planned));
        self.flight.goes_on()
    }

    fn count(&mut self, planned: bool) {
        let (flight, row) = (&self.flight, &mut self.so_far);
        let (world, pilot, computer) = (flight.world(), flight.pilot(), flight.computer());
        if !row.ignited && pilot.ignited_at_s().is_some() {
            row.ignited = true;
            row.chosen_onset_height_m = pilot.prediction().ignition.chosen_m;
            row.ignition_height_m = Some(world.height_m());
            row.ignition_outside_gate = pilot.gate_refusal().is_some();
        }
        if row.onset_height_m.is_none() && world.thrust_n() > 0.0 {
            row.onset_height_m = Some(world.height_m());
            row.onset_vertical_m_s = Some(world.state().velocity_m_s.z);
        }
        if world.touchdown().is_some() {
            return;
        }
        let burning_s = world.thrust_begins_s().map_or(-1.0, |begins_s| world.time_s() - begins_s);
        if burning_s >= 0.0 {
            // It changes slowly.
            if flight.frame().is_multiple_of(NEES_EVERY)
                && let Some(nees) = flight.nees_of_motion()
            {
                self.nees_of_motion = (self.nees_of_motion.0 + nees, self.nees_of_motion.1 + 1);
            }
            if burning_s >= MOTOR_ESTIMATED_S && row.nees_of_motor.is_none() {
                row.nees_of_motor = flight.nees_of_motor();
            }
        }
        if computer.mode().phase != Phase::Powered || flight.computer_is_dead() {
            return;
        }
        self.burning_frames += 1;
        let stop_rad = AT_STOP_SHARE * flight.mission().airframe.gimbal.limit_rad();
        self.saturated_frames +=
            u64::from(computer.commands().gimbal_rad.iter().any(|angle| angle.abs() >= stop_rad));
        if planned {
            let report = pilot.report();
            let plans = match computer.level() {
                ControlLevel::Idle | ControlLevel::Rehearsal => None,
                ControlLevel::Converged => Some(&mut row.plans_converged),
                ControlLevel::BestFeasible => Some(&mut row.plans_best_feasible),
                ControlLevel::ShiftedPlan => Some(&mut row.plans_shifted),
                ControlLevel::Stabiliser => Some(&mut row.plans_stabiliser),
            };
            if let Some(plans) = plans {
                *plans += 1;
            }
            row.solver_iterations += report.iterations as u64;
            let solved = matches!(report.status, Status::Converged | Status::NotRun);
            row.solver_failures += u64::from(!solved);
        }
    }

    /// The row of the flight so far.
    pub fn row(&self) -> Row {
        let outcome = self.flight.outcome();
        let (touchdown, landing) = (outcome.touchdown.as_ref(), outcome.landing);
        let world = self.flight.world();
        let errors = self.flight.largest_errors();
        let drawn = self.flight.drawn();
        let (truth, apogee) = (&drawn.truth, self.flight.fell_from());
        let at = |read: fn(&FirstContact) -> f64| touchdown.map(read);
        let strain = outcome.rest.and_then(|rest| rest.strain);
        Row {
            impulse_scale: truth.impulse_scale,
            burn_time_scale: truth.burn_time_scale,
            ignition_delay_s: truth.ignition_delay_s,
            thrust_misalignment_pitch_deg: truth.thrust_misalignment_rad[0].to_degrees(),
            thrust_misalignment_yaw_deg: truth.thrust_misalignment_rad[1].to_degrees(),
            mass_scale: truth.mass_scale,
            drag_scale: truth.drag_scale,
            cg_offset_y_m: truth.cg_offset_m[1],
            cg_offset_z_m: truth.cg_offset_m[2],
            wind_m_s: truth.wind_m_s,
            wind_towards_deg: truth.wind_towards_rad.to_degrees(),
            apogee_height_m: apogee.position_m.z,
            apogee_distance_m: libm::hypot(apogee.position_m.x, apogee.position_m.y),
            apogee_speed_m_s: libm::hypot(apogee.velocity_m_s.x, apogee.velocity_m_s.y),
            apogee_tilt_deg: apogee.tilt_rad().to_degrees(),
            apogee_rate_deg_s: libm::sqrt(apogee.rate_rad_s.norm_squared()).to_degrees(),
            parachute: world.parachute_ejected_s().is_some(),
            burn_time_at_contact_s: touchdown
                .zip(world.thrust_begins_s())
                .map(|(touchdown, begins_s)| touchdown.time_s - begins_s)
                .filter(|burning_s| *burning_s >= 0.0),
            touchdown_time_s: at(|touchdown| touchdown.time_s),
            touchdown_vertical_m_s: at(|touchdown| touchdown.over_ground.vertical_m_s),
            touchdown_lateral_m_s: at(|touchdown| touchdown.over_ground.lateral_m_s),
            touchdown_tilt_deg: at(|touchdown| touchdown.over_ground.tilt_rad.to_degrees()),
            touchdown_rate_deg_s: at(|touchdown| touchdown.over_ground.rate_rad_s.to_degrees()),
            touchdown_x_m: at(|touchdown| touchdown.state.position_m.x),
            touchdown_y_m: at(|touchdown| touchdown.state.position_m.y),
            touchdown_thrust_over_weight: at(|touchdown| touchdown.thrust_n / touchdown.weight_n),
            leg_use: touchdown.map(|contact| leg_use(&self.flight.mission().leg_limits, contact)),
            stands: landing.stands,
            upright: landing.upright,
            envelope: landing.envelope,
            table_2: landing.table_2,
            failure: outcome.failure.map_or("", |failure| failure.name()).to_owned(),
            rest: outcome.rest.map_or("", |rest| rest.outcome.name()).to_owned(),
            stroke_used: strain.map(|strain| strain.stroke_used),
            strength_used: strain.map(|strain| strain.strength_used),
            clearance_m: strain.map(|strain| strain.clearance_m),
            leaned_deg: strain.map(|strain| strain.tilt_rad.to_degrees()),
            phase: outcome.phase.name().to_owned(),
            gimbal_saturation_share: self.saturated_frames as f64 / self.burning_frames.max(1) as f64,
            error_vertical_m_s: errors.vertical_m_s,
            error_lateral_m_s: errors.lateral_m_s,
            error_height_m: errors.height_m,
            error_nose_deg: errors.nose_rad.to_degrees(),
            nees_of_motion: (self.nees_of_motion.1 > 0)
                .then(|| self.nees_of_motion.0 / f64::from(self.nees_of_motion.1)),
            faults: self.flight.faults_happened(),
            flight_time_s: world.rest().map_or_else(|| world.time_s(), |rest| rest.time_s),
            ..self.so_far.clone()
        }
    }
}

/// The largest share of the legs' design envelope.
fn leg_use(legs: &LegLimits, contact: &FirstContact) -> f64 {
    let shares = by_envelope(legs, contact).results.map(|limit| limit.value.abs() / limit.highest);
    shares.into_iter().fold(0.0, f64::max)
}

/// Flies a whole flight.
///
/// # Errors
/// The flight cannot be set up.
pub fn fly(recipe: &Recipe, number: u64) -> Result<Row, SetUpError> {
    let mut tally = Tally::new(recipe, number)?;
    while tally.step() {}
    Ok(tally.row())
}
