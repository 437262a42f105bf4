//! What the screens tell of the links: each link, each component, each message.

use std::time::Duration;

use ground::key::Key;
use ground::model::link::LinkReport;
use ground::update::Msg;
use protocol::dialect::{HEARTBEAT_DATA, MavMessage, RADIO_STATUS_DATA, SYS_STATUS_DATA};
use protocol::frame::Encoder;
use protocol::identity::{Address, VEHICLE};
use protocol::link::{LinkFigures, SourceFigures};
use protocol::signing::SigningCounters;

use crate::bench::Bench;

/// A telemetry radio speaks for itself with ids of its own.
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
fn several_links_are_shown_side_by_side_and_an_answer_names_its_own() {
    let mut bench = Bench::crewed();
    bench.key(Key::Char('5'));
    let links = |trouble| {
        let links =
            vec![report("udpin:0.0.0.0:14550", 0.0, None), report("serial:/dev/x:57600", 0.125, trouble)];
        Msg::Links { links, signing: None }
    };
    bench.msg(links(None));
    let screen = bench.screen(140, 40);
    assert!(screen.contains("2 links") && screen.contains("serial 1590/5760 B/s 12.5 %"), "{screen}");
    bench.msg(links(Some("unplugged")));
    assert!(bench.screen(140, 40).contains("serial DOWN"));
    bench.msg(Msg::OneLinkDown("/dev/x: unplugged".to_owned()));
    assert!(bench.events().contains("one link down"));
    assert!(!bench.screen(140, 40).contains("LINK DOWN"), "the other still works");
}

#[test]
fn what_signatures_keep_out_is_said_and_counted() {
    let mut bench = Bench::crewed();
    let counted = |wrong| {
        let signing = Some(SigningCounters { wrong, accepted: 5, ..SigningCounters::default() });
        Msg::Links { links: vec![report("udpin:0.0.0.0:14550", 0.0, None)], signing }
    };
    bench.msg(counted(0));
    assert!(!bench.events().contains("frames refused"));
    bench.msg(counted(3));
    bench.msg(counted(4));
    assert_eq!(bench.events().matches("frames refused: 0 unsigned, 3 wrongly signed").count(), 1);
    assert!(bench.screen(140, 40).contains("rejected 4"));
}

/// A screen's lines, their runs of spaces made one.
fn lines(bench: &Bench) -> Vec<String> {
    let squeezed = |line: &str| line.trim_matches('"').split_whitespace().collect::<Vec<_>>().join(" ");
    bench.screen(80, 40).lines().map(squeezed).collect()
}

/// The lines that begin with these words.
fn line(bench: &Bench, begins: &str) -> String {
    let lines = lines(bench).into_iter().filter(|line| line.starts_with(begins));
    lines.collect::<Vec<_>>().join("\n")
}

/// Every fourth frame of the radio is lost, none of the vehicle's: each component has a loss of its own.
#[test]
fn loss_is_told_by_component() {
    let mut bench = Bench::crewed();
    bench.key(Key::Char('5'));
    let mut radio = Encoder::new(RADIO);
    for count in 0..41 {
        let frame = radio.encode(&MavMessage::RADIO_STATUS(RADIO_STATUS_DATA::default()));
        if count % 4 != 3 {
            bench.msg(Msg::Frame(frame));
        }
    }
    assert_eq!(line(&bench, "1/1 vehicle"), "1/1 vehicle 13.0 0.0 % 0.0 s");
    assert_eq!(line(&bench, "51/68 radio"), "51/68 radio 31.0 24.4 % 0.0 s");
    bench.speaks = false;
    bench.run(2.0);
    assert!(line(&bench, "1/1 vehicle").ends_with("~2.0 s"), "{}", bench.screen(80, 40));
    // Ten seconds on, nothing of it is in the window any more.
    bench.run(10.0);
    assert_eq!(line(&bench, "51/68 radio"), "51/68 radio 0.0 unknown ~12.0 s");
}

/// Each of several links has its own figures, and its own of each component; ages go on between two reports.
#[test]
fn loss_is_told_by_link_and_component() {
    let mut bench = Bench::crewed();
    bench.key(Key::Char('5'));
    let mut serial = report("serial:/dev/x:57600", 0.125, None);
    serial.sources.push(source(RADIO, 0.5, 0));
    serial.copies = 17;
    let links = vec![report("udpin:0.0.0.0:14550", 0.0, None), serial];
    bench.msg(Msg::Links { links, signing: None });
    bench.run(0.3);
    assert!(line(&bench, "all links").contains(" 0.0 % 17"));
    assert_eq!(line(&bench, "udpin:"), "udpin:0.0.0.0:14550 1590 0 20.0 0.0 % 0");
    assert_eq!(line(&bench, "serial:"), "serial:/dev/x:57600 1590/5760 0 20.0 12.5 % 17");
    let vehicle = line(&bench, "1/1 vehicle");
    assert!(vehicle.ends_with("1/1 vehicle 20.0 0.0 % 0.5 s\n1/1 vehicle 20.0 12.5 % 0.5 s"), "{vehicle}");
    assert_eq!(line(&bench, "51/68 radio"), "51/68 radio 20.0 50.0 % 0.3 s");
}

/// Every message that was heard has its age, also those that no other screen shows; what the screens live by is
/// listed before it is heard.
#[test]
fn every_message_has_its_age() {
    let mut bench = Bench::crewed();
    bench.key(Key::Char('5'));
    let shows = |bench: &Bench, what: &str| lines(bench).iter().any(|line| line.contains(what));
    assert!(shows(&bench, "SYS_STATUS never"), "{}", bench.screen(80, 40));
    bench.hear(&MavMessage::SYS_STATUS(SYS_STATUS_DATA::default()));
    bench.text("ready");
    // Another component's messages are its own.
    let other = Address { system_id: 1, component_id: 2 };
    bench.hear_from(other, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    bench.run(1.7);
    for age in ["SYS_STATUS ~1.7 s", "STATUSTEXT ~1.7 s", "HEARTBEAT 0.7 s"] {
        assert!(shows(&bench, age), "{age}: {}", bench.screen(80, 40));
    }
}

/// What has no room is reached with the arrows, and nowhere is scrolled past the end.
#[test]
fn the_link_screen_scrolls() {
    let mut bench = Bench::crewed();
    bench.key(Key::Char('5'));
    assert!(!bench.screen(40, 12).contains("TD_PREDICTED_PATH"));
    for _ in 0..30 {
        bench.key(Key::Down);
    }
    assert!(bench.screen(40, 12).contains("TD_PREDICTED_PATH"), "{}", bench.screen(40, 12));
    bench.key(Key::Home);
    assert!(bench.screen(40, 12).contains("rx 0 B/s"), "{}", bench.screen(40, 12));
}
