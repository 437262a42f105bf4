//! `onboard-sim playback`: recorded sensors of a real flight, played to the flight computer.

use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use flight::estimation::estimator::AidStatus;
use flight::vehicle::mission::StartPoint;
use flight::vehicles::mission;
use onboard_sim::playback::sensor_file::{self, Reading};
use onboard_sim::playback::{Axes, CLIMB_MAX_M_S, Played, RecordedSensors, beginning, play};
use protocol::log::writer::LogHeader;
use protocol::program::Exit;
use sim::recipe::Recipe;

use super::{logging, recipe};

/// Accepted burn times of an ascent motor, s.
const BURN_TIMES_S: std::ops::RangeInclusive<f64> = 0.1..=60.0;

#[derive(Args)]
pub(crate) struct PlaybackArguments {
    /// Recorded sensors: CSV, or CSV compressed by zstd (.zst).
    ///
    /// Columns: time_s; gyro_x, gyro_y, gyro_z (rad/s); accel_x, accel_y, accel_z (m/s2, +9.8 upwards at rest); barometer (m above the
    /// pad) or pressure_pa; gnss_x, gnss_y, gnss_z (m from the pad, z up), gnss_vx, gnss_vy, gnss_vz (m/s), gnss_time_s; lidar (m). An
    /// empty cell or nan is no new sample. Only time_s, gyro and accelerometer are required, at 50 to 2,000 rows a second.
    #[arg(value_name = "SENSORS.csv")]
    sensors: PathBuf,
    /// Built-in mission or TOML file, with a section `launch`.
    #[arg(long, default_value = mission::DEFAULT, value_name = "NAME|FILE")]
    mission: String,
    /// Log to write; one that exists is kept, and this one gets the next free name.
    #[arg(long, value_name = "LOG.mcap")]
    out: Option<PathBuf>,
    /// The recorded axes that lie along body x (to the nose), y and z.
    #[arg(long, default_value = "+x,+y,+z", allow_hyphen_values = true, value_name = "X,Y,Z")]
    axes: Axes,
    /// Rows a second of a file without time_s.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Burn time of the ascent motor that flew, s, instead of the mission's: before 0.6 of it no burnout is detected.
    #[arg(long, value_name = "S")]
    burn_time: Option<f64>,
}

