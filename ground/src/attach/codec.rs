//! Messages to bytes and back: a length, a kind, a time, a payload; numbers little-endian.
//!
//! ```text
//! u32 length of what follows | u8 kind | u64 nanoseconds since the station's start | payload
//! ```

mod bytes;
mod report;

use std::time::Duration;

use protocol::frame::FramerCounters;

use crate::model::LogHealth;
use crate::model::alarm::AlarmKind;
use crate::model::command::CommandKind;
use crate::model::seat::Seat;
use crate::update::Msg;
use bytes::{Reader, Writer};

/// Changes when the bytes do; a screen of another version is told so.
pub const VERSION: u32 = 3;
/// Nothing longer is believed.
const LENGTH_MAX: usize = 64 * 1024;
/// The length itself.
const PREFIX_LEN: usize = 4;
/// Characters of a key's name, and of an operator's.
const KEY_MAX: usize = 8;
pub(crate) const OPERATOR_MAX: usize = 40;
/// Kind and time.
const HEAD_LEN: usize = 9;

/// What the station is, told first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Hello {
    /// [`VERSION`] of the station.
    pub version: u32,
    /// The number that the station gives to this screen.
    pub screen: u32,
    /// Arms and starts without a hand.
    pub auto: bool,
    /// Its vehicle is simulated in its own process.
    pub demonstration: bool,
    /// Bytes per second; 0 where nothing is known to bound it.
    pub link_capacity_bytes_s: u32,
    /// System ids of the station and of its vehicle.
    pub system_ids: [u8; 2],
    /// The link's name.
    pub link_name: String,
    /// The log's path; empty without one.
    pub log_path: String,
    /// The telemetry log's path; empty without one.
    pub tlog_path: String,
}

/// What a station tells its screens.
#[derive(Debug, Clone, PartialEq)]
pub enum Told {
    /// The first.
    Hello(Hello),
    /// Everything before was history.
    Live,
    /// Taken into the model.
    Msg(Msg),
    /// How the station does.
    Status(Status),
    /// Whether it ends, as it was asked to; in words.
    Stopping {
        /// It does.
        stops: bool,
        /// Why, or what it leaves.
        words: String,
    },
}

/// How a station does, for whoever looks for it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Status {
    /// Its process.
    pub pid: u32,
    /// Its links.
    pub link: String,
    /// Its vehicle is simulated in its own process.
    pub demonstration: bool,
    /// Its vehicle, in words.
    pub vehicle: String,
    /// The vehicle's phase, in words.
    pub phase: String,
    /// Armed, in flight or being aborted.
    pub at_risk: bool,
    /// The log's path; empty without one.
    pub log: String,
    /// Who looks: each screen, in words.
    pub screens: String,
}

/// What a screen asks of its station.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Asked {
    /// The first; `watch` asks for nothing else.
    Hello {
        /// Read-only.
        watch: bool,
        /// Who sits at the screen.
        operator: String,
    },
    /// The only one: how does the station do?
    Status,
    /// The only one: the station is to end.
    Stop {
        /// Also while the vehicle is armed or in flight.
        force: bool,
        /// Who asks.
        operator: String,
    },
    /// The crew's whole ladder was climbed.
    Command(CommandKind),
    /// This alarm was seen.
    Acknowledge(AlarmKind),
    /// The parameters are wanted.
    Parameters,
    /// A key was pressed: for the log.
    Key(String),
}

