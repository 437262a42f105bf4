//! The sections of an airframe, one struct each, with their accessors in SI and radians.

use serde::Deserialize;

/// How the landing motor is lit.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Igniter {
    /// Scatter of the ignition delay, as a multiple of that of a single igniter. Two in parallel have about half of it.
    pub scatter_scale: f64,
}

impl Default for Igniter {
    /// A single igniter.
    fn default() -> Self {
        Self { scatter_scale: 1.0 }
    }
}

/// Masses with the landing motor full, and the place of the propellant.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mass {
    /// Mass with the landing motor full, kg.
    pub loaded_kg: f64,
    /// Centre of gravity with the landing motor full, m above the nozzle.
    pub loaded_cg_station_m: f64,
    /// Moment of inertia about the pitch or yaw axis through that centre of gravity, kg m^2.
    pub loaded_pitch_inertia_kg_m2: f64,
    /// Moment of inertia about the roll axis, kg m^2; the propellant's part is neglected.
    pub roll_inertia_kg_m2: f64,
    /// Middle of the propellant, m above the nozzle.
    pub propellant_station_m: f64,
}

/// The fuselage: a cylinder from the nozzle to the nose.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Length from nozzle to nose, m.
    pub length_m: f64,
    pub diameter_m: f64,
    /// Reference area of the axial drag coefficient and of the fins' coefficients, m^2.
    pub reference_area_m2: f64,
    /// Axial drag coefficient on the reference area.
    pub axial_drag_coefficient: f64,
    /// Crossflow drag coefficient on length times diameter.
    pub crossflow_drag_coefficient: f64,
}

/// The four fins and their servos. Opening angle from the body: 0 closed, 90 degrees deployed.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FinData {
    /// Position of the hinges, m above the nozzle.
    pub station_m: f64,
    /// Length of a fin, m (the paper's L_f).
    pub length_m: f64,
    /// Drag coefficient of an open fin on the body's reference area (Eq. 2).
    pub drag_coefficient: f64,
    /// Lift coefficient of an open fin on the body's reference area (Eq. 2).
    pub lift_coefficient: f64,
    /// Opening angle at the closed stop, degrees.
    pub closed_deg: f64,
    /// Opening angle at the open stop, degrees.
    pub open_deg: f64,
    /// Smallest opening angle used for control, degrees.
    pub control_min_deg: f64,
    /// The servo of each fin.
    pub servo: Servo,
}

impl FinData {
    /// Opening angle at the closed stop, rad.
    pub fn closed_rad(&self) -> f64 {
        self.closed_deg.to_radians()
    }

    /// Opening angle at the open stop, rad.
    pub fn open_rad(&self) -> f64 {
        self.open_deg.to_radians()
    }

    /// Smallest opening angle used for control, rad.
    pub fn control_min_rad(&self) -> f64 {
        self.control_min_deg.to_radians()
    }
}

/// The thrust-vectoring actuator: two axes with the same servo.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gimbal {
    /// Mechanical stop on either side, degrees.
    pub limit_deg: f64,
    /// The servo of each axis.
    pub servo: Servo,
}

impl Gimbal {
    /// Mechanical stop on either side, rad.
    pub fn limit_rad(&self) -> f64 {
        self.limit_deg.to_radians()
    }
}

/// A servo: a pure delay, then a rate limit, then play between its horn and its load.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Servo {
    /// Slew rate under load, degrees per second.
    pub rate_deg_s: f64,
    /// Delay between a command and the first motion, s.
    pub delay_s: f64,
    /// Total play (backlash) between horn and load, degrees.
    pub slop_deg: f64,
}

impl Servo {
    /// Slew rate under load, rad/s.
    pub fn rate_rad_s(&self) -> f64 {
        self.rate_deg_s.to_radians()
    }

    /// Total play between horn and load, rad.
    pub fn slop_rad(&self) -> f64 {
        self.slop_deg.to_radians()
    }
}

/// Four legs, 90 degrees apart. Each has a spring and a damper along the vertical, and a foot with friction.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Legs {
    /// Station of the feet, m above the nozzle; negative.
    pub foot_station_m: f64,
    /// Distance of each foot from the axis, m.
    pub foot_radius_m: f64,
    /// Stiffness of one leg, N/m.
    pub stiffness_n_m: f64,
    /// Damping of one leg, N s/m.
    pub damping_n_s_m: f64,
    /// Friction coefficient between foot and ground.
    pub friction_coefficient: f64,
}

/// The recovery parachute, attached at the nose.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parachute {
    /// Canopy area, m^2.
    pub area_m2: f64,
    /// Drag coefficient on the canopy area.
    pub drag_coefficient: f64,
    /// Time from the command until the lines are taut, s.
    pub ejection_delay_s: f64,
    /// Distance through the air from taut lines to the fully open canopy, m.
    pub inflation_distance_m: f64,
}
