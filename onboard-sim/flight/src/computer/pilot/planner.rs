//! Computations longer than a frame: the landing under thrust, and the prediction in the fall.
//!
//! A frame requests one of them and goes on; a later frame, whose input marks it as ready, takes
//! over the result. The request is a copy of all its inputs, so the result does not depend on where
//! and when it is computed. A board computes it in its main context while a timer executes the
//! frames; a simulator or a replay computes it at once and delays its result.

use alloc::boxed::Box;

use nalgebra::{UnitQuaternion, Vector3};
use ocp::{Outcome, Status};

use super::vehicle_model::{Burning, VehicleModel};
use super::{Pilot, Prediction};
use crate::computer::{Computer, FRAME_MS, Rehearsed};
use crate::estimation::estimator::Estimate;
use crate::guidance::powered::{LandingSolved, Plan, Search};
use crate::rules::verdict::Touchdown;
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;

/// Time after its request within which a plan must be ready, s; a slower board is not supported.
/// Twice the period of plans; the bound on a plan's work (`powered.max_passes`) is chosen for it.
pub const PLAN_WITHIN_S: f64 = 0.1;

/// Expected time from request to result, s: a plan is made for the vehicle as it will be then. It
/// is the median of mk2's plans. Of 300 `real` flights of mk2 (seed 7001) 268 land, 242 with plans
/// for the present, and 261 with 40 ms and 60 ms for the first; chosen on that seed, before their
/// instructions were measured.
const EXPECTED_S: f64 = 0.025;

/// Instructions that a Cortex-M7 executes in a frame: 600 MHz, with an assumed 0.67 instructions
/// per cycle.
const INSTRUCTIONS_PER_FRAME: u64 = 400_000 * FRAME_MS as u64;
/// Instructions on an emulated Cortex-M7 (onboard-sim/lab/cortex-m7/README.md): the most expensive
/// of 3,347 predictions, and for a landing the line in the passes of its search that 39 of 3,994
/// plans exceed.
const PREDICTION: u64 = 13_600_000;
const LANDING: u64 = 5_170_000;
const PASS: u64 = 12_050;

/// The problem to solve.
#[derive(Debug, Clone)]
pub(super) enum Problem {
    Landing(Burning),
    /// With the fins' openings, rad, and the height from which it falls, m.
    Prediction {
        fins_rad: [f64; 4],
        apogee_m: f64,
    },
}

/// The result.
#[derive(Debug, Clone)]
enum Solved {
    /// The search's outcome (`None` if the thrust never carries the vehicle), unless the flown plan
    /// is flown to its end; whether the vehicle was high; and the share of the fins' drag area if
    /// no plan has it.
    Landing {
        searched: Option<(Option<Outcome>, bool)>,
        fin_share: Option<f64>,
    },
    Prediction(Prediction),
}

/// A request and its solver. It may be moved to another context, and must be given back.
#[derive(Debug, Clone)]
pub struct Planner {
    model: VehicleModel,
    /// With the estimate's time since the release.
    requested: Option<(Estimate, Problem)>,
    search: Search,
    found: Option<Solved>,
}

impl Planner {
    /// Solves the requested problem, once.
    pub fn solve(&mut self) {
        let Self { model, requested: Some((estimate, problem)), search, found: found @ None } = self else {
            return;
        };
        *found = Some(match problem {
            Problem::Prediction { fins_rad, apogee_m } => {
                Solved::Prediction(model.prediction(estimate, fins_rad, *apogee_m))
            }
            Problem::Landing(burning) => {
                let (settings, time_s) = (&model.mission.powered, estimate.time_s);
                let searched = (!search.is_flown_out(settings, time_s)).then(|| {
                    let (later, burning) = model.later(search.from(), estimate, burning);
                    let situation = model.situation_to_plan(&later, &burning);
                    (search.search(settings, later.time_s, &later.state, &situation), situation.high)
                });
                let outcome = searched.as_ref().and_then(|(outcome, _)| outcome.as_ref());
                let plan_has_no_fin_share = search.to_be_flown(outcome).fin_share(time_s).is_none();
                let fin_share = plan_has_no_fin_share.then(|| model.fin_share(estimate, burning));
                Solved::Landing { fin_share, searched }
            }
        });
    }

