//! The landing paper's own experiments, its numbers beside ours.
//!
//! Tables 3 to 6 of *Definition of a Landing Strategy for a Model-Scale Reusable Rocket* (EuroGNC) give the optimal
//! landing for several input weights and from several starts. Here each is solved open loop (the whole plan at once)
//! and flown closed loop (the horizon shrinks to touchdown; the first action comes one sample late, as in the paper),
//! and each final state is judged by the paper's Table 2. A second part shows what the paper's equations predict
//! exactly as printed.
//!
//! * [`Objective`]: Table 3's J under every definition that the paper leaves open.
//! * [`figures`]: Figures 5 to 9 from these runs.
//! * [`passive`]: the fall of its Fig. 5, in space; [`stability`]: from which tilts that vehicle settles.

mod cases;
mod closed_loop;
pub mod figures;
mod json;
mod objective;
pub mod passive;
mod printed;
pub mod stability;
mod stability_table;
mod table;

use flight::guidance::landing::landing_problem;
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::profile::Profile;
use nmpc::{Problem, SolveStatus};
use vehicles::airframe::AirframeError;
use vehicles::motors::MotorError;
use world::world::WorldError;

use crate::figure::FigureError;
pub use cases::{Case, PaperRow, Table};
pub use json::to_json;
pub use objective::{Definition, Objective};
pub use printed::{AsPrinted, as_printed};
pub use stability_table::write_stability;
pub use table::write_tables;

/// One experiment: the paper's result and ours.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The experiment.
    pub case: Case,
    /// The paper's final state by its own Table 2; `None` where it reports none.
    pub paper_landed: Option<bool>,
    /// The plan's end, solved once from the start.
    pub open_loop: Finish,
    /// The end of the closed-loop flight.
    pub closed_loop: Finish,
}

/// How one landing ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Finish {
    /// The state at the end of the burn.
    pub state: PlanarState,
    /// By the paper's Table 2.
    pub verdict: LandingVerdict,
    /// Cost: of the plan, or of the first plan of a closed loop.
    pub cost: f64,
    /// Whether the plan, or every plan of a closed loop, met the optimality conditions to the tolerance.
    pub converged: bool,
    /// The way there, from ignition on, once a sample.
    pub path: Vec<Sample>,
}

/// One moment of a landing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time since ignition, s.
    pub time_s: f64,
    pub state: PlanarState,
    /// Gimbal angle that led here, rad.
    pub gimbal_rad: f64,
}

impl Finish {
    /// `path` has its start at least.
    fn judged(limits: &TouchdownLimits, path: Vec<Sample>, cost: f64, converged: bool) -> Self {
        let state = path.last().map_or_else(PlanarState::default, |sample| sample.state);
        Self { state, verdict: LandingVerdict::judge_plan(limits, &state), cost, converged, path }
    }
}

/// All of the paper's experiments.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiments {
    /// Table by table.
    pub rows: Vec<Row>,
    /// What Table 3's J could be.
    pub objective: Objective,
}

/// All of the paper's experiments.
///
/// # Errors
/// A built-in profile is missing: a defect of the build.
pub fn experiments() -> Result<Experiments, PaperError> {
    let base = builtin("paper-calibrated")?;
    let rows: Vec<Row> = cases::all().into_iter().map(|case| experiment(&base, case)).collect();
    let objective = Objective::new(&rows, |case| problem(&papers_own(&base, case)));
    Ok(Experiments { rows, objective })
}

/// Why an experiment cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum PaperError {
    /// A defect of the build.
    #[error("the built-in profile {0} is missing")]
    Missing(&'static str),
    #[error(transparent)]
    Airframe(#[from] AirframeError),
    #[error(transparent)]
    Motor(#[from] MotorError),
    /// The vehicle's data are refused: a defect of the build.
    #[error(transparent)]
    World(#[from] WorldError),
    /// A thread could not be started.
    #[error("a thread could not be started")]
    Thread(#[from] std::io::Error),
    #[error(transparent)]
    Figure(#[from] FigureError),
}

fn builtin(name: &'static str) -> Result<Profile, PaperError> {
    vehicles::profile::builtin(name).ok_or(PaperError::Missing(name))
}

/// The whole landing as one problem.
fn problem(profile: &Profile) -> Problem {
    landing_problem(profile, profile.start.planar_state(), 0.0, profile.nmpc.horizon_steps, 1.0)
}

/// The profile with the paper's own problem: its conditions at the end and no others.
fn papers_own(base: &Profile, case: &Case) -> Profile {
    let mut profile = base.clone();
    profile.nmpc.limits.final_box = None;
    profile.nmpc.limits.altitude_min_m = None;
    profile.nmpc.weights.delta = case.input_weight;
    profile.start.pitch_deg = case.pitch_deg;
    profile.start.w_m_s = case.w_m_s;
    profile.start.pitch_rate_deg_s = case.pitch_rate_deg_s;
    profile
}

fn experiment(base: &Profile, case: Case) -> Row {
    let profile = papers_own(base, &case);
    let limits = TouchdownLimits::from_profile(&profile);
    let solution = nmpc::solve(&problem(&profile), None);
    let inputs_rad = core::iter::once(0.0).chain(solution.inputs_rad.iter().copied());
    let path = solution.states.iter().zip(inputs_rad).enumerate().map(|(node, (state, gimbal_rad))| Sample {
        time_s: node as f64 * solution.step_s,
        state: *state,
        gimbal_rad,
    });
    let converged = solution.status == SolveStatus::Converged;
    Row {
        paper_landed: case.paper.map(|row| LandingVerdict::judge(&limits, &row.state()).landed()),
        open_loop: Finish::judged(&limits, path.collect(), solution.cost, converged),
        closed_loop: closed_loop::fly(&profile, &limits),
        case,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Optimal costs that six independent solvers agree on (CasADi with IPOPT and fatrop, acados and others) for
    /// these starts and P = 1.
    #[test]
    fn val_six_solvers_optimal_costs() {
        let cost = |case: &Case| match (case.pitch_deg, case.w_m_s, case.pitch_rate_deg_s) {
            (90.0, 0.0, 0.0) => 8465.15,
            (90.0, _, 0.0) => 8382.32,
            (90.0, 0.0, _) => 8462.95,
            _ => 8483.94,
        };
        let rows = experiments().unwrap().rows;
        for row in rows.iter().filter(|row| (row.case.input_weight - 1.0).abs() < 1e-12) {
            let expected = cost(&row.case);
            assert!(
                (row.open_loop.cost - expected).abs() < 0.01,
                "{}: {}",
                row.case.name(),
                row.open_loop.cost
            );
        }
    }

    #[test]
    fn every_start_and_weight_lands_open_and_closed_loop() {
        for row in experiments().unwrap().rows {
            for (name, finish) in [("open", &row.open_loop), ("closed", &row.closed_loop)] {
                assert!(
                    finish.converged && finish.verdict.landed(),
                    "{} {name} loop: {}",
                    row.case.name(),
                    finish.verdict.summary()
                );
            }
        }
    }

    /// By its own Table 2 the paper lands 3 of its 7 distinct starts.
    #[test]
    fn val_landing_paper_lands_three_of_seven() {
        let rows = experiments().unwrap().rows;
        let distinct: Vec<_> = rows
            .iter()
            .filter(|row| row.case.table != Table::InputWeights || row.case.is_nominal())
            .filter(|row| !(row.case.table != Table::InputWeights && row.case.is_nominal()))
            .collect();
        assert_eq!(distinct.len(), 7);
        assert_eq!(distinct.iter().filter(|row| row.paper_landed == Some(true)).count(), 3);
    }
}
