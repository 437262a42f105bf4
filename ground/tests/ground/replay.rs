//! Replay: seeking, speed, and that nothing is ever commanded.

use std::path::Path;
use std::sync::LazyLock;
use std::time::Duration;

use ground::key::Key;
use ground::model::{Page, Role, Settings};
use ground::replay::Player;
use ground::replay::recording::Recording;
use ground::update::{Action, Msg};
use ground::view::draw;
use protocol::dialect::{HEARTBEAT_DATA, MavAutopilot, MavMessage, MavType, TdPhase};
use protocol::frame::Encoder;
use protocol::identity::{GROUND, VEHICLE};
use protocol::log::record::{Direction, RawFrame, Record};
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Cell;

use crate::keys::ladder;
use crate::rig::{MONO, settings};

/// The heartbeat of one of our vehicles.
fn beat(custom_mode: u32) -> HEARTBEAT_DATA {
    HEARTBEAT_DATA {
        custom_mode,
        mavtype: MavType::MAV_TYPE_ROCKET,
        autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
        ..HEARTBEAT_DATA::default()
    }
}

const S: fn(u64) -> Duration = Duration::from_secs;
/// When the recordings here begin, us since the Unix epoch.
const START_US: u64 = 1_760_000_000_000_000;

/// One heartbeat per second for a minute: on the pad, descending from second 20, under thrust from
/// 40, landed at 50.
static HEARTBEATS: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let mut encoder = Encoder::new(VEHICLE);
    let mut bytes = Vec::new();
    for second in 0..=60_u64 {
        let phase = match second {
            0..20 => TdPhase::TD_PHASE_PAD_ARMED,
            20..40 => TdPhase::TD_PHASE_AERO_DESCENT,
            40..50 => TdPhase::TD_PHASE_POWERED,
            _ => TdPhase::TD_PHASE_TOUCHDOWN,
        };
        let heartbeat = beat(phase as u32);
        bytes.extend((START_US + 1_000_000 * second).to_be_bytes());
        bytes.extend(encoder.encode(&MavMessage::HEARTBEAT(heartbeat)).as_bytes());
    }
    let directory = tempfile::tempdir().expect("a directory for the log");
    std::fs::write(directory.path().join("heartbeats.tlog"), bytes).expect("a log");
    directory
});

fn recording() -> Recording {
    load(&HEARTBEATS.path().join("heartbeats.tlog")).expect("a recording")
}

fn load(path: &Path) -> anyhow::Result<Recording> {
    Recording::load(path, None)
}

/// Every event of a recording with its time.
fn events(recording: &Recording) -> Vec<(Duration, Msg)> {
    let reader = recording.reader().expect("the recording's file");
    reader.map(|event| event.expect("the recording's file")).collect()
}

fn player() -> Player {
    Player::new(recording(), Settings { role: Role::Replaying, ..settings(false, true) })
}

fn drawn(player: &Player) -> Terminal<TestBackend> {
    let mut terminal = Terminal::new(TestBackend::new(80, 24)).expect("a test terminal");
    terminal
        .draw(|frame| {
            draw(&player.model, MONO, player.position(), frame);
        })
        .expect("drawing in memory");
    terminal
}

fn phase(player: &Player) -> TdPhase {
    player.model.vehicle.phase().map(|phase| phase.value).expect("a phase is known")
}

#[test]
fn time_passes_at_the_chosen_speed_and_stops_when_paused() {
    let mut player = player();
    player.pass(S(2));
    assert_eq!(player.position(), S(2));
    player.on_key(Key::Char('+'));
    player.on_key(Key::Char('+'));
    player.pass(S(5));
    assert_eq!(player.position(), S(22));
    assert_eq!(phase(&player), TdPhase::TD_PHASE_AERO_DESCENT);
    player.on_key(Key::Char(' '));
    player.pass(S(5));
    assert_eq!(player.position(), S(22));
    player.on_key(Key::Char(' '));
    player.pass(S(60));
    assert_eq!(player.position(), S(60));
}

#[test]
fn seeking_back_shows_nothing_from_later() {
    let mut player = player();
    player.seek(S(55));
    assert_eq!(player.model.page(), Page::Review);
    player.seek(S(25));
    assert_eq!(player.model.page(), Page::Descent);
    assert_eq!(player.model.history.timeline.len(), 2);
    player.on_key(Key::Char(']'));
    assert_eq!((player.position(), phase(&player)), (S(40), TdPhase::TD_PHASE_POWERED));
    player.on_key(Key::Char('['));
    assert_eq!(player.position(), S(20));
    player.on_key(Key::Right);
    player.on_key(Key::Left);
    assert_eq!(player.position(), S(20));
    assert!(player.seek_phase(TdPhase::TD_PHASE_TOUCHDOWN) && !player.seek_phase(TdPhase::TD_PHASE_CHUTE));
    assert_eq!(player.position(), S(50));
}

