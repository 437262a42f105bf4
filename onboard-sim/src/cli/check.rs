//! `onboard-sim check`: predicts whether an unbuilt vehicle will land, and what to change if not.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use clap::Args;
use flight::vehicle::mission::Mission;
use flight::vehicles::thrust_curve;
use onboard_sim::check::{Candidate, Verdict, built_in, check};
use onboard_sim::drawing::{self, Drawing, MK3};
use protocol::program::{Exit, in_range};
use serde::Deserialize;

use super::{WindsFile, answer, notify, on_threads, read, recipe, show_flights};

#[derive(Args)]
pub(crate) struct CheckArguments {
    /// Built-in mission or TOML file.
    #[arg(value_name = "NAME|FILE")]
    mission: String,
    /// Motors to propose: an .eng or .rse file, a folder of them, or the .json of the npm package
    /// thrustcurve-db; may be repeated. The built-in motors if not given.
    #[arg(long, value_name = "DIR|FILE")]
    from: Vec<PathBuf>,
    /// Flights that are flown as a check of the other rows; 0 leaves them out.
    #[arg(long, default_value_t = 100, value_name = "N", value_parser = in_range(0..=10_000_u64))]
    flights: u64,
    /// Built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh, wild) or
    /// TOML file.
    #[arg(long, default_value = "field", value_name = "NAME|FILE")]
    dispersion: String,
    #[command(flatten)]
    winds_aloft: WindsFile,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1, value_parser = in_range(0..=u64::MAX))]
    seed: u64,
    /// Flights at the same time; the results do not depend on it.
    #[arg(long, value_name = "N", value_parser = in_range(1..=usize::MAX))]
    jobs: Option<usize>,
    /// Draw the vehicle to scale into this file, and name the parts that overlap.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Parts to draw, CSV. Without a list mk3's own are drawn in mk3, and the mission's in others.
    #[arg(long, value_name = "FILE", requires = "svg")]
    parts: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long, conflicts_with = "svg")]
    json: bool,
}

pub(crate) fn run(arguments: &CheckArguments) -> anyhow::Result<Exit> {
    let recipe = recipe(&arguments.mission, None, &arguments.dispersion, arguments.seed)?;
    let recipe = arguments.winds_aloft.applied(recipe)?;
    let mut motors = if arguments.from.is_empty() { built_in() } else { Vec::new() };
    arguments.from.iter().try_for_each(|path| read_motors(path, &mut motors))?;
    let (flights, show) = (arguments.flights, show_flights());
    let progress = |done| show(done, flights as usize);
    let page = on_threads(arguments.jobs, || Ok(check(&recipe, &motors, flights, &progress)?))?;
    write!(std::io::stdout().lock(), "{}", answer(arguments.json.then(|| page.json()), &page))?;
    let fits = arguments.svg.as_deref().map_or(Ok(true), |file| draw(arguments, &recipe.mission, file))?;
    Ok(Exit::of(fits && page.verdict() != Verdict::No))
}

/// Draws the vehicle; returns whether no two parts overlap.
fn draw(arguments: &CheckArguments, mission: &Mission, file: &Path) -> anyhow::Result<bool> {
    let list = match &arguments.parts {
        Some(parts) => drawing::read(&read(parts)?).with_context(|| parts.display().to_string())?,
        None if arguments.mission == "mk3" => drawing::read(MK3)?,
        None => Vec::new(),
    };
    let drawing = Drawing::new(mission, list);
    let overlaps = drawing.overlaps();
    for [one, other] in &overlaps {
        writeln!(std::io::stdout().lock(), "no    drawing    {one} and {other} overlap")?;
    }
    std::fs::write(file, drawing.svg().0).with_context(|| file.display().to_string())?;
    Ok(overlaps.is_empty())
}

