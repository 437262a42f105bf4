//! The ranking as a table for a screen, and as CSV with every motor.

use core::fmt::{self, Write};

use serde::Serialize;

use super::ranking::{Flown, Landing, Ranked};
use super::source::Candidate;

/// Motors without a landing that are listed if not all are asked for.
const FEW: usize = 20;

/// The ranking as text. Motors without a landing are listed with their reasons, all of them or the first few.
pub fn text(ranking: &[Ranked], all: bool) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_text(ranking, all, &mut out);
    out
}

fn write_text(ranking: &[Ranked], all: bool, out: &mut String) -> fmt::Result {
    let landings: Vec<&Landing> = landings(ranking).collect();
    if !landings.is_empty() {
        writeln!(
            out,
            "{:>4}  {:<28} {:>8} {:>8} {:>7} {:>7} {:>13} {:>13} {:>7}  stands undamaged",
            "rank", "motor", "mass kg", "ballast", "from m", "lit m", "lands from m", "thrust x", "scatter"
        )?;
    }
    for (index, landing) in landings.iter().enumerate() {
        let (choice, window) = (&landing.choice, &landing.choice.window);
        writeln!(
            out,
            "{:>4}  {:<28} {:>8.3} {:>+8.3} {:>7.0} {:>7.1} {:>13} {:>13} {:>7.2}  {}",
            index + 1,
            cut(&landing.candidate.name()),
            choice.mass.loaded_kg,
            choice.ballast.mass_kg,
            choice.start_height_m,
            window.onset_m,
            format!("{:.0} to {:.0}", window.heights.low_m, window.heights.high_m),
            format!("{:.3} to {:.3}", window.impulse_scales[0], window.impulse_scales[1]),
            window.scatter,
            landing.flown.as_deref().map_or_else(|| "not flown".to_owned(), rate)
                + if landing.candidate.in_production == Some(false) { "; OUT OF PRODUCTION" } else { "" }
        )?;
    }
    let others = ranking.len() - landings.len();
    if others == 0 {
        return Ok(());
    }
    writeln!(out, "{}{others} of {} motors cannot be landed on:", gap(&landings), ranking.len())?;
    let shown = if all { others } else { FEW };
    for (name, origin, reason) in ranking.iter().filter_map(without_a_landing).take(shown) {
        writeln!(out, "  {:<28} {reason} ({origin})", cut(&name))?;
    }
    if shown >= others {
        return Ok(());
    }
    writeln!(out, "  (--all lists each with its reason; so does the file of --csv)")
}

fn gap(landings: &[&Landing]) -> &'static str {
    if landings.is_empty() { "" } else { "\n" }
}

/// Landed flights with their interval, and the most frequent reason of the others.
fn rate(flown: &Flown) -> String {
    let others = flown.failure.as_ref().map_or_else(String::new, |(reason, _)| format!("; mostly {reason}"));
    format!("{} in {}{others}", flown.landings, flown.set)
}

fn cut(name: &str) -> String {
    name.chars().take(28).collect()
}

fn landings(ranking: &[Ranked]) -> impl Iterator<Item = &Landing> {
    ranking.iter().filter_map(|ranked| match ranked {
        Ranked::Lands(landing) => Some(landing),
        _ => None,
    })
}

/// Name, origin and reason of a motor without a landing.
fn without_a_landing(ranked: &Ranked) -> Option<(String, &str, String)> {
    match ranked {
        Ranked::Lands(_) => None,
        Ranked::Refused(candidate, refusal) => {
            Some((candidate.name(), &candidate.origin, refusal.to_string()))
        }
        Ranked::Unusable(unusable) => {
            Some((unusable.name.clone(), &unusable.origin, unusable.reason.clone()))
        }
    }
}

