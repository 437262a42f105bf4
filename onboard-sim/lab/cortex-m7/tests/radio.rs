//! The program of a board, as a process: it exchanges MAVLink with the ordinary ground station over
//! a serial radio, and decides every frame of a simulated world, which is another process.
//! `tests/emulated.rs` does the same with the image of a Cortex-M7.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use e2e::{
    Ended, Program, Random, Running, SerialLine, Signal, Terminal, auto_ground, expect_identical_replay,
    program,
};
use nix::sys::stat::Mode;
use nix::unistd::mkfifo;

/// World and board of one flight, and the board's radio.
struct Chain {
    world: Running,
    board: Running,
    radio: SerialLine,
}

impl Chain {
    fn start(folder: &Path) -> Self {
        let radio = SerialLine::new(57_600);
        for pipe in ["frames", "answers"] {
            mkfifo(&folder.join(pipe), Mode::S_IRUSR | Mode::S_IWUSR).unwrap();
        }
        // The shell opens the pipes in the order in which the world opens them.
        let mut board = Command::new("sh");
        board.args(["-c", "exec \"$0\" fly --radio \"$1\" <frames >answers"]);
        board.arg(env!("CARGO_BIN_EXE_board")).arg(&radio.near).current_dir(folder);
        let board = Running::start(&mut board);
        let mut world = program(Program::OnboardSim);
        world.args(["fly", "--mission", "mk2", "--start", "pad", "--speed", "4", "--board", "."]);
        let world = Running::start(world.args(["--log", "vehicle.mcap"]).current_dir(folder));
        Self { world, board, radio }
    }

    /// Waits for the end of the world, and of the board, which ends with it. Returns the world's
    /// output.
    fn wait(self) -> Ended {
        let (world, board) = (self.world.wait(), self.board.wait());
        assert_eq!(board.code, Some(0), "{}\n{}", board.output, world.output);
        world
    }
}

#[test]
fn a_board_with_a_radio_is_armed_started_and_lands() {
    let folder = tempfile::tempdir().unwrap();
    let chain = Chain::start(folder.path());
    let mut ground = Running::start(&mut auto_ground(folder.path(), &[&chain.radio.far_link()]));
    for phase in ["PAD_ARMED", "BOOST", "AERO_DESCENT", "POWERED", "TOUCHDOWN"] {
        ground.wait_for_line(phase);
    }
    let world = chain.wait();
    assert_eq!(world.code, Some(0), "{}", world.output);
    assert!(world.output.contains("STANDS UNDAMAGED"), "{}", world.output);
    expect_identical_replay(folder.path(), "vehicle.mcap");
}

#[test]
fn an_abort_from_the_screen_opens_the_parachute_of_a_board() {
    let folder = tempfile::tempdir().unwrap();
    let chain = Chain::start(folder.path());
    let mut ground = program(Program::Ground);
    ground.args(["--connect", &chain.radio.far_link(), "--log", "ground.mcap"]).current_dir(folder.path());
    ground.env("XDG_RUNTIME_DIR", folder.path()).env("XDG_CONFIG_HOME", folder.path());
    let mut screen = Terminal::start(&ground, (100, 40), false);
    screen.wait_for("every arming check passes");
    // On a busy machine the radio may be silent for a second, which holds the countdown: then the
    // crew starts it again.
    let falls = |screen: &Terminal| {
        screen
            .wait_within(Duration::from_secs(30), |window| window.shows("AERO_DESCENT").then_some(()))
            .is_some()
    };
    let flown = (0..3).any(|_| {
        screen.type_until(b"AARM\r", " ARMED ");
        screen.type_until(b"SSTART\r", "START  commanded");
        falls(&screen)
    });
    assert!(flown, "{}", screen.window().rows().join("\n"));
    screen.type_bytes(b"\x18\r");
    screen.wait_for(" CHUTE ");
    screen.wait_for("TOUCHDOWN");
    let world = chain.wait();
    assert_eq!(world.code, Some(4), "{}", world.output);
    for words in ["ABORTED", "parachute deployed"] {
        assert!(world.output.contains(words), "no {words} in:\n{}", world.output);
    }
    assert!(!world.output.contains("IGNITION"), "{}", world.output);
    expect_identical_replay(folder.path(), "vehicle.mcap");
}

