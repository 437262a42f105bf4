//! `onboard-sim motors` and `card`: which motor an airframe lands on best, and the page that a team takes to the field; with
//! the choices of a team that both have.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use anyhow::Context as _;
use campaign::hazard::Flights;
use campaign::motors::card::{Card, Day, Order};
use campaign::motors::choice::{StartHeight, Team};
use campaign::motors::ranking::{Ranked, Request, rank};
use campaign::motors::source::{self, Candidate, Found};
use campaign::motors::table;
use clap::Args;
use flight::vehicle::mission::Mission;
use flight::vehicle::mission::StartPoint;
use protocol::mission::MissionHash;
use sim::dispersion;

use super::hazard::check_winds;
use super::{in_wind, on_threads, recipe, refuse_loss, show_progress, write_file, write_folder};

/// Most flights of a motor.
const FLIGHTS_MAX: u64 = 100_000;

/// For the help.
pub(crate) const MOTORS_EXAMPLE: &str = "Example: onboard-sim motors --mission mini-f10 --from \
    thrustcurve-db.json --csv motors.csv";

#[derive(Args)]
pub(crate) struct MotorsArguments {
    #[command(flatten)]
    choices: Choices,
    /// Number of motors that are flown, beginning with the best.
    #[arg(long, default_value_t = 5, value_name = "N")]
    best: usize,
    /// Flights of each of them.
    #[arg(long, default_value_t = 60, value_name = "N")]
    flights: u64,
    /// List every motor that cannot be landed on, with its reason.
    #[arg(long)]
    all: bool,
    /// Write every motor as CSV, those that cannot be landed on with their reason.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

pub(crate) fn motors(arguments: &MotorsArguments) -> anyhow::Result<ExitCode> {
    let choices = &arguments.choices;
    anyhow::ensure!(
        arguments.flights <= FLIGHTS_MAX,
        "--flights {}: must be 0 to {FLIGHTS_MAX}",
        arguments.flights
    );
    if let Some(path) = &arguments.csv {
        refuse_loss(path, arguments.force)?;
    }
    let team = choices.team()?;
    let mission = &team.recipe.mission;
    let request = Request { team: &team, best: arguments.best, flights: arguments.flights };
    let found = choices.motors()?;
    let ranking = on_threads(choices.jobs, || Ok(rank(&request, found, &show_progress())?))?;
    std::io::stdout().lock().write_all(table::text(&ranking, arguments.all).as_bytes())?;
    if let Some(path) = &arguments.csv {
        write_file(path, arguments.force, |out| table::write_csv(&ranking, out))?;
    }
    let lands = ranking.iter().any(|ranked| matches!(ranked, Ranked::Lands(_)));
    anyhow::ensure!(lands, "{} lands on none of these motors", mission.name);
    Ok(ExitCode::SUCCESS)
}

/// The files of a card; the last one only if another mass or motor is proposed.
const FILES: [&str; 4] = ["card.html", "card.txt", "mission.toml", "proposal.toml"];
/// Most flights of a card.
const CARD_FLIGHTS_MAX: u64 = 10_000;

/// For the help.
pub(crate) const CARD_EXAMPLE: &str =
    "Example: onboard-sim card --mission mini-f10 --wind-from 270 --out card";

#[derive(Args)]
pub(crate) struct CardArguments {
    #[command(flatten)]
    choices: Choices,
    /// The landing motor of the proposal at the card's end: an .eng or .rse file, or the name of one of the motors of --from (built
    /// in if not given). By default the mission's own.
    #[arg(long, value_name = "FILE|NAME")]
    motor: Option<String>,
    /// Mass of the proposal with the motor full, kg. By default the best one within --ballast.
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    /// Mean winds 10 m above the ground, m/s, each with a radius and a rate of its own.
    #[arg(long = "wind", value_delimiter = ',', default_value = "0,3,6,10", value_name = "M/S,...")]
    winds: Vec<f64>,
    /// Where the wind of the day comes from, degrees clockwise from north: the plan has north up and the line downwind. By default
    /// downwind is up.
    #[arg(long, value_name = "DEG", value_parser = degrees)]
    wind_from: Option<f64>,
    /// Flights in each wind of every way in which a flight can end. Fewer than 100 give neither a rate nor a radius.
    #[arg(long, default_value_t = 100, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=CARD_FLIGHTS_MAX))]
    flights: u64,
    /// Flights in each wind of the ways that come down farthest. Below 368 the interval has no upper end.
    #[arg(long, default_value_t = 400, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=CARD_FLIGHTS_MAX))]
    hazard_flights: u64,
    /// Folder of the card.
    #[arg(long, default_value = "card", value_name = "DIR")]
    out: PathBuf,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

pub(crate) fn card(arguments: &CardArguments) -> anyhow::Result<ExitCode> {
    let choices = &arguments.choices;
    check_winds(&arguments.winds)?;
    anyhow::ensure!(
        arguments.mass.is_none_or(|mass_kg| mass_kg.is_finite() && mass_kg > 0.0),
        "--mass {}: a mass in kg above 0 is accepted",
        arguments.mass.unwrap_or_default()
    );
    for name in FILES {
        refuse_loss(&arguments.out.join(name), arguments.force)?;
    }
    let team = choices.team()?;
    let mission = &team.recipe.mission;
    let found = choices.motors()?;
    let own = &mission.airframe.motor;
    let motor = if let Some(name) = arguments.motor.as_ref().filter(|name| *name != own) {
        named(name, &found)?
    } else {
        let motor = own.clone();
        let curve = mission.motor_curve.clone();
        Candidate { origin: "the mission".to_owned(), motor, curve, in_production: None }
    };
    let mut winds_m_s = arguments.winds.clone();
    winds_m_s.sort_by(f64::total_cmp);
    winds_m_s.dedup();
    let days = winds_m_s
        .into_iter()
        .map(|wind_m_s| Ok(Day { wind_m_s, recipe: in_wind(&team.recipe, wind_m_s)? }))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let order = Order {
        team: &team,
        hash: &MissionHash::of(&team.recipe.mission_toml).to_string(),
        motor: &motor,
        mass_kg: arguments.mass,
        winds: &days,
        flights: Flights {
            survey: arguments.flights,
            of_widest: arguments.hazard_flights.max(arguments.flights),
        },
        wind_from_deg: arguments.wind_from,
    };
    let card = on_threads(choices.jobs, || Ok(Card::new(&order, &show_progress())?))?;
    let [html, text, mission_file, proposal] = FILES;
    let page = card.text();
    let mut files = vec![(html, card.html()), (text, page.clone()), (mission_file, card.recipe.mission_toml)];
    files.extend(card.proposed.map(|proposed| (proposal, proposed.mission_toml)));
    write_folder(&arguments.out, &files, arguments.force)?;
    writeln!(std::io::stdout().lock(), "{page}card {}", arguments.out.join(html).display())?;
    Ok(ExitCode::SUCCESS)
}

/// A direction.
fn degrees(text: &str) -> Result<f64, String> {
    let degrees = text.parse().ok().filter(|degrees| (0.0..=360.0).contains(degrees));
    degrees.ok_or_else(|| format!("`{text}` is not a direction of 0 to 360 degrees"))
}

/// The motor of a file, or of this name among others.
fn named(name: &str, found: &[Found]) -> anyhow::Result<Candidate> {
    let path = Path::new(name);
    let is_file = ["eng", "rse", "json"]
        .iter()
        .any(|ending| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending)));
    let of_file = if is_file || path.exists() { source::read(path)? } else { Vec::new() };
    if is_file || path.exists() {
        anyhow::ensure!(
            of_file.len() == 1,
            "--motor {name}: it holds {} motors, and one is accepted; or --from {name} --motor with one of their names",
            of_file.len()
        );
        let only = of_file.into_iter().next().context("no motor")?;
        return only.map_err(|unusable| anyhow::anyhow!("--motor {}: {}", unusable.origin, unusable.reason));
    }
    let is_it =
        |known: &str, alone: &str| known.eq_ignore_ascii_case(name) || alone.eq_ignore_ascii_case(name);
    let matching: Vec<&Candidate> = found
        .iter()
        .filter_map(|found| found.as_ref().ok())
        .filter(|motor| is_it(&motor.name(), motor.curve.name()) || motor.motor == name)
        .collect();
    match matching.as_slice() {
        [motor] => Ok((*motor).clone()),
        [] => {
            let broken = found.iter().filter_map(|found| found.as_ref().err()).find(|broken| {
                broken.name.eq_ignore_ascii_case(name)
                    || broken.name.rsplit(' ').next().is_some_and(|own| own.eq_ignore_ascii_case(name))
            });
            if let Some(broken) = broken {
                anyhow::bail!("--motor {name}: {}: {}", broken.origin, broken.reason);
            }
            let known: Vec<String> =
                found.iter().filter_map(|found| Some(found.as_ref().ok()?.name())).take(12).collect();
            anyhow::bail!(
                "--motor {name}: neither a motor file nor one of the {} motors ({}{})",
                found.len(),
                known.join(", "),
                if found.len() > known.len() { ", ..." } else { "" }
            )
        }
        several => {
            let names: Vec<String> =
                several.iter().map(|motor| format!("{} ({})", motor.name(), motor.origin)).collect();
            anyhow::bail!("--motor {name}: {} motors have this name: {}", several.len(), names.join(", "))
        }
    }
}

