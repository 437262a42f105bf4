//! Where motors come from: the built-in ones, motor files, folders of them, and the list of the npm package
//! `thrustcurve-db` (<https://github.com/broofa/thrustcurve-db>), a copy of thrustcurve.org as one JSON array. Masses are in
//! grams, sizes in millimetres, samples in seconds and newtons in it.

use std::fs;
use std::path::{Path, PathBuf};

use flight::vehicle::thrust_curve::{MotorData, ThrustCurve, ThrustPoint};
use flight::vehicles::thrust_curve::{ThrustCurveError, from_rasp, to_rasp};
use serde::Deserialize;
use serde_json::value::RawValue;

/// A motor to choose from.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// What a mission's `airframe.motor` says: the name of a built-in motor, or the text of its file.
    pub motor: String,
    /// Its data.
    pub curve: ThrustCurve,
    /// Whether its maker still makes it, as far as the source says.
    pub in_production: Option<bool>,
}

impl Candidate {
    /// Maker and name.
    pub fn name(&self) -> String {
        format!("{} {}", self.curve.manufacturer(), self.curve.name()).trim().to_owned()
    }
}

/// A motor that cannot be used, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unusable {
    /// Its name, as far as it is known.
    pub name: String,
    /// The file, with the line in a list.
    pub origin: String,
    /// What is wrong, with the value and what would be accepted.
    pub reason: String,
}

/// A motor of a source.
pub type Found = Result<Candidate, Unusable>;

/// Why a source has no motors to choose from.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// A file or folder cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    /// A folder holds no motor file.
    #[error("{} holds no file that ends in .eng, .rse or .json; folders in it are not looked into", .0.display())]
    Empty(PathBuf),
    /// A list is not one.
    #[error("{}", path.display())]
    List {
        path: PathBuf,
        #[source]
        source: ListError,
    },
}

/// The endings of the files that are read from a folder.
const ENDINGS: [&str; 3] = ["eng", "rse", "json"];

/// The motors that come with the program.
pub fn built_in() -> Vec<Found> {
    let found = flight::vehicles::motors::names().map(|name| match flight::vehicles::motors::builtin(name) {
        Ok(curve) => Ok(Candidate {
            motor: name.to_owned(),
            curve,
            in_production: flight::vehicles::motors::status(name).map(|(in_production, _)| in_production),
        }),
        Err(error) => {
            Err(Unusable { name: name.to_owned(), origin: "built in".to_owned(), reason: error.to_string() })
        }
    });
    found.collect()
}

/// The motors of a motor file (`.eng`, `.rse`), a list (`.json`, of the npm package `thrustcurve-db`), or a folder of
/// these in the order of their names. A broken file in it is a motor that cannot be used.
///
/// # Errors
/// The path cannot be read, or a folder holds no such file, or a list is not one.
pub fn read(path: &Path) -> Result<Vec<Found>, SourceError> {
    if !path.is_dir() {
        return read_file(path);
    }
    let unreadable = |source| SourceError::Read { path: path.to_owned(), source };
    let mut files = fs::read_dir(path)
        .and_then(|entries| {
            entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>()
        })
        .map_err(unreadable)?;
    files.retain(|file| ENDINGS.iter().any(|ending| has_ending(file, ending)) && file.is_file());
    files.sort();
    if files.is_empty() {
        return Err(SourceError::Empty(path.to_owned()));
    }
    let mut found = Vec::new();
    for file in files {
        found.extend(read_file(&file)?);
    }
    Ok(found)
}

fn has_ending(file: &Path, wanted: &str) -> bool {
    file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(wanted))
}

fn read_file(path: &Path) -> Result<Vec<Found>, SourceError> {
    let bytes = fs::read(path).map_err(|source| SourceError::Read { path: path.to_owned(), source })?;
    // Old files have makers' names in Latin-1. Only names and comments can be touched by this.
    let text = String::from_utf8_lossy(&bytes);
    if has_ending(path, "json") {
        return parse(&text, &path.display().to_string())
            .map_err(|source| SourceError::List { path: path.to_owned(), source });
    }
    Ok(vec![one(path, &text)])
}

