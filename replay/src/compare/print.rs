//! A comparison for people.

use super::{Align, Comparison, SignalDifference};
use crate::cli::Answer;
use crate::print::{columns, counted, limits_of_both, verdict_table, word};
use protocol::program::Exit;

/// Most signals listed that differ.
const SIGNALS_SHOWN: usize = 60;
/// Limits that are nearer, as a share of their range, are the same: a station receives them as
/// `f32`.
const SAME: f64 = 1e-4;
/// Most limits named in which the landings differ.
const LIMITS_SHOWN: usize = 3;
/// Most names listed.
const NAMES_SHOWN: usize = 20;

impl Answer for Comparison {
    fn sentences(&self) -> Vec<String> {
        let aligned = match self.align {
            Align::Ignition => "ignition",
            Align::Time => "vehicle time",
        };
        let mut lines = self.landings();
        lines.push(self.sentence());
        lines.push(format!("aligned on {aligned}: {:+.6} s added to the second's times", self.shift_s));
        lines.push(format!(
            "{} of both flights, {} of them identical; {} missing, {} added",
            counted(self.signals.len() as u64, "signal"),
            self.identical(),
            self.missing.len(),
            self.added.len()
        ));
        let differing: Vec<_> = self.signals.iter().filter(|signal| !signal.is_identical()).collect();
        if !differing.is_empty() {
            let head = ["signal", "samples", "rms", "max", "at s"].map(str::to_owned);
            let rows = differing.iter().take(SIGNALS_SHOWN).map(|signal| signal.row());
            lines.extend(columns(['<', '>', '>', '>', '>'], std::iter::once(head).chain(rows)));
            lines.extend(more(differing.len(), SIGNALS_SHOWN));
        }
        for (what, names) in [("missing", &self.missing), ("added", &self.added)] {
            if !names.is_empty() {
                let listed: Vec<&str> = names.iter().take(NAMES_SHOWN).map(String::as_str).collect();
                lines.push(format!("{what}: {}", listed.join(", ")));
                lines.extend(more(names.len(), NAMES_SHOWN));
            }
        }
        if self.failures.len() > 1 {
            lines.push("NOT like the first:".to_owned());
            lines.extend(self.failures.iter().map(|failure| format!("- {failure}")));
        }
        lines
    }

    fn outcome(&self) -> Exit {
        Exit::of(self.failures.is_empty())
    }
}

impl Comparison {
    /// What differs in the landings; nothing of two logs without one.
    fn landings(&self) -> Vec<String> {
        let both = [self.verdicts.0.as_ref(), self.verdicts.1.as_ref()];
        let different = limits_of_both(both).into_iter().filter(|(apart, _)| *apart > SAME);
        let [then, now] = both.map(word);
        let most = different
            .take(LIMITS_SHOWN)
            .map(|(_, [name, first, second, _])| format!("{name} {first} and {second}"));
        let most = match most.collect::<Vec<_>>() {
            _ if both == [None; 2] => return Vec::new(),
            _ if both.contains(&None) => "of one landing nothing is known".to_owned(),
            same if same.is_empty() => "no limit differs".to_owned(),
            most => format!("most different: {}", most.join(", ")),
        };
        let sentence = format!("{}: {then}; {}: {now}; {most}", self.baseline, self.other);
        [vec![sentence], verdict_table(["first", "second"], both)].concat()
    }

    /// The answer in one sentence.
    fn sentence(&self) -> String {
        let Self { baseline, other, signals, failures, .. } = self;
        let tables = counted(self.tables() as u64, "table");
        let (all, differing) = (counted(signals.len() as u64, "signal"), signals.len() - self.identical());
        match failures.as_slice() {
            [] if differing == 0 => {
                format!("{other} is like {baseline}: all {all} of {tables} are identical")
            }
            [] => format!("{other} is like {baseline}: {differing} of {all} of {tables} differ"),
            [only] => format!("{other} is NOT like {baseline}: {only}"),
            [first, more @ ..] => {
                format!("{other} is NOT like {baseline}: {first}; and {} more below", more.len())
            }
        }
    }
}

impl SignalDifference {
    fn row(&self) -> [String; 5] {
        let [ours, theirs] = self.samples_of;
        let samples = if ours == theirs { ours.to_string() } else { format!("{ours}, {theirs}") };
        [
            self.signal.clone(),
            samples,
            format!("{:.4e}", self.rms),
            format!("{:.4e}", self.max),
            self.max_at_s.map(|at_s| format!("{at_s:.3}")).unwrap_or_default(),
        ]
    }
}

fn more(all: usize, shown: usize) -> Option<String> {
    (all > shown).then(|| format!("and {} more that differ", all - shown))
}
