//! The landing paper's own experiments, its numbers beside ours.
//!
//! Tables 3 to 6 of *Definition of a Landing Strategy for a Model-Scale Reusable Rocket* (EuroGNC)
//! give the optimal landing for several input weights and from several starts. Here each is solved
//! open loop (the whole plan at once) and flown closed loop (the horizon shrinks to touchdown; the
//! first action comes one sample late, as in the paper), and each final state is judged by the
//! paper's Table 2. A second part shows what the paper's equations predict exactly as printed.
//!
//! * [`Objective`]: Table 3's J under every definition that the paper leaves open.
//! * [`figures`]: Figures 5 to 9 from these runs; `figure` draws.
//! * [`fins`]: its Eq. 9-14, and the force that it drops, in falls of the flight computer.
//! * [`fall`]: the fall of its Fig. 5, in space, and from which tilts that vehicle settles.

mod cases;
pub(crate) mod fall;
mod figure;
pub(crate) mod figures;
pub(crate) mod fins;
mod flown;
mod objective;
mod text;

use flight::vehicles::motors::MotorError;
use paper::plane::dynamics::PlanarState;
use sim::world::plant::WorldError;

pub(crate) use cases::{Case, Table, Verdict};
use figure::FigureError;
pub(crate) use flown::{AsPrinted, as_printed};
pub(crate) use objective::Objective;
pub(crate) use text::{write_stability, write_tables, write_verdicts};

/// One experiment: the paper's result and ours.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    /// The experiment.
    pub(crate) case: Case,
    /// The paper's final state by its own Table 2; `None` where it reports none.
    pub(crate) paper_landed: Option<bool>,
    /// The plan's end, solved once from the start.
    pub(crate) open_loop: Finish,
    /// The end of the closed-loop flight.
    pub(crate) closed_loop: Finish,
}

impl Row {
    /// What became of the printed final state: by the plan's end, which is what the paper prints.
    pub(crate) fn verdict(&self) -> Verdict {
        Verdict::of(self.case.paper.as_ref(), &self.open_loop.state)
    }
}

/// How one landing ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Finish {
    /// The state at the end of the burn.
    pub(crate) state: PlanarState,
    /// The limits of the paper's Table 2 that it breaks, in words.
    pub(crate) broken: Vec<String>,
    /// Cost: of the plan, or of the first plan of a closed loop.
    pub(crate) cost: f64,
    /// Whether the plan, or every plan of a closed loop, met the optimality conditions to the
    /// tolerance.
    pub(crate) converged: bool,
    /// The way there, from ignition on, once a sample.
    pub(crate) path: Vec<Sample>,
}

/// One moment of a landing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    /// Time since ignition, s.
    pub(crate) time_s: f64,
    pub(crate) state: PlanarState,
    /// Gimbal angle that led here, rad.
    pub(crate) gimbal_rad: f64,
}

impl Finish {
    /// `path` has its start at least.
    fn judged(path: Vec<Sample>, cost: f64, converged: bool) -> Self {
        let state = path.last().map_or_else(PlanarState::default, |sample| sample.state);
        Self { state, broken: cases::broken(&state), cost, converged, path }
    }

    /// Whether it ends inside Table 2.
    pub(crate) fn landed(&self) -> bool {
        self.broken.is_empty()
    }
}

