//! The paper's experiments, the numbers it prints for them (its Tables 3 to 6), and what counts as
//! a landing (Table 2).

use core::f64::consts::FRAC_PI_2;

use flight::rules::verdict::{LandingVerdict, LimitResult, TABLE_2, Touchdown};
use paper::plane::Problem;
use paper::plane::dynamics::PlanarState;
use paper::problem::{HORIZON, problem, start as nominal_start};

/// Which of the paper's tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Table {
    /// Table 3: input weights P.
    InputWeights,
    /// Table 4: initial pitch.
    Pitch,
    /// Table 5: initial lateral velocity.
    LateralVelocity,
    /// Table 6: initial pitch rate.
    PitchRate,
}

impl Table {
    /// Every table, in the paper's order.
    pub(crate) const ALL: [Self; 4] =
        [Self::InputWeights, Self::Pitch, Self::LateralVelocity, Self::PitchRate];

    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::InputWeights => "Table 3: input weight P",
            Self::Pitch => "Table 4: initial pitch",
            Self::LateralVelocity => "Table 5: initial lateral velocity",
            Self::PitchRate => "Table 6: initial pitch rate",
        }
    }
}

/// A final state as the paper prints it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PaperRow {
    /// Horizontal position, m.
    pub(crate) x_m: f64,
    /// Altitude, m.
    pub(crate) z_m: f64,
    pub(crate) pitch_deg: f64,
    /// Axial velocity, m/s.
    pub(crate) u_m_s: f64,
    /// Lateral velocity, m/s.
    pub(crate) w_m_s: f64,
    pub(crate) pitch_rate_deg_s: f64,
}

impl PaperRow {
    /// The state in SI and radians.
    pub(crate) fn state(&self) -> PlanarState {
        PlanarState {
            x_m: self.x_m,
            z_m: self.z_m,
            theta_rad: self.pitch_deg.to_radians(),
            u_m_s: self.u_m_s,
            w_m_s: self.w_m_s,
            q_rad_s: self.pitch_rate_deg_s.to_radians(),
        }
    }
}

/// One experiment. Every one starts at 15 m and -5 m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Case {
    /// The table in which it appears.
    pub(crate) table: Table,
    /// Input weight P.
    pub(crate) input_weight: f64,
    /// Initial pitch, degrees.
    pub(crate) pitch_deg: f64,
    /// Initial lateral velocity, m/s.
    pub(crate) w_m_s: f64,
    /// Initial pitch rate, degrees per second.
    pub(crate) pitch_rate_deg_s: f64,
    /// What the paper reports; it shows P = 5 in Fig. 6 without numbers.
    pub(crate) paper: Option<PaperRow>,
    /// The J that the paper prints beside it, in Table 3 only.
    pub(crate) paper_cost: Option<f64>,
}

impl Case {
    /// What distinguishes it within its table.
    pub(crate) fn name(&self) -> String {
        match self.table {
            Table::InputWeights => format!("P = {}", self.input_weight),
            Table::Pitch => format!("theta0 = {} deg", self.pitch_deg),
            Table::LateralVelocity => format!("w0 = {:+} m/s", self.w_m_s),
            Table::PitchRate => format!("q0 = {:+} deg/s", self.pitch_rate_deg_s),
        }
    }

    /// The paper's own problem: its conditions at the end and no others.
    pub(crate) fn problem(&self) -> Problem {
        let start = PlanarState {
            theta_rad: self.pitch_deg.to_radians(),
            w_m_s: self.w_m_s,
            q_rad_s: self.pitch_rate_deg_s.to_radians(),
            ..nominal_start()
        };
        Problem { input_weight: self.input_weight, ..problem(start, HORIZON) }
    }

    /// Upright, without lateral velocity or rate, P = 1: the row that every table repeats.
    pub(crate) fn is_nominal(&self) -> bool {
        *self == Self { table: self.table, paper: self.paper, paper_cost: self.paper_cost, ..NOMINAL }
    }
}

const fn row(x_m: f64, z_m: f64, pitch_deg: f64, u_m_s: f64, w_m_s: f64, pitch_rate_deg_s: f64) -> PaperRow {
    PaperRow { x_m, z_m, pitch_deg, u_m_s, w_m_s, pitch_rate_deg_s }
}

const NOMINAL: Case = Case {
    table: Table::InputWeights,
    input_weight: 1.0,
    pitch_deg: 90.0,
    w_m_s: 0.0,
    pitch_rate_deg_s: 0.0,
    // Table 3; Tables 4 to 6 round its x to -0.27.
    paper: Some(row(-0.278, 3.36e-9, 87.28, 0.11, 0.040, 0.80)),
    paper_cost: None,
};

