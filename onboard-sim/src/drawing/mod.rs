//! A drawing of a vehicle to scale, as SVG: a side view, three sections, and the station of every
//! part. One unit is 1 mm of the vehicle; the side view has the nose up and body z to the right.

mod parts;
mod solid;

use core::fmt::Write as _;

use flight::vehicle::mission::Mission;

use crate::card::escaped;

pub use self::parts::{MK3, PartsError, Piece, read};
pub use self::solid::{Section, Solid};

/// Colours of pieces, in turn.
const COLOURS: [&str; 6] = ["#1b6ca8", "#b3541e", "#3d7a34", "#7b4397", "#8a6d00", "#b02a4b"];
/// Height and width of a letter, and distance of lines, mm.
const LETTER_MM: f64 = 13.0;
const WIDE_MM: f64 = 8.0;
const LINE_MM: f64 = 17.0;
/// Half width of a section on the vehicle, mm, and of the square in which it is drawn.
const SECTION_MM: f64 = 90.0;
const SQUARE_MM: f64 = 360.0;

/// A line of text: its left edge and its baseline, mm from the upper left corner.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    pub x_mm: f64,
    pub y_mm: f64,
    pub text: String,
}

impl Label {
    /// Left, right, upper and lower edge, mm.
    pub fn edges_mm(&self) -> [f64; 4] {
        let width_mm = WIDE_MM * self.text.chars().count() as f64;
        [self.x_mm, self.x_mm + width_mm, self.y_mm - LETTER_MM, self.y_mm]
    }
}

/// A vehicle's drawing.
#[derive(Debug, Clone)]
pub struct Drawing {
    name: String,
    pieces: Vec<Piece>,
    /// Name, station and z of the points that the flight computer uses, m.
    points: Vec<(&'static str, f64, f64)>,
    /// Stations of the sections, m.
    sections_m: [f64; 3],
}

impl Drawing {
    /// The vehicle of a mission, with the parts of a list if there is one.
    pub fn new(mission: &Mission, list: Vec<Piece>) -> Self {
        let (airframe, sensors) = (&mission.airframe, &mission.sensors);
        let (fins_m, pivot_m) = (airframe.fins.station_m, airframe.gimbal.pivot_station_m);
        let cg_m = airframe.mass.loaded_cg_station_m;
        let mut pieces = parts::of_mission(mission, !list.is_empty());
        pieces.extend(list);
        let points = [
            ("GNSS antenna", sensors.gnss_station_m, sensors.gnss_across_m[1]),
            ("fin hinges", Some(fins_m), 0.0),
            ("inertial unit", sensors.imu_station_m, sensors.imu_across_m[1]),
            ("static ports", sensors.barometer_station_m, sensors.barometer_across_m[1]),
            ("centre of gravity, motor full", Some(cg_m), 0.0),
            ("lidar", sensors.lidar_station_m, sensors.lidar_across_m[1]),
            ("gimbal pivot", Some(pivot_m), 0.0),
            ("feet", Some(airframe.legs.foot_station_m), 0.0),
        ];
        let points = points.into_iter().filter_map(|(name, station_m, z_m)| Some((name, station_m?, z_m)));
        let sections_m = [fins_m - 0.01, sensors.lidar_station_m.unwrap_or(cg_m), pivot_m];
        Self { name: mission.name.clone(), pieces, points: points.collect(), sections_m }
    }

    /// Pairs of parts that fill the same space.
    pub fn overlaps(&self) -> Vec<[&str; 2]> {
        let mut found = Vec::new();
        for (at, one) in self.pieces.iter().enumerate() {
            for other in self.pieces[at + 1..].iter().filter(|other| other.part != one.part) {
                if one.solids.iter().any(|a| other.solids.iter().any(|b| a.overlaps(b))) {
                    found.push([one.part.as_str(), &other.part]);
                }
            }
        }
        found
    }

    /// Whether a part fills a point: station, y and z, m.
    pub fn contains(&self, part: &str, [station_m, y_m, z_m]: [f64; 3]) -> bool {
        let section = Section::disc([y_m, z_m], 1e-4);
        let point = Solid { from_m: station_m - 1e-4, to_m: station_m + 1e-4, section };
        let solids = self.pieces.iter().filter(|piece| piece.part == part).flat_map(|piece| &piece.solids);
        solids.into_iter().any(|solid| solid.overlaps(&point))
    }

