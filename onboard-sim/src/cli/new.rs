//! A mission file for a custom rocket: a club's measurements, each with its unit and method.
//! Missing values are another mission's, scaled.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::io::{BufRead as _, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::mission::Mission;
use flight::vehicle::thrust_curve::ThrustCurve;
use flight::vehicles::{mission, motors, openrocket, table, thrust_curve};
use onboard_sim::files::{NewFile, text_of};
use protocol::program::Exit;
use toml::Value;

use super::{notify, read};

const MASS: &str = "airframe.mass.loaded_kg";
const LENGTH: &str = "airframe.body.length_m";
const DIAMETER: &str = "airframe.body.diameter_m";
const MOTOR: &str = "airframe.motor";
const START: &str = "start.at";

#[derive(clap::Args)]
pub(crate) struct NewArguments {
    /// The vehicle's name: NAME.toml is written.
    name: String,
    /// Mission that supplies missing values, scaled by mass, length and diameter: built-in or TOML
    /// file [default: mk3].
    #[arg(long, value_name = "NAME|FILE")]
    like: Option<String>,
    /// OpenRocket's export of a simulated flight (CSV) of the landing vehicle alone, without its
    /// booster: its first row has mass, centre of gravity, inertias and cross section, in any
    /// units. Its drag is that of a flight nose first, and is not used.
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// Length from the nozzle exit to the tip of the nose, m: OpenRocket counts from the nose.
    #[arg(long, value_name = "M")]
    length: Option<f64>,
    /// Landing motor: a built-in one, a .eng or .rse file, or a test stand's table (.csv with
    /// columns such as time_s, thrust_n).
    #[arg(long, value_name = "NAME|FILE")]
    motor: Option<String>,
    /// What a test stand's table does not say of its motor.
    #[arg(long, num_args = 5, requires = "motor", value_names = ["NAME", "DIAMETER_MM", "LENGTH_MM", "PROPELLANT_KG", "TOTAL_KG"])]
    motor_data: Option<Vec<String>>,
    /// The file [default: NAME.toml].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Shows a question, and returns the typed answer.
type Prompt<'a> = &'a mut dyn FnMut(&str) -> anyhow::Result<String>;

pub(crate) fn run(arguments: &NewArguments) -> anyhow::Result<Exit> {
    let path = arguments.out.clone().unwrap_or_else(|| format!("{}.toml", arguments.name).into());
    let mut stdin = std::io::stdin().lock();
    let terminal = stdin.is_terminal();
    let mut prompt = |question: &str| {
        ensure!(terminal, "there is no terminal on which to ask for it");
        write!(std::io::stderr(), "{question}: ")?;
        let mut line = String::new();
        ensure!(stdin.read_line(&mut line)? > 0, "the answers end at: {question}");
        Ok(line.trim().to_owned())
    };
    let prompts = arguments.like.is_none();
    if prompts && !terminal {
        notify(&format!("no terminal for questions: missing values are {}'s", mission::DEFAULT));
    }
    let text = made(arguments, prompts && terminal, &mut prompt, &path.display().to_string())?;
    let path = NewFile::create(&path)?.fill(|file| file.write_all(text.as_bytes()))?;
    notify(&format!("{0} is written; `onboard-sim check {0}` says whether it will land", path.display()));
    Ok(Exit::Yes)
}

/// The text of the mission, which can be loaded; asks for everything if `prompts`, else only
/// for required values.
fn made(arguments: &NewArguments, prompts: bool, prompt: Prompt<'_>, path: &str) -> anyhow::Result<String> {
    let NewArguments { name, like, from, length, motor, motor_data, .. } = arguments;
    let mut draft = Draft::like(like.as_deref().unwrap_or(mission::DEFAULT))?;
    draft.put("name", Value::String(name.clone()), "chosen");
    draft.put("summary", Value::String(format!("A vehicle like {}", draft.like.name)), "chosen");
    if let Some(length_m) = length {
        draft.put(LENGTH, Value::Float(*length_m), "--length");
    }
    if let Some(file) = from {
        draft.simulated(file, prompt)?;
    }
    if let Some(motor) = motor {
        draft.motor(motor, motor_data.as_ref(), prompt)?;
    }
    let mut questions: Vec<Key> = keys().filter(|key| prompts && key.place.is_some()).collect();
    questions.sort_by_key(|key| key.place);
    for key in questions {
        let drone = draft.given.get(START).is_some_and(|(at, _)| at.as_str() == Some("drone"));
        let idle = if drone { "start.height_m" } else { "drop.height_m" };
        if key.path != idle && !draft.given.contains_key(key.path) {
            draft.query(&key, prompt)?;
        }
    }
    let text = draft.text()?;
    mission::from_toml(&text, path)?;
    Ok(text)
}

/// A key of a mission that a club measures or decides.
struct Key {
    path: &'static str,
    unit: &'static str,
    /// Its description and method of measurement.
    how: &'static str,
    /// Powers of mass, length and diameter by which it is scaled.
    powers: Vec<f64>,
    /// Among the questions.
    place: Option<u32>,
}

/// All of them, in the order of the file.
fn keys() -> impl Iterator<Item = Key> {
    include_str!("keys.txt").lines().filter(|line| !line.starts_with('#')).filter_map(|line| {
        let mut fields = line.split(';').map(str::trim);
        Some(Key {
            path: fields.next()?,
            unit: fields.next()?,
            how: fields.next()?,
            powers: fields.next()?.split_whitespace().filter_map(|power| power.parse().ok()).collect(),
            place: fields.next()?.parse().ok(),
        })
    })
}

/// A mission in the making.
struct Draft {
    like: Mission,
    /// Values stated in the other mission.
    stated: toml::Table,
    motor: ThrustCurve,
    /// Given values, with their sources.
    given: BTreeMap<&'static str, (Value, String)>,
}

impl Draft {
    fn like(name: &str) -> anyhow::Result<Self> {
        let text = text_of(name, mission::BUILTIN, "mission")?;
        let like = mission::from_toml(&text, name)?;
        let motor = like.motor_curve.clone();
        Ok(Self { like, stated: text.parse()?, motor, given: BTreeMap::new() })
    }

