//! Flies a recorded flight, frame by frame, and answers each frame with what this machine decided.

use alloc::string::{String, ToString as _};
use alloc::vec::Vec;

use flight::computer::Output;
use flight::computer::saved::Saved;
use flight::guidance::baseline::Controller;
use log_records::computer_v1::ComputerStart;
use tick_log::again::{FrameError, RecordedComputer, mission_flown};
use tick_log::computer::output_to_log;
use tick_log::pilot;

use crate::radio::{Crewed, Radio};
use crate::stream::{Answer, Begin, Frame, Link, StreamError, receive, send};

/// What looks at the computer while it flies, without changing anything. A machine that counts its instructions counts
/// between `begins` and `ended`.
pub trait Watch {
    /// The computer is built: from here on it flies.
    fn is_set_up(&mut self) {}
    /// The next frame is flown now.
    fn begins(&mut self) {}
    /// The frame of this number was flown.
    fn ended(&mut self, _frame: u64, _output: &Output) {}
    /// What was saved before the machine was reset; `None` at power-up.
    fn saved(&mut self) -> Option<Saved> {
        None
    }
    /// Saves what is kept through a reset, after each frame.
    fn save(&mut self, _saved: &Saved) {}
    /// The computer was dead in the frames before this one: the machine is reset. Where this returns, the computer is
    /// restarted in place.
    fn reset(&mut self, _before: u64) {}
}

impl Watch for () {}

/// Why a recorded flight was not flown to its end.
#[derive(Debug, thiserror::Error)]
pub enum FlyError<E> {
    #[error(transparent)]
    Stream(#[from] StreamError<E>),
    #[error("the stream is empty: its first record must say what to fly")]
    Empty,
    /// No computer can be built from the first record.
    #[error("the first record: {0}")]
    Begin(String),
    #[error("the record after {after} frames must have one input, of a flight from power-up or in the air")]
    TwoInputs { after: u64 },
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// Flies the flight that comes over the link. If it says who the board is on the air, the crew is heard over the radio.
/// Returns the number of its frames.
///
/// # Errors
/// See [`FlyError`]; every frame before the error was answered.
pub fn fly<L: Link>(
    link: &mut L,
    radio: &mut impl Radio,
    watch: &mut impl Watch,
) -> Result<u64, FlyError<L::Error>> {
    let mut buffer = Vec::new();
    let begin: Begin = receive(link, &mut buffer)?.ok_or(FlyError::Empty)?;
    let (mut computer, mut crewed) = power_up(&begin).map_err(FlyError::Begin)?;
    drop(begin);
    watch.is_set_up();
    let mut frames = 0;
    let mut saved = watch.saved();
    while let Some(frame) = receive::<Frame, _>(link, &mut buffer)? {
        if let Some(number) = frame.number() {
            match saved.take_if(|saved| saved.frame() < number) {
                Some(saved) => computer = computer.resumed(&saved, number),
                // Flown before the reset.
                None if saved.is_some() => continue,
                None if computer.was_reset_before(number) => watch.reset(number),
                None => {}
            }
        }
        let answer = match (&frame.from_power_up, &frame.in_the_air) {
            (Some(input), None) => {
                let read = computer.read(input)?;
                let read = match &crewed {
                    Some(crewed) => crewed.hear(read),
                    None => read,
                };
                watch.begins();
                let output = computer.step(&read);
                watch.ended(input.frame, &output);
                let computer = computer.computer();
                let speak = |crewed: &mut Crewed| crewed.flown(&read.input(), &output, computer, radio);
                Answer {
                    from_power_up: Some(output_to_log(&output, computer)),
                    in_the_air: None,
                    state_digest: computer.digest(),
                    heard: crewed.as_mut().map(speak),
                }
            }
            (None, Some(input)) => {
                let read = computer.read_in_the_air(input)?;
                watch.begins();
                let output = computer.step_in_the_air(&read);
                watch.ended(input.frame, &output);
                let computer = computer.computer();
                Answer {
                    from_power_up: None,
                    in_the_air: computer.piloted().map(|(_, output)| pilot::output_to_log(output)),
                    state_digest: computer.flight_digest(),
                    heard: None,
                }
            }
            _ => return Err(FlyError::TwoInputs { after: frames }),
        };
        send(link, &answer, &mut buffer)?;
        watch.save(&computer.computer().saved());
        frames += 1;
    }
    Ok(frames)
}

/// The flight computer before its first frame, and the crew's end of it; or why there is none.
fn power_up(begin: &Begin) -> Result<(RecordedComputer, Option<Crewed>), String> {
    let controller: Controller = begin.controller.parse().map_err(|error| alloc::format!("{error}"))?;
    let mission = |start| {
        let mission = vehicles::mission::from_toml(&begin.toml, "mission");
        mission.map_err(|error| error.to_string()).map(|mission| mission_flown(mission, start))
    };
    match (&begin.at_power_up, &begin.in_the_air, &begin.on_the_air) {
        (Some(ComputerStart { start }), None, on_the_air) => {
            let mission = mission(start)?;
            let computer = RecordedComputer::at_power_up(&mission, start, controller);
            let crewed = on_the_air.as_ref().map(|on_the_air| Crewed::new(on_the_air, mission, &begin.toml));
            Ok((computer, crewed))
        }
        (None, Some(start), None) => {
            Ok((RecordedComputer::in_the_air(&mission(start)?, start, controller), None))
        }
        _ => Err("must name one start, with a radio only from power-up on".into()),
    }
}
