//! `replay learn`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use anyhow::{Context as _, Result, ensure};
use clap::Args;
use replay::fit::{Fit, Trace, fit};
use replay::learn::{self, learn};
use replay::print::{print_json, print_learn};
use serde::Deserialize;

use super::{Answer, answer, refuse_existing, say, text_of, warn_of_damage, write_new};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// Logs of vehicles (MCAP), or answers of `replay fit --json`, of one vehicle with one motor lot.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Mission of the next flight: built-in or TOML file [default: that of the first log]. Scales of fits over other data of
    /// the same vehicle and motor are converted.
    #[arg(long, value_name = "NAME|FILE")]
    mission: Option<String>,
    /// Prior: built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh) or TOML file.
    #[arg(long, default_value = sim::dispersion::DEFAULT, value_name = "NAME|FILE")]
    prior: String,
    /// Simulated flights of the day; with fewer the interval gets wider.
    #[arg(long, default_value_t = 1000, value_name = "N")]
    flights: usize,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Landing rate that the club wants at least.
    #[arg(long, default_value_t = 0.95, value_name = "SHARE")]
    limit: f64,
    /// Risk that is taken of flying below it: GO if the probability is no higher.
    #[arg(long, default_value_t = 0.1, value_name = "SHARE")]
    risk: f64,
    /// Write mission.toml and dispersion.toml of the day into this directory, for `onboard-sim campaign`. Existing files are
    /// kept.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Flights at the same time; the answer does not depend on it [default: all processors].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

/// The files of the day.
const FILES: [&str; 2] = ["mission.toml", "dispersion.toml"];

/// An answer of `replay fit --json`.
#[derive(Deserialize)]
struct Fits {
    fits: Vec<Fit>,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        for (name, share) in [("--limit", self.limit), ("--risk", self.risk)] {
            ensure!((0.0..=1.0).contains(&share), "{name} {share}: must be 0 to 1");
        }
        if let Some(out) = &self.out {
            FILES.iter().try_for_each(|name| refuse_existing(&out.join(name)))?;
        }
        let (mut fits, mut flown) = (Vec::new(), None);
        for file in &self.files {
            if file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json")) {
                let text = std::fs::read_to_string(file)
                    .with_context(|| format!("{}: cannot be read", file.display()))?;
                let read: Fits = serde_json::from_str(&text)
                    .with_context(|| format!("{}: is no answer of `replay fit --json`", file.display()))?;
                fits.extend(read.fits);
            } else {
                let trace = Trace::open(file)?;
                let found = fit(&trace);
                warn_of_damage(&found.source, found.damage.as_deref());
                fits.push(found);
                flown.get_or_insert(trace.mission_toml);
            }
        }
        let mission_toml = match (&self.mission, flown) {
            (Some(name), _) => text_of(name, vehicles::mission::BUILTIN, "mission")?,
            (None, Some(flown)) => flown,
            (None, None) => anyhow::bail!("--mission is missing: fits do not hold their mission"),
        };
        let set = text_of(&self.prior, sim::dispersion::BUILTIN, "set of dispersions")?;
        let jobs =
            self.jobs.or_else(|| std::thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN);
        say(&format!("simulates {} flights of the day; a thousand take some minutes", self.flights));
        let learnt = learn(
            &fits,
            &learn::Ask {
                mission_toml: &mission_toml,
                set: (&self.prior, &set),
                flights: self.flights,
                seed: self.seed,
                limit: self.limit,
                risk: self.risk,
                jobs,
            },
        )?;
        if let Some(out) = &self.out {
            std::fs::create_dir_all(out).with_context(|| format!("{}: cannot be made", out.display()))?;
            write_new(&out.join(FILES[0]), &learnt.day.mission_toml)?;
            write_new(&out.join(FILES[1]), &learnt.day.dispersion_toml)?;
            let out = out.display();
            say(&format!(
                "onboard-sim campaign --profile {out}/mission.toml --dispersion {out}/dispersion.toml --out flights"
            ));
        }
        answer(|output| if self.json { print_json(&learnt, output) } else { print_learn(&learnt, output) })?;
        Ok(Answer::Compared { within: learnt.go })
    }
}
