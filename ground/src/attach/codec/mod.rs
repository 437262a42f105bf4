//! Encodes messages to bytes and back: length, kind, time, payload; numbers are little-endian.
//!
//! ```text
//! u32 length of what follows | u8 kind | u64 nanoseconds since the station's start | payload
//! ```

mod bytes;
mod checklist;
mod report;

use std::time::Duration;

use protocol::book::{Head, SignedHead};
use protocol::frame::FramerCounters;

use super::message::{Hello, OPERATOR_MAX, StationStatus, ToScreen, ToStation, VERSION};
use crate::model::LogHealth;
use crate::model::action::Request;
use crate::model::alarm::AlarmKind;
use crate::model::command::CommandKind;
use crate::model::seat::Seat;
use crate::model::station_log::LogSpace;
use crate::place_file;
use crate::update::Msg;
pub use bytes::CodecError;
use bytes::{PREFIX_LEN, Reader, Writer};

/// The longest accepted message, bytes.
const LENGTH_MAX: usize = 64 * 1024;
/// The longest name of a key, in characters.
const KEY_MAX: usize = 8;
/// Bytes of kind and time.
const HEAD_LEN: usize = 9;

/// Encodes a message to a screen. `None` for messages that stay in the station (its own keys, its own end) and for
/// messages that are too long.
pub fn encode_to_screen(told: &ToScreen, now: Duration) -> Option<Vec<u8>> {
    let mut out = Writer::new(now);
    match told {
        ToScreen::Hello(hello) => {
            out.kind(0).u32(hello.version).u32(hello.screen).u8(u8::from(hello.auto));
            out.u8(u8::from(hello.demonstration)).u32(hello.link_capacity_bytes_s);
            out.u8(hello.system_ids[0]).u8(hello.system_ids[1]).u32(hello.session);
            out.text(&hello.link_name).text(&hello.log_path).text(&hello.tlog_path);
            out.u8(hello.key_number).text(&hello.key_owner);
            out.u8(u8::from(hello.mission.is_some()));
            out.u64(u64::from_le_bytes(hello.mission.unwrap_or_default()));
        }
        ToScreen::Live => drop(out.kind(1)),
        ToScreen::Msg(msg) => encode_msg(msg, &mut out)?,
        ToScreen::Status(status) => {
            out.kind(30).u32(status.pid).u8(u8::from(status.demonstration)).u8(u8::from(status.at_risk));
            out.text(&status.link).text(&status.vehicle).text(&status.phase);
            out.text(&status.log).text(&status.screens);
        }
        ToScreen::Stopping { stops, words } => drop(out.kind(31).u8(u8::from(*stops)).text(words)),
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
        Msg::Log(health) => {
            out.kind(8).u64(health.dropped).u8(u8::from(health.failed)).u8(u8::from(health.space.is_some()));
            let LogSpace { free_bytes, grows_bytes_s } = health.space.unwrap_or_default();
            out.u64(free_bytes).u32(grows_bytes_s);
        }
        Msg::Requested { kind, by } => {
            out.kind(9).u8(number_of(*kind)).u32(by.screen).text(&by.operator);
        }
        Msg::WithoutLog(by) => drop(out.kind(27).u32(by.screen).text(&by.operator)),
        Msg::RangeTest(by) => drop(out.kind(25).u32(by.screen).text(&by.operator)),
        Msg::SimulatorEnded(why) => {
            out.kind(10).u8(u8::from(why.is_some())).text(why.as_deref().unwrap_or_default());
        }
        Msg::AlarmAcknowledged(kind) => drop(out.kind(11).u8(alarm_number(*kind))),
        Msg::ParametersWanted => drop(out.kind(12)),
        Msg::SignRefused(why) => drop(out.kind(26).text(why)),
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
        Msg::Report(written) => {
            let (Ok(text) | Err(text)) = written;
            out.kind(23).u8(u8::from(written.is_ok())).text(text);
        }
        Msg::Download(told) => {
            let (Ok(text) | Err(text)) = told;
            out.kind(24).u8(u8::from(told.is_ok())).text(text);
        }
        Msg::Place(place) => drop(out.kind(22).text(&place_file::geojson(place))),
        Msg::Book { head: SignedHead { head, signature }, is_signed } => {
            out.kind(21).u64(head.book).u32(head.entries).raw(&head.hash).raw(signature);
            out.u8(u8::from(*is_signed));
        }
        Msg::Checklist(list) => {
            out.kind(20);
            checklist::encode(list, out);
        }
        // The station's own keys and end, and messages that only a replay or an attached screen uses.
        Msg::Key(_)
        | Msg::Keys(_)
        | Msg::Pasted
        | Msg::SignAsked { .. }
        | Msg::ReportWanted
        | Msg::DownloadWanted
        | Msg::Terminate(_)
        | Msg::Commanded(_)
        | Msg::ScreenTick => return None,
    }
    Some(())
}