/// All of the paper's experiments.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Experiments {
    /// Table by table.
    pub(crate) rows: Vec<Row>,
    /// What Table 3's J could be.
    pub(crate) objective: Objective,
    /// How far the start may deviate: name, the paper's largest, ours, and its step.
    pub(crate) ranges: [(&'static str, f64, f64, f64); 3],
}

/// All of the paper's experiments.
pub(crate) fn experiments() -> Experiments {
    let rows: Vec<Row> = cases::all().into_iter().map(experiment).collect();
    Experiments { objective: Objective::new(&rows), ranges: cases::ranges(), rows }
}

/// Why an experiment cannot be run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PaperError {
    #[error(transparent)]
    Mission(#[from] flight::vehicles::mission::MissionError),
    #[error(transparent)]
    Motor(#[from] MotorError),
    /// The vehicle's data are refused: a defect of the build.
    #[error(transparent)]
    World(#[from] WorldError),
    #[error(transparent)]
    Figure(#[from] FigureError),
    #[error(transparent)]
    Recipe(#[from] sim::recipe::RecipeError),
    #[error(transparent)]
    SetUp(#[from] sim::sortie::SetUpError),
    /// The output cannot be written.
    #[error(transparent)]
    Output(#[from] std::io::Error),
}

fn experiment(case: Case) -> Row {
    let problem = case.problem();
    let solution = paper::plane::solve(&problem, None);
    let path = (0..solution.states.len()).map(|node| Sample {
        time_s: node as f64 * problem.step_s,
        state: solution.state(node),
        gimbal_rad: if node == 0 { 0.0 } else { solution.inputs_rad[node - 1][0] },
    });
    Row {
        paper_landed: case.paper.map(|row| cases::broken(&row.state()).is_empty()),
        open_loop: Finish::judged(path.collect(), solution.outcome.cost, solution.converged()),
        closed_loop: flown::closed_loop(&problem),
        case,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Optimal costs that six independent solvers agree on (CasADi with IPOPT and fatrop, acados
    /// and others) for these starts and P = 1.
    #[test]
    fn val_six_solvers_optimal_costs() {
        let cost = |case: &Case| match (case.pitch_deg, case.w_m_s, case.pitch_rate_deg_s) {
            (90.0, 0.0, 0.0) => 8465.15,
            (90.0, _, 0.0) => 8382.32,
            (90.0, 0.0, _) => 8462.95,
            _ => 8483.94,
        };
        let rows = experiments().rows;
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
        for row in experiments().rows {
            for (name, finish) in [("open", &row.open_loop), ("closed", &row.closed_loop)] {
                assert!(
                    finish.converged && finish.landed(),
                    "{} {name} loop: {}",
                    row.case.name(),
                    finish.broken.join(", ")
                );
            }
        }
    }

    /// The page has the verdicts as the program writes them, and the entry of each table has those
    /// of its rows.
    #[test]
    fn the_page_has_the_computed_verdicts() {
        let page =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../docs/paper.md")).unwrap();
        let rows = experiments().rows;
        let mut written = Vec::new();
        write_verdicts(&mut written, &rows).unwrap();
        let written = String::from_utf8(written).unwrap();
        assert!(page.contains(&written), "docs/paper.md is to have\n{written}");
        for table in Table::ALL {
            let (number, _) = table.title().split_once(':').unwrap();
            let mut verdicts: Vec<&str> = Vec::new();
            for row in rows.iter().filter(|row| row.case.table == table && row.case.paper.is_some()) {
                if !verdicts.contains(&row.verdict().name()) {
                    verdicts.push(row.verdict().name());
                }
            }
            let verdicts = verdicts.join("**, **");
            let entry = page.lines().find(|line| {
                let head = line.split('|').nth(1).unwrap_or_default();
                head.contains(number) && line.contains(&format!("| **{verdicts}** |"))
            });
            assert!(entry.is_some(), "the entry of {number} in docs/paper.md is to have **{verdicts}**");
        }
    }

    /// By its own Table 2 the paper lands 3 of its 7 distinct starts.
    #[test]
    fn val_landing_paper_lands_three_of_seven() {
        let rows = experiments().rows;
        let distinct: Vec<_> = rows
            .iter()
            .filter(|row| row.case.table != Table::InputWeights || row.case.is_nominal())
            .filter(|row| !(row.case.table != Table::InputWeights && row.case.is_nominal()))
            .collect();
        assert_eq!(distinct.len(), 7);
        assert_eq!(distinct.iter().filter(|row| row.paper_landed == Some(true)).count(), 3);
    }
}
