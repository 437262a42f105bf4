//! Writes into `onboard-sim/landing_rates.csv` how often campaigns landed. A test compares the
//! pages with it.
//!
//! `cargo run -p onboard-sim --example landing_rates -- DIR...`
//!
//! Each DIR is the `--out` of an `onboard-sim campaign`. A row with the same mission and dispersion
//! is replaced in place; others stay.

use anyhow::{Context as _, Result};
use flight::rules::verdict::Landing;
use serde_json::Value;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/landing_rates.csv");

fn main() -> Result<()> {
    let text = std::fs::read_to_string(PATH).context(PATH)?;
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for directory in std::env::args().skip(1) {
        let (begins, row) = row_of(&directory).with_context(|| directory.clone())?;
        match lines.iter_mut().find(|line| line.starts_with(&begins)) {
            Some(line) => *line = row,
            None => lines.push(row),
        }
    }
    std::fs::write(PATH, lines.join("\n") + "\n").context(PATH)
}

/// How the row begins, and the row.
fn row_of(directory: &str) -> Result<(String, String)> {
    let summary: Value =
        serde_json::from_str(&std::fs::read_to_string(format!("{directory}/summary.json"))?)?;
    let manifest = &summary["manifest"];
    let word = |key: &str| manifest[key].as_str().with_context(|| format!("no {key}"));
    let begins = format!("{},{},", word("mission")?, word("dispersion")?);
    let counts = Landing::COLUMNS.map(|column| summary[column]["count"].to_string()).join(",");
    let commit: String = word("build")?.split(' ').nth(1).unwrap_or_default().chars().take(7).collect();
    let row = format!("{begins}{},{},{counts},{commit}", manifest["seed"], manifest["flights"]);
    Ok((begins, row))
}
