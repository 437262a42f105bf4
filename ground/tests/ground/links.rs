//! What the screens show about the links: each link, each component, each message.

use std::time::Duration;

use ground::key::Key;
use ground::model::{AlarmKind, LinkReport};
use ground::update::Msg;
use protocol::dialect::{HEARTBEAT_DATA, MavMessage, RADIO_STATUS_DATA, SYS_STATUS_DATA};
use protocol::frame::Encoder;
use protocol::identity::{Address, VEHICLE};
use protocol::link_stats::{LinkFigures, SourceFigures};
use protocol::signing::SigningCounters;

use crate::rig::Rig;

/// A telemetry radio reports about itself with its own ids.
const RADIO: Address = Address { system_id: 51, component_id: 68 };

fn source(source: Address, loss: f64, age_ms: u64) -> SourceFigures {
    SourceFigures { source, age: Duration::from_millis(age_ms), rx_frames_s: 20.0, loss }
}

fn report(name: &str, loss: f64, trouble: Option<&str>) -> LinkReport {
    LinkReport {
        name: name.to_owned(),
        figures: LinkFigures { rx_bytes_s: 1_590.0, rx_frames_s: 20.0, loss, ..LinkFigures::default() },
        sources: vec![source(VEHICLE, loss, 200)],
        capacity_bytes_s: name.starts_with("serial").then_some(5_760),
        copies: 0,
        trouble: trouble.map(str::to_owned),
    }
}

#[test]
fn several_links_are_shown_side_by_side_and_an_answer_names_its_link() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('5'));
    let links = |trouble| {
        let links =
            vec![report("udpin:0.0.0.0:14550", 0.0, None), report("serial:/dev/x:57600", 0.125, trouble)];
        Msg::Links { links, signing: None }
    };
    rig.msg(links(None));
    let screen = rig.screen(140, 40);
    assert!(screen.contains("all links") && screen.contains(" 1590/5760 "), "{screen}");
    rig.msg(links(Some("unplugged")));
    assert!(rig.screen(140, 40).contains("serial:/dev/x:57600 DOWN unplugged"));
    rig.msg(Msg::LinkWarning("one link down: /dev/x: unplugged".to_owned()));
    rig.expect_event("one link down");
    assert!(!rig.model.alarms.is_unseen(AlarmKind::LinkDown), "the other still works");
}

#[test]
fn frames_with_bad_signatures_are_reported_and_counted() {
    let mut rig = Rig::crewed();
    let counted = |wrong| {
        let signing = Some(SigningCounters { wrong, accepted: 5, ..SigningCounters::default() });
        Msg::Links { links: vec![report("udpin:0.0.0.0:14550", 0.0, None)], signing }
    };
    rig.msg(counted(0));
    assert!(!rig.events().contains("frames refused"));
    rig.msg(counted(3));
    rig.msg(counted(4));
    assert_eq!(rig.events().matches("frames refused: 0 unsigned, 3 wrongly signed").count(), 1);
    rig.key(Key::Char('5'));
    assert!(rig.screen(140, 40).contains(" wrong 4 "));
}

/// The lines of a screen, with single spaces.
fn lines(rig: &Rig) -> Vec<String> {
    let squeezed =
        |line: &str| line.trim_matches(['"', '│']).split_whitespace().collect::<Vec<_>>().join(" ");
    rig.screen(80, 40).lines().map(squeezed).collect()
}

/// The lines that start with these words.
fn line(rig: &Rig, begins: &str) -> String {
    let lines = lines(rig).into_iter().filter(|line| line.starts_with(begins));
    lines.collect::<Vec<_>>().join("\n")
}

/// Every fourth frame of the radio is lost and none of the vehicle: each component has its own
/// loss.
#[test]
fn loss_is_shown_for_each_component() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('5'));
    let mut radio = Encoder::new(RADIO);
    for count in 0..41 {
        let frame = radio.encode(&MavMessage::RADIO_STATUS(RADIO_STATUS_DATA::default()));
        if count % 4 != 3 {
            rig.msg(Msg::Frame(frame));
        }
    }
    assert_eq!(line(&rig, "1/1 vehicle"), "1/1 vehicle 13.0 0.0 % 0.0 s");
    assert_eq!(line(&rig, "51/68 radio"), "51/68 radio 31.0 24.4 % 0.0 s");
    rig.speaks = false;
    rig.run(2.0);
    assert!(line(&rig, "1/1 vehicle").ends_with("~2.0 s"), "{}", rig.screen(80, 40));
    // After ten seconds no frame of it is in the window any more.
    rig.run(10.0);
    assert_eq!(line(&rig, "51/68 radio"), "51/68 radio 0.0 unknown ~12.0 s");
}

/// Each of several links has its own rates for each component; ages keep growing between two
/// reports.
#[test]
fn loss_is_shown_for_each_link_and_component() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('5'));
    let mut serial = report("serial:/dev/x:57600", 0.125, None);
    serial.sources.push(source(RADIO, 0.5, 0));
    serial.copies = 17;
    let links = vec![report("udpin:0.0.0.0:14550", 0.0, None), serial];
    rig.msg(Msg::Links { links, signing: None });
    rig.run(0.3);
    assert!(line(&rig, "all links").contains(" 0.0 % 17"));
    assert_eq!(line(&rig, "udpin:"), "udpin:0.0.0.0:14550 1590 0 20.0 0.0 % 0");
    assert_eq!(line(&rig, "serial:"), "serial:/dev/x:57600 1590/5760 0 20.0 12.5 % 17");
    let vehicle = line(&rig, "1/1 vehicle");
    assert!(vehicle.ends_with("1/1 vehicle 20.0 0.0 % 0.5 s\n1/1 vehicle 20.0 12.5 % 0.5 s"), "{vehicle}");
    assert_eq!(line(&rig, "51/68 radio"), "51/68 radio 20.0 50.0 % 0.3 s");
}

/// Every received message has its age; regular messages are also listed before they are received.
#[test]
fn every_message_has_its_age() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('5'));
    let shows = |rig: &Rig, what: &str| lines(rig).iter().any(|line| line.contains(what));
    assert!(shows(&rig, "SYS_STATUS never"), "{}", rig.screen(80, 40));
    rig.receive(&MavMessage::SYS_STATUS(SYS_STATUS_DATA::default()));
    rig.text("ready");
    // Messages of another component do not count.
    let other = Address { system_id: 1, component_id: 2 };
    rig.receive_from(other, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    rig.run(1.7);
    for age in ["SYS_STATUS ~1.7 s", "STATUSTEXT ~1.7 s", "HEARTBEAT 0.7 s"] {
        assert!(shows(&rig, age), "{age}: {}", rig.screen(80, 40));
    }
}

/// Scrolling reaches every line and never goes past the end.
#[test]
fn the_link_screen_scrolls() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('5'));
    assert!(!rig.screen(40, 12).contains("TD_PREDICTED_PATH"));
    for _ in 0..30 {
        rig.key(Key::Down);
    }
    assert!(rig.screen(40, 12).contains("TD_PREDICTED_PATH"), "{}", rig.screen(40, 12));
    rig.key(Key::Home);
    assert!(rig.screen(40, 12).contains("rejected checksum"), "{}", rig.screen(40, 12));
}
