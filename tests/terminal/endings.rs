//! Every way in which a screen ends: the terminal is restored and the log is complete.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use e2e::{Signal, Terminal};
use ground::app::files::LogGuard;
use ground::app::screen::Screen;
use ground::config::Config;
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;

use super::rig::{Rig, SIZE, ground};

/// Reads a log to its end and returns the messages on this topic.
fn complete_log(path: &Path, topic: &str) -> Vec<String> {
    let mut reader = LogReader::new(std::fs::File::open(path).unwrap());
    let mut found = Vec::new();
    while let Some(item) = reader.next_item().unwrap() {
        if let LogItem::Message { channel_id, data, .. } = item
            && reader.channel(channel_id).is_some_and(|channel| channel.topic == topic)
        {
            found.push(String::from_utf8_lossy(&data).into_owned());
        }
    }
    assert_eq!(reader.damage(), None, "{}", path.display());
    found
}

/// Quits with the key. A station that stood still leaves out what was typed meanwhile.
fn quit(terminal: &mut Terminal) {
    let has_ended = |terminal: &mut Terminal| {
        terminal.type_by_hand(b"q");
        terminal.wait_within(Duration::from_secs(10), |window| window.is_closed().then_some(())).is_some()
    };
    assert!((0..6).any(|_| has_ended(terminal)), "{:?}", terminal.window().rows());
}

#[test]
fn when_quit_or_terminated_it_restores_the_terminal_and_completes_its_log() {
    type Ending = fn(&mut Terminal);
    let endings: [(Ending, bool); 8] = [
        (quit, false),
        // Ctrl-C, as a terminal that distinguishes repeats sends it.
        (|terminal| terminal.type_bytes(b"\x1b[99;5u"), true),
        (|terminal| terminal.signal(Signal::SIGTERM), true),
        (|terminal| terminal.signal(Signal::SIGINT), false),
        // What would otherwise end it with the terminal as the screen has it.
        (|terminal| terminal.signal(Signal::SIGQUIT), false),
        (|terminal| terminal.signal(Signal::SIGUSR1), false),
        (|terminal| terminal.signal(Signal::SIGUSR2), false),
        (|terminal| terminal.signal(Signal::SIGABRT), false),
    ];
    for (end, reports_repeats) in endings {
        let mut rig = Rig::on_terminal("mk2", reports_repeats, "xterm-256color");
        rig.terminal.wait_for("every arming check passes");
        assert!(!rig.terminal.is_restored(), "the screen is not open");
        rig.terminal.type_bytes(b"5");
        rig.terminal.wait_for("[5Link]");
        end(&mut rig.terminal);
        assert_eq!(rig.terminal.wait_for_end(), Some(0));
        assert!(rig.terminal.is_restored(), "{:?}", rig.terminal.window().rows());
        // Its last line is written to the restored terminal.
        rig.terminal.wait_for("log: ground.mcap");
        let keys = complete_log(&rig.folder.path().join("ground.mcap"), "/operator");
        assert!(keys.iter().any(|key| key.contains("key") && key.contains('5')), "{keys:?}");
    }
}

#[test]
fn while_armed_the_screen_quits_only_by_a_typed_word_and_the_station_continues() {
    let mut rig = Rig::new("mk2");
    rig.arm();
    rig.terminal.type_by_hand(b"q");
    rig.terminal.wait_for("QUIT although armed or in flight");
    rig.terminal.type_by_hand(b"x");
    rig.terminal.wait_for("quit: cancelled");
    // From now on it writes lines to the restored terminal.
    rig.type_until(b"qquit\r", "the screen was quit; armed or in flight, so the station");
    assert!(rig.terminal.is_restored() && !rig.terminal.window().is_closed());
    rig.terminal.signal(Signal::SIGINT);
    rig.terminal.wait_for("SIGINT: the station continues while armed or in flight");
    let mut second = Terminal::start(&ground(rig.folder.path(), &["attach"]), SIZE, false);
    second.wait_for(" ARMED ");
    second.type_bytes(b"\x18\r");
    second.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    rig.terminal.signal(Signal::SIGTERM);
    assert_eq!(rig.terminal.wait_for_end(), Some(4), "the exit code of an aborted flight");
    complete_log(&rig.folder.path().join("ground.mcap"), "/operator");
}