    /// Sets the problem to solve.
    pub(super) fn request(&mut self, time_s: f64, estimate: &Estimate, problem: Problem) {
        self.requested = Some((Estimate { time_s, ..*estimate }, problem));
        self.found = None;
    }

    /// Starts the next landing from the plan found, or continues with the last one. Returns whether
    /// the search converged on a landing; `None` if there was no search, because the last plan is
    /// flown to its end or the thrust never carries the vehicle.
    pub(super) fn fly_on(&mut self) -> Option<bool> {
        let Some(Solved::Landing { searched: Some((Some(outcome), _)), .. }) = &self.found else {
            return None;
        };
        self.search.fly_on();
        Some(outcome.status == Status::Converged && outcome.miss <= self.model.mission.powered.landing_miss)
    }

    /// The end of the plan from which the next landing starts.
    pub(super) fn end(&self) -> Touchdown {
        self.search.from().touchdown()
    }

    pub(super) fn model(&self) -> &VehicleModel {
        &self.model
    }

    /// The estimate extrapolated to the time at which its plan is expected.
    pub(super) fn later(&self, estimate: &Estimate, burning: &Burning) -> (Estimate, Burning) {
        self.model.later(self.search.from(), estimate, burning)
    }

    /// Number of frames in which a Cortex-M7 computes this result.
    pub fn frames_on_a_board(&self) -> u64 {
        let instructions = match &self.found {
            Some(Solved::Landing { searched: Some((Some(_), _)), .. }) => {
                LANDING + PASS * self.search.passes() as u64
            }
            Some(Solved::Landing { .. }) => LANDING,
            Some(Solved::Prediction(_)) => PREDICTION,
            None => 0,
        };
        instructions.div_ceil(INSTRUCTIONS_PER_FRAME)
    }
}

impl VehicleModel {
    /// The vehicle when its plan is expected to be ready: until then it moves as in the flown plan,
    /// or without one with constant force and rates.
    fn later(&self, flown: &Plan, estimate: &Estimate, burning: &Burning) -> (Estimate, Burning) {
        let time_s = estimate.time_s;
        let later_s = time_s + EXPECTED_S;
        let mut state = estimate.state;
        let gained_m_s =
            if let Some(((from_m_s, from), (to_m_s, to))) = flown.at(time_s).zip(flown.at(later_s)) {
                let rate = state.world_from_body * state.rate_rad_s;
                // A deviation from the planned rate persists.
                let astray = UnitQuaternion::from_scaled_axis((rate - from.rate_in_world_rad_s) * EXPECTED_S);
                let turned = UnitQuaternion::rotation_between(&from.nose_in_world, &to.nose_in_world);
                state.world_from_body = astray * turned.unwrap_or_default() * state.world_from_body;
                state.rate_rad_s = state
                    .world_from_body
                    .inverse_transform_vector(&(rate + to.rate_in_world_rad_s - from.rate_in_world_rad_s));
                to_m_s - from_m_s
            } else {
                let turned = UnitQuaternion::from_scaled_axis(state.rate_rad_s * EXPECTED_S);
                let force_m_s2 = state.world_from_body * estimate.specific_force_m_s2;
                state.world_from_body *= turned;
                (force_m_s2 - Vector3::z() * STANDARD_GRAVITY_M_S2) * EXPECTED_S
            };
        state.position_m += (state.velocity_m_s + gained_m_s * 0.5) * EXPECTED_S;
        state.velocity_m_s += gained_m_s;
        let burning_s = burning.burning_s + EXPECTED_S;
        let mass = self.mass_now(Some(burning_s));
        (Estimate { time_s: later_s, state, ..*estimate }, Burning { burning_s, mass, ..burning.clone() })
    }
}

