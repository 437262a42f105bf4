//! Loss, lost answers, refusals, silence: what the crew is told, and that it can act nevertheless.

use std::time::Duration;

use e2e::Weather;

use crate::stage::{ABORT, ARM, START, Stage};

/// A third of everything lost, a fifth doubled, all of it late.
const BAD: Weather = Weather {
    lost: 300,
    doubled: 200,
    late: Duration::from_millis(200),
    eats_answers: false,
    silent: false,
    uplink_silent: false,
};

#[test]
fn through_heavy_loss_the_ladder_arms_and_the_abort_arrives() {
    let mut stage = Stage::set("paper-calibrated");
    stage.terminal.wait_for("PAD_IDLE");
    stage.air.set(BAD);
    let climbed = stage.arm();
    assert!((1..=climbed).contains(&stage.sent(ARM, 1.0)), "an arm is sent once for each ladder at most");
    stage.abort();
    let attempts = stage.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    assert_eq!(attempts, stage.sent(ABORT, 1.0), "the screen counts what went out");
    stage.terminal.wait_for(" disarmed");
    stage.terminal.wait_until("that nobody may come near", |window| {
        let rows = window.rows().concat();
        (rows.contains("STAY OFF THE PAD") || rows.contains("do not approach")).then_some(())
    });
    assert_eq!(stage.sent(START, 0.0), 0);

    // A latched abort refuses the next arming, and says why.
    stage.air.set(Weather::default());
    stage.terminal.wait_for("NO  abort latch");
    stage.type_until(b"AARM\r", "ARM REFUSED by the vehicle");
    stage.terminal.wait_until("the refusal, its check and the value found", |window| {
        let events = window.rows().concat();
        (events.contains("abort latch") && events.contains("latched")).then_some(())
    });
    assert!(!stage.terminal.look().shows(" ARMED "));
}

#[test]
fn an_abort_whose_answers_are_lost_is_repeated_and_said_to_be_seen() {
    let mut stage = Stage::set("paper-calibrated");
    stage.arm();
    stage.air.set(Weather { eats_answers: true, ..Weather::default() });
    stage.abort();
    // Observed is one fact, acknowledged another.
    stage.wait_for_fact("ABORT", "acknowledged waiting  observed yes");
    stage.wait_for_attempts("ABORT", 4);
    stage.terminal.wait_for("ABORT NOT ACKNOWLEDGED yet; repeated");
    stage.air.set(Weather::default());
    let attempts = stage.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    assert_eq!(attempts, stage.sent(ABORT, 1.0));
}

#[test]
fn an_arm_whose_answer_is_lost_is_not_sent_again_and_the_vehicle_is_believed() {
    let mut stage = Stage::set("paper-calibrated");
    stage.terminal.wait_for("GO: every arming check passes");
    stage.air.set(Weather { eats_answers: true, ..Weather::default() });
    stage.terminal.type_by_hand(b"AARM\r");
    stage.wait_for_fact("ARM", "acknowledged NEVER  observed yes");
    stage.terminal.wait_for(" ARMED ");
    assert_eq!(stage.sent(ARM, 1.0), 1);
}

#[test]
fn in_silence_everything_is_old_the_path_is_a_prediction_and_an_abort_goes_on() {
    let mut stage = Stage::set("paper-calibrated");
    stage.arm();
    stage.start();
    stage.terminal.wait_for(" POWERED");
    stage.air.set(Weather { silent: true, ..Weather::default() });
    stage.terminal.wait_for("~POWERED");
    stage.terminal.wait_for("~ARMED");
    stage.terminal.wait_for("LINK LOST");
    stage.terminal.wait_for("PREDICTED, not heard");
    stage.terminal.wait_for("last heard ");
    stage.terminal.wait_for("MAY NOT ARRIVE");
    stage.abort();
    stage.wait_for_attempts("ABORT", 5);
    stage.wait_for_fact("ABORT", "acknowledged waiting  observed not yet");
    stage.air.set(Weather::default());
    // By now it stands on the ground, or is about to.
    stage.terminal.wait_for(" down 0s up 0s");
    let attempts = stage.wait_for_fact("ABORT", "acknowledged ");
    assert!(attempts >= 5, "{attempts}");
    stage.terminal.wait_until("an answer to the abort", |window| {
        let facts = window.row_with("ABORT  commanded")?;
        (facts.contains("accepted") || facts.contains("REFUSED")).then_some(())
    });
}
