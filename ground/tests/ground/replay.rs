//! A recorded flight on the same screens: seeking, speed, and that nothing is ever commanded.

use std::time::Duration;

use ground::key::Key;
use ground::model::page::Page;
use ground::model::{Role, Settings};
use ground::replay::film::{Film, FilmError, Scene};
use ground::replay::player::Player;
use ground::update::{Action, Msg};
use protocol::dialect::{HEARTBEAT_DATA, MavMessage, TdPhase};
use protocol::frame::Encoder;
use protocol::identity::{GROUND, VEHICLE};

use crate::bench::{MONO, settings};
use crate::hand::ladder;

const S: fn(u64) -> Duration = Duration::from_secs;

/// A heartbeat a second for a minute: on the pad, falling from second 20, under thrust from 40, down at 50.
fn film() -> Film {
    let mut encoder = Encoder::new(VEHICLE);
    let phase_at = |second: u64| match second {
        0..20 => TdPhase::TD_PHASE_PAD_ARMED,
        20..40 => TdPhase::TD_PHASE_AERO_DESCENT,
        40..50 => TdPhase::TD_PHASE_POWERED,
        _ => TdPhase::TD_PHASE_TOUCHDOWN,
    };
    let scenes = (0..=60)
        .map(|second| {
            let heartbeat =
                HEARTBEAT_DATA { custom_mode: phase_at(second) as u32, ..HEARTBEAT_DATA::default() };
            (S(second), Scene::Heard(encoder.encode(&MavMessage::HEARTBEAT(heartbeat))))
        })
        .collect();
    let phases = [0, 20, 40, 50].map(|second| (phase_at(second), S(second))).to_vec();
    Film { scenes, phases, ..Film::default() }
}

fn player() -> Player {
    Player::new(film(), Settings { role: Role::Replaying, ..settings(false, true) })
}

fn phase(player: &Player) -> TdPhase {
    player.model.vehicle.phase().map(|phase| phase.value).expect("a phase is known")
}

#[test]
fn time_passes_at_its_speed_and_stands_still_when_paused() {
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
    assert!(player.ended() && player.position() == S(60));
}

#[test]
fn seeking_back_shows_what_was_known_then_and_nothing_later() {
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

/// The same position is the same screen, however it was reached.
#[test]
fn the_way_to_a_position_does_not_show() {
    let screen = |player: &Player| {
        let mut terminal = ratatui::Terminal::new(ratatui::backend::TestBackend::new(80, 24)).unwrap();
        let now = player.position();
        terminal.draw(|frame| ground::view::view(&player.model, MONO, now, frame)).unwrap();
        terminal.backend().to_string()
    };
    let (mut straight, mut astray) = (player(), player());
    straight.seek(S(43));
    for second in [60, 3, 41, 12, 43] {
        astray.seek(S(second));
    }
    assert_eq!(screen(&straight), screen(&astray));
    assert!(screen(&straight).contains("REPLAY plays 43.0 of 60.0 s"));
}

#[test]
fn no_key_commands_anything_in_a_replay() {
    let mut player = player();
    for key in [ladder(), vec![Key::CtrlX, Key::CtrlX, Key::Char('S'), Key::Enter, Key::Char('D')]].concat() {
        player.on_key(key);
        player.pass(Duration::from_millis(200));
    }
    assert!(player.model.commands.tracks.is_empty());
    assert!(player.on_key(Key::Char('q')), "quits at once: nothing is armed here");
}

/// The link's figures are those of the flight, and nothing says that a replay records.
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
    player.on_key(Key::Char('8'));
    let mut terminal = ratatui::Terminal::new(ratatui::backend::TestBackend::new(80, 24)).unwrap();
    let now = player.position();
    terminal.draw(|frame| ground::view::view(&player.model, MONO, now, frame)).unwrap();
    let screen = terminal.backend().to_string();
    assert!(screen.contains("a recorded flight") && !screen.contains("recording"), "{screen}");
}

/// The crew's own commands are shown with what became of them, from the same code as live.
#[test]
fn what_was_commanded_then_is_shown() {
    let mut model = ground::model::Model::new(settings(false, true));
    let msg = Msg::Commanded(ground::model::command::CommandKind::Abort);
    let actions = ground::update::update(&mut model, msg, S(1));
    assert!(actions.iter().any(|action| matches!(action, Action::Send(_))));
    assert_eq!(model.commands.tracks[0].attempts, 1);
}

#[test]
fn a_tlog_is_played_up_to_its_damage() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("flight.tlog");
    let (mut vehicle, mut ground) = (Encoder::new(VEHICLE), Encoder::new(GROUND));
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA { custom_mode: 9, ..HEARTBEAT_DATA::default() });
    let mut bytes = Vec::new();
    for (stamp_us, ours) in [(7_000_000_u64, false), (7_400_000, true), (9_000_000, false)] {
        let encoder = if ours { &mut ground } else { &mut vehicle };
        bytes.extend(stamp_us.to_be_bytes());
        bytes.extend(encoder.encode(&heartbeat).as_bytes());
    }
    bytes.extend([1, 2, 3]);
    std::fs::write(&path, &bytes).unwrap();
    let film = Film::load(&path, None).unwrap();
    let at_400_ms = Duration::from_millis(400);
    assert_eq!(film.scenes.iter().map(|(at, _)| *at).collect::<Vec<_>>(), [S(0), at_400_ms, S(2)]);
    assert!(matches!(film.scenes[1].1, Scene::Sent(21)), "our own heartbeat: {:?}", film.scenes[1]);
    assert_eq!(film.damage.as_deref(), Some("unreadable 3 bytes before the end"));
    assert_eq!(film.begin_of(TdPhase::TD_PHASE_POWERED), Some(S(0)));
}

#[test]
fn what_is_no_log_is_refused_by_name() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("notes.mcap");
    std::fs::write(&path, "not a log").unwrap();
    let refused = Film::load(&path, None).unwrap_err();
    assert!(matches!(refused, FilmError::Empty { .. }) && refused.to_string().contains("notes.mcap"));
    assert!(matches!(Film::load(&directory.path().join("gone"), None), Err(FilmError::Read { .. })));
}
