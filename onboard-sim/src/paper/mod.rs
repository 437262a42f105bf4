//! The landing paper's own experiments, its numbers beside ours.
//!
//! Tables 3 to 6 of *Definition of a Landing Strategy for a Model-Scale Reusable Rocket* (EuroGNC) give the optimal
//! landing for several input weights and from several starts. Here each is solved open loop (the whole plan at once)
//! and flown closed loop (the horizon shrinks to touchdown; the first action comes one sample late, as in the paper),
//! and each final state is judged by the paper's Table 2. A second part shows what the paper's equations predict
//! exactly as printed.

mod cases;
mod closed_loop;
mod json;
mod printed;
mod table;

use flight::guidance::landing::landing_problem;
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::profile::Profile;
use nmpc::SolveStatus;

pub use cases::{Case, PaperRow, Table};
pub use json::to_json;
pub use printed::{AsPrinted, as_printed};
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
}

impl Finish {
    fn judged(limits: &TouchdownLimits, state: PlanarState, cost: f64, converged: bool) -> Self {
        Self { state, verdict: LandingVerdict::judge_plan(limits, &state), cost, converged }
    }
}

/// All of the paper's experiments.
///
/// # Errors
/// A built-in profile is missing: a defect of the build.
pub fn experiments() -> Result<Vec<Row>, MissingProfile> {
    let base = builtin("paper-calibrated")?;
    Ok(cases::all().into_iter().map(|case| experiment(&base, case)).collect())
}

/// A built-in profile is missing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the built-in profile {0} is missing")]
pub struct MissingProfile(&'static str);

fn builtin(name: &'static str) -> Result<Profile, MissingProfile> {
    vehicles::profile::builtin(name).ok_or(MissingProfile(name))
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
    let initial = profile.start.planar_state();
    let problem = landing_problem(&profile, initial, 0.0, profile.nmpc.horizon_steps, 1.0);
    let solution = nmpc::solve(&problem, None);
    let end = solution.states.last().copied().unwrap_or(initial);
    let converged = solution.status == SolveStatus::Converged;
    Row {
        paper_landed: case.paper.map(|row| LandingVerdict::judge(&limits, &row.state()).landed()),
        open_loop: Finish::judged(&limits, end, solution.cost, converged),
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
        let rows = experiments().unwrap();
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
        for row in experiments().unwrap() {
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
        let rows = experiments().unwrap();
        let distinct: Vec<_> = rows
            .iter()
            .filter(|row| row.case.table != Table::InputWeights || row.case.is_nominal())
            .filter(|row| !(row.case.table != Table::InputWeights && row.case.is_nominal()))
            .collect();
        assert_eq!(distinct.len(), 7);
        assert_eq!(distinct.iter().filter(|row| row.paper_landed == Some(true)).count(), 3);
    }
}