    fn put(&mut self, path: &'static str, value: Value, by: &str) {
        self.given.insert(path, (value, by.to_owned()));
    }

    /// Value of a key, and its source.
    fn value(&self, key: &Key) -> Option<(Value, String)> {
        if let Some(given) = self.given.get(key.path) {
            return Some(given.clone());
        }
        let (section, leaf) = key.path.rsplit_once('.').unwrap_or(("", key.path));
        let mut sections = section.split('.').filter(|name| !name.is_empty());
        let table = sections.try_fold(&self.stated, |table, name| table.get(name)?.as_table())?;
        let value = table.get(leaf)?;
        let by = format!("{}'s", self.like.name);
        let scale: f64 =
            self.scales().iter().zip(&key.powers).map(|(scale, power)| libm::pow(*scale, *power)).product();
        Some(match value.as_float().or(value.as_integer().map(|whole| whole as f64)) {
            Some(number) if key.path == "airframe.gimbal.limit_deg" && number > self.free_deg() => {
                (Value::Float(self.free_deg()), "as far as the motor can swing in its tube".to_owned())
            }
            Some(number) if (scale - 1.0).abs() > 1e-9 => (rounded(number * scale), by + ", scaled"),
            _ => (value.clone(), by),
        })
    }

    /// Mass, length and diameter, over the other vehicle's.
    fn scales(&self) -> [f64; 3] {
        let (mass, body) = (&self.like.airframe.mass, &self.like.airframe.body);
        [(MASS, mass.loaded_kg), (LENGTH, body.length_m), (DIAMETER, body.diameter_m)].map(|(path, like)| {
            self.given.get(path).and_then(|(value, _)| value.as_float()).map_or(1.0, |number| number / like)
        })
    }

