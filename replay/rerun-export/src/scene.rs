//! The flight in space: rocket, nozzle, thrust, paths, pad.

use flight::rules::phase::Phase;
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use rerun::archetypes::{Arrows3D, LineStrips3D, Points3D, Transform3D, ViewCoordinates};
use rerun::components::Radius;
use rerun::datatypes::{Quaternion, Rgba32};
use rerun::{RecordingStream, RecordingStreamResult};

use crate::entity;
use crate::flown::FlownPath;
use crate::plots::Whose;
use crate::pose::Pose;
use crate::shape::RocketShape;
use crate::survey::Survey;

const PAD: Rgba32 = Rgba32::from_rgb(150, 158, 168);
const LIMIT: Rgba32 = Rgba32::from_rgb(220, 70, 70);
const MARKER: Rgba32 = Rgba32::from_rgb(255, 255, 255);
const FLAME: Rgba32 = Rgba32::from_rgb(255, 110, 30);
const FLOWN: Rgba32 = Rgba32::from_rgb(84, 102, 122);
const TRAIL: Rgba32 = Rgba32::from_rgb(110, 190, 255);
const PREDICTED: Rgba32 = Rgba32::from_rgb(255, 205, 70);
const FIRST_PLAN: Rgba32 = Rgba32::from_rgb(120, 95, 40);
const FLOWN_BESIDE: Rgba32 = Rgba32::from_rgb(122, 84, 102);
const TRAIL_BESIDE: Rgba32 = Rgba32::from_rgb(255, 120, 190);

/// Pose and thrust of the rocket.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    pub(crate) rocket: Pose,
    /// The nozzle in the rocket.
    pub(crate) nozzle: Pose,
    /// Thrust over weight, if known.
    pub(crate) thrust_in_weights: Option<f64>,
}

/// The size of the space, for the layout.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "each name ends in its unit")]
pub(crate) struct Extent {
    /// Highest point of the path, m.
    pub(crate) top_m: f32,
    /// Widest x of the path and the pad on either side, m.
    pub(crate) x_m: (f32, f32),
    /// Height of the ground in the viewer's space, m.
    pub(crate) ground_z_m: f32,
    /// Length of the rocket, m.
    pub(crate) rocket_m: f32,
}

impl Extent {
    /// Where a flight is expected before it is flown: between the height of its start and the pad.
    pub(crate) fn expected(survey: &Survey) -> Self {
        let shape = shape_of(survey);
        let top_m =
            survey.mission.as_ref().map_or(4.0 * shape.length_m(), |mission| mission.start.height_m as f32);
        Self { top_m, x_m: (0.0, 0.0), ground_z_m: ground_z_m(survey, &shape), rocket_m: shape.length_m() }
    }

    /// The space around this one and another.
    pub(crate) fn around(&self, other: &Self) -> Self {
        Self {
            top_m: self.top_m.max(other.top_m),
            x_m: (self.x_m.0.min(other.x_m.0), self.x_m.1.max(other.x_m.1)),
            ground_z_m: self.ground_z_m.min(other.ground_z_m),
            rocket_m: self.rocket_m,
        }
    }
}

/// The altitude of telemetry is 0 when the vehicle stands; a vehicle's own heights are above the pad.
fn ground_z_m(survey: &Survey, shape: &RocketShape) -> f32 {
    if survey.of_vehicle { 0.0 } else { -shape.standing_height_m() }
}

fn shape_of(survey: &Survey) -> RocketShape {
    survey.mission.as_ref().map_or_else(RocketShape::unknown, |mission| {
        RocketShape::of_airframe(&mission.airframe, mission.motor_curve.propellant_mass_kg())
    })
}

/// The space being recorded.
pub(crate) struct Scene<'a> {
    recording: &'a RecordingStream,
    whose: Whose,
    shape: RocketShape,
    ground_z_m: f32,
    gravity_m_s2: f64,
    flown: FlownPath,
    planned_under_thrust: bool,
}

impl<'a> Scene<'a> {
    /// Records the objects that never move.
    pub(crate) fn new(
        recording: &'a RecordingStream,
        survey: &Survey,
        whose: Whose,
    ) -> RecordingStreamResult<Self> {
        let shape = shape_of(survey);
        recording.log_static(entity::WORLD, &ViewCoordinates::RIGHT_HAND_Z_UP())?;
        recording.log_static(entity::BODY, &shape.body())?;
        recording.log_static(entity::LEGS, &shape.legs())?;
        recording.log_static(entity::BELL, &shape.bell())?;
        let marker = Points3D::new([[0.0; 3]]).with_colors([MARKER]);
        recording.log_static(entity::MARKER, &marker.with_radii([Radius::new_ui_points(5.0)]))?;
        let ground_z_m = ground_z_m(survey, &shape);
        let pad_m = shape.length_m();
        let cross = [[[-pad_m, 0.0], [pad_m, 0.0]], [[0.0, -pad_m], [0.0, pad_m]]]
            .map(|ends| ends.map(|[x, y]| [x, y, ground_z_m]).to_vec());
        let rings = [pad_m, pad_m / 2.0].map(|radius_m| circle(radius_m, ground_z_m));
        let strips: Vec<Vec<[f32; 3]>> = rings.into_iter().chain(cross).collect();
        recording.log_static(
            entity::PAD,
            &LineStrips3D::new(strips).with_colors([PAD]).with_radii([Radius::new_ui_points(1.0)]),
        )?;
        if let Some(mission) = &survey.mission {
            let limit = circle(mission.touchdown_limits.x_m as f32, ground_z_m);
            let limit = LineStrips3D::new([limit]).with_colors([LIMIT]);
            recording.log_static(entity::PAD_LIMIT, &limit.with_radii([Radius::new_ui_points(1.0)]))?;
        }
        let gravity_m_s2 =
            survey.mission.as_ref().map_or(STANDARD_GRAVITY_M_S2, |mission| mission.gravity_m_s2);
        Ok(Self {
            recording,
            whose,
            shape,
            ground_z_m,
            gravity_m_s2,
            flown: FlownPath::new(),
            planned_under_thrust: false,
        })
    }

