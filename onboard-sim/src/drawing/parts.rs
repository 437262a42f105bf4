//! Pieces of a vehicle: those of its mission, and those of a list of parts.

use core::f64::consts::{FRAC_PI_2, PI};

use flight::vehicle::fins::{PITCH, YAW};
use flight::vehicle::mission::Mission;
use serde::Deserialize;

use super::solid::{Section, Solid};

/// Slices of a piece whose section changes along the axis.
const SLICES: u32 = 24;
/// Thickness of a fin, and diameter of a leg that no list describes, m.
const FIN_M: f64 = 0.001;
const LEG_M: f64 = 0.014;

/// Parts of mk3, whose masses are in docs/build-mk3.md.
pub const MK3: &str = include_str!("mk3-parts.csv");

/// A piece of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    pub part: String,
    pub solids: Vec<Solid>,
}

/// A row of a list, mm and degrees.
#[derive(Deserialize)]
struct Row {
    part: String,
    shape: Shape,
    from: f64,
    to: f64,
    y: f64,
    z: f64,
    a: f64,
    b: f64,
    c: f64,
}

/// Shapes of a list, whose header describes `y`, `z`, `a`, `b` and `c`.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Shape {
    Disc,
    Tube,
    Box,
    Strut,
}

/// Why a list of parts cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PartsError {
    #[error("{0}; part, shape (disc, tube, box or strut), from, to, y, z, a, b, c are accepted")]
    Read(#[from] csv::Error),
    #[error("{0}: its sizes leave no volume; to above from, and a diameter or widths above 0 are accepted")]
    Empty(String),
}

/// Pieces of a list: CSV with comments behind `#`, as [`MK3`].
///
/// # Errors
/// The text is no such list, or a part of it has no volume.
pub fn read(text: &str) -> Result<Vec<Piece>, PartsError> {
    let mut rows = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let rows = rows.deserialize();
    rows.map(|row: Result<Row, csv::Error>| {
        let Row { part, shape, from, to, y, z, a, b, c } = row?;
        let thinnest = match shape {
            Shape::Disc => a,
            Shape::Tube => a - b.max(0.0),
            Shape::Box => a.min(b),
            Shape::Strut => c,
        };
        // So a value that is no number is refused, too.
        if !(to > from && thinnest > 0.0 && [from, to, y, z, a, b, c].iter().all(|value| value.is_finite())) {
            return Err(PartsError::Empty(part));
        }
        let [from_m, to_m, y, z, a, b, wide_m] = [from, to, y, z, a, b, c].map(|mm| mm / 1e3);
        let slices = if matches!(shape, Shape::Strut) { SLICES } else { 1 };
        let solids = sliced([from_m, to_m], slices, |low_m, high_m| match shape {
            Shape::Disc => Section::disc([y, z], a / 2.0),
            Shape::Tube => Section::Ring { outside_m: a / 2.0, inside_m: b.max(0.0) / 2.0 },
            Shape::Box => {
                let [half_y, half_z] = [a / 2.0, b / 2.0];
                Section::rectangle([y - half_y, y + half_y], [z - half_z, z + half_z], c.to_radians())
            }
            Shape::Strut => {
                let share = (f64::midpoint(low_m, high_m) - from_m) / (to_m - from_m);
                Section::disc([y + share * (a - y), z + share * (b - z)], wide_m / 2.0)
            }
        });
        Ok(Piece { part, solids })
    })
    .collect()
}

/// Slices between two stations, each with the section between its two ends.
fn sliced([from_m, to_m]: [f64; 2], slices: u32, section: impl Fn(f64, f64) -> Section) -> Vec<Solid> {
    let at = |slice: u32| from_m + (to_m - from_m) * f64::from(slice) / f64::from(slices);
    let solid =
        |slice| Solid { from_m: at(slice), to_m: at(slice + 1), section: section(at(slice), at(slice + 1)) };
    (0..slices).map(solid).collect()
}

