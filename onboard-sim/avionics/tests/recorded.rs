//! A simulated flight as a stream: the answers match the record, and faults of a stream are
//! reported.
#![expect(clippy::unwrap_used, reason = "tests")]

use std::cell::Cell;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use avionics::board::port::{self, Frames};
use avionics::board::radio::Radio;
use avionics::board::recorded::{Board, FlyError, VehicleKind, Watch};
use avionics::board::stream::{Answer, Begin, Frame, LONGEST_BYTES, OnTheAir, Reader, put};
use avionics::log::again::RecordedComputer;
use avionics::log::frame::{LoggedInput, input_from_log};
use flight::computer::crew::{CrewCommand, Request};
use flight::computer::messages::CrewMessage;
use flight::computer::pilot::planner::Planner;
use flight::computer::{Commands, Computer};
use flight::rules::outputs::PyroOutput;
use protocol::dialect::{MavMessage, MavModeFlag, TdVehicleFlag};
use protocol::frame::Framer;
use protocol::records::computer_v1::ComputerFrame;
use sim::outside::Outside;
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use sim::wire::record::LastFrame;

/// Answers of a board to bytes that arrive a few at a time, as from a serial line.
fn fly(bytes: &[u8]) -> (Board, Vec<Answer>, Result<(), FlyError>) {
    let (mut board, mut out, mut flown) = (Board::new(VehicleKind::Simulated), Vec::new(), Ok(()));
    for arrived in bytes.chunks(61) {
        flown = board.take(arrived, &mut (), &mut (), &mut |bytes: &[u8]| out.extend_from_slice(bytes));
        if flown.is_err() {
            break;
        }
    }
    let mut reader = Reader::default();
    reader.push(&out);
    let answers = std::iter::from_fn(|| reader.next_record()).collect();
    (board, answers, flown)
}

fn recipe() -> Recipe {
    Recipe::built_in("mk2", "field").unwrap()
}

fn begin(sortie: &Sortie) -> Begin {
    Begin {
        toml: recipe().mission_toml,
        start: sim::wire::record::start(sortie.computer()),
        on_the_air: None,
        flight: 7,
    }
}

/// A flight's frames.
fn flown(sortie: &mut Sortie) -> Vec<ComputerFrame> {
    let (mut frames, mut last) = (Vec::new(), LastFrame::default());
    while sortie.goes_on() {
        sortie.step_with(&Outside::NOBODY, &mut last);
        frames.push(*last.take().unwrap());
    }
    frames
}

fn answer_to(frame: &ComputerFrame) -> Answer {
    Answer {
        frame: frame.input.frame,
        output: frame.output.clone(),
        state_digest: frame.state_digest,
        radio: None,
    }
}

fn request(frame: &ComputerFrame, begin: Option<Begin>) -> Frame {
    Frame { input: frame.input.clone(), begin }
}

fn bytes_of(frames: impl IntoIterator<Item = Frame>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for frame in frames {
        put(&frame, &mut bytes);
    }
    bytes
}

#[test]
fn a_flight_through_a_stream_is_answered_as_it_was_flown_bit_for_bit() {
    let mut sortie = Sortie::new(&recipe(), 0).unwrap();
    let mut begin = Some(begin(&sortie));
    let frames = flown(&mut sortie);
    let bytes = bytes_of(frames.iter().map(|frame| request(frame, begin.take())));
    let (board, answers, flown) = fly(&bytes);
    flown.unwrap();
    assert_eq!((board.frames(), board.reader().broken()), (frames.len() as u64, 0));
    assert_eq!(answers.len(), frames.len());
    for (answer, frame) in answers.iter().zip(&frames) {
        assert_eq!(prost::Message::encode_to_vec(answer), prost::Message::encode_to_vec(&answer_to(frame)));
    }
}

/// Every frame is requested twice, with the flight's beginning, through noise and with broken
/// copies.
#[test]
fn a_bad_wire_changes_no_answer() {
    let mut sortie = Sortie::new(&recipe(), 0).unwrap();
    let begin = begin(&sortie);
    let frames: Vec<_> = flown(&mut sortie).into_iter().take(300).collect();
    let mut bytes = b"noise before the first frame".to_vec();
    bytes.push(0);
    for frame in &frames {
        let whole = bytes_of([request(frame, Some(begin.clone()))]);
        for place in [3, whole.len() / 2] {
            let mut flipped = whole.clone();
            flipped[place] ^= if flipped[place] == 0x10 { 0x20 } else { 0x10 };
            let lost: Vec<u8> = [&whole[..place], &whole[place + 1..]].concat();
            bytes.extend(flipped);
            bytes.extend(lost);
        }
        bytes.extend([whole.as_slice(), &whole].concat());
    }
    let (board, answers, flown) = fly(&bytes);
    flown.unwrap();
    assert_eq!(board.frames(), 300);
    assert_eq!(board.reader().broken(), 1 + 4 * 300);
    let expected: Vec<Answer> =
        frames.iter().flat_map(|frame| [answer_to(frame), answer_to(frame)]).collect();
    assert_eq!(answers, expected);
}