/// A position shows the same screen, however it was reached.
#[test]
fn a_position_shows_the_same_screen_however_it_was_reached() {
    let screen = |player: &Player| drawn(player).backend().to_string();
    let (mut straight, mut astray) = (player(), player());
    straight.seek(S(43));
    for second in [60, 3, 41, 12, 43] {
        astray.seek(S(second));
    }
    assert_eq!(screen(&straight), screen(&astray));
    assert!(screen(&straight).contains("REPLAY plays 43.0 of 60.0 s"));
}

/// The recorded flight lasts 32 s. An axis of 20 s would have a tick at 15 s.
#[test]
fn the_recorded_flight_fills_the_axis_of_time() {
    let mut player = player();
    for second in [22, 25, 38] {
        player.seek(S(second));
        let screen = drawn(&player).backend().to_string();
        let axis = screen.lines().find(|line| line.contains("T+ s")).expect("the axis");
        assert!(axis.contains("20") && !axis.contains("15"), "{second}: {screen}");
    }
}

#[test]
fn no_key_commands_anything_in_a_replay() {
    let mut player = player();
    for key in [ladder(), vec![Key::CtrlX, Key::CtrlX, Key::Char('S'), Key::Enter, Key::Char('D')]].concat() {
        player.on_key(key);
        player.pass(Duration::from_millis(200));
    }
    assert!(player.model.commands.tracks.is_empty());
    assert!(player.on_key(Key::Char('q')).contains(&Action::Quit), "quits at once: nothing is armed here");
}

/// The link rates are those of the flight, and the log page does not claim to record.
#[test]
fn the_links_figures_are_the_recorded_ones() {
    let mut player = player();
    player.seek(S(30));
    // A heartbeat a second.
    let figures = player.model.link.stats.figures(player.position());
    assert!(
        (figures.rx_frames_s - 1.0).abs() < 0.2 && (figures.rx_bytes_s - 21.0).abs() < 5.0,
        "{figures:?}"
    );
    player.on_key(Key::Char('7'));
    let mut terminal = ratatui::Terminal::new(ratatui::backend::TestBackend::new(80, 24)).unwrap();
    let now = player.position();
    terminal
        .draw(|frame| {
            draw(&player.model, MONO, now, frame);
        })
        .unwrap();
    let screen = terminal.backend().to_string();
    assert!(screen.contains("a recorded flight") && !screen.contains("recording"), "{screen}");
}

/// Recorded commands are shown with their progress, by the same code as live ones.
#[test]
fn recorded_commands_are_shown() {
    let mut model = ground::model::Model::new(settings(false, true));
    let msg = Msg::Commanded(ground::model::CommandKind::Abort);
    let actions = ground::update::update(&mut model, msg, S(1));
    assert!(actions.iter().any(|action| matches!(action, Action::Send(_))));
    assert_eq!(model.commands.tracks[0].attempts, 1);
}

#[test]
fn a_tlog_is_recognised_by_its_content_and_played_around_its_damage() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("flight.mcap");
    let (mut vehicle, mut ground) = (Encoder::new(VEHICLE), Encoder::new(GROUND));
    let heartbeat = MavMessage::HEARTBEAT(beat(9));
    let mut bytes = Vec::new();
    for (stamp_us, ours) in [(7_000_000_u64, false), (7_400_000, true), (9_000_000, false)] {
        let encoder = if ours { &mut ground } else { &mut vehicle };
        bytes.extend((START_US + stamp_us).to_be_bytes());
        bytes.extend(encoder.encode(&heartbeat).as_bytes());
        if bytes.len() < 40 {
            bytes.extend([1, 2, 3]);
        }
    }
    std::fs::write(&path, &bytes).unwrap();
    let recording = load(&path).unwrap();
    let at_400_ms = Duration::from_millis(400);
    let events = events(&recording);
    assert_eq!(events.iter().map(|(at, _)| *at).collect::<Vec<_>>(), [S(0), at_400_ms, S(2)]);
    assert!(matches!(events[1].1, Msg::Sent { bytes: 21, .. }), "our own heartbeat: {:?}", events[1]);
    assert_eq!(recording.damage.as_deref(), Some("3 bytes belong to no frame"));
    assert_eq!(*recording.phases, [(TdPhase::TD_PHASE_POWERED, S(0))]);
}

