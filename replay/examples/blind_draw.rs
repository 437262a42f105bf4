//! Draws flights with one random fault each, and counts how often the first finding names the
//! broken part.
//!
//! `cargo run --release -p replay --example blind_draw -- FLIGHTS SEED [all|healthy]`
//!
//! A flight that lands undamaged without a finding is counted apart: its fault had no effect that
//! anybody has to explain. With `all` every flight is printed, otherwise those with another first
//! finding. With `healthy` no part is broken, and the flights that stand with a finding are
//! counted.

use std::collections::BTreeMap;
use std::io::Write as _;

use anyhow::Context as _;
use flight::computer::findings::{Finding, Findings};
use flight::vehicle::mission::StartPoint;
use onboard_sim::run::{in_parallel, threads};
use onboard_sim::statistics::Share;
use sim::draw::Chance;
use sim::recipe::Recipe;
use sim::sortie::Sortie;

const MISSIONS: [&str; 3] = ["mk2", "mk3", "vlr"];

/// Moments at which a part in use during the complete descent breaks.
const ANY: &[&str] = &["apogee+0..1", "descent+0..2", "armed+0..1", "ignition", "powered+0..1"];
const FALL: &[&str] = &["apogee", "descent+0..2", "armed"];
const BURN: &[&str] = &["ignition", "powered+0..1"];
const START: &[&str] = &["0"];

