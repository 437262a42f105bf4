//! The landing burn: its path, motor, plans and actuators.

use flight::guidance::powered::{ControlLevel, Plan};
use flight::vehicle::mission::Mission;
use nalgebra::Vector3;

use super::HEIGHT;
use super::pictures::PLANNED;
use crate::report::chart::{Chart, line};
use crate::report::html::{charts, paragraph};
use crate::report::track::{Decision, Flight, Part, Sample, Series, State, planned};

/// A plan that ends this far below the ground ends on it, m.
const GROUND_M: f64 = 0.05;

/// Ends a line.
const GAP: (f64, f64) = (f64::NAN, f64::NAN);

const PLANS_DRAWN: usize = 8;

/// Where the nose points is drawn so many times, as a line of this length, m.
const NOSES_DRAWN: usize = 16;
const NOSE_M: f64 = 4.0;

/// The views of a path: its axes, as words and as numbers, and the name of the first.
const VIEWS: [(&str, &str, [usize; 2], &str); 3] = [
    ("Path from the south, m", "1 2", [1, 2], "east, m"),
    ("Path from the east, m", "0 2", [0, 2], "north, m"),
    ("Path from above, m", "1 0", [1, 0], "east, m"),
];

/// The path to the landing with plans and attitude, from three sides.
fn paths(flight: &Flight) -> String {
    let parts = [Part::Burn, Part::Air];
    let shown = |sample: &&Sample| parts.iter().all(|part| flight.has(*part, sample.time_s));
    let (made, flown) = (flight.made(), flight.track.iter().filter(shown).copied().collect::<Vec<_>>());
    let picture = |(title, axes, [right, up], x_name): (&str, &'static str, [usize; 2], &'static str)| {
        let see = |state: &State| (state[right], state[up]);
        let path = |(_, plan): &(&Decision, &Plan)| -> Series {
            // A plan that does not land ends below the ground.
            let above = plan.states().iter().map(planned).take_while(|state| state[HEIGHT] >= -GROUND_M);
            above.map(|state| see(&state)).chain([GAP]).collect()
        };
        let nose = |sample: &Sample| {
            let nose = sample.attitude? * Vector3::x();
            // East is against y.
            let along = [nose.x, -nose.y, nose.z].map(|share| NOSE_M * share);
            let (x, y) = see(&sample.state);
            Some([(x, y), (x + along[right], y + along[up]), GAP])
        };
        let every = |all: usize, drawn: usize| all.div_ceil(drawn).max(1);
        let later = made.iter().skip(1).step_by(every(made.len(), PLANS_DRAWN)).flat_map(path);
        let noses = flown.iter().step_by(every(flown.len(), NOSES_DRAWN)).filter_map(nose).flatten();
        let lines = vec![
            line("later plans", "thin", later.collect()),
            line(PLANNED, "b", made.first().map(path).unwrap_or_default()),
            line("nose", "nose", noses.collect()),
            line("flown", "a", flown.iter().map(|sample| see(&sample.state)).collect()),
        ];
        let (title, size_px) = (title.to_owned(), Some((348.0, 300.0)));
        Chart { title, axes, x_name, size_px, lines, ..Chart::default() }.svg()
    };
    charts(&VIEWS.map(picture).concat())
}

/// Where the track comes from, what the motor did, and the path.
pub(super) fn words(flight: &Flight) -> String {
    let Some(source) = flight.source else {
        return paragraph("The log has no positions of the vehicle.");
    };
    paragraph(&format!("{source} {}", thrust(flight))) + &paths(flight)
}

/// A motor that is further off than this was another one than the mission expected: one of twenty
/// of its own lot is.
const ANOTHER_SIGMAS: f64 = 2.0;

fn thrust(flight: &Flight) -> String {
    let (Some(pilot), Some(_)) = (&flight.pilot, flight.ignition_s) else {
        return "The log has no ignition, or no profile that says how strong the motor should be.".to_owned();
    };
    if pilot.motor().ignition_s().is_none() {
        return String::new();
    }
    let (impulse, burn_time) = (pilot.motor().impulse_scale(), pilot.motor().burn_time_stretch());
    let another = another_curve([impulse, burn_time], pilot.mission());
    let inferred =
        format!("Inferred at the end: impulse {impulse:.3} and burn time {burn_time:.3} of expected. ");
    inferred + &another.unwrap_or_default()
}

/// That the motor flew another curve than expected, if it did, and what had confirmed that curve.
fn another_curve(scales: [f64; 2], mission: &Mission) -> Option<String> {
    let sigmas = [mission.motor.impulse_sigma, mission.motor.burn_time_sigma];
    let off: Vec<String> = ["impulse", "burn time"]
        .into_iter()
        .zip(scales.map(|scale| scale - 1.0).into_iter().zip(sigmas))
        .filter(|(_, (off, sigma))| off.abs() > ANOTHER_SIGMAS * sigma)
        .map(|(name, (off, sigma))| {
            format!("{name} {:+.1} %, {:.1} deviations", 100.0 * off, off.abs() / sigma)
        })
        .collect();
    let confirmed = match mission.motor_burns() {
        0 => "No burn of its lot had confirmed the certified curve.".to_owned(),
        burns => format!("Burns of its lot that had confirmed the curve: {burns}."),
    };
    let off = off.join("; ");
    let words = || format!("The motor flew another curve than expected: {off}. {confirmed}");
    (!off.is_empty()).then(words)
}

pub(super) fn plans(flight: &Flight) -> Option<String> {
    let plans = flight.made();
    let levels = ControlLevel::ALL.into_iter().filter_map(|level| {
        let count = plans.iter().filter(|(decision, _)| decision.level == u32::from(level.index())).count();
        (count > 0).then(|| format!("{count} decided by {}", level.name()))
    });
    let most = plans.iter().map(|(decision, _)| decision.iterations).max()?;
    let levels: Vec<String> = levels.collect();
    let words = format!("{} plans: {}; at most {most} iterations.", plans.len(), levels.join(", "));
    Some(paragraph(&words))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_two_deviations_off_flew_another_curve() {
        let of = |scales, [impulse_sigma, burn_time_sigma]: [f64; 2]| {
            let mut mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
            (mission.motor.impulse_sigma, mission.motor.burn_time_sigma) = (impulse_sigma, burn_time_sigma);
            // No motor of its lot was fired.
            assert_eq!(mission.motor_burns(), 0);
            another_curve(scales, &mission)
        };
        assert_eq!(of([1.02, 0.97], [0.0125, 0.02]), None);
        assert_eq!(
            of([0.95, 1.01], [0.0125, 0.02]).as_deref(),
            Some(
                "The motor flew another curve than expected: impulse -5.0 %, 4.0 deviations. No burn of its lot had confirmed the \
                 certified curve."
            )
        );
        let both = of([0.95, 1.05], [0.0125, 0.02]);
        assert!(
            both.as_ref().is_some_and(|words| words.contains("; burn time +5.0 %, 2.5 deviations.")),
            "{both:?}"
        );
    }
}
