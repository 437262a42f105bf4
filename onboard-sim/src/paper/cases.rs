//! The paper's experiments and the numbers it prints for them (its Tables 3 to 6).

use flight::vehicle::dynamics::PlanarState;

/// Which of the paper's tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
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
    pub const ALL: [Self; 4] = [Self::InputWeights, Self::Pitch, Self::LateralVelocity, Self::PitchRate];

    pub fn title(self) -> &'static str {
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
pub struct PaperRow {
    /// Horizontal position, m.
    pub x_m: f64,
    /// Altitude, m.
    pub z_m: f64,
    pub pitch_deg: f64,
    /// Axial velocity, m/s.
    pub u_m_s: f64,
    /// Lateral velocity, m/s.
    pub w_m_s: f64,
    pub pitch_rate_deg_s: f64,
}

impl PaperRow {
    /// The state in SI and radians.
    pub fn state(&self) -> PlanarState {
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
pub struct Case {
    /// The table in which it appears.
    pub table: Table,
    /// Input weight P.
    pub input_weight: f64,
    /// Initial pitch, degrees.
    pub pitch_deg: f64,
    /// Initial lateral velocity, m/s.
    pub w_m_s: f64,
    /// Initial pitch rate, degrees per second.
    pub pitch_rate_deg_s: f64,
    /// What the paper reports; it shows P = 5 in Fig. 6 without numbers.
    pub paper: Option<PaperRow>,
    /// The J that the paper prints beside it, in Table 3 only.
    pub paper_cost: Option<f64>,
}

impl Case {
    /// What distinguishes it within its table.
    pub fn name(&self) -> String {
        match self.table {
            Table::InputWeights => format!("P = {}", self.input_weight),
            Table::Pitch => format!("theta0 = {} deg", self.pitch_deg),
            Table::LateralVelocity => format!("w0 = {:+} m/s", self.w_m_s),
            Table::PitchRate => format!("q0 = {:+} deg/s", self.pitch_rate_deg_s),
        }
    }

    /// Upright, without lateral velocity or rate, P = 1: the row that every table repeats.
    pub fn is_nominal(&self) -> bool {
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