    /// The drawing as SVG, and its labels.
    pub fn svg(&self) -> (String, Vec<Label>) {
        let solids = || self.pieces.iter().flat_map(|piece| &piece.solids);
        let highest_m = solids().map(|solid| solid.to_m).fold(0.0, f64::max);
        let lowest_m = solids().map(|solid| solid.from_m).fold(0.0, f64::min);
        let half_mm = 1e3 * solids().map(|solid| solid.section.end_m(1.0)).fold(0.0, f64::max);
        let y_mm = |station_m: f64| 3.0 * LINE_MM + 1e3 * (highest_m - station_m);
        let x_mm = |z_m: f64| half_mm + 20.0 + 1e3 * z_m;
        let (mut shapes, mut labels) = (String::new(), Vec::new());
        let mut label = |x_mm, y_mm, text| labels.push(Label { x_mm, y_mm, text });

        label(10.0, LINE_MM, format!("{}: stations in mm above the nozzle", self.name));
        let coloured = || self.pieces.iter().zip(COLOURS.iter().cycle());
        for (piece, colour) in coloured() {
            for outline in outlines(piece) {
                shapes += &polygon(colour, outline.map(|[station_m, z_m]| [x_mm(z_m), y_mm(station_m)]));
            }
        }
        let points = self
            .points
            .iter()
            .map(|(name, station_m, z_m)| (*station_m, *z_m, format!("{:.1} {name}", 1e3 * station_m)));
        let mut names: Vec<_> = self.pieces.iter().map(named).chain(points).collect();
        names.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (right_mm, mut below_mm) = (x_mm(0.0) + half_mm + 60.0, 0.0);
        for (station_m, z_m, name) in names {
            below_mm = f64::max(y_mm(station_m), below_mm + LINE_MM);
            let (x1, y1, x2, y2) = (right_mm - 4.0, below_mm - 4.0, x_mm(z_m), y_mm(station_m));
            let _ = write!(shapes, "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>");
            label(right_mm, below_mm, name);
        }
        let left_mm = right_mm + 58.0 * WIDE_MM;
        for (place, station_m) in self.sections_m.into_iter().enumerate() {
            let top_mm = 2.0 * LINE_MM + place as f64 * (SQUARE_MM + 3.0 * LINE_MM);
            let scale = SQUARE_MM / SECTION_MM / 2.0;
            label(
                left_mm,
                top_mm - 4.0,
                format!("{:.1}, {scale} to 1, from the nose, z up", 1e3 * station_m),
            );
            let (start, size) = (-SECTION_MM, 2.0 * SECTION_MM);
            let _ = write!(
                shapes,
                "<svg x=\"{left_mm}\" y=\"{top_mm}\" width=\"{SQUARE_MM}\" height=\"{SQUARE_MM}\" \
                 viewBox=\"{start} {start} {size} {size}\">"
            );
            let mut row_mm = top_mm;
            for (piece, colour) in coloured() {
                let Some(solid) = piece.solids.iter().find(|solid| solid.is_at(station_m)) else { continue };
                shapes += &drawn(colour, &solid.section);
                row_mm += LINE_MM;
                label(left_mm + SQUARE_MM + 10.0, row_mm, piece.part.clone());
            }
            shapes += "</svg>";
        }
        let [width, height] = labels.iter().map(Label::edges_mm).fold(
            [0.0, y_mm(lowest_m).max(3.0 * (SQUARE_MM + 3.0 * LINE_MM))],
            |[width, height], [_, right, _, below]| [f64::max(width, right), f64::max(height, below)],
        );
        let texts = labels.iter().map(|Label { x_mm, y_mm, text }| {
            format!("<text x=\"{x_mm:.1}\" y=\"{y_mm:.1}\">{}</text>\n", escaped(text))
        });
        let svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0} {:.0}\">\n<style>\
             text{{font:{LETTER_MM}px monospace}}line{{stroke:#999;stroke-width:.5}}circle{{fill:none}}\
             polygon{{fill-opacity:.35;stroke:#222;stroke-width:.4}}</style>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{}\n{}</svg>\n",
            width + 20.0,
            height + 20.0,
            shapes.replace("/>", "/>\n"),
            texts.collect::<String>()
        );
        (svg, labels)
    }
}

/// A piece's middle, m: its station and z; and its stations and name.
fn named(piece: &Piece) -> (f64, f64, String) {
    let low_m = piece.solids.first().map_or(0.0, |solid| solid.from_m);
    let high_m = piece.solids.last().map_or(0.0, |solid| solid.to_m);
    let middle_m = f64::midpoint(low_m, high_m);
    let cut = piece.solids.iter().find(|solid| solid.is_at(middle_m));
    let z_m = cut.map_or(0.0, |solid| solid.section.end_m(1.0));
    (middle_m, z_m, format!("{:.1} to {:.1} {}", 1e3 * low_m, 1e3 * high_m, piece.part))
}

fn polygon(colour: &str, corners_mm: impl Iterator<Item = [f64; 2]>) -> String {
    let points: Vec<String> = corners_mm.map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    format!("<polygon fill=\"{colour}\" points=\"{}\"/>", points.join(" "))
}

/// A section seen from the nose: z is up, and y to the right.
fn drawn(colour: &str, section: &Section) -> String {
    match section {
        Section::Polygon(corners) => polygon(colour, corners.iter().map(|[y, z]| [1e3 * y, -1e3 * z])),
        Section::Ring { outside_m, inside_m } => {
            let (middle, wall) = (500.0 * (outside_m + inside_m), 1e3 * (outside_m - inside_m));
            format!("<circle r=\"{middle:.2}\" stroke=\"{colour}\" stroke-width=\"{wall:.2}\"/>")
        }
    }
}

/// A piece from the side, station and z, m: both walls of a tube, else the outline of its slices.
fn outlines(piece: &Piece) -> Vec<std::vec::IntoIter<[f64; 2]>> {
    if let [Solid { from_m, to_m, section: Section::Ring { outside_m, inside_m } }] = piece.solids[..] {
        let wall = |side: f64| {
            let (near, far) = (side * inside_m, side * outside_m);
            vec![[from_m, near], [from_m, far], [to_m, far], [to_m, near]].into_iter()
        };
        return vec![wall(-1.0), wall(1.0)];
    }
    let last = piece.solids.len().saturating_sub(1);
    let side = |side: f64| {
        piece.solids.iter().enumerate().flat_map(move |(at, solid)| {
            let (z_m, middle_m) = (solid.section.end_m(side), f64::midpoint(solid.from_m, solid.to_m));
            let from_m = if at == 0 { solid.from_m } else { middle_m };
            [[from_m, z_m], [if at == last { solid.to_m } else { middle_m }, z_m]]
        })
    };
    let left: Vec<[f64; 2]> = side(-1.0).collect();
    vec![side(1.0).chain(left.into_iter().rev()).collect::<Vec<_>>().into_iter()]
}
