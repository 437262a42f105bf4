//! Texts of the vehicle that contain escape sequences for the terminal.

use protocol::dialect::{MavMessage, MavSeverity, STATUSTEXT_DATA};
use protocol::frame::Encoder;
use protocol::identity::VEHICLE;

use super::rig::Rig;

/// Sequences that a terminal would obey, or bytes that are no text. Each ends in a word that must
/// be shown.
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

/// The beginnings of sequences that the ground never writes: strings for the terminal, requests,
/// full resets, scrolling regions, and control characters other than bell and escape.
const NEVER_WRITTEN: [&[u8]; 14] = [
    b"\x1b]",
    b"\x1bP",
    b"\x1b\\",
    b"\x1bc",
    b"\x1b#",
    b"\x1b[6n",
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

#[test]
fn texts_of_a_vehicle_never_control_the_terminal() {
    let mut rig = Rig::new("mk2");
    rig.terminal.wait_for("every arming check passes");
    let mut encoder = Encoder::new(VEHICLE);
    for page in ["[1Pad]", "[6Texts]"] {
        rig.terminal.type_bytes(&page.as_bytes()[1..2]);
        rig.terminal.wait_for(page);
        for attack in &ATTACKS {
            rig.proxy.send_to_ground(encoder.encode(&status_text(attack)).as_bytes());
            if page == "[1Pad]" {
                wait_for_newest(&rig, page, word_of(attack));
            }
        }
        wait_for_newest(&rig, page, word_of(ATTACKS[ATTACKS.len() - 1]));
        if page == "[6Texts]" {
            let window = rig.terminal.window();
            // The page shows all but the first at once.
            let newer = ATTACKS[1..].iter().map(|attack| word_of(attack));
            let missing: Vec<&str> = newer.filter(|word| !window.shows(word)).collect();
            assert!(missing.is_empty(), "{missing:?} are not shown in {:#?}", window.rows());
            drop(window);
            rig.terminal.type_bytes(b"\x1b[A");
            rig.terminal.wait_for(word_of(ATTACKS[0]));
        }
    }
    assert_harmless(&rig);
    // Drawn again from scratch the screen is the same, so nothing had moved a cell.
    // The first row has a clock.
    let below = |window: &e2e::Window| window.rows().split_off(1);
    // The last row that the last key has changed: before it, a frame may be half drawn.
    let is_last = |pair: &[String]| {
        pair[0].contains(word_of(ATTACKS[ATTACKS.len() - 2])) && pair[1].starts_with('\u{2514}')
    };
    let rows = rig.terminal.wait_until("the whole page, scrolled by a row", |window| {
        let rows = below(window);
        rows.windows(2).any(is_last).then_some(rows)
    });
    rig.terminal.type_bytes(b"\x0c");
    rig.terminal.wait_until("the same screen", |window| (below(window) == rows).then_some(()));
}

/// A full screen drops characters without a cell, but lines are written as they are.
#[test]
fn texts_of_a_vehicle_never_control_a_terminal_without_a_screen() {
    let rig = Rig::on_terminal("mk2", false, "dumb");
    rig.terminal.wait_for("PAD_IDLE");
    let mut encoder = Encoder::new(VEHICLE);
    for attack in ATTACKS {
        rig.proxy.send_to_ground(encoder.encode(&status_text(attack)).as_bytes());
        rig.terminal.wait_for(word_of(attack));
    }
    assert_harmless(&rig);
    let window = rig.terminal.window();
    let control = |byte: &u8| *byte < b' ' && !matches!(byte, b'\r' | b'\n');
    assert!(!window.bytes().iter().any(control), "a control character reached the terminal");
}

fn assert_harmless(rig: &Rig) {
    let window = rig.terminal.window();
    assert_eq!(window.forbidden_requests(), 0, "a title, the clipboard or another size was requested");
    for never in NEVER_WRITTEN {
        let found = window.bytes().windows(never.len()).any(|bytes| bytes == never);
        assert!(!found, "{never:?} reached the terminal");
    }
    assert!(std::str::from_utf8(window.bytes()).is_ok(), "bytes that are not UTF-8 reached the terminal");
}

/// Waits until the newest message is shown on the last line but one, with everything around it in
/// place.
fn wait_for_newest(rig: &Rig, page: &str, word: &str) {
    rig.terminal.wait_until(&format!("{word} on {page}"), |window| {
        let rows = window.rows();
        let said = rows[rows.len() - 2].contains(word);
        (said && rows[rows.len() - 1].contains(page) && rows[1].contains("PAD_IDLE")).then_some(())
    });
}

/// The letters and digits at the end of an attack.
fn word_of(attack: &[u8]) -> &str {
    let length = attack.iter().rev().take_while(|byte| byte.is_ascii_alphanumeric()).count();
    std::str::from_utf8(&attack[attack.len() - length..]).unwrap()
}
