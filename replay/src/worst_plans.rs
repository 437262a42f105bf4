//! The plans of a landing burn that break their conditions most, by the formulas of the [`judge`]. Nothing is solved.

use flight::guidance::powered::LandingSolved;
use judge::Score;
use ocp::landing::LANDING_MISS;
use serde::Serialize;

/// Most plans that are named.
const NAMED: usize = 3;

/// A plan that breaks a condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BrokenPlan {
    /// Its frame, by its number in the log.
    pub frame: u64,
    /// T+, s.
    pub time_s: f64,
    /// What the broken conditions add to its cost.
    pub price: f64,
    /// The condition that misses most, and its node.
    pub condition: &'static str,
    pub node: usize,
    /// By how much, in `unit`.
    pub miss: f64,
    pub unit: &'static str,
}

impl BrokenPlan {
    /// Judges the plan of a frame; `None` if it keeps its conditions.
    pub(crate) fn of(
        frame: u64,
        time_s: f64,
        LandingSolved { problem, plan, .. }: &LandingSolved,
    ) -> Option<Self> {
        let Score { cost, merit, miss, worst, .. } = judge::score(problem, plan.states(), plan.inputs());
        let (condition, node) = worst.filter(|_| miss > LANDING_MISS)?;
        let (factor, unit) = unit(condition);
        Some(Self { frame, time_s, price: merit - cost, condition, node, miss: factor * miss, unit })
    }

    /// In words, with how to learn more of it.
    pub(crate) fn words(&self) -> String {
        let Self { frame, time_s, condition, node, miss, unit, .. } = self;
        format!(
            "frame {frame} (T+{time_s:.2} s): {condition} at node {node} broken by {miss:.2} {unit}; `replay verify LOG --explain {frame}` judges it"
        )
    }
}

/// The unit of a condition's miss in words, and the factor to it.
fn unit(condition: &str) -> (f64, &'static str) {
    let degrees = 1.0_f64.to_degrees();
    let units = [
        ("velocity", 1.0, "m/s"),
        ("rate", degrees, "deg/s"),
        ("lean", degrees, "deg"),
        ("gimbal", degrees, "deg"),
        ("fins", 1.0, "of their share"),
    ];
    let known = units.into_iter().find(|(word, ..)| condition.contains(word));
    known.map_or((1.0, "m"), |(_, factor, unit)| (factor, unit))
}

/// The worst: those whose broken conditions cost most, then those that miss most.
pub(crate) fn worst(mut plans: Vec<BrokenPlan>) -> Vec<BrokenPlan> {
    plans.sort_by(|a, b| b.price.total_cmp(&a.price).then(b.miss.total_cmp(&a.miss)));
    plans.truncate(NAMED);
    plans
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(frame: u64, price: f64, miss: f64) -> BrokenPlan {
        let condition = "settled velocity x";
        BrokenPlan { frame, time_s: 12.5, price, condition, node: 25, miss, unit: unit(condition).1 }
    }

    #[test]
    fn the_dearest_plans_are_named_and_of_equal_ones_those_that_miss_most() {
        let plans = vec![plan(10, 1.0, 0.3), plan(20, 3.0, 0.1), plan(30, 1.0, 0.4), plan(40, 0.5, 2.0)];
        let named = worst(plans);
        assert_eq!(named.iter().map(|plan| plan.frame).collect::<Vec<_>>(), [20, 30, 10]);
        assert_eq!(
            named[2].words(),
            "frame 10 (T+12.50 s): settled velocity x at node 25 broken by 0.30 m/s; `replay verify LOG --explain 10` judges it"
        );
    }

    #[test]
    fn angles_are_told_in_degrees() {
        assert_eq!(unit("height at the end"), (1.0, "m"));
        assert_eq!(unit("settled rate towards x").1, "deg/s");
        assert!((unit("lean towards y").0 - 57.295_779_5).abs() < 1e-6);
    }
}
