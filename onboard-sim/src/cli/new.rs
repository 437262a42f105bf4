//! A mission file for a rocket of one's own: what a club measures, each with its unit and how it is measured. What is not told is
//! another mission's, scaled.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::io::{BufRead, IsTerminal as _, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, bail, ensure};
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::mission::Mission;
use flight::vehicles::{mission, motors, openrocket, table, thrust_curve};
use toml::Value;

use super::{refuse_loss, text_of, write_file};

const MASS: &str = "airframe.mass.loaded_kg";
const CG: &str = "airframe.mass.loaded_cg_station_m";
const PITCH: &str = "airframe.mass.loaded_pitch_inertia_kg_m2";
const ROLL: &str = "airframe.mass.roll_inertia_kg_m2";
const LENGTH: &str = "airframe.body.length_m";
const DIAMETER: &str = "airframe.body.diameter_m";
const MOTOR: &str = "airframe.motor";
const GIMBAL: &str = "airframe.gimbal.limit_deg";
const START: &str = "start.at";
const HEIGHT: &str = "start.height_m";
const DROP: &str = "drop.height_m";

/// A key of a mission that a club measures or decides: its path, its unit, what it is and how it is measured, and by which powers
/// of mass, length and diameter it is scaled where it is taken from another vehicle.
type Key = (&'static str, &'static str, &'static str, [i32; 3]);

/// In the order of the file. Stations are heights above the nozzle exit.
#[rustfmt::skip]
const KEYS: &[Key] = &[
    ("name", "", "Of the vehicle", [0; 3]),
    ("summary", "", "One line", [0; 3]),
    ("other_motors", "", "What the motor may turn out to be: names of motors, or texts of motor files", [0; 3]),
    ("lidar_ahead_of_feet_m", "m", "Height of the lidar above the feet: ruler", [0; 3]),
    (MOTOR, "", "Landing motor: a name of the list, or the text of a motor file", [0; 3]),
    ("airframe.igniters", "", "Independent igniters in the landing motor, 1 to 3", [0; 3]),
    ("airframe.servos_tell", "", "Whether the servos report where they are", [0; 3]),
    (MASS, "kg", "Mass with the landing motor full, without booster: kitchen scale", [0; 3]),
    (CG, "m", "Centre of gravity above the nozzle, motor full: balance the lying vehicle on the edge of a ruler", [0, 1, 0]),
    (PITCH, "kg m2", "Pitch inertia, motor full: a number, or of a swing level on two parallel wires the time of ten swings in s, the \
        length of the wires in m, and the distance between them in m", [1, 2, 0]),
    (ROLL, "kg m2", "Roll inertia: as pitch inertia, the vehicle upright between the wires", [1, 0, 2]),
    (LENGTH, "m", "Length from the nozzle exit to the tip of the nose: tape", [0; 3]),
    (DIAMETER, "m", "Diameter of the body: calliper", [0; 3]),
    ("airframe.fins.station_m", "m", "Hinges of the fins, above the nozzle: tape", [0, 1, 0]),
    ("airframe.fins.length_m", "m", "Length of a fin from its hinge: ruler", [0, 1, 0]),
    ("airframe.fins.control_min_deg", "deg", "Smallest opening that steers: protractor at the skin", [0; 3]),
    ("airframe.fins.servo.rate_deg_s", "deg/s", "Rate of a fin under load: camera at 240 pictures a second", [0; 3]),
    ("airframe.fins.servo.delay_s", "s", "From a command to the first motion: camera", [0; 3]),
    ("airframe.fins.servo.slop_deg", "deg", "Play of a fin with its servo on: its end, pushed to and fro by a finger", [0; 3]),
    (GIMBAL, "deg", "Stop of the gimbal on either side: a rod of 0.5 m in the motor's place", [0; 3]),
    ("airframe.gimbal.inside_diameter_m", "m", "Inside of the tube in which the motor swings: calliper", [0, 0, 1]),
    ("airframe.gimbal.servo.rate_deg_s", "deg/s", "Rate of the gimbal with the motor in: camera at 240 pictures a second", [0; 3]),
    ("airframe.gimbal.servo.delay_s", "s", "From a command to the first motion: camera", [0; 3]),
    ("airframe.gimbal.servo.slop_deg", "deg", "Play of the gimbal with its servos on: the rod's end, by a finger", [0; 3]),
    ("airframe.legs.foot_station_m", "m", "Feet, above the nozzle (below it is negative): ruler", [0; 3]),
    ("airframe.legs.foot_radius_m", "m", "From the axis to a foot: ruler", [0, 1, 0]),
    ("airframe.legs.stiffness_n_m", "N/m", "Force at a foot over how far it gives way: kitchen scale and ruler", [1, 0, 0]),
    ("airframe.legs.damping_n_s_m", "N s/m", "Of a leg", [1, 0, 0]),
    ("airframe.legs.drag_area_m2", "m2", "Drag area of all legs along the axis: spring balance in a car's wind", [0, 1, 1]),
    ("airframe.legs.drag_station_m", "m", "Where that drag acts, above the nozzle", [0, 1, 0]),
    ("airframe.legs.crush.force_n", "N", "Force at which a foot's block gives way: press it on a scale", [1, 0, 0]),
    ("airframe.legs.crush.guide_share", "", "By how much the guide's friction raises that force, as a share", [0; 3]),
    ("airframe.legs.crush.stroke_m", "m", "How far a block is crushed at most: ruler", [0; 3]),
    ("airframe.legs.crush.strength_n", "N", "What a leg bears upwards at its foot", [1, 0, 0]),
    ("airframe.legs.crush.strength_across_n", "N", "What a leg bears across at its foot", [1, 0, 0]),
    ("airframe.parachute.area_m2", "m2", "Area of the canopy, spread out: tape", [1, 0, 0]),
    ("airframe.parachute.ejection_delay_s", "s", "From the command to the canopy in the air: camera", [0; 3]),
    ("airframe.parachute.inflation_distance_m", "m", "Way in which the canopy fills: camera, from a car", [0; 3]),
    (START, "", "Where a flight begins: pad, apogee or drone", [0; 3]),
    (HEIGHT, "m", "Apogee above the pad: an altimeter's flight", [0; 3]),
    (DROP, "m", "Height above the pad at which a drone lets it go", [0; 3]),
    ("drop.drift_m_s", "m/s", "Speed of the drone over the ground as it lets go, at most", [0; 3]),
    ("drop.rope_m", "m", "From the drone to the vehicle: tape", [0; 3]),
    ("drop.swing_deg", "deg", "How far the vehicle swings below the drone, at most", [0; 3]),
    ("launch.rail.length_m", "m", "Travel until the last button leaves the rail: tape", [0; 3]),
    ("launch.booster.motor", "", "Booster's motor: a name of the list, or the text of a motor file", [0; 3]),
    ("launch.booster.length_m", "m", "From the booster's nozzle to the vehicle's: tape", [0; 3]),
    ("launch.booster.dry_kg", "kg", "Mass of the booster with its motor's empty case: scale", [0; 3]),
    ("launch.booster.cg_station_m", "m", "Its centre of gravity above the vehicle's nozzle (negative): ruler", [0; 3]),
    ("launch.booster.pitch_inertia_kg_m2", "kg m2", "Its pitch inertia: as the vehicle's", [0; 3]),
    ("launch.booster.fins.root_chord_m", "m", "Chord of its three fins at the body: ruler", [0; 3]),
    ("launch.booster.fins.tip_chord_m", "m", "Chord at the tip: ruler", [0; 3]),
    ("launch.booster.fins.span_m", "m", "From the skin to the tip: ruler", [0; 3]),
    ("launch.booster.fins.sweep_m", "m", "How far the tip's leading edge lies below the root's: ruler", [0; 3]),
    ("gate.fence_radius_m", "m", "Radius around the pad outside of which the flight is ended: what the site allows", [0; 3]),
];

/// What is asked, in this order: what the defaults are scaled by comes first.
const ASKED: [&str; 13] = [
    MASS,
    LENGTH,
    DIAMETER,
    CG,
    PITCH,
    ROLL,
    MOTOR,
    "airframe.fins.length_m",
    "airframe.fins.station_m",
    GIMBAL,
    START,
    HEIGHT,
    "gate.fence_radius_m",
];

#[derive(clap::Args)]
pub(crate) struct NewArguments {
    /// The vehicle's name: NAME.toml is written.
    name: String,
    /// Mission that has what is not told, scaled by mass, length and diameter: built-in or TOML file [default: mk3].
    #[arg(long, value_name = "NAME|FILE")]
    like: Option<String>,
    /// OpenRocket's export of a simulated flight (CSV) of the landing vehicle alone, without its booster: its first row has mass,
    /// centre of gravity, inertias and cross section, in any units.
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// Length from the nozzle exit to the tip of the nose, m: OpenRocket counts from the nose.
    #[arg(long, value_name = "M")]
    length: Option<f64>,
    /// Landing motor: a built-in one, a .eng or .rse file, or a test stand's table (.csv with columns such as time_s, thrust_n).
    #[arg(long, value_name = "NAME|FILE")]
    motor: Option<String>,
    /// What a test stand's table does not say of its motor.
    #[arg(long, num_args = 5, requires = "motor", value_names = ["NAME", "DIAMETER_MM", "LENGTH_MM", "PROPELLANT_KG", "TOTAL_KG"])]
    motor_data: Option<Vec<String>>,
    /// The file [default: NAME.toml].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long)]
    force: bool,
}

/// Where questions are asked: what is typed, and what is shown.
type Terminal<'a> = (&'a mut dyn BufRead, &'a mut dyn Write);

pub(crate) fn run(arguments: &NewArguments) -> anyhow::Result<ExitCode> {
    let path = arguments.out.clone().unwrap_or_else(|| format!("{}.toml", arguments.name).into());
    refuse_loss(&path, arguments.force)?;
    let (mut stdin, mut stderr) = (std::io::stdin().lock(), std::io::stderr());
    let terminal = stdin.is_terminal();
    let text = made(arguments, terminal.then_some((&mut stdin, &mut stderr)), &path.display().to_string())?;
    write_file(&path, arguments.force, |file| file.write_all(text.as_bytes()))?;
    writeln!(stderr, "{}: --profile of `onboard-sim fly`, `campaign` and `card` takes it", path.display())?;
    Ok(ExitCode::SUCCESS)
}

/// The text of the mission, which can be loaded.
fn made(arguments: &NewArguments, mut terminal: Option<Terminal<'_>>, path: &str) -> anyhow::Result<String> {
    let NewArguments { name, like, from, length, motor, motor_data, .. } = arguments;
    let mut draft = Draft::like(like.as_deref().unwrap_or(mission::DEFAULT))?;
    draft.put("name", Value::String(name.clone()), "chosen");
    if let Some(length_m) = length {
        draft.put(LENGTH, Value::Float(*length_m), "--length");
    }
    if let Some(file) = from {
        if length.is_none() {
            let Some(terminal) = &mut terminal else {
                bail!(
                    "--length is missing: the nozzle's distance from the nose, m, from which OpenRocket counts"
                )
            };
            draft.ask(LENGTH, terminal)?;
        }
        draft.simulated(file)?;
    }
    if let Some(motor) = motor {
        draft.motor(motor, motor_data.as_deref(), &mut terminal)?;
    }
    match &mut terminal {
        Some(terminal) if like.is_none() && from.is_none() => draft.ask_all(motor.is_some(), terminal)?,
        None if like.is_none() && from.is_none() => {
            let _ = writeln!(
                std::io::stderr(),
                "nobody to ask: what is not told is that of {}",
                mission::DEFAULT
            );
        }
        _ => {}
    }
    let text = draft.text()?;
    mission::from_toml(&text, path)?;
    Ok(text)
}

/// A mission in the making.
struct Draft {
    like_name: String,
    like: Mission,
    /// What the other mission states.
    stated: toml::Table,
    /// What is told, and by what.
    told: BTreeMap<&'static str, (Value, String)>,
    notes: String,
}

impl Draft {
    fn like(name: &str) -> anyhow::Result<Self> {
        let text = text_of(name, mission::BUILTIN, "mission")?;
        let like = mission::from_toml(&text, name)?;
        Ok(Self {
            like_name: like.name.clone(),
            like,
            stated: text.parse()?,
            told: BTreeMap::new(),
            notes: String::new(),
        })
    }

    fn put(&mut self, key: &'static str, value: Value, by: &str) {
        self.told.insert(key, (value, by.to_owned()));
    }

    /// What stands at a key, and where it comes from.
    fn value(&self, (path, _, _, powers): &Key) -> Option<(Value, String)> {
        if let Some(told) = self.told.get(path) {
            return Some(told.clone());
        }
        // Of another motor nobody has said what it may turn out to be.
        if *path == "other_motors" && self.told.contains_key(MOTOR) {
            return None;
        }
        let mut value = path.split('.').try_fold(None, |table: Option<&Value>, name| {
            table.map_or_else(|| self.stated.get(name), |table| table.get(name)).map(Some)
        })??;
        let scaled;
        let mut by = format!("{}'s", self.like_name);
        if let Some(number) = value.as_float() {
            let mut scale = 1.0;
            for ((key, like), power) in self.sizes().into_iter().zip(powers) {
                scale *= self.told_number(key).map_or(1.0, |size| libm::pow(size / like, f64::from(*power)));
            }
            let free_deg = (*path == GIMBAL).then(|| self.free_deg()).flatten().unwrap_or(f64::INFINITY);
            if number > free_deg {
                (scaled, by) =
                    (Value::Float(free_deg), "as far as the motor can swing in its tube".to_owned());
                value = &scaled;
            } else if (scale - 1.0).abs() > 1e-9 {
                (scaled, by) = (Value::Float(rounded(number * scale)), by + ", scaled");
                value = &scaled;
            }
        }
        Some((value.clone(), by))
    }

    /// What everything is scaled by, and the other vehicle's.
    fn sizes(&self) -> [(&'static str, f64); 3] {
        let airframe = &self.like.airframe;
        [
            (MASS, airframe.mass.loaded_kg),
            (LENGTH, airframe.body.length_m),
            (DIAMETER, airframe.body.diameter_m),
        ]
    }

    fn told_number(&self, key: &str) -> Option<f64> {
        self.told.get(key)?.0.as_float()
    }

    /// How far another motor can swing before it touches the tube, degrees.
    fn free_deg(&self) -> Option<f64> {
        let motor = motors::named(self.told.get(MOTOR)?.0.as_str()?).ok()?;
        let mut airframe = self.like.airframe.clone();
        airframe.gimbal.pivot_station_m = 0.5 * motor.length_m();
        let diameter_m = self.told_number(DIAMETER).unwrap_or(airframe.body.diameter_m);
        airframe.gimbal.inside_diameter_m *= diameter_m / airframe.body.diameter_m;
        Some(libm::floor(10.0 * airframe.gimbal_clearance_rad(&motor).to_degrees()) / 10.0)
    }

    /// Takes what OpenRocket says of the vehicle whose length is known.
    fn simulated(&mut self, file: &Path) -> anyhow::Result<()> {
        let name = file.display().to_string();
        let found = openrocket::read(&read(file)?).with_context(|| name.clone())?;
        let length_m = self.told_number(LENGTH).unwrap_or(self.like.airframe.body.length_m);
        for (key, number) in [
            (MASS, Some(found.mass_kg)),
            (CG, found.cg_below_nose_m.map(|below_m| length_m - below_m)),
            (PITCH, found.pitch_inertia_kg_m2),
            (ROLL, found.roll_inertia_kg_m2),
            (DIAMETER, found.reference_area_m2.map(|area_m2| libm::sqrt(4.0 * area_m2 / PI))),
        ] {
            if let Some(number) = number {
                self.put(key, Value::Float(rounded(number)), &name);
            }
        }
        if let Some(drag) = found.drag_coefficient {
            let like = self.like.airframe.body.axial_drag_coefficient;
            writeln!(
                self.notes,
                "# {name} has a drag coefficient of {drag}. That is nose first: the vehicle falls tail first, with {like}."
            )?;
        }
        Ok(())
    }

    /// Takes a motor: a name, or a file's, whose text goes into the mission.
    fn motor(
        &mut self,
        motor: &str,
        data: Option<&[String]>,
        ask: &mut Option<Terminal<'_>>,
    ) -> anyhow::Result<()> {
        if motors::names().any(|known| known == motor) {
            self.put(MOTOR, Value::String(motor.to_owned()), "the list's");
            return Ok(());
        }
        let path = Path::new(motor);
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        let text = read(path).with_context(|| {
            let known = motors::names().collect::<Vec<_>>().join(", ");
            format!("'{motor}' is neither a built-in motor ({known}) nor a readable file")
        })?;
        let curve = if ["csv", "tsv", "txt"].iter().any(|known| ending == *known) {
            let data = match (data, ask) {
                (Some(data), _) => data.to_vec(),
                (None, Some(terminal)) => {
                    let ask = |what: &str| {
                        prompt(terminal, &format!("Motor on the stand, {what}"), "", |text| {
                            ensure!(!text.is_empty(), "a {what} is needed");
                            Ok(text.replace(char::is_whitespace, "_"))
                        })
                    };
                    ["name", "diameter, mm", "length, mm", "propellant, kg", "mass with propellant, kg"]
                        .map(ask)
                        .into_iter()
                        .collect::<Result<_, _>>()?
                }
                (None, None) => bail!(
                    "{motor}: --motor-data is missing: name, diameter and length in mm, propellant and total mass in kg"
                ),
            };
            let [name, diameter, length, masses @ ..] = &data[..] else {
                bail!("--motor-data has five values")
            };
            let name = name.replace(char::is_whitespace, "_");
            thrust_curve::from_stand(&format!("{name} {diameter} {length} P {}", masses.join(" ")), &text)
        } else {
            thrust_curve::from_file_text(motor, &text)
        };
        let curve = curve.with_context(|| motor.to_owned())?;
        self.put(MOTOR, Value::String(thrust_curve::to_rasp(&curve)), motor);
        Ok(())
    }

    /// Asks everything; a motor was given if `motor`.
    fn ask_all(&mut self, motor: bool, terminal: &mut Terminal<'_>) -> anyhow::Result<()> {
        writeln!(
            terminal.1,
            "Enter alone takes what stands in brackets. Numbers may have another unit: 700 mm."
        )?;
        for key in ASKED {
            let drops = self.told.get(START).is_some_and(|(at, _)| at.as_str() == Some("drone"));
            match key {
                MOTOR if motor => {}
                HEIGHT if drops => self.ask(DROP, terminal)?,
                _ => self.ask(key, terminal)?,
            }
        }
        Ok(())
    }

    /// Asks for the value of a key.
    fn ask(&mut self, key: &'static str, terminal: &mut Terminal<'_>) -> anyhow::Result<()> {
        let row = KEYS.iter().find(|row| row.0 == key).with_context(|| format!("{key}: is no key"))?;
        let (_, unit, how, _) = row;
        let default = match self.value(row) {
            Some((Value::String(text), _)) if text.contains('\n') => motors::named(&text)?.name().to_owned(),
            Some((Value::String(text), _)) => text,
            Some((value, _)) => value.to_string(),
            None => self.like.start.at.name().to_owned(),
        };
        let what = if unit.is_empty() { (*how).to_owned() } else { format!("{how}, {unit}") };
        loop {
            let answer = prompt(terminal, &what, &default, |text| Ok(text.to_owned()))?;
            let taken = match key {
                _ if answer.is_empty() => Ok(()),
                MOTOR => {
                    let (input, output) = terminal;
                    self.motor(&answer, None, &mut Some((&mut **input, &mut **output)))
                }
                START => match answer.as_str() {
                    "pad" | "apogee" | "drone" => Ok(self.put(key, Value::String(answer), "told")),
                    _ => Err(anyhow::anyhow!("pad, apogee or drone is accepted")),
                },
                _ => {
                    number(&answer, unit, self.told_number(MASS).unwrap_or(self.like.airframe.mass.loaded_kg))
                        .map(|number| self.put(key, Value::Float(number), "told"))
                }
            };
            match taken {
                Ok(()) => return Ok(()),
                Err(error) => writeln!(terminal.1, "{error:#}")?,
            }
        }
    }

    fn text(&mut self) -> anyhow::Result<String> {
        let of = |key: &str| KEYS.iter().find(|row| row.0 == key).and_then(|row| Some(self.value(row)?.0));
        let motor = of(MOTOR).and_then(|motor| Some(motors::named(motor.as_str()?).ok()?.name().to_owned()));
        let mass_kg = of(MASS).and_then(|mass| mass.as_float()).unwrap_or_default();
        let summary = format!("{mass_kg} kg on {}, like {}", motor.unwrap_or_default(), self.like_name);
        self.put("summary", Value::String(summary), "computed");
        let mut text = "# What a club measures or decides of its vehicle. Each comment says what it is and how it is measured, and in \
            brackets\n# the unit and where the value comes from. Stations are heights above the nozzle exit when upright.\n"
            .to_owned()
            + &self.notes;
        let mut section = "";
        for row in KEYS {
            let (path, unit, how, _) = row;
            let Some((value, by)) = self.value(row) else { continue };
            let (of, leaf) = path.rsplit_once('.').unwrap_or(("", path));
            if of != section {
                write!(text, "\n[{of}]\n")?;
                section = of;
            }
            let unit = if unit.is_empty() { String::new() } else { format!("{unit}; ") };
            writeln!(text, "# {how} ({unit}{by})\n{leaf} = {value}")?;
        }
        Ok(text)
    }
}

/// Four digits of a number.
fn rounded(number: f64) -> f64 {
    format!("{number:.3e}").parse().unwrap_or(number)
}

/// A file's text; what is not UTF-8 is read as Latin-1, in which some programs export.
fn read(path: &Path) -> anyhow::Result<String> {
    let bytes = std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| error.as_bytes().iter().copied().map(char::from).collect()))
}

