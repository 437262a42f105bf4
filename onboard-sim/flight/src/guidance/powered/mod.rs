//! Phase 2: from ignition to touchdown on a motor that cannot be throttled.
//!
//! A tick requests a landing from the [NMPC](ocp::landing): gimbal, fins and final time at once,
//! starting from the flown plan. It is [searched](Search) outside the frames, and flown from the
//! frame on in which it is ready. The nose may lean in any direction. The plan contains the thrust
//! curve as estimated by [`Burn`](crate::vehicle::burn::Burn), the burning mass, the drag of body
//! and fins, a floor above the ground, and a free final time that is not before the thrust falls
//! through the weight. In each frame the plan gives the direction of the nose and the opening of
//! the fins.
//!
//! Without a plan the guidance degrades in reported steps, the [`ControlLevel`]s.

mod plan;
mod report;
mod search;
mod situation;

use nalgebra::Vector3;
use ocp::landing::SolverLimits;
use ocp::{Outcome, Status};
use serde::{Deserialize, Serialize};

pub use self::plan::Plan;
pub use self::report::{ControlLevel, PoweredReport, PoweredSettings};
use self::search::MOST_INTERVALS;
pub use self::search::{LandingSolved, Search};
pub use self::situation::PoweredSituation;
use crate::control::aim::Aim;
use crate::vehicle::rigid::RigidState;

/// Largest lean that corrects the velocity when a plan is flown to its end, rad: 3 degrees, well
/// within the limits of the legs.
const END_LEAN_MAX_RAD: f64 = 0.05;

/// Largest lean with which a vehicle is brought to rest before contact, rad: 5 degrees, half of the
/// legs' limit.
const CONTACT_LEAN_RAD: f64 = 0.0873;

/// A plan that touches down faster than this is not flown unless the vehicle is high, m/s: the
/// upright law brakes just as well.
const HARD_M_S: f64 = -1.2;

/// The guidance and its memory.
#[derive(Debug, Clone, Serialize)]
pub struct PoweredGuidance {
    #[serde(skip)]
    settings: PoweredSettings,
    report: PoweredReport,
    /// Without intervals before the first plan.
    flown: Plan,
}

impl PoweredGuidance {
    /// Guidance without a plan, and a search with room for every plan, however long the motor
    /// burns.
    ///
    /// It plans a landing with the most intervals and forgets the plans, so that every buffer has
    /// its size.
    pub fn with_room(
        settings: PoweredSettings,
        state: &RigidState,
        situation: &PoweredSituation<'_>,
    ) -> (Self, Search) {
        let solver = SolverLimits { max_iterations: 1, ..settings.solver };
        // As many intervals as there can be, and no longer than in flight: of longer ones fewer
        // would be settled.
        let carried_s = situation.ends_s(0.0, 0.0).map_or(0.0, |(earliest_s, _)| earliest_s);
        let latest_after_s = MOST_INTERVALS as f64 * settings.interval_s - carried_s;
        let mut planned = Self::new(PoweredSettings { solver, max_solves: 1, latest_after_s, ..settings });
        let mut search = Search::default();
        // Cold, warm, and cold again: the search swaps its buffers, and a warm plan is shorter.
        planned.plan(&mut search, state, situation);
        planned.plan(&mut search, state, situation);
        search.reserve(&planned.flown);
        planned.flown.clear();
        planned.plan(&mut search, state, situation);
        planned.flown.clear();
        (Self { settings, report: PoweredReport::default(), ..planned }, search)
    }

    /// Guidance without a plan.
    pub fn new(settings: PoweredSettings) -> Self {
        Self { settings, report: PoweredReport::default(), flown: Plan::default() }
    }

    /// Plans from time zero, and takes the plan over at once.
    fn plan(&mut self, search: &mut Search, state: &RigidState, situation: &PoweredSituation<'_>) {
        search.begin(&self.flown);
        let outcome = search.search(&self.settings, 0.0, state, situation);
        self.take_over(search, outcome.as_ref(), situation.high, [0.0; 2]);
    }

    /// The same memory with other settings.
    #[must_use]
    pub(crate) fn reconfigured(&self, settings: &PoweredSettings) -> Self {
        Self { settings: *settings, ..self.clone() }
    }

    /// The report of the last tick.
    pub fn report(&self) -> &PoweredReport {
        &self.report
    }

    /// The plan that is flown.
    pub fn planned(&self) -> Option<&Plan> {
        (self.flown.intervals() > 0).then_some(&self.flown)
    }

    /// Time until the flown plan ends, s.
    pub fn left_s(&self, time_s: f64) -> Option<f64> {
        self.planned().map(|plan| plan.left_s(time_s))
    }

    /// Starts the next search from the flown plan.
    pub(crate) fn begin(&self, search: &mut Search) {
        search.begin(&self.flown);
    }

