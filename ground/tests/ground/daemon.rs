//! A daemon, and screens that attach and detach over its socket.

use std::io::{Read as _, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use ground::attach::codec::{decode_to_screen, encode_to_station};
use ground::attach::{ToScreen, ToStation};
use ground::model::{CommandKind, Model, Role, Seat, Settings, TrackedCommand};
use ground::update::{Msg, Request, update};
use protocol::dialect::TdPhase;
use protocol::log::reader::{LogItem, LogReader};

use crate::rig::settings;

/// The demonstration as a daemon; killed if a test fails.
struct Daemon {
    child: Child,
    socket: PathBuf,
    log: PathBuf,
    _directory: tempfile::TempDir,
}

impl Daemon {
    fn start() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let socket = directory.path().join("s");
        let log = directory.path().join("flight.mcap");
        let child = Command::new(env!("CARGO_BIN_EXE_ground"))
            .args(["daemon", "--speed", "2", "--socket"])
            .arg(&socket)
            .arg("--log")
            .arg(&log)
            // A directory of its own, so that other tests do not find it.
            .env("XDG_RUNTIME_DIR", directory.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program can be started");
        Self { child, socket, log, _directory: directory }
    }

    fn signal(&self, name: &str) {
        // The built-in of the shell, because not every machine has a `kill` program.
        let sent = Command::new("sh").args(["-c", &format!("kill -s {name} {}", self.child.id())]).status();
        assert!(sent.is_ok_and(|status| status.success()), "kill -s {name}");
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A screen without a terminal: the model that it would show.
struct Screen {
    stream: UnixStream,
    model: Model,
    now: Duration,
    live: bool,
}

impl Screen {
    /// Waits until the daemon listens, long enough for a slow machine.
    fn attach(socket: &Path, watch: bool) -> Self {
        let stream = (0..600).find_map(|attempt| {
            if attempt > 0 {
                std::thread::park_timeout(Duration::from_millis(50));
            }
            UnixStream::connect(socket).ok()
        });
        let mut stream = stream.expect("the daemon listens");
        stream.set_read_timeout(Some(Duration::from_secs(30))).expect("a time limit");
        let greeting = ToStation::Hello { watch, operator: "anna".to_owned() };
        stream.write_all(&encode_to_station(&greeting)).expect("a greeting");
        let role = if watch { Role::Watching } else { Role::Attached };
        let model = Model::new(Settings { role, ..settings(false, true) });
        let mut screen = Self { stream, model, now: Duration::ZERO, live: false };
        screen.until("the end of the history", |screen| screen.live);
        screen
    }

    fn request(&mut self, asked: &ToStation) {
        self.stream.write_all(&encode_to_station(asked)).expect("the daemon listens");
    }

    fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        for _ in 0..20_000 {
            if done(self) {
                return;
            }
            let mut prefix = [0; 4];
            self.stream.read_exact(&mut prefix).unwrap_or_else(|error| panic!("{what}: {error}"));
            let mut bytes = vec![0; u32::from_le_bytes(prefix) as usize];
            self.stream.read_exact(&mut bytes).unwrap_or_else(|error| panic!("{what}: {error}"));
            let (message, at) = decode_to_screen(&bytes).expect("a message of the station");
            match message {
                ToScreen::Hello(hello) => {
                    assert!(hello.station.log_path.is_some_and(|path| path.ends_with("flight.mcap")));
                    self.model.settings.session = hello.station.session;
                }
                ToScreen::Live => self.live = true,
                ToScreen::Msg(msg) => {
                    self.now = at;
                    drop(update(&mut self.model, msg, at));
                }
                ToScreen::Status(_) | ToScreen::Stopping { .. } => panic!("an answer without a request"),
            }
        }
        panic!("{what} never came");
    }

    fn armed(&self) -> bool {
        self.model.vehicle.armed().is_some_and(|armed| armed.value)
    }
}

fn ready(screen: &Screen) -> bool {
    screen.model.vehicle.status.as_ref().is_some_and(|status| {
        status.value.phase == TdPhase::TD_PHASE_PAD_IDLE && status.value.checks_failed.is_empty()
    })
}

#[test]
fn screens_attach_and_detach_while_the_station_runs_on() {
    let mut daemon = Daemon::start();
    let mut watching = Screen::attach(&daemon.socket, true);
    assert_eq!(std::fs::metadata(&daemon.socket).unwrap().permissions().mode() & 0o777, 0o600);
    watching.until("ready", ready);
    watching.request(&ToStation::Request(Request::Command(CommandKind::Arm)));
    let mut first = Screen::attach(&daemon.socket, false);
    first.until("ready", ready);
    let before = first.now;
    first.until("two seconds more", |screen| screen.now > before + Duration::from_secs(2));
    assert!(!first.armed() && first.model.commands.tracks.is_empty(), "who only watches arms nothing");
    first.request(&ToStation::Key("A".to_owned()));
    first.request(&ToStation::Request(Request::Command(CommandKind::Arm)));
    // Acknowledged and observed come in either order.
    first.until("armed", |screen| {
        screen.armed() && screen.model.commands.of(CommandKind::Arm).is_some_and(TrackedCommand::accepted)
    });
    let arm = first.model.commands.of(CommandKind::Arm).unwrap();
    assert!(arm.by == Seat::new(2, "anna"), "{arm:?}");
    // The other screen sees the same, and the screen that commanded may vanish.
    drop(first);
    watching.until("armed there, too", Screen::armed);
    daemon.signal("HUP");
    let mut second = Screen::attach(&daemon.socket, false);
    assert!(second.armed(), "the history shows at once what was");
    assert!(second.model.history.timeline.len() >= 2);
    let reports = &second.model.link.reports;
    assert!(reports.len() == 1 && reports[0].figures.rx_frames_s > 1.0, "the link's figures: {reports:?}");
    second.request(&ToStation::Request(Request::Command(CommandKind::Abort)));
    drop(second);
    watching.until("aborted", |screen| screen.model.outcome.aborted_at.is_some());
    daemon.signal("TERM");
    let status = daemon.child.wait().unwrap();
    assert_eq!(status.code(), Some(4), "aborted");
    assert!(!daemon.socket.exists());
    let mut reader = LogReader::new(std::fs::File::open(&daemon.log).unwrap());
    let mut operator = 0;
    while let Some(item) = reader.next_item().unwrap() {
        if let LogItem::Message { channel_id, data, .. } = item
            && reader.channel(channel_id).is_some_and(|channel| channel.topic == "/operator")
        {
            operator += usize::from(String::from_utf8_lossy(&data).contains("A (screen 2, anna)"));
        }
    }
    assert_eq!((reader.damage(), operator), (None, 1));
}

#[test]
fn a_socket_serves_one_station_and_garbage_does_not_end_it() {
    let daemon = Daemon::start();
    let mut screen = Screen::attach(&daemon.socket, false);
    let second = Command::new(env!("CARGO_BIN_EXE_ground"))
        .args(["daemon", "--log", "none", "--socket"])
        .arg(&daemon.socket)
        .env("XDG_RUNTIME_DIR", daemon.socket.parent().unwrap())
        .output()
        .unwrap();
    assert_eq!(second.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&second.stderr).contains("serves it already"));
    for garbage in [&[0xFF; 64][..], &[9, 0, 0, 0, 77, 0, 0, 0, 0, 0, 0, 0, 0], b"GET / HTTP/1.1\r\n\r\n"] {
        let mut stream = UnixStream::connect(&daemon.socket).unwrap();
        let _ = stream.write_all(garbage);
    }
    let before = screen.now;
    screen.until("life goes on", |screen| screen.now > before + Duration::from_secs(1));
}

/// The vehicle may have changed since the crew completed the steps on a screen.
#[test]
fn a_request_is_checked_again_by_the_station() {
    let request = |kind| Msg::command(kind, Seat::new(2, "anna"));
    let mut model = Model::new(settings(false, true));
    drop(update(&mut model, request(CommandKind::Arm), Duration::from_secs(1)));
    assert!(model.commands.tracks.is_empty(), "no vehicle was received yet");
    let actions = update(&mut model, request(CommandKind::Abort), Duration::from_secs(1));
    assert!(actions.iter().any(|action| matches!(action, ground::update::Action::Send(_))));
}
