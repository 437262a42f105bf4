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
use crate::update::Msg;
use bytes::{Reader, Writer};

/// Changes when the bytes do; a screen of another version is told so.
pub const VERSION: u32 = 3;
/// Nothing longer is believed.
const LENGTH_MAX: usize = 64 * 1024;
/// The length itself.
const PREFIX_LEN: usize = 4;
/// Kind and time.
const HEAD_LEN: usize = 9;

/// What the station is, told first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Hello {
    /// [`VERSION`] of the station.
    pub version: u32,
    /// Arms and starts without a hand.
    pub auto: bool,
    /// Bytes per second; 0 where nothing is known to bound it.
    pub link_capacity_bytes_s: u32,
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
}

/// What a screen asks of its station.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Asked {
    /// The first; `watch` asks for nothing else.
    Hello {
        /// Read-only.
        watch: bool,
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
            out.kind(0).u32(hello.version).u8(u8::from(hello.auto)).u32(hello.link_capacity_bytes_s);
            out.text(&hello.link_name).text(&hello.log_path).text(&hello.tlog_path);
        }
        Told::Live => drop(out.kind(1)),
        Told::Msg(msg) => encode_msg(msg, &mut out)?,
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
        Msg::Requested(kind) => drop(out.kind(9).u8(number_of(*kind))),
        Msg::SimulatorEnded(why) => {
            out.kind(10).u8(u8::from(why.is_some())).text(why.as_deref().unwrap_or_default());
        }
        Msg::Acknowledged(kind) => drop(out.kind(11).u8(alarm_number(*kind))),
        Msg::ParametersWanted => drop(out.kind(12)),
        Msg::ScreenGone => drop(out.kind(13)),
        Msg::HeardOver(number) => drop(out.kind(14).u64(*number as u64)),
        Msg::OneLinkDown(why) => drop(out.kind(15).text(why)),
        Msg::Links { links, signing } => {
            out.kind(16);
            report::encode(links, signing.as_ref(), out);
        }
        // The station's own keys and end; what only a replay or an attached screen tells itself.
        Msg::Key(_) | Msg::Terminate(_) | Msg::Commanded(_) | Msg::ScreenTick => return None,
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
        0 => Told::Hello(Hello {
            version: rest.u32()?,
            auto: rest.u8()? != 0,
            link_capacity_bytes_s: rest.u32()?,
            link_name: rest.text()?,
            log_path: rest.text()?,
            tlog_path: rest.text()?,
        }),
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
        9 => Told::Msg(Msg::Requested(kind_of(rest.u8()?)?)),
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
        _ => return Err(CodecError("an unknown kind of message")),
    };
    rest.end()?;
    Ok((told, now))
}

/// The bytes of what is asked.
pub fn encode_asked(asked: &Asked) -> Vec<u8> {
    let mut out = Writer::new(Duration::ZERO);
    match asked {
        Asked::Hello { watch } => out.kind(0).u32(VERSION).u8(u8::from(*watch)),
        Asked::Command(kind) => out.kind(1).u8(number_of(*kind)),
        Asked::Acknowledge(kind) => out.kind(2).u8(alarm_number(*kind)),
        Asked::Parameters => out.kind(3),
        Asked::Key(name) => out.kind(4).text(name),
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
            Asked::Hello { watch: rest.u8()? != 0 }
        }
        1 => Asked::Command(kind_of(rest.u8()?)?),
        2 => Asked::Acknowledge(alarm_of(rest.u8()?)?),
        3 => Asked::Parameters,
        4 => Asked::Key(protocol::text::printable(rest.text()?.as_bytes()).chars().take(8).collect()),
        _ => return Err(CodecError("an unknown kind of request")),
    };
    rest.end()?;
    Ok(asked)
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
