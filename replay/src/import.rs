//! Imports a flight of another program as telemetry: PX4 (`.ulg`), ArduPilot (`.bin`), and CSV of
//! AltOS, RocketPy and OpenRocket.
//!
//! The log that it writes describes the flight as a ground station would have recorded it: position
//! from the first sample, velocity and tilt. It has no frames of a flight computer, so nothing of
//! it can be run again. The nose is the body's x axis.

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, anyhow, bail, ensure};
use ardupilot_binlog::Reader;
use flight::computer::messages::Severity;
use flight::rules::phase::Phase;
use protocol::log::record::Record;
use protocol::log::v1::Telemetry;
use protocol::log::writer::LogHeader;
use protocol::motion::Degrees;
use px4_ulog::full_parser::{Completeness, MultiId, SomeVec, read_file};
use serde::Serialize;
use sim::wire::record::text_event;

use crate::cli::{Answer, ending, print_note};
use crate::log::write_records;

/// A log that was written.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Imported {
    pub output: PathBuf,
    /// Format of the flight.
    pub format: &'static str,
    pub samples: usize,
    pub lasted_s: f64,
    /// Signals that the file does not have.
    pub missing: Vec<&'static str>,
}

impl Answer for Imported {
    fn sentences(&self) -> Vec<String> {
        let Self { output, format, samples, lasted_s, missing } = self;
        let missing = if missing.is_empty() { "nothing".to_owned() } else { missing.join(", ") };
        vec![format!(
            "{}: {samples} samples over {lasted_s:.1} s from {format}; missing: {missing}",
            output.display()
        )]
    }
}

/// A signal of a sample.
type Value = fn(&Telemetry) -> Option<f64>;

/// Samples and texts of a flight, with their times, s.
#[derive(Default)]
struct Track {
    samples: Vec<Telemetry>,
    texts: Vec<(f64, String)>,
}

/// Imports a flight.
///
/// # Errors
/// The file cannot be read, is of no known format or has no position, or the log cannot be written.
pub fn import(file: &Path, output: &Path) -> Result<Imported> {
    let name = file.display();
    let (format, track) = match ending(file).as_str() {
        "ulg" => ("PX4", px4(file)),
        "bin" => ("ArduPilot", ardupilot(file)),
        "csv" => ("CSV", table(file)),
        _ => bail!("{name}: .ulg, .bin and .csv are accepted"),
    };
    let Track { mut samples, texts } = track.with_context(|| name.to_string())?;
    samples.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let first = samples.first().with_context(|| format!("{name}: no sample with a position"))?.clone();
    for sample in &mut samples {
        sample.time_s -= first.time_s;
    }
    let counted: [fn(&mut Telemetry) -> &mut Option<f64>; 3] =
        [|sample| &mut sample.north_m, |sample| &mut sample.east_m, |sample| &mut sample.altitude_m];
    for value in counted {
        // A receiver may have its first fix in flight.
        let origin = samples.iter_mut().find_map(|sample| *value(sample)).unwrap_or_default();
        for value in samples.iter_mut().filter_map(|sample| value(sample).as_mut()) {
            *value -= origin;
        }
    }
    let signals: [(&str, Value); 5] = [
        ("altitude", |sample| sample.altitude_m),
        ("position", |sample| sample.north_m),
        ("climb", |sample| sample.climb_m_s),
        ("horizontal velocity", |sample| sample.north_m_s),
        ("tilt", |sample| sample.tilt_rad),
    ];
    let lacks = |(_, value): &&(&str, Value)| samples.iter().all(|sample| value(sample).is_none());
    let missing = signals.iter().filter(lacks).map(|(name, _)| *name).collect();
    let lasted_s = samples.last().map_or(0.0, |last| last.time_s);
    let run = [("imported", name.to_string()), ("format", format.to_owned())];
    let header = LogHeader {
        writer: "replay import".to_owned(),
        run: run.map(|(key, value)| (key.to_owned(), value)).into(),
        ..LogHeader::default()
    };
    let count = samples.len();
    let sampled = samples.into_iter().map(|sample| (sample.time_s, Record::Telemetry(Box::new(sample))));
    let texts = texts.iter().map(|(time_s, text)| (time_s - first.time_s, text_event(Severity::Info, text)));
    let mut records: Vec<(f64, Record)> = sampled.chain(texts).collect();
    records.sort_by(|a, b| a.0.total_cmp(&b.0));
    let output = write_records(output, &header, &records)?;
    Ok(Imported { output, format, samples: count, lasted_s, missing })
}

