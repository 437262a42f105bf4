//! A landing with a free final time, for the comparison: the landing paper's, on a thrust that falls with the square of time.

use std::fmt::Write as _;
use std::hint::black_box;

use anyhow::Result;
use nmpc::free_time::{FreeTimeProblem, FreeTimeSolution, FreeTimeWorkspace, Motor, solve_free_time_into};
use nmpc::{Problem, paper};

use crate::clock::thread_ns;

/// How much later than when the thrust equals the weight the landing may end, s.
const SPAN_S: f64 = 1.5;

/// No search needs as many.
const MOST_SOLVES: u32 = 40;

/// A thrust of so many weights at ignition, and of one after `until_s`.
pub(crate) struct Falling {
    pub(crate) over_weight: f64,
    pub(crate) until_s: f64,
}

impl Motor for Falling {
    fn mean_thrust_n(&self, from_s: f64, to_s: f64) -> f64 {
        let square = (to_s * to_s + to_s * from_s + from_s * from_s) / (3.0 * self.until_s * self.until_s);
        let params = paper::model().params;
        params.mass_kg * params.gravity_m_s2 * (self.over_weight - (self.over_weight - 1.0) * square)
    }

    fn mean_mass_kg(&self, _: f64, _: f64) -> f64 {
        paper::model().params.mass_kg
    }
}

/// The searches, with the plan of the last cold one.
#[derive(Default)]
pub(crate) struct Free {
    workspace: FreeTimeWorkspace,
    plan: FreeTimeSolution,
    last: FreeTimeSolution,
}

impl Free {
    /// Searches cold, or from the plan.
    pub(crate) fn answer(&mut self, warm: bool, motor: &Falling, landing: Problem) -> Result<String> {
        let posed = FreeTimeProblem {
            intervals: landing.thrust_n.len(),
            landing,
            earliest_s: motor.until_s,
            latest_s: motor.until_s + SPAN_S,
            target_drift_m_s: 0.0,
            max_solves: MOST_SOLVES,
        };
        let Self { workspace, plan, last } = self;
        let mut ns = 0;
        for _ in 0..2 {
            let before = thread_ns();
            let earlier = warm.then_some((&*plan, 0.0));
            solve_free_time_into(black_box(&posed), motor, earlier, workspace, last);
            ns = thread_ns() - before;
        }
        let FreeTimeSolution { solution, final_time_s, .. } = &*last;
        let mut answer = format!("{} {ns} {:e} {final_time_s:e}", last.lands(), solution.cost);
        for input in &solution.inputs_rad {
            write!(answer, " {input:e}")?;
        }
        if !warm {
            plan.clone_from(last);
        }
        Ok(answer)
    }
}
