//! `onboard-sim playback`: recorded sensors of a real flight, played to the flight computer.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use flight::computer::messages::Severity;
use flight::estimation::estimator::AidStatus;
use flight::vehicle::mission::StartPoint;
use flight::vehicles::mission;
use onboard_sim::playback::{Axes, CLIMB_MAX_M_S, Played, applies, play, sensor_file};
use protocol::log::writer::LogHeader;
use protocol::program::Exit;
use sim::recipe::Recipe;
use sim::wire::record::text_event;

use super::{logging, recipe};

#[derive(Args)]
pub(crate) struct PlaybackArguments {
    /// Recorded sensors: CSV, or CSV compressed by zstd (.zst).
    ///
    /// Columns: time_s; gyro_x, gyro_y, gyro_z (rad/s); accel_x, accel_y, accel_z (m/s2, +9.8
    /// upwards at rest); barometer (m above the pad) or pressure_pa; gnss_x, gnss_y, gnss_z (m from
    /// the pad, z up), gnss_vx, gnss_vy, gnss_vz (m/s), gnss_time_s; lidar (m). An empty cell or
    /// nan is no new sample. Only time, gyro and accelerometer are required, 50 to 2,000 times a
    /// second.
    #[arg(value_name = "SENSORS.csv")]
    sensors: PathBuf,
    /// Built-in mission or TOML file, with a section `launch`.
    #[arg(long, default_value = mission::DEFAULT, value_name = "NAME|FILE")]
    mission: String,
    /// Log to write; one that exists is kept, and this one gets the next free name.
    #[arg(long, value_name = "LOG.mcap")]
    out: Option<PathBuf>,
    /// The axes of the inertial unit along body x (to the nose), y and z.
    #[arg(long, default_value = "+x,+y,+z", allow_hyphen_values = true, value_name = "X,Y,Z")]
    axes: Axes,
    /// Rows a second of a file without time_s.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Burn time of the ascent motor that flew, s, instead of the mission's: before 0.6 of it no
    /// burnout is detected.
    #[arg(long, value_name = "S")]
    burn_time: Option<f64>,
}

pub(crate) fn run(arguments: &PlaybackArguments) -> anyhow::Result<Exit> {
    let PlaybackArguments { sensors: path, mission, out, axes, rate, burn_time } = arguments;
    let recipe = recipe(mission, None, "none", 1)?;
    anyhow::ensure!(recipe.mission.launch.is_some(), "mission {mission}: a section `launch` is required");
    let mut recipe = recipe.starting_at(StartPoint::Pad)?;
    let mut overridden = String::new();
    if let Some(burn_s) = *burn_time {
        anyhow::ensure!((0.1..=60.0).contains(&burn_s), "--burn-time {burn_s}: 0.1 to 60 s is accepted");
        recipe = recipe.ascending_for(burn_s)?;
        overridden = format!("; OVERRIDE: the ascent motor burns for {burn_s} s");
    }
    let (shown, name) = (path.display(), &recipe.mission.name);
    let head =
        format!("playback of {shown} to {name}: nothing connected, not armed, no phase forced{overridden}");
    let file = File::open(path).with_context(|| format!("{shown}: cannot be read"))?;
    let file: Box<dyn Read> = if path.extension().is_some_and(|end| end == "zst") {
        Box::new(zstd::Decoder::new(file)?)
    } else {
        Box::new(file)
    };
    let recorded = sensor_file::read(file, *rate, *axes).with_context(|| shown.to_string())?;
    let recorder = out.as_ref().map(|out| logging(out, &header(&recipe, path))).transpose()?;
    if let Some(recorder) = &recorder {
        recorder.record(text_event(Severity::Notice, &head), 0);
    }
    let played = play(&recorded.frames, &recipe.mission, |record, time_ns| {
        if let Some(recorder) = &recorder {
            recorder.record(record, time_ns);
        }
    });
    let log = recorder.map(|recorder| recorder.finish()).transpose();
    let log = log.context("the flight was played, but its log is incomplete")?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "{head}")?;
    let (frames, pause_ms) = (recorded.frames.len(), 1e3 * recorded.longest_pause_s);
    let rate_hz = recorded.rate_hz;
    writeln!(
        out,
        "{rate_hz:.0} inertial samples a second, longest pause {pause_ms:.0} ms, {frames} frames of 5 ms"
    )?;
    print_checks(&mut out, &played)?;
    print_moments(&mut out, &played)?;
    print_sensors(&mut out, &played)?;
    if let Some(log) = log {
        writeln!(out, "log {}", log.display())?;
    }
    Ok(match played.moment("apogee") {
        _ if played.moments.iter().any(|moment| moment.too_fast) => Exit::No,
        Some(_) => Exit::Yes,
        None => Exit::NotSeen,
    })
}