    /// How far the motor can swing before it touches the tube, degrees.
    fn free_deg(&self) -> f64 {
        let mut airframe = self.like.airframe.clone();
        airframe.gimbal.pivot_station_m = 0.5 * self.motor.length_m();
        airframe.gimbal.inside_diameter_m *= self.scales()[2];
        libm::floor(10.0 * airframe.gimbal_clearance_rad(&self.motor).to_degrees()) / 10.0
    }

    /// Applies OpenRocket's data of the vehicle.
    fn simulated(&mut self, file: &Path, prompt: Prompt<'_>) -> anyhow::Result<()> {
        let name = file.display().to_string();
        let found = openrocket::read(&read(file)?).with_context(|| name.clone())?;
        if let Some(length) = keys().find(|key| key.path == LENGTH && !self.given.contains_key(LENGTH)) {
            self.query(&length, prompt).context("--length is missing: OpenRocket counts from the nose")?;
        }
        let length_m = self.scales()[1] * self.like.airframe.body.length_m;
        for (path, number) in [
            (MASS, Some(found.mass_kg)),
            ("airframe.mass.loaded_cg_station_m", found.cg_below_nose_m.map(|below_m| length_m - below_m)),
            ("airframe.mass.loaded_pitch_inertia_kg_m2", found.pitch_inertia_kg_m2),
            ("airframe.mass.roll_inertia_kg_m2", found.roll_inertia_kg_m2),
            (DIAMETER, found.reference_area_m2.map(|area_m2| libm::sqrt(4.0 * area_m2 / PI))),
        ] {
            if let Some(number) = number {
                self.put(path, rounded(number), &name);
            }
        }
        Ok(())
    }

    /// Applies a motor: a name, or a file's, whose text becomes part of the mission.
    fn motor(&mut self, motor: &str, data: Option<&Vec<String>>, prompt: Prompt<'_>) -> anyhow::Result<()> {
        const DATA: [&str; 5] =
            ["name", "diameter, mm", "length, mm", "mass of its propellant, kg", "mass with propellant, kg"];
        let (text, curve) = match motors::builtin(motor) {
            Ok(curve) => (motor.to_owned(), curve),
            Err(unknown) => {
                let text = read(Path::new(motor)).context(unknown)?;
                let ending = motor.rsplit('.').next().unwrap_or_default();
                let curve = if ["csv", "tsv", "txt"].iter().any(|table| ending.eq_ignore_ascii_case(table)) {
                    let answers =
                        || DATA.map(|of| prompt(&format!("Motor on the stand, {of}"))).into_iter().collect();
                    let data = data.cloned().map_or_else(answers, Ok).context("--motor-data is missing")?;
                    let mut head: Vec<_> =
                        data.iter().map(|word| word.replace(char::is_whitespace, "_")).collect();
                    // A RASP file has the delays there.
                    head.insert(3, "P".to_owned());
                    thrust_curve::from_stand(&head.join(" "), &text)
                } else {
                    thrust_curve::from_file_text(motor, &text)
                };
                let curve = curve.with_context(|| motor.to_owned())?;
                (thrust_curve::to_rasp(&curve), curve)
            }
        };
        self.motor = curve;
        self.put(MOTOR, Value::String(text), motor);
        // The alternative curve of this motor is not available.
        self.stated.remove("other_motor");
        Ok(())
    }