/// The vehicle and its world.
#[derive(Args)]
struct Choices {
    /// Built-in mission or TOML file: airframe, guidance and limits. Its motor is replaced.
    #[arg(long, default_value = flight::vehicles::mission::DEFAULT, value_name = "NAME|FILE")]
    mission: String,
    /// Motors: an .eng or .rse file, a folder of them, or the .json of the npm package thrustcurve-db; may be repeated. The
    /// built-in motors if not given.
    #[arg(long, value_name = "DIR|FILE")]
    from: Vec<PathBuf>,
    /// Ballast that can be added, kg; below zero it is taken out. By default up to 30 % of the mission's mass.
    #[arg(long, value_name = "FROM:TO", allow_hyphen_values = true)]
    ballast: Option<Range>,
    /// Widest motor that fits, mm. By default the diameter of the mission's own motor.
    #[arg(long, value_name = "MM")]
    tube: Option<f64>,
    /// Height of the centre of gravity at which the flight begins, m. By default the best apogee up to --highest, or the
    /// drop of the mission.
    #[arg(long, value_name = "M")]
    height: Option<f64>,
    /// Highest start, m: the best one up to this. By default the apogee of the mission.
    #[arg(long, value_name = "M", conflicts_with = "height")]
    highest: Option<f64>,
    /// Built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh, wild) or TOML file.
    #[arg(long, default_value = dispersion::DEFAULT, value_name = "NAME|FILE")]
    dispersion: String,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Motors or flights computed at the same time; the results do not depend on it.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
}