/// A fault: its name, the range of its value's size, whether the value has a sign, when it happens,
/// and the words of which a finding that names the part has one; `$` is the name of the surface.
type Kind = (&'static str, Option<[f64; 2]>, bool, &'static [&'static str], &'static [&'static str]);

#[rustfmt::skip]
const KINDS: [Kind; 44] = [
    ("accelerometer-bias", Some([300.0, 1000.0]), true, ANY, &["accelerometer"]),
    ("accelerometer-spike", Some([1000.0, 10_000.0]), true, ANY, &["accelerometer"]),
    ("accelerometer-noise", Some([300.0, 2000.0]), false, ANY, &["accelerometer"]),
    ("accelerometer-stuck", None, false, ANY, &["accelerometer"]),
    ("accelerometer-nan", None, false, ANY, &["accelerometer"]),
    ("accelerometer-dead", None, false, ANY, &["accelerometer"]),
    ("gyro-bias", Some([5.0, 60.0]), true, ANY, &["gyro"]),
    ("gyro-noise", Some([10.0, 100.0]), false, ANY, &["gyro"]),
    ("gyro-stuck", None, false, ANY, &["gyro"]),
    ("gyro-nan", None, false, ANY, &["gyro"]),
    ("gyro-dead", None, false, ANY, &["gyro"]),
    ("barometer-out", None, false, ANY, &["barometer"]),
    ("barometer-stuck", None, false, ANY, &["barometer"]),
    ("barometer-step", Some([10.0, 50.0]), true, ANY, &["barometer"]),
    ("barometer-ramp", Some([3.0, 20.0]), true, FALL, &["barometer"]),
    ("barometer-noise", Some([5.0, 20.0]), false, ANY, &["barometer"]),
    ("barometer-scale", Some([0.5, 0.9]), false, FALL, &["barometer"]),
    ("gnss-out", None, false, FALL, &["GNSS"]),
    ("gnss-stuck", None, false, FALL, &["GNSS"]),
    ("gnss-step", Some([20.0, 100.0]), true, FALL, &["GNSS"]),
    ("gnss-ramp", Some([1.0, 5.0]), true, FALL, &["GNSS"]),
    ("gnss-noise", Some([5.0, 20.0]), false, FALL, &["GNSS"]),
    ("lidar-out", None, false, FALL, &["lidar"]),
    ("lidar-stuck", None, false, ANY, &["lidar"]),
    ("lidar-step", Some([1.0, 5.0]), true, ANY, &["lidar"]),
    ("lidar-blocked", Some([0.3, 3.0]), false, ANY, &["lidar"]),
    ("lidar-noise", Some([1.0, 3.0]), false, ANY, &["lidar"]),
    ("fin-stuck", Some([0.0, 3.0]), false, FALL, &["$"]),
    ("reversed", Some([1.0, 6.0]), false, START, &["$"]),
    ("swapped", Some([1.0, 6.0]), false, START, &["$"]),
    ("gimbal-stuck", None, false, BURN, &["gimbal"]),
    ("gimbal-jams", Some([2.0, 8.0]), true, BURN, &["gimbal"]),
    ("gimbal-slow", Some([0.05, 0.3]), false, BURN, &["gimbal"]),
    ("no-light", None, false, START, &["landing motor", "landing ignition"]),
    ("late-light", Some([0.4, 1.0]), false, START, &["landing motor", "landing ignition"]),
    ("weak-motor", Some([0.5, 0.85]), false, START, &["landing motor"]),
    ("early-burnout", Some([0.5, 2.5]), false, START, &["landing motor"]),
    ("ascent-weak", Some([0.4, 0.75]), false, START, &["ascent motor"]),
    ("ascent-no-light", None, false, START, &["ascent motor"]),
    ("separation-fails", None, false, START, &["booster"]),
    ("reboot", Some([0.1, 1.0]), false, ANY, &["flight computer"]),
    ("abort", None, false, ANY, &["abort of the crew"]),
    ("battery", None, false, START, &["battery"]),
    ("parachute-fails", None, false, START, &["parachute"]),
];

const SURFACES: [&str; 6] = ["gimbal pitch", "gimbal yaw", "fin 1", "fin 2", "fin 3", "fin 4"];

/// The kind of a flight without a fault.
const HEALTHY: &str = "healthy";

/// A drawn flight.
struct Drawn {
    mission: &'static str,
    fault: String,
    kind: &'static str,
    /// Names of which the first finding must have one.
    names: Vec<String>,
    seed: u64,
}

fn drawn(seed: u64) -> Drawn {
    let mut chance = Chance::of(seed, 0);
    let mut below = |count: usize| ((chance.unit() * count as f64) as usize).min(count - 1);
    let (kind, range, signed, moments, names) = KINDS[below(KINDS.len())];
    let pad_only = kind.starts_with("ascent") || kind == "separation-fails";
    let mission = if pad_only { ["mk2", "mk3"][below(2)] } else { MISSIONS[below(MISSIONS.len())] };
    let (when, sign) = (moments[below(moments.len())], if signed && below(2) == 1 { -1.0 } else { 1.0 });
    let (value, surfaces) = match (kind, range) {
        ("swapped", _) => {
            let one = below(6);
            let other = (one + 1 + below(5)) % 6;
            (format!(":{}{}", one + 1, other + 1), vec![one, other])
        }
        ("reversed", _) => {
            let one = below(6);
            (format!(":{}", one + 1), vec![one])
        }
        ("fin-stuck", _) => {
            let fin = below(4);
            (format!(":{fin}"), vec![fin + 2])
        }
        (_, Some([low, high])) => (format!(":{:.3}", sign * (low + chance.unit() * (high - low))), vec![]),
        (_, None) => (String::new(), vec![]),
    };
    let mut names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    if names[0] == "$" {
        names = surfaces.iter().map(|surface| SURFACES[*surface].to_owned()).collect();
    }
    Drawn { mission, fault: format!("{kind}{value}@{when}"), kind, names, seed }
}

/// Flies it: whether it stands undamaged, and the findings.
fn flown(drawn: &Drawn) -> anyhow::Result<(bool, Vec<Finding>)> {
    let recipe = Recipe::built_in(drawn.mission, "real")?;
    let recipe = if recipe.mission.launch.is_some() { recipe.starting_at(StartPoint::Pad)? } else { recipe };
    let is_battery = drawn.kind == "battery";
    let faults = if is_battery || drawn.kind == HEALTHY { Vec::new() } else { vec![drawn.fault.parse()?] };
    let mut flight = Sortie::new(&Recipe { seed: drawn.seed, faults, ..recipe }, 0)?;
    if is_battery {
        flight.set_battery(0.0);
    }
    let mut findings = Findings::default();
    while flight.goes_on() {
        if flight.step().is_some() {
            findings.note(flight.computer());
        }
    }
    Ok((flight.outcome().landing.stands, findings.found()))
}

/// Prints the healthy flights that have a finding, and how many of them stand.
fn print_healthy(draws: &[Drawn], results: Vec<anyhow::Result<(bool, Vec<Finding>)>>) -> anyhow::Result<()> {
    let (mut standing, mut false_findings) = (0, 0);
    let mut output = std::io::stdout().lock();
    for (Drawn { mission, seed, .. }, result) in draws.iter().zip(results) {
        let (stands, found) = result?;
        standing += u64::from(stands);
        false_findings += u64::from(stands && !found.is_empty());
        if !found.is_empty() {
            let words: Vec<String> = found.iter().map(Finding::words).collect();
            let verdict = if stands { "stands" } else { "damaged" };
            writeln!(output, "{mission} seed {seed} {verdict}: {}", words.join(" | "))?;
        }
    }
    let share = Share::new(false_findings, standing);
    writeln!(output, "healthy flights that stand with a finding: {share} (95 % interval)")?;
    Ok(())
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |place: usize| -> anyhow::Result<u64> {
        let text = arguments.get(place).context("arguments: FLIGHTS SEED [all]")?;
        text.parse().with_context(|| format!("{text}: not a number"))
    };
    let (flights, seed) = (number(0)?, number(1)?);
    let all = arguments.get(2).is_some_and(|mode| mode == "all");
    let is_healthy = arguments.get(2).is_some_and(|mode| mode == HEALTHY);
    let mut draws: Vec<Drawn> = (0..flights).map(|flight| drawn(seed + flight)).collect();
    if is_healthy {
        for drawn in &mut draws {
            (drawn.kind, drawn.fault) = (HEALTHY, HEALTHY.to_owned());
        }
    }
    let results = threads(None)?.install(|| in_parallel(&draws, flown, &|_| {}));
    if is_healthy {
        return print_healthy(&draws, results);
    }
    let (mut named, mut without_effect, mut silent) = (0, 0, 0);
    let mut by_kind: BTreeMap<&str, [u64; 2]> = BTreeMap::new();
    let mut output = std::io::stdout().lock();
    for (drawn, result) in draws.iter().zip(results) {
        let (stands, found) = result?;
        let words: Vec<String> = found.iter().map(Finding::words).collect();
        if stands && words.is_empty() {
            without_effect += 1;
            continue;
        }
        silent += u64::from(words.is_empty());
        let is_named =
            words.first().is_some_and(|first| drawn.names.iter().any(|name| first.contains(name.as_str())));
        named += u64::from(is_named);
        let counts = by_kind.entry(drawn.kind).or_default();
        counts[0] += u64::from(is_named);
        counts[1] += 1;
        if all || !is_named {
            let Drawn { mission, fault, seed, .. } = drawn;
            let verdict = if stands { "stands" } else { "damaged" };
            let mark = if is_named { "named" } else { "OTHER" };
            writeln!(output, "{mark} {mission} seed {seed} {fault} {verdict}: {}", words.join(" | "))?;
        }
    }
    for (kind, [named, of]) in by_kind {
        writeln!(output, "{kind:20} {named} of {of}")?;
    }
    let of = flights - without_effect;
    writeln!(
        output,
        "the first finding names the part in {} (95 % interval); {silent} have none; {without_effect} of {flights} had no effect",
        Share::new(named, of)
    )?;
    Ok(())
}
