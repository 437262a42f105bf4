//! `replay compare`.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use clap::{Args, ValueEnum};
use replay::compare::{Align, Comparison, Flown, Tolerances, compare};
use replay::print::{compare_cases, print_compare, print_json, print_junit};

use super::{Answer, answer, warn_of_cut, warn_of_damage};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The flight to compare with.
    baseline: PathBuf,
    /// The other flights.
    #[arg(required = true)]
    others: Vec<PathBuf>,
    /// The event on which the flights are aligned [default: ignition if both flights have one, else vehicle time].
    #[arg(long, value_enum)]
    align: Option<AlignOn>,
    /// Tolerances, a TOML file.
    ///
    /// [signals."NAME"] with rms and max in the signal's own unit; a * at the end of NAME matches any rest. Before
    /// that: `verdict = false` lets the verdicts differ; `missing = N` and `added = N` allow this many signals that
    /// only one flight has; `samples_missing = SHARE` and `samples_added = SHARE` allow this share of each signal's
    /// samples (also possible for one signal, after its max); `damaged = true` allows logs that are damaged or end
    /// before their flight did. Anything left out is not tolerated.
    #[arg(long, value_name = "FILE")]
    tolerances: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long, conflicts_with = "junit")]
    json: bool,
    /// Answer in JUnit XML.
    #[arg(long)]
    junit: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum AlignOn {
    /// Ignition of the landing motor.
    Ignition,
    /// Touchdown.
    Touchdown,
    /// Vehicle time itself.
    Time,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let tolerances = self.tolerances.as_deref().map(read).transpose()?.unwrap_or_default();
        let baseline = open(&self.baseline)?;
        let mut comparisons = Vec::new();
        for path in &self.others {
            let other = open(path)?;
            let align = match self.align {
                None => Align::best_for(&baseline, &other),
                Some(AlignOn::Ignition) => Align::Ignition,
                Some(AlignOn::Touchdown) => Align::Touchdown,
                Some(AlignOn::Time) => Align::Time,
            };
            comparisons.push(compare(&baseline, &other, align, &tolerances)?);
        }
        answer(|output| match () {
            () if self.json => print_json(&comparisons, output),
            () if self.junit => print_junit("compare", compare_cases(&comparisons), output),
            () => print_compare(&comparisons, output),
        })?;
        let within = |comparison: &Comparison| comparison.failures.is_empty();
        Ok(Answer::Compared { within: comparisons.iter().all(within) })
    }
}

fn open(path: &Path) -> Result<Flown> {
    let flown = Flown::open(path)?;
    warn_of_damage(&flown.name, flown.damage.as_deref());
    warn_of_cut(&flown.name, flown.cut.as_ref());
    Ok(flown)
}

fn read(path: &Path) -> Result<Tolerances> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    Ok(Tolerances::from_toml(&text, &name)?)
}