/// A row of the CSV; what a motor does not have is empty.
#[derive(Debug, Default, Serialize)]
struct CsvRow<'a> {
    rank: Option<usize>,
    manufacturer: &'a str,
    motor: &'a str,
    origin: &'a str,
    in_production: Option<bool>,
    diameter_mm: Option<f64>,
    impulse_n_s: Option<f64>,
    lands: bool,
    reason: String,
    loaded_kg: Option<f64>,
    ballast_kg: Option<f64>,
    loaded_cg_station_m: Option<f64>,
    landing_from_kg: Option<f64>,
    landing_to_kg: Option<f64>,
    start_height_m: Option<f64>,
    onset_height_m: Option<f64>,
    onset_low_m: Option<f64>,
    onset_high_m: Option<f64>,
    impulse_scale_low: Option<f64>,
    impulse_scale_high: Option<f64>,
    scatter: Option<f64>,
    flights: Option<u64>,
    stands: Option<u64>,
    stands_low: Option<f64>,
    stands_high: Option<f64>,
    envelope: Option<u64>,
    flown_in_set: Option<&'a str>,
}

impl<'a> CsvRow<'a> {
    fn of(place: usize, ranked: &'a Ranked) -> Self {
        match ranked {
            Ranked::Unusable(unusable) => Self {
                motor: &unusable.name,
                origin: &unusable.origin,
                reason: unusable.reason.clone(),
                ..Self::default()
            },
            Ranked::Refused(candidate, refusal) => Self {
                reason: refusal.to_string(),
                landing_from_kg: refusal.landing_kg.map(|kg| kg[0]),
                landing_to_kg: refusal.landing_kg.map(|kg| kg[1]),
                ..Self::of_motor(candidate)
            },
            Ranked::Lands(Landing { candidate, choice, flown }) => {
                let window = &choice.window;
                let landings = flown.as_deref().map(|flown| flown.landings);
                let stands = landings.map(|landings| landings.stands);
                Self {
                    rank: Some(place + 1),
                    lands: true,
                    loaded_kg: Some(choice.mass.loaded_kg),
                    ballast_kg: Some(choice.ballast.mass_kg),
                    loaded_cg_station_m: Some(choice.mass.loaded_cg_station_m),
                    landing_from_kg: Some(choice.landing_kg[0]),
                    landing_to_kg: Some(choice.landing_kg[1]),
                    start_height_m: Some(choice.start_height_m),
                    onset_height_m: Some(window.onset_m),
                    onset_low_m: Some(window.heights.low_m),
                    onset_high_m: Some(window.heights.high_m),
                    impulse_scale_low: Some(window.impulse_scales[0]),
                    impulse_scale_high: Some(window.impulse_scales[1]),
                    scatter: Some(window.scatter),
                    flights: stands.map(|stands| stands.of),
                    stands: stands.map(|stands| stands.count),
                    stands_low: stands.map(|stands| stands.low),
                    stands_high: stands.map(|stands| stands.high),
                    envelope: landings.map(|landings| landings.envelope.count),
                    flown_in_set: flown.as_deref().map(|flown| flown.set.as_str()),
                    ..Self::of_motor(candidate)
                }
            }
        }
    }

    fn of_motor(candidate: &'a Candidate) -> Self {
        let Candidate { origin, curve, in_production, .. } = candidate;
        Self {
            manufacturer: curve.manufacturer(),
            motor: curve.name(),
            origin,
            in_production: *in_production,
            diameter_mm: Some(1e3 * curve.diameter_m()),
            impulse_n_s: Some(curve.total_impulse_n_s()),
            ..Self::default()
        }
    }
}

/// Every motor as CSV.
///
/// # Errors
/// The output cannot be written.
pub fn write_csv(ranking: &[Ranked], out: &mut impl std::io::Write) -> std::io::Result<()> {
    let mut table = csv::Writer::from_writer(out);
    for (place, ranked) in ranking.iter().enumerate() {
        table.serialize(CsvRow::of(place, ranked))?;
    }
    table.flush()
}
