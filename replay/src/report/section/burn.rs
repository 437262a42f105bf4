//! The landing burn: its path, motor, plans and actuators.

use flight::guidance::powered::{ControlLevel, Plan};
use flight::vehicle::mission::Mission;

use super::pictures::gimbal_deg;
use super::{COMPONENTS, DEGREES, rms_and_max};
use crate::report::chart::{Chart, line};
use crate::report::html::{charts, paragraph, table};
use crate::report::track::{Flight, Part, Sample, Series, State, Thought, planned, planned_at};

/// Prediction times at which predictions are compared with the flight, s.
pub(super) const AHEAD_S: [f64; 2] = [0.1, 0.5];

/// A plan that ends this far below the ground ends on it, m.
const GROUND_M: f64 = 0.05;

const PLANS_DRAWN: usize = 8;

/// A view of a path: title, axes, and what it shows of a state.
pub(super) type View = (&'static str, [&'static str; 2], fn(&State) -> (f64, f64));

const VIEWS: [View; 2] = [
    (
        "The landing: height over the distance from the pad",
        ["distance from the pad, m", "height of the feet, m"],
        |state| (libm::hypot(state[0], state[1]), state[2]),
    ),
    ("The landing from above", ["east, m", "north, m"], |state| (state[1], state[0])),
];

/// The flights' paths to their landings, each with its name and class, in both views; of a single flight with its plans.
pub(super) fn paths(flights: &[(&'static str, &'static str, &Flight)]) -> String {
    let picture = |(title, labels, see): View| {
        let shown = |flight: &Flight| -> Series {
            let part = |sample: &&Sample| {
                [Part::Burn, Part::Air].iter().all(|part| flight.has(*part, sample.time_s))
            };
            flight.track.iter().filter(part).map(|sample| see(&sample.state)).collect()
        };
        let plans = flights.iter().filter(|_| flights.len() == 1).map(|(.., flight)| {
            let made = flight.made();
            let drawn = made.iter().step_by(made.len().div_ceil(PLANS_DRAWN).max(1));
            let path = |(_, plan): &(&Thought, &Plan)| -> Series {
                // A plan that does not land ends below the ground.
                let above = plan.states().iter().map(planned).take_while(|state| state[2] >= -GROUND_M);
                above.map(|state| see(&state)).chain([(f64::NAN, f64::NAN)]).collect()
            };
            line("planned", "thin", drawn.flat_map(path).collect())
        });
        let flown = flights.iter().map(|(name, class, flight)| line(name, class, shown(flight)));
        let mut chart = Chart::new(title, labels, plans.chain(flown).collect());
        (chart.panel.equal_scales, chart.full) = (true, true);
        chart.svg()
    };
    charts(&VIEWS.map(picture))
}

pub(super) fn path(flight: &Flight) -> String {
    let Some(source) = flight.source else {
        return paragraph("The log has no positions of the vehicle.");
    };
    // Without a landing, the pictures of the whole flight show all there is of its path.
    let lands = flight.pilot.is_none() || !flight.made().is_empty();
    paragraph(source) + &if lands { paths(&[("flown", "a", flight)]) } else { String::new() }
}

/// A motor that is further off than this was another one than the mission expected: one of twenty of its own lot is.
const ANOTHER_SIGMAS: f64 = 2.0;

