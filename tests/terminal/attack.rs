//! Words of the vehicle that are meant for the terminal rather than for the crew.

use protocol::dialect::{MavMessage, MavParamType, MavSeverity, PARAM_VALUE_DATA, STATUSTEXT_DATA};
use protocol::frame::Encoder;
use protocol::identity::VEHICLE;

use crate::stage::Stage;

/// What a terminal would act upon, or what is no text at all. Each ends in a word that must arrive.
const ATTACKS: [&[u8]; 16] = [
    b"\x1b[2J\x1b[HCLEARED01",
    b"\x1b]0;title\x07TITLED02",
    b"\x1b]52;c;cm0gLXJm\x07COPIED03",
    b"\x1b[?1049lLEFT04",
    b"\x1b[8;1;1tSHRUNK05",
    b"\x1bP+q544e\x1b\\ASKED06",
    b"\x1b[5n\x1b[6n\x1b[cANSWERED07",
    b"\xc2\x9b2J\xc2\x9d0;x\xc2\x9cC1CODES08",
    b"\x9b31m\x9d0;x\x9cRAWC109",
    b"\r\n\x08\x08\x0b\x0cMOVED10",
    b"\x07\x07\x07\x0e\x0fRUNG11",
    b"\xff\xfe\xc3\x28\xe2\x82\xf0\x9fBROKEN12",
    "\u{202e}\u{2066}TURNED13".as_bytes(),
    "\u{65e5}\u{672c}\u{8a9e}WIDE14".as_bytes(),
    b"\x1b[?25h\x1b[1;1r\x1b#8\x1bcRESET15",
    "e\u{301}\u{200b}\u{feff}\u{7f}JOINED16".as_bytes(),
];

/// Beginnings of what the ground never writes by itself: strings for the terminal, questions to it, full resets,
/// scrolling regions, single control characters beside the bell and the escape.
const NEVER_WRITTEN: [&[u8]; 14] = [
    b"\x1b]",
    b"\x1bP",
    b"\x1b\\",
    b"\x1bc",
    b"\x1b#",
    b"\x1b[5n",
    b"\x1b[8;1;1t",
    b"\xc2\x9b",
    b"\xc2\x9d",
    b"\x08",
    b"\x0b",
    b"\x0c",
    b"\x0e",
    b"\x7f",
];

fn status_text(bytes: &[u8]) -> MavMessage {
    let mut text = [0; 50];
    text[..bytes.len()].copy_from_slice(bytes);
    MavMessage::STATUSTEXT(STATUSTEXT_DATA {
        severity: MavSeverity::MAV_SEVERITY_WARNING,
        text: text.into(),
        ..STATUSTEXT_DATA::default()
    })
}

fn parameter(index: u16, bytes: &[u8]) -> MavMessage {
    let mut name = [0; 16];
    let length = bytes.len().min(name.len());
    name[..length].copy_from_slice(&bytes[bytes.len() - length..]);
    MavMessage::PARAM_VALUE(PARAM_VALUE_DATA {
        param_value: 1.0,
        param_count: u16::try_from(ATTACKS.len()).unwrap(),
        param_index: index,
        param_id: name.into(),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    })
}

#[test]
fn what_a_vehicle_says_never_commands_the_terminal() {
    let mut stage = Stage::set("paper-calibrated");
    stage.terminal.wait_for("GO: every arming check passes");
    let mut encoder = Encoder::new(VEHICLE);
    for page in ["[1Pad]", "[6Texts]", "[7Params]"] {
        stage.terminal.type_bytes(&page.as_bytes()[1..2]);
        stage.terminal.wait_for(page);
        for (attack, index) in ATTACKS.iter().zip(0..) {
            stage.air.forge(encoder.encode(&status_text(attack)).as_bytes());
            stage.air.forge(encoder.encode(&parameter(index, attack)).as_bytes());
            if page == "[1Pad]" {
                wait_for_newest(&stage, page, word_of(attack));
            }
        }
        wait_for_newest(&stage, page, word_of(ATTACKS[ATTACKS.len() - 1]));
        if page == "[6Texts]" {
            let window = stage.terminal.look();
            let missing: Vec<&str> =
                ATTACKS.iter().map(|attack| word_of(attack)).filter(|word| !window.shows(word)).collect();
            assert!(missing.is_empty(), "{missing:?} of {:#?}", window.rows());
        }
    }
    // The parameters' names are shown here.
    stage.terminal.wait_for("TITLED02 ");
    assert_harmless(&stage);
    // Drawn anew, it is what it was: nothing had moved a cell.
    let rows = stage.terminal.look().rows();
    stage.terminal.type_bytes(b"\x0c");
    stage.terminal.wait_until("the same screen", |window| (window.rows() == rows).then_some(()));
}

/// A screen leaves out what has no cell; lines are written as they are.
#[test]
fn what_a_vehicle_says_never_commands_a_terminal_that_is_told_in_lines() {
    let stage = Stage::set_on("paper-calibrated", false, "dumb");
    stage.terminal.wait_for("PAD_IDLE");
    let mut encoder = Encoder::new(VEHICLE);
    for attack in ATTACKS {
        stage.air.forge(encoder.encode(&status_text(attack)).as_bytes());
        stage.terminal.wait_for(word_of(attack));
    }
    assert_harmless(&stage);
    let window = stage.terminal.look();
    let control = |byte: &u8| *byte < b' ' && !matches!(byte, b'\r' | b'\n');
    assert!(!window.bytes().iter().any(control), "a control character reached the terminal");
}

fn assert_harmless(stage: &Stage) {
    let window = stage.terminal.look();
    assert_eq!(window.liberties(), 0, "no title, no clipboard, no other size");
    for never in NEVER_WRITTEN {
        let found = window.bytes().windows(never.len()).any(|bytes| bytes == never);
        assert!(!found, "{never:?} reached the terminal");
    }
    assert!(std::str::from_utf8(window.bytes()).is_ok(), "no byte that is no text reached the terminal");
}

/// The newest message stands on the last line but one; around it everything is in its place.
fn wait_for_newest(stage: &Stage, page: &str, word: &str) {
    stage.terminal.wait_until(&format!("{word} on {page}"), |window| {
        let rows = window.rows();
        let said = rows[rows.len() - 2].contains(word);
        (said && rows[rows.len() - 1].contains(page) && rows[1].starts_with(" PAD_IDLE")).then_some(())
    });
}

/// The letters and digits at the end.
fn word_of(attack: &[u8]) -> &str {
    let length = attack.iter().rev().take_while(|byte| byte.is_ascii_alphanumeric()).count();
    std::str::from_utf8(&attack[attack.len() - length..]).unwrap()
}
