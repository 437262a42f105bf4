//! What takes longer than a frame: the landing under thrust, and the prediction in the fall.
//!
//! A frame poses one of them, and goes on; a later frame, whose input says that it is ready, takes it over. What is posed is a
//! copy of all that it depends on, so that whoever computes it, at whatever time, finds the same. A board computes it in its main
//! context, while a timer flies the frames; a simulator or a replay computes it at once and holds it back.

use alloc::boxed::Box;

use nmpc::Outcome;

use super::vehicle_model::{Burning, VehicleModel};
use super::{Pilot, Prediction};
use crate::computer::FRAME_MS;
use crate::estimation::estimator::Estimate;
use crate::guidance::powered::{LandingSolved, Search};

/// Within this time after its tick a plan is ready, s: a board that needs longer is too slow. Two periods: of the ticks, one at most
/// poses nothing. The bound on a plan's work (`powered.max_passes`) is made for it.
pub const PLAN_WITHIN_S: f64 = 0.1;

/// Instructions that a Cortex-M7 executes in a frame: 600 MHz, and 0.67 instructions a cycle, which is assumed.
const INSTRUCTIONS_PER_FRAME: u64 = 400_000 * FRAME_MS as u64;
/// Instructions of a prediction at most; of a landing without its search, which are the bands of its motors; and of each pass of the
/// search. Of the dearest plans in space on an emulated Cortex-M7, 34 million instructions, 2,240 passes.
const PREDICTION: u64 = 8_100_000;
const LANDING: u64 = 4_000_000;
const PASS: u64 = 13_500;

/// What is asked.
#[derive(Debug, Clone)]
enum Asked {
    Landing(Burning),
    /// With the fins' openings, rad, and the height from which it falls, m.
    Prediction {
        fins_rad: [f64; 4],
        apogee_m: f64,
    },
}

/// What was found.
#[derive(Debug, Clone)]
enum Found {
    /// The search's outcome (none if the thrust never carries the vehicle), unless the flown plan is flown to its end; whether the
    /// vehicle was high; and the share of the fins' drag area if no plan says it.
    Landing { searched: Option<(Option<Outcome>, bool)>, fin_share: Option<f64> },
    Prediction(Prediction),
}

/// What was posed, and what computes it. It may be moved to another context, and has to come back.
#[derive(Debug, Clone)]
pub struct Planner {
    model: VehicleModel,
    /// With its time since the release, s.
    posed: Option<(f64, Estimate, Asked)>,
    search: Search,
    found: Option<Found>,
}

impl Planner {
    /// Computes what was posed, once.
    pub fn solve(&mut self) {
        let Self { model, posed: Some((time_s, estimate, asked)), search, found: found @ None } = self else {
            return;
        };
        *found = Some(match asked {
            Asked::Prediction { fins_rad, apogee_m } => {
                Found::Prediction(model.prediction(estimate, fins_rad, *apogee_m))
            }
            Asked::Landing(burning) => {
                let settings = &model.mission.powered;
                let searched = (!search.is_flown_out(settings, *time_s)).then(|| {
                    let situation = model.situation_to_plan(estimate, burning);
                    (search.search(settings, *time_s, &estimate.state, &situation), situation.high)
                });
                let outcome = searched.as_ref().and_then(|(outcome, _)| outcome.as_ref());
                let says_none = search.to_be_flown(outcome).fin_share(*time_s).is_none();
                Found::Landing { fin_share: says_none.then(|| model.fin_share(estimate, burning)), searched }
            }
        });
    }

    /// In how many frames a Cortex-M7 has computed what was found.
    pub fn frames_on_a_board(&self) -> u64 {
        let instructions = match &self.found {
            Some(Found::Landing { searched: Some((Some(_), _)), .. }) => {
                LANDING + PASS * self.search.passes() as u64
            }
            Some(Found::Landing { .. }) => LANDING,
            Some(Found::Prediction(_)) => PREDICTION,
            None => 0,
        };
        instructions.div_ceil(INSTRUCTIONS_PER_FRAME)
    }
}

impl Pilot {
    /// A planner with a copy of what the pilot knows, before it is asked.
    pub(super) fn planner(model: &VehicleModel, search: Search) -> Option<Box<Planner>> {
        Some(Box::new(Planner { model: model.without_filters(), posed: None, search, found: None }))
    }

    /// Poses the prediction in the fall.
    pub(super) fn pose_prediction(&mut self, time_s: f64, estimate: &Estimate) {
        let (fins_rad, apogee_m) = (self.fins_rad, self.apogee_m);
        self.pose(time_s, estimate, Asked::Prediction { fins_rad, apogee_m });
    }

    /// Poses a landing.
    pub(super) fn pose_landing(&mut self, time_s: f64, estimate: &Estimate, burning: Burning) {
        self.pose(time_s, estimate, Asked::Landing(burning));
    }

    /// Nothing is posed before the last has been taken over.
    fn pose(&mut self, time_s: f64, estimate: &Estimate, asked: Asked) {
        let Some(planner) = self.planner.as_mut().filter(|_| self.posed_at_s.is_none()) else { return };
        self.posed_at_s = Some(time_s);
        self.powered.begin(&mut planner.search);
        planner.model = self.model.without_filters();
        (planner.posed, planner.found) = (Some((time_s, *estimate, asked)), None);
    }

    /// Takes over what was posed; computes it now, if nobody has. Returns whether it is a plan of a landing.
    pub(in crate::computer) fn take_over(&mut self, time_s: f64) -> bool {
        let Some((posed_at_s, planner)) = self.posed_at_s.zip(self.planner.as_mut()) else { return false };
        self.posed_at_s = None;
        planner.solve();
        match &planner.found {
            Some(Found::Landing { searched, fin_share }) => {
                self.fin_share = fin_share.unwrap_or(self.fin_share);
                if let Some((outcome, high)) = searched {
                    let times_s = [posed_at_s, time_s];
                    self.powered.take_over(&mut planner.search, outcome.as_ref(), *high, times_s);
                }
                searched.is_some()
            }
            Some(Found::Prediction(prediction)) => {
                self.prediction = *prediction;
                false
            }
            None => false,
        }
    }

    /// What is posed and not computed yet.
    pub(in crate::computer) fn posed(&mut self) -> Option<&mut Box<Planner>> {
        self.posed_at_s?;
        self.planner.as_mut().filter(|planner| planner.found.is_none())
    }

    pub(in crate::computer) fn take_posed(&mut self) -> Option<Box<Planner>> {
        self.posed()?;
        self.planner.take()
    }

    pub(in crate::computer) fn give_back(&mut self, planner: Box<Planner>) {
        // One of a computer that has restarted meanwhile has its own.
        self.planner.get_or_insert(planner);
    }

    /// The landing that was taken over last, and its problem; none before the first, and while the next one is posed.
    pub fn landing_solved(&self) -> Option<LandingSolved> {
        let planner = self.planner.as_ref()?;
        let (time_s, estimate, Asked::Landing(burning)) = planner.posed.as_ref()? else { return None };
        let Some(Found::Landing { searched: Some((Some(outcome), _)), .. }) = &planner.found else {
            return None;
        };
        let situation = planner.model.situation_to_plan(estimate, burning);
        let settings = &planner.model.mission.powered;
        planner.search.solved(settings, *time_s, outcome, self.powered.planned()?, &situation)
    }
}