    /// Asks for a value until an answer is valid; a value far from the expected one must be
    /// repeated.
    fn query(&mut self, key: &Key, prompt: Prompt<'_>) -> anyhow::Result<()> {
        let number_of = |draft: &Self| draft.value(key)?.0.as_float();
        let (expected, mut remark) = (number_of(self), String::new());
        let unit = match key.unit {
            _ if key.path == MOTOR => {
                "; built in: ".to_owned() + &motors::names().collect::<Vec<_>>().join(", ")
            }
            "" => String::new(),
            unit => format!(", {unit}"),
        };
        loop {
            // Only these two may be missing from a mission.
            let missing = if key.path == START { self.like.start.at.name() } else { "standard" };
            let default = self.value(key).map_or(missing.into(), |(value, _)| value);
            let shown = default.as_str().map_or(default.to_string(), |text| text.lines().take(1).collect());
            let answer = prompt(&format!("{remark}{}{unit} [{shown}]", key.how))?;
            let before = self.given.clone();
            let taken = match key.path {
                _ if answer.is_empty() => return Ok(()),
                MOTOR => self.motor(&answer, None, prompt),
                START => Ok(Value::String(answer.to_lowercase())).map(|at| self.put(START, at, "stated")),
                path => number(&answer, key.unit, self.scales()[0] * self.like.airframe.mass.loaded_kg)
                    .map(|number| self.put(path, number, "stated")),
            };
            remark = match (taken.and_then(|()| self.refused(key)), expected.zip(number_of(self))) {
                (Err(error), _) => {
                    self.given = before;
                    format!("{error:#}\n")
                }
                (Ok(()), Some((expected, given)))
                    if !key.path.starts_with("site.")
                        && !(0.25..=4.0).contains(&(given / expected))
                        && default.as_float() != Some(given) =>
                {
                    format!("{given} is far from the {expected} of a vehicle like this; Enter takes it\n")
                }
                _ => return Ok(()),
            };
        }
    }

    /// An error if the value of this key is invalid in a mission.
    fn refused(&self, key: &Key) -> anyhow::Result<()> {
        let leaf = key.path.rsplit('.').next().unwrap_or_default();
        let error = mission::from_toml(&self.text()?, "not taken").err().map(|error| error.to_string());
        let error = error.filter(|error| error.contains(&format!("{leaf} = ")));
        error.map_or(Ok(()), |error| bail!("{}", error.trim().lines().last().unwrap_or_default().to_owned()))
    }

