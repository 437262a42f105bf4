//! The height that a timed ignition is set to before the flight.

use flight::mission::Mission;

use crate::baseline::{Baseline, Controller};
use crate::dispersion::Dispersion;
use crate::draw::draw;
use crate::fly::{Flight, FlyError};

/// Searched on either side of the first guess, as a share of it.
const SPAN_SHARE: f64 = 0.08;
/// Flights of the search: to a centimetre or two.
const FLIGHTS: usize = 14;
/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// The height, m, from which a baseline touches down most slowly if everything is as in the data: found by flying it.
/// `None` for the pilot, who decides for himself.
///
/// # Errors
/// The mission cannot be flown.
pub fn fixed_height_m(controller: Controller, mission: &Mission) -> Result<Option<f64>, FlyError> {
    let Some(baseline) = Baseline::new(controller, mission)? else { return Ok(None) };
    let certain = Dispersion::default();
    let speed_m_s = |height_m: f64| -> Result<f64, FlyError> {
        let mut timed = mission.clone();
        timed.ignition.fixed_height_m = Some(height_m);
        let draw = draw(&timed, &certain, 0, 0);
        let mut flight = Flight::new(&timed, &certain, &draw)?.with_baseline(Some(baseline.clone()));
        let outcome = flight.run();
        Ok(outcome.touchdown.map_or(f64::INFINITY, |touchdown| touchdown.vertical_m_s.abs()))
    };
    let guess_m = baseline.ignition_height_m();
    let (mut low_m, mut high_m) = (guess_m * (1.0 - SPAN_SHARE), guess_m * (1.0 + SPAN_SHARE));
    let inside =
        |low_m: f64, high_m: f64| [high_m - GOLDEN * (high_m - low_m), low_m + GOLDEN * (high_m - low_m)];
    let [mut left_m, mut right_m] = inside(low_m, high_m);
    let (mut left_m_s, mut right_m_s) = (speed_m_s(left_m)?, speed_m_s(right_m)?);
    for _ in 2..FLIGHTS {
        if left_m_s < right_m_s {
            high_m = right_m;
            (right_m, right_m_s) = (left_m, left_m_s);
            left_m = inside(low_m, high_m)[0];
            left_m_s = speed_m_s(left_m)?;
        } else {
            low_m = left_m;
            (left_m, left_m_s) = (right_m, right_m_s);
            right_m = inside(low_m, high_m)[1];
            right_m_s = speed_m_s(right_m)?;
        }
    }
    Ok(Some(if left_m_s < right_m_s { left_m } else { right_m }))
}
