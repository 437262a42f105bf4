//! A real vehicle whose motor no burn of its lot has confirmed.

use ground::key::Key;
use ground::model::{LogHealth, Prompt, Role, Seat, why_untested};
use ground::update::{Action, Msg, Request};
use protocol::dialect::{MavMessage, TD_MISSION_DATA};
use protocol::log::record::Record;

use crate::rig::{Rig, enter, is_arm, settings};
use crate::screens::on_the_pad;

fn report_mission(rig: &mut Rig, motor_burns: u8) {
    rig.receive(&MavMessage::TD_MISSION(TD_MISSION_DATA { motor_burns, ..TD_MISSION_DATA::default() }));
}

/// On the pad, with everything well but for the motor.
fn real(motor_burns: u8) -> Rig {
    let mut rig = on_the_pad();
    rig.simulated = false;
    rig.run(1.0);
    report_mission(&mut rig, motor_burns);
    rig.actions.clear();
    rig
}

/// NO-GO with its reason on the pad page, until a word is typed; who typed it is in the log and in
/// the book. Then the ladder is the usual one.
#[test]
fn an_unconfirmed_motor_of_a_real_vehicle_is_armed_by_a_word_that_is_recorded() {
    let mut rig = real(0);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("NO-GO: motor UNCONFIRMED: no burn of its lot"), "{screen}");
    assert!(screen.contains(" NO  motor       UNCONFIRMED"), "{screen}");
    rig.keys(&enter("AARM"));
    assert!(!rig.take_commands().iter().any(is_arm), "another word");
    rig.run(2.0);
    rig.key(Key::Char('A'));
    assert!(rig.model.dialog.as_ref().is_some_and(|dialog| dialog.prompt == Prompt::Untested));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("Type UNTESTED and Enter") && screen.contains("another lot's"), "{screen}");
    rig.keys(&enter("UNTESTED"));
    assert!(!rig.take_commands().iter().any(is_arm), "nothing is armed by it");
    let words = "UNTESTED MOTOR: arming goes on although motor UNCONFIRMED: no burn of its lot";
    rig.expect_event(words);
    assert!(rig.screen(120, 40).contains(" !!  motor       overruled"), "{}", rig.screen(120, 40));
    rig.keys(&enter("AARM"));
    assert!(rig.take_commands().iter().any(is_arm));

    let mut rig = real(0);
    rig.keys(&enter("AUNTESTED"));
    let recorded = |action: &Action| matches!(action, Action::Record(Record::OperatorAction(action)) if action.kind == "untested motor");
    let entered = |action: &Action| matches!(action, Action::Enter(line) if line.kind == "untested motor");
    assert!(rig.actions.iter().any(recorded) && rig.actions.iter().any(entered));
}

#[test]
fn a_confirmed_or_a_simulated_motor_needs_no_word() {
    let mut simulated = on_the_pad();
    report_mission(&mut simulated, 0);
    for (mut rig, events) in [
        (real(4), "motor       confirmed, burns of its lot: 4"),
        (simulated, "motor       certified, no burn of its lot"),
    ] {
        rig.expect_screen("every arming check passes");
        assert!(rig.screen(120, 40).contains(events), "{}", rig.screen(120, 40));
        rig.keys(&enter("AARM"));
        assert!(rig.take_commands().iter().any(is_arm), "{events}");
    }
}

/// A real vehicle without a reported mission has not reported that burns confirm it; and another
/// power-up is another motor.
#[test]
fn the_word_counts_for_one_power_up_only() {
    let mut rig = on_the_pad();
    rig.simulated = false;
    rig.run(1.0);
    rig.expect_screen("NO-GO: motor not known");
    report_mission(&mut rig, 0);
    rig.keys(&enter("AUNTESTED"));
    assert_eq!(why_untested(&rig.model), None);
    rig.reboot();
    rig.run(15.0);
    report_mission(&mut rig, 0);
    assert!(why_untested(&rig.model).is_some());
}

/// An attached screen asks its station to go on with an untested motor, or without a log. The
/// station decides, and records who requested it.
#[test]
fn an_attached_screen_requests_the_overruling_from_its_station() {
    let failed = LogHealth { failed: true, ..LogHealth::default() };
    for (simulated, health, word, request) in [
        (false, LogHealth::default(), "AUNTESTED", Request::Untested),
        (true, failed, "ANOLOG", Request::WithoutLog),
    ] {
        let mut rig = Rig::new(ground::model::Settings { role: Role::Attached, ..settings(false, true) });
        rig.model.alarms.history_ends();
        rig.simulated = simulated;
        rig.run(1.0);
        report_mission(&mut rig, 0);
        rig.msg(Msg::Log(health));
        let stops = |rig: &Rig| why_untested(&rig.model).or_else(|| rig.model.why_no_log(rig.now));
        rig.keys(&enter(word));
        assert!(rig.actions.contains(&Action::Request(request.clone())));
        assert_ne!(stops(&rig), None, "the station decides");
        rig.msg(Msg::Requested { request, by: Seat::new(2, "bob on pts/2") });
        assert_eq!(stops(&rig), None);
        rig.expect_event("(screen 2, bob on pts/2)");
    }
}