/// Reads a motor file, the files of a folder in the order of their names, or a list. Reports
/// unusable motors with the reason.
fn read_motors(path: &Path, motors: &mut Vec<Candidate>) -> anyhow::Result<()> {
    const ENDINGS: [&str; 3] = ["eng", "rse", "json"];
    let origin = path.display();
    let is = |path: &Path, ending: &str| path.extension().is_some_and(|its| its.eq_ignore_ascii_case(ending));
    if path.is_dir() {
        let entries = std::fs::read_dir(path).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
        let entries = entries.with_context(|| format!("{origin}: cannot be read"))?;
        let mut files: Vec<PathBuf> = entries.iter().map(std::fs::DirEntry::path).collect();
        files.retain(|file| ENDINGS.iter().any(|ending| is(file, ending)) && file.is_file());
        files.sort();
        ensure!(
            !files.is_empty(),
            "{origin} holds no file that ends in .eng, .rse or .json; folders in it are not looked into"
        );
        return files.iter().try_for_each(|file| read_motors(file, motors));
    }
    let text = read(path)?;
    let mut take = |name: &str, motor: anyhow::Result<Candidate>| match motor {
        Ok(motor) => motors.push(motor),
        Err(reason) => notify(&format!("{name} cannot be used: {origin}: {reason:#}")),
    };
    if is(path, "json") {
        let list: Vec<serde_json::Value> = serde_json::from_str(&text).with_context(|| {
            format!(
                "{origin}: not a list of motors: a JSON array of objects, as in the npm package thrustcurve-db, is accepted"
            )
        })?;
        anyhow::ensure!(!list.is_empty(), "{origin}: the list holds no motor");
        for entry in list {
            let name = entry["designation"].as_str().unwrap_or("an entry").to_owned();
            take(&name, of_entry(entry));
        }
        return Ok(());
    }
    let text = text.trim_start_matches('\u{feff}').trim_end();
    let curve = thrust_curve::from_file_text(&origin.to_string(), text);
    // A mission takes a text without a line break for a name.
    let motor = curve.map(|curve| Candidate { motor: format!("{text}\n"), curve, in_production: true });
    take(&path.file_stem().unwrap_or_default().to_string_lossy(), motor.map_err(Into::into));
    Ok(())
}

/// The parsed fields of an entry of the list: grams and millimetres, and samples in seconds and
/// newtons.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Entry {
    designation: String,
    #[serde(default)]
    manufacturer_abbrev: String,
    diameter: f64,
    length: f64,
    prop_weight_g: f64,
    total_weight_g: f64,
    samples: Vec<[f64; 2]>,
    availability: Option<String>,
}

/// A motor from the RASP file of an entry of the list.
fn of_entry(entry: serde_json::Value) -> anyhow::Result<Candidate> {
    let entry: Entry = serde_json::from_value(entry)?;
    let name = entry.designation.replace(char::is_whitespace, "_");
    let [propellant_kg, total_kg] = [entry.prop_weight_g, entry.total_weight_g].map(|mass_g| mass_g / 1000.0);
    let points = entry.samples.iter().map(|[time_s, thrust_n]| format!("{time_s:?} {thrust_n:?}\n"));
    let motor = format!(
        "{name} {:?} {:?} P {propellant_kg:?} {total_kg:?} {}\n{}",
        entry.diameter,
        entry.length,
        entry.manufacturer_abbrev,
        points.collect::<String>()
    );
    let curve = thrust_curve::from_rasp(&motor)?;
    Ok(Candidate { motor, curve, in_production: entry.availability.as_deref() != Some("OOP") })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An Estes D12 as thrustcurve-db 3.0.4 has it (<https://www.npmjs.com/package/thrustcurve-db>,
    /// ISC licence).
    const D12: &str = r#"{ "availability": "regular", "designation": "D12", "diameter": 24, "length": 70, "manufacturerAbbrev": "Estes",
        "propWeightG": 21.1, "totalWeightG": 44, "samples": [
        [0, 0], [0.049, 2.569], [0.116, 9.369], [0.184, 17.27], [0.237, 24.26], [0.282, 29.73], [0.297, 27.01], [0.311, 22.59],
        [0.322, 17.99], [0.348, 14.13], [0.386, 12.1], [0.442, 10.81], [0.546, 9.876], [0.718, 9.306], [0.879, 9.105], [1.066, 8.901],
        [1.257, 8.698], [1.436, 8.31], [1.59, 8.294], [1.612, 4.613], [1.65, 0]] }"#;

    fn read_entry(text: &str) -> Result<Candidate, String> {
        of_entry(serde_json::from_str(text).unwrap()).map_err(|error| error.to_string())
    }

    /// As thrustcurve.org states it: 24 x 70 mm, 21.1 g of propellant in 44 g, 16.84 N s.
    #[test]
    fn val_thrustcurve_org_an_entry_is_the_motor_of_the_list() {
        let Candidate { motor, curve, in_production } = read_entry(D12).unwrap();
        assert!(in_production && motor.starts_with("D12 24.0 70.0 P 0.0211 0.044 Estes\n"), "{motor}");
        assert!((curve.total_impulse_n_s() / 16.84 - 1.0).abs() < 0.01, "{}", curve.total_impulse_n_s());
    }

    #[test]
    fn a_fractional_entry_is_refused_with_the_value() {
        for (from, to, reason) in [
            ("\"totalWeightG\": 44, ", "", "missing field `totalWeightG`"),
            (
                "[1.612, 4.613]",
                "[1.59, 4.613]",
                "line 21: time is '1.59'; times must increase from point to point",
            ),
            ("\"D12\"", "3", "invalid type: integer `3`, expected a string"),
        ] {
            assert_eq!(read_entry(&D12.replace(from, to)).unwrap_err(), reason);
        }
    }
}
