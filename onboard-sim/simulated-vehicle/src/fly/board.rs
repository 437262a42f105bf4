//! A flight computer on a board that decides every frame of a flight beside the one in this process, and hears the crew on a
//! radio of its own.
//!
//! What the crew asks for comes from the board with its answer to the frame before. The vehicle's frame is over when the board has
//! answered it with the same output and the same digest of its memory, bit for bit; otherwise the flight ends with an error. So
//! what moves the vehicle is what the board has decided, from what the board has heard.
//!
//! The board is at the other end of two pipes in a folder, `frames` and `answers`, and reads a flight as
//! [`board::stream`] describes it. A board that was dead in some frames finds that out from the number of the next one, and
//! resets itself; so behind missing frames the flight's first record and that frame are sent again.

use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use board::stream::{self, Answer, Begin, Frame, Link, OnTheAir, StreamError, receive, send};
use flight::rules::arming::Uplink;
use protocol::log::computer_v1::{ComputerFrame, ComputerInput};
use protocol::log::record::Record;
use tick_log::computer::{commander_from_log, request_from_log, uplink_from_log};
use tick_log::pilot::PilotLogError;

use crate::endpoint::Heard;
use crate::vehicle::{Vehicle, VehicleEvent};

/// A board that is silent for longer has stopped. An emulated one plans a landing in a second or two.
const PATIENCE: Duration = Duration::from_secs(30);

/// Why a flight with a board has ended early.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    #[error("{}: {source}", path.display())]
    Pipe { path: PathBuf, source: io::Error },
    #[error("the board's pipes: {0}")]
    Stream(#[from] StreamError<io::Error>),
    #[error("the board has not answered frame {frame} for {PATIENCE:?}")]
    Silent { frame: u64 },
    #[error("the board has closed its pipe before it answered frame {frame}")]
    Gone { frame: u64 },
    #[error("frame {frame}: the board has decided something else than the computer in this process")]
    Differs { frame: u64 },
    #[error("what the board has heard: {0}")]
    Heard(#[from] PilotLogError),
}

/// The pipe to the board as a link that is only written.
struct Frames(File);

impl Link for Frames {
    type Error = io::Error;

    fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
        Ok(0)
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }
}

/// The pipe from the board as a link that is only read.
struct Answers(BufReader<File>);

impl Link for Answers {
    type Error = io::Error;

    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.0.read(into)
    }

    fn write_all(&mut self, _: &[u8]) -> io::Result<()> {
        Ok(())
    }
}

/// A board at the other end of two pipes.
pub(super) struct OnBoard {
    frames: Frames,
    answers: Receiver<Result<Option<Answer>, StreamError<io::Error>>>,
    begin: Begin,
    /// The number of the last frame.
    last: Option<u64>,
    /// For the next frame; `None` of a board that has not answered the last one: it has heard nobody yet.
    heard: Option<stream::Heard>,
    buffer: Vec<u8>,
}

impl OnBoard {
    /// Opens the pipes in a folder; waits until the board has opened them, too.
    pub(super) fn open(
        folder: &Path,
        (mission_toml, controller): (&str, &str),
        on_the_air: OnTheAir,
    ) -> Result<Self, BoardError> {
        let opened = |name: &str, options: &OpenOptions| {
            let path = folder.join(name);
            options.open(&path).map_err(|source| BoardError::Pipe { path, source })
        };
        // In the order in which the board opens them.
        let frames = Frames(opened("frames", OpenOptions::new().write(true))?);
        let mut from_board = Answers(BufReader::new(opened("answers", OpenOptions::new().read(true))?));
        let (sender, answers) = sync_channel(1);
        let reading = thread::Builder::new().name("board".into()).spawn(move || {
            let mut buffer = Vec::new();
            loop {
                let answer = receive(&mut from_board, &mut buffer);
                let ended = !matches!(answer, Ok(Some(_)));
                if sender.send(answer).is_err() || ended {
                    return;
                }
            }
        });
        reading.map_err(|source| BoardError::Pipe { path: folder.join("answers"), source })?;
        let begin = Begin {
            toml: mission_toml.to_owned(),
            controller: controller.to_owned(),
            on_the_air: Some(on_the_air),
            ..Begin::default()
        };
        Ok(Self { frames, answers, begin, last: None, heard: None, buffer: Vec::new() })
    }

    /// Steps the vehicle by one frame with what the board has heard; the board decides it, too.
    pub(super) fn step(
        &mut self,
        vehicle: &mut Vehicle,
        stopwatch: &mut dyn FnMut() -> Duration,
    ) -> Result<Vec<VehicleEvent>, BoardError> {
        let Heard { uplink, commander, requests } = self.heard()?;
        vehicle.set_uplink(uplink, commander);
        let events = vehicle.step(&requests, stopwatch).events;
        self.heard = None;
        self.decide(vehicle)?;
        Ok(events)
    }

    fn heard(&self) -> Result<Heard, PilotLogError> {
        let Some(stream::Heard { uplink, commander, requests }) = &self.heard else {
            return Ok(Heard { uplink: Uplink::NeverHeard, commander: None, requests: Vec::new() });
        };
        let next = self.last.map_or(0, |last| last + 1);
        let requests = requests.iter().map(|request| request_from_log(request, next));
        Ok(Heard {
            uplink: uplink_from_log(uplink.as_ref()),
            commander: commander.as_ref().map(|commander| commander_from_log(commander, next)).transpose()?,
            requests: requests.collect::<Result<_, _>>()?,
        })
    }

    /// Has the board decide the vehicle's last frame, if its computer lived in it, and compares.
    fn decide(&mut self, vehicle: &Vehicle) -> Result<(), BoardError> {
        for record in vehicle.computer_records() {
            match record {
                Record::ComputerStart(start) => {
                    self.begin.at_power_up = Some(*start);
                    send(&mut self.frames, &self.begin, &mut self.buffer)?;
                }
                Record::ComputerFrame(frame) => self.compare(&frame)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn compare(&mut self, frame: &ComputerFrame) -> Result<(), BoardError> {
        let number = frame.input.frame;
        // The board knows itself what it has heard.
        let input =
            ComputerInput { uplink: None, commander: None, requests: Vec::new(), ..frame.input.clone() };
        let sent = Frame { from_power_up: Some(input), in_the_air: None };
        send(&mut self.frames, &sent, &mut self.buffer)?;
        if self.last.is_some_and(|last| number > last + 1) {
            send(&mut self.frames, &self.begin, &mut self.buffer)?;
            send(&mut self.frames, &sent, &mut self.buffer)?;
        }
        self.last = Some(number);
        let answer = match self.answers.recv_timeout(PATIENCE) {
            Ok(answer) => answer?.ok_or(BoardError::Gone { frame: number })?,
            Err(RecvTimeoutError::Timeout) => return Err(BoardError::Silent { frame: number }),
            Err(RecvTimeoutError::Disconnected) => return Err(BoardError::Gone { frame: number }),
        };
        let expected = Answer {
            from_power_up: Some(frame.output.clone()),
            in_the_air: None,
            state_digest: frame.state_digest,
            heard: None,
        };
        if !answer.is_same_as(&expected) {
            return Err(BoardError::Differs { frame: number });
        }
        self.heard = answer.heard;
        Ok(())
    }
}
