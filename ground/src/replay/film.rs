//! The frames of a log, with their times: from MCAP, or from a `.tlog`.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

use protocol::dialect::{MavCmd, MavMessage, TdPhase};
use protocol::frame::{Frame, Framer};
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{TOPIC_RAW_RX, TOPIC_RAW_TX};
use protocol::log::tlog::frame_length;

use crate::model::command::CommandKind;
use crate::model::telemetry::phase_from_number;

/// Frames held at most: some forty hours of a 57,600-baud radio.
const FRAMES_MAX: usize = 8_000_000;

/// Why a log could not be played.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// The file cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// There is nothing to show.
    #[error("{}: holds no frames of a vehicle; a log that `ground` or `onboard-sim` wrote has them", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// There is too much to show.
    #[error("{}: holds more than {FRAMES_MAX} frames; cut it into parts", path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
    },
}

/// What happened at one time.
#[derive(Debug, Clone, PartialEq)]
pub enum Scene {
    /// A frame arrived from the vehicle.
    Heard(Frame),
    /// The crew asked for something.
    Commanded(CommandKind),
    /// The ground sent something else, of so many bytes.
    Sent(usize),
}

/// A whole flight.
#[derive(Debug, Clone, Default)]
pub struct Film {
    /// In the order of their times, which count from the first.
    pub scenes: Vec<(Duration, Scene)>,
    /// When each phase began.
    pub phases: Vec<(TdPhase, Duration)>,
    /// Why reading ended early, if it did.
    pub damage: Option<String>,
    /// Whose flight it is: of several vehicles the one that was asked for, else the first that was heard.
    pub vehicle: Option<Address>,
}

/// Who is who in a log; each is the first that was heard in its part, unless it is known before.
#[derive(Debug, Clone, Copy, Default)]
struct Sides {
    vehicle: Option<Address>,
    ground: Option<Address>,
}

impl Sides {
    fn hear(&mut self, source: Address) {
        if source.component_id == VEHICLE.component_id {
            self.vehicle.get_or_insert(source);
        } else if source.component_id == GROUND.component_id {
            self.ground.get_or_insert(source);
        }
    }
}

impl Film {
    /// Reads the flight of this vehicle (`None`: the first that was heard) from a log; a `.tlog` by its name, everything
    /// else as MCAP.
    ///
    /// # Errors
    /// The file cannot be read, holds nothing to show, or too much.
    pub fn load(path: &Path, vehicle: Option<Address>) -> Result<Self, FilmError> {
        let read = |source| FilmError::Read { path: path.to_owned(), source };
        let file = BufReader::new(File::open(path).map_err(read)?);
        let is_tlog = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("tlog"));
        let film = if is_tlog { from_tlog(file, vehicle) } else { from_mcap(file, vehicle) }.map_err(read)?;
        if film.scenes.is_empty() {
            return Err(FilmError::Empty { path: path.to_owned() });
        }
        if film.scenes.len() > FRAMES_MAX {
            return Err(FilmError::TooLong { path: path.to_owned() });
        }
        Ok(film)
    }

    /// The time of the last scene.
    pub fn length(&self) -> Duration {
        self.scenes.last().map_or(Duration::ZERO, |(at, _)| *at)
    }

    /// When a phase began first.
    pub fn begin_of(&self, phase: TdPhase) -> Option<Duration> {
        self.phases.iter().find(|(known, _)| *known == phase).map(|(_, at)| *at)
    }

    fn of(mut stamped: Vec<(u64, Scene)>, damage: Option<String>, sides: Sides) -> Self {
        // Stable: what has the same time keeps its order in the file.
        stamped.sort_by_key(|(at_ns, _)| *at_ns);
        let first_ns = stamped.first().map_or(0, |(at_ns, _)| *at_ns);
        let mut phases: Vec<(TdPhase, Duration)> = Vec::new();
        let mut scenes = Vec::with_capacity(stamped.len());
        for (at_ns, scene) in stamped {
            let at = Duration::from_nanos(at_ns - first_ns);
            if let Scene::Heard(frame) = &scene
                && let Some(phase) = phase_of(frame)
                && phases.last().is_none_or(|(last, _)| *last != phase)
            {
                phases.push((phase, at));
            }
            scenes.push((at, scene));
        }
        Self { scenes, phases, damage, vehicle: sides.vehicle }
    }
}