    /// Takes over the search result, if it is finite; there is no outcome if the thrust never
    /// carries the vehicle. `high`: as in its situation; the times are those of the request and of
    /// the present frame.
    pub(crate) fn take_over(
        &mut self,
        search: &mut Search,
        outcome: Option<&Outcome>,
        high: bool,
        [requested_at_s, time_s]: [f64; 2],
    ) {
        let took_s = time_s - requested_at_s;
        let Some(outcome) = outcome else {
            let level = ControlLevel::Stabiliser;
            self.report = PoweredReport { level, requested_at_s, took_s, ..PoweredReport::default() };
            return;
        };
        let found = &mut search.found;
        let usable = found.is_finite();
        // Too low for any landing: upright brakes just as well. High above the ground it would stop
        // the vehicle there.
        let too_low = !high && found.end_m_s() < HARD_M_S;
        let lands = outcome.status == Status::Converged && outcome.miss <= self.settings.landing_miss;
        // Processors give the NaN of a broken plan different signs, and the report is in the
        // digest.
        let one_nan = |value: f64| if value.is_nan() { f64::NAN } else { value };
        self.report = PoweredReport {
            level: ControlLevel::of_plan(usable, self.left_s(time_s), too_low, lands),
            status: outcome.status,
            iterations: outcome.iterations,
            passes: search.workspace.passes(),
            requested_at_s,
            took_s,
            kkt_stationarity: one_nan(outcome.stationarity),
            kkt_feasibility: one_nan(outcome.feasibility),
            cost: one_nan(outcome.cost),
            condition_miss: one_nan(outcome.miss),
            touchdown_in_s: one_nan(found.left_s(time_s)),
            touchdown_m_s: one_nan(found.end_m_s()),
            largest_tilt_rad: one_nan(found.largest_tilt_rad()),
        };
        if usable {
            core::mem::swap(&mut self.flown, found);
        }
    }

    /// Share of the fins' drag area that the plan has at a time.
    pub fn fin_share(&self, time_s: f64) -> Option<f64> {
        let planned = self.flown.fin_share(time_s)?;
        // Too low for any landing: brake.
        Some(if self.report.level == ControlLevel::Stabiliser { 1.0 } else { planned })
    }

    /// The commanded direction of the nose at a time.
    ///
    /// A vehicle whose foot is about to touch is only brought to rest, because it may touch before
    /// its plan ends: a lean of 10 degrees lowers a foot of mk2 by 7 cm, which it sinks in 0.15 s.
    pub fn aim(&self, time_s: f64, state: &RigidState, situation: &PoweredSituation<'_>) -> Aim {
        let quiet_s = self.settings.contact_quiet_s;
        if quiet_s > 0.0 && situation.touches_within(quiet_s, state) {
            return Aim::leaning_at_most(&state.nose_in_world(), CONTACT_LEAN_RAD);
        }
        let thrust_n = situation.burn.thrust_n(situation.burning_s);
        let level_m_s2 = |push_m_s2: f64| {
            let most = self.settings.upright_lean_max_deg.to_radians();
            libm::atan(push_m_s2 * situation.mass_kg() / thrust_n.max(1.0)).clamp(-most, most)
        };
        let decay = self.settings.upright_decay_per_s;
        let flown = self.planned().filter(|_| self.report.level != ControlLevel::Stabiliser);
        if let Some(aim) = flown.and_then(|plan| {
            self.planned_aim(plan, time_s, state, |astray_m_s| level_m_s2(-decay * astray_m_s))
        }) {
            return aim;
        }
        // Upright, with a lean against the sideways velocity.
        let air_m_s2 = situation.air_m_s2(state);
        let lean = |direction: &Vector3<f64>| {
            libm::tan(level_m_s2(-decay * state.velocity_m_s.dot(direction) - air_m_s2.dot(direction)))
        };
        let nose = Vector3::z() + Vector3::x() * lean(&Vector3::x()) + Vector3::y() * lean(&Vector3::y());
        Aim::at(nose / nose.norm())
    }

    /// The direction in a plan at a time; `None` after its end. `push` makes a lean, as a tangent,
    /// from a velocity to be lost.
    fn planned_aim(
        &self,
        plan: &Plan,
        time_s: f64,
        state: &RigidState,
        push: impl Fn(f64) -> f64,
    ) -> Option<Aim> {
        let settings = &self.settings;
        let aim = plan.aim(time_s)?;
        let left_s = plan.left_s(time_s);
        if left_s < settings.quiet_s {
            return Some(Aim::at(state.nose_in_world()));
        }
        if left_s >= settings.flown_out_s {
            return Some(aim);
        }
        // A plan that is flown to its end needs a correction of the velocity.
        let [x_m_s, y_m_s] = plan.level_m_s(time_s);
        let lean = |astray_m_s: f64| push(astray_m_s).clamp(-END_LEAN_MAX_RAD, END_LEAN_MAX_RAD);
        let nose = aim.nose_in_world
            + Vector3::x() * lean(state.velocity_m_s.x - x_m_s)
            + Vector3::y() * lean(state.velocity_m_s.y - y_m_s);
        Some(Aim { nose_in_world: nose / nose.norm(), ..aim })
    }
}