/// The motor of a motor file's text.
fn one(path: &Path, text: &str) -> Found {
    let origin = path.display().to_string();
    let text = text.trim_start_matches('\u{feff}');
    let curve = flight::vehicles::thrust_curve::from_file_text(&origin, text).map_err(|error| Unusable {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        origin,
        reason: error.to_string(),
    })?;
    // A mission takes a text without a line break for a name.
    let motor = format!("{}\n", text.trim_end());
    Ok(Candidate { motor, curve, in_production: None })
}

/// Why a text is not a list of motors.
#[derive(Debug, thiserror::Error)]
pub enum ListError {
    /// Not a JSON array.
    #[error(
        "not a list of motors: a JSON array of objects, as in the npm package thrustcurve-db, is accepted"
    )]
    Json(#[from] serde_json::Error),
    /// The array is empty.
    #[error("the list holds no motor")]
    Empty,
}

/// What is read of an entry.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Entry {
    designation: String,
    #[serde(default)]
    manufacturer_abbrev: String,
    diameter: f64,
    length: f64,
    prop_weight_g: Option<f64>,
    total_weight_g: Option<f64>,
    #[serde(default)]
    samples: Vec<[f64; 2]>,
    availability: Option<String>,
}

/// The motors of a list; `origin` names its file. An entry that is no motor, or not a whole one, cannot be used.
///
/// # Errors
/// The text is no JSON array, or an empty one.
pub fn parse(text: &str, origin: &str) -> Result<Vec<Found>, ListError> {
    let entries: Vec<&RawValue> = serde_json::from_str(text)?;
    if entries.is_empty() {
        return Err(ListError::Empty);
    }
    let (mut line, mut counted) = (1, 0);
    let found = entries.into_iter().map(|entry| {
        // Entries follow each other in the text.
        let begins = entry.get().as_ptr() as usize - text.as_ptr() as usize;
        line += text[counted..begins].matches('\n').count();
        counted = begins;
        of_entry(entry.get(), &format!("{origin}:{line}"))
    });
    Ok(found.collect())
}

fn of_entry(text: &str, origin: &str) -> Found {
    let unusable =
        |name: &str, reason: String| Unusable { name: name.to_owned(), origin: origin.to_owned(), reason };
    let entry: Entry = serde_json::from_str(text).map_err(|error| unusable("", in_words(&error)))?;
    let name = format!("{} {}", entry.manufacturer_abbrev, entry.designation).trim().to_owned();
    let candidate = motor(&entry).map_err(|reason| unusable(&name, reason))?;
    // Everything is flown as a mission's text says it.
    let motor = to_rasp(&candidate);
    let curve = from_rasp(&motor).map_err(|error| unusable(&name, without_line(&error)))?;
    let in_production = entry.availability.map(|availability| availability != "OOP");
    Ok(Candidate { motor, curve, in_production })
}

fn motor(entry: &Entry) -> Result<ThrustCurve, String> {
    let kg = |key: &str, mass_g: Option<f64>| {
        let mass_g = mass_g.ok_or_else(|| format!("{key} is missing; a mass in g is accepted"))?;
        if mass_g.is_finite() && mass_g > 0.0 {
            Ok(mass_g / 1000.0)
        } else {
            Err(format!("{key} is {mass_g}; a mass in g above 0 is accepted"))
        }
    };
    let propellant_mass_kg = kg("propWeightG", entry.prop_weight_g)?;
    let total_mass_kg = kg("totalWeightG", entry.total_weight_g)?;
    if entry.samples.is_empty() {
        return Err(
            "samples is missing or empty; points of time in s and thrust in N are accepted".to_owned()
        );
    }
    let mut points: Vec<ThrustPoint> = Vec::with_capacity(entry.samples.len() + 1);
    for (place, [time_s, thrust_n]) in entry.samples.iter().copied().enumerate() {
        let bad = |what: &str, value: f64, required: &str| {
            Err(format!("samples[{place}]: {what} is {value}; {required}"))
        };
        if !(time_s.is_finite() && time_s >= 0.0) {
            return bad("time", time_s, "a number of seconds, 0 or more, is accepted");
        }
        if !(thrust_n.is_finite() && thrust_n >= 0.0) {
            return bad("thrust", thrust_n, "a number of newtons, 0 or more, is accepted");
        }
        if points.last().is_some_and(|last| time_s <= last.time_s) {
            return bad("time", time_s, "times must increase from point to point");
        }
        if points.is_empty() && time_s > 0.0 {
            points.push(ThrustPoint { time_s: 0.0, thrust_n: 0.0 });
        }
        points.push(ThrustPoint { time_s, thrust_n });
    }
    let data = MotorData {
        name: entry.designation.clone(),
        manufacturer: entry.manufacturer_abbrev.clone(),
        diameter_m: entry.diameter / 1000.0,
        length_m: entry.length / 1000.0,
        propellant_mass_kg,
        total_mass_kg,
        points,
    };
    ThrustCurve::new(data).ok_or_else(|| "samples: a motor has at least one point with thrust".to_owned())
}

