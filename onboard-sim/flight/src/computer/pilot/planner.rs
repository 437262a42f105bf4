//! What takes longer than a frame: the landing under thrust, and the prediction in the fall.
//!
//! A frame poses one of them, and goes on; a later frame, whose input says that it is ready, takes
//! it over. What is posed is a copy of all that it depends on, so that whoever computes it, at
//! whatever time, finds the same. A board computes it in its main context, while a timer flies the
//! frames; a simulator or a replay computes it at once and holds it back.

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

/// Within this time after it was posed a plan is ready, s: a board that needs longer is too slow.
/// Twice the period of plans; the bound on a plan's work (`powered.max_passes`) is made for it.
pub const PLAN_WITHIN_S: f64 = 0.1;

/// A plan is expected to be ready after this time, s, and is made for the vehicle as it will be
/// then: the median of mk2's plans. Of 300 `real` flights of mk2 (seed 7001) 268 land, 242 if plans
/// are made for the present, and 261 with 40 ms and 60 ms for the first; chosen on that seed,
/// before their instructions were measured.
const EXPECTED_S: f64 = 0.025;

/// Instructions that a Cortex-M7 executes in a frame: 600 MHz, and 0.67 instructions a cycle, which
/// is assumed.
const INSTRUCTIONS_PER_FRAME: u64 = 400_000 * FRAME_MS as u64;
/// Instructions on an emulated Cortex-M7 (onboard-sim/lab/cortex-m7/README.md): of 3,347
/// predictions the dearest, and of a landing the line in the passes of its search above which 39 of
/// 3,994 plans lie.
const PREDICTION: u64 = 13_600_000;
const LANDING: u64 = 5_170_000;
const PASS: u64 = 12_050;

/// What is asked.
#[derive(Debug, Clone)]
pub(super) enum Posed {
    Landing(Burning),
    /// With the fins' openings, rad, and the height from which it falls, m.
    Prediction {
        fins_rad: [f64; 4],
        apogee_m: f64,
    },
}

/// What was found.
#[derive(Debug, Clone)]
enum Solved {
    /// The search's outcome (none if the thrust never carries the vehicle), unless the flown plan
    /// is flown to its end; whether the vehicle was high; and the share of the fins' drag area if
    /// no plan says it.
    Landing {
        searched: Option<(Option<Outcome>, bool)>,
        fin_share: Option<f64>,
    },
    Prediction(Prediction),
}

/// What was posed, and what computes it. It may be moved to another context, and has to come back.
#[derive(Debug, Clone)]
pub struct Planner {
    model: VehicleModel,
    /// Its time is that of its frame since the release.
    posed: Option<(Estimate, Posed)>,
    search: Search,
    found: Option<Solved>,
}

impl Planner {
    /// Computes what was posed, once.
    pub fn solve(&mut self) {
        let Self { model, posed: Some((estimate, asked)), search, found: found @ None } = self else {
            return;
        };
        *found = Some(match asked {
            Posed::Prediction { fins_rad, apogee_m } => {
                Solved::Prediction(model.prediction(estimate, fins_rad, *apogee_m))
            }
            Posed::Landing(burning) => {
                let (settings, time_s) = (&model.mission.powered, estimate.time_s);
                let searched = (!search.is_flown_out(settings, time_s)).then(|| {
                    let (later, burning) = model.later(search.from(), estimate, burning);
                    let situation = model.situation_to_plan(&later, &burning);
                    (search.search(settings, later.time_s, &later.state, &situation), situation.high)
                });
                let outcome = searched.as_ref().and_then(|(outcome, _)| outcome.as_ref());
                let says_none = search.to_be_flown(outcome).fin_share(time_s).is_none();
                let fin_share = says_none.then(|| model.fin_share(estimate, burning));
                Solved::Landing { fin_share, searched }
            }
        });
    }

    /// Asks it.
    pub(super) fn ask(&mut self, time_s: f64, estimate: &Estimate, asked: Posed) {
        self.posed = Some((Estimate { time_s, ..*estimate }, asked));
        self.found = None;
    }

    /// The next landing starts from the plan that was found, or goes on with the last one. Returns
    /// whether the search converged on a landing; `None` if there was none, because the last plan
    /// is flown to its end or the thrust never carries the vehicle.
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

