//! Every key in every phase of a flight, on the screens of real processes: the station's own, one
//! that is attached, one that watches, and a replay.

use std::time::Duration;

use e2e::{Program, Running, Terminal, program, unshared_address, wait_for_text};
use ground::model::{Act, DEFINITIONS};

use super::rig::{COUNTDOWN, ground};

/// Between two keys, ms: a hand is not faster, and the shortest phase has time for all of them.
const KEY_MS: u64 = 90;

/// Presses every key, each followed by Esc, which closes what it has opened.
fn press_every_key(screen: &mut Terminal, phase: &str, may_quit: bool) {
    screen.wait_for(phase);
    for definition in DEFINITIONS.iter().filter(|definition| may_quit || definition.act != Act::Quit) {
        let ground::key::Key::Char(letter) = definition.key else {
            screen.type_bytes(b"\x0c");
            continue;
        };
        screen.type_slowly(&[letter as u8, 0x1b], Duration::from_millis(KEY_MS));
        let window = screen.window();
        let rows = window.rows().join("\n");
        assert!(!window.is_closed(), "{phase}, {}: the screen has ended:\n{rows}", definition.name);
        for words in ["not written", "panicked"] {
            assert!(!rows.contains(words), "{phase}, {}: {rows}", definition.name);
        }
    }
}

/// A flight at half speed, so that the burn has time for every key.
fn fly(size: (u16, u16)) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let link = unshared_address();
    let mut vehicle = program(Program::OnboardSim);
    vehicle.args(["fly", "--stay", "--mission", "mk3", "--start", "pad", "--seed", "3", "--speed", "0.5"]);
    let _vehicle = Running::start(vehicle.args(["--mavlink", &format!("udpout:{link}")]).current_dir(folder));
    let on_terminal = |arguments: &[&str]| Terminal::start(&ground(folder, arguments), size, false);
    let mut station = on_terminal(&["--connect", &format!("udpin:{link}"), "--log", "ground.mcap"]);
    station.wait_for("every arming check passes");
    let [mut attached, mut watching] = [on_terminal(&["attach"]), on_terminal(&["attach", "--watch"])];
    let mut in_phase = |station: &mut Terminal, phase: &str| {
        std::thread::scope(|threads| {
            // On an idle pad it quits at once; from then on it asks.
            threads.spawn(|| press_every_key(station, phase, phase != "PAD_IDLE"));
            threads.spawn(|| press_every_key(&mut attached, phase, false));
            press_every_key(&mut watching, phase, false);
        });
    };
    in_phase(&mut station, "PAD_IDLE");
    station.type_until(b"AARM\r", " ARMED ");
    in_phase(&mut station, "PAD_ARMED");
    station.arm_and_start(2 * COUNTDOWN, " T+");
    for phase in ["AERO_DESCENT", "POWERED", "TOUCHDOWN"] {
        in_phase(&mut station, phase);
    }
    // One of the three screens wrote it at least.
    station.type_until(b"W", "the report is written");
    wait_for_text(&folder.join("ground.html"), "STANDS UNDAMAGED");

    let mut replay = on_terminal(&["--replay", "ground.mcap"]);
    press_every_key(&mut replay, "PAD_IDLE", false);
    replay.type_bytes(b"q");
    assert_eq!(replay.wait_for_end(), Some(0));
}

#[test]
fn every_key_works_in_every_phase_at_80x24() {
    fly((80, 24));
}

#[test]
fn every_key_works_in_every_phase_at_120x40() {
    fly((120, 40));
}
