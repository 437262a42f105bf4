//! A folder of logs, a flight a line: what a season looks like.

use std::path::{Path, PathBuf};

use anyhow::Result;
use onboard_sim::run::in_parallel;
use protocol::program::Exit;
use serde::Serialize;

use super::{Info, info, utc};
use crate::cli::{Answer, logs_of};
use crate::log::worst_first;
use crate::print::columns;

/// One log in a line. Missing values are empty.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Flown {
    /// When it begins, UTC.
    pub date: String,
    pub vehicle: String,
    /// Greatest height, m.
    pub highest_m: Option<f64>,
    /// At contact, up, m/s.
    pub vertical_m_s: Option<f64>,
    /// Of the contact from the pad, m.
    pub distance_m: Option<f64>,
    /// How the flight ended, or that the log cannot be read.
    pub ending: String,
    /// The limit of the legs that was used most, with its share.
    pub worst_limit: String,
    /// What went wrong first, with the log too.
    pub finding: String,
    pub file: String,
}

impl Flown {
    fn of(info: &Info) -> Self {
        let verdict = info.verdict.as_ref();
        let at_contact = |name: &str| {
            let limits =
                verdict.into_iter().flat_map(|verdict| verdict.envelope.iter().chain(&verdict.table_2));
            limits.into_iter().find(|limit| limit.name == name).map(|limit| limit.value)
        };
        let worst = verdict.and_then(|verdict| worst_first(verdict.of_the_legs()).into_iter().next());
        let worst = worst.map(|(limit, share)| {
            let share = if share.is_finite() { format!(" x {share:.2}") } else { String::new() };
            format!("{}{share}", limit.name)
        });
        let first = info.findings.iter().flatten().next().map(|found| found.words.clone());
        let first = first.or_else(|| Some(info.no_findings()));
        let cut = info.completeness.cut.as_ref().map(|cut| format!("the flight {cut}"));
        let lost = [info.completeness.damage.clone(), cut, first];
        let vehicle = info.profile.as_ref().and_then(|profile| profile.name.clone());
        Self {
            // To the minute.
            date: info.span.map_or(String::new(), |span| utc(span.first_ns).chars().take(16).collect()),
            vehicle: vehicle.or_else(|| info.run.get("profile").cloned()).unwrap_or_default(),
            highest_m: info.highest_m,
            vertical_m_s: at_contact("vertical speed"),
            distance_m: at_contact("distance"),
            ending: info.ending.clone().unwrap_or_else(|| "no verdict".to_owned()),
            worst_limit: worst.unwrap_or_default(),
            finding: lost.into_iter().flatten().collect::<Vec<_>>().join("; "),
            file: info.file.clone(),
        }
    }
}

/// The logs of a folder, first in time; one that cannot be read has its line too.
///
/// # Errors
/// The folder cannot be read, or has no log.
pub fn season(folder: &Path) -> Result<Vec<Flown>> {
    let line = |path: &PathBuf| {
        info(path).map_or_else(
            |error| {
                let file = path.display().to_string();
                let reason = format!("{:#}", anyhow::Error::from(error)).replace(&format!("{file}: "), "");
                Flown { ending: UNREAD.to_owned(), finding: reason, file, ..Flown::default() }
            },
            |info| Flown::of(&info),
        )
    };
    let mut flown = in_parallel(&logs_of(folder)?, line, &|_| {});
    // The same minute: by name.
    flown.sort_by(|a, b| a.date.cmp(&b.date));
    Ok(flown)
}

/// How a log that cannot be read ends.
const UNREAD: &str = "CANNOT BE READ";

/// A season as a table.
#[derive(Serialize)]
#[serde(transparent)]
pub(super) struct Season(pub(super) Vec<Flown>);

impl Answer for Season {
    fn sentences(&self) -> Vec<String> {
        let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.1}"));
        let head = [
            "date",
            "vehicle",
            "highest m",
            "m/s",
            "place m",
            "ending",
            "worst limit",
            "first finding",
            "log",
        ];
        let row = |flown: &Flown| {
            let Flown { date, vehicle, mut ending, worst_limit, finding, file, .. } = flown.clone();
            // The column of the worst limit makes the list of limits redundant.
            let kept = [", inside ", ", outside "].iter().filter_map(|word| ending.find(word)).min();
            ending.truncate(kept.unwrap_or(ending.len()));
            let [highest, vertical, place] =
                [flown.highest_m, flown.vertical_m_s, flown.distance_m].map(number);
            [date, vehicle, highest, vertical, place, ending, worst_limit, finding, file]
        };
        let sides = ['<', '<', '>', '>', '>', '<', '<', '<', '<'];
        columns(sides, std::iter::once(head.map(str::to_owned)).chain(self.0.iter().map(row)))
    }

    fn outcome(&self) -> Exit {
        if self.0.iter().any(|flown| flown.ending == UNREAD) { Exit::NotSeen } else { Exit::Yes }
    }
}
