//! A simulated flight as a stream: the answers are what was recorded, and what is wrong with a stream is said.
#![expect(clippy::unwrap_used, reason = "tests")]

use board::port::{self, Readings};
use board::recorded::{Board, FlyError};
use board::stream::{Answer, Begin, Frame, LONGEST_BYTES, Reader, put};
use flight::computer::news::News;
use flight::computer::pilot::{PilotInput, Sensed};
use flight::computer::{Commands, Computer, Input};
use flight::guidance::baseline::Law;
use log_records::computer_v1::{ComputerFrame, ComputerInput};
use log_records::flight_v1::PilotInput as PilotRecord;
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use tick_log::again::RecordedComputer;
use tick_log::pilot::{input_to_log, output_to_log};

/// More than the messages of a frame need, bytes, with the parts that they are put together from: 1,073 at ignition, when the
/// gate says every number that it has looked at.
const NEWS_BYTES_MAX: u64 = 2048;

/// What a board answers to bytes that arrive a few at a time, as a serial line gives them.
fn fly(bytes: &[u8]) -> (Board, Vec<Answer>, Result<(), FlyError>) {
    let (mut board, mut out, mut flown) = (Board::default(), Vec::new(), Ok(()));
    for arrived in bytes.chunks(61) {
        flown = board.take(arrived, &mut (), &mut (), &mut out);
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
        controller: recipe().controller.name().to_owned(),
        at_power_up: None,
        in_the_air: Some(tick_log::sortie::pilot_start(sortie)),
        on_the_air: None,
        flight: 7,
    }
}

/// A flight's input and expected answer in each frame.
fn flown(sortie: &mut Sortie) -> Vec<(PilotInput, Answer)> {
    let mut frames = Vec::new();
    while sortie.goes_on() {
        sortie.step();
        let (input, output) = sortie.computer().piloted().unwrap();
        let answer = Answer {
            frame: input.frame,
            from_power_up: None,
            in_the_air: Some(output_to_log(output)),
            state_digest: sortie.computer().flight_digest(),
            heard: None,
        };
        frames.push((*input, answer));
    }
    frames
}

fn in_the_air(input: &PilotInput, begin: Option<Begin>) -> Frame {
    Frame { in_the_air: Some(input_to_log(input)), begin, ..Frame::default() }
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
    let bytes = bytes_of(frames.iter().map(|(input, _)| in_the_air(input, begin.take())));
    let (board, answers, flown) = fly(&bytes);
    flown.unwrap();
    assert_eq!((board.frames(), board.reader().broken()), (frames.len() as u64, 0));
    assert_eq!(answers.len(), frames.len());
    for (answer, (_, expected)) in answers.iter().zip(&frames) {
        assert_eq!(prost::Message::encode_to_vec(answer), prost::Message::encode_to_vec(expected));
    }
}

/// Every frame is asked twice, with the flight's beginning, and comes through noise and with broken copies.
#[test]
fn a_bad_wire_changes_no_answer() {
    let mut sortie = Sortie::new(&recipe(), 0).unwrap();
    let begin = begin(&sortie);
    let frames: Vec<_> = flown(&mut sortie).into_iter().take(300).collect();
    let mut bytes = b"noise before the first frame".to_vec();
    bytes.push(0);
    for (input, _) in &frames {
        let whole = bytes_of([in_the_air(input, Some(begin.clone()))]);
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
    let expected: Vec<&Answer> = frames.iter().flat_map(|(_, answer)| [answer, answer]).collect();
    assert_eq!(answers.iter().collect::<Vec<_>>(), expected);
}

/// A board that senses what was recorded, and notes its commands.
struct Recorded<'f> {
    frames: std::slice::Iter<'f, (PilotInput, Answer)>,
    commanded: Vec<Commands>,
    kept: u64,
}

impl port::Board for Recorded<'_> {
    type Error = core::convert::Infallible;

    fn sense(&mut self) -> Result<Option<Readings>, Self::Error> {
        Ok(self.frames.next().map(|(input, _)| {
            let Sensed::Measured(measured) = input.sensed else { panic!("sensors fly") };
            let flown = Input::in_the_air(input);
            Readings {
                measured,
                gimbal_rad: flown.gimbal_rad,
                fins_rad: flown.fins_rad,
                contact: flown.contact,
                igniter_continuity: flown.igniter_continuity,
                booster_attached: flown.booster_attached,
                pin_out: flown.pin_out,
                battery_v: flown.battery_v,
                log: flown.log,
                uplink: flown.uplink,
                commander: flown.commander,
                people: flown.people,
                requests: flown.requests.to_vec(),
                rehearsed: None,
            }
        }))
    }

    fn act(&mut self, commands: &Commands) -> Result<(), Self::Error> {
        self.commanded.push(*commands);
        Ok(())
    }

    fn tell(&mut self, _: &[News]) {}

    fn keep(&mut self, frame: &ComputerFrame) {
        self.kept += 1;
        assert_eq!(frame.input.frame, self.kept);
    }
}