/// Every experiment, table by table.
pub(super) fn all() -> Vec<Case> {
    let of = |table| Case { table, ..NOMINAL };
    let (pitch, lateral, rate) = (of(Table::Pitch), of(Table::LateralVelocity), of(Table::PitchRate));
    vec![
        Case {
            input_weight: 0.5,
            paper: Some(row(-0.096, 3.36e-9, 86.76, 0.12, -0.086, 0.80)),
            paper_cost: Some(1.54),
            ..NOMINAL
        },
        Case { paper_cost: Some(2.18), ..NOMINAL },
        Case {
            input_weight: 2.0,
            paper: Some(row(-0.29, 3.36e-9, 86.71, -0.012, -0.100, 0.80)),
            paper_cost: Some(4.57),
            ..NOMINAL
        },
        Case { input_weight: 5.0, paper: None, ..NOMINAL },
        Case { pitch_deg: 60.0, paper: Some(row(-8.02, 7.41e-10, 90.47, -0.29, 0.011, 1.03)), ..pitch },
        pitch,
        Case { pitch_deg: 120.0, paper: Some(row(0.41, 3.76e-9, 89.65, 0.019, 0.0020, -0.039)), ..pitch },
        Case { w_m_s: -1.0, paper: Some(row(-6.84, 6.20e-10, 88.18, 0.48, 0.010, 1.69)), ..lateral },
        lateral,
        Case { w_m_s: 1.0, paper: Some(row(6.35, 5.39e-9, 91.50, 0.46, 0.0039, -1.86)), ..lateral },
        Case {
            pitch_rate_deg_s: -5.0,
            paper: Some(row(-18.08, 7.89e-15, 93.96, -1.00, 0.083, -0.41)),
            ..rate
        },
        rate,
        Case { pitch_rate_deg_s: 5.0, paper: Some(row(19.85, 4.17e-12, 82.50, -0.99, -0.069, 1.77)), ..rate },
    ]
}

