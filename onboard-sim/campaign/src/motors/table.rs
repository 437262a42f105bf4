//! The ranking as a table for a screen, as CSV with every motor, and the best motors as a picture.

use core::fmt::{self, Write};

use super::choice::Obstacle;
use super::ranking::{Flown, Landing, Ranked};
use crate::figure::{Bar, FigureError, bars_svg};

/// Up to this many motors without a landing are listed one by one if not all are asked for.
const FEW: usize = 20;

/// The ranking as text. Motors without a landing are listed with their reasons if `all` are asked for or there are few;
/// otherwise they are counted by reason.
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
            "{:>4}  {:<28} {:>8} {:>8} {:>7} {:>7} {:>13} {:>13} {:>7}  landed on its legs",
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
        )?;
    }
    let others = ranking.len() - landings.len();
    if others == 0 {
        return Ok(());
    }
    writeln!(out, "{}{others} of {} motors cannot be landed on:", gap(&landings), ranking.len())?;
    if all || others <= FEW {
        for ranked in ranking {
            if let Some((name, origin, reason)) = without_a_landing(ranked) {
                writeln!(out, "  {:<28} {reason} ({origin})", cut(&name))?;
            }
        }
        return Ok(());
    }
    for kind in KINDS {
        let count = ranking.iter().filter(|ranked| kind_of(ranked) == Some(kind)).count();
        if count > 0 {
            writeln!(out, "{count:>6} {kind}")?;
        }
    }
    writeln!(out, "  (--all lists each with its reason; so does the file of --csv)")
}

fn gap(landings: &[&Landing]) -> &'static str {
    if landings.is_empty() { "" } else { "\n" }
}

/// Landed flights with their interval, and the most frequent reason of the others.
fn rate(flown: &Flown) -> String {
    let legs = flown.legs;
    let others = flown.failure.as_ref().map_or_else(String::new, |(reason, _)| format!("; mostly {reason}"));
    format!(
        "{} of {} in {}: {:.0} % ({:.0} to {:.0}){others}",
        legs.count,
        legs.of,
        flown.set,
        100.0 * legs.share,
        100.0 * legs.low,
        100.0 * legs.high
    )
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

const KINDS: [&str; 6] = [
    "do not fit the tube or the body",
    "are never stronger than the weight",
    "have no landing at a mass that can be had",
    "need a higher start",
    "make no sound vehicle",
    "have a file or an entry that cannot be used",
];

fn kind_of(ranked: &Ranked) -> Option<&'static str> {
    let place = match ranked {
        Ranked::Lands(_) => return None,
        Ranked::Refused(_, refusal) => match refusal.obstacle {
            Obstacle::Diameter { .. } | Obstacle::Length { .. } => 0,
            Obstacle::Thrust { .. } => 1,
            Obstacle::Mass { .. } => 2,
            Obstacle::Height { .. } => 3,
            Obstacle::Unsound(_) => 4,
        },
        Ranked::Unusable(_) => 5,
    };
    Some(KINDS[place])
}

/// The columns of the CSV.
const COLUMNS: [&str; 26] = [
    "rank",
    "manufacturer",
    "motor",
    "origin",
    "in_production",
    "diameter_mm",
    "impulse_n_s",
    "lands",
    "reason",
    "loaded_kg",
    "ballast_kg",
    "loaded_cg_station_m",
    "landing_from_kg",
    "landing_to_kg",
    "start_height_m",
    "onset_height_m",
    "onset_low_m",
    "onset_high_m",
    "impulse_scale_low",
    "impulse_scale_high",
    "scatter",
    "flights",
    "landed_legs",
    "legs_low",
    "legs_high",
    "flown_in_set",
];

/// Every motor as CSV.
///
/// # Errors
/// The output cannot be written.
pub fn write_csv(ranking: &[Ranked], out: &mut impl std::io::Write) -> std::io::Result<()> {
    let mut table = csv::Writer::from_writer(out);
    table.write_record(COLUMNS)?;
    for (index, ranked) in ranking.iter().enumerate() {
        table.write_record(record(index + 1, ranked))?;
    }
    table.flush()
}

