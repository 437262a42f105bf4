//! A window that is pulled about.

use e2e::Window;

use crate::stage::{SIZE, Stage};

/// Corners first: the smallest screen, the largest, both odd shapes, the two sides of where panels begin.
const SIZES: [(u16, u16); 8] =
    [(20, 5), (300, 90), (300, 5), (20, 90), (80, 24), (79, 24), (80, 23), (133, 41)];
const STORM: u16 = 400;

/// Numbers change from frame to frame; everything else stands still on a pad.
fn without_numbers(window: &Window) -> Vec<String> {
    let digits = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-');
    window.rows().iter().map(|row| row.split(digits).map(str::trim).collect()).collect()
}

/// Clears the whole screen (ECMA-48, ED 2).
const CLEAR: &[u8] = b"\x1b[2J";

/// After a change of size nothing of what stood there before is left over: drawn whole again, the screen is what it was.
fn assert_whole(stage: &mut Stage, size: (u16, u16)) {
    stage.terminal.resize(size);
    // A frame that answers a key was begun after the key: at the new size. These leave everything as it is.
    stage.type_until(b"z\x18", "ENTER ABORTS");
    stage.terminal.type_bytes(b"z");
    let (before, written) = stage.terminal.wait_until("everything in its place", |window| {
        let shown = window.rows();
        let heard = shown.iter().take(3).any(|row| row.contains(" down 0s up 0s"));
        let found = shown.len() == usize::from(size.1) && shown[1].starts_with(" PAD_IDLE") && heard;
        (found && !window.shows("ENTER ABORTS")).then(|| (without_numbers(window), window.bytes().len()))
    });
    stage.terminal.type_bytes(b"\x0c");
    stage.terminal.wait_until(
        &format!("the screen of {size:?} drawn whole, which was {before:#?}"),
        |window| {
            let cleared = window.bytes()[written..].windows(CLEAR.len()).any(|bytes| bytes == CLEAR);
            (cleared && without_numbers(window) == before).then_some(())
        },
    );
}

#[test]
fn after_a_storm_of_sizes_the_screen_is_right_at_every_size() {
    let mut stage = Stage::set("paper-calibrated");
    stage.terminal.wait_for("GO: every arming check passes");
    let mut number = 1_u32;
    for _ in 0..STORM {
        number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let (columns, rows) = (20 + (number >> 8) % 281, 5 + (number >> 20) % 86);
        stage.terminal.resize((u16::try_from(columns).unwrap(), u16::try_from(rows).unwrap()));
    }
    for size in SIZES {
        assert_whole(&mut stage, size);
    }
    assert_whole(&mut stage, SIZE);
    // The hand works after it as before it, and in the smallest window.
    stage.terminal.resize((20, 5));
    stage.type_until(b"AARM\r", " ARMED");
    stage.terminal.resize(SIZE);
    stage.start();
    for step in 0..STORM {
        stage.terminal.resize(SIZES[usize::from(step % 8)]);
    }
    stage.terminal.resize(SIZE);
    stage.terminal.wait_until("a flight's end, and nothing left over", |window| {
        let shown = window.rows();
        let top = shown[1].starts_with(" TOUCHDOWN ") && shown[1].contains(" disarmed ");
        (top && shown[4].starts_with(" Review ───") && shown[23].contains("[4Review]")).then_some(())
    });
    let before = without_numbers(&stage.terminal.look());
    stage.terminal.type_bytes(b"\x0c");
    stage.terminal.wait_until(&format!("{before:#?} drawn whole"), |window| {
        (without_numbers(window) == before).then_some(())
    });
    // Some time behind the key before it, as a finger is.
    stage.terminal.type_by_hand(b"0q");
    stage.terminal.wait_for_end();
    assert!(stage.terminal.is_restored());
}
