//! Whether a vehicle weighs what its motor can land.

use crate::guidance::vertical::EvenLanding;

/// From this tilt on, rad, a vehicle that throws away thrust all the way down has nothing left for a motor that is stronger: 62
/// degrees.
pub const MOST_TILT_RAD: f64 = 1.082;

/// Why no height lands a vehicle with this even landing, in a builder's words; `None` if some may.
pub fn misfit(landing: &EvenLanding) -> Option<&'static str> {
    match landing.tilt_rad {
        None => Some("too heavy for its motor: the thrust does not stop it"),
        Some(tilt_rad) if tilt_rad > MOST_TILT_RAD => Some("too light for its motor: no height lands it"),
        Some(_) => None,
    }
}