/// The parser's words without its place in the entry; the origin has the entry's line.
fn in_words(error: &serde_json::Error) -> String {
    let words = error.to_string();
    words.rsplit_once(" at line ").map_or(words.clone(), |(what, _)| what.to_owned())
}

/// A line of the intermediate text is none of the list.
fn without_line(error: &ThrustCurveError) -> String {
    match error {
        ThrustCurveError::BadField { field, found, required, .. } => {
            format!("{field} is '{found}'; {required}")
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three entries of thrustcurve-db 3.0.4 (<https://www.npmjs.com/package/thrustcurve-db>, ISC licence), unchanged: an Estes
    /// D12, a Cesaroni 129G79 with a time twice, and an Ellis Mountain H50 without its total mass.
    const EXCERPT: &str = include_str!("../../tests/onboard/thrustcurve-db-excerpt.json");

    #[test]
    fn val_thrustcurve_org_an_entry_is_the_motor_of_the_list() {
        let found = parse(EXCERPT, "db.json").unwrap();
        let motor = found[0].as_ref().unwrap();
        assert_eq!((motor.name().as_str(), motor.in_production), ("Estes D12", Some(true)));
        // As thrustcurve.org states them: 24 x 70 mm, 21.1 g of propellant in 44 g, 16.84 N s.
        let curve = &motor.curve;
        for (found, stated) in [
            (curve.diameter_m(), 0.024),
            (curve.length_m(), 0.070),
            (curve.propellant_mass_kg(), 0.0211),
            (curve.total_mass_kg(), 0.044),
        ] {
            assert!((found - stated).abs() < 1e-12, "{found} {stated}");
        }
        assert!((curve.total_impulse_n_s() / 16.84 - 1.0).abs() < 0.01, "{}", curve.total_impulse_n_s());
        assert_eq!(from_rasp(&motor.motor).unwrap(), *curve, "the text in a mission is the same motor");
    }

    #[test]
    fn an_entry_that_is_not_whole_is_named_with_line_key_and_value() {
        let found = parse(EXCERPT, "db.json").unwrap();
        let [twice, no_mass] = [&found[1], &found[2]].map(|found| found.as_ref().unwrap_err());
        assert_eq!((twice.name.as_str(), twice.origin.as_str()), ("Cesaroni 129G79-13A", "db.json:32"));
        assert_eq!(twice.reason, "samples[24]: time is 1.631; times must increase from point to point");
        assert_eq!(no_mass.name, "Ellis H50");
        assert_eq!(no_mass.reason, "totalWeightG is missing; a mass in g is accepted");
        let kilograms = EXCERPT.replace("\"propWeightG\": 21.1", "\"propWeightG\": 0.0211");
        let found = parse(&kilograms, "db.json").unwrap();
        let reason = &found[0].as_ref().unwrap_err().reason;
        assert!(reason.starts_with("propellant mass is '0.0000211 kg for 16."), "{reason}");
        let none = parse("[{\"designation\": 3}]", "db.json").unwrap();
        assert!(none[0].as_ref().unwrap_err().reason.contains("integer `3`, expected a string"), "{none:?}");
    }

    #[test]
    fn a_text_that_is_no_list_is_an_error() {
        assert!(parse("{}", "a.json").unwrap_err().to_string().starts_with("not a list of motors"));
        assert!(matches!(parse("[]", "a.json"), Err(ListError::Empty)));
    }
}
