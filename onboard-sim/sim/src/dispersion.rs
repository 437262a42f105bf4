//! The uncertain values of a flight, as data.

use crate::world::sensors::SensorParams;
use crate::world::wind::aloft::WindsAloft;
use flight::vehicles::file_error::FileError;
use serde::Deserialize;

/// A set of dispersions. Each value is the standard deviation of a normal distribution unless its
/// name says otherwise.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Dispersion {
    /// The sensors have errors; otherwise they are nearly exact, and the initial state is exact.
    pub sensors: bool,
    /// Errors of the sensors.
    pub sensor_params: SensorParams,
    /// Impulse, as a fraction.
    pub impulse_share: f64,
    /// Impulse, as a fraction: uniform between minus and plus this value.
    pub impulse_even_share: f64,
    /// Burn time, as a fraction.
    pub burn_time_share: f64,
    /// Ignition delay of a single igniter, s; the airframe scales it. The drawn delay is never
    /// below 20 ms.
    pub ignition_delay_s: f64,
    /// Ignition delay of a single igniter, s: uniform between minus and plus this value.
    pub ignition_delay_even_s: f64,
    /// Thrust misalignment in each axis, degrees.
    pub thrust_misalignment_deg: f64,
    /// Mass, as a fraction.
    pub mass_share: f64,
    /// Drag, as a fraction.
    pub drag_share: f64,
    /// Centre of gravity off the axis, m, in each axis.
    pub cg_off_axis_m: f64,
    /// Lowest and highest mean wind 10 m above the ground, m/s; the draw is uniform between them.
    pub wind_m_s: [f64; 2],
    /// Mean wind over height instead of a draw: height above the pad, m; speed, m/s; direction it
    /// comes from, degrees clockwise from north. The levels rise.
    pub winds_aloft: Option<WindsAloft>,
    /// Gust intensity, as a multiple of the military standard's.
    pub gust_scale: f64,
    /// Error of the wind that the crew measures before it places the rail: of its speed, m/s.
    pub measured_wind_m_s: f64,
    /// Of its direction, degrees.
    pub measured_wind_deg: f64,
    pub apogee_height_m: f64,
    /// Horizontal position of apogee, m, in each axis.
    pub apogee_place_m: f64,
    /// Horizontal velocity at apogee, m/s, in each axis.
    pub apogee_velocity_m_s: f64,
    /// Tilt at apogee, degrees, in each axis.
    pub apogee_tilt_deg: f64,
    /// Rotation rate at apogee, degrees per second, in each axis.
    pub apogee_rate_deg_s: f64,
    /// Lean of the launch rail, degrees, about each axis of the world.
    pub rail_lean_deg: f64,
    /// Cant of the booster's fins, degrees.
    pub fin_cant_deg: f64,
    /// Height of a drop, m.
    pub drop_height_m: f64,
    /// Deviations of the vehicle from its data that the flight computer's models do not contain.
    pub mismatch: Mismatch,
}

