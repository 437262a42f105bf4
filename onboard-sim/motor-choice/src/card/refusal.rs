//! Why there is no card, and the nearest vehicle that lands.

use core::fmt;

use flight::vehicle::mission::Mission;

use super::{CardError, Order, certified_window};
use crate::choice::{Choice, Limits, Refusal, StartHeight, choose, usual_limits};
use crate::frame::{Ballast, Frame};
use crate::source::Candidate;
use campaign::work::in_parallel;

/// Motors that are suggested.
const MOST: usize = 3;

/// No landing exists.
#[derive(Debug, thiserror::Error)]
pub struct NoLanding {
    motor: String,
    refusal: Refusal,
    bound: String,
    /// The mass at which the airframe lands best on the motor, and how much heavier it is without any ballast, kg.
    other_mass: Option<(Choice, f64)>,
    /// Motors on which it lands at this mass, with the mass and the scatter.
    other_motors: Vec<(String, f64, f64)>,
}

impl fmt::Display for NoLanding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.motor, self.refusal)?;
        write!(f, "\n  bound: {}", self.bound)?;
        match &self.other_mass {
            Some((choice, excess_kg)) => {
                let mass_kg = choice.mass.loaded_kg;
                write!(f, "\n  nearest mass on this motor: {mass_kg:.3} kg")?;
                write!(f, " from {:.0} m, scatter {:.2}", choice.start_height_m, choice.window.scatter)?;
                if *excess_kg > 0.0 {
                    write!(f, "; airframe and motor weigh {excess_kg:.3} kg more than that")?;
                }
            }
            None => write!(f, "\n  no mass lands on this motor")?,
        }
        if self.other_motors.is_empty() {
            return write!(f, "\n  none of the other motors lands either; --from gives more to choose from");
        }
        write!(f, "\n  nearest motors:")?;
        for (name, mass_kg, scatter) in &self.other_motors {
            write!(f, "\n    {name} at {mass_kg:.3} kg, scatter {scatter:.2}")?;
        }
        Ok(())
    }
}

pub(super) fn no_landing(
    order: &Order<'_>,
    frame: &Frame,
    limits: &Limits,
    refusal: Refusal,
) -> Result<NoLanding, CardError> {
    let curve = &order.motor.curve;
    let without_kg = frame.mass_kg() + curve.total_mass_kg();
    let other_mass = refusal.landing_kg.and_then(|landing_kg| {
        let limits = Limits { masses_kg: landing_kg, ..*limits };
        let choice = choose(order.mission, frame, curve, &limits).ok()?;
        let excess_kg = without_kg - choice.mass.loaded_kg;
        Some((choice, excess_kg))
    });
    let bound = bound(order, frame, limits);
    let other_motors = other_motors(order, frame, limits)?;
    let motor = format!("{} ({})", order.motor.name(), order.motor.origin);
    Ok(NoLanding { motor, refusal, bound, other_mass, other_motors })
}

/// What a controller that knows everything could do.
fn bound(order: &Order<'_>, frame: &Frame, limits: &Limits) -> String {
    /// Starts tried, as shares of the highest.
    const SHARES: [f64; 4] = [1.0, 0.7, 0.45, 0.25];
    let curve = &order.motor.curve;
    let mass_kg = limits.masses_kg[0];
    let ballast = Ballast {
        mass_kg: mass_kg - frame.mass_kg() - curve.total_mass_kg(),
        station_m: limits.ballast_station_m,
    };
    let mass = match frame.with(curve, ballast) {
        Ok(mass) => mass,
        Err(error) => return error.to_string(),
    };
    let heights_m: Vec<f64> = match limits.start {
        StartHeight::Exactly(height_m) => vec![height_m],
        StartHeight::AtMost(height_m) => SHARES.map(|share| share * height_m).to_vec(),
    };
    for height_m in &heights_m {
        let mut mission: Mission = order.mission.clone();
        mission.airframe.mass = mass;
        mission.motor_curve = curve.clone();
        mission.start.height_m = *height_m;
        if let Some(drop) = &mut mission.drop {
            drop.height_m = *height_m;
        }
        if let Some(window) = certified_window(&mission) {
            return format!(
                "a controller that knows everything lands {mass_kg:.3} kg from {height_m:.0} m if it commands the \
                 ignition at {:.1} to {:.1} m, but guidance, which keeps a reserve of tilt, finds no height for it",
                window.low_m, window.high_m
            );
        }
    }
    let from: Vec<String> = heights_m.iter().map(|height_m| format!("{height_m:.0}")).collect();
    format!(
        "not even a controller that knows everything and may light the motor at any height lands {mass_kg:.3} kg (starts \
         from {} m)",
        from.join(", ")
    )
}

/// The best other motors for this mass, or for this ballast if there is no mass.
fn other_motors(
    order: &Order<'_>,
    frame: &Frame,
    limits: &Limits,
) -> Result<Vec<(String, f64, f64)>, CardError> {
    let others: Vec<&Candidate> = order
        .others
        .iter()
        .filter_map(|found| found.as_ref().ok())
        .filter(|other| other.curve != order.motor.curve)
        .collect();
    let chosen = in_parallel(
        &others,
        order.jobs,
        |other| {
            let usual = usual_limits(order.mission, frame, &other.curve, order.ballast_kg);
            let masses_kg = order.mass_kg.map_or(usual.masses_kg, |mass_kg| [mass_kg; 2]);
            // With the least ballast it weighs more than this mass.
            if masses_kg[0] < usual.masses_kg[0] - 5e-4 {
                return None;
            }
            choose(order.mission, frame, &other.curve, &Limits { masses_kg, ..*limits }).ok()
        },
        &|_| {},
    )?;
    let mut landings: Vec<(String, f64, f64)> = others
        .iter()
        .zip(chosen)
        .filter_map(|(other, choice)| {
            let choice = choice?;
            Some((other.name(), choice.mass.loaded_kg, choice.window.scatter))
        })
        .collect();
    landings.sort_by(|one, two| two.2.total_cmp(&one.2));
    landings.truncate(MOST);
    Ok(landings)
}