/// Pieces that the mission describes: body, motor with the volume through which its gimbal swings
/// it, fins with that through which they open, and the booster; without a list of parts the legs.
pub(super) fn of_mission(mission: &Mission, listed: bool) -> Vec<Piece> {
    let (airframe, mut pieces) = (&mission.airframe, Vec::new());
    let mut add = |part: String, solids| pieces.push(Piece { part, solids });
    let radius_m = airframe.body.diameter_m / 2.0;
    let skin =
        |_, _| Section::Ring { outside_m: radius_m, inside_m: airframe.gimbal.inside_diameter_m / 2.0 };
    add("Body tube".to_owned(), sliced([0.0, airframe.body.length_m], 1, skin));
    if let Some(launch) = &mission.launch {
        add("Booster".to_owned(), sliced([-launch.booster.length_m, 0.0], 1, skin));
    }

    let (pivot_m, motor_m) = (airframe.gimbal.pivot_station_m, mission.motor_curve.diameter_m() / 2.0);
    let above_m = mission.motor_curve.length_m() - pivot_m;
    let (sin, cos) = libm::sincos(airframe.gimbal.limit_rad());
    let end_m = |arm_m: f64| arm_m.max(arm_m * cos + motor_m * sin);
    let swung = sliced([pivot_m - end_m(pivot_m), pivot_m + end_m(above_m)], SLICES, |low_m, high_m| {
        let away_m = (low_m - pivot_m).abs().max((high_m - pivot_m).abs());
        let rim_m = pivot_m.max(above_m) * sin + motor_m * cos;
        Section::disc([0.0; 2], (motor_m / cos + away_m * sin / cos).min(rim_m))
    });
    add("Landing motor, swung".to_owned(), swung);

    let fins = &airframe.fins;
    let closed_m = [fins.station_m - fins.length_m, fins.station_m];
    let outside_m = radius_m + FIN_M;
    add(
        "Fins, closed".to_owned(),
        sliced(closed_m, 1, |_, _| Section::Ring { outside_m, inside_m: radius_m }),
    );
    let open_rad = (fins.from_y_deg - fins.hinge_off_deg).to_radians();
    // A fin is a part of the skin: its edges are these chords beside its hinge.
    let (half_rad, off_rad) = (fins.width_m / airframe.body.diameter_m, fins.hinge_off_deg.to_radians());
    let [near_m, far_m] =
        [-off_rad, off_rad].map(|off| radius_m * libm::sin((half_rad + off).min(FRAC_PI_2)));
    for fin in 0..4 {
        let quadrant = -YAW[fin] * PITCH[fin];
        let across_m = if quadrant > 0.0 { [-near_m, far_m] } else { [-far_m, near_m] };
        let angle_rad = quadrant * open_rad + if YAW[fin] > 0.0 { PI } else { 0.0 };
        let opening = sliced(closed_m, SLICES, |_, high_m| {
            let reach_m = (fins.length_m.powi(2) - (fins.station_m - high_m).powi(2)).max(0.0).sqrt();
            Section::rectangle([outside_m, outside_m + reach_m.max(FIN_M)], across_m, angle_rad)
        });
        add(format!("Fin {}, opening", fin + 1), opening);
    }
    let (legs, skin_m) = (&airframe.legs, radius_m + LEG_M);
    let top_m = (legs.foot_station_m + legs.foot_radius_m - skin_m).min(closed_m[0]);
    for (leg, [y, z]) in flight::vehicle::airframe::LEGS_AT.into_iter().enumerate().filter(|_| !listed) {
        let solids = sliced([legs.foot_station_m, top_m], SLICES, |low_m, high_m| {
            let share = (f64::midpoint(low_m, high_m) - legs.foot_station_m) / (top_m - legs.foot_station_m);
            let at_m = legs.foot_radius_m + share * (skin_m - legs.foot_radius_m);
            Section::disc([y * at_m, z * at_m], LEG_M / 2.0)
        });
        add(format!("Leg {}", leg + 1), solids);
    }
    pieces
}
