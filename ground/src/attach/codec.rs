//! Encodes messages to bytes and back: length, kind, time, payload; numbers are little-endian.
//!
//! ```text
//! u32 length of what follows | u8 kind | u64 nanoseconds since the station's start | payload
//! ```

use std::time::Duration;

use protocol::book::{Head, SignedHead};
use protocol::dialect::TdRole;
use protocol::frame::{Frame, Framer, FramerCounters};
use protocol::identity::Address;
use protocol::link_stats::{LinkFigures, SourceFigures};
use protocol::signing::SigningCounters;

use super::{Hello, OPERATOR_MAX, StationStatus, ToScreen, ToStation, VERSION};
use crate::model::alarm::AlarmKind;
use crate::model::checklist::{Checklist, Limits, Mark, Signature, Step};
use crate::model::command::CommandKind;
use crate::model::crew::Seat;
use crate::model::link::LinkReport;
use crate::model::log::LogSpace;
use crate::model::quantity::Quantity;
use crate::model::{LogHealth, Request, place};
use crate::update::Msg;

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
            encode_links(links, signing.as_ref(), out);
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
        Msg::Place(place) => drop(out.kind(22).text(&place::geojson(place))),
        Msg::Book { head: SignedHead { head, signature }, is_signed } => {
            out.kind(21).u64(head.book).u32(head.entries).raw(&head.hash).raw(signature);
            out.u8(u8::from(*is_signed));
        }
        Msg::Checklist(list) => {
            out.kind(20);
            encode_checklist(list, out);
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
            let (links, signing) = decode_links(&mut rest)?;
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
            let place = place::read_geojson(&rest.text()?).ok_or(CodecError("no place"))?;
            ToScreen::Msg(Msg::Place(Box::new(place)))
        }
        21 => {
            let head = Head { book: rest.u64()?, entries: rest.u32()?, hash: rest.take()? };
            let head = SignedHead { head, signature: rest.take()? };
            ToScreen::Msg(Msg::Book { head, is_signed: rest.u8()? != 0 })
        }
        20 => ToScreen::Msg(Msg::Checklist(Box::new(decode_checklist(&mut rest)?))),
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

// Writes numbers, texts and frames as bytes, and reads them back.

/// Bytes of the length that stands before every message.
pub(super) const PREFIX_LEN: usize = 4;

/// The bytes are no valid message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unexpected bytes on the socket: {0}")]
pub struct CodecError(pub(super) &'static str);

pub(super) struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    pub(super) fn new(now: Duration) -> Self {
        let mut bytes = vec![0; PREFIX_LEN + 1];
        bytes.extend(u64::try_from(now.as_nanos()).unwrap_or(u64::MAX).to_le_bytes());
        Self { bytes }
    }

    pub(super) fn kind(&mut self, kind: u8) -> &mut Self {
        self.bytes[PREFIX_LEN] = kind;
        self
    }

    pub(super) fn raw(&mut self, bytes: &[u8]) -> &mut Self {
        self.bytes.extend_from_slice(bytes);
        self
    }

    pub(super) fn u8(&mut self, value: u8) -> &mut Self {
        self.raw(&[value])
    }

    pub(super) fn u32(&mut self, value: u32) -> &mut Self {
        self.raw(&value.to_le_bytes())
    }

    pub(super) fn u64(&mut self, value: u64) -> &mut Self {
        self.raw(&value.to_le_bytes())
    }

    pub(super) fn f64(&mut self, value: f64) -> &mut Self {
        self.u64(value.to_bits())
    }

    /// Writes at most 4,000 bytes of the text; no valid text is longer.
    pub(super) fn text(&mut self, text: &str) -> &mut Self {
        let mut end = text.len().min(4_000);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        self.u32(end as u32).raw(&text.as_bytes()[..end])
    }

    pub(super) fn finish(mut self) -> Vec<u8> {
        let length = (self.bytes.len() - PREFIX_LEN) as u32;
        self.bytes[..PREFIX_LEN].copy_from_slice(&length.to_le_bytes());
        self.bytes
    }
}