/// How many answers were given when the computer was reset before a frame.
struct Resets<'a> {
    answered: &'a Cell<usize>,
    found: Vec<(u64, usize)>,
}

impl Watch for Resets<'_> {
    fn reset(&mut self, before: u64) {
        self.found.push((before, self.answered.get()));
    }
}

/// A reset loses the bytes that have not left the machine.
#[test]
fn every_frame_before_a_reset_is_answered_before_it() {
    let mut sortie = Sortie::new(&recipe(), 0).unwrap();
    let mut begin = Some(begin(&sortie));
    let mut frames = flown(&mut sortie);
    frames.truncate(200);
    frames.drain(100..120);
    let bytes = bytes_of(frames.iter().map(|frame| request(frame, begin.take())));
    let answered = Cell::new(0);
    let mut resets = Resets { answered: &answered, found: Vec::new() };
    Board::new(VehicleKind::Simulated)
        .take(&bytes, &mut (), &mut resets, &mut |_: &[u8]| answered.set(answered.get() + 1))
        .unwrap();
    assert_eq!(resets.found, [(frames[100].input.frame, 100)]);
}

/// A board whose main context is a thread. It senses the recorded input, has a plan in the frame in
/// which the recorded computer had it, and notes its commands.
struct Recorded<'f> {
    frames: std::slice::Iter<'f, ComputerFrame>,
    ready: bool,
    to_main: SyncSender<Box<Planner>>,
    from_main: Receiver<Box<Planner>>,
    commanded: Vec<Commands>,
    logged: u64,
}

impl<'f> Recorded<'f> {
    fn sensing(frames: &'f [ComputerFrame]) -> Self {
        // There is never more than one.
        let ((to_main, requests), (solve, from_main)) = (sync_channel::<Box<Planner>>(1), sync_channel(1));
        let solves = move || {
            for mut planner in requests {
                planner.solve();
                if solve.send(planner).is_err() {
                    return;
                }
            }
        };
        thread::Builder::new().name("main context".into()).spawn(solves).unwrap();
        Self { frames: frames.iter(), ready: false, to_main, from_main, commanded: Vec::new(), logged: 0 }
    }
}

impl port::Board for Recorded<'_> {
    type Error = core::convert::Infallible;

    fn sense(&mut self) -> Result<Option<LoggedInput>, Self::Error> {
        let Some(frame) = self.frames.next() else { return Ok(None) };
        self.ready = frame.input.plan_ready;
        Ok(Some(input_from_log(&frame.input).unwrap()))
    }

    fn act(&mut self, commands: &Commands) -> Result<(), Self::Error> {
        self.commanded.push(*commands);
        Ok(())
    }

    fn submit(&mut self, planner: Box<Planner>) {
        self.to_main.send(planner).unwrap();
    }

    fn solved(&mut self) -> Option<Box<Planner>> {
        self.ready.then(|| self.from_main.recv().unwrap())
    }

    fn send(&mut self, _: &[CrewMessage]) {}

    fn log(&mut self, frame: &ComputerFrame) {
        self.logged += 1;
        assert_eq!(frame.input.frame, self.logged);
    }
}

fn started(recipe: &Recipe, sortie: &Sortie) -> RecordedComputer {
    RecordedComputer::started(&recipe.mission, &sim::wire::record::start(sortie.computer()))
}

/// Flies the board to its end, and compares every command with the recorded one.
fn commands_the_same(computer: Computer, frames: &[ComputerFrame]) -> Frames {
    let (mut flight, mut board) = (Frames::new(computer, 0), Recorded::sensing(frames));
    while flight.fly(&mut board).unwrap() {}
    assert_eq!(
        (board.logged, board.commanded.len()),
        (frames.len() as u64, frames.len()),
        "no frame is lost"
    );
    for (frame, commands) in frames.iter().zip(&board.commanded) {
        let (recorded, number) = (&frame.output, frame.input.frame);
        let bits = |angles: &[f64]| angles.iter().map(|angle| angle.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&commands.gimbal_rad), bits(&recorded.gimbal_rad), "frame {number}");
        assert_eq!(bits(&commands.fins_rad), bits(&recorded.fins_rad), "frame {number}");
        let lines = [
            PyroOutput::LandingIgniter,
            PyroOutput::Parachute,
            PyroOutput::AscentIgniter,
            PyroOutput::Separation,
        ];
        let recorded =
            [recorded.ignite, recorded.parachute, recorded.ignite_booster, recorded.separate_booster];
        assert_eq!(lines.map(|line| commands.outputs.is_on(line)), recorded, "frame {number}");
    }
    flight
}

