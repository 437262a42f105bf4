//! A flight computer on a board that decides every frame of a flight in parallel with the one in
//! this process, and receives the crew's commands by radio.
//!
//! The crew's requests come from the board with its answer to the frame before. The vehicle's frame
//! is complete when the board has answered it with the same output and the same digest of its
//! memory, bit for bit; otherwise the flight ends with an error. So the vehicle moves by the
//! board's decisions, from the board's received data.
//!
//! The board is at the other end of two pipes in a folder, `frames` and `answers`, and reads a
//! flight as described in [`avionics::board::stream`]; the connection behind the pipes (a process,
//! an emulator, `socat` and a cable) may lose bytes. An unanswered frame is sent again, with the
//! flight's beginning. A board that was down in some frames detects that from the number of the
//! next one, and resets itself; so after missing frames that frame is sent twice.

use std::fs::{File, OpenOptions};
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::{Read as _, Write as _};
use std::num::{NonZeroU16, NonZeroU32};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;
use std::{io, thread};

use avionics::board::stream;
use avionics::board::stream::{Answer, Begin, Frame, OnTheAir, Reader, put};
use avionics::log::logged::{At, Logged, RecordError};
use flight::computer::crew::Requests;
use flight::rules::arming::Uplink;
use protocol::hub::line::SHARE;
use protocol::identity::{LARGEST_BOOT_NUMBER, NETWORK_BUDGET_BYTES_S, RADIO_BUDGET_BYTES_S};
use protocol::log::computer_v1::{ComputerFrame, ComputerInput};
use protocol::log::record::Record;
use protocol::transport::LinkAddress;

use crate::wire::endpoint::UplinkState;
use crate::wire::vehicle::{Vehicle, VehicleEvent};

/// A board that is silent for longer has stopped. An emulated one plans a landing in a second or
/// two.
const PATIENCE: Duration = Duration::from_secs(30);

/// A frame without an answer is sent again after this time. An emulated board that still plans
/// answers it twice.
const SENT_AGAIN_AFTER: Duration = Duration::from_millis(500);

