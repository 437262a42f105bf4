//! Screens that are attached to a station in another process, and what they show when it dies.

use e2e::{ABORT, Signal, wait_for_text};

use super::rig::Pad;

fn aborts_sent(pad: &Pad) -> usize {
    pad.proxy.commands().iter().filter(|request| request.is(ABORT)).count()
}

#[test]
fn an_abort_without_a_station_is_reported_on_every_screen_and_sent_by_the_next_station() {
    let pad = Pad::new();
    let first = pad.daemon("first.mcap");
    let mut screen = pad.attach(&[], &[]);
    let watching = pad.attach(&["--watch"], &[]);
    screen.wait_for("every arming check passes");
    watching.wait_for("every arming check passes");
    first.signal(Signal::SIGKILL);
    first.wait();
    screen.wait_for("STATION GONE: this screen shows the past");
    // This page has no list of events.
    screen.type_bytes(b"2");
    screen.wait_for("[2Descent]");
    screen.type_bytes(b"\x18\r");
    screen.wait_for("ABORT NOT SENT");
    assert_eq!(aborts_sent(&pad), 0);
    let second = pad.daemon("second.mcap");
    for shown in [&screen, &watching] {
        // The second station has another clock than the first; its values must not look old, nor
        // the link lost.
        shown.wait_until("the abort, by the second station", |window| {
            let rows = window.rows();
            let heard = rows[0].contains(" down 0s up 0s") && rows[1].contains(" PAD_IDLE ");
            (heard && rows[2].contains("acknowledged accepted  observed yes")).then_some(())
        });
    }
    assert!(aborts_sent(&pad) >= 1);
    second.signal(Signal::SIGTERM);
    assert_eq!(second.wait().code, Some(4), "the exit code of an aborted flight");
}

#[test]
fn an_abort_requested_from_a_hung_station_is_reported_at_once_and_sent_when_it_resumes() {
    let pad = Pad::new();
    let daemon = pad.daemon("flight.mcap");
    let mut screen = pad.attach(&[], &[]);
    screen.wait_for("every arming check passes");
    daemon.signal(Signal::SIGSTOP);
    screen.type_bytes(b"\x18\r");
    screen.wait_for(" ABORT NOT SENT: the station hangs; it sends it when it resumes");
    assert_eq!(aborts_sent(&pad), 0);
    // A new screen shows no state, but the reason, and the requested abort.
    let mut late = pad.attach(&[], &[]);
    late.wait_for("the station does not answer: it hangs or is stopped; ABORT requested at ");
    late.wait_for_end();
    daemon.signal(Signal::SIGCONT);
    screen.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    daemon.signal(Signal::SIGTERM);
    assert_eq!(daemon.wait().code, Some(4), "the exit code of an aborted flight");
}

#[test]
fn the_station_after_one_that_hung_reports_the_unconfirmed_abort() {
    let pad = Pad::new();
    let first = pad.daemon("first.mcap");
    let mut screen = pad.attach(&[], &[]);
    screen.wait_for("every arming check passes");
    first.signal(Signal::SIGSTOP);
    screen.type_bytes(b"\x18\r");
    screen.wait_for(" ABORT NOT SENT: the station hangs");
    // An abort does not wait for the disk.
    wait_for_text(&pad.folder.path().join("touchdown-unfinished.json"), r#""abort":""#);
    screen.signal(Signal::SIGKILL);
    screen.wait_for_end();
    first.signal(Signal::SIGKILL);
    first.wait();
    let second = pad.daemon("second.mcap");
    let mut shown = pad.attach(&[], &[]);
    shown.wait_for("ALARM ABORT requested at ");
    assert_eq!(aborts_sent(&pad), 0, "nothing is sent by itself");
    shown.type_bytes(b"\x18\r");
    shown.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    shown.wait_until("no open abort", |window| (!window.shows("ABORT requested at ")).then_some(()));
    second.signal(Signal::SIGTERM);
    assert_eq!(second.wait().code, Some(4), "the exit code of an aborted flight");
}

/// Whether a sequence of ECMA-48's SGR sets a colour: 30 to 37 and 40 to 47, 38 and 48 with more
/// behind them. A place of the cursor may have the same numbers.
fn has_colour(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let sequences = text.split("\x1b[").skip(1).filter_map(|rest| {
        let end = rest.find(|letter: char| letter.is_ascii_alphabetic())?;
        rest[end..].starts_with('m').then_some(&rest[..end])
    });
    let is_colour = |code: &str| {
        code.parse().is_ok_and(|code: u8| (30..=38).contains(&code) || (40..=48).contains(&code))
    };
    sequences.flat_map(|codes| codes.split(';')).any(is_colour)
}

#[test]
fn a_terminal_that_cannot_show_a_screen_gets_lines() {
    let pad = Pad::new();
    let daemon = pad.daemon("flight.mcap");
    for environment in [[("TERM", "dumb")], [("TERM", "")]] {
        let mut lines = pad.attach(&[], &environment);
        lines.wait_for("PAD_IDLE");
        lines.signal(Signal::SIGTERM);
        assert_eq!(lines.wait_for_end(), Some(0));
        assert!(
            lines.is_restored() && !lines.window().bytes().contains(&0x1B),
            "the output contains an escape sequence"
        );
    }
    let mut ascii = pad.attach(&[], &[("LC_ALL", "C"), ("NO_COLOR", "1")]);
    ascii.wait_for("[1Pad]");
    ascii.wait_for(" steps -");
    assert!(ascii.window().bytes().is_ascii());
    assert!(!has_colour(ascii.window().bytes()));
    ascii.type_bytes(b"q");
    assert_eq!(ascii.wait_for_end(), Some(0));
    daemon.signal(Signal::SIGTERM);
    assert_eq!(daemon.wait().code, Some(5), "the exit code without a flight");
}