/// A number in a unit: of an answer that has the number alone, or another unit behind it, or for an inertia what was measured of
/// a vehicle of this mass that swings on two wires.
fn number(answer: &str, unit: &str, mass_kg: f64) -> anyhow::Result<f64> {
    let float = |text: &str| {
        text.parse::<f64>()
            .ok()
            .filter(|value| value.is_finite())
            .with_context(|| format!("'{text}' is no number"))
    };
    let words: Vec<&str> = answer.split_whitespace().collect();
    match words[..] {
        [number] => float(number),
        [number, other] => Ok(float(number)? * table::factor(unit, other).map_err(anyhow::Error::msg)?),
        [ten_swings_s, length_m, apart_m] if unit == "kg m2" => {
            Ok(rounded(bifilar_kg_m2(mass_kg, 0.1 * float(ten_swings_s)?, float(length_m)?, float(apart_m)?)))
        }
        _ => bail!("'{answer}': a number in {unit}, or a number and its unit, is accepted"),
    }
}

/// Moment of inertia of a body that swings about the vertical on two parallel wires: `m g T^2 d^2 / (16 pi^2 L)`.
fn bifilar_kg_m2(mass_kg: f64, period_s: f64, length_m: f64, apart_m: f64) -> f64 {
    mass_kg * STANDARD_GRAVITY_M_S2 * libm::pow(period_s * apart_m / (4.0 * PI), 2.0) / length_m
}