/// Why a flight with a board has ended early.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    #[error("{}: cannot be opened", path.display())]
    Pipe { path: PathBuf, source: io::Error },
    #[error("the board's pipes: {0}")]
    Pipes(#[from] io::Error),
    #[error("the board has not answered frame {frame} for {PATIENCE:?}")]
    Silent { frame: u64 },
    #[error("the board has closed its pipe before it answered frame {frame}")]
    Gone { frame: u64 },
    #[error("frame {frame}: the board has decided something else than the computer in this process")]
    Differs { frame: u64 },
    #[error("input from the board's radio: {0}")]
    Uplink(#[from] RecordError),
}

/// A board at the other end of two pipes.
pub struct OnBoard {
    frames: File,
    answers: Receiver<io::Result<Answer>>,
    begin: Begin,
    /// The number of the last frame.
    last: Option<u64>,
    /// For the next frame; `None` for a board that has not answered the last one: it has received
    /// nothing yet.
    radio: Option<stream::RadioInput>,
}

impl OnBoard {
    /// Opens the pipes in a folder; waits until the board has opened them, too.
    ///
    /// # Errors
    /// The pipes cannot be opened.
    pub fn open(folder: &Path, mission_toml: &str, on_the_air: OnTheAir) -> Result<Self, BoardError> {
        let opened = |name: &str, options: &OpenOptions| {
            let path = folder.join(name);
            options.open(&path).map_err(|source| BoardError::Pipe { path, source })
        };
        // In the order in which the board opens them.
        let frames = opened("frames", OpenOptions::new().write(true))?;
        let mut from_board = opened("answers", OpenOptions::new().read(true))?;
        let (sender, answers) = sync_channel(16);
        let reading = thread::Builder::new().name("board".into()).spawn(move || {
            let (mut reader, mut arrived) = (Reader::default(), [0; 4096]);
            loop {
                match from_board.read(&mut arrived) {
                    Ok(0) => return,
                    Ok(read) => reader.push(&arrived[..read]),
                    Err(error) => {
                        let _ = sender.send(Err(error));
                        return;
                    }
                }
                while let Some(answer) = reader.next_record() {
                    if sender.send(Ok(answer)).is_err() {
                        return;
                    }
                }
            }
        });
        reading.map_err(|source| BoardError::Pipe { path: folder.join("answers"), source })?;
        let begin = Begin {
            toml: mission_toml.to_owned(),
            flight: on_the_air.boot_number,
            on_the_air: Some(on_the_air),
            ..Begin::default()
        };
        Ok(Self { frames, answers, begin, last: None, radio: None })
    }

    /// Steps the vehicle by one frame with the board's radio input; the board decides it, too.
    ///
    /// # Errors
    /// The board is silent, has ended or has decided differently.
    pub fn step(&mut self, vehicle: &mut Vehicle) -> Result<Vec<VehicleEvent>, BoardError> {
        let UplinkState { uplink, commander, requests } = self.uplink_state()?;
        vehicle.set_uplink(uplink, commander);
        let events = vehicle.step(&requests).events;
        self.radio = None;
        self.decide(vehicle)?;
        Ok(events)
    }

    fn uplink_state(&self) -> Result<UplinkState, RecordError> {
        let Some(stream::RadioInput { uplink, commander, requests }) = &self.radio else {
            let (uplink, requests) = (Uplink::NeverReceived, Requests::new());
            return Ok(UplinkState { uplink, commander: None, requests });
        };
        let at = At { frame: self.last.map_or(0, |last| last + 1), field: "radio" };
        Ok(UplinkState {
            uplink: Logged::from_log(uplink, at)?,
            commander: Logged::from_log(commander, at)?,
            requests: Logged::from_log(requests, at)?,
        })
    }

    /// Has the board decide the vehicle's last frame, if its computer lived in it, and compares.
    fn decide(&mut self, vehicle: &Vehicle) -> Result<(), BoardError> {
        for record in vehicle.computer_records() {
            match record {
                Record::ComputerStart(start) if !start.released => self.begin.start = *start,
                Record::ComputerFrame(frame) => self.compare(&frame)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn compare(&mut self, frame: &ComputerFrame) -> Result<(), BoardError> {
        let number = frame.input.frame;
        // The board has its own radio input.
        let input =
            ComputerInput { uplink: None, commander: None, requests: Vec::new(), ..frame.input.clone() };
        let sent = Frame { input, begin: None };
        let (mut once, mut again) = (Vec::new(), Vec::new());
        put(&sent, &mut once);
        put(&Frame { begin: Some(self.begin.clone()), ..sent }, &mut again);
        match self.last {
            None => self.frames.write_all(&again)?,
            Some(last) => {
                self.frames.write_all(&once)?;
                if number > last + 1 {
                    self.frames.write_all(&again)?;
                }
            }
        }
        self.last = Some(number);
        let answer = self.answer_to(number, &again)?;
        let expected = Answer {
            frame: number,
            output: frame.output.clone(),
            state_digest: frame.state_digest,
            radio: None,
        };
        if !answer.is_same_as(&expected) {
            return Err(BoardError::Differs { frame: number });
        }
        self.radio = answer.radio;
        Ok(())
    }

    /// Waits for the answer to a frame; older ones were given already.
    fn answer_to(&mut self, number: u64, again: &[u8]) -> Result<Answer, BoardError> {
        let mut waited = Duration::ZERO;
        while waited < PATIENCE {
            match self.answers.recv_timeout(SENT_AGAIN_AFTER) {
                Ok(answer) => {
                    let answer = answer?;
                    if answer.frame == number {
                        return Ok(answer);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {
                    waited += SENT_AGAIN_AFTER;
                    self.frames.write_all(again)?;
                }
                Err(RecvTimeoutError::Disconnected) => return Err(BoardError::Gone { frame: number }),
            }
        }
        Err(BoardError::Silent { frame: number })
    }
}

// Identity and budgets of a vehicle on the wire, fixed at power-up.

/// Identity and budgets of a vehicle on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnTheWire {
    /// Random number drawn once at each power-up: a different number means a different boot.
    pub boot_number: NonZeroU32,
    /// Random number of the vehicle, the same after each power-up if it is stored.
    pub uid: NonZeroU16,
    /// Budget of each network link, bytes per second.
    pub network_bytes_s: u32,
    /// Budget of each serial link, bytes per second, up to four fifths of its baud rate: the
    /// capacity of a radio behind it.
    pub serial_bytes_s: u32,
}

impl OnTheWire {
    /// A random boot number and unique id, a network's budget on network links and a radio's on
    /// serial ones.
    pub fn drawn() -> Self {
        // The standard library's random hash keys differ in every process.
        let drawn = || RandomState::new().build_hasher().finish();
        let boot_number = NonZeroU32::new(drawn() as u32 & LARGEST_BOOT_NUMBER).unwrap_or(NonZeroU32::MIN);
        let uid = NonZeroU16::new(drawn() as u16).unwrap_or(NonZeroU16::MIN);
        Self {
            boot_number,
            uid,
            network_bytes_s: NETWORK_BUDGET_BYTES_S,
            serial_bytes_s: RADIO_BUDGET_BYTES_S,
        }
    }

    pub(super) fn capacity_bytes_s(self, link: &LinkAddress) -> u32 {
        let of_line = |bytes_s| self.serial_bytes_s.min((SHARE * f64::from(bytes_s)) as u32);
        link.capacity_bytes_s().map_or(self.network_bytes_s, of_line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_boot_draws_another_number() {
        let mut numbers: Vec<_> = (0..50).map(|_| OnTheWire::drawn().boot_number).collect();
        numbers.sort_unstable();
        numbers.dedup();
        assert!(numbers.len() > 45, "{} different of 50", numbers.len());
    }

    #[test]
    fn a_network_link_may_carry_more_and_a_serial_line_has_the_radio_s_budget() {
        let wire = OnTheWire { network_bytes_s: 20_000, ..OnTheWire::drawn() };
        let cable = OnTheWire { serial_bytes_s: 20_000, ..OnTheWire::drawn() };
        let line: LinkAddress = "serial:/dev/ttyUSB0:57600".parse().unwrap();
        assert_eq!(cable.capacity_bytes_s(&line), 4_608, "four fifths of what the line carries");
        let slow: LinkAddress = "serial:/dev/ttyUSB0:9600".parse().unwrap();
        for wire in [wire, cable] {
            assert_eq!(wire.capacity_bytes_s(&slow), 768, "whatever a radio would carry");
        }
        let capacity = |link: &str| wire.capacity_bytes_s(&link.parse().unwrap());
        assert_eq!(capacity("udpout:127.0.0.1:14550"), 20_000);
        assert_eq!(capacity("tcpin:127.0.0.1:5760"), 20_000);
        assert_eq!(capacity("serial:/dev/ttyUSB0:57600"), 2_000);
    }
}