fn from_mcap(file: impl Read, vehicle: Option<Address>) -> std::io::Result<Film> {
    let mut sides = Sides { vehicle, ground: None };
    let mut reader = LogReader::new(file);
    // What the ground heard; else what the vehicle said.
    let (mut heard, mut said) = (Vec::new(), Vec::new());
    while let Some(item) = reader.next_item()? {
        let LogItem::Message { channel_id, log_time_ns, data, .. } = item else { continue };
        let Some(channel) = reader.channel(channel_id) else { continue };
        let endpoint = channel.metadata.get("endpoint").map(String::as_str);
        match (channel.topic.as_str(), endpoint) {
            (TOPIC_RAW_RX, Some("ground")) => {
                heard.extend(
                    frames(&data).into_iter().filter_map(|frame| scene(log_time_ns, frame, &mut sides)),
                );
            }
            (TOPIC_RAW_TX, Some("ground")) => {
                heard.extend(
                    frames(&data).into_iter().filter_map(|frame| scene(log_time_ns, frame, &mut sides)),
                );
            }
            (TOPIC_RAW_TX | TOPIC_RAW_RX, Some("vehicle")) => {
                said.extend(
                    frames(&data).into_iter().filter_map(|frame| scene(log_time_ns, frame, &mut sides)),
                );
            }
            _ => {}
        }
        if heard.len().max(said.len()) > FRAMES_MAX {
            break;
        }
    }
    let of_vehicle = |(_, scene): &(u64, Scene)| matches!(scene, Scene::Heard(_));
    let scenes = if heard.iter().any(of_vehicle) { heard } else { said };
    let scenes = if scenes.iter().any(of_vehicle) { scenes } else { Vec::new() };
    Ok(Film::of(scenes, reader.damage().map(ToString::to_string), sides))
}

/// Microseconds since the Unix epoch, big-endian, then a frame; again and again.
fn from_tlog(mut file: impl Read, vehicle: Option<Address>) -> std::io::Result<Film> {
    let mut sides = Sides { vehicle, ground: None };
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    let mut scenes = Vec::new();
    let mut rest = bytes.as_slice();
    let mut damage = None;
    while !rest.is_empty() {
        let whole = rest.split_first_chunk::<8>().and_then(|(stamp, behind)| {
            let (len, frame) = tlog_frame(behind)?;
            Some((u64::from_be_bytes(*stamp), len, frame))
        });
        let Some((stamp_us, len, frame)) = whole else {
            damage = Some(format!("unreadable {} bytes before the end", rest.len()));
            break;
        };
        scenes.extend(frame.and_then(|frame| scene(stamp_us.saturating_mul(1_000), frame, &mut sides)));
        rest = &rest[8 + len..];
    }
    Ok(Film::of(scenes, damage, sides))
}

/// The length of the frame that the bytes begin with, and the frame if its checksum holds.
fn tlog_frame(bytes: &[u8]) -> Option<(usize, Option<Frame>)> {
    // Of MAVLink 1 nothing is shown.
    let len = frame_length(bytes)?;
    let bytes = bytes.get(..len)?;
    Some((len, frames(bytes).pop()))
}

fn frames(bytes: &[u8]) -> Vec<Frame> {
    let mut framer = Framer::new();
    framer.push_datagram(bytes);
    std::iter::from_fn(|| framer.next_frame()).collect()
}

/// What a frame shows: the vehicle's own; the crew's command, for the first time it was sent; or that the ground sent
/// something.
fn scene(at_ns: u64, frame: Frame, sides: &mut Sides) -> Option<(u64, Scene)> {
    sides.hear(frame.source());
    if Some(frame.source()) == sides.vehicle {
        return Some((at_ns, Scene::Heard(frame)));
    }
    if Some(frame.source()) != sides.ground {
        return None;
    }
    let sent = Some((at_ns, Scene::Sent(frame.as_bytes().len())));
    let Ok(MavMessage::COMMAND_LONG(command)) = frame.decode() else { return sent };
    let kind = match command.command {
        _ if command.confirmation > 0 => return sent,
        MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if command.param1 > 0.5 => CommandKind::Arm,
        MavCmd::MAV_CMD_COMPONENT_ARM_DISARM => CommandKind::Disarm,
        MavCmd::MAV_CMD_MISSION_START => CommandKind::Start,
        MavCmd::MAV_CMD_DO_FLIGHTTERMINATION => CommandKind::Abort,
        _ => return sent,
    };
    Some((at_ns, Scene::Commanded(kind)))
}

fn phase_of(frame: &Frame) -> Option<TdPhase> {
    match frame.decode().ok()? {
        MavMessage::HEARTBEAT(data) => phase_from_number(data.custom_mode),
        MavMessage::TD_FLIGHT_STATUS(data) => Some(data.phase),
        _ => None,
    }
}