/// The log has no date: it begins at the epoch, so that the same sensors always give the same log.
fn header(recipe: &Recipe, sensors: &Path) -> LogHeader {
    let run = [("profile", recipe.mission.name.clone()), ("playback", sensors.display().to_string())];
    LogHeader {
        writer: "onboard-sim playback".to_owned(),
        run: run.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
        profile_toml: Some(recipe.mission_toml.clone()),
        ..LogHeader::default()
    }
}

fn print_checks(out: &mut impl Write, played: &Played) -> std::io::Result<()> {
    let Played { checks, checked_s, .. } = played;
    writeln!(out, "\narming checks, last {checked_s} s on the pad")?;
    for (_, refusals) in checks.iter().filter(|(name, _)| applies(name)) {
        if let Some(newest) = refusals.first() {
            writeln!(out, "  REFUSES {:>2} of {checked_s} s  {newest}", refusals.len())?;
        }
    }
    let names = |shown: &dyn Fn(&str, bool) -> bool| {
        let checks = checks.iter().filter(|(name, refusals)| shown(name, refusals.is_empty()));
        checks.map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
    };
    writeln!(out, "  pass: {}", names(&|name, passes| passes && applies(name)))?;
    writeln!(out, "  not applicable: {}", names(&|name, _| !applies(name)))
}

fn print_moments(out: &mut impl Write, played: &Played) -> std::io::Result<()> {
    if played.moments.is_empty() {
        return writeln!(out, "\nNO LIFT-OFF: check --axes, and that accel is specific force in m/s2");
    }
    writeln!(out, "\n                    file s      T+ s  estimate m     m/s barometer m     m/s   GNSS m")?;
    let cell = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.1}"));
    for moment in &played.moments {
        write!(out, "{:<16}{:>10.2}{:>10.2}", moment.name, moment.recording_s, moment.flight_s)?;
        let (barometer_m, barometer_m_s) = moment.barometer.unzip();
        write!(out, "{:>12.1}{:>8.1}{:>12}", moment.height_m, moment.climb_m_s, cell(barometer_m))?;
        let too_fast = if moment.too_fast { "  TOO FAST" } else { "" };
        writeln!(out, "{:>8}{:>9}{too_fast}", cell(barometer_m_s), cell(moment.gnss_m))?;
    }
    for name in ["burnout", "separation", "apogee", "parachute"] {
        if played.moment(name).is_none() {
            writeln!(out, "{name:<16}     never")?;
        }
    }
    if played.moments.iter().any(|moment| moment.too_fast) {
        writeln!(out, "TOO FAST: fired while the barometer climbs at more than {CLIMB_MAX_M_S} m/s")?;
    }
    if let Some(((highest_s, highest_m), (apart_s, apart_m))) = played.highest.zip(played.apart) {
        writeln!(out, "\nhighest sample of the barometer: {highest_m:.1} m at T+{highest_s:.2} s")?;
        writeln!(out, "estimate less barometer, largest up to apogee: {apart_m:+.1} m at T+{apart_s:.2} s")?;
    }
    Ok(())
}

fn print_sensors(out: &mut impl Write, played: &Played) -> std::io::Result<()> {
    writeln!(out, "\nin flight         received      used  rejected not offered")?;
    let (aids, [barometer, fixes, lidar]) = (&played.aids, played.received);
    // A fix has three numbers of each kind. Measurements withheld from the estimator were never
    // offered.
    for (name, received, AidStatus { used, refused, .. }) in [
        ("barometer", barometer, &aids.barometer),
        ("GNSS velocity", 3 * fixes, &aids.gnss_velocity),
        ("GNSS position", 3 * fixes, &aids.gnss_position),
        ("lidar", lidar, &aids.lidar),
    ] {
        let withheld = received.saturating_sub(used + refused);
        writeln!(out, "{name:<16}{received:>10}{used:>10}{refused:>10}{withheld:>12}")?;
    }
    let (refused, restarts) = (aids.imu.refused, played.restarts);
    writeln!(
        out,
        "inertial samples rejected: {refused}; restarts after a state that is not a number: {restarts}"
    )
}