#[test]
fn after_a_hangup_the_station_continues_and_another_screen_shows_everything() {
    let mut rig = Rig::new("mk2");
    rig.arm();
    rig.terminal.signal(Signal::SIGHUP);
    rig.terminal.wait_until("the terminal as it was", |window| (!window.is_held()).then_some(()));
    assert!(rig.terminal.is_restored());
    let attach = ground(rig.folder.path(), &["attach"]);
    let mut second = Terminal::start(&attach, SIZE, false);
    second.wait_for(" ARMED ");
    second.type_by_hand(b"6");
    second.wait_for("the terminal is gone");
    second.type_by_hand(b"0");
    second.type_bytes(b"\x18\r");
    second.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    // A watching screen can neither abort nor end the station.
    let watch = ground(rig.folder.path(), &["attach", "--watch"]);
    let mut third = Terminal::start(&watch, SIZE, false);
    third.wait_for("WATCHING only");
    third.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    for screen in [&mut second, &mut third] {
        screen.type_by_hand(b"q");
        screen.wait_for_end();
        assert!(screen.is_restored());
    }
    rig.terminal.signal(Signal::SIGTERM);
    assert_eq!(rig.terminal.wait_for_end(), Some(4), "the exit code of an aborted flight");
    let said = complete_log(&rig.folder.path().join("ground.mcap"), "/operator");
    assert!(said.iter().any(|said| said.contains("ABORT observed")), "{said:?}");
}

/// After Ctrl-S or in a hanging session the program's output has no reader.
#[test]
fn a_terminal_that_reads_nothing_blocks_neither_link_nor_abort_nor_log() {
    let mut rig = Rig::new("mk2");
    rig.arm();
    let not_reading = rig.terminal.stop_reading();
    // Whole screens of the largest size are several times what the terminal's buffer holds.
    for step in 0..10 {
        let size = if step == 9 { SIZE } else { (300 - step % 2, 90) };
        rig.terminal.resize(size);
        rig.proxy.wait_for_ground();
    }
    let attach = ground(rig.folder.path(), &["attach"]);
    let mut second = Terminal::start(&attach, SIZE, false);
    second.wait_for(" ARMED ");
    second.type_bytes(b"\x18\r");
    second.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    drop(not_reading);
    // When the output is read again, the screen shows the present state.
    rig.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    rig.terminal.wait_until("everything in its place", |window| {
        let rows = window.rows();
        (rows[1].contains(" disarmed ") && rows[23].contains("[1Pad] 2Descent")).then_some(())
    });
    rig.terminal.signal(Signal::SIGTERM);
    assert_eq!(rig.terminal.wait_for_end(), Some(4), "the exit code of an aborted flight");
    assert!(rig.terminal.is_restored());
    complete_log(&rig.folder.path().join("ground.mcap"), "/operator");
}

/// This variable is set for the child process of the test below, which runs the same test program.
const PANICS_HERE: &str = "TOUCHDOWN_TEST_PANICS_WITH_LOG";

/// Nothing makes the real program panic, so the test opens a screen and a log of its own.
#[test]
fn a_panic_restores_the_terminal_is_reported_and_completes_the_log() {
    if let Some(log) = std::env::var_os(PANICS_HERE) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        return runtime.block_on(async {
            let recorder = Recorder::create(Path::new(&log), false, &LogHeader::default()).unwrap();
            let _guard = LogGuard::new(Some(recorder.clone()));
            let _screen = Screen::open(&Config::default()).unwrap();
            let (level, name) = (EventLevel::Info, "ground".to_owned());
            let event = Event { level, name, message: "before the panic".to_owned() };
            recorder.try_record(Record::Event(event), 0);
            panic!("the screen has failed on purpose");
        });
    }
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("panic.mcap");
    let name = "terminal::endings::a_panic_restores_the_terminal_is_reported_and_completes_the_log";
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", name, "--nocapture"]).env(PANICS_HERE, &log);
    command.env("RUST_BACKTRACE", "0");
    for reports_repeats in [false, true] {
        let _ = std::fs::remove_file(&log);
        let mut terminal = Terminal::start(&command, SIZE, reports_repeats);
        assert_eq!(terminal.wait_for_end(), Some(101), "the exit code of a failed test");
        assert!(terminal.is_restored());
        terminal.wait_for("the screen has failed on purpose");
        assert!(
            terminal.window().bytes().windows(8).any(|bytes| bytes == b"\x1b[?1049h"),
            "the screen was not open"
        );
        let said = complete_log(&log, "/events");
        assert!(said.iter().any(|said| said.contains("before the panic")), "{said:?}");
    }
}