pub(crate) fn run(arguments: &PlaybackArguments) -> anyhow::Result<Exit> {
    let PlaybackArguments { sensors: path, mission, rate, axes, .. } = arguments;
    let recipe = recipe(mission, None, "none", 1)?;
    anyhow::ensure!(
        recipe.mission.launch.is_some(),
        "mission {mission} has no section `launch`: playback needs a mission that starts on a rail"
    );
    let mut recipe = recipe.starting_at(StartPoint::Pad)?;
    let mut overridden = String::new();
    if let Some(burn_time_s) = arguments.burn_time {
        anyhow::ensure!(
            BURN_TIMES_S.contains(&burn_time_s),
            "--burn-time {burn_time_s}: {} to {} s is accepted",
            BURN_TIMES_S.start(),
            BURN_TIMES_S.end()
        );
        recipe = recipe.ascending_for(burn_time_s)?;
        overridden = format!("; OVERRIDE: the ascent motor burns for {burn_time_s} s");
    }
    let head = format!(
        "playback of {} to {}: nothing is connected, nobody arms, no phase is forced{overridden}",
        path.display(),
        recipe.mission.name
    );
    let reading = Reading { rate_hz: *rate, axes: *axes };
    let recorded = sensor_file::read(opened(path)?, &reading).with_context(|| path.display().to_string())?;
    let recorder = arguments.out.as_ref().map(|out| logging(out, &header(&recipe, path))).transpose()?;
    if let Some(recorder) = &recorder {
        recorder.record(beginning(&head), 0);
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
    print(&mut out, &recorded, &played)?;
    if let Some(log) = log {
        writeln!(out, "log {}", log.display())?;
    }
    Ok(if played.moments.iter().any(onboard_sim::playback::Moment::breaks_the_vehicle) {
        Exit::No
    } else if played.moment("apogee").is_none() {
        Exit::NotSeen
    } else {
        Exit::Yes
    })
}

fn opened(path: &Path) -> anyhow::Result<Box<dyn Read>> {
    let context = || format!("{}: cannot be read", path.display());
    let file = File::open(path).with_context(context)?;
    if path.extension().is_some_and(|end| end == "zst") {
        return Ok(Box::new(zstd::Decoder::new(file).with_context(context)?));
    }
    Ok(Box::new(BufReader::new(file)))
}

/// The log has no date: it begins at the epoch, so that the same sensors always give the same log.
fn header(recipe: &Recipe, sensors: &Path) -> LogHeader {
    let run = [("profile", recipe.mission.name.clone()), ("playback", sensors.display().to_string())];
    LogHeader {
        writer: "onboard-sim playback".to_owned(),
        start_unix_ns: 0,
        run: run.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
        profile_toml: Some(recipe.mission_toml.clone()),
        scenario_toml: None,
    }
}

fn print(out: &mut impl Write, recorded: &RecordedSensors, played: &Played) -> std::io::Result<()> {
    let frames = recorded.frames.len();
    writeln!(
        out,
        "{:.0} inertial samples a second, longest pause {:.0} ms, {frames} frames of 5 ms\n",
        recorded.rate_hz,
        1e3 * recorded.longest_pause_s
    )?;
    print_checks(out, played)?;
    if played.moment("lift-off").is_none() {
        return writeln!(
            out,
            "NO LIFT-OFF DETECTED: check --axes, and that accel_* is specific force in m/s2"
        );
    }
    print_moments(out, played)?;
    print_sensors(out, played)
}

fn print_checks(out: &mut impl Write, played: &Played) -> std::io::Result<()> {
    let seconds = played.checked_s;
    writeln!(out, "arming checks, last {seconds} s on the pad")?;
    for check in played.checks.iter().filter(|check| check.applies) {
        if let Some(refusal) = &check.refusal {
            writeln!(out, "  REFUSES {:>2} of {seconds} s  {refusal}", check.refused_s)?;
        }
    }
    let names = |applies: bool| {
        let checks = played.checks.iter().filter(|check| check.applies == applies);
        let checks = checks.filter(|check| !applies || check.refusal.is_none());
        checks.map(|check| check.name).collect::<Vec<_>>().join(", ")
    };
    writeln!(out, "  pass: {}\n  not applicable: {}\n", names(true), names(false))
}

fn print_moments(out: &mut impl Write, played: &Played) -> std::io::Result<()> {
    writeln!(
        out,
        "{:<16}{:>10}{:>10}{:>12}{:>8}{:>12}{:>8}{:>9}",
        "", "file s", "T+ s", "estimate m", "m/s", "barometer m", "m/s", "GNSS m"
    )?;
    let cell = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.1}"));
    for moment in &played.moments {
        let (height_m, climb_m_s) = moment.barometer.unzip();
        writeln!(
            out,
            "{:<16}{:>10.2}{:>10.2}{:>12.1}{:>8.1}{:>12}{:>8}{:>9}{}",
            moment.name,
            moment.recording_s,
            moment.flight_s,
            moment.height_m,
            moment.climb_m_s,
            cell(height_m),
            cell(climb_m_s),
            cell(moment.gnss_m),
            if moment.breaks_the_vehicle() { "  TOO FAST" } else { "" }
        )?;
    }
    for name in ["burnout", "apogee", "separation", "parachute"] {
        if played.moment(name).is_none() {
            writeln!(out, "{name:<16}{:>10}", "never")?;
        }
    }
    if played.moments.iter().any(onboard_sim::playback::Moment::breaks_the_vehicle) {
        writeln!(out, "TOO FAST: fired while the barometer climbs at more than {CLIMB_MAX_M_S} m/s")?;
    }
    if let Some((at_s, height_m)) = played.highest {
        writeln!(out, "\nhighest sample of the barometer: {height_m:.1} m at T+{at_s:.2} s")?;
    }
    if let Some((at_s, apart_m)) = played.apart {
        writeln!(out, "estimate less barometer, largest up to apogee: {apart_m:+.1} m at T+{at_s:.2} s")?;
    }
    Ok(())
}

fn print_sensors(out: &mut impl Write, played: &Played) -> std::io::Result<()> {
    writeln!(
        out,
        "\n{:<16}{:>10}{:>10}{:>10}{:>12}",
        "in flight", "received", "used", "rejected", "not offered"
    )?;
    let aids = &played.aids;
    let [barometer, fixes, lidar] = played.received;
    // A fix has three numbers of each kind. What the computer withholds from its estimator was never offered.
    for (name, received, AidStatus { used, refused, .. }) in [
        ("barometer", barometer, &aids.barometer),
        ("GNSS velocity", 3 * fixes, &aids.gnss_velocity),
        ("GNSS position", 3 * fixes, &aids.gnss_position),
        ("lidar", lidar, &aids.lidar),
    ] {
        if received == 0 {
            continue;
        }
        let withheld = received.saturating_sub(used + refused);
        writeln!(out, "{name:<16}{received:>10}{used:>10}{refused:>10}{withheld:>12}")?;
    }
    writeln!(
        out,
        "inertial samples rejected: {}; estimates that are not a number: {}; restarts of the estimator: {}",
        aids.imu.refused, played.not_finite, played.restarts
    )
}
