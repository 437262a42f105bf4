//! What `motors` and `card` have in common: the choices of a team on the command line, and the progress on the screen.

use std::io::{IsTerminal as _, Write as _};
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use flight::vehicle::mission::Mission;
use flight::vehicle::profile::StartPoint;
use motor_choice::choice::StartHeight;
use motor_choice::flown::Weather;
use motor_choice::mission_text::start_height_m;
use motor_choice::source::{self, Found};
use sim::dispersion::{self, Dispersion};

use super::campaign::text_of;

/// The vehicle and its world.
#[derive(Args)]
pub(super) struct Choices {
    /// Built-in mission or TOML file: airframe, guidance and limits. Its motor is replaced.
    #[arg(long, default_value = "mk2", value_name = "NAME|FILE")]
    mission: String,
    /// Motors: an .eng or .rse file, a folder of them, or the .json of the npm package thrustcurve-db; may be repeated. The
    /// built-in motors if not given.
    #[arg(long, value_name = "DIR|FILE")]
    from: Vec<PathBuf>,
    /// Ballast that can be added, kg; below zero it is taken out. By default up to 30 % of the mission's mass.
    #[arg(long, value_name = "FROM:TO", allow_hyphen_values = true)]
    ballast: Option<Range>,
    /// Where the ballast is, m above the nozzle. By default at the centre of gravity of the airframe without its motor.
    #[arg(long, value_name = "M")]
    ballast_station: Option<f64>,
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
    /// Built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh) or TOML file.
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
pub(super) struct Range([f64; 2]);

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let ends = text.split_once(':').and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
        ends.filter(|(from, to): &(f64, f64)| from.is_finite() && to.is_finite() && from <= to)
            .map(|(from, to)| Self([from, to]))
            .ok_or_else(|| format!("`{text}` is not FROM:TO, two numbers in order, as in 0:0.5"))
    }
}

/// A mission with its text.
pub(super) struct Loaded {
    pub(super) mission: Mission,
    pub(super) toml: String,
}

impl Choices {
    pub(super) fn load(&self) -> anyhow::Result<Loaded> {
        let toml = text_of(&self.mission, vehicles::mission::BUILTIN, "mission")?;
        let mission = vehicles::mission::from_toml(&toml, &self.mission)?;
        Ok(Loaded { mission, toml })
    }

    /// The motors to choose from.
    pub(super) fn motors(&self) -> anyhow::Result<Vec<Found>> {
        if self.from.is_empty() {
            return Ok(source::built_in());
        }
        let mut found = Vec::new();
        for path in &self.from {
            found.extend(source::read(path)?);
        }
        Ok(found)
    }

    pub(super) fn weather(&self) -> anyhow::Result<Weather> {
        let toml = text_of(&self.dispersion, dispersion::BUILTIN, "set of dispersions")?;
        Ok(Weather {
            dispersion: Dispersion::from_toml(&toml, &self.dispersion)?,
            dispersion_name: self.dispersion.clone(),
            dispersion_toml: toml,
            seed: self.seed,
        })
    }

    pub(super) fn ballast_kg(&self, mission: &Mission) -> [f64; 2] {
        /// Of the loaded mass.
        const MOST_SHARE: f64 = 0.3;
        self.ballast.map_or([0.0, MOST_SHARE * mission.airframe.mass.loaded_kg], |Range(kg)| kg)
    }

    pub(super) fn ballast_station_m(&self, mission: &Mission) -> anyhow::Result<Option<f64>> {
        let length_m = mission.airframe.body.length_m;
        if let Some(station_m) = self.ballast_station {
            anyhow::ensure!(
                (0.0..=length_m).contains(&station_m),
                "--ballast-station {station_m}: must be 0 (the nozzle) to {length_m} m (the nose)"
            );
        }
        Ok(self.ballast_station)
    }

    pub(super) fn tube_m(&self, mission: &Mission) -> anyhow::Result<Option<f64>> {
        let body_mm = 1e3 * mission.airframe.body.diameter_m;
        if let Some(tube_mm) = self.tube {
            anyhow::ensure!(
                tube_mm > 0.0 && tube_mm <= body_mm,
                "--tube {tube_mm}: must be above 0 and up to {body_mm:.0} mm, the diameter of the body"
            );
        }
        Ok(self.tube.map(|tube_mm| 1e-3 * tube_mm))
    }

    pub(super) fn start(&self, mission: &Mission) -> anyhow::Result<StartHeight> {
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
        let own_m = start_height_m(mission);
        // A drone can hang anywhere, so a drop begins where the mission says.
        let own =
            if mission.start.at == StartPoint::Drone { StartHeight::Exactly } else { StartHeight::AtMost };
        Ok(match (self.height, self.highest) {
            (Some(height_m), _) => StartHeight::Exactly(height_m),
            (None, Some(highest_m)) => StartHeight::AtMost(highest_m),
            (None, None) => own(own_m),
        })
    }

    pub(super) fn jobs(&self) -> usize {
        self.jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
    }
}

/// Shows on standard error how much of something is done: every per cent on a terminal, every tenth in a file.
pub(super) fn show(done: usize, of: usize, what: &str) {
    let on_terminal = std::io::stderr().is_terminal();
    let step = (of / if on_terminal { 100 } else { 10 }).max(1);
    if !done.is_multiple_of(step) && done != of {
        return;
    }
    let (before, after) = if on_terminal { ("\r\x1b[K", "") } else { ("", "\n") };
    let after = if done == of { "\n" } else { after };
    // Messages go to standard error, which may be closed.
    let _ = write!(std::io::stderr(), "{before}{done} of {of} {what}{after}");
}
