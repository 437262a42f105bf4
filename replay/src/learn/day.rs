//! The mission and the set of dispersions of the next day, which `onboard-sim campaign` flies: means go into the mission,
//! deviations into the set.

use std::fmt::Write as _;

use flight::vehicle::mission::Mission;
use flight::vehicle::thrust_curve::{MotorData, ThrustCurve, ThrustPoint};
use sim::dispersion::Dispersion;
use world::truth::Truth;

use super::posterior::Lot;
use super::{Ask, LearnError};
use crate::fit::Pooled;
use crate::settings::{Setting, mission_toml_with, mission_with};

/// The files of the day.
#[derive(Debug, Clone)]
pub struct Day {
    pub mission: Mission,
    pub mission_toml: String,
    pub dispersion: Dispersion,
    pub dispersion_toml: String,
}

impl Day {
    pub(super) fn of(
        ask: &Ask<'_>,
        mission: &Mission,
        lots: &[Lot],
        airframe: &[Pooled],
        wind_m_s: [f64; 2],
        sources: &[String],
    ) -> Result<Self, LearnError> {
        let [thrust, burn_time, delay] = lots else {
            return Err(LearnError::Day("a lot has thrust, burn time and delay".to_owned()));
        };
        let curve = scaled(&mission.motor_curve, thrust.mean, burn_time.mean)
            .ok_or_else(|| LearnError::Day("the lot's mean motor has no thrust".to_owned()))?;
        let drag = airframe.iter().find(|pooled| pooled.mean.name == "drag_scale").map(|pooled| &pooled.mean);
        let drag_scale = drag.map_or(1.0, |mean| mean.value);
        let (body, fins) = (&mission.airframe.body, &mission.airframe.fins);
        let float = |value: f64| toml::Value::Float(value);
        let set = |path: &str, value: toml::Value| Setting { path: path.to_owned(), value, at_s: None };
        let settings = [
            set("airframe.motor", toml::Value::String(vehicles::thrust_curve::to_rasp(&curve))),
            set("airframe.body.axial_drag_coefficient", float(body.axial_drag_coefficient * drag_scale)),
            set(
                "airframe.body.crossflow_drag_coefficient",
                float(body.crossflow_drag_coefficient * drag_scale),
            ),
            set("airframe.fins.drag_coefficient", float(fins.drag_coefficient * drag_scale)),
            set("airframe.fins.lift_coefficient", float(fins.lift_coefficient * drag_scale)),
            set("ignition.delay_s", float(delay.mean)),
            set("motor.impulse_sigma", float(thrust.next_sigma())),
            set("motor.burn_time_sigma", float(burn_time.next_sigma())),
        ];
        let head = head("The mission", ask, sources);
        let mission_toml = head + &mission_toml_with(ask.mission_toml, &settings)?;
        let mission = mission_with(&mission_toml, &[])?;
        let dispersion_toml =
            dispersion_toml(ask, &mission, lots, drag.map(|mean| mean.sigma / mean.value), wind_m_s, sources)
                .map_err(LearnError::Day)?;
        // Read as the campaign reads it.
        let dispersion = Dispersion::from_toml(&dispersion_toml, "the day's set")?;
        Ok(Self { mission, mission_toml, dispersion, dispersion_toml })
    }
}

fn head(what: &str, ask: &Ask<'_>, sources: &[String]) -> String {
    let mut head =
        format!("# {what} of the next flight, after {} with the prior {}:\n", sources.len(), ask.set.0);
    for source in sources {
        // Writing to a String cannot fail.
        let _ = writeln!(head, "# {}", protocol::text::printable(source.as_bytes()));
    }
    head
}

fn dispersion_toml(
    ask: &Ask<'_>,
    mission: &Mission,
    lots: &[Lot],
    drag_share: Option<f64>,
    wind_m_s: [f64; 2],
    sources: &[String],
) -> Result<String, String> {
    let mut table: toml::Table = ask.set.1.parse().map_err(|error| format!("{}: {error}", ask.set.0))?;
    let mut set = |key: &str, value: f64| table.insert(key.to_owned(), toml::Value::Float(value));
    let [thrust, burn_time, delay] = lots else { return Err("a lot has three properties".to_owned()) };
    // The thrust is per mass and has the mass's scatter in it. A set has normal deviations where the next burn has a Student
    // t of the same variance.
    set("impulse_share", thrust.next_sigma() / thrust.mean);
    set("impulse_even_share", 0.0);
    set("mass_share", 0.0);
    set("burn_time_share", burn_time.next_sigma() / burn_time.mean);
    // A set's delays scatter around the nominal one; a lot with another mean gets its distance as scatter, too.
    let apart_s = delay.mean - Truth::default().ignition_delay_s;
    let scatter_scale = mission.airframe.igniter.scatter_scale.max(1e-3);
    set("ignition_delay_s", libm::hypot(delay.next_sigma(), apart_s) / scatter_scale);
    set("ignition_delay_even_s", 0.0);
    if let Some(drag_share) = drag_share {
        set("drag_share", drag_share);
    }
    table.insert("wind_m_s".to_owned(), toml::Value::Array(wind_m_s.map(toml::Value::Float).to_vec()));
    let text = toml::to_string(&table).map_err(|error| error.to_string())?;
    Ok(head("The dispersions", ask, sources) + &text)
}

/// A motor with another impulse in another time.
fn scaled(curve: &ThrustCurve, impulse: f64, burn_time: f64) -> Option<ThrustCurve> {
    let points = curve.points().iter().map(|point| ThrustPoint {
        time_s: point.time_s * burn_time,
        thrust_n: point.thrust_n * impulse / burn_time,
    });
    ThrustCurve::new(MotorData {
        name: curve.name().to_owned(),
        manufacturer: curve.manufacturer().to_owned(),
        diameter_m: curve.diameter_m(),
        length_m: curve.length_m(),
        propellant_mass_kg: curve.propellant_mass_kg(),
        total_mass_kg: curve.total_mass_kg(),
        points: points.collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_hand_a_scaled_motor() {
        let curve = vehicles::thrust_curve::from_rasp("T40 38 200 P 0.12 0.3 M\n1 40\n3 40\n4 0\n").unwrap();
        let found = scaled(&curve, 1.1, 2.0).unwrap();
        assert!(
            (found.total_impulse_n_s() - 132.0).abs() < 1e-9 && (found.burn_time_s() - 8.0).abs() < 1e-12
        );
        assert!((found.thrust_at_n(4.0) - 22.0).abs() < 1e-12);
        assert!((found.propellant_mass_kg() - 0.12).abs() < 1e-12);
    }
}
