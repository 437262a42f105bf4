//! Loss, lost answers, refusals and silence: what the screen shows, and that the crew can still
//! act.

use std::time::Duration;

use e2e::{ABORT, ARM, Impairment, START};

use super::rig::Rig;

/// A third of the datagrams is lost, a fifth duplicated, and all are delayed.
const BAD: Impairment = Impairment {
    lost_per_1000: 300,
    duplicated_per_1000: 200,
    delay_max: Duration::from_millis(200),
    drops_answers: false,
    drops_all: false,
    drops_uplink: false,
};

#[test]
fn with_heavy_loss_arming_works_and_the_abort_arrives() {
    let mut rig = Rig::new("mk2");
    rig.terminal.wait_for("PAD_IDLE");
    rig.proxy.impair(BAD);
    let climbed = rig.arm();
    assert!(
        (1..=5 * climbed).contains(&rig.sent(ARM, 1.0)),
        "an arm command was sent more than five times for each that was typed"
    );
    rig.abort();
    let attempts = rig.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    assert_eq!(attempts, rig.sent(ABORT, 1.0), "the screen shows another number of attempts than were sent");
    rig.terminal.wait_for(" disarmed");
    rig.terminal.wait_until("the warning to stay away", |window| {
        let rows = window.rows().concat();
        rows.contains("do not approach").then_some(())
    });
    assert_eq!(rig.sent(START, 0.0), 0);

    // A latched abort makes the vehicle refuse the next arming, with the reason.
    rig.proxy.impair(Impairment::default());
    rig.terminal.wait_for("NO  abort latch");
    rig.type_until(b"AARM\r", "acknowledged REFUSED (denied)");
    rig.terminal.wait_until("the refusal, its check and the value found", |window| {
        let events = window.rows().concat();
        (events.contains("abort latch") && events.contains("latched")).then_some(())
    });
    assert!(!rig.terminal.window().shows(" ARMED "));
}

#[test]
fn an_abort_whose_answers_are_lost_is_repeated_and_reported_as_observed() {
    let mut rig = Rig::new("mk2");
    rig.arm();
    rig.proxy.impair(Impairment { drops_answers: true, ..Impairment::default() });
    rig.abort();
    // Observed and acknowledged are different facts.
    rig.wait_for_fact("ABORT", "acknowledged waiting  observed yes");
    rig.wait_for_attempts("ABORT", 4);
    rig.terminal.wait_for("ABORT NOT ACKNOWLEDGED yet; repeated");
    rig.proxy.impair(Impairment::default());
    let attempts = rig.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    assert_eq!(attempts, rig.sent(ABORT, 1.0));
}

#[test]
fn an_arm_whose_answers_are_lost_is_repeated_for_two_seconds_done_once_and_the_heartbeat_decides() {
    let mut rig = Rig::new("mk2");
    rig.terminal.wait_for("every arming check passes");
    rig.proxy.impair(Impairment { drops_answers: true, ..Impairment::default() });
    // A hand types again only if nothing was sent: keys may arrive so bunched that they are
    // confirmed again.
    rig.type_until(b"AARM\r", "ARM    commanded");
    rig.wait_for_fact("ARM", "acknowledged NEVER  observed yes");
    rig.terminal.wait_for(" ARMED ");
    assert_eq!(rig.sent(ARM, 1.0), 5);
}

#[test]
fn without_a_link_values_are_marked_old_the_path_is_predicted_and_an_abort_is_repeated() {
    let mut rig = Rig::new("mk2");
    rig.fly();
    rig.terminal.wait_for(" AERO_DESCENT ");
    rig.proxy.impair(Impairment { drops_all: true, ..Impairment::default() });
    rig.terminal.wait_for("~AERO_DESCENT");
    rig.terminal.wait_for("~ARMED");
    rig.terminal.wait_for("LINK LOST");
    rig.terminal.wait_for(" PREDICTED ");
    rig.terminal.wait_for("last data ");
    rig.terminal.wait_for("MAY NOT ARRIVE");
    rig.abort();
    rig.wait_for_attempts("ABORT", 5);
    rig.wait_for_fact("ABORT", "acknowledged waiting  observed not yet");
    rig.proxy.impair(Impairment::default());
    // The vehicle has landed by now, or is about to.
    rig.terminal.wait_for(" down 0s up 0s");
    let attempts = rig.wait_for_fact("ABORT", "acknowledged ");
    assert!(attempts >= 5, "{attempts}");
    rig.terminal.wait_until("an answer to the abort", |window| {
        let facts = window.facts_about("ABORT")?;
        (facts.contains("accepted") || facts.contains("REFUSED")).then_some(())
    });
}