pub(super) struct Reader<'a>(pub(super) &'a [u8]);

impl Reader<'_> {
    pub(super) fn take<const N: usize>(&mut self) -> Result<[u8; N], CodecError> {
        let (taken, rest) = self.0.split_first_chunk().ok_or(CodecError("too short"))?;
        self.0 = rest;
        Ok(*taken)
    }

    pub(super) fn u8(&mut self) -> Result<u8, CodecError> {
        Ok(self.take::<1>()?[0])
    }

    pub(super) fn u32(&mut self) -> Result<u32, CodecError> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    pub(super) fn u64(&mut self) -> Result<u64, CodecError> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    pub(super) fn f64(&mut self) -> Result<f64, CodecError> {
        Ok(f64::from_bits(self.u64()?))
    }

    pub(super) fn size(&mut self) -> Result<usize, CodecError> {
        usize::try_from(self.u64()?).map_err(|_too_large| CodecError("a size beyond this machine"))
    }

    pub(super) fn text(&mut self) -> Result<String, CodecError> {
        let length = usize::try_from(self.u32()?).unwrap_or(usize::MAX);
        let text = self.0.get(..length).ok_or(CodecError("too short"))?;
        self.0 = &self.0[length..];
        String::from_utf8(text.to_vec()).map_err(|_not_text| CodecError("not text"))
    }

    pub(super) fn frame(&mut self) -> Result<Frame, CodecError> {
        let mut framer = Framer::new();
        framer.push_datagram(std::mem::take(&mut self.0));
        framer.next_frame().ok_or(CodecError("not a frame"))
    }

    /// Ignores the remaining bytes.
    pub(super) fn skip(&mut self) {
        self.0 = &[];
    }

    pub(super) fn end(&self) -> Result<(), CodecError> {
        if self.0.is_empty() { Ok(()) } else { Err(CodecError("too long")) }
    }
}

// Encodes a checklist with its signatures: name, mission, hash, a `u32` count, each step with its limits and its mark.

/// The number for no role.
const NOBODY: u8 = u8::MAX;

pub(super) fn encode_checklist(list: &Checklist, out: &mut Writer) {
    out.text(&list.name).text(list.mission.as_deref().unwrap_or_default()).text(&list.hash);
    out.u32(list.steps.len() as u32);
    for step in &list.steps {
        out.text(&step.words).u8(role_number(step.role));
        let limits = step.value.as_ref();
        out.text(limits.map_or("", |limits| limits.quantity.name));
        out.f64(limits.and_then(|limits| limits.least).unwrap_or(f64::NAN));
        out.f64(limits.and_then(|limits| limits.most).unwrap_or(f64::NAN));
        let (kind, signature) = match &step.mark {
            Mark::Open => (0, None),
            Mark::Signed(signature) => (1, Some(signature)),
            Mark::Voided(signature) => (2, Some(signature)),
        };
        out.u8(kind);
        if let Some(signature) = signature {
            out.text(&signature.by).u8(role_number(signature.role)).u64(signature.unix_s);
            out.f64(signature.found.unwrap_or(f64::NAN));
        }
    }
}

pub(super) fn decode_checklist(rest: &mut Reader) -> Result<Checklist, CodecError> {
    let name = rest.text()?;
    let mission = Some(rest.text()?).filter(|mission| !mission.is_empty());
    let hash = rest.text()?;
    // No memory is reserved by the count: a wrong count ends with the bytes.
    let steps = (0..rest.u32()?).map(|_| step(rest)).collect::<Result<_, _>>()?;
    Ok(Checklist { name, mission, hash, steps })
}