/// A sample of position, m, and velocity, m/s, north-east-down.
fn moving(
    [north_m, east_m, down_m]: [Option<f64>; 3],
    [north_m_s, east_m_s, down_m_s]: [Option<f64>; 3],
) -> Telemetry {
    Telemetry {
        north_m,
        east_m,
        altitude_m: down_m.map(|down_m| -down_m),
        north_m_s,
        east_m_s,
        climb_m_s: down_m_s.map(|down_m_s| -down_m_s),
        ..Telemetry::default()
    }
}

/// The local position, with the attitude before each sample.
fn px4(file: &Path) -> Result<Track> {
    let parsed = read_file(file.to_str().context("its name is not UTF-8")?).map_err(|error| {
        // The parser's own errors are debug texts of any length.
        let is_file_s = error.raw_os_error().is_some();
        if is_file_s { error.into() } else { anyhow!("is no ULog file, or its definitions are damaged") }
    })?;
    let damage = match parsed.completeness {
        Completeness::Complete => None,
        Completeness::Truncated => Some("the file ends inside a record"),
        Completeness::MalformedRecord(_) => {
            Some("the file has a damaged record, and nothing after it was read")
        }
    };
    let column = |topic: &str, name: &str| -> Result<Vec<f64>> {
        let fields = parsed.messages.get(topic).and_then(|instances| instances.get(&MultiId::new(0)));
        Ok(match fields.and_then(|fields| fields.get(name)) {
            Some(SomeVec::Float(values)) => values.iter().map(|value| f64::from(*value)).collect(),
            Some(SomeVec::UInt64(values)) => values.iter().map(|value| *value as f64 / 1e6).collect(),
            Some(SomeVec::Bool(values)) => values.iter().map(|value| f64::from(u8::from(*value))).collect(),
            _ => bail!("no {name} of {topic}{}", damage.map(|why| format!("; {why}")).unwrap_or_default()),
        })
    };
    let times_s = column("vehicle_local_position", "timestamp")?;
    // An estimate that is not valid reads 0.
    let valid = |name: &str, flag: &str| -> Result<Vec<Option<f64>>> {
        let flags = column("vehicle_local_position", flag).unwrap_or_default();
        let values = column("vehicle_local_position", name)?.into_iter().enumerate();
        Ok(values.map(|(row, value)| Some(value).filter(|_| flags.get(row) != Some(&0.0))).collect())
    };
    let position = [valid("x", "xy_valid")?, valid("y", "xy_valid")?, valid("z", "z_valid")?];
    let velocity = [valid("vx", "v_xy_valid")?, valid("vy", "v_xy_valid")?, valid("vz", "v_z_valid")?];
    let turned =
        ["timestamp", "q[0]", "q[1]", "q[2]", "q[3]"].map(|name| column("vehicle_attitude", name).ok());
    let tilt_rad = |time_s: f64| {
        let [Some(times_s), Some(w), Some(x), Some(y), Some(z)] = &turned else { return None };
        let place = times_s.partition_point(|at_s| *at_s <= time_s).checked_sub(1)?;
        // The height of the nose over its length, north-east-down.
        let up = 2.0 * (w.get(place)? * y.get(place)? - x.get(place)? * z.get(place)?);
        Some(libm::acos(up.clamp(-1.0, 1.0)))
    };
    let sample = |(row, time_s): (usize, f64)| {
        let here = |columns: &[Vec<Option<f64>>; 3]| {
            columns.each_ref().map(|values| values.get(row).copied().flatten())
        };
        Telemetry { time_s, tilt_rad: tilt_rad(time_s), ..moving(here(&position), here(&velocity)) }
    };
    let track = Track { samples: times_s.into_iter().enumerate().map(sample).collect(), texts: Vec::new() };
    if let Some(damage) = damage {
        print_note(&format!("warning: {}: {damage}", file.display()));
    }
    Ok(track)
}