/// A deviation from the nominal start: its name, its step, and the case with it.
type Deviation = (&'static str, f64, fn(f64) -> Case);

/// How far each value of the start may be from nominal, on either side, for the paper's plan to end
/// inside Table 2, the others nominal: name, the paper's largest, ours and its step. The search
/// ends at the first step that misses.
pub(super) fn ranges() -> [(&'static str, f64, f64, f64); 3] {
    const MOST_STEPS: u32 = 60;
    let deviations: [(Deviation, f64); 3] = [
        (("pitch, deg", 2.5, |off| Case { pitch_deg: 90.0 + off, ..NOMINAL }), 30.0),
        (("w, m/s", 0.25, |off| Case { w_m_s: off, ..NOMINAL }), 1.0),
        (("q, deg/s", 5.0, |off| Case { pitch_rate_deg_s: off, ..NOMINAL }), 5.0),
    ];
    deviations.map(|((name, step, case), printed)| {
        let lands = |off: f64| {
            let solution = paper::plane::solve(&case(off).problem(), None);
            solution.converged() && broken(&solution.end()).is_empty()
        };
        let steps = (1..=MOST_STEPS).map(f64::from);
        let most = steps.take_while(|count| lands(count * step) && lands(-count * step)).last();
        (name, printed, most.unwrap_or(0.0) * step, step)
    })
}

/// The limits of Table 2 that a final state breaks, in words; none means that it lands.
pub(super) fn broken(state: &PlanarState) -> Vec<String> {
    let end = Touchdown {
        distance_m: state.x_m.abs(),
        height_m: state.z_m,
        vertical_m_s: state.u_m_s,
        lateral_m_s: state.w_m_s.abs(),
        tilt_rad: (state.theta_rad - FRAC_PI_2).abs(),
        rate_rad_s: state.q_rad_s.abs(),
    };
    LandingVerdict::judge_plan(&TABLE_2, &end).failures().map(LimitResult::to_string).collect()
}

/// What became of a printed final state, by the key of docs/paper.md.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Every value agrees with the printed one.
    Reproduced,
    /// Some value differs; both meet Table 2.
    InsideTheSameLimits,
    /// The printed values miss Table 2, ours meet it.
    Improved,
    /// Ours miss Table 2.
    Missed,
    /// The paper prints no final state.
    NotPrinted,
}

/// Largest difference between two values that agree, as a share of their limit in Table 2.
const AGREES_WITHIN: f64 = 0.1;

impl Verdict {
    /// The verdict from a printed final state and ours.
    pub(crate) fn of(printed: Option<&PaperRow>, ours: &PlanarState) -> Self {
        let Some(printed) = printed.map(PaperRow::state) else { return Self::NotPrinted };
        let agrees = [
            (printed.x_m - ours.x_m, TABLE_2.distance_m),
            (printed.z_m - ours.z_m, TABLE_2.height_m),
            (printed.theta_rad - ours.theta_rad, TABLE_2.tilt_rad),
            (printed.u_m_s - ours.u_m_s, TABLE_2.vertical_m_s),
            (printed.w_m_s - ours.w_m_s, TABLE_2.lateral_m_s),
            (printed.q_rad_s - ours.q_rad_s, TABLE_2.rate_rad_s),
        ]
        .iter()
        .all(|(difference, limit)| difference.abs() <= AGREES_WITHIN * limit);
        match (broken(&printed).is_empty(), broken(ours).is_empty()) {
            (_, false) => Self::Missed,
            _ if agrees => Self::Reproduced,
            (true, true) => Self::InsideTheSameLimits,
            (false, true) => Self::Improved,
        }
    }

    /// For tables and the page.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::InsideTheSameLimits => "inside the same limits",
            Self::Improved => "improved",
            Self::Missed => "missed",
            Self::NotPrinted => "not printed",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables 3 to 6 of the landing paper under its own Table 2: 3 of the 7 distinct start states
    /// land.
    #[test]
    fn val_landing_paper_tables_4_to_6_judged_by_table_2() {
        // (x m, theta deg, u m/s, w m/s, q deg/s), z is zero in all.
        let rows = [
            ("nominal", -0.27, 87.28, 0.11, 0.040, 0.80, true),
            ("theta0 = 60", -8.02, 90.47, -0.29, 0.011, 1.03, true),
            ("theta0 = 120", 0.41, 89.65, 0.019, 0.0020, -0.039, true),
            ("w0 = -1", -6.84, 88.18, 0.48, 0.010, 1.69, false),
            ("w0 = +1", 6.35, 91.50, 0.46, 0.0039, -1.86, false),
            ("q0 = -5", -18.08, 93.96, -1.00, 0.083, -0.41, false),
            ("q0 = +5", 19.85, 82.50, -0.99, -0.069, 1.77, false),
        ];
        for (name, x_m, pitch_deg, u_m_s, w_m_s, rate_deg_s, lands) in rows {
            let broken = broken(&row(x_m, 0.0, pitch_deg, u_m_s, w_m_s, rate_deg_s).state());
            assert_eq!(broken.is_empty(), lands, "{name}: {broken:?}");
        }
    }

    /// The paper's ranges lie well inside ours.
    #[test]
    fn val_landing_paper_ranges_of_the_start_are_exceeded() {
        for (name, printed, ours, _) in ranges() {
            assert!(ours > printed, "{name}: {ours}, the paper {printed}");
        }
    }

    /// Agreement needs every value; a plan that misses Table 2 is never better than "missed".
    #[test]
    fn a_verdict_follows_from_the_numbers() {
        let inside = row(0.4, 0.0, 90.0, 0.1, 0.0, 0.0);
        let near = PlanarState { x_m: 2.3, u_m_s: 0.13, ..inside.state() };
        let off = PlanarState { q_rad_s: 0.3_f64.to_radians(), ..near };
        let outside = row(0.4, 0.0, 90.0, 0.48, 0.0, 0.0);
        let hard = PlanarState { u_m_s: -0.41, ..near };
        for (printed, ours, expected) in [
            (Some(&inside), near, Verdict::Reproduced),
            (Some(&inside), off, Verdict::InsideTheSameLimits),
            (Some(&outside), near, Verdict::Improved),
            (Some(&outside), hard, Verdict::Missed),
            (Some(&inside), hard, Verdict::Missed),
            (None, near, Verdict::NotPrinted),
        ] {
            assert_eq!(Verdict::of(printed, &ours), expected, "{printed:?} {ours:?}");
        }
    }

    #[test]
    fn each_limit_can_fail_alone_and_a_plan_may_end_slightly_below_the_ground() {
        let upright = PlanarState { theta_rad: FRAC_PI_2, ..PlanarState::default() };
        let failed = |state| {
            let broken = broken(&state);
            broken
                .iter()
                .map(|words| {
                    words.split(|c: char| c == '-' || c.is_ascii_digit()).next().unwrap().trim().to_owned()
                })
                .collect::<Vec<_>>()
        };
        assert!(failed(upright).is_empty());
        assert!(failed(PlanarState { z_m: -1e-12, ..upright }).is_empty());
        for (name, state) in [
            ("distance", PlanarState { x_m: -20.1, ..upright }),
            ("height", PlanarState { z_m: 0.21, ..upright }),
            ("height", PlanarState { z_m: -0.002, ..upright }),
            ("tilt", PlanarState { theta_rad: FRAC_PI_2 - 0.1, ..upright }),
            ("vertical speed", PlanarState { u_m_s: -0.41, ..upright }),
            ("lateral speed", PlanarState { w_m_s: 0.11, ..upright }),
            ("rotation rate", PlanarState { q_rad_s: 0.036, ..upright }),
        ] {
            assert_eq!(failed(state), [name]);
        }
        assert_eq!(broken(&PlanarState { u_m_s: f64::NAN, ..upright }).len(), 1);
    }
}
