//! Finds the ignition height of the simpler guidance laws before the flight.

use flight::vehicle::mission::Mission;

use flight::guidance::baseline::{Controller, Law};
use sim::dispersion::Dispersion;
use sim::draw::draw;
use sim::sortie::{SetUpError, Sortie};

/// Search range on either side of the first guess, as a fraction of it.
const SPAN_SHARE: f64 = 0.08;
/// Flights of the search; they give the height to a centimetre or two.
const FLIGHTS: usize = 14;
/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// The ignition height, m, from which a baseline touches down most slowly with nominal data, found by simulated
/// flights. `None` for the pilot, which decides in flight.
///
/// # Errors
/// The mission cannot be flown.
pub fn fixed_height_m(controller: Controller, mission: &Mission) -> Result<Option<f64>, SetUpError> {
    let law = Law::of(controller, mission);
    let Some(guess_m) = law.ignition_height_m() else { return Ok(None) };
    let certain = Dispersion::default();
    let speed_m_s = |height_m: f64| -> Result<f64, SetUpError> {
        let mut timed = mission.clone();
        timed.ignition.fixed_height_m = Some(height_m);
        let draw = draw(&timed, &certain, 0, 0);
        let mut flight = Sortie::drawn_as(&timed, &certain, &draw, law.clone())?;
        let outcome = flight.run();
        Ok(outcome.touchdown.map_or(f64::INFINITY, |touchdown| touchdown.vertical_m_s.abs()))
    };
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
