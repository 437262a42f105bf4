//! Flies the trials of `onboard-sim/mk3_trials.csv` again and writes their results there. A test
//! compares the tables of docs/build-mk3.md with them.
//!
//! `cargo run --release -p onboard-sim --example trials [TABLE]`

#[path = "../tests/onboard/trial.rs"]
mod trial;

use std::io::Write as _;

use onboard_sim::run::in_parallel;
use onboard_sim::tally;

use crate::trial::{PATH, Trial, read};

fn main() -> anyhow::Result<()> {
    let table = std::env::args().nth(1);
    let text = std::fs::read_to_string(PATH)?;
    let mut trials = read(&text)?;
    let mut stdout = std::io::stdout().lock();
    for at in 0..trials.len() {
        let trial = &mut trials[at];
        if table.as_ref().is_some_and(|table| trial.table != *table) {
            continue;
        }
        let recipe = trial.recipe()?;
        let numbers: Vec<u64> = (0..trial.flights).collect();
        let rows = in_parallel(&numbers, |number| tally::fly(&recipe, *number), &|_| {});
        let rows = rows.into_iter().collect::<Result<Vec<_>, _>>()?;
        trial.stands = rows.iter().filter(|row| row.stands).count() as u64;
        trial.envelope = rows.iter().filter(|row| row.stands && row.envelope).count() as u64;
        let table_2 = rows.iter().filter(|row| row.stands && row.table_2).count() as u64;
        trial.table_2 = Some(table_2);
        trial.first_m_s = rows[0].touchdown_vertical_m_s.map(|m_s| m_s.to_string()).unwrap_or_default();
        let Trial { table, row, stands, envelope, .. } = trial;
        writeln!(
            stdout,
            "{table} {row}: {stands} stand, {envelope} inside the envelope, {table_2} inside Table 2"
        )?;
        // After each row: the rest may be flown another time.
        std::fs::write(PATH, written(&text, &trials)?)?;
    }
    Ok(())
}

/// The file, with its comments.
fn written(text: &str, trials: &[Trial]) -> anyhow::Result<Vec<u8>> {
    let head = text.lines().take_while(|line| line.starts_with('#'));
    let mut written = head.flat_map(|line| [line, "\n"]).collect::<String>().into_bytes();
    let mut rows = csv::Writer::from_writer(&mut written);
    trials.iter().try_for_each(|trial| rows.serialize(trial))?;
    drop(rows);
    Ok(written)
}
