//! Writes the recording of a log: what Rerun imports from it, and what it is drawn with.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use flight::rules::verdict::TABLE_2;
use flight::vehicle::mission::Mission;
use re_lenses::{CastTo, Lens, LensBuilderError, LensError, Lenses, OutputMode, Selector, default_runtime};
use re_mcap::{DecoderRegistry, McapFile, TopicFilter};
use replay::log::{Entry, FlightLog, LogError};
use replay::output::{NewFile, WriteError};
use rerun::archetypes::{LineStrips3D, Points3D, Transform3D};
use rerun::components::Radius;
use rerun::datatypes::Rgba32;
use rerun::external::re_log_encoding::EncodeError;
use rerun::log::Chunk;
use rerun::time::TimeType;
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamError, TimeColumn};

use crate::layout::layout;
use crate::shape::RocketShape;

/// The timeline of both flights: time since the start of each log.
pub const FLIGHT_TIME: &str = "flight_time";
/// The entities of the second flight lie below this one.
pub const BESIDE: &str = "/beside";

/// Recordings of one application share a layout in the viewer.
const APPLICATION: &str = "touchdown";
/// The timeline of the import.
const LOG_TIME: &str = "message_log_time";

const PAD: Rgba32 = Rgba32::from_rgb(150, 158, 168);
const LIMIT: Rgba32 = Rgba32::from_rgb(220, 70, 70);
const MARKER: Rgba32 = Rgba32::from_rgb(255, 255, 255);
const FLOWN: Rgba32 = Rgba32::from_rgb(110, 190, 255);
const FLOWN_BESIDE: Rgba32 = Rgba32::from_rgb(255, 120, 190);

