//! One row per flight: its random draws, its outcome and the work of its solver.
//!
//! The columns and their units are named only here. The cell of a missing quantity (such as the
//! height of an ignition that never took place) is empty. A number in CSV has enough digits to
//! restore the same bits.

use flight::rules::verdict::Landing;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A column: its name and how to read it off a row.
pub struct Column {
    /// The name, with its unit.
    pub name: &'static str,
    /// The cell of a row.
    pub value: fn(&Row) -> Value,
}

macro_rules! row {
    ($($(#[$documentation:meta])* $name:ident: $kind:ty,)*) => {
        /// A flight in a table.
        #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
        pub struct Row {
            $($(#[$documentation])* pub $name: $kind,)*
        }

        /// Every column, in order.
        pub const COLUMNS: &[Column] =
            &[$(Column { name: stringify!($name), value: |row| Value::from(row.$name.clone()) },)*];
    };
}

row! {
    /// Number of the flight.
    number: u64,
    /// Drawn: true impulse over certified.
    impulse_scale: f64,
    /// Drawn: true burn time over certified.
    burn_time_scale: f64,
    /// Drawn: from the ignition command to the first thrust, s.
    ignition_delay_s: f64,
    /// Drawn: thrust direction off the axis in pitch, degrees.
    thrust_misalignment_pitch_deg: f64,
    /// Drawn: thrust direction off the axis in yaw, degrees.
    thrust_misalignment_yaw_deg: f64,
    /// Drawn: true mass over the data's.
    mass_scale: f64,
    /// Drawn: true drag over the data's.
    drag_scale: f64,
    /// Drawn: centre of gravity off the axis along body y, m.
    cg_offset_y_m: f64,
    /// Drawn: centre of gravity off the axis along body z, m.
    cg_offset_z_m: f64,
    /// Drawn: mean wind 10 m above the ground, m/s.
    wind_m_s: f64,
    /// Drawn: direction that the wind blows to, from world x towards world y, degrees.
    wind_towards_deg: f64,
    /// Drawn: height of apogee, m.
    apogee_height_m: f64,
    /// Drawn: horizontal distance of apogee from the pad, m.
    apogee_distance_m: f64,
    /// Drawn: horizontal speed at apogee, m/s.
    apogee_speed_m_s: f64,
    /// Drawn: tilt of the nose at apogee, degrees.
    apogee_tilt_deg: f64,
    /// Drawn: size of the rotation rate at apogee, degrees per second.
    apogee_rate_deg_s: f64,
    /// The landing motor was commanded to light.
    ignited: bool,
    /// The motor was commanded to light while a check of the ignition gate failed. This must never
    /// happen.
    ignition_outside_gate: bool,
    /// The parachute was deployed.
    parachute: bool,
    /// Height of the feet that was chosen for the first thrust, m, at the time of the command.
    chosen_onset_height_m: Option<f64>,
    /// Height of the feet at the ignition command, m.
    ignition_height_m: Option<f64>,
    /// Height of the feet at the first thrust, m.
    onset_height_m: Option<f64>,
    /// Vertical velocity at the first thrust, up, m/s.
    onset_vertical_m_s: Option<f64>,
    /// Time since the first thrust at contact, s.
    burn_time_at_contact_s: Option<f64>,
    /// Time of contact since apogee, s.
    touchdown_time_s: Option<f64>,
    /// Vertical velocity at contact, up, m/s.
    touchdown_vertical_m_s: Option<f64>,
    /// Horizontal speed at contact, m/s.
    touchdown_lateral_m_s: Option<f64>,
    /// Tilt at contact, degrees.
    touchdown_tilt_deg: Option<f64>,
    /// Size of the rotation rate at contact, degrees per second.
    touchdown_rate_deg_s: Option<f64>,
    /// Position of contact, world x, m from the pad.
    touchdown_x_m: Option<f64>,
    /// Position of contact, world y, m from the pad.
    touchdown_y_m: Option<f64>,
    /// Thrust over weight at contact.
    touchdown_thrust_over_weight: Option<f64>,
    /// The load of the contact on the legs as a fraction of their limit, the largest of all limits;
    /// above 1 is too much.
    leg_use: Option<f64>,
    /// It stands undamaged ([`Landing`]).
    stands: bool,
    /// It is upright, whatever its touchdown.
    upright: bool,
    /// Inside the design envelope of its legs at contact.
    envelope: bool,
    /// Inside the landing paper's Table 2 at contact.
    table_2: bool,
    /// Why it does not stand undamaged; empty if it does.
    failure: String,
    /// Rest state of the vehicle; empty if it did not come to rest.
    rest: String,
    /// Largest used share of a leg's stroke, if legs are crushable.
    stroke_used: Option<f64>,
    /// Largest force at a foot over the leg's strength, if legs are crushable.
    strength_used: Option<f64>,
    /// Smallest distance of nozzle and body from the ground since contact, if legs are crushable,
    /// m.
    clearance_m: Option<f64>,
    /// Largest tilt since contact, if legs are crushable, degrees.
    leaned_deg: Option<f64>,
    /// Last phase.
    phase: String,
    /// Plans that converged and land.
    plans_converged: u64,
    /// Plans that were flown although they did not converge or missed their end conditions
    /// slightly.
    plans_best_feasible: u64,
    /// Ticks on which the previous plan was continued.
    plans_shifted: u64,
    /// Ticks on which the upright law flew.
    plans_stabiliser: u64,
    /// Total iterations of the solver.
    solver_iterations: u64,
    /// Solves that did not converge.
    solver_failures: u64,
    /// Fraction of the frames under thrust in which a gimbal axis was commanded to its stop.
    gimbal_saturation_share: f64,
    /// Largest error of the estimated vertical velocity below 10 m, m/s.
    error_vertical_m_s: f64,
    /// Largest error of the estimated horizontal velocity below 10 m, m/s.
    error_lateral_m_s: f64,
    /// Largest error of the estimated height below 10 m, m.
    error_height_m: f64,
    /// Largest error of the estimated direction of the nose below 10 m, degrees.
    error_nose_deg: f64,
    /// Normalised error squared of the estimated impulse and burn time 3 s after the first thrust:
    /// chi-square with 2 degrees of freedom in a consistent filter.
    nees_of_motor: Option<f64>,
    /// Normalised error squared of estimated position, velocity and attitude, mean from the first
    /// thrust to contact: 9 in a consistent filter.
    nees_of_motion: Option<f64>,
    /// Faults that happened.
    faults: u64,
    /// Time from apogee until the vehicle was at rest, s.
    flight_time_s: f64,
}

impl Row {
    pub fn landing(&self) -> Landing {
        let Self { stands, upright, envelope, table_2, .. } = *self;
        Landing { stands, upright, envelope, table_2 }
    }

    /// The drawn columns in order, each with its nominal value if it has one.
    pub const DRAWN: [(&'static str, Option<f64>); 15] = [
        ("impulse_scale", Some(1.0)),
        ("burn_time_scale", Some(1.0)),
        ("ignition_delay_s", Some(0.24)),
        ("thrust_misalignment_pitch_deg", Some(0.0)),
        ("thrust_misalignment_yaw_deg", Some(0.0)),
        ("mass_scale", Some(1.0)),
        ("drag_scale", Some(1.0)),
        ("cg_offset_y_m", Some(0.0)),
        ("cg_offset_z_m", Some(0.0)),
        ("wind_m_s", None),
        ("apogee_height_m", None),
        ("apogee_distance_m", None),
        ("apogee_speed_m_s", None),
        ("apogee_tilt_deg", None),
        ("apogee_rate_deg_s", None),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_drawn_quantity_is_a_column() {
        for (name, _) in Row::DRAWN {
            assert!(COLUMNS.iter().any(|column| column.name == name), "{name}");
        }
    }
}
