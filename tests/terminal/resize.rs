//! A window whose size changes.

use e2e::{Signal, Window};

use super::rig::{COUNTDOWN, Rig, SIZE};

/// The smallest and the largest screen, both extreme shapes, and the sizes on both sides of where
/// panels appear.
const SIZES: [(u16, u16); 8] =
    [(20, 5), (300, 90), (300, 5), (20, 90), (80, 24), (79, 24), (80, 23), (133, 41)];
const STORM: u16 = 400;

/// The rows without their numbers, which change from frame to frame; on a pad everything else stays
/// the same.
fn without_numbers(window: &Window) -> Vec<String> {
    let digits = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-');
    window.rows().iter().map(|row| row.split(digits).map(str::trim).collect()).collect()
}

/// Clears the whole screen (ECMA-48, ED 2).
const CLEAR: &[u8] = b"\x1b[2J";

/// Changes the size and checks that nothing of the previous size is left: when the screen is drawn
/// again from scratch, it looks the same.
fn assert_complete(rig: &mut Rig, size: (u16, u16)) {
    rig.terminal.resize(size);
    // A frame that shows the effect of a key was drawn after the key, so at the new size. These
    // keys change nothing else.
    rig.type_until(b"z\x18", "ENTER ABORTS");
    rig.terminal.type_bytes(b"z");
    let (before, written) = rig.terminal.wait_until("everything in its place", |window| {
        let shown = window.rows();
        let heard = shown.iter().take(3).any(|row| row.contains(" down 0s up 0s"));
        let found = shown.len() == usize::from(size.1) && shown[1].contains("PAD_IDLE") && heard;
        // On a busy machine two keys arrive at once, and a word about that stands there for
        // seconds.
        let says_more = window.shows("ENTER ABORTS") || shown[1].contains("keys ");
        (found && !says_more).then(|| (without_numbers(window), window.bytes().len()))
    });
    rig.terminal.type_bytes(b"\x0c");
    rig.terminal.wait_until(
        &format!("the screen of {size:?} drawn whole, which was {before:#?}"),
        |window| {
            let cleared = window.bytes()[written..].windows(CLEAR.len()).any(|bytes| bytes == CLEAR);
            (cleared && without_numbers(window) == before).then_some(())
        },
    );
}

#[test]
fn after_many_changes_of_size_the_screen_is_right_at_every_size() {
    let mut rig = Rig::new("mk2");
    rig.terminal.wait_for("every arming check passes");
    let mut number = 1_u32;
    for _ in 0..STORM {
        number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let (columns, rows) = (20 + (number >> 8) % 281, 5 + (number >> 20) % 86);
        rig.terminal.resize((u16::try_from(columns).unwrap(), u16::try_from(rows).unwrap()));
    }
    for size in SIZES {
        assert_complete(&mut rig, size);
    }
    assert_complete(&mut rig, SIZE);
    // Keys still work, also in the smallest window.
    rig.terminal.resize((20, 5));
    rig.type_until(b"AARM\r", " ARMED");
    rig.terminal.resize(SIZE);
    rig.terminal.arm_and_start(COUNTDOWN, " T+");
    for step in 0..STORM {
        rig.terminal.resize(SIZES[usize::from(step % 8)]);
    }
    rig.terminal.resize(SIZE);
    rig.terminal.wait_until("a flight's end, and nothing left over", |window| {
        let shown = window.rows();
        let top = shown[1].contains(" TOUCHDOWN ") && shown[1].contains(" disarmed ");
        let table = shown.iter().any(|row| row.contains(" touchdown "));
        (top && table && shown[23].contains("[4Review]")).then_some(())
    });
    let before = without_numbers(&rig.terminal.window());
    rig.terminal.type_bytes(b"\x0c");
    rig.terminal.wait_until(&format!("{before:#?} drawn whole"), |window| {
        (without_numbers(window) == before).then_some(())
    });
    // The keys are typed with a pause after the previous key.
    rig.terminal.type_by_hand(b"0q");
    // Its motor is hot.
    rig.terminal.wait_for("people must keep away, DO NOT APPROACH");
    rig.terminal.signal(Signal::SIGTERM);
    rig.terminal.wait_for_end();
    assert!(rig.terminal.is_restored());
}