/// How the true vehicle, the weather and the ground differ from the flight computer's models. Each
/// value is the standard deviation of a normal distribution unless its name says otherwise; a pair
/// is the lowest and highest value of a uniform one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mismatch {
    /// Shape of the thrust curve: rms over the burn, as a fraction of the thrust. Slow deviations
    /// are larger than fast ones; the impulse stays.
    pub thrust_shape_share: f64,
    /// Position of the curve between the mission's and the last of its other ones, 0 to 1.
    pub other_curve: [f64; 2],
    /// Probability that the motor chuffs: it burns for 0.1 s, goes out for 0.2 s, and reignites.
    pub chuff_share: f64,
    /// Time in which the thrust rises to its curve's, s.
    pub thrust_rise_s: [f64; 2],
    /// Mean of an exponentially distributed ignition delay beyond that of the igniter, s: the
    /// propellant does not catch at once.
    pub ignition_tail_s: f64,
    /// Fraction of the body's axial drag that the exhaust takes away.
    pub plume_body_loss: [f64; 2],
    /// Fraction of the fins' drag that the exhaust takes away.
    pub plume_fin_loss: [f64; 2],
    /// Drag along the body, as a fraction.
    pub body_drag_share: f64,
    /// Drag of the fins, as a fraction.
    pub fin_drag_share: f64,
    /// Force of a fin away from the axis, over its drag times the cosine of its opening.
    pub fin_radial: [f64; 2],
    /// Drag across the body, as a fraction.
    pub crossflow_share: f64,
    /// Drag of the legs, as a fraction of the airframe's.
    pub leg_drag_share: f64,
    /// Drag area of the legs that the airframe does not have, m^2.
    pub leg_drag_m2: [f64; 2],
    /// Moments of inertia, as a fraction.
    pub inertia_share: f64,
    /// How far the inertias about pitch and yaw lie from their mean, as a fraction, in either
    /// direction.
    pub inertia_split_share: f64,
    /// Lean of the principal axis of inertia against the body's axis, each way, degrees.
    pub principal_axis_deg: f64,
    /// Centre of gravity along the axis, m.
    pub cg_along_m: f64,
    /// Thrust off the axis, m, in each direction.
    pub thrust_offset_m: f64,
    /// Turn of the nozzle over the turn of its servo, as a fraction.
    pub gimbal_gain_share: f64,
    /// Play of the gimbal beside the airframe's, degrees.
    pub gimbal_slop_deg: [f64; 2],
    /// Misalignment of each fin, degrees.
    pub fin_offset_deg: f64,
    /// Play of the fins beside the airframe's, degrees.
    pub fin_slop_deg: [f64; 2],
    /// Exponent of the wind's power law over height.
    pub wind_exponent: f64,
    /// Turn of the wind over the first 100 m of height, degrees.
    pub wind_veer_deg_100m: f64,
    /// Slope of the ground along each axis of the world, as a multiple of the site's.
    pub ground_slope_scale: f64,
}

/// The built-in sets: name and TOML text.
pub const BUILTIN: &[(&str, &str)] = &[
    ("none", include_str!("dispersions/none.toml")),
    ("thrust-only", include_str!("dispersions/thrust-only.toml")),
    ("field", include_str!("dispersions/field.toml")),
    ("harsh", include_str!("dispersions/harsh.toml")),
    ("real", include_str!("dispersions/real.toml")),
    ("real-harsh", include_str!("dispersions/real-harsh.toml")),
    ("wild", include_str!("dispersions/wild.toml")),
];

/// The default set behind every number that a person acts on: the one with an error in everything.
pub const DEFAULT: &str = "real";

/// Whether a number from this set may be kinder than one from [`DEFAULT`]: every set but this one,
/// twice its errors, and it with more. Other winds do not matter.
pub fn is_more_benign(name: &str) -> bool {
    let set = name.split_once(" with ").map_or(name, |(set, _)| set);
    !["real", "real-harsh", "wild"].contains(&set)
}

/// Why a set cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DispersionError {
    /// The text is not a set of dispersions.
    #[error(transparent)]
    File(#[from] FileError),
    /// No built-in set has this name.
    #[error("no dispersion is named '{name}'; these are built in: {available}")]
    Unknown {
        /// The requested name.
        name: String,
        /// The names there are.
        available: String,
    },
}

impl Dispersion {
    /// Reads a set from TOML; `origin` names it in messages.
    ///
    /// # Errors
    /// [`DispersionError::File`] names the key.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, DispersionError> {
        let read = toml::from_str(text);
        Ok(read.map_err(|error| FileError::Parse { origin: origin.to_owned(), message: error.to_string() })?)
    }

    /// Source of the mean wind over height, in words.
    pub fn wind_over_height(&self) -> String {
        let words = "power law from the mean wind at 10 m, exponent 1/7 in the mean";
        self.winds_aloft.as_ref().map_or_else(|| words.to_owned(), ToString::to_string)
    }

    /// The built-in set of a name.
    ///
    /// # Errors
    /// [`DispersionError::Unknown`] lists the names there are.
    pub fn builtin(name: &str) -> Result<Self, DispersionError> {
        Self::from_toml(Self::builtin_toml(name)?, name)
    }

    /// The text of the built-in set of a name.
    ///
    /// # Errors
    /// [`DispersionError::Unknown`] lists the names there are.
    pub fn builtin_toml(name: &str) -> Result<&'static str, DispersionError> {
        let found = BUILTIN.iter().find(|(key, _)| *key == name).map(|(_, text)| *text);
        found.ok_or_else(|| {
            let available = BUILTIN.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
            DispersionError::Unknown { name: name.to_owned(), available }
        })
    }
}
