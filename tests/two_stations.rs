//! Two people at two real stations with keys of their own, and one vehicle in two-person mode.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::time::Duration;

use e2e::{Program, Running, Signal, Terminal, keygen, program};

const SIZE: (u16, u16) = (100, 34);
// `0` before each sequence: keys that come too soon may have opened another page.

/// A person who taps twice a second is within the 1 s.
const TAP_EVERY: Duration = Duration::from_millis(400);

/// How long a person waits for the answer to what was typed, before typing it again.
const ANSWERED: Duration = Duration::from_secs(3);

/// Two people of different roles.
pub(crate) const CREW: &str = r#"
mode = "two-person"
[[operator]]
name = "Ann"
role = "range-safety"
link = 1
key = "ann.key"
[[operator]]
name = "Bob"
role = "flight"
link = 2
key = "bob.key"
"#;

/// A vehicle, and the two stations of its crew.
struct Launch {
    ann: Terminal,
    bob: Terminal,
    vehicle: Running,
    _folder: tempfile::TempDir,
}

impl Launch {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for key in ["flight.key", "ann.key", "bob.key"] {
            assert_eq!(keygen(folder.path(), key).code, Some(0));
        }
        std::fs::write(folder.path().join("crew.toml"), CREW).unwrap();
        let mut fly = program(Program::OnboardSim);
        fly.args(["fly", "--mission", "mk2", "--stay", "--mavlink", "udpin:127.0.0.1:0"])
            .args(["--key", "flight.key", "--crew", "crew.toml"])
            .current_dir(folder.path());
        let mut vehicle = Running::start(&mut fly);
        let link = vehicle.udp_link();
        // Each laptop has its own files of time stamps, as two machines have.
        let station = |operator: &str, system: &str| {
            let laptop = folder.path().join(operator);
            std::fs::create_dir(&laptop).unwrap();
            for file in ["flight.key", "ann.key", "bob.key", "crew.toml"] {
                std::fs::copy(folder.path().join(file), laptop.join(file)).unwrap();
            }
            let mut command = program(Program::Ground);
            command
                .args(["--connect", &link, "--key", "flight.key", "--crew", "crew.toml"])
                .args(["--operator", operator, "--sysid", system, "--log", "ground.mcap"])
                .envs([("XDG_RUNTIME_DIR", &laptop), ("XDG_CONFIG_HOME", &laptop)])
                .env("TERM", "xterm-256color")
                .current_dir(&laptop);
            Terminal::start(&command, SIZE, false)
        };
        let (ann, bob) = (station("Ann", "255"), station("Bob", "254"));
        for screen in [&ann, &bob] {
            screen.wait_for("every arming check passes");
        }
        Self { ann, bob, vehicle, _folder: folder }
    }

    /// Bob asks for the arming, and Ann confirms it: Bob is in command.
    fn armed_by_bob_and_ann() -> Self {
        let mut launch = Self::new();
        let [ann, bob] = [&mut launch.ann, &mut launch.bob];
        agreed((bob, b"0AARM\r", "FLIGHT Bob requests to arm"), (ann, b"0ACONFIRM\r", " ARMED "));
        launch.bob.wait_for(" ARMED ");
        launch
    }
}

/// One person asks and the other one confirms: the keys of each, and what the other one then sees.
/// On a busy machine the 10 s between them may pass, and both do it again.
fn agreed(asks: (&mut Terminal, &[u8], &str), confirms: (&mut Terminal, &[u8], &str)) {
    let (one, asking, asked) = asks;
    let (other, confirming, confirmed) = confirms;
    for _ in 0..10 {
        one.type_by_hand(asking);
        if other.wait_within(ANSWERED, |window| window.shows(asked).then_some(())).is_none() {
            continue;
        }
        other.type_by_hand(confirming);
        if other.wait_within(ANSWERED, |window| window.shows(confirmed).then_some(())).is_some() {
            return;
        }
    }
    panic!("no `{confirmed}` on:\n{}", other.window().rows().join("\n"));
}

impl Drop for Launch {
    fn drop(&mut self) {
        self.vehicle.signal(Signal::SIGTERM);
    }
}

fn shows(screen: &Terminal, words: &str) -> bool {
    screen.window().row_with(words).is_some()
}

#[test]
fn one_person_alone_neither_arms_nor_starts_and_two_fly_with_taps() {
    let mut launch = Launch::new();
    // Ann alone, twice: an ask each time, and the reason on her screen.
    for _ in 0..2 {
        launch.ann.type_until(b"0AARM\r", "must confirm within");
    }
    assert!(!shows(&launch.ann, " ARMED "), "one alone has armed");
    let [ann, bob] = [&mut launch.ann, &mut launch.bob];
    agreed((ann, b"0AARM\r", "RANGE SAFETY Ann requests to arm"), (bob, b"0ACONFIRM\r", " ARMED "));
    launch.ann.wait_for(" ARMED ");
    // The start is shared in the same way. Ann is in command, so Bob must tap.
    let [ann, bob] = [&mut launch.ann, &mut launch.bob];
    agreed((bob, b"0SSTART\r", "FLIGHT Bob requests to start"), (ann, b"0SCONFIRM\r", " T-"));
    launch.ann.wait_for("no tap of FLIGHT Bob for 1 s");
    launch.ann.wait_for("start again");
    assert!(shows(&launch.ann, " ARMED "), "a hold does not disarm");
    // Again, with taps until the release.
    let [ann, bob] = [&mut launch.ann, &mut launch.bob];
    agreed((bob, b"0SSTART\r", "FLIGHT Bob requests to start"), (ann, b"0SCONFIRM\r", " T-"));
    let released = (0..60).any(|_| {
        launch.bob.type_bytes(b"T");
        let flies = |window: &e2e::Window| window.shows(" AERO_DESCENT ").then_some(());
        launch.ann.wait_within(TAP_EVERY, flies).is_some()
    });
    assert!(released, "{}", launch.ann.window().rows().join("\n"));
    launch.ann.wait_for("STANDS UNDAMAGED");
    launch.bob.wait_for("STANDS UNDAMAGED");
}

#[test]
fn the_command_is_taken_over_when_the_commanding_laptop_dies() {
    let mut launch = Launch::armed_by_bob_and_ann();
    launch.ann.wait_for("FLIGHT Bob commands");
    // While Bob's frames arrive, no one takes command from him.
    launch.ann.type_until(b"CTAKE\r", "FLIGHT Bob (254/190) was received");
    launch.bob.signal(Signal::SIGKILL);
    launch.ann.type_until(b"CTAKE\r", "RANGE SAFETY Ann commands");
    assert!(shows(&launch.ann, " ARMED "), "the vehicle stays armed");
    // One alone still does not start it.
    launch.ann.type_until(b"0SSTART\r", "RANGE SAFETY Ann requests to start");
    assert!(!shows(&launch.ann, "countdown runs"));
    launch.ann.type_until(b"D\r", "disarmed PAD_IDLE");
}

#[test]
fn either_person_alone_aborts() {
    for ann_aborts in [true, false] {
        let mut launch = Launch::armed_by_bob_and_ann();
        let hand = if ann_aborts { &mut launch.ann } else { &mut launch.bob };
        hand.type_bytes(b"\x18\r");
        for screen in [&launch.ann, &launch.bob] {
            screen.wait_for("ABORT LATCHED");
        }
    }
}