/// The state of the first estimator, and the messages.
fn ardupilot(file: &Path) -> Result<Track> {
    let mut track = Track::default();
    for entry in Reader::new(File::open(file)?) {
        let entry = entry?;
        let value = |name: &str| entry.get_f64(name);
        // Until 2015 the time was in ms.
        let old_s = || value("TimeMS").unwrap_or_default() / 1e3;
        let time_s = entry.timestamp_usec.map_or_else(old_s, |time_us| time_us as f64 / 1e6);
        match entry.name.as_str() {
            "XKF1" | "NKF1" | "EKF1" if value("C").unwrap_or(0.0) <= 0.0 => track.samples.push(Telemetry {
                time_s,
                tilt_rad: value("Pitch").map(|pitch_deg| (90.0 - pitch_deg).to_radians()),
                ..moving(["PN", "PE", "PD"].map(value), ["VN", "VE", "VD"].map(value))
            }),
            "MSG" => track.texts.extend(entry.get_str("Message").map(|text| (time_s, text.to_owned()))),
            _ => {}
        }
    }
    ensure!(!track.samples.is_empty(), "no XKF1, NKF1 or EKF1, the estimator's state");
    Ok(track)
}

/// The names of a column in its programs, the first that is there, and the signal that it sets.
type Column = (&'static [&'static str], fn(&mut Telemetry, f64));

/// With their units where the programs write them; AltOS and CATS write none.
const COLUMNS: [Column; 8] = [
    (&["time", "time s", "ts", "t s"], |sample, value| sample.time_s = value),
    (
        &["height", "filtered_altitude_agl", "altitude agl m", "altitude m", "alt m", "z m"],
        |sample, value| sample.altitude_m = Some(value),
    ),
    (&["x m", "position east of launch m"], |sample, value| sample.east_m = Some(value)),
    (&["y m", "position north of launch m"], |sample, value| sample.north_m = Some(value)),
    (&["vx m/s"], |sample, value| sample.east_m_s = Some(value)),
    (&["vy m/s"], |sample, value| sample.north_m_s = Some(value)),
    (
        &["vz m/s", "vertical velocity m/s", "velocity m/s", "speed", "accel_speed", "velocity"],
        |sample, value| sample.climb_m_s = Some(value),
    ),
    (&["attitude angle \u{b0}", "vertical orientation (zenith) \u{b0}"], |sample, value| {
        sample.tilt_rad = Some((90.0 - value).to_radians());
    }),
];

/// A head of a table: its name with its unit, in lower case, and the size of the unit. Feet become
/// metres.
fn head_of(text: &str) -> (String, f64) {
    let text = text.trim_matches(['#', ' ', '\u{feff}', '"']).to_lowercase();
    let Some((name, unit)) = text.trim_end_matches([')', ']']).rsplit_once(['(', '[']) else {
        return (text, 1.0);
    };
    let (unit, size) = match unit.trim() {
        "ft" => ("m", 0.3048),
        "ft/s" => ("m/s", 0.3048),
        unit => (unit, 1.0),
    };
    (format!("{} {unit}", name.trim()), size)
}

/// The phase of a state of AltOS.
fn phase_of(state: &str) -> Option<u32> {
    let phase = match state {
        "pad" => Phase::PadArmed,
        "boost" => Phase::Boost,
        "fast" | "coast" => Phase::Coast,
        "drogue" | "main" => Phase::Chute,
        "landed" => Phase::Touchdown,
        _ => return None,
    };
    Some(phase as u32)
}

