//! The image of the Cortex-M7 in QEMU: flown under the ground station, and with its frames as
//! interrupts of a main context that allocates without a pause.
//!
//! Everything runs on the vehicle's clock, so nothing depends on the speed of the machine: the
//! world waits for the emulator, and the station's model and updates live in the test. The chip
//! speaks MAVLink itself; its radio is two files. Without QEMU the tests say so, and test nothing.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::Duration;

use avionics::board::stream::{Answer, Begin, Frame, OnTheAir, Reader, put};
use e2e::Running;
use flight::computer::LogState;
use ground::key::Key;
use ground::model::{CommandKind, KeyTiming, Model, Settings};
use ground::update::{Action, Msg, update};
use ground::view::top_lines::readiness;
use nix::sys::stat::Mode;
use nix::unistd::mkfifo;
use protocol::dialect::TdPhase;
use protocol::frame::{Encoder, Framer};
use protocol::identity::{GROUND, RADIO_BUDGET_BYTES_S};
use sim::outside::Outside;
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use sim::wire::fly::{OnBoard, StartPoint, load_flight};
use sim::wire::record::{LastFrame, start};
use sim::wire::vehicle::Vehicle;
use tempfile::TempDir;

fn emulate(arguments: &[&str]) -> Command {
    let mut command = Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/emulate"));
    command.args(arguments);
    command
}

/// Builds the image, which takes minutes the first time. Returns `false` without QEMU.
fn is_built() -> bool {
    static BUILT: OnceLock<bool> = OnceLock::new();
    *BUILT.get_or_init(|| {
        if Command::new("qemu-system-arm").arg("--version").output().is_err() {
            eprintln!("NOT TESTED: qemu-system-arm is not installed");
            return false;
        }
        let Output { status, stderr, .. } = emulate(&["image"]).output().unwrap();
        assert!(status.success(), "{}", String::from_utf8_lossy(&stderr));
        true
    })
}

/// World, emulated chip and station.
struct Chain {
    vehicle: Vehicle,
    board: OnBoard,
    chip: Running,
    model: Model,
    encoder: Encoder,
    framer: Framer,
    uplink: File,
    downlink: File,
    frame: u32,
    _folder: TempDir,
}

impl Chain {
    /// mk2, switched on where it is dropped or launched.
    fn switched_on(start: StartPoint) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for pipe in ["frames", "answers"] {
            mkfifo(&at(pipe), Mode::S_IRUSR | Mode::S_IWUSR).unwrap();
        }
        let (uplink, downlink) = (File::create(at("uplink")).unwrap(), File::create_new(at("downlink")));
        drop(downlink.unwrap());
        let chip = Running::start(&mut emulate(&["chip", folder.path().to_str().unwrap()]));
        let flight = load_flight("mk2").unwrap().starting_at(Some(start)).unwrap();
        let on_the_air = OnTheAir {
            mission: flight.recipe.mission.name.clone(),
            system_id: 1,
            boot_number: 1,
            budget_bytes_s: RADIO_BUDGET_BYTES_S,
            uid: 1,
        };
        let mut vehicle = flight.vehicle().unwrap();
        vehicle.set_log_state(LogState { running: true, space_bytes: u64::MAX });
        vehicle.set_pin_out(true);
        let log_path = Some("ground.mcap".to_owned());
        Self {
            vehicle,
            board: OnBoard::open(folder.path(), &flight.recipe.mission_toml, on_the_air).unwrap(),
            chip,
            model: Model::new(Settings { log_path, session: 7, ..Settings::on_screen("radio") }),
            encoder: Encoder::new(GROUND),
            framer: Framer::new(),
            uplink,
            downlink: File::open(at("downlink")).unwrap(),
            frame: 0,
            _folder: folder,
        }
    }

    fn now(&self) -> Duration {
        Duration::from_millis(5) * self.frame
    }

    fn msg(&mut self, msg: Msg) {
        let now = self.now();
        for action in update(&mut self.model, msg, now) {
            let Action::Send(message) = action else { continue };
            self.uplink.write_all(self.encoder.encode(&message).as_bytes()).unwrap();
        }
    }

    /// Types as a hand does.
    fn types(&mut self, keys: &[Key]) {
        for key in keys {
            self.model.key_timing = KeyTiming::default();
            self.msg(Msg::Keys(vec![*key]));
        }
    }

    /// Flies a frame on the chip, and gives the station what the chip has sent in it.
    fn step(&mut self) {
        self.board.step(&mut self.vehicle).unwrap();
        self.frame += 1;
        let mut sent = Vec::new();
        self.downlink.read_to_end(&mut sent).unwrap();
        self.framer.push(&sent);
        while let Some(frame) = self.framer.next_frame() {
            self.msg(Msg::Frame(frame));
        }
        if self.frame.is_multiple_of(20) {
            self.msg(Msg::Tick);
        }
    }

    /// Flies until the station shows it.
    #[track_caller]
    fn until(&mut self, what: &str, seconds: u32, shown: impl Fn(&Model, Duration) -> bool) {
        let end = self.frame + 200 * seconds;
        while !shown(&self.model, self.now()) {
            let events = || self.model.events.newest(20).map(|event| event.text.clone()).collect::<Vec<_>>();
            assert!(self.frame < end, "no {what} within {seconds} s:\n{}", events().join("\n"));
            self.step();
        }
    }

    #[track_caller]
    fn until_phase(&mut self, phase: TdPhase, seconds: u32) {
        let is_in = |model: &Model, _| model.vehicle.status.as_ref().is_some_and(|s| s.value.phase == phase);
        self.until(&format!("{phase:?}"), seconds, is_in);
    }

    /// GO, armed and started by keys.
    fn start(&mut self) {
        let is_go =
            |model: &Model, now| readiness(model, now).is_some_and(|(words, _)| words.starts_with("GO:"));
        self.until("GO", 30, is_go);
        self.types(&typed("AARM"));
        self.until("arming", 5, |model, _| is_observed(model, CommandKind::Arm));
        self.types(&typed("SSTART"));
        self.until("start", 5, |model, _| is_observed(model, CommandKind::Start));
    }

    /// Ends the world, and with it the chip. Returns the chip's output.
    fn end(self) -> String {
        let Self { chip, board, .. } = self;
        drop(board);
        let ended = chip.wait();
        assert_eq!(ended.code, Some(0), "{}", ended.output);
        eprintln!("{}", ended.output);
        ended.output
    }
}