pub(super) fn thrust(flight: &Flight) -> String {
    let (Some(pilot), Some(_)) = (&flight.pilot, flight.ignition_s) else {
        return paragraph("The log has no ignition, or no profile that says how strong the motor should be.");
    };
    let mut rows = Vec::new();
    let mut words = None;
    if pilot.motor().ignition_s().is_some() {
        let scales = pilot.scales();
        for (what, scale) in ["impulse", "burn time"].into_iter().zip(scales) {
            rows.push([format!("inferred {what} at the end, of expected"), format!("{scale:.4}")]);
        }
        words = another_curve(scales, pilot.mission(), pilot.other_curve());
    }
    let world = &flight.recording.world;
    let pairs =
        world.windows(2).map(|pair| (pair[0].thrust_n + pair[1].thrust_n, pair[1].time_s - pair[0].time_s));
    let impulse_n_s: f64 = pairs.map(|(twice_n, dt_s)| 0.5 * twice_n * dt_s).sum();
    if impulse_n_s > 0.0 && world.last().is_some_and(|last| last.thrust_n <= 0.0) {
        let scale = impulse_n_s / pilot.mission().motor_curve.total_impulse_n_s();
        rows.push(["actual impulse, of expected".to_owned(), format!("{scale:.4}")]);
    }
    words.map_or_else(String::new, |words| paragraph(&words))
        + &table(&["", "#"], rows)
        + &paragraph("The dashed level is the vehicle's weight.")
}

/// That the motor flew another curve than expected, if it did, and what had confirmed that curve.
fn another_curve(scales: [f64; 2], mission: &Mission, nearest: Option<&str>) -> Option<String> {
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
    let nearest = nearest.map_or_else(String::new, |name| {
        format!(" Half a second after its ignition the flight computer took it for {name}.")
    });
    let off = off.join("; ");
    let words = || format!("The motor flew another curve than expected: {off}.{nearest} {confirmed}");
    (!off.is_empty()).then(words)
}

pub(super) fn plans(flight: &Flight) -> Option<String> {
    let plans = flight.made();
    let levels = ControlLevel::ALL.into_iter().filter_map(|level| {
        let count = plans.iter().filter(|(thought, _)| thought.level == u32::from(level.index())).count();
        (count > 0).then(|| format!("{count} decided by {}", level.name()))
    });
    let most = plans.iter().map(|(thought, _)| thought.iterations).max()?;
    let levels: Vec<String> = levels.collect();
    let words = format!("{} plans: {}; at most {most} iterations.", plans.len(), levels.join(", "));
    let worst = flight.worst_plans.iter().map(|plan| paragraph(&format!("Worst: {}.", plan.words())));
    let kept = paragraph("By the judge's formulas every plan keeps its conditions.");
    Some(paragraph(&words) + &if flight.worst_plans.is_empty() { kept } else { worst.collect() })
}

/// What the flight made of each plan: the time that it predicts, so far ahead, s, and the actual less the planned state then.
pub(super) fn tracking_errors(flight: &Flight, ahead_s: f64) -> Vec<(f64, State)> {
    let error = |(thought, plan): (&Thought, &Plan)| {
        let then_s = thought.time_s + ahead_s;
        // After contact the ground determines the motion.
        let came = flight.state_at(then_s).filter(|_| flight.has(Part::Air, then_s))?;
        let planned = planned_at(plan, then_s)?;
        Some((then_s, core::array::from_fn(|i| came[i] - planned[i])))
    };
    flight.made().into_iter().filter_map(error).collect()
}

pub(super) fn tracking(flight: &Flight) -> Option<String> {
    let row = |ahead_s: f64| -> Vec<String> {
        let errors = tracking_errors(flight, ahead_s);
        let cells = COMPONENTS.iter().enumerate().filter_map(|(component, (_, _, factor))| {
            let (rms, max) = rms_and_max(errors.iter().map(|(_, error)| factor * error[component]))?;
            Some(format!("{rms:.4} / {max:.4}"))
        });
        [format!("{ahead_s} s"), errors.len().to_string()].into_iter().chain(cells).collect()
    };
    flight.made().first()?;
    let heads = COMPONENTS.map(|(name, unit, _)| format!("#{name}, {unit}"));
    let heads: Vec<&str> =
        ["predicted ahead", "#plans"].into_iter().chain(heads.iter().map(String::as_str)).collect();
    let words = paragraph("Actual state less the planned one, root mean square / largest.");
    Some(words + &table(&heads, AHEAD_S.map(row)))
}

/// A value within this fraction of a stop or of the maximum slew rate counts as saturated.
const AT_LIMIT: f64 = 0.995;