/// Bytes that are not what the other side sends.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unexpected bytes on the socket: {0}")]
pub struct CodecError(&'static str);

/// The bytes of what is told; `None` for what stays with the station (its own keys, its own end) and for what is
/// longer than anything that is believed.
pub fn encode_told(told: &Told, now: Duration) -> Option<Vec<u8>> {
    let mut out = Writer::new(now);
    match told {
        Told::Hello(hello) => {
            out.kind(0).u32(hello.version).u32(hello.screen).u8(u8::from(hello.auto));
            out.u8(u8::from(hello.demonstration)).u32(hello.link_capacity_bytes_s);
            out.u8(hello.system_ids[0]).u8(hello.system_ids[1]);
            out.text(&hello.link_name).text(&hello.log_path).text(&hello.tlog_path);
        }
        Told::Live => drop(out.kind(1)),
        Told::Msg(msg) => encode_msg(msg, &mut out)?,
        Told::Status(status) => {
            out.kind(30).u32(status.pid).u8(u8::from(status.demonstration)).u8(u8::from(status.at_risk));
            out.text(&status.link).text(&status.vehicle).text(&status.phase);
            out.text(&status.log).text(&status.screens);
        }
        Told::Stopping { stops, words } => drop(out.kind(31).u8(u8::from(*stops)).text(words)),
    }
    Some(out.finish()).filter(|bytes| bytes.len() - PREFIX_LEN <= LENGTH_MAX)
}

fn encode_msg(msg: &Msg, out: &mut Writer) -> Option<()> {
    match msg {
        Msg::Tick => drop(out.kind(2)),
        Msg::Frame(frame) => drop(out.kind(3).raw(frame.as_bytes())),
        Msg::Received { bytes, framing } => {
            out.kind(4).u64(*bytes as u64);
            for count in counters(framing) {
                out.u64(count);
            }
        }
        Msg::Sent { bytes, drops } => drop(out.kind(5).u64(*bytes as u64).u64(*drops)),
        Msg::LinkUp(peer) => drop(out.kind(6).text(peer)),
        Msg::LinkDown(why) => drop(out.kind(7).text(why)),
        Msg::Log(health) => drop(out.kind(8).u64(health.dropped).u8(u8::from(health.failed))),
        Msg::Requested { kind, by } => {
            out.kind(9).u8(number_of(*kind)).u32(by.screen).text(&by.operator);
        }
        Msg::SimulatorEnded(why) => {
            out.kind(10).u8(u8::from(why.is_some())).text(why.as_deref().unwrap_or_default());
        }
        Msg::Acknowledged(kind) => drop(out.kind(11).u8(alarm_number(*kind))),
        Msg::ParametersWanted => drop(out.kind(12)),
        Msg::ScreenGone => drop(out.kind(13)),
        Msg::HeardOver(number) => drop(out.kind(14).u64(*number as u64)),
        Msg::OneLinkDown(why) => drop(out.kind(15).text(why)),
        Msg::LinkSays(words) => drop(out.kind(19).text(words)),
        Msg::Links { links, signing } => {
            out.kind(16);
            report::encode(links, signing.as_ref(), out);
        }
        Msg::Crew(seats) => {
            out.kind(17).u32(seats.len() as u32);
            for seat in seats {
                out.u32(seat.screen).text(&seat.operator);
            }
        }
        Msg::ScreenQuit => drop(out.kind(18)),
        // The station's own keys and end; what only a replay or an attached screen tells itself.
        Msg::Key(_)
        | Msg::Keys(_)
        | Msg::Pasted
        | Msg::Terminate(_)
        | Msg::Commanded(_)
        | Msg::ScreenTick => return None,
    }
    Some(())
}

/// What was told, and when.
///
/// # Errors
/// The bytes are not what a station sends.
pub fn decode_told(bytes: &[u8]) -> Result<(Told, Duration), CodecError> {
    let (kind, now, mut rest) = open(bytes)?;
    let told = match kind {
        0 => Told::Hello(hello(&mut rest)?),
        1 => Told::Live,
        2 => Told::Msg(Msg::Tick),
        3 => Told::Msg(Msg::Frame(rest.frame()?)),
        4 => {
            let bytes = rest.size()?;
            let framing = FramerCounters {
                frames: rest.u64()?,
                crc_errors: rest.u64()?,
                unknown_ids: rest.u64()?,
                cut_short: rest.u64()?,
                unknown_flags: rest.u64()?,
                garbage_bytes: rest.u64()?,
            };
            Told::Msg(Msg::Received { bytes, framing })
        }
        5 => Told::Msg(Msg::Sent { bytes: rest.size()?, drops: rest.u64()? }),
        6 => Told::Msg(Msg::LinkUp(rest.text()?)),
        7 => Told::Msg(Msg::LinkDown(rest.text()?)),
        8 => Told::Msg(Msg::Log(LogHealth { dropped: rest.u64()?, failed: rest.u8()? != 0 })),
        9 => {
            let kind = kind_of(rest.u8()?)?;
            Told::Msg(Msg::Requested { kind, by: seat(&mut rest)? })
        }
        10 => {
            let failed = rest.u8()? != 0;
            let why = rest.text()?;
            Told::Msg(Msg::SimulatorEnded(failed.then_some(why)))
        }
        11 => Told::Msg(Msg::Acknowledged(alarm_of(rest.u8()?)?)),
        12 => Told::Msg(Msg::ParametersWanted),
        13 => Told::Msg(Msg::ScreenGone),
        14 => Told::Msg(Msg::HeardOver(rest.size()?)),
        15 => Told::Msg(Msg::OneLinkDown(rest.text()?)),
        16 => {
            let (links, signing) = report::decode(&mut rest)?;
            Told::Msg(Msg::Links { links, signing })
        }
        17 => {
            // Not reserved for: a count that lies ends where the bytes end.
            let seats = (0..rest.u32()?).map(|_| seat(&mut rest)).collect::<Result<_, _>>()?;
            Told::Msg(Msg::Crew(seats))
        }
        18 => Told::Msg(Msg::ScreenQuit),
        19 => Told::Msg(Msg::LinkSays(rest.text()?)),
        30 => Told::Status(Status {
            pid: rest.u32()?,
            demonstration: rest.u8()? != 0,
            at_risk: rest.u8()? != 0,
            link: rest.text()?,
            vehicle: rest.text()?,
            phase: rest.text()?,
            log: rest.text()?,
            screens: rest.text()?,
        }),
        31 => Told::Stopping { stops: rest.u8()? != 0, words: rest.text()? },
        _ => return Err(CodecError("an unknown kind of message")),
    };
    rest.end()?;
    Ok((told, now))
}

fn seat(rest: &mut Reader) -> Result<Seat, CodecError> {
    Ok(Seat { screen: rest.u32()?, operator: rest.text()? })
}

/// What the station is; of one of another version, nothing but its version.
fn hello(rest: &mut Reader) -> Result<Hello, CodecError> {
    let version = rest.u32()?;
    if version != VERSION {
        rest.skip();
        return Ok(Hello { version, ..Hello::default() });
    }
    Ok(Hello {
        version,
        screen: rest.u32()?,
        auto: rest.u8()? != 0,
        demonstration: rest.u8()? != 0,
        link_capacity_bytes_s: rest.u32()?,
        system_ids: [rest.u8()?, rest.u8()?],
        link_name: rest.text()?,
        log_path: rest.text()?,
        tlog_path: rest.text()?,
    })
}

/// The bytes of what is asked.
pub fn encode_asked(asked: &Asked) -> Vec<u8> {
    let mut out = Writer::new(Duration::ZERO);
    match asked {
        Asked::Hello { watch, operator } => out.kind(0).u32(VERSION).u8(u8::from(*watch)).text(operator),
        Asked::Command(kind) => out.kind(1).u8(number_of(*kind)),
        Asked::Acknowledge(kind) => out.kind(2).u8(alarm_number(*kind)),
        Asked::Parameters => out.kind(3),
        Asked::Key(name) => out.kind(4).text(name),
        Asked::Status => out.kind(5),
        Asked::Stop { force, operator } => out.kind(6).u8(u8::from(*force)).text(operator),
    };
    out.finish()
}

/// What was asked.
///
/// # Errors
/// The bytes are not what a screen sends.
pub fn decode_asked(bytes: &[u8]) -> Result<Asked, CodecError> {
    let (kind, _, mut rest) = open(bytes)?;
    let asked = match kind {
        0 => {
            if rest.u32()? != VERSION {
                return Err(CodecError("the screen is of another version"));
            }
            Asked::Hello { watch: rest.u8()? != 0, operator: words(&mut rest, OPERATOR_MAX)? }
        }
        1 => Asked::Command(kind_of(rest.u8()?)?),
        2 => Asked::Acknowledge(alarm_of(rest.u8()?)?),
        3 => Asked::Parameters,
        4 => Asked::Key(words(&mut rest, KEY_MAX)?),
        5 => Asked::Status,
        6 => Asked::Stop { force: rest.u8()? != 0, operator: words(&mut rest, OPERATOR_MAX)? },
        _ => return Err(CodecError("an unknown kind of request")),
    };
    rest.end()?;
    Ok(asked)
}

/// What another process says, for a terminal: printable, and no longer than this.
fn words(rest: &mut Reader, characters: usize) -> Result<String, CodecError> {
    Ok(protocol::text::printable(rest.text()?.as_bytes()).chars().take(characters).collect())
}

/// The length of what follows, from its four bytes.
///
/// # Errors
/// Longer or shorter than anything that is sent.
pub fn length(prefix: [u8; 4]) -> Result<usize, CodecError> {
    let length = usize::try_from(u32::from_le_bytes(prefix)).unwrap_or(usize::MAX);
    if (HEAD_LEN..=LENGTH_MAX).contains(&length) { Ok(length) } else { Err(CodecError("a wrong length")) }
}

fn counters(framing: &FramerCounters) -> [u64; 6] {
    [
        framing.frames,
        framing.crc_errors,
        framing.unknown_ids,
        framing.cut_short,
        framing.unknown_flags,
        framing.garbage_bytes,
    ]
}

fn number_of(kind: CommandKind) -> u8 {
    match kind {
        CommandKind::Arm => 1,
        CommandKind::Disarm => 2,
        CommandKind::Start => 3,
        CommandKind::Abort => 4,
    }
}

fn kind_of(number: u8) -> Result<CommandKind, CodecError> {
    [CommandKind::Arm, CommandKind::Disarm, CommandKind::Start, CommandKind::Abort]
        .into_iter()
        .find(|kind| number_of(*kind) == number)
        .ok_or(CodecError("an unknown command"))
}

fn alarm_number(kind: AlarmKind) -> u8 {
    let place = AlarmKind::all().position(|known| known == kind);
    place.and_then(|place| u8::try_from(place).ok()).unwrap_or(u8::MAX)
}

fn alarm_of(number: u8) -> Result<AlarmKind, CodecError> {
    AlarmKind::all().nth(number.into()).ok_or(CodecError("an unknown alarm"))
}

fn open(bytes: &[u8]) -> Result<(u8, Duration, Reader<'_>), CodecError> {
    let mut rest = Reader(bytes);
    Ok((rest.u8()?, Duration::from_nanos(rest.u64()?), rest))
}

#[cfg(test)]
mod tests;
