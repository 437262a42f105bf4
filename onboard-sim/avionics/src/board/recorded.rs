//! Flies received frames, and answers each with this machine's decisions.

use alloc::boxed::Box;
use alloc::string::{String, ToString as _};
use alloc::vec::Vec;

use crate::log::again::{FrameError, RecordedComputer, mission_flown};
use crate::log::frame::output_to_log;
use flight::computer::saved::Saved;
use protocol::records::computer_v1::{ComputerInput, ComputerOutput};

pub use crate::link::vehicle::VehicleKind;

use crate::board::radio::{Crewed, Radio};
use crate::board::stream::{Answer, Begin, Frame, Reader, put};

/// Observes the computer while it flies, without changing anything. A machine that counts its
/// instructions counts between `begins` and `ended`.
pub trait Watch {
    /// The computer is built: from here on it flies.
    fn is_set_up(&mut self) {}
    /// The next frame is about to be flown, or the last one's request is about to be computed.
    fn begins(&mut self) {}
    /// The frame of this number was flown, or its request was computed (`posed`).
    fn ended(&mut self, _frame: u64, _posed: bool) {}
    /// The state saved before the machine was reset; `None` at power-up.
    fn saved(&mut self) -> Option<Saved> {
        None
    }
    /// Saves the state that survives a reset, after each frame.
    fn save(&mut self, _saved: &Saved) {}
    /// The computer was dead in the frames before this one: the machine is reset. Where this
    /// returns, the computer is restarted in place.
    fn reset(&mut self, _before: u64) {}
}

impl Watch for () {}

/// Why a flight was not flown to its end.
#[derive(Debug, thiserror::Error)]
pub enum FlyError {
    #[error("the first record must say what to fly")]
    Empty,
    /// No computer can be built from the first record.
    #[error("the first record: {0}")]
    Begin(String),
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// The flight computer on a board: frames in, answers out.
pub struct Board {
    kind: VehicleKind,
    reader: Reader,
    /// Boxed: a large value that is moved is on the stack twice.
    flying: Option<Box<Flying>>,
    frames: u64,
}

struct Flying {
    flight: u32,
    computer: RecordedComputer,
    /// If the board has a radio.
    crewed: Option<Crewed>,
    /// State saved before a reset, until the frames behind it arrive.
    saved: Option<Saved>,
    /// The number of the last frame and its answer, for a repeated request.
    answered: Option<(u64, Vec<u8>)>,
}

impl Board {
    /// Before its first frame. `kind` is the kind that it reports to its crew.
    pub fn new(kind: VehicleKind) -> Self {
        Self { kind, reader: Reader::default(), flying: None, frames: 0 }
    }

    /// Frames that it has flown.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Data received so far.
    pub fn reader(&self) -> &Reader {
        &self.reader
    }

    /// Takes received bytes, flies the frames in them, and gives each answer to `answer` before the
    /// next frame, which may reset the machine. If the flight's first frame identifies the board on
    /// the air, the crew's commands come by radio.
    ///
    /// # Errors
    /// See [`FlyError`]; every frame before the error was answered.
    pub fn take(
        &mut self,
        bytes: &[u8],
        radio: &mut impl Radio,
        watch: &mut impl Watch,
        answer: &mut impl FnMut(&[u8]),
    ) -> Result<(), FlyError> {
        self.reader.push(bytes);
        while let Some(mut frame) = self.reader.next_record::<Frame>() {
            let begin = frame.begin.take();
            if let Some(begin) = begin.filter(|begin| self.flight() != Some(begin.flight)) {
                let flying = Flying::power_up(self.kind, &begin, watch.saved());
                self.flying = Some(Box::new(flying.map_err(FlyError::Begin)?));
                watch.is_set_up();
            }
            let flying = self.flying.as_mut().ok_or(FlyError::Empty)?;
            self.frames += u64::from(flying.fly(&frame.input, radio, watch, answer)?);
        }
        Ok(())
    }

    fn flight(&self) -> Option<u32> {
        self.flying.as_ref().map(|flying| flying.flight)
    }
}

impl Flying {
    /// Returns whether the frame was flown now.
    fn fly(
        &mut self,
        input: &ComputerInput,
        radio: &mut impl Radio,
        watch: &mut impl Watch,
        answer: &mut impl FnMut(&[u8]),
    ) -> Result<bool, FlyError> {
        let number = input.frame;
        if let Some((_, bytes)) = self.answered.as_ref().filter(|(answered, _)| *answered == number) {
            answer(bytes);
            return Ok(false);
        }
        match self.saved.take_if(|saved| saved.frame() < number) {
            Some(saved) => self.computer.resume(&saved, number),
            // Flown before the reset.
            None if self.saved.is_some() => return Ok(false),
            None if self.computer.was_reset_before(number) => watch.reset(number),
            None => {}
        }
        let computer = &mut self.computer;
        let read = computer.read(input)?;
        let read = match &self.crewed {
            Some(crewed) => crewed.with_uplink(read),
            None => read,
        };
        watch.begins();
        let output = computer.step(&read);
        watch.ended(number, false);
        let computer = computer.computer();
        let speak = |crewed: &mut Crewed| crewed.flown(&read.input(), &output, computer, radio);
        let decided = Answer {
            frame: number,
            output: output_to_log(&output, computer, ComputerOutput::default()),
            state_digest: computer.digest(),
            radio: self.crewed.as_mut().map(speak),
        };
        watch.save(&self.computer.computer().saved());
        let mut bytes = Vec::new();
        put(&decided, &mut bytes);
        answer(&bytes);
        self.answered = Some((number, bytes));
        // With a timer, frames would continue meanwhile. The simulator decides which frame takes
        // the result over.
        watch.begins();
        if self.computer.computer_mut().solve_requested().is_some() {
            watch.ended(number, true);
        }
        Ok(true)
    }

    /// The flight computer before its first frame, and the crew's end of it; or why there is none.
    fn power_up(kind: VehicleKind, begin: &Begin, saved: Option<Saved>) -> Result<Self, String> {
        let mission = flight::vehicles::mission::from_toml(&begin.toml, "mission");
        let mission = mission_flown(mission.map_err(|error| error.to_string())?, &begin.start, |_| false);
        let computer = RecordedComputer::started(&mission, &begin.start);
        let crewed = begin.on_the_air.as_ref().map(|air| Crewed::new(kind, air, &mission, &begin.toml));
        Ok(Self { flight: begin.flight, computer, crewed, saved, answered: None })
    }
}