impl Pilot {
    /// A planner with a copy of the pilot's model, without a request.
    pub(super) fn planner(model: &VehicleModel, search: Search) -> Box<Planner> {
        Box::new(Planner { model: model.clone(), requested: None, search, found: None })
    }

    /// Requests a prediction or a landing. Returns whether it could: a new request waits until the
    /// last result is taken over.
    pub(super) fn request(&mut self, time_s: f64, estimate: &Estimate, problem: Problem) -> bool {
        let Some(planner) = self.planner.as_mut().filter(|_| self.request_s.is_none()) else { return false };
        self.request_s = Some(time_s);
        self.powered.begin(&mut planner.search);
        planner.model = self.model.clone();
        planner.request(time_s, estimate, problem);
        true
    }

    /// Takes over the result; computes it now if it is not computed yet. Returns whether it is a
    /// landing plan.
    pub(crate) fn take_over(&mut self, time_s: f64) -> bool {
        let Some((request_s, planner)) = self.request_s.zip(self.planner.as_mut()) else { return false };
        self.request_s = None;
        planner.solve();
        match &planner.found {
            Some(Solved::Landing { searched, fin_share }) => {
                self.fin_share = fin_share.unwrap_or(self.fin_share);
                if let Some((outcome, high)) = searched {
                    let times_s = [request_s, time_s];
                    self.powered.take_over(&mut planner.search, outcome.as_ref(), *high, times_s);
                }
                searched.is_some()
            }
            Some(Solved::Prediction(prediction)) => {
                self.prediction = *prediction;
                false
            }
            None => false,
        }
    }

    /// The planner if its request is not computed yet.
    fn requested(&mut self) -> Option<&mut Box<Planner>> {
        self.request_s?;
        self.planner.as_mut().filter(|planner| planner.found.is_none())
    }

    /// The landing taken over last, with its problem; `None` before the first, and after the next
    /// request.
    pub fn landing_solved(&self) -> Option<LandingSolved> {
        let planner = self.planner.as_ref()?;
        let (estimate, Problem::Landing(burning)) = planner.requested.as_ref()? else { return None };
        let Some(Solved::Landing { searched: Some((Some(outcome), _)), .. }) = &planner.found else {
            return None;
        };
        let (later, burning) = planner.later(estimate, burning);
        let situation = planner.model.situation_to_plan(&later, &burning);
        let settings = &planner.model.mission.powered;
        planner.search.solved(settings, later.time_s, outcome, self.powered.planned()?, &situation)
    }
}

impl Computer {
    /// Computes the pilot's request in this context, if that was not done yet; returns the number
    /// of frames that a Cortex-M7 takes.
    pub fn solve_requested(&mut self) -> Option<u64> {
        let planner = self.pilot.requested()?;
        planner.solve();
        Some(planner.frames_on_a_board())
    }

    /// Takes the pilot's request, once, to compute it in another context. It must be [given
    /// back](Self::give_back).
    pub fn take_request(&mut self) -> Option<Box<Planner>> {
        self.pilot.requested()?;
        self.pilot.planner.take()
    }

    /// Returns a request [computed](Planner::solve) in another context. The frame whose input marks
    /// it as ready takes it over.
    pub fn give_back(&mut self, planner: Box<Planner>) {
        // A computer that has restarted meanwhile has a new planner.
        self.pilot.planner.get_or_insert(planner);
    }

    /// Rehearses the landing at power-up, without a simulated world, for the inputs of a board.
    /// `None` once released, and while a request is pending. It takes some seconds on a board and
    /// leaves the memory unchanged.
    pub fn rehearse(&mut self) -> Option<Rehearsed> {
        let pilot = &mut *self.pilot;
        let planner =
            pilot.planner.as_mut().filter(|_| self.release.is_none() && pilot.request_s.is_none())?;
        pilot.powered.begin(&mut planner.search);
        Some(planner.rehearse())
    }
}