/// Why a log could not be exported. Damage inside a log is not a reason.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A log cannot be used.
    #[error(transparent)]
    Log(#[from] LogError),
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Rerun's import of MCAP cannot be set up.
    #[error("Rerun cannot import the log")]
    Import(#[from] LensBuilderError),
    /// Rerun refuses a record.
    #[error("Rerun refused a record")]
    Record(#[from] RecordingStreamError),
    /// Rerun cannot encode the recording.
    #[error("the recording cannot be encoded")]
    Encode(#[from] EncodeError),
}

/// What was exported of a log.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Exported {
    /// Records that carry the pose of the rocket.
    pub poses: usize,
    pub events: usize,
    /// What ended the reading early.
    pub damage: Option<String>,
    /// Why this build cannot use the log's mission, if so.
    pub mission_problem: Option<String>,
}

/// Writes the recording of a log, and of another one beside it. The file appears when it is
/// complete; returns its name, and what was exported of each.
///
/// # Errors
/// A log cannot be used, or the recording cannot be written.
pub fn export(log: &Path, beside: Option<&Path>, to: &Path) -> Result<(PathBuf, Vec<Exported>), ExportError> {
    let mut file = NewFile::create(to)?;
    let own = Survey::of(log)?;
    let stem = log.file_stem().unwrap_or_default().to_string_lossy();
    let (recording, messages) = RecordingStreamBuilder::new(APPLICATION)
        .enabled(true)
        .recording_id(format!("{}-{stem}", own.start_ns))
        .recording_name(stem)
        .memory()?;
    recording.set_log_tick_enabled(false);
    recording.set_log_time_enabled(false);
    own.draw(&recording, "", FLOWN)?;
    let mut exported = vec![own.import(&recording, log, "")?];
    let mut topics = own.topics;
    if let Some(beside) = beside {
        let other = Survey::of(beside)?;
        other.draw(&recording, BESIDE, FLOWN_BESIDE)?;
        exported.push(other.import(&recording, beside, BESIDE)?);
        topics.extend(other.topics);
    }
    layout(&topics).send(&recording, rerun::blueprint::BlueprintActivation::default())?;
    file.write_all(&messages.drain_as_bytes()?).map_err(WriteError::at(to))?;
    Ok((file.commit()?, exported))
}

/// What is read of a log before its import.
#[derive(Default)]
struct Survey {
    start_ns: i64,
    mission: Option<Mission>,
    path_m: Vec<[f32; 3]>,
    topics: Vec<String>,
    exported: Exported,
}

impl Survey {
    fn of(path: &Path) -> Result<Self, LogError> {
        let mut log = FlightLog::open(path)?;
        let mut found = Self::default();
        let mut first_ns = None;
        while let Some(stamped) = log.next_entry()? {
            first_ns.get_or_insert(stamped.log_time_ns);
            match stamped.entry {
                Entry::World(truth) => {
                    let at = &truth.state.position_m;
                    let at_m = [at.x, at.y, at.z].map(|value| value as f32);
                    found.exported.poses += 1;
                    // On the pad it stays where it is.
                    if found.path_m.last() != Some(&at_m) {
                        found.path_m.push(at_m);
                    }
                }
                Entry::Event(_) => found.exported.events += 1,
                _ => {}
            }
        }
        let head = log.head();
        let start_ns = head.run.get("start_unix_ns").and_then(|text| text.parse().ok()).or(first_ns);
        found.start_ns = start_ns.and_then(|start_ns| i64::try_from(start_ns).ok()).unwrap_or(0);
        found.topics = log.channels().map(|(_, channel)| channel.topic.clone()).collect();
        found.exported.damage = log.damage().map(ToString::to_string);
        if let Some(Ok(text)) = &head.profile_toml {
            match flight::vehicles::mission::from_toml(text, "profile.toml") {
                Ok(mission) => found.mission = Some(mission),
                Err(error) => found.exported.mission_problem = Some(error.to_string()),
            }
        }
        Ok(found)
    }

    /// Records what never moves: the shape of the rocket in its own axes, the pad, and the path
    /// that was flown.
    fn draw(
        &self,
        recording: &RecordingStream,
        below: &str,
        flown: Rgba32,
    ) -> Result<(), RecordingStreamError> {
        let shape = self.mission.as_ref().map_or_else(RocketShape::unknown, |mission| {
            RocketShape::of_airframe(&mission.airframe, mission.motor_curve.propellant_mass_kg())
        });
        let at = |entity: &str| format!("{below}/world/{entity}");
        recording.log_static(at("rocket/body"), &shape.body())?;
        recording.log_static(at("rocket/nose"), &shape.nose())?;
        recording.log_static(at("rocket/legs"), &shape.legs())?;
        recording.log_static(at("rocket/bell"), &shape.bell())?;
        // In a view of the whole flight the rocket is small.
        let marker = Points3D::new([[0.0; 3]]).with_colors([MARKER]);
        recording.log_static(at("rocket/marker"), &marker.with_radii([Radius::new_ui_points(5.0)]))?;
        let lines = |strips: Vec<Vec<[f32; 3]>>, color| {
            LineStrips3D::new(strips).with_colors([color]).with_radii([Radius::new_ui_points(1.0)])
        };
        let length_m = shape.length_m();
        let mut pad: Vec<_> = [length_m, length_m / 2.0].map(circle).to_vec();
        pad.push(vec![[-length_m, 0.0, 0.0], [length_m, 0.0, 0.0]]);
        pad.push(vec![[0.0, -length_m, 0.0], [0.0, length_m, 0.0]]);
        recording.log_static(at("pad"), &lines(pad, PAD))?;
        if self.mission.is_some() {
            let limit = circle(TABLE_2.distance_m as f32);
            recording.log_static(at("pad/limit"), &lines(vec![limit], LIMIT))?;
        }
        recording.log_static(at("flown"), &lines(vec![self.path_m.clone()], flown))
    }

    /// Records everything that Rerun reads from a log, on the clock of the flight.
    fn import(&self, recording: &RecordingStream, path: &Path, below: &str) -> Result<Exported, ExportError> {
        let lenses = lenses()?;
        let emit = |chunk: Chunk| {
            for made in lenses.apply(&chunk, &default_runtime()) {
                let made = made.map_or_else(LensError::partial_chunk, Some);
                recording.send_chunks(made.map(|chunk| self.moved(&chunk, below)));
            }
        };
        let bytes = std::fs::read(path)
            .map_err(|source| LogError::Read { name: path.display().to_string(), source })?;
        let log = McapFile::new(bytes, true);
        let mut exported = self.exported.clone();
        let imported = log.summary().map_err(Into::into).and_then(|summary| {
            let plan = DecoderRegistry::all_without_raw_fallback();
            let plan = plan.plan(log.bytes(), &summary, &TopicFilter::default())?;
            plan.run(log.bytes(), &summary, TimeType::TimestampNs, &emit)
        });
        if let Err(error) = imported {
            exported.damage.get_or_insert(format!("{error:#}"));
        }
        Ok(exported)
    }

    /// A chunk of this log with the time since its start, below an entity.
    fn moved(&self, chunk: &Chunk, below: &str) -> Chunk {
        let mut moved = chunk.clone_with_new_entity_path(format!("{below}{}", chunk.entity_path()).into());
        let log_time = chunk.timelines().get(&LOG_TIME.into());
        let since_start = log_time.map(|times| {
            let since_ns = times.times_raw().iter().map(|time_ns| time_ns.saturating_sub(self.start_ns));
            TimeColumn::new_duration_nanos(FLIGHT_TIME, since_ns)
        });
        if let Some(times) = since_start
            && moved.add_timeline(times).is_err()
        {
            // It has as many rows as the column it was made from.
            return chunk.clone();
        }
        moved
    }
}

/// What the import makes of well-known messages: the events as text, and `/tf` as the pose of the
/// entity that is drawn.
fn lenses() -> Result<Lenses, LensBuilderError> {
    let transform = |entity: &str| Lens::scatter("foxglove.FrameTransform:message").output_entity(entity);
    let position = || Selector::parse(".translation | pack(.x!, .y!, .z!)");
    let attitude = Selector::parse(".rotation | pack(.x!, .y!, .z!, .w!)")?;
    let rocket = transform("world/rocket")
        .to_component_with_cast(Transform3D::descriptor_translation(), position()?, CastTo::Auto)
        .to_component_with_cast(Transform3D::descriptor_quaternion(), attitude, CastTo::Auto)
        .build()?;
    // A camera here follows the rocket but does not turn with it.
    let followed = transform("world/followed")
        .to_component_with_cast(Transform3D::descriptor_translation(), position()?, CastTo::Auto)
        .build()?;
    let events = re_lenses::semantic::foxglove::log(TimeType::TimestampNs)?;
    Ok(Lenses::new(OutputMode::ForwardAll).add_lens(rocket).add_lens(followed).add_lens(events))
}

/// A circle around the pad.
fn circle(radius_m: f32) -> Vec<[f32; 3]> {
    const EDGES: u8 = 64;
    let at = |edge: u8| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(edge) / f64::from(EDGES));
        [radius_m * cos as f32, radius_m * sin as f32, 0.0]
    };
    (0..=EDGES).map(at).collect()
}
