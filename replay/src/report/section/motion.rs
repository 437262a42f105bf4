//! The vehicle over time, for the page's script: where it was, how it pointed, and what its
//! actuators did.

use flight::vehicle::airframe::MassModel;
use serde_json::{Value, json};

use super::pictures::surface_deg;
use crate::report::track::{Flight, Part, Series};

/// Time between two rows in the landing burn and elsewhere, s.
const EACH_S: [f64; 2] = [0.04, 0.1];

/// The shape of the vehicle, the phases, and rows of: time on the report's axis, s; north, east and
/// height of the feet, m; attitude from body to world (w, x, y, z); gimbal pitch and yaw, and the
/// fins, deg; thrust, N; whether it is on its booster; how far the parachute is open. As JSON; what
/// is unknown is null.
pub(in crate::report) fn json(flight: &Flight) -> String {
    let on_booster = flight.framed(|frame| Some(f64::from(u8::from(frame.input.booster_attached))));
    let thrust_n = match flight.recording.world.as_slice() {
        [] => flight.decision(|decision| decision.thrust_n),
        _ => flight.truth(|sample| Some(sample.thrust_n + sample.booster_thrust_n.unwrap_or(0.0))),
    };
    let surfaces = (0..6).map(|surface| surface_deg(flight, surface)).map(|[actual, _]| actual);
    let parachute = flight.truth(|sample| Some(sample.parachute_open_share));
    let held: Vec<Series> = surfaces.chain([thrust_n, on_booster, parachute]).collect();
    let (mut rows, mut next_s) = (Vec::new(), f64::NEG_INFINITY);
    for sample in flight.track.iter().filter(|sample| sample.state[2].is_finite()) {
        if sample.time_s < next_s {
            continue;
        }
        let burns = flight.ignition_s.is_some() && flight.has(Part::Burn, sample.time_s);
        next_s = sample.time_s + EACH_S[usize::from(!burns)];
        let at_s = flight.axis_s(sample.time_s);
        let attitude = sample.attitude.map_or([f64::NAN; 4], |it| [it.w, it.i, it.j, it.k]);
        let known = [at_s].into_iter().chain(sample.state[..3].iter().copied()).chain(attitude);
        let held = held.iter().map(|series| {
            let behind = series.partition_point(|(then_s, _)| *then_s <= at_s);
            behind.checked_sub(1).map_or(f64::NAN, |place| series[place].1)
        });
        // To a thousandth, as far as pictures show it.
        rows.push(known.chain(held).map(|value| json!((value * 1e3).round() / 1e3)).collect::<Value>());
    }
    let spans = flight.spans.iter().map(|span| json!([span.name, span.from, span.to]));
    let burn_s = flight.ignition_s.zip(flight.touchdown_s);
    let at_s = burn_s.map(|(from_s, to_s)| flight.axis_s(from_s + 0.4 * (to_s - from_s)));
    let shape = flight.pilot.as_ref().map(|pilot| {
        let (airframe, curve) = (&pilot.mission().airframe, &pilot.mission().motor_curve);
        let propellant_kg = curve.propellant_mass_kg();
        let dry = MassModel::new(&airframe.mass, propellant_kg).at(propellant_kg);
        let booster_m = pilot.mission().launched().map(|launch| launch.booster.length_m);
        let parts = json!([airframe.body, airframe.fins, airframe.gimbal, airframe.legs]);
        json!([parts, dry.cg_station_m, booster_m, curve.peak_thrust_n()])
    });
    json!({ "shape": shape, "phases": spans.collect::<Value>(), "at": at_s, "rows": rows }).to_string()
}
