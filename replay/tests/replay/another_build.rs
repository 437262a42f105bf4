//! Tests logs that this build would not produce: every command says so, so that nobody blames the settings for it.

use replay::evaluate::evaluate;
use replay::evaluate::print_evaluate;
use replay::log::Recording;
use replay::refly::ReflyOptions;
use replay::refly::vary::print_sweep;
use replay::refly::vary::{SweepReport, grid, sweep};

use crate::asked::settings;
use crate::simulated::MK2;

/// A report as text.
fn words(print: impl FnOnce(&mut Vec<u8>) -> std::io::Result<()>) -> String {
    let mut output = Vec::new();
    print(&mut output).unwrap();
    String::from_utf8(output).unwrap()
}

/// The landing, with two commands that this build would not give.
fn forged() -> Recording {
    let mut recording = MK2.recording();
    for place in [20, 30] {
        recording.frames[place].output.gimbal_rad[0] += 0.01;
    }
    recording
}

#[test]
fn an_evaluation_counts_differences_caused_by_the_build() {
    let forged = forged();
    let said = format!(
        "with nothing changed this build decides 2 of {} frames differently from the record",
        forged.frames.len()
    );
    for given in [&[][..], &["powered.weights.theta=300"]] {
        let report = evaluate(&forged, &settings(given)).unwrap();
        assert_eq!(report.unchanged_different, 2, "{given:?}");
        let text = words(|output| print_evaluate(&report, output));
        assert!(text.contains(&said), "{text}");
    }
    let own = evaluate(&MK2.recording(), &settings(&["powered.weights.theta=300"])).unwrap();
    assert!(own.unchanged_different == 0 && own.commands_different > 0);
    assert!(!words(|output| print_evaluate(&own, output)).contains("with nothing changed"));
}

fn swept(flights: &[Recording]) -> SweepReport {
    let points = grid(&["powered.weights.theta=110".parse().unwrap()], &[]).unwrap();
    sweep(flights, &points, &ReflyOptions::default(), &|_, _| {}).unwrap()
}

#[test]
fn a_sweep_names_the_flights_that_are_not_reproduced() {
    let other = Recording { name: "other.mcap".to_owned(), ..forged() };
    let report = swept(&[MK2.recording(), other]);
    assert_eq!(report.not_reproduced, ["other.mcap"]);
    let text = words(|output| print_sweep(&report, output));
    assert!(
        text.contains("other.mcap: with nothing changed this build does not fly it as recorded"),
        "{text}"
    );
}