    /// Thrust over weight.
    pub(crate) fn in_weights(&self, thrust_n: f64, mass_kg: f64) -> f64 {
        thrust_n / (mass_kg * self.gravity_m_s2)
    }

    /// Where the nozzle turns, m ahead of the centre of gravity.
    pub(crate) fn pivot_x_m(&self) -> f64 {
        f64::from(self.shape.pivot_x_m)
    }

    /// Records where the rocket is now.
    pub(crate) fn rocket(&mut self, seen: &Seen) -> RecordingStreamResult<()> {
        self.recording.log(entity::ROCKET, &transform(&seen.rocket))?;
        self.recording.log(entity::FOLLOWED, &Transform3D::from_translation(seen.rocket.translation_m))?;
        self.recording.log(entity::NOZZLE, &transform(&seen.nozzle))?;
        if let Some(weights) = seen.thrust_in_weights {
            self.recording.log(entity::THRUST, &self.thrust_arrow(weights))?;
        }
        let here_m = seen.rocket.translation_m;
        if let Some(from_m) = self.flown.push(here_m) {
            let color = if self.whose == Whose::Own { TRAIL } else { TRAIL_BESIDE };
            let piece = LineStrips3D::new([vec![from_m, here_m]]).with_colors([color]);
            self.recording.log(entity::TRAIL, &piece.with_radii([Radius::new_ui_points(2.0)]))?;
        }
        Ok(())
    }

    /// Records a path planned in a phase; one without points clears the previous path.
    pub(crate) fn path(&mut self, points_m: Vec<[f32; 3]>, phase: u32) -> RecordingStreamResult<()> {
        let in_burn =
            u8::try_from(phase).ok().and_then(Phase::from_index).is_some_and(Phase::in_landing_burn);
        if in_burn && !points_m.is_empty() && !self.planned_under_thrust {
            self.planned_under_thrust = true;
            let first = LineStrips3D::new([points_m.clone()]).with_colors([FIRST_PLAN]);
            self.recording.log_static(entity::FIRST_PLAN, &first.with_radii([Radius::new_ui_points(1.0)]))?;
        }
        let end = Points3D::new(points_m.last().copied())
            .with_colors([PREDICTED])
            .with_radii([Radius::new_ui_points(4.0)]);
        self.recording.log(entity::PREDICTED_TOUCHDOWN, &end)?;
        self.recording.log(entity::PREDICTED, &strip(points_m))
    }

    /// Records the whole path, and returns its extent.
    pub(crate) fn finish(self) -> RecordingStreamResult<Extent> {
        let points_m = self.flown.into_points_m();
        let all_x_m = || points_m.iter().map(|[x, _, _]| *x).chain([0.0]);
        let extent = Extent {
            top_m: points_m.iter().map(|[_, _, z]| *z).fold(0.0, f32::max),
            x_m: (all_x_m().fold(0.0, f32::min), all_x_m().fold(0.0, f32::max)),
            ground_z_m: self.ground_z_m,
            rocket_m: self.shape.length_m(),
        };
        if points_m.len() > 1 {
            let color = if self.whose == Whose::Own { FLOWN } else { FLOWN_BESIDE };
            let path = LineStrips3D::new([points_m]).with_colors([color]);
            self.recording.log_static(entity::FLOWN, &path.with_radii([Radius::new_ui_points(1.0)]))?;
        }
        Ok(extent)
    }

    /// An arrow that ends at the nozzle and begins at the end of the flame.
    fn thrust_arrow(&self, weights: f64) -> Arrows3D {
        let length_m = weights as f32 * self.shape.length_m();
        let visible = length_m.is_finite() && length_m > 0.0;
        let length_m = visible.then_some(length_m);
        Arrows3D::from_vectors(length_m.map(|length_m| [length_m, 0.0, 0.0]))
            .with_origins(length_m.map(|length_m| [-length_m - self.shape.bell_m(), 0.0, 0.0]))
            .with_colors([FLAME])
            .with_radii([0.35 * self.shape.radius_m])
    }
}

/// A planned path, or nothing if it has no points.
fn strip(points_m: Vec<[f32; 3]>) -> LineStrips3D {
    let strips = if points_m.is_empty() { vec![] } else { vec![points_m] };
    LineStrips3D::new(strips).with_colors([PREDICTED]).with_radii([Radius::new_ui_points(1.5)])
}

fn transform(pose: &Pose) -> Transform3D {
    Transform3D::from_translation(pose.translation_m)
        .with_quaternion(Quaternion::from_xyzw(pose.quaternion_xyzw))
}

/// A closed circle on the ground.
fn circle(radius_m: f32, z_m: f32) -> Vec<[f32; 3]> {
    const EDGES: u32 = 96;
    (0..=EDGES)
        .map(|edge| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(edge) / f64::from(EDGES));
            [radius_m * cos as f32, radius_m * sin as f32, z_m]
        })
        .collect()
}