#[test]
fn a_board_that_senses_the_same_commands_the_same() {
    let mut sortie = Sortie::new(&recipe(), 0).unwrap();
    let start = tick_log::sortie::pilot_start(&sortie);
    let frames = flown(&mut sortie);
    let believed = tick_log::pilot::state_from_log(&start.believed);
    let mut computer = Computer::at_power_up(&recipe().mission, Law::Nmpc, &believed).released();
    let mut board = Recorded { frames: frames.iter(), commanded: Vec::new(), kept: 0 };
    port::fly(&mut computer, &mut board).unwrap();
    assert_eq!((board.kept, board.commanded.len()), (frames.len() as u64, frames.len()));
    for ((input, answer), commands) in frames.iter().zip(&board.commanded) {
        let recorded = answer.in_the_air.as_ref().unwrap();
        let bits = |angles: &[f64]| angles.iter().map(|angle| angle.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&commands.gimbal_rad), bits(&recorded.gimbal_rad), "frame {}", input.frame);
        assert_eq!(bits(&commands.fins_rad), bits(&recorded.fins_rad), "frame {}", input.frame);
        assert_eq!((commands.ignite, commands.parachute), (recorded.ignite, recorded.parachute));
    }
    assert_eq!(computer.flight_digest(), frames.last().unwrap().1.state_digest);
}

/// On a board the heap is for set-up. In flight there are only the lists of a frame's news, which go with the frame.
#[test]
fn in_flight_only_news_allocate() {
    let mut sortie = Sortie::new(&recipe(), 0).unwrap();
    let start = tick_log::sortie::pilot_start(&sortie);
    let frames = flown(&mut sortie);
    let mut computer = RecordedComputer::in_the_air(&recipe().mission, &start, recipe().controller);
    let mut frames_with_news = 0;
    for (input, _) in &frames {
        let mut news = 0;
        let allocated = allocation_counter::measure(|| news = computer.step_in_the_air(input).news.len());
        let frame = input.frame;
        if news == 0 {
            assert_eq!(allocated.count_total, 0, "frame {frame}: {allocated:?}");
        } else {
            frames_with_news += 1;
            assert!(allocated.bytes_max < NEWS_BYTES_MAX, "frame {frame}: {allocated:?}");
        }
        assert_eq!(allocated.bytes_current, 0, "frame {frame}: {allocated:?}");
    }
    assert!(frames_with_news > 3, "apogee, ignition, touchdown: {frames_with_news}");
}

#[test]
fn what_is_wrong_with_a_stream_is_said() {
    let sortie = Sortie::new(&recipe(), 0).unwrap();
    let begin = begin(&sortie);
    let said = |frame: Frame| fly(&bytes_of([frame])).2.unwrap_err().to_string();
    let first = |begin: Begin| Frame {
        in_the_air: Some(PilotRecord::default()),
        begin: Some(begin),
        ..Frame::default()
    };

    assert_eq!(said(Frame { begin: None, ..first(begin.clone()) }), "the first record must say what to fly");
    let nothing = Begin { in_the_air: None, ..begin.clone() };
    assert_eq!(
        said(first(nothing)),
        "the first record: must name one start, with a radio only from power-up on"
    );
    let unknown = Begin { controller: "luck".to_owned(), ..begin.clone() };
    assert_eq!(
        said(first(unknown)),
        "the first record: no controller is named `luck`; there are nmpc, open-loop and oscillating"
    );
    let two = Frame { from_power_up: Some(ComputerInput::default()), ..first(begin.clone()) };
    let one = "the record after 0 frames must have one input, of a flight from power-up or in the air";
    assert_eq!(said(two), one);
    assert!(said(first(begin.clone())).starts_with("frame 0: needs measurements"));

    let mut cut = bytes_of([first(begin)]);
    cut.pop();
    let (board, answers, _) = fly(&cut);
    assert_eq!((board.reader().missing_its_end(), answers.len()), (cut.len(), 0));
    let (board, _, flown) = fly(&vec![1; 2 * LONGEST_BYTES]);
    assert!(flown.is_ok() && board.reader().missing_its_end() <= LONGEST_BYTES + 61, "memory is bounded");
    assert!(board.reader().broken() > 0);
}