/// However late the plans, a board whose main context plans decides as the simulator has decided
/// with plans as late.
#[test]
fn a_board_that_senses_the_same_commands_the_same() {
    for slower in [1, 4] {
        let mut sortie = Sortie::new(&recipe(), 0).unwrap().planning_slower(slower);
        let computer = started(&recipe(), &sortie).computer().clone();
        let frames = flown(&mut sortie);
        let ready = frames.iter().filter(|frame| frame.input.plan_ready).count();
        assert!(ready > 20, "{ready} plans and predictions, {slower} times as late");
        let flight = commands_the_same(computer, &frames);
        assert_eq!(flight.computer().digest(), frames.last().unwrap().state_digest);
    }
}

/// A flight from power-up, with these requests of the crew in these frames, and the computer that
/// began it. The simulated rehearsal is over after some seconds.
fn flown_from_the_pad(
    recipe: &Recipe,
    crew: &[(u64, CrewCommand)],
) -> (Computer, Sortie, Vec<ComputerFrame>) {
    let mut sortie = Sortie::on_the_pad(recipe, 0).unwrap();
    let computer = started(recipe, &sortie).computer().clone();
    let (mut frames, mut last) = (Vec::new(), LastFrame::default());
    while sortie.goes_on() || sortie.computer().released_at_s().is_none() {
        let due = crew.iter().filter(|(frame, _)| *frame == sortie.frame());
        let requests: Vec<_> = due.map(|(_, command)| Request::of_the_programme(*command)).collect();
        sortie.step_with(&Outside { requests: &requests, ..Outside::NOBODY }, &mut last);
        let mut frame = *last.take().unwrap();
        // A board has no simulated world.
        frame.input.rehearsed = None;
        frames.push(frame);
        assert!(frames.len() < 40_000);
    }
    (computer, sortie, frames)
}

/// From power-up: it rehearses by itself, its crew arms and starts it, and it lands. The world is
/// moved by a computer that decides the same in every frame.
#[test]
fn a_board_rehearses_arms_and_lands() {
    let crew = [(4_000, CrewCommand::Arm), (4_010, CrewCommand::Start)];
    let (computer, sortie, frames) = flown_from_the_pad(&recipe(), &crew);
    assert!(sortie.outcome().landing.stands, "{:?}", sortie.outcome());
    let flight = commands_the_same(computer, &frames);
    let rehearsed = flight.computer().rehearsed().unwrap();
    assert!(rehearsed.warm, "{rehearsed:?}");
    assert_eq!(flight.computer().mode().phase, sortie.computer().mode().phase);
}

/// A board that plans between the frames. It expects the commands and the log of a recorded flight.
struct Expecting<'f> {
    frames: std::slice::Iter<'f, ComputerFrame>,
    recorded: Option<&'f ComputerFrame>,
    planner: Option<Box<Planner>>,
    messages: usize,
    /// Most in a frame, and the length of the longest, bytes.
    most: [usize; 2],
}

impl port::Board for Expecting<'_> {
    type Error = core::convert::Infallible;

    fn sense(&mut self) -> Result<Option<LoggedInput>, Self::Error> {
        self.recorded = self.frames.next();
        Ok(self.recorded.map(|frame| input_from_log(&frame.input).unwrap()))
    }

    fn act(&mut self, _: &Commands) -> Result<(), Self::Error> {
        Ok(())
    }

    fn submit(&mut self, planner: Box<Planner>) {
        self.planner = Some(planner);
    }

    fn solved(&mut self) -> Option<Box<Planner>> {
        self.planner.take_if(|_| self.recorded.is_some_and(|frame| frame.input.plan_ready))
    }

    fn send(&mut self, messages: &[CrewMessage]) {
        self.messages += messages.len();
        let lengths = messages.iter().map(|message| match message {
            CrewMessage::Text { text, .. } => text.len(),
            CrewMessage::PhaseChanged { .. } => 0,
        });
        self.most = [self.most[0].max(messages.len()), lengths.fold(self.most[1], usize::max)];
    }

    fn log(&mut self, frame: &ComputerFrame) {
        let recorded = self.recorded.unwrap();
        assert_eq!(frame.output, recorded.output, "frame {}", recorded.input.frame);
        assert_eq!(frame.input.rehearsed.is_some(), recorded.input.frame == 1);
    }
}