fn typed(word: &str) -> Vec<Key> {
    word.chars().map(Key::Char).chain([Key::Enter]).collect()
}

fn is_observed(model: &Model, kind: CommandKind) -> bool {
    model.commands.of(kind).is_some_and(|command| command.accepted() && command.observed_at.is_some())
}

#[test]
fn the_emulated_chip_is_armed_started_and_lands() {
    if !is_built() {
        return;
    }
    let mut chain = Chain::switched_on(StartPoint::Pad);
    chain.start();
    for (phase, seconds) in [
        (TdPhase::TD_PHASE_BOOST, 20),
        (TdPhase::TD_PHASE_AERO_DESCENT, 60),
        (TdPhase::TD_PHASE_POWERED, 60),
        (TdPhase::TD_PHASE_TOUCHDOWN, 30),
    ] {
        chain.until_phase(phase, seconds);
    }
    while chain.vehicle.judged().is_none() {
        chain.step();
    }
    assert!(chain.vehicle.judged().unwrap().landing.stands);
    let frames = chain.frame;
    let output = chain.end();
    assert!(output.ends_with(&format!("{frames} frames")), "{output}");
}

#[test]
fn an_abort_in_the_descent_opens_the_parachute_of_the_emulated_chip() {
    if !is_built() {
        return;
    }
    let mut chain = Chain::switched_on(StartPoint::Drone);
    chain.start();
    chain.until_phase(TdPhase::TD_PHASE_AERO_DESCENT, 60);
    chain.types(&[Key::CtrlX, Key::Enter]);
    chain.until("abort", 5, |model, _| is_observed(model, CommandKind::Abort));
    chain.until_phase(TdPhase::TD_PHASE_CHUTE, 5);
    chain.until_phase(TdPhase::TD_PHASE_TOUCHDOWN, 120);
    assert!(chain.vehicle.aborted() && chain.vehicle.state().parachute_ejected);
    assert!(chain.model.outcome.aborted_at.is_some());
    chain.end();
}

/// Largest delay of a frame behind its time, instructions: 1 ms at 600 MHz, a fifth of a frame. The
/// delays of two images differ: 290,000 and 330,000.
const LATEST_INSTRUCTIONS: u64 = 600_000;

/// QEMU counts instructions instead of time here, so the storm is the same on every machine.
#[test]
fn frames_as_interrupts_survive_a_storm_of_allocations() {
    if !is_built() {
        return;
    }
    let (frames, recorded) = recorded_flight();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("frames"), frames).unwrap();
    fs::write(folder.path().join("storm"), "").unwrap();
    let storm = ["chip", folder.path().to_str().unwrap(), "-icount", "shift=0"];
    let mut chip = Running::start(&mut emulate(&storm));
    for reported in (250..=recorded.len()).step_by(250) {
        chip.wait_for_line(&format!("{reported} frames so far"));
    }
    let ended = chip.wait();
    assert_eq!(ended.code, Some(0), "{}", ended.output);
    eprintln!("{}", ended.output);
    let mut reader = Reader::default();
    reader.push(&fs::read(folder.path().join("answers")).unwrap());
    let answers: Vec<Answer> = std::iter::from_fn(|| reader.next_record()).collect();
    assert_eq!(answers.len(), recorded.len());
    assert!(answers.iter().zip(&recorded).all(|(here, recorded)| here.is_same_as(recorded)));
    let numbers = |words: &str| -> Vec<u64> {
        let line = ended.output.lines().find(|line| line.contains(words)).unwrap();
        line.split(' ').filter_map(|word| word.parse().ok()).collect()
    };
    let found = [numbers("as interrupts"), numbers("allocations of")].concat();
    let [flown, waited, latest, allocations] = found[..] else { panic!("{}", ended.output) };
    assert_eq!(flown, recorded.len() as u64);
    assert!(allocations > 100 * flown && waited > flown / 10, "no storm: {}", ended.output);
    assert!(latest <= LATEST_INSTRUCTIONS, "{}", ended.output);
}

/// A landing of mk3 from its apogee as a stream of frames, and its decisions.
fn recorded_flight() -> (Vec<u8>, Vec<Answer>) {
    let recipe = Recipe::built_in("mk3", "field").unwrap();
    let mut sortie = Sortie::new(&recipe, 0).unwrap();
    let start = start(sortie.computer());
    let mut begin = Some(Begin { toml: recipe.mission_toml, start, on_the_air: None, flight: 0 });
    let (mut frames, mut recorded, mut last) = (Vec::new(), Vec::new(), LastFrame::default());
    while sortie.goes_on() {
        sortie.step_with(&Outside::NOBODY, &mut last);
        let Some(frame) = last.take() else { continue };
        recorded.push(Answer {
            frame: frame.input.frame,
            output: frame.output,
            state_digest: frame.state_digest,
            radio: None,
        });
        put(&Frame { input: frame.input, begin: begin.take() }, &mut frames);
    }
    (frames, recorded)
}
