//! The uplink: whether the vehicle receives this station.

use ground::key::Key;
use ground::model::{AlarmKind, LinkState, Prompt, Seat};
use ground::update::{Action, Msg};
use ground::view::top_lines;
use protocol::dialect::{MavMessage, TD_UPLINK_DATA, TIMESYNC_DATA, TdFrameRefusal, TdPhase};
use protocol::identity::{Address, GROUND};

use crate::keys::ladder;
use crate::rig::{MONO, Rig, is_arm, settings};

/// Both directions as every first line shows them.
fn directions(rig: &Rig) -> String {
    top_lines::link(&rig.model, MONO, rig.now).to_string()
}

/// Only the uplink is cut; telemetry still arrives.
#[test]
fn a_lost_uplink_is_shown_raises_an_alarm_and_is_no_go() {
    let mut rig = Rig::crewed();
    rig.run(2.0);
    assert_eq!(directions(&rig), "down 0s up 0s ");
    rig.expect_screen(" every arming check passes");
    rig.uplink_alive = false;
    rig.run(2.4);
    assert_eq!(directions(&rig), "down 0s up late 2s ");
    let ready = top_lines::readiness(&rig.model, rig.now).unwrap().0;
    assert_eq!(ready, "NO-GO: uplink not proven, every other check passes");
    rig.run(2.0);
    let screen = rig.screen(80, 24);
    assert_eq!(directions(&rig), "down 0s UP LOST 4s ");
    assert!(screen.contains("ALARM UPLINK LOST") && screen.contains("NO-GO: uplink not proven"), "{screen}");
    assert!(screen.contains("▶ uplink proven"), "{screen}");
    rig.keys(&ladder());
    assert!(rig.take_commands().is_empty(), "no offer to arm, and so nothing is sent");
    rig.expect_event("cannot arm: the uplink is not proven");
    rig.uplink_alive = true;
    rig.run(1.0);
    rig.expect_screen("✓ uplink proven");
    rig.keys(&ladder());
    assert!(rig.take_commands().iter().any(is_arm));
}

/// The link to an emulated vehicle, which takes several times real time, ages by its clock. A real
/// one is never waited for so long.
#[test]
fn a_slow_simulated_vehicle_is_go_and_its_loss_is_reported() {
    for (slower, simulated) in [(4, true), (10, true), (4, false), (10, false)] {
        let mut rig = Rig::new(settings(false, true));
        (rig.slower, rig.simulated) = (slower, simulated);
        rig.run(20.0);
        let mut unproven = 0;
        for _ in 0..100 {
            rig.run(0.1);
            unproven += u32::from(
                !rig.model.link.uplink.is_proven(rig.now) || !directions(&rig).starts_with("down 0s"),
            );
        }
        assert_eq!(
            unproven == 0,
            simulated,
            "{slower} times as long: {unproven} of 100, {}",
            directions(&rig)
        );
        rig.speaks = false;
        rig.run(2.5 * f64::from(slower));
        assert_eq!(matches!(rig.model.link.state(rig.now), LinkState::Lost(_)), !simulated, "{slower}");
        rig.run(1.5 * f64::from(slower));
        assert!(matches!(rig.model.link.state(rig.now), LinkState::Lost(_)), "{slower}, {simulated}");
        rig.expect_event("LINK LOST");
    }
}

/// The uplink is lost while the word is being typed.
#[test]
fn a_lost_uplink_prevents_arming_in_the_middle_of_the_ladder() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('A'));
    assert!(rig.model.dialog.as_ref().is_some_and(|dialog| dialog.prompt == Prompt::Arm));
    rig.uplink_alive = false;
    rig.run(4.0);
    rig.keys(&ladder()[1..]);
    assert!(rig.take_commands().is_empty());
}

