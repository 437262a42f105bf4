//! Finds masses, sizes and times in the wrong unit or place: a motor with grams in the place of
//! kilograms parses, but cannot exist.

use alloc::format;
use core::f64::consts::PI;

use crate::vehicle::thrust_curve::ThrustCurve;

use super::{ThrustCurveError, bad};

/// Impulse over mass of the propellant, m/s. Black powder has 300 to 800, composite 1500 to 2200;
/// for a hybrid some files count only the solid fuel, and have up to 35,000 (thrustcurve.org,
/// 2019). A wrong unit is a factor of 1000.
const EXHAUST_M_S: core::ops::RangeInclusive<f64> = 100.0..=50_000.0;
/// Highest mass over volume of the casing, kg/m^3: that of steel is 7,900, the highest in
/// thrustcurve.org 4,900.
const DENSEST_KG_M3: f64 = 10_000.0;
/// Diameters of motors, m: 6 to 161 mm (thrustcurve.org). Many have one of 24 to 54 mm, which are
/// 0.9 to 2.1 inches.
const DIAMETERS_M: core::ops::RangeInclusive<f64> = 0.005..=0.5;
/// The latest first thrust, s: up to 0.36 in thrustcurve.org.
const BEGINS_S: f64 = 1.0;

/// Checks a motor whose masses and size are on this line of its file.
pub(super) fn check(curve: &ThrustCurve, line: usize) -> Result<(), ThrustCurveError> {
    let (propellant_kg, total_kg) = (curve.propellant_mass_kg(), curve.total_mass_kg());
    let impulse_n_s = curve.total_impulse_n_s();
    if !EXHAUST_M_S.contains(&(impulse_n_s / propellant_kg)) {
        return Err(bad(
            line,
            "propellant mass",
            &format!("{propellant_kg} kg for {impulse_n_s:.1} N s"),
            "100 to 50,000 N s from each kilogram are accepted; a .eng file has kilograms, a .rse file grams",
        ));
    }
    let (diameter_m, length_m) = (curve.diameter_m(), curve.length_m());
    if !DIAMETERS_M.contains(&diameter_m) {
        let found = format!("{:?} mm", libm::round(1e6 * diameter_m) / 1e3);
        return Err(bad(line, "diameter", &found, "5 to 500 mm are accepted"));
    }
    let begins_s = curve.points().iter().find(|point| point.thrust_n > 0.0).map_or(0.0, |point| point.time_s);
    if begins_s > BEGINS_S {
        let required = "a curve begins with the thrust, within 1 s; cut off what was recorded before";
        return Err(bad(line, "the first thrust", &format!("at {begins_s} s"), required));
    }
    let volume_m3 = 0.25 * PI * diameter_m * diameter_m * length_m;
    if total_kg > DENSEST_KG_M3 * volume_m3 {
        return Err(bad(
            line,
            "total mass",
            &format!("{total_kg} kg in {:.0} x {:.0} mm", 1e3 * diameter_m, 1e3 * length_m),
            "at most 10,000 kg/m3 is accepted; sizes are in mm, masses of a .eng file in kg, of a .rse file in g",
        ));
    }
    Ok(())
}