/// Decodes a message to a screen, and its time.
///
/// # Errors
/// The bytes are not what a station sends.
pub fn decode_to_screen(bytes: &[u8]) -> Result<(ToScreen, Duration), CodecError> {
    let (kind, now, mut rest) = open(bytes)?;
    let told = match kind {
        0 => ToScreen::Hello(hello(&mut rest)?),
        1 => ToScreen::Live,
        2 => ToScreen::Msg(Msg::Tick),
        3 => ToScreen::Msg(Msg::Frame(rest.frame()?)),
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
            ToScreen::Msg(Msg::Received { bytes, framing })
        }
        5 => ToScreen::Msg(Msg::Sent { bytes: rest.size()?, drops: rest.u64()? }),
        6 => ToScreen::Msg(Msg::LinkUp(rest.text()?)),
        7 => ToScreen::Msg(Msg::LinkDown(rest.text()?)),
        8 => {
            let (dropped, failed, is_known) = (rest.u64()?, rest.u8()? != 0, rest.u8()? != 0);
            let space = LogSpace { free_bytes: rest.u64()?, grows_bytes_s: rest.u32()? };
            ToScreen::Msg(Msg::Log(LogHealth { dropped, failed, space: is_known.then_some(space) }))
        }
        9 => {
            let kind = kind_of(rest.u8()?)?;
            ToScreen::Msg(Msg::Requested { kind, by: seat(&mut rest)? })
        }
        10 => {
            let failed = rest.u8()? != 0;
            let why = rest.text()?;
            ToScreen::Msg(Msg::SimulatorEnded(failed.then_some(why)))
        }
        11 => ToScreen::Msg(Msg::AlarmAcknowledged(alarm_of(rest.u8()?)?)),
        12 => ToScreen::Msg(Msg::ParametersWanted),
        13 => ToScreen::Msg(Msg::ScreenGone),
        14 => ToScreen::Msg(Msg::HeardOver(rest.size()?)),
        15 => ToScreen::Msg(Msg::OneLinkDown(rest.text()?)),
        16 => {
            let (links, signing) = report::decode(&mut rest)?;
            ToScreen::Msg(Msg::Links { links, signing })
        }
        17 => {
            // No memory is reserved by the count: a wrong count ends with the bytes.
            let seats = (0..rest.u32()?).map(|_| seat(&mut rest)).collect::<Result<_, _>>()?;
            ToScreen::Msg(Msg::Crew(seats))
        }
        18 => ToScreen::Msg(Msg::ScreenQuit),
        19 => ToScreen::Msg(Msg::LinkSays(rest.text()?)),
        23 => {
            let (is_written, text) = (rest.u8()? != 0, rest.text()?);
            ToScreen::Msg(Msg::Report(if is_written { Ok(text) } else { Err(text) }))
        }
        24 => {
            let (goes_on, text) = (rest.u8()? != 0, rest.text()?);
            ToScreen::Msg(Msg::Download(if goes_on { Ok(text) } else { Err(text) }))
        }
        26 => ToScreen::Msg(Msg::SignRefused(rest.text()?)),
        25 => ToScreen::Msg(Msg::RangeTest(seat(&mut rest)?)),
        27 => ToScreen::Msg(Msg::WithoutLog(seat(&mut rest)?)),
        22 => {
            let place = place_file::read(&rest.text()?).ok_or(CodecError("no place"))?;
            ToScreen::Msg(Msg::Place(Box::new(place)))
        }
        21 => {
            let head = Head { book: rest.u64()?, entries: rest.u32()?, hash: rest.take()? };
            let head = SignedHead { head, signature: rest.take()? };
            ToScreen::Msg(Msg::Book { head, is_signed: rest.u8()? != 0 })
        }
        20 => ToScreen::Msg(Msg::Checklist(Box::new(checklist::decode(&mut rest)?))),
        30 => ToScreen::Status(StationStatus {
            pid: rest.u32()?,
            demonstration: rest.u8()? != 0,
            at_risk: rest.u8()? != 0,
            link: rest.text()?,
            vehicle: rest.text()?,
            phase: rest.text()?,
            log: rest.text()?,
            screens: rest.text()?,
        }),
        31 => ToScreen::Stopping { stops: rest.u8()? != 0, words: rest.text()? },
        _ => return Err(CodecError("an unknown kind of message")),
    };
    rest.end()?;
    Ok((told, now))
}