/// The text of a table: UTF-16 where its mark says so, else UTF-8.
fn text_of(bytes: &[u8]) -> Result<String> {
    let units = |unit: fn([u8; 2]) -> u16| {
        let units = bytes[2..].as_chunks().0.iter().map(|pair| unit(*pair));
        char::decode_utf16(units).collect::<Result<String, _>>().context("it is damaged UTF-16")
    };
    match bytes {
        [0xff, 0xfe, ..] => units(u16::from_le_bytes),
        [0xfe, 0xff, ..] => units(u16::from_be_bytes),
        // Only names of columns have other letters.
        _ => Ok(String::from_utf8_lossy(bytes).into_owned()),
    }
}

/// The head of a table, if it has a column of times.
fn heads_of<'a>(row: impl Iterator<Item = &'a str>) -> Option<Vec<(String, f64)>> {
    let heads: Vec<_> = row.map(head_of).collect();
    heads.iter().any(|(head, _)| COLUMNS[0].0.contains(&head.as_str())).then_some(heads)
}

fn table(file: &Path) -> Result<Track> {
    let text = text_of(&std::fs::read(file)?)?;
    let is_head = |separator: &char| text.lines().any(|line| heads_of(line.split(*separator)).is_some());
    let separator = [',', ';', '\t'].into_iter().find(is_head).context(
        "no line has the head of a column of times, `time` or `Time (s)`, between commas, semicolons or tabs",
    )?;
    let rows = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .delimiter(separator as u8)
        .from_reader(text.as_bytes())
        .into_records();
    let mut heads = Vec::new();
    let mut samples = Vec::new();
    let mut pad = None;
    for row in rows {
        let row = row?;
        let line = row.position().map_or(0, csv::Position::line);
        let first = row.get(0).unwrap_or_default();
        if heads.is_empty() || first.starts_with('#') {
            heads = heads_of(row.iter()).unwrap_or(heads);
            continue;
        }
        let values = row.iter().enumerate().filter(|(_, value)| !value.is_empty());
        let values = values.last().map_or(0, |(last, _)| last + 1);
        ensure!(
            values <= heads.len(),
            "line {line}: {values} values under {} heads: is the decimal sign the separator, too?",
            heads.len()
        );
        let place = |name: &str| heads.iter().position(|(head, _)| head == name);
        let cell = |name: &str| row.get(place(name)?);
        if samples.is_empty() && row.len() < heads.len() {
            let (name, values, heads) = (file.display(), row.len(), heads.len());
            print_note(&format!(
                "warning: {name}: line {line}: {values} values under {heads} heads: are they in place?"
            ));
        }
        let mut sample = Telemetry::default();
        for (names, set) in COLUMNS {
            let found = names.iter().find_map(|name| Some((name, cell(name)?, heads[place(name)?].1)));
            let Some((name, text, size)) = found else { continue };
            let number = if separator == ',' { text.to_owned() } else { text.replace(',', ".") };
            let value: f64 =
                number.parse().with_context(|| format!("line {line}, {name}: {text:.40}: not a number"))?;
            if value.is_finite() {
                set(&mut sample, size * value);
            }
        }
        sample.phase = cell("state_name").and_then(phase_of);
        let degrees = |name: &str| cell(name)?.parse().ok().filter(|degrees: &f64| degrees.abs() > 0.0);
        if let Some((latitude, longitude)) = degrees("latitude").zip(degrees("longitude")) {
            let here = Degrees { latitude, longitude };
            let (north_m, east_m) = pad.get_or_insert(here).to(here);
            (sample.north_m, sample.east_m) = (Some(north_m), Some(east_m));
        }
        samples.push(sample);
    }
    ensure!(!heads.is_empty(), "no line has the head of a column of times: `time` or `Time (s)`");
    ensure!(
        samples.iter().any(|sample| sample.altitude_m.is_some()),
        "no column of heights: `height`, `Altitude (m)` or `Z (m)`"
    );
    Ok(Track { samples, texts: Vec::new() })
}