    /// The vehicle of an estimate when its plan is expected to be ready.
    pub(super) fn later(&self, estimate: &Estimate, burning: &Burning) -> (Estimate, Burning) {
        self.model.later(self.search.from(), estimate, burning)
    }

    /// In how many frames a Cortex-M7 has computed what was found.
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
    /// The vehicle when its plan is expected to be ready: until then it moves as the flown plan
    /// does, or without one keeps its force and its rates.
    fn later(&self, flown: &Plan, estimate: &Estimate, burning: &Burning) -> (Estimate, Burning) {
        let time_s = estimate.time_s;
        let later_s = time_s + EXPECTED_S;
        let mut state = estimate.state;
        let gained_m_s =
            if let Some(((from_m_s, from), (to_m_s, to))) = flown.at(time_s).zip(flown.at(later_s)) {
                let rate = state.world_from_body * state.rate_rad_s;
                // What it turns otherwise than planned, it goes on to turn.
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
    /// A planner with a copy of what the pilot knows, before it is asked.
    pub(super) fn planner(model: &VehicleModel, search: Search) -> Box<Planner> {
        Box::new(Planner { model: model.without_filters(), posed: None, search, found: None })
    }

    /// Poses a prediction or a landing. Returns whether it could: nothing is posed before the last
    /// has been taken over.
    pub(super) fn pose(&mut self, time_s: f64, estimate: &Estimate, asked: Posed) -> bool {
        let Some(planner) = self.planner.as_mut().filter(|_| self.posed_at_s.is_none()) else { return false };
        self.posed_at_s = Some(time_s);
        self.powered.begin(&mut planner.search);
        planner.model = self.model.without_filters();
        planner.ask(time_s, estimate, asked);
        true
    }

    /// Takes over what was posed; computes it now, if nobody has. Returns whether it is a plan of a
    /// landing.
    pub(crate) fn take_over(&mut self, time_s: f64) -> bool {
        let Some((posed_at_s, planner)) = self.posed_at_s.zip(self.planner.as_mut()) else { return false };
        self.posed_at_s = None;
        planner.solve();
        match &planner.found {
            Some(Solved::Landing { searched, fin_share }) => {
                self.fin_share = fin_share.unwrap_or(self.fin_share);
                if let Some((outcome, high)) = searched {
                    let times_s = [posed_at_s, time_s];
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

    /// What is posed and not computed yet.
    fn posed(&mut self) -> Option<&mut Box<Planner>> {
        self.posed_at_s?;
        self.planner.as_mut().filter(|planner| planner.found.is_none())
    }

    /// The landing that was taken over last, and its problem; none before the first, and once the
    /// next one is posed.
    pub fn landing_solved(&self) -> Option<LandingSolved> {
        let planner = self.planner.as_ref()?;
        let (estimate, Posed::Landing(burning)) = planner.posed.as_ref()? else { return None };
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
    /// Computes what the pilot has posed, in this context, if it was not done yet; returns in how
    /// many frames a Cortex-M7 does.
    pub fn solve_posed(&mut self) -> Option<u64> {
        let planner = self.pilot.posed()?;
        planner.solve();
        Some(planner.frames_on_a_board())
    }

    /// What the pilot has posed, to be computed in another context; once. It has to be [given
    /// back](Self::give_back).
    pub fn take_posed(&mut self) -> Option<Box<Planner>> {
        self.pilot.posed()?;
        self.pilot.planner.take()
    }

    /// Gives back what was [computed](Planner::solve) in another context. The frame that is told so
    /// takes it over.
    pub fn give_back(&mut self, planner: Box<Planner>) {
        // One of a computer that has restarted meanwhile has its own.
        self.pilot.planner.get_or_insert(planner);
    }

    /// Rehearses the landing at power-up, without a simulated world: what a board puts into its
    /// inputs. `None` once it is released, and while something is posed. It takes some seconds on a
    /// board, and leaves no memory.
    pub fn rehearse(&mut self) -> Option<Rehearsed> {
        let pilot = &mut *self.pilot;
        let planner =
            pilot.planner.as_mut().filter(|_| self.release.is_none() && pilot.posed_at_s.is_none())?;
        pilot.powered.begin(&mut planner.search);
        Some(planner.rehearse())
    }
}