#[test]
fn a_file_that_is_no_log_is_refused_by_name() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("notes.mcap");
    std::fs::write(&path, "not a log").unwrap();
    let refused = |path: &Path| load(path).unwrap_err().to_string();
    assert!(refused(&path).contains("notes.mcap: contains no frames of a vehicle"), "{}", refused(&path));
    assert!(refused(&directory.path().join("gone")).starts_with("cannot read "));
    let heartbeat = Encoder::new(VEHICLE).encode(&MavMessage::HEARTBEAT(beat(9)));
    std::fs::write(&path, heartbeat.as_bytes().repeat(3)).unwrap();
    assert!(refused(&path).contains("is a MAVLink stream without times"), "{}", refused(&path));
}

#[test]
fn a_log_that_is_not_in_order_of_time_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    for late_ns in [1_000_000_000, 1_000_000_001] {
        let path = directory.path().join(format!("{late_ns}.mcap"));
        let log = Recorder::create(&path, false, &LogHeader::default()).unwrap();
        let bytes = Encoder::new(VEHICLE).encode(&MavMessage::HEARTBEAT(beat(9))).as_bytes().to_vec();
        let frame = RawFrame { direction: Direction::Rx, endpoint: "ground", link: "udp".to_owned(), bytes };
        for time_ns in [late_ns, 0] {
            log.record(Record::RawFrame(frame.clone()), time_ns);
        }
        log.finish().unwrap();
        let refused = load(&path).err().map(|error| format!("{error:#}"));
        let says = refused.map(|words| words.ends_with("it is not in order of time; `mcap sort` sorts it"));
        assert_eq!(says, (late_ns > 1_000_000_000).then_some(true));
    }
}

/// The peak memory of a running process, kB (Linux).
#[cfg(target_os = "linux")]
fn peak_kb(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// A log of 36 MB needs little more memory than one of a few bytes, and its reading progress is
/// reported.
#[cfg(target_os = "linux")]
#[test]
fn a_long_tlog_is_played_in_bounded_memory() {
    // Measured: 11 MB for a log of one frame, 12 MB for this one; keeping all frames in memory
    // takes 130 MB.
    const MOST_KB: u64 = 40_000;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("long.tlog");
    let mut encoder = Encoder::new(VEHICLE);
    let frames: Vec<_> = (0..=u8::MAX).map(|_| encoder.encode(&MavMessage::HEARTBEAT(beat(9)))).collect();
    let mut bytes = Vec::new();
    for (number, frame) in (0..1_240_000_u64).zip(frames.iter().cycle()) {
        bytes.extend((START_US + 10_000 * number).to_be_bytes());
        bytes.extend(frame.as_bytes());
    }
    assert!(bytes.len() > 35_000_000, "{}", bytes.len());
    std::fs::write(&path, bytes).unwrap();
    let mut process = std::process::Command::new(env!("CARGO_BIN_EXE_ground"))
        .arg("--replay")
        .arg(&path)
        .stdin(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut most_kb = 0;
    while process.try_wait().unwrap().is_none() {
        most_kb = most_kb.max(peak_kb(process.id()).unwrap_or(0));
        std::thread::sleep(Duration::from_millis(2));
    }
    let said = String::from_utf8(process.wait_with_output().unwrap().stderr).unwrap();
    assert!(0 < most_kb && most_kb < MOST_KB, "{most_kb} kB; {said}");
    assert!(said.contains("ground: reading") && said.contains("long.tlog, 3"), "{said}");
}

/// The bar shows the flight from 2 s before it to 2 s after it, 18 to 52 s, and the position in it.
#[test]
fn the_bar_shows_the_flight_and_the_position_in_it() {
    let place = |second: u64| {
        let mut player = player();
        player.seek(S(second));
        let terminal = drawn(&player);
        let bar = &terminal.backend().buffer().content[22 * 80..23 * 80];
        let text: String = bar.iter().map(Cell::symbol).collect();
        let names = ["falls", "touchdown"].map(|name| text.find(name));
        assert!(names.iter().all(Option::is_some) && names.is_sorted(), "{text}");
        bar.iter().position(|cell| cell.symbol() == "◆").expect("a mark")
    };
    assert_eq!([0, 30, 60].map(place), [1, 28, 78]);
}

/// The keys of the screen itself work in a replay.
#[test]
fn palette_filter_and_theme_work_in_a_replay() {
    let mut player = player();
    assert!(player.on_key(Key::Char('c')).contains(&Action::NextTheme));
    for key in [Key::Char(':'), Key::Char('q'), Key::Char(' '), Key::Escape] {
        assert!(!player.on_key(key).contains(&Action::Quit), "it is a letter of a text");
    }
    player.pass(S(3));
    assert_eq!(player.position(), S(3), "the space did not pause it");
    player.on_key(Key::Char('f'));
    assert_eq!(player.model.page(), Page::Find);
}