fn record(rank: usize, ranked: &Ranked) -> [String; 26] {
    let number = |value: f64| format!("{value}");
    let (candidate, reason) = match ranked {
        Ranked::Lands(landing) => (Some(&landing.candidate), String::new()),
        Ranked::Refused(candidate, refusal) => (Some(candidate), refusal.to_string()),
        Ranked::Unusable(unusable) => (None, unusable.reason.clone()),
    };
    let mut cells: [String; 26] = Default::default();
    if let Some(candidate) = candidate {
        let curve = &candidate.curve;
        curve.manufacturer().clone_into(&mut cells[1]);
        curve.name().clone_into(&mut cells[2]);
        cells[3].clone_from(&candidate.origin);
        cells[4] = candidate.in_production.map_or_else(String::new, |made| made.to_string());
        cells[5] = format!("{:.1}", 1e3 * curve.diameter_m());
        cells[6] = format!("{:.2}", curve.total_impulse_n_s());
    }
    if let Ranked::Unusable(unusable) = ranked {
        cells[2].clone_from(&unusable.name);
        cells[3].clone_from(&unusable.origin);
    }
    cells[7] = matches!(ranked, Ranked::Lands(_)).to_string();
    cells[8] = reason;
    if let Ranked::Refused(_, refusal) = ranked {
        [cells[12], cells[13]] =
            refusal.landing_kg.map_or_else(Default::default, |kg| kg.map(|kg| format!("{kg:.4}")));
    }
    let Ranked::Lands(Landing { choice, flown, .. }) = ranked else { return cells };
    let window = &choice.window;
    cells[0] = rank.to_string();
    let numbers = [
        choice.mass.loaded_kg,
        choice.ballast.mass_kg,
        choice.mass.loaded_cg_station_m,
        choice.landing_kg[0],
        choice.landing_kg[1],
        choice.start_height_m,
        window.onset_m,
        window.heights.low_m,
        window.heights.high_m,
        window.impulse_scales[0],
        window.impulse_scales[1],
        window.scatter,
    ];
    for (cell, value) in cells[9..].iter_mut().zip(numbers) {
        *cell = format!("{value:.4}");
    }
    if let Some(Flown { set, legs, .. }) = flown.as_deref() {
        cells[21] = legs.of.to_string();
        cells[22] = legs.count.to_string();
        [cells[23], cells[24]] = [number(legs.low), number(legs.high)];
        cells[25].clone_from(set);
    }
    cells
}

/// Motors in the picture.
const MOST: usize = 12;

/// The first motors of a ranking, as SVG: how far the thrust of each may be from the certified one. A bar spans the
/// impulses, over the certified one, that land from one ignition height.
///
/// # Errors
/// A bar is not finite.
pub fn svg(ranking: &[Ranked], mission: &str) -> Result<String, FigureError> {
    let bar = |(index, landing): (usize, &Landing)| {
        let Landing { candidate, choice, flown } = landing;
        let rate = flown.as_ref().map_or_else(String::new, |flown| {
            format!(", {} of {} land in {}", flown.legs.count, flown.legs.of, flown.set)
        });
        let (name, mass_kg) = (candidate.name(), choice.mass.loaded_kg);
        Bar {
            x: choice.window.impulse_scales,
            y: [-(index as f64) - 0.85, -(index as f64) - 0.15],
            kind: usize::from(flown.is_none()),
            text: format!("{} {name}, {mass_kg:.2} kg from {:.0} m{rate}", index + 1, choice.start_height_m),
        }
    };
    let bars: Vec<Bar> = landings(ranking).take(MOST).enumerate().map(bar).collect();
    let title = if bars.is_empty() {
        format!("{mission} lands on no motor")
    } else {
        format!("Motors that {mission} lands on")
    };
    let labels = ["impulse over the certified impulse that still lands", ""];
    bars_svg(&title, labels, &["flown", "not flown"], &bars, Some(("certified", 1.0)))
}