/// The files of a recorded flight are written to the given folder, beside existing files: `emulate`
/// stores the flight's text there. A board reproduces the recorded answers.
#[test]
fn a_recorded_flight_is_written_beside_what_is_there_and_flown_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut fly = program(Program::OnboardSim);
    fly.args(["fly", "--mission", "mk2", "--start", "apogee", "--speed", "max", "--log", "flight.mcap"]);
    Running::to_end(fly.current_dir(folder.path()));
    let board = Path::new(env!("CARGO_BIN_EXE_board"));
    // `cargo test -p board` builds it.
    let mut frames = Command::new(board.with_file_name("examples").join("frames"));
    let written = Running::to_end(frames.arg(at("flight.mcap")).arg(folder.path()));
    assert_eq!(written.code, Some(0), "{}", written.output);
    let mut again = Command::new(board);
    again.arg("fly").stdin(File::open(at("frames")).unwrap()).stdout(File::create(at("answers")).unwrap());
    assert!(again.status().unwrap().success());
    assert!(std::fs::read(at("answers")).unwrap() == std::fs::read(at("recorded")).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
}

/// The transport of the frames drops and changes bytes: the flight stays identical.
#[test]
fn a_bad_wire_to_a_board_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for pipe in ["frames", "answers"] {
        mkfifo(&folder.path().join(pipe), Mode::S_IRUSR | Mode::S_IWUSR).unwrap();
    }
    let mut world = program(Program::OnboardSim);
    world.args([
        "fly",
        "--start",
        "drone",
        "--mission",
        "vlr",
        "--speed",
        "max",
        "--board",
        ".",
        "--log",
        "log.mcap",
    ]);
    let mut world = Running::start(world.current_dir(folder.path()));
    // Opened in the order in which the world opens them.
    let from_world = File::open(folder.path().join("frames")).unwrap();
    let to_world = File::options().write(true).open(folder.path().join("answers")).unwrap();
    let mut board = Command::new(env!("CARGO_BIN_EXE_board"));
    let mut board = board.arg("fly").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let ways = [
        worsened(from_world, board.stdin.take().unwrap(), 1),
        worsened(board.stdout.take().unwrap(), to_world, 2),
    ];
    // It stays unarmed on its pad.
    world.wait_for_line("phase SAFE to PAD_IDLE");
    world.signal(Signal::SIGTERM);
    let world = world.wait();
    assert_eq!(world.code, Some(5), "{}", world.output);
    let worse: u64 = ways.map(|way| way.join().unwrap()).iter().sum();
    assert!(worse > 3, "{worse} bytes were lost or changed");
    board.wait().unwrap();
    expect_identical_replay(folder.path(), "log.mcap");
}

/// Carries bytes in a thread; one in ten thousand is lost, and one is changed. Returns the numbers
/// of both.
fn worsened(
    mut from: impl Read + Send + 'static,
    mut to: impl Write + Send + 'static,
    seed: u64,
) -> JoinHandle<u64> {
    let carries = move || {
        let (mut random, mut bytes, mut worse) = (Random(seed), [0; 4096], 0);
        while let Ok(read @ 1..) = from.read(&mut bytes) {
            let carried = bytes[..read].iter().filter_map(|byte| match random.next() % 10_000 {
                0 => None,
                1 => Some(byte ^ 0x55),
                _ => Some(*byte),
            });
            let carried: Vec<u8> = carried.collect();
            let differs = bytes[..read].iter().zip(&carried).any(|(before, after)| before != after);
            worse += u64::from(differs);
            if to.write_all(&carried).is_err() {
                break;
            }
        }
        worse
    };
    Builder::new().name("bad wire".to_owned()).spawn(carries).unwrap()
}