    fn text(&self) -> anyhow::Result<String> {
        let mut text = "# What a club measures or decides of its vehicle. Each comment says what it is and how it is measured, and in \
            brackets\n# the unit and where the value comes from. Stations are heights above the nozzle exit when upright.\n"
            .to_owned();
        let mut section = "";
        for key in keys() {
            let Some((value, by)) = self.value(&key) else { continue };
            let (of, leaf) = key.path.rsplit_once('.').unwrap_or(("", key.path));
            if of != section {
                write!(text, "\n[{of}]\n")?;
                section = of;
            }
            let unit = if key.unit.is_empty() { String::new() } else { format!("{}; ", key.unit) };
            writeln!(text, "# {} ({unit}{by})\n{leaf} = {value}", key.how)?;
        }
        Ok(text)
    }
}

/// Four digits of a number.
fn rounded(number: f64) -> Value {
    Value::Float(format!("{number:.3e}").parse().unwrap_or(number))
}

/// A number in a unit, from an answer that has the number alone, or with another unit, or for an
/// inertia the measurements of a vehicle of this mass swinging on two wires.
fn number(answer: &str, unit: &str, mass_kg: f64) -> anyhow::Result<Value> {
    let float = |text: &str| {
        text.replace(',', ".").parse::<f64>().ok().with_context(|| format!("'{text}' is no number"))
    };
    let (first, other) = answer.split_once(char::is_whitespace).unwrap_or((answer, unit));
    Ok(match other.split_whitespace().collect::<Vec<_>>()[..] {
        // m g T^2 d^2 / (16 pi^2 L)
        [length_m, apart_m] if unit == "kg m2" && float(length_m).is_ok() => {
            let swing = 0.1 * float(first)? * float(apart_m)? / (4.0 * PI);
            rounded(mass_kg * STANDARD_GRAVITY_M_S2 * swing * swing / float(length_m)?)
        }
        _ if other == unit => Value::Float(float(first)?),
        _ => rounded(float(first)? * table::factor(unit, other).map_err(anyhow::Error::msg)?),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(words: &[&str]) -> NewArguments {
        #[derive(clap::Parser)]
        struct Only {
            #[command(flatten)]
            new: NewArguments,
        }
        <Only as clap::Parser>::parse_from([&["new"], words].concat()).new
    }

    /// The text, and the dialogue.
    fn dialogue(words: &[&str], answers: &str) -> (anyhow::Result<String>, String) {
        let (mut shown, mut lines) = (String::new(), answers.lines());
        let mut prompt = |question: &str| {
            shown += question;
            lines.next().map(str::to_owned).context("no more answers")
        };
        let made = made(&arguments(words), true, &mut prompt, "ours.toml");
        (made, shown)
    }

    fn text_of_new(words: &[&str]) -> anyhow::Result<String> {
        made(&arguments(words), false, &mut |_| bail!("no terminal"), "ours.toml")
    }

    fn stated_keys(table: &toml::Table, prefix: &str, into: &mut Vec<String>) {
        for (name, value) in table {
            match value {
                Value::Table(inner) => stated_keys(inner, &format!("{prefix}{name}."), into),
                _ => into.push(format!("{prefix}{name}")),
            }
        }
    }

    #[test]
    fn every_built_in_mission_comes_out_as_it_is() {
        for (like, text) in mission::BUILTIN {
            let mut stated = Vec::new();
            stated_keys(&text.parse().unwrap(), "", &mut stated);
            for key in &stated {
                assert!(keys().any(|row| row.path == key), "{like}: {key} is not in the table");
            }
            let made = mission::from_toml(&text_of_new(&["ours", "--like", like]).unwrap(), "ours").unwrap();
            assert!(made.changed.is_empty(), "{:?}", made.changed);
            let built_in = mission::from_toml(text, like).unwrap();
            assert_eq!(
                Mission { name: built_in.name.clone(), summary: built_in.summary.clone(), ..made },
                built_in
            );
        }
    }

    /// docs/build-mk3.md, "What a builder measures": ten swings of mk3 on wires of 1 m, 0.4 m
    /// apart, take 19.3 s.
    #[test]
    fn val_hand_answers_are_scaled_converted_and_swung() {
        let answers = "HP-H45W\n4100 g\n80 m\n0,8\n\nhalf\n40\n0.4\n20.1 1 0.4\n1 kg m2\n\n130 mm\n\n8\n1500 ft\n95\n35\nabove\nDrone\n140\n\n\n\n\n\n";
        let (text, shown) = dialogue(&["ours"], answers);
        let text = text.unwrap();
        let ours = mission::from_toml(&text, "ours").unwrap();
        let Mission { airframe, drop, site, start, changed, .. } = &ours;
        assert_eq!((site.altitude_m, site.temperature_c), (457.2, Some(35.0)));
        assert!(changed.is_empty(), "{changed:?}");
        assert!(
            (airframe.mass.loaded_kg - 4.1).abs() < 1e-12 && (airframe.fins.length_m - 0.13).abs() < 1e-12
        );
        assert!((airframe.fins.station_m - 0.72).abs() < 1e-12, "0.63 of 0.7 m is 0.72 of 0.8 m");
        assert!((airframe.parachute.area_m2 - 2.05 * 4.1 / 3.7).abs() < 1e-3);
        let inertia_kg_m2 = 4.1 * 9.806_65 * 2.01 * 2.01 * 0.16 / (16.0 * PI * PI);
        assert!((airframe.mass.loaded_pitch_inertia_kg_m2 - inertia_kg_m2).abs() < 1e-4, "{inertia_kg_m2}");
        let mk3 = number("19.3 1 0.4", "kg m2", 3.7).unwrap().as_float().unwrap();
        assert!((mk3 - 0.137).abs() < 5e-4, "{mk3}");
        assert_eq!((start.at.name(), drop.map(|drop| drop.height_m)), ("drone", Some(140.0)));
        for (question, answer) in [
            ("nose: tape, m [0.7]", "not taken: airframe.body.length_m = 80: must be above 0 to 3\n"),
            ("edge of a ruler, m [0.3943]", "'half' is no number\n"),
            (
                "edge of a ruler, m [0.3943]",
                "40 is far from the 0.3943 of a vehicle like this; Enter takes it\n",
            ),
            ("edge of a ruler, m [40.0]", "Pitch"),
            (
                "in the shade, C [standard]",
                "not taken: site.temperature_c = 95: must be degrees Celsius, -40 to 60\n",
            ),
            (
                "apogee or drone [apogee]",
                "unknown variant `above`, expected one of `pad`, `apogee`, `drone`\n",
            ),
        ] {
            assert!(shown.contains(&format!("{question}{answer}")), "{question}{answer}: {shown}");
        }
        assert!(text.contains("kitchen scale (kg; stated)\nloaded_kg = 4.1\n"), "{text}");
        assert!(text.contains("(m; mk3's, scaled)\nstation_m = 0.72\n"), "{text}");
        assert_eq!(dialogue(&["ours"], "3.7\n").0.unwrap_err().to_string(), "no more answers");
    }

    #[test]
    fn openrocket_and_a_stand_fill_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let (sim, stand) = (folder.path().join("sim.csv"), folder.path().join("stand.csv"));
        // As some programs for Windows write it: in Latin-1.
        let row = "# Time (s),Mass (g),Longitudinal moment of inertia (kg\u{b7}m\u{b2}),CG location (cm),Reference area (cm\u{b2}),Drag \
            coefficient ()\n0,3500,0.13,38,43.0,0.61\n";
        std::fs::write(&sim, row.chars().map(|letter| letter as u8).collect::<Vec<_>>()).unwrap();
        let burn: String = (0..800).map(|row| f64::from(row) * 0.01).fold(
            "time_s,thrust_lbf\n".to_owned(),
            |text, time_s| {
                let thrust_n = if (1.0..7.0).contains(&time_s) { 55.0 } else { 0.0 };
                text + &format!("{time_s:.2},{:.3}\n", thrust_n / 4.448_22)
            },
        );
        std::fs::write(&stand, burn).unwrap();
        let (sim, stand) = (sim.to_str().unwrap(), stand.to_str().unwrap());
        let burnt = ["ours", "--from", sim, "--motor", stand];
        let error = |more: &[&str]| text_of_new(&[&burnt, more].concat()).unwrap_err().to_string();
        assert!(error(&[]).starts_with("--length is missing"));
        assert!(error(&["--length", "0.72"]).contains("--motor-data is missing"));
        let data = ["--length", "0.72", "--motor-data", "club 38", "38", "210", "0.19", "0.37"];
        let text = text_of_new(&[burnt.as_slice(), &data].concat()).unwrap();
        let ours = mission::from_toml(&text, "ours").unwrap();
        let mass = &ours.airframe.mass;
        assert!(
            (mass.loaded_kg - 3.5).abs() < 1e-12 && (mass.loaded_cg_station_m - 0.34).abs() < 1e-9,
            "{mass:?}"
        );
        assert!((ours.airframe.body.diameter_m - 0.074).abs() < 1e-4);
        assert_eq!(ours.motor_curve.name(), "club_38");
        assert!((ours.motor_curve.total_impulse_n_s() - 330.0).abs() < 1.0);
        assert!(ours.changed.is_empty() && ours.other_motor.is_none());
        assert!(text.contains(&format!("(kg; {sim})\nloaded_kg = 3.5\n")), "{text}");
        // A motor that is too long for mk3's gimbal swings less.
        let long = ["--length", "0.72", "--motor-data", "club", "38", "260", "0.19", "0.37"];
        let text = text_of_new(&[burnt.as_slice(), &long].concat()).unwrap();
        assert!(text.contains("as far as the motor can swing in its tube)\nlimit_deg = 7."), "{text}");
        // A mission that cannot be flown is not written.
        let bad = text_of_new(&["ours", "--like", "mk3", "--length", "0"]).unwrap_err().to_string();
        assert!(bad.starts_with("ours.toml: airframe."), "{bad}");
    }
}
