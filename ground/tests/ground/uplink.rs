//! That the vehicle hears this station is a fact of its own.

use ground::key::Key;
use ground::model::dialog::Dialog;
use ground::update::Action;
use protocol::dialect::{MavMessage, TD_UPLINK_DATA, TIMESYNC_DATA, TdFrameRefusal, TdPhase};
use protocol::identity::{Address, GROUND};

use crate::bench::{Bench, is_arm};
use crate::hand::ladder;

fn top(bench: &Bench) -> String {
    bench.screen(80, 24).lines().nth(1).unwrap_or_default().to_owned()
}

/// Only the way up is cut. The vehicle is heard as before.
#[test]
fn an_uplink_that_is_lost_is_shown_alarms_and_is_no_go() {
    let mut bench = Bench::crewed();
    bench.run(2.0);
    assert!(top(&bench).contains("down 0s up 0s"), "{}", top(&bench));
    assert!(bench.screen(80, 24).contains(" GO: every arming check passes"));
    bench.hears = false;
    bench.run(2.4);
    assert!(top(&bench).contains("down 0s up late 2s"), "{}", top(&bench));
    assert!(!bench.screen(80, 24).contains(" GO: "), "{}", bench.screen(80, 24));
    bench.run(2.0);
    let screen = bench.screen(80, 24);
    assert!(top(&bench).contains("down 0s UP LOST 4s"), "{screen}");
    assert!(screen.contains("ALARM UPLINK LOST") && screen.contains("NO-GO: uplink not proven"), "{screen}");
    assert!(screen.contains("[ ] it hears us: uplink proven"), "{screen}");
    bench.keys(&ladder());
    assert!(bench.take_commands().is_empty(), "no offer to arm, and so nothing is sent");
    assert!(bench.events().contains("cannot arm: the uplink is not proven"));
    bench.hears = true;
    bench.run(1.0);
    assert!(bench.screen(80, 24).contains("[x] it hears us: uplink proven"));
    bench.keys(&ladder());
    assert!(bench.take_commands().iter().any(is_arm));
}

/// It is lost while the word is being typed.
#[test]
fn an_uplink_that_is_lost_in_the_ladder_ends_it() {
    let mut bench = Bench::crewed();
    bench.key(Key::Char('A'));
    assert!(matches!(bench.model.dialog, Dialog::Arm { .. }));
    bench.hears = false;
    bench.run(4.0);
    bench.keys(&ladder()[1..]);
    assert!(bench.take_commands().is_empty());
}

/// With a key on one side only the vehicle accepts nothing, and says so to whom it may concern.
#[test]
fn a_vehicle_that_accepts_nothing_says_why() {
    let mut bench = Bench::crewed();
    bench.hears = false;
    for _ in 0..10 {
        bench.run(0.4);
        bench.hear(&MavMessage::TD_UPLINK(TD_UPLINK_DATA {
            accepted_age_ms: u16::MAX,
            refused_age_ms: 100,
            refused_count: 7,
            refusal: TdFrameRefusal::TD_FRAME_REFUSAL_UNSIGNED,
            refused_system: GROUND.system_id,
            refused_component: GROUND.component_id,
            ..TD_UPLINK_DATA::default()
        }));
    }
    let screen = bench.screen(140, 45);
    assert!(screen.contains("UP NOT PROVEN"), "{screen}");
    assert!(screen.contains("it refuses frames of 255/190: not signed"), "{screen}");
    bench.key(Key::Char('5'));
    assert!(
        bench.screen(140, 45).contains("up never ago; it refused 7 of 255/190"),
        "{}",
        bench.screen(140, 45)
    );
}

/// A vehicle that does not tell of its uplink answers questions if it hears them.
#[test]
fn an_answer_proves_the_uplink_of_a_vehicle_that_tells_nothing() {
    let mut bench = Bench::crewed();
    bench.model.link.uplink = ground::model::uplink::Uplink::default();
    assert!(!bench.model.link.uplink.is_proven(bench.now));
    let ts1 = i64::try_from(bench.now.as_nanos()).unwrap();
    bench.now += std::time::Duration::from_millis(80);
    bench.hear(&MavMessage::TIMESYNC(TIMESYNC_DATA { tc1: 5, ts1, ..Default::default() }));
    assert!(bench.model.link.uplink.is_proven(bench.now));
}

#[test]
fn who_armed_the_vehicle_is_on_the_screen() {
    let mut bench = Bench::crewed();
    let identity = |bench: &Bench| bench.screen(80, 24).lines().next().unwrap_or_default().to_owned();
    assert!(identity(&bench).contains("commands here"));
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.run(1.0);
    assert!(identity(&bench).contains("armed here"), "{}", identity(&bench));
    let mut bench = Bench::crewed();
    bench.uplink_of(Address { system_id: 254, component_id: 190 }, 100, true);
    assert!(identity(&bench).contains("armed 254/190"), "{}", identity(&bench));
}

fn heartbeats_in(bench: &mut Bench, seconds: f64) -> usize {
    bench.actions.clear();
    bench.run(seconds);
    let is_beat = |action: &&Action| matches!(action, Action::Send(message) if matches!(**message, MavMessage::HEARTBEAT(_)));
    bench.actions.iter().filter(is_beat).count()
}

#[test]
fn an_armed_vehicle_on_its_pad_hears_ten_heartbeats_a_second() {
    let mut bench = Bench::crewed();
    assert_eq!(heartbeats_in(&mut bench, 5.0), 5);
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.run(1.0);
    assert_eq!(heartbeats_in(&mut bench, 5.0), 50);
    bench.countdown_ms = 3_000;
    assert_eq!(heartbeats_in(&mut bench, 2.0), 20);
    bench.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    bench.run(0.2);
    assert!(heartbeats_in(&mut bench, 5.0) <= 6);
}

#[test]
fn without_a_link_the_loss_is_unknown() {
    let mut bench = Bench::crewed();
    bench.key(Key::Char('5'));
    assert!(bench.screen(80, 24).contains("loss 0.0 %"));
    bench.speaks = false;
    bench.run(4.0);
    assert!(bench.screen(80, 24).contains("loss unknown"), "{}", bench.screen(80, 24));
}