/// Two numbers in order.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Range([f64; 2]);

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let ends = text.split_once(':').and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
        ends.filter(|(from, to): &(f64, f64)| from.is_finite() && to.is_finite() && from <= to)
            .map(|(from, to)| Self([from, to]))
            .ok_or_else(|| format!("`{text}` is not FROM:TO, two numbers in order, as in 0:0.5"))
    }
}

impl Choices {
    fn team(&self) -> anyhow::Result<Team> {
        let recipe = recipe(&self.mission, None, &self.dispersion, self.seed)?;
        let mission = &recipe.mission;
        Ok(Team {
            ballast_kg: self.ballast_kg(mission),
            start: self.start(mission)?,
            tube_m: self.tube_m(mission)?,
            recipe,
        })
    }

    /// The motors to choose from.
    fn motors(&self) -> anyhow::Result<Vec<Found>> {
        if self.from.is_empty() {
            return Ok(source::built_in());
        }
        let mut found = Vec::new();
        for path in &self.from {
            found.extend(source::read(path)?);
        }
        Ok(found)
    }

    fn ballast_kg(&self, mission: &Mission) -> [f64; 2] {
        /// Of the loaded mass.
        const MOST_SHARE: f64 = 0.3;
        self.ballast.map_or([0.0, MOST_SHARE * mission.airframe.mass.loaded_kg], |Range(kg)| kg)
    }

    fn tube_m(&self, mission: &Mission) -> anyhow::Result<Option<f64>> {
        let body_mm = 1e3 * mission.airframe.body.diameter_m;
        if let Some(tube_mm) = self.tube {
            anyhow::ensure!(
                tube_mm > 0.0 && tube_mm <= body_mm,
                "--tube {tube_mm}: must be above 0 and up to {body_mm:.0} mm, the diameter of the body"
            );
        }
        Ok(self.tube.map(|tube_mm| 1e-3 * tube_mm))
    }

    fn start(&self, mission: &Mission) -> anyhow::Result<StartHeight> {
        /// The highest start that is accepted, m.
        const MOST_M: f64 = 3_000.0;
        for (option, height_m) in [("--height", self.height), ("--highest", self.highest)] {
            if let Some(height_m) = height_m {
                anyhow::ensure!(
                    height_m > 0.0 && height_m <= MOST_M,
                    "{option} {height_m}: must be above 0 and up to {MOST_M} m"
                );
            }
        }
        let own_m = mission.start_height_m();
        // A drone can hang anywhere, so a drop begins where the mission says.
        let own =
            if mission.start.at == StartPoint::Drone { StartHeight::Exactly } else { StartHeight::AtMost };
        Ok(match (self.height, self.highest) {
            (Some(height_m), _) => StartHeight::Exactly(height_m),
            (None, Some(highest_m)) => StartHeight::AtMost(highest_m),
            (None, None) => own(own_m),
        })
    }
}
