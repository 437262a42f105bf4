//! `replay fit`.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use clap::Args;
use flight::vehicle::thrust_curve::ThrustCurve;
use replay::fit::{Fit, Trace, fit, fit_stand, patched, pooled, read_stand};
use replay::print::{FitReport, print_fit, print_json};

use super::{Answer, answer, refuse_existing, say, warn_of_damage, write_new};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// Logs of vehicles (MCAP), and tables of a test stand (CSV with time_s from the ignition command, and thrust_n).
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The motor that a table is compared with: a built-in one, or a .eng or .rse file.
    #[arg(long, value_name = "NAME|FILE")]
    motor: Option<String>,
    /// Write the mission of the only log, with what was found of its vehicle. An existing file is kept.
    #[arg(long, value_name = "FILE")]
    write_mission: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        if self.write_mission.is_some() && (self.files.len() != 1 || is_table(&self.files[0])) {
            bail!("--write-mission takes the log of one flight: its mission is changed");
        }
        if let Some(motor) = &self.motor
            && !self.files.iter().any(|file| is_table(file))
        {
            bail!(
                "--motor {motor}: only a table of a test stand (CSV) is compared with a motor; a log has its own"
            );
        }
        if let Some(path) = &self.write_mission {
            refuse_existing(path)?;
        }
        let (mut fits, mut refused) = (Vec::new(), false);
        for file in &self.files {
            match self.one(file) {
                Ok(fit) => fits.push(fit),
                Err(error) if self.files.len() == 1 => return Err(error),
                // One unreadable log must not hide the others.
                Err(error) => {
                    refused = true;
                    say(&format!("{error:#}"));
                }
            }
        }
        let together = pooled(&fits);
        let report = FitReport { fits, together };
        answer(|output| if self.json { print_json(&report, output) } else { print_fit(&report, output) })?;
        for fit in &report.fits {
            warn_of_damage(&fit.source, fit.damage.as_deref());
        }
        Ok(if refused { Answer::NotAll } else { Answer::Given })
    }

    fn one(&self, file: &Path) -> Result<Fit> {
        let name = file.display().to_string();
        if is_table(file) {
            let motor = self.motor.as_deref().with_context(|| {
                format!("{name}: --motor is missing: a table is compared with the motor's certified curve")
            })?;
            let text = std::fs::read_to_string(file).with_context(|| format!("{name}: cannot be read"))?;
            let rows = read_stand(&text).with_context(|| name.clone())?;
            return fit_stand(&name, &rows, &curve_of(motor)?).context(name);
        }
        let trace = Trace::open(file)?;
        let found = fit(&trace);
        if let Some(path) = &self.write_mission {
            let text = patched(&trace.mission_toml, &found).context("the mission with what was found")?;
            write_new(path, &text)?;
            say(&format!("{}: --profile of `onboard-sim fly` and `campaign` takes it", path.display()));
        }
        Ok(found)
    }
}

fn is_table(file: &Path) -> bool {
    file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"))
}

fn curve_of(motor: &str) -> Result<ThrustCurve> {
    if vehicles::motors::names().any(|known| known == motor) {
        return Ok(vehicles::motors::builtin(motor)?);
    }
    let text = std::fs::read_to_string(motor).with_context(|| {
        let known = vehicles::motors::names().collect::<Vec<_>>().join(", ");
        format!("'{motor}' is neither a built-in motor ({known}) nor a readable file")
    })?;
    vehicles::thrust_curve::from_file_text(motor, &text).with_context(|| motor.to_owned())
}