// Chooses the landing point of a plan, in each level direction alone.

/// Limits of the homing to the pad: a plan lands only as near as necessary, and diverts no farther
/// than a moderate lean reaches.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Homing {
    /// Distance from the pad that counts as near enough, m.
    pub near_m: f64,
    /// Largest diversion of a plan, per squared second that is left, m/s^2.
    #[serde(default)]
    pub reach_m_s2: f64,
}

impl Homing {
    /// The landing point in one direction, m from the pad, at a velocity of `along_m_s` with
    /// `left_s` to go.
    pub(crate) fn target_m(&self, x_m: f64, along_m_s: f64, left_s: f64) -> f64 {
        let free_m = here_m(x_m, along_m_s, left_s);
        let reach_m = self.reach_m_s2 * left_s * left_s;
        free_m + (free_m.clamp(-self.near_m, self.near_m) - free_m).clamp(-reach_m, reach_m)
    }
}

/// The landing point without homing, m from the pad: the end of a constant deceleration from
/// `along_m_s` in `left_s`. It needs the smallest lean.
pub(crate) fn here_m(x_m: f64, along_m_s: f64, left_s: f64) -> f64 {
    x_m + 0.5 * along_m_s * left_s
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    use crate::vehicle::burn::Burn;
    use crate::vehicles::mission::builtin;

    // Guidance without a good plan.

    /// A vehicle in the middle of its burn, 7 m above the ground at 5 m/s and moving sideways at 3
    /// m/s: it must waste more thrust than it can without hovering.
    fn too_high(mission: &str, high: bool) -> PoweredGuidance {
        let mission = builtin(mission).unwrap().unwrap();
        let feet_below_cg_m = 0.44;
        let situation = PoweredSituation {
            burn: Burn::nominal(&mission.motor_curve),
            burning_s: 2.5,
            mass_at_ignition_kg: 3.1,
            inertia_kg_m2: 0.12,
            arm_m: 0.4,
            feet_below_cg_m,
            foot_radius_m: 0.4,
            air_density_kg_m3: 1.2,
            wind_m_s: Vector3::zeros(),
            body_drag_area_m2: 0.003,
            crossflow_area_m2: 0.062,
            fin_drag_area_m2: 0.0,
            gimbal_limit_rad: 5.0_f64.to_radians(),
            lands_in_place: false,
            high,
        };
        let state = RigidState {
            velocity_m_s: Vector3::new(3.0, 0.0, -5.0),
            world_from_body: UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -0.07)
                * RigidState::upright(0.0).world_from_body,
            ..RigidState::upright(7.0 + feet_below_cg_m)
        };
        // Without a bound: a cold search that is cut short has not found yet how hard this ends.
        let mut guidance = PoweredGuidance::new(PoweredSettings { max_passes: None, ..mission.powered });
        guidance.plan(&mut Search::default(), &state, &situation);
        guidance
    }

    #[test]
    fn a_vehicle_that_is_high_flies_a_hard_plan_and_does_not_brake_upright() {
        for mission in ["mk2", "mk3"] {
            let low = too_high(mission, false);
            assert!(low.report().touchdown_m_s < HARD_M_S, "{mission}: {:?}", low.report());
            assert_eq!(low.report().level, ControlLevel::Stabiliser, "{mission}");

            let high = too_high(mission, true);
            assert_eq!(high.report().level, ControlLevel::BestFeasible, "{mission}: {:?}", high.report());
            let tilt_rad = high.report().largest_tilt_rad;
            assert!(tilt_rad > 45.0_f64.to_radians(), "{mission}: {:?}", high.report());
        }
    }

    #[test]
    fn a_plan_diverts_to_the_edge_of_the_pad_within_its_reach() {
        let homing = Homing { near_m: 6.0, reach_m_s2: 0.5 };
        assert!((homing.target_m(4.0, 0.0, 4.0) - 4.0).abs() < 1e-12, "near enough");
        assert!((homing.target_m(10.0, 0.0, 4.0) - 6.0).abs() < 1e-12, "to the edge");
        assert!((homing.target_m(-50.0, 0.0, 4.0) + 42.0).abs() < 1e-12, "8 m are in reach in 4 s");
        assert!((homing.target_m(10.0, -4.0, 4.0) - 2.0).abs() < 1e-12, "braking evenly ends there");
    }
}
