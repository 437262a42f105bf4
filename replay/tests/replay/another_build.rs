//! Tests logs that this build would not produce: every command reports it, so that the settings are
//! not blamed.

use replay::cli::Answer as _;
use replay::evaluate::evaluate;
use replay::log::Recording;

use crate::settings::settings;
use crate::simulated::MK2;

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
        assert!(report.sentences().contains(&said), "{report:?}");
    }
    let own = evaluate(&MK2.recording(), &settings(&["powered.weights.theta=300"])).unwrap();
    assert!(own.unchanged_different == 0 && own.commands_different > 0);
}
