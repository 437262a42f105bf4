//! The trials of mk3 are those of this program, and the page shows them.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use onboard_sim::tally;

use crate::trial::{PATH, Trial, read};

fn trials() -> Vec<Trial> {
    read(&std::fs::read_to_string(PATH).unwrap()).unwrap()
}

/// Numbers of a row of the page's tables: the first whose first cell begins so, behind a heading.
fn row(heading: &str, first: &str) -> Vec<u64> {
    let page = include_str!("../../../docs/build-mk3.md");
    let section = page.split(heading).nth(1).unwrap();
    let row = section.lines().find(|line| line.starts_with(&format!("| {first}"))).unwrap();
    let cells = row.split('|').skip(2).flat_map(|cell| cell.split([',', ';']));
    let number = |text: &str| text.split_whitespace().next().and_then(|word| word.parse().ok());
    cells.filter_map(number).collect()
}

/// A column of the trials.
type Column = fn(&Trial) -> u64;

#[test]
fn the_tables_of_the_page_are_the_measured_ones() {
    let trials = trials();
    let of = |table: &str, which: Column| -> Vec<u64> {
        trials.iter().filter(|trial| trial.table == table).map(which).collect()
    };
    let (stands, envelope): (Column, Column) = (|trial| trial.stands, |trial| trial.envelope);
    assert_eq!(row("\n### Mass\n", "stand"), of("mass", stands));
    assert_eq!(row("\n### Mass\n", "inside"), of("mass", envelope));
    for (table, heading) in [("reset", "| reset |"), ("brown-out", "| brown-out |")] {
        let (stands, envelope) = (of(table, stands), of(table, envelope));
        let rows = ["at ignition, 0.05", "at ignition, 0.5", "in the fall", "in the burn"];
        let found: Vec<Vec<u64>> = rows.iter().map(|first| row(heading, first)).collect();
        let mut flown: Vec<(u64, u64)> = stands.into_iter().zip(envelope).collect();
        if table == "reset" {
            flown.remove(0);
        }
        let three = |which: fn(&(u64, u64)) -> u64| flown[..3].iter().map(which).collect::<Vec<_>>();
        assert_eq!(found[0], [three(|pair| pair.0), three(|pair| pair.1)].concat(), "{table}");
        for (found, pair) in found[1..].iter().zip(&flown[3..]) {
            assert_eq!([found[0], found[found.len() - 1]], [pair.0, pair.1], "{table}");
        }
    }
    let counts = |trial: &Trial| -> Vec<u64> {
        [Some(trial.stands), Some(trial.envelope), trial.table_2].into_iter().flatten().collect()
    };
    for trial in trials.iter().filter(|trial| trial.table == "change") {
        assert_eq!(row("\n## Trials\n", &format!("{} |", trial.row)), counts(trial), "{}", trial.row);
    }
    for first in ["as built", "softer"] {
        let of_plan = trials.iter().filter(|trial| trial.table == "plan" && trial.row.starts_with(first));
        assert_eq!(row("\n### A softer plan\n", first), of_plan.flat_map(counts).collect::<Vec<_>>());
    }
    let late = trials.iter().find(|trial| trial.row.starts_with("igniters")).unwrap();
    let sentence = format!("Igniters that all need 0.4 s land\n  {} of {}.", late.stands, late.flights);
    assert!(include_str!("../../../docs/build-mk3.md").contains(&sentence), "{sentence}");
}

#[test]
fn the_measured_trials_are_those_of_this_program() {
    for trial in trials() {
        let row = tally::fly(&trial.recipe().unwrap(), 0).unwrap();
        let first_m_s = row.touchdown_vertical_m_s.map(|m_s| m_s.to_string()).unwrap_or_default();
        assert!(
            first_m_s == trial.first_m_s,
            "{} {}: flight 0 meets the ground at {first_m_s} m/s, and at {} when the file was written: run the example `trials`",
            trial.table,
            trial.row,
            trial.first_m_s
        );
    }
}