/// A frame is an interrupt of a main context that may hold the heap: it neither allocates nor
/// frees. From power-up, through a check, refusals, a landing or an abort, to rest.
#[test]
fn no_frame_uses_the_heap() {
    const CREW: [(u64, CrewCommand); 8] = [
        (10, CrewCommand::Start),
        (500, CrewCommand::Check),
        (600, CrewCommand::EndCheck),
        (700, CrewCommand::Arm),
        (900, CrewCommand::Check),
        (6_000, CrewCommand::Arm),
        (6_010, CrewCommand::Start),
        (8_500, CrewCommand::Abort),
    ];
    for (mission, crew) in [("mk2", &CREW[..7]), ("mk3", &CREW[..7]), ("vlr", &CREW[..7]), ("mk3", &CREW)] {
        let recipe = Recipe::built_in(mission, "field").unwrap();
        let (computer, sortie, recorded) = flown_from_the_pad(&recipe, crew);
        let (mut flight, mut frames) = (Frames::new(computer, 0), Vec::new());
        let mut board =
            Expecting { frames: recorded.iter(), recorded: None, planner: None, messages: 0, most: [0; 2] };
        for frame in 1..=recorded.len() {
            let used = allocation_counter::measure(|| assert!(flight.fly(&mut board).unwrap()));
            if (used.count_total, used.bytes_current) != (0, 0) {
                frames.push((frame, flight.computer().mode().phase, used.count_total, used.bytes_current));
            }
            if let Some(planner) = &mut board.planner {
                planner.solve();
            }
        }
        let shown = &frames[..frames.len().min(20)];
        assert!(frames.is_empty(), "{mission}: {} frames of {}: {shown:?}", frames.len(), recorded.len());
        assert!(board.messages > 15, "{mission}: {}", board.messages);
        // Half of the room for each.
        assert!(board.most[0] <= 8 && board.most[1] <= 128, "{mission}: {:?}", board.most);
        assert_eq!(sortie.outcome().landing.stands, crew.len() < CREW.len());
    }
}

#[test]
fn a_fault_in_a_stream_is_reported() {
    let sortie = Sortie::new(&recipe(), 0).unwrap();
    let begin = begin(&sortie);
    let said = |frame: Frame| fly(&bytes_of([frame])).2.unwrap_err().to_string();
    let first = |begin: Begin| Frame { begin: Some(begin), ..Frame::default() };

    assert_eq!(said(Frame { begin: None, ..first(begin.clone()) }), "the first record must say what to fly");
    let unknown = Begin { toml: "luck = 1".to_owned(), ..begin.clone() };
    assert!(said(first(unknown)).starts_with("the first record: mission: "));
    assert_eq!(said(first(begin.clone())), "frame 0: gimbal_rad has 0 values and should have 2");

    let mut cut = bytes_of([first(begin)]);
    cut.pop();
    let (board, answers, _) = fly(&cut);
    assert_eq!((board.reader().missing_its_end(), answers.len()), (cut.len(), 0));
    let (board, _, flown) = fly(&vec![1; 2 * LONGEST_BYTES]);
    assert!(flown.is_ok() && board.reader().missing_its_end() <= LONGEST_BYTES + 61, "memory is bounded");
    assert!(board.reader().broken() > 0);
}

/// Stores the sent messages.
#[derive(Default)]
struct Sent(Vec<u8>);

impl Radio for Sent {
    fn read(&mut self, _: &mut [u8]) -> usize {
        0
    }

    fn write(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }
}

/// A station acts by itself only on a vehicle that reports itself as simulated in both places.
#[test]
fn a_board_reports_to_its_crew_whether_it_is_real() {
    let mut sortie = Sortie::new(&recipe(), 0).unwrap();
    let on_the_air =
        OnTheAir { mission: "mk2".to_owned(), system_id: 1, boot_number: 7, ..OnTheAir::default() };
    let on_the_air = OnTheAir { budget_bytes_s: 20_000, ..on_the_air };
    let mut begin = Some(Begin { on_the_air: Some(on_the_air), ..begin(&sortie) });
    let mut frames = flown(&mut sortie);
    frames.truncate(400);
    let bytes = bytes_of(frames.iter().map(|frame| request(frame, begin.take())));
    for (kind, marked) in [(VehicleKind::Real, false), (VehicleKind::Simulated, true)] {
        let mut radio = Sent::default();
        Board::new(kind).take(&bytes, &mut radio, &mut (), &mut |_: &[u8]| ()).unwrap();
        let mut framer = Framer::new();
        framer.push(&radio.0);
        let said: Vec<bool> = core::iter::from_fn(|| framer.next_frame())
            .filter_map(|frame| match frame.decode() {
                Ok(MavMessage::HEARTBEAT(beat)) => {
                    Some(beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED))
                }
                Ok(MavMessage::TD_FLIGHT_STATUS(status)) => {
                    Some(status.vehicle_flags.contains(TdVehicleFlag::TD_VEHICLE_FLAG_SIMULATED))
                }
                _ => None,
            })
            .collect();
        assert!(said.len() > 4 && said.iter().all(|said| *said == marked), "{kind:?}: {said:?}");
    }
}
