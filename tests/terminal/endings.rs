//! Every way a screen ends: the terminal is given back, and the log is whole.

use std::path::Path;
use std::process::Command;

use e2e::{Signal, Terminal};
use ground::app::log::LogGuard;
use ground::app::screen::Screen;
use ground::config::Config;
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;

use crate::stage::{SIZE, Stage, ground};

/// Reads a log to its end; what its messages on this topic hold.
fn whole_log(path: &Path, topic: &str) -> Vec<String> {
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

/// Not the facts of the arming before it.
fn wait_for_abort(screen: &Terminal) {
    screen.wait_until("an abort that was seen", |window| {
        window
            .row_with(" ABORT  commanded ")
            .filter(|facts| facts.contains("acknowledged accepted  observed yes"))
    });
}

#[test]
fn quit_and_terminated_it_gives_the_terminal_back_and_ends_its_log() {
    type Ending = fn(&mut Terminal);
    let endings: [(Ending, bool); 4] = [
        (|terminal| terminal.type_bytes(b"q"), false),
        // Ctrl-C, as a terminal that tells repeats apart writes it.
        (|terminal| terminal.type_bytes(b"\x1b[99;5u"), true),
        (|terminal| terminal.signal(Signal::SIGTERM), true),
        (|terminal| terminal.signal(Signal::SIGINT), false),
    ];
    for (end, tells_repeats) in endings {
        let mut stage = Stage::set_on("paper-calibrated", tells_repeats, "xterm-256color");
        stage.terminal.wait_for("GO: every arming check passes");
        assert!(!stage.terminal.is_restored(), "it has taken the terminal");
        stage.terminal.type_bytes(b"5");
        stage.terminal.wait_for("[5Link]");
        end(&mut stage.terminal);
        assert_eq!(stage.terminal.wait_for_end(), Some(0));
        assert!(stage.terminal.is_restored(), "{:?}", stage.terminal.look().rows());
        // What it says last is said on the terminal as it was.
        stage.terminal.wait_for("log: ground.mcap");
        let keys = whole_log(&stage.folder.path().join("ground.mcap"), "/operator");
        assert!(keys.iter().any(|key| key.contains("key") && key.contains('5')), "{keys:?}");
    }
}

#[test]
fn armed_its_screen_quits_by_a_typed_word_alone_and_the_station_goes_on() {
    let mut stage = Stage::set("paper-calibrated");
    stage.arm();
    stage.terminal.type_by_hand(b"q");
    stage.terminal.wait_for("QUIT although armed or in flight");
    stage.terminal.type_by_hand(b"x");
    stage.terminal.wait_for("quit: cancelled");
    // What it says from now on is said on the terminal as it was.
    stage.type_until(b"qquit\r", "the screen was quit; armed or in flight, so the station");
    assert!(stage.terminal.is_restored() && !stage.terminal.look().is_closed());
    stage.terminal.signal(Signal::SIGINT);
    stage.terminal.wait_for("SIGINT: the station goes on while armed or in flight");
    let mut second = Terminal::start(&ground(stage.folder.path(), &["attach"]), SIZE, false);
    second.wait_for(" ARMED ");
    second.type_bytes(b"\x18\r");
    wait_for_abort(&second);
    stage.terminal.signal(Signal::SIGTERM);
    assert_eq!(stage.terminal.wait_for_end(), Some(4), "aborted");
    whole_log(&stage.folder.path().join("ground.mcap"), "/operator");
}

#[test]
fn hung_up_it_goes_on_without_its_screen_and_another_screen_finds_everything() {
    let mut stage = Stage::set("paper-calibrated");
    stage.arm();
    stage.terminal.signal(Signal::SIGHUP);
    stage.terminal.wait_until("the terminal as it was", |window| (!window.is_taken()).then_some(()));
    assert!(stage.terminal.is_restored());
    let attach = ground(stage.folder.path(), &["attach"]);
    let mut second = Terminal::start(&attach, SIZE, false);
    second.wait_for(" ARMED ");
    second.type_by_hand(b"6");
    second.wait_for("the terminal is gone");
    second.type_by_hand(b"0");
    second.type_bytes(b"\x18\r");
    wait_for_abort(&second);
    // Who only looks cannot abort, nor take the station with it.
    let watch = ground(stage.folder.path(), &["attach", "--watch"]);
    let mut third = Terminal::start(&watch, SIZE, false);
    third.wait_for("WATCHING only");
    wait_for_abort(&third);
    for screen in [&mut second, &mut third] {
        screen.type_by_hand(b"q");
        screen.wait_for_end();
        assert!(screen.is_restored());
    }
    stage.terminal.signal(Signal::SIGTERM);
    assert_eq!(stage.terminal.wait_for_end(), Some(4), "aborted");
    let said = whole_log(&stage.folder.path().join("ground.mcap"), "/operator");
    assert!(said.iter().any(|said| said.contains("ABORT observed")), "{said:?}");
}

/// A stopped scroll, a session that hangs: nobody reads what the program writes.
#[test]
fn a_terminal_that_takes_nothing_stops_neither_link_nor_abort_nor_log() {
    let mut stage = Stage::set("paper-calibrated");
    stage.arm();
    let stalled = stage.terminal.stall();
    // Whole frames of the largest size: several times what a terminal holds for its reader.
    for step in 0..10 {
        let size = if step == 9 { SIZE } else { (300 - step % 2, 90) };
        stage.terminal.resize(size);
        stage.air.wait_for_ground();
    }
    let attach = ground(stage.folder.path(), &["attach"]);
    let mut second = Terminal::start(&attach, SIZE, false);
    second.wait_for(" ARMED ");
    second.type_bytes(b"\x18\r");
    wait_for_abort(&second);
    drop(stalled);
    // Read again, it shows what is, not what was.
    stage.wait_for_fact("ABORT", "acknowledged accepted  observed yes");
    stage.terminal.wait_until("everything in its place", |window| {
        let rows = window.rows();
        (rows[1].contains(" disarmed ") && rows[23].starts_with("[1Pad] 2Descent")).then_some(())
    });
    stage.terminal.signal(Signal::SIGTERM);
    assert_eq!(stage.terminal.wait_for_end(), Some(4), "aborted");
    assert!(stage.terminal.is_restored());
    whole_log(&stage.folder.path().join("ground.mcap"), "/operator");
}

/// Set for the program of the test below, which is this test program again.
const PANICS_HERE: &str = "TOUCHDOWN_TEST_PANICS_WITH_LOG";

/// The program has no way to be made to panic; so what its session holds, a screen and a log, is held here.
#[test]
fn a_panic_gives_the_terminal_back_says_what_it_was_and_ends_the_log() {
    if let Some(log) = std::env::var_os(PANICS_HERE) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        return runtime.block_on(async {
            let recorder = Recorder::create(Path::new(&log), &LogHeader::default()).unwrap();
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
    let name = "endings::a_panic_gives_the_terminal_back_says_what_it_was_and_ends_the_log";
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", name, "--nocapture"]).env(PANICS_HERE, &log);
    command.env("RUST_BACKTRACE", "0");
    for tells_repeats in [false, true] {
        let _ = std::fs::remove_file(&log);
        let mut terminal = Terminal::start(&command, SIZE, tells_repeats);
        assert_eq!(terminal.wait_for_end(), Some(101), "the test program's word for a failed test");
        assert!(terminal.is_restored());
        terminal.wait_for("the screen has failed on purpose");
        assert!(terminal.look().bytes().windows(8).any(|bytes| bytes == b"\x1b[?1049h"), "it had the screen");
        let said = whole_log(&log, "/events");
        assert!(said.iter().any(|said| said.contains("before the panic")), "{said:?}");
    }
}