/// If only the vehicle has a key, it accepts nothing and reports that to every station.
#[test]
fn a_vehicle_that_accepts_nothing_reports_why() {
    let mut rig = Rig::crewed();
    rig.uplink_alive = false;
    for _ in 0..10 {
        rig.run(0.4);
        rig.receive(&MavMessage::TD_UPLINK(TD_UPLINK_DATA {
            accepted_age_ms: u16::MAX,
            refused_age_ms: 100,
            refused_count: 7,
            refusal: TdFrameRefusal::TD_FRAME_REFUSAL_UNSIGNED,
            refused_system: GROUND.system_id,
            refused_component: GROUND.component_id,
            ..TD_UPLINK_DATA::default()
        }));
    }
    assert_eq!(rig.model.link.uplink.state(rig.now), LinkState::NeverReceived);
    let alarm = rig.model.alarms.foremost().map(|alarm| &alarm.what).unwrap();
    let why = "it refuses frames of 255/190: not signed, is the key missing here?";
    assert_eq!(alarm.kind, AlarmKind::UplinkLost);
    assert_eq!(alarm.text, format!("UPLINK LOST: the vehicle does not receive this station; {why}"));
    rig.key(Key::Char('5'));
    assert!(rig.screen(140, 45).contains("refused  7 of 255/190 by the vehicle"), "{}", rig.screen(140, 45));
}

/// A vehicle that does not report its uplink still answers TIMESYNC.
#[test]
fn an_answer_proves_the_uplink_of_a_vehicle_that_does_not_report_it() {
    let mut rig = Rig::crewed();
    rig.model.link.uplink = ground::model::Uplink::default();
    assert!(!rig.model.link.uplink.is_proven(rig.now));
    let ts1 = i64::try_from(rig.now.as_nanos()).unwrap();
    rig.now += std::time::Duration::from_millis(80);
    rig.receive(&MavMessage::TIMESYNC(TIMESYNC_DATA { tc1: 5, ts1, ..Default::default() }));
    assert!(rig.model.link.uplink.is_proven(rig.now));
}

#[test]
fn who_armed_the_vehicle_is_on_the_screen() {
    let mut rig = Rig::crewed();
    let who = |rig: &Rig| {
        let line = top_lines::identity(&rig.model, MONO, rig.now).to_string();
        line.split("boot 1A2B3C4D  ").nth(1).map(str::to_owned)
    };
    assert_eq!(who(&rig).as_deref(), Some("commands here"));
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.0);
    assert_eq!(who(&rig).as_deref(), Some("armed here"));
    // Whoever else sits here: the silence of this station holds the countdown.
    let seats = |names: &[&str]| (1..).zip(names).map(|(number, name)| Seat::new(number, *name)).collect();
    rig.msg(Msg::Crew { seats: seats(&["ann on pts/1", "ann", "bob on pts/2", "ann"]), silent: Vec::new() });
    assert_eq!(who(&rig).as_deref(), Some("armed here"));
    rig.armed = false;
    rig.phase = TdPhase::TD_PHASE_PAD_IDLE;
    rig.run(1.0);
    assert_eq!(who(&rig).as_deref(), Some("by ann,bob"));
    let mut rig = Rig::crewed();
    rig.uplink_of(Address { system_id: 254, component_id: 190 }, 100, true);
    assert_eq!(who(&rig).as_deref(), Some("armed 254/190"));
}

fn heartbeats_in(rig: &mut Rig, seconds: f64) -> usize {
    rig.actions.clear();
    rig.run(seconds);
    let is_beat = |action: &&Action| matches!(action, Action::Send(message) if matches!(**message, MavMessage::HEARTBEAT(_)));
    rig.actions.iter().filter(is_beat).count()
}

#[test]
fn an_armed_vehicle_on_the_pad_gets_ten_heartbeats_a_second() {
    let mut rig = Rig::crewed();
    assert_eq!(heartbeats_in(&mut rig, 5.0), 5);
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.0);
    assert_eq!(heartbeats_in(&mut rig, 5.0), 50);
    rig.countdown_ms = 3_000;
    assert_eq!(heartbeats_in(&mut rig, 2.0), 20);
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.run(0.2);
    assert!(heartbeats_in(&mut rig, 5.0) <= 6);
}

/// Otherwise a countdown that starts just before the next slow heartbeat is held for its absence.
#[test]
fn a_vehicle_that_is_armed_between_two_heartbeats_gets_the_next_one_at_once() {
    for tenths in 0..10 {
        let mut rig = Rig::crewed();
        rig.run(f64::from(tenths) / 10.0);
        rig.armed = true;
        rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
        rig.heartbeat();
        assert_eq!(heartbeats_in(&mut rig, 0.1), 1, "{tenths}");
    }
}

#[test]
fn without_a_link_the_loss_is_unknown() {
    let mut rig = Rig::crewed();
    assert_eq!(rig.model.link.loss(rig.now), Some(0.0));
    rig.speaks = false;
    rig.run(4.0);
    assert_eq!(rig.model.link.loss(rig.now), None);
}
