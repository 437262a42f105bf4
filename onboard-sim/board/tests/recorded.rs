//! A simulated flight as a stream: the answers are what was recorded, and what is wrong with a stream is said.
#![expect(clippy::unwrap_used, reason = "tests")]

use board::port::{Board, Readings};
use board::recorded::{FlyError, fly};
use board::stream::{Answer, Begin, Frame, LONGEST_BYTES, Link, StreamError, receive, send};
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

/// A link in memory.
#[derive(Default)]
struct Memory {
    to_read: Vec<u8>,
    read: usize,
    written: Vec<u8>,
}

impl Link for Memory {
    type Error = core::convert::Infallible;

    /// Some bytes at a time, as a serial line gives them.
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Self::Error> {
        let bytes = into.len().min(self.to_read.len() - self.read).min(61);
        into[..bytes].copy_from_slice(&self.to_read[self.read..self.read + bytes]);
        self.read += bytes;
        Ok(bytes)
    }

    fn write_all(&mut self, bytes: &[u8]) -> Result<(), Self::Error> {
        self.written.extend(bytes);
        Ok(())
    }
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
    }
}

/// A flight's input and expected answer in each frame.
fn flown(sortie: &mut Sortie) -> Vec<(PilotInput, Answer)> {
    let mut frames = Vec::new();
    while sortie.goes_on() {
        sortie.step();
        let (input, output) = sortie.computer().piloted().unwrap();
        let answer = Answer {
            from_power_up: None,
            in_the_air: Some(output_to_log(output)),
            state_digest: sortie.computer().flight_digest(),
            heard: None,
        };
        frames.push((*input, answer));
    }
    frames
}

fn stream(begin: &Begin, frames: impl IntoIterator<Item = Frame>) -> Memory {
    let (mut link, mut buffer) = (Memory::default(), Vec::new());
    send(&mut link, begin, &mut buffer).unwrap();
    for frame in frames {
        send(&mut link, &frame, &mut buffer).unwrap();
    }
    Memory { to_read: link.written, ..Memory::default() }
}

fn in_the_air(input: &PilotInput) -> Frame {
    Frame { from_power_up: None, in_the_air: Some(input_to_log(input)) }
}

#[test]
fn a_flight_through_a_stream_is_answered_as_it_was_flown_bit_for_bit() {
    let mut sortie = Sortie::new(&recipe(), 0).unwrap();
    let begin = begin(&sortie);
    let frames = flown(&mut sortie);
    let mut link = stream(&begin, frames.iter().map(|(input, _)| in_the_air(input)));
    assert_eq!(fly(&mut link, &mut (), &mut ()).unwrap(), frames.len() as u64);
    let (mut answers, mut buffer) = (Memory { to_read: link.written, ..Memory::default() }, Vec::new());
    for (_, expected) in &frames {
        let answer: Answer = receive(&mut answers, &mut buffer).unwrap().unwrap();
        assert_eq!(prost::Message::encode_to_vec(&answer), prost::Message::encode_to_vec(expected));
    }
    assert_eq!(receive::<Answer, _>(&mut answers, &mut buffer).unwrap(), None);
}

/// A board that senses what was recorded, and notes its commands.
struct Recorded<'f> {
    frames: std::slice::Iter<'f, (PilotInput, Answer)>,
    commanded: Vec<Commands>,
    kept: u64,
}

impl Board for Recorded<'_> {
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
    board::port::fly(&mut computer, &mut board).unwrap();
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
    let said = |mut link: Memory| fly(&mut link, &mut (), &mut ()).unwrap_err().to_string();

    assert!(matches!(fly(&mut Memory::default(), &mut (), &mut ()), Err(FlyError::Empty)));
    let nothing = Begin { in_the_air: None, ..begin.clone() };
    assert_eq!(
        said(stream(&nothing, [])),
        "the first record: must name one start, with a radio only from power-up on"
    );
    let unknown = Begin { controller: "luck".to_owned(), ..begin.clone() };
    assert_eq!(
        said(stream(&unknown, [])),
        "the first record: no controller is named `luck`; there are nmpc, open-loop and oscillating"
    );
    let empty = Frame { from_power_up: Some(ComputerInput::default()), in_the_air: None };
    let two = Frame { in_the_air: Some(PilotRecord::default()), ..empty.clone() };
    let one = "the record after 0 frames must have one input, of a flight from power-up or in the air";
    assert_eq!(said(stream(&begin, [two])), one);
    assert!(said(stream(&begin, [empty])).starts_with("frame 0: needs measurements"));

    let mut cut = stream(&begin, []);
    cut.to_read.pop();
    let bytes = cut.to_read.len() - 3;
    assert_eq!(said(cut), format!("the stream ends inside a record: 1 of {bytes} bytes are missing"));
    let mut long = Memory::default();
    long.to_read.extend((LONGEST_BYTES as u32 + 1).to_le_bytes());
    assert!(matches!(
        fly(&mut long, &mut (), &mut ()),
        Err(FlyError::Stream(StreamError::TooLong { bytes })) if bytes == LONGEST_BYTES + 1
    ));
}