fn step(rest: &mut Reader) -> Result<Step, CodecError> {
    let (words, role, name) = (rest.text()?, role(rest.u8()?)?, rest.text()?);
    let (least, most) = (number_or_none(rest.f64()?), number_or_none(rest.f64()?));
    let value = match Quantity::named(&name) {
        Some(quantity) => Some(Limits { quantity, least, most }),
        None if name.is_empty() => None,
        None => return Err(CodecError("an unknown value")),
    };
    let mark = match rest.u8()? {
        0 => Mark::Open,
        1 => Mark::Signed(signature(rest)?),
        2 => Mark::Voided(signature(rest)?),
        _ => return Err(CodecError("an unknown mark")),
    };
    Ok(Step { words, role, value, mark })
}

fn signature(rest: &mut Reader) -> Result<Signature, CodecError> {
    Ok(Signature {
        by: rest.text()?,
        role: role(rest.u8()?)?,
        unix_s: rest.u64()?,
        found: number_or_none(rest.f64()?),
    })
}

fn number_or_none(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn role_number(role: Option<TdRole>) -> u8 {
    role.map_or(NOBODY, |role| role as u8)
}

fn role(number: u8) -> Result<Option<TdRole>, CodecError> {
    let roles =
        [TdRole::TD_ROLE_OBSERVER, TdRole::TD_ROLE_RANGE_SAFETY, TdRole::TD_ROLE_FLIGHT, TdRole::TD_ROLE_PAD];
    match roles.into_iter().find(|role| *role as u8 == number) {
        None if number != NOBODY => Err(CodecError("an unknown role")),
        role => Ok(role),
    }
}

// Encodes the link reports: a `u32` count, each link with its rates and components, then the signature counts.

pub(super) fn encode_links(links: &[LinkReport], signing: Option<&SigningCounters>, out: &mut Writer) {
    out.u32(links.len() as u32);
    for link in links {
        let LinkReport { name, figures, sources, capacity_bytes_s, copies, trouble } = link;
        let LinkFigures { rx_bytes_s, tx_bytes_s, rx_frames_s, loss } = *figures;
        out.text(name).f64(rx_bytes_s).f64(tx_bytes_s).f64(rx_frames_s).f64(loss);
        out.u32(sources.len() as u32);
        for SourceFigures { source, age, rx_frames_s, loss } in sources {
            out.u8(source.system_id).u8(source.component_id);
            out.u64(u64::try_from(age.as_nanos()).unwrap_or(u64::MAX)).f64(*rx_frames_s).f64(*loss);
        }
        out.u8(u8::from(capacity_bytes_s.is_some())).u32(capacity_bytes_s.unwrap_or_default());
        out.u64(*copies);
        out.u8(u8::from(trouble.is_some())).text(trouble.as_deref().unwrap_or_default());
    }
    out.u8(u8::from(signing.is_some()));
    if let Some(SigningCounters { accepted, unsigned, wrong, replayed, too_old, too_new }) = signing {
        out.u64(*accepted).u64(*unsigned).u64(*wrong).u64(*replayed).u64(*too_old).u64(*too_new);
    }
}

/// Link reports and signature counts.
type Report = (Vec<LinkReport>, Option<SigningCounters>);

pub(super) fn decode_links(rest: &mut Reader) -> Result<Report, CodecError> {
    // No memory is reserved by the count: a wrong count ends with the bytes.
    let links = (0..rest.u32()?).map(|_| link(rest)).collect::<Result<_, _>>()?;
    let signing = match rest.u8()? {
        0 => None,
        _ => Some(SigningCounters {
            accepted: rest.u64()?,
            unsigned: rest.u64()?,
            wrong: rest.u64()?,
            replayed: rest.u64()?,
            too_old: rest.u64()?,
            too_new: rest.u64()?,
        }),
    };
    Ok((links, signing))
}

fn link(rest: &mut Reader) -> Result<LinkReport, CodecError> {
    let name = rest.text()?;
    let figures = LinkFigures {
        rx_bytes_s: rest.f64()?,
        tx_bytes_s: rest.f64()?,
        rx_frames_s: rest.f64()?,
        loss: rest.f64()?,
    };
    let sources = (0..rest.u32()?).map(|_| source(rest)).collect::<Result<_, _>>()?;
    let (bounded, capacity) = (rest.u8()? != 0, rest.u32()?);
    let copies = rest.u64()?;
    let (down, why) = (rest.u8()? != 0, rest.text()?);
    Ok(LinkReport {
        name,
        figures,
        sources,
        capacity_bytes_s: bounded.then_some(capacity),
        copies,
        trouble: down.then_some(why),
    })
}

fn source(rest: &mut Reader) -> Result<SourceFigures, CodecError> {
    Ok(SourceFigures {
        source: Address { system_id: rest.u8()?, component_id: rest.u8()? },
        age: Duration::from_nanos(rest.u64()?),
        rx_frames_s: rest.f64()?,
        loss: rest.f64()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::option;
    use proptest::prelude::*;
    use protocol::dialect::{HEARTBEAT_DATA, MavMessage};
    use protocol::frame::Encoder;
    use protocol::identity::{Address, VEHICLE};
    use protocol::link_stats::{LinkFigures, SourceFigures};
    use protocol::signing::SigningCounters;

    use crate::model::link::LinkReport;

    // Every message decodes to what was encoded, and no bytes cause a panic.

    fn back(told: &ToScreen, now: Duration) -> (ToScreen, Duration) {
        let bytes = encode_to_screen(told, now).unwrap();
        let (prefix, rest) = bytes.split_first_chunk().unwrap();
        assert_eq!(length(*prefix).unwrap(), rest.len());
        decode_to_screen(rest).unwrap()
    }

    #[test]
    fn greeting_end_of_history_status_and_stopping_survive_the_round_trip() {
        let hello = ToScreen::Hello(Hello {
            version: VERSION,
            link_name: "a".to_owned(),
            key_number: 2,
            key_owner: "Bob".to_owned(),
            mission: Some([1, 2, 3, 4, 5, 6, 7, 8]),
            ..Hello::default()
        });
        assert_eq!(back(&hello, Duration::ZERO).0, hello);
        assert_eq!(back(&ToScreen::Live, Duration::ZERO).0, ToScreen::Live);
        let status = StationStatus {
            pid: 7,
            at_risk: true,
            phase: "PAD_ARMED".to_owned(),
            ..StationStatus::default()
        };
        assert_eq!(back(&ToScreen::Status(status.clone()), Duration::ZERO).0, ToScreen::Status(status));
        let stopping = ToScreen::Stopping { stops: false, words: "armed".to_owned() };
        assert_eq!(back(&stopping, Duration::ZERO).0, stopping);
    }

    #[test]
    fn a_report_and_a_download_survive_the_round_trip() {
        for written in [Ok("flight.html".to_owned()), Err("disk full".to_owned())] {
            for told in [Msg::Report(written.clone()), Msg::Download(written)].map(ToScreen::Msg) {
                assert_eq!(back(&told, Duration::ZERO).0, told);
            }
        }
    }

    #[test]
    fn the_end_of_the_book_survives_the_round_trip() {
        let head = SignedHead { head: Head { book: 7, entries: 8, hash: [9; 32] }, signature: [10; 64] };
        let told = ToScreen::Msg(Msg::Book { head, is_signed: true });
        assert_eq!(back(&told, Duration::ZERO).0, told);
    }

    #[test]
    fn a_checklist_survives_the_round_trip() {
        use crate::model::checklist::{ChecklistEntry, Signature};
        let mut list =
            crate::model::checklist::parse_checklist(include_str!("../../checklist-example.toml")).unwrap();
        let signature = Signature { by: "Ann".to_owned(), unix_s: 7, found: Some(1.5), role: None };
        list.apply(&ChecklistEntry::Signed { step: 0, signature: signature.clone() });
        list.apply(&ChecklistEntry::Voided { step: 1, signature });
        let told = ToScreen::Msg(Msg::Checklist(Box::new(list)));
        assert_eq!(back(&told, Duration::ZERO).0, told);
    }

    /// A screen must be able to tell its crew which program to update.
    #[test]
    fn a_greeting_of_another_version_decodes_to_its_version() {
        let hello = Hello { version: VERSION + 1, link_name: "a".to_owned(), ..Hello::default() };
        let ToScreen::Hello(known) = back(&ToScreen::Hello(hello), Duration::ZERO).0 else {
            panic!("a greeting")
        };
        assert_eq!(known, Hello { version: VERSION + 1, ..Hello::default() });
    }

    #[test]
    fn a_stations_own_keys_are_not_sent() {
        assert_eq!(encode_to_screen(&ToScreen::Msg(Msg::Key(crate::key::Key::Enter)), Duration::ZERO), None);
    }

    /// A screen disconnects on a message that is too long, so none is sent.
    #[test]
    fn a_message_that_is_too_long_is_not_sent() {
        let long = LinkReport {
            name: "x".repeat(4_000),
            figures: LinkFigures::default(),
            sources: Vec::new(),
            capacity_bytes_s: None,
            copies: 0,
            trouble: None,
        };
        let links = |count| ToScreen::Msg(Msg::Links { links: vec![long.clone(); count], signing: None });
        assert_eq!(back(&links(16), Duration::ZERO).0, links(16));
        assert_eq!(encode_to_screen(&links(17), Duration::ZERO), None);
    }

    #[test]
    fn messages_to_a_station_survive_the_round_trip() {
        let asked = [
            ToStation::Hello { watch: true, operator: "anna on pts/3".to_owned() },
            ToStation::Status,
            ToStation::Stop { force: true, operator: "anna".to_owned() },
            ToStation::Request(Request::Command(CommandKind::Arm)),
            ToStation::Request(Request::Acknowledge(AlarmKind::Held)),
            ToStation::Request(Request::Acknowledge(AlarmKind::Refused(CommandKind::Abort))),
            ToStation::Request(Request::Parameters),
            ToStation::Request(Request::Report),
            ToStation::Request(Request::Download),
            ToStation::Request(Request::RangeTest),
            ToStation::Request(Request::WithoutLog),
            ToStation::Request(Request::Sign { step: 7, void: true }),
            ToStation::Key("Ctrl-X".to_owned()),
        ];
        for asked in asked {
            assert_eq!(decode_to_station(&encode_to_station(&asked)[4..]), Ok(asked));
        }
    }

    fn counters() -> impl Strategy<Value = FramerCounters> {
        any::<[u64; 6]>().prop_map(
            |[frames, crc_errors, unknown_ids, cut_short, unknown_flags, garbage_bytes]| FramerCounters {
                frames,
                crc_errors,
                unknown_ids,
                cut_short,
                unknown_flags,
                garbage_bytes,
            },
        )
    }

    fn signing() -> impl Strategy<Value = SigningCounters> {
        any::<[u64; 6]>().prop_map(|[accepted, unsigned, wrong, replayed, too_old, too_new]| {
            SigningCounters { accepted, unsigned, wrong, replayed, too_old, too_new }
        })
    }

    fn source() -> impl Strategy<Value = SourceFigures> {
        let figures = (any::<[u8; 2]>(), any::<u64>(), -1e9..1e9, -1e9..1e9);
        figures.prop_map(|([system_id, component_id], age_ns, rx_frames_s, loss)| SourceFigures {
            source: Address { system_id, component_id },
            age: Duration::from_nanos(age_ns),
            rx_frames_s,
            loss,
        })
    }

    fn link() -> impl Strategy<Value = LinkReport> {
        let figures =
            prop::array::uniform4(-1e9..1e9).prop_map(|[rx_bytes_s, tx_bytes_s, rx_frames_s, loss]| {
                LinkFigures { rx_bytes_s, tx_bytes_s, rx_frames_s, loss }
            });
        let rest = (vec(source(), 0..4), option::of(any::<u32>()), any::<u64>(), option::of(any::<String>()));
        (any::<String>(), figures, rest).prop_map(|(name, figures, rest)| {
            let (sources, capacity_bytes_s, copies, trouble) = rest;
            LinkReport { name, figures, sources, capacity_bytes_s, copies, trouble }
        })
    }

    fn seat() -> impl Strategy<Value = Seat> {
        (any::<u32>(), any::<String>()).prop_map(|(screen, operator)| Seat { screen, operator })
    }

    /// Every message that a station forwards to its screens.
    fn msg() -> impl Strategy<Value = Msg> {
        let heartbeat = any::<u32>().prop_map(|custom_mode| {
            let data = HEARTBEAT_DATA { custom_mode, ..HEARTBEAT_DATA::default() };
            Msg::Frame(Encoder::new(VEHICLE).encode(&MavMessage::HEARTBEAT(data)))
        });
        let kind = prop::sample::select(CommandKind::ALL.to_vec());
        prop_oneof![
            prop::sample::select(vec![
                Msg::Tick,
                Msg::AlarmAcknowledged(AlarmKind::LinkLost),
                Msg::ParametersWanted,
                Msg::SignRefused("step 2 is not signed: FLIGHT signs it".to_owned()),
                Msg::ScreenGone
            ]),
            heartbeat,
            (any::<usize>(), counters()).prop_map(|(bytes, framing)| Msg::Received { bytes, framing }),
            (any::<usize>(), any::<u64>()).prop_map(|(bytes, drops)| Msg::Sent { bytes, drops }),
            any::<String>().prop_map(Msg::LinkUp),
            any::<String>().prop_map(Msg::LinkDown),
            any::<String>().prop_map(Msg::OneLinkDown),
            any::<String>().prop_map(Msg::LinkSays),
            any::<usize>().prop_map(Msg::HeardOver),
            (vec(link(), 0..4), option::of(signing()))
                .prop_map(|(links, signing)| Msg::Links { links, signing }),
            (any::<u64>(), any::<bool>(), any::<Option<(u64, u32)>>()).prop_map(
                |(dropped, failed, space)| {
                    let space =
                        space.map(|(free_bytes, grows_bytes_s)| LogSpace { free_bytes, grows_bytes_s });
                    Msg::Log(LogHealth { dropped, failed, space })
                }
            ),
            (kind, seat()).prop_map(|(kind, by)| Msg::Requested { kind, by }),
            vec(seat(), 0..4).prop_map(Msg::Crew),
            seat().prop_map(Msg::RangeTest),
            seat().prop_map(Msg::WithoutLog),
            Just(Msg::ScreenQuit),
            option::of(any::<String>()).prop_map(Msg::SimulatorEnded),
        ]
    }

    proptest! {
        #[test]
        fn messages_to_a_screen_survive_the_round_trip(msg in msg(), now_ns in any::<u64>()) {
            let (told, now) = (ToScreen::Msg(msg), Duration::from_nanos(now_ns));
            prop_assert_eq!(back(&told, now), (told, now));
        }

        #[test]
        fn arbitrary_bytes_do_not_panic(bytes in vec(any::<u8>(), 0..80), kind in 0_u8..33) {
            let _ = decode_to_screen(&bytes);
            let _ = decode_to_station(&bytes);
            let mut aimed = vec![kind, 0, 0, 0, 0, 0, 0, 0, 0];
            aimed.extend(&bytes);
            let _ = decode_to_screen(&aimed);
            let _ = decode_to_station(&aimed);
        }

        /// A valid message with one changed byte.
        #[test]
        fn a_changed_byte_does_not_panic(msg in msg(), place in any::<prop::sample::Index>(), byte in any::<u8>()) {
            let mut bytes = encode_to_screen(&ToScreen::Msg(msg), Duration::ZERO).unwrap();
            let place = 4 + place.index(bytes.len() - 4);
            bytes[place] = byte;
            let _ = decode_to_screen(&bytes[4..]);
        }
    }
}