fn seat(rest: &mut Reader) -> Result<Seat, CodecError> {
    Ok(Seat { screen: rest.u32()?, operator: rest.text()? })
}

/// Decodes the greeting. If the station has another version, only the version is decoded.
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
        session: rest.u32()?,
        link_name: rest.text()?,
        log_path: rest.text()?,
        tlog_path: rest.text()?,
        key_number: rest.u8()?,
        key_owner: rest.text()?,
        mission: {
            let known = rest.u8()? != 0;
            let hash = rest.u64()?.to_le_bytes();
            known.then_some(hash)
        },
    })
}

/// Encodes a message to a station.
pub fn encode_to_station(asked: &ToStation) -> Vec<u8> {
    let mut out = Writer::new(Duration::ZERO);
    match asked {
        ToStation::Hello { watch, operator } => out.kind(0).u32(VERSION).u8(u8::from(*watch)).text(operator),
        ToStation::Request(Request::Command(kind)) => out.kind(1).u8(number_of(*kind)),
        ToStation::Request(Request::Acknowledge(kind)) => out.kind(2).u8(alarm_number(*kind)),
        ToStation::Request(Request::Parameters) => out.kind(3),
        ToStation::Request(Request::Sign { step, void }) => out.kind(7).u8(*step).u8(u8::from(*void)),
        ToStation::Request(Request::Report) => out.kind(8),
        ToStation::Request(Request::Download) => out.kind(9),
        ToStation::Request(Request::RangeTest) => out.kind(10),
        ToStation::Request(Request::WithoutLog) => out.kind(11),
        ToStation::Key(name) => out.kind(4).text(name),
        ToStation::Status => out.kind(5),
        ToStation::Stop { force, operator } => out.kind(6).u8(u8::from(*force)).text(operator),
    };
    out.finish()
}

/// Decodes a message to a station.
///
/// # Errors
/// The bytes are not what a screen sends.
pub fn decode_to_station(bytes: &[u8]) -> Result<ToStation, CodecError> {
    let (kind, _, mut rest) = open(bytes)?;
    let asked = match kind {
        0 => {
            if rest.u32()? != VERSION {
                return Err(CodecError("the screen is of another version"));
            }
            ToStation::Hello { watch: rest.u8()? != 0, operator: words(&mut rest, OPERATOR_MAX)? }
        }
        1 => ToStation::Request(Request::Command(kind_of(rest.u8()?)?)),
        2 => ToStation::Request(Request::Acknowledge(alarm_of(rest.u8()?)?)),
        3 => ToStation::Request(Request::Parameters),
        4 => ToStation::Key(words(&mut rest, KEY_MAX)?),
        5 => ToStation::Status,
        6 => ToStation::Stop { force: rest.u8()? != 0, operator: words(&mut rest, OPERATOR_MAX)? },
        8 => ToStation::Request(Request::Report),
        9 => ToStation::Request(Request::Download),
        10 => ToStation::Request(Request::RangeTest),
        11 => ToStation::Request(Request::WithoutLog),
        7 => ToStation::Request(Request::Sign { step: rest.u8()?, void: rest.u8()? != 0 }),
        _ => return Err(CodecError("an unknown kind of request")),
    };
    rest.end()?;
    Ok(asked)
}

/// A text from another process, made printable and shortened to this many characters.
fn words(rest: &mut Reader, characters: usize) -> Result<String, CodecError> {
    Ok(protocol::text::printable(rest.text()?.as_bytes()).chars().take(characters).collect())
}

/// The length of a message, from its four bytes.
///
/// # Errors
/// No valid message has this length.
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
        CommandKind::ConfirmArm => 5,
        CommandKind::ConfirmStart => 6,
        CommandKind::Hold => 7,
        CommandKind::Tap => 8,
        CommandKind::TakeCommand => 9,
        CommandKind::Check => 10,
        CommandKind::CheckStill => 11,
        CommandKind::EndCheck => 12,
    }
}

fn kind_of(number: u8) -> Result<CommandKind, CodecError> {
    CommandKind::ALL
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