/// Asks until the answer can be taken; Enter alone is the empty answer.
fn prompt<T>(
    (input, output): &mut Terminal<'_>,
    what: &str,
    default: &str,
    take: impl Fn(&str) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    loop {
        if default.is_empty() {
            write!(output, "{what}: ")?
        } else {
            write!(output, "{what} [{default}]: ")?
        }
        output.flush()?;
        let mut line = String::new();
        ensure!(input.read_line(&mut line)? > 0, "the answers end at: {what}");
        match take(line.trim()) {
            Ok(taken) => return Ok(taken),
            Err(error) => writeln!(output, "{error:#}")?,
        }
    }
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

    fn asked(words: &[&str], answers: &str) -> (anyhow::Result<String>, String) {
        let mut shown = Vec::new();
        let made = made(&arguments(words), Some((&mut answers.as_bytes(), &mut shown)), "ours.toml");
        (made, String::from_utf8(shown).unwrap())
    }

    fn told(words: &[&str]) -> anyhow::Result<String> {
        made(&arguments(words), None, "ours.toml")
    }

    fn keys(table: &toml::Table, prefix: &str, into: &mut Vec<String>) {
        for (name, value) in table {
            match value {
                Value::Table(inner) => keys(inner, &format!("{prefix}{name}."), into),
                _ => into.push(format!("{prefix}{name}")),
            }
        }
    }

    #[test]
    fn every_built_in_mission_comes_out_as_it_is() {
        for (like, text) in mission::BUILTIN {
            let mut stated = Vec::new();
            keys(&text.parse().unwrap(), "", &mut stated);
            for key in &stated {
                assert!(KEYS.iter().any(|(path, ..)| path == key), "{like}: {key} is not in the table");
            }
            let made = mission::from_toml(&told(&["ours", "--like", like]).unwrap(), "ours").unwrap();
            assert!(made.changed.is_empty(), "{:?}", made.changed);
            let built_in = mission::from_toml(text, like).unwrap();
            assert_eq!(
                Mission { name: built_in.name.clone(), summary: built_in.summary.clone(), ..made },
                built_in
            );
        }
    }

    /// MK3.md, "What a builder measures": ten swings of mk3 on wires of 1 m, 0.4 m apart, take 19.3 s.
    #[test]
    fn val_hand_answers_are_scaled_converted_and_swung() {
        let answers = "4100 g\n0.8\n\nhalf\n0.4\n20.1 1 0.4\n\nHP-H45W\n130 mm\n\n8\ndrone\n140\n\n";
        let (text, shown) = asked(&["ours"], answers);
        let text = text.unwrap();
        let ours = mission::from_toml(&text, "ours").unwrap();
        let Mission { airframe, drop, start, changed, .. } = &ours;
        assert!(changed.is_empty(), "{changed:?}");
        assert!(
            (airframe.mass.loaded_kg - 4.1).abs() < 1e-12 && (airframe.fins.length_m - 0.13).abs() < 1e-12
        );
        assert!((airframe.fins.station_m - 0.72).abs() < 1e-12, "0.63 of 0.7 m is 0.72 of 0.8 m");
        assert!((airframe.parachute.area_m2 - 2.05 * 4.1 / 3.7).abs() < 1e-3);
        let inertia_kg_m2 = 4.1 * 9.806_65 * 2.01 * 2.01 * 0.16 / (16.0 * PI * PI);
        assert!((airframe.mass.loaded_pitch_inertia_kg_m2 - inertia_kg_m2).abs() < 1e-4, "{inertia_kg_m2}");
        assert!((bifilar_kg_m2(3.7, 1.93, 1.0, 0.4) - 0.137).abs() < 5e-4);
        assert_eq!((start.at.name(), drop.map(|drop| drop.height_m)), ("drone", Some(140.0)));
        assert!(shown.contains("edge of a ruler, m [0.3943]: 'half' is no number\n"), "{shown}");
        assert!(text.contains("kitchen scale (kg; told)\nloaded_kg = 4.1\n"), "{text}");
        assert!(text.contains("(m; mk3's, scaled)\nstation_m = 0.72\n"), "{text}");
        let (ended, _) = asked(&["ours"], "3.7\n");
        assert!(ended.unwrap_err().to_string().starts_with("the answers end at: Length"));
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
        let error = |more: &[&str]| told(&[&burnt, more].concat()).unwrap_err().to_string();
        assert!(error(&[]).starts_with("--length is missing"));
        assert!(error(&["--length", "0.72"]).contains("--motor-data is missing"));
        let data = ["--length", "0.72", "--motor-data", "club 38", "38", "210", "0.19", "0.37"];
        let text = told(&[burnt.as_slice(), &data].concat()).unwrap();
        let ours = mission::from_toml(&text, "ours").unwrap();
        let mass = &ours.airframe.mass;
        assert!(
            (mass.loaded_kg - 3.5).abs() < 1e-12 && (mass.loaded_cg_station_m - 0.34).abs() < 1e-9,
            "{mass:?}"
        );
        assert!((ours.airframe.body.diameter_m - 0.074).abs() < 1e-4);
        assert_eq!(ours.motor_curve.name(), "club_38");
        assert!((ours.motor_curve.total_impulse_n_s() - 330.0).abs() < 1.0);
        assert!(ours.changed.is_empty() && ours.other_motors.is_empty());
        assert!(text.contains("drag coefficient of 0.61. That is nose first"), "{text}");
        assert!(text.contains(&format!("(kg; {sim})\nloaded_kg = 3.5\n")), "{text}");
        // A motor that is too long for mk3's gimbal swings less.
        let long = ["--length", "0.72", "--motor-data", "club", "38", "260", "0.19", "0.37"];
        let text = told(&[burnt.as_slice(), &long].concat()).unwrap();
        assert!(text.contains("as far as the motor can swing in its tube)\nlimit_deg = 7."), "{text}");
        // What cannot be flown is not written.
        let bad = told(&["ours", "--like", "mk3", "--length", "0"]).unwrap_err().to_string();
        assert!(bad.starts_with("ours.toml: airframe."), "{bad}");
    }
}