pub(super) fn saturation(flight: &Flight) -> Option<String> {
    let airframe = &flight.pilot.as_ref()?.mission().airframe;
    let world = &flight.recording.world;
    // The track is the world's.
    let mut flying = world.iter().zip(&flight.track).filter(|(sample, Sample { phase, .. })| {
        !sample.in_contact && phase.is_some_and(|phase| !phase.on_pad())
    });
    let ((from, _), (to, _)) = flying.next().zip(flying.next_back())?;
    let total_s = to.time_s - from.time_s;
    let mut rows = Vec::new();
    let mut put = |what: String, angles: &Series, holds: &dyn Fn(f64, f64, f64) -> bool| {
        let pairs = angles.windows(2).filter(|pair| from.time_s <= pair[0].0 && pair[1].0 <= to.time_s);
        let pairs = pairs.map(|pair| (pair[0].1, pair[1].1, pair[1].0 - pair[0].0));
        // From positive zero, because an empty sum is a negative one.
        let found_s =
            pairs.filter(|(a, b, dt_s)| holds(*a, *b, *dt_s)).fold(0.0, |sum, (_, _, dt_s)| sum + dt_s);
        rows.push([what, format!("{found_s:.2} s"), format!("{:.1} %", 100.0 * found_s / total_s)]);
    };
    let slews = |rate: f64| move |a: f64, b: f64, dt_s: f64| (b - a).abs() >= AT_LIMIT * rate * dt_s;
    for (axis, name) in ["pitch", "yaw"].into_iter().enumerate() {
        let ([actual, _], gimbal) = (gimbal_deg(flight, axis), &airframe.gimbal);
        let at_stop = |_: f64, b: f64, _: f64| b.abs() >= AT_LIMIT * gimbal.limit_deg;
        put(format!("gimbal {name} at its stop of {:.1} deg", gimbal.limit_deg), &actual, &at_stop);
        put(format!("gimbal {name} at its fastest slew"), &actual, &slews(gimbal.servo.rate_deg_s));
    }
    for fin in 0..from.fins_actual_rad.len() {
        let angles = flight.truth(|sample| Some(DEGREES * sample.fins_actual_rad.get(fin)?));
        let rate_deg_s = airframe.fins.servo.rate_deg_s;
        let what = format!("fin {} at its fastest slew of {rate_deg_s:.0} deg/s", fin + 1);
        put(what, &angles, &slews(rate_deg_s));
    }
    let words = paragraph(&format!("Of {total_s:.2} s in the air."));
    Some(words + &table(&["actuator", "#time", "#share"], rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_two_deviations_off_flew_another_curve() {
        let of = |scales, [impulse_sigma, burn_time_sigma]: [f64; 2], nearest| {
            let mut mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
            (mission.motor.impulse_sigma, mission.motor.burn_time_sigma) = (impulse_sigma, burn_time_sigma);
            // Nobody has burnt any of its lot.
            assert_eq!(mission.motor_burns(), 0);
            another_curve(scales, &mission, nearest)
        };
        assert_eq!(of([1.02, 0.97], [0.0125, 0.02], None), None);
        assert_eq!(
            of([0.95, 1.01], [0.0125, 0.02], None).as_deref(),
            Some(
                "The motor flew another curve than expected: impulse -5.0 %, 4.0 deviations. No burn of its lot had confirmed the \
                 certified curve."
            )
        );
        let known = of([1.11, 0.85], [0.027, 0.04], Some("HP-H45W"));
        let words =
            "deviations. Half a second after its ignition the flight computer took it for HP-H45W. No burn";
        assert!(known.as_ref().is_some_and(|known| known.contains(words)), "{known:?}");
        let both = of([0.95, 1.05], [0.0125, 0.02], None);
        assert!(
            both.as_ref().is_some_and(|words| words.contains("; burn time +5.0 %, 2.5 deviations.")),
            "{both:?}"
        );
    }
}
