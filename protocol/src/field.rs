//! The lines of a launch field, from a GeoJSON or KML file: where people stand, and what is in the
//! way. They are drawn and measured for people; nothing on board depends on them.

use std::fmt;
use std::path::Path;

use geojson::{GeoJson, GeometryValue, Position};
use serde::{Deserialize, Serialize};

use crate::motion::Degrees;

/// The most points of a field; a drawn one has some hundred.
const POINTS_MAX: usize = 20_000;
/// A field farther from its pad than this is that of another pad, or has its coordinates swapped,
/// m.
const FARTHEST_M: f64 = 50_000.0;

/// Kind of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    Boundary,
    Road,
    CrowdLine,
    Trees,
    LandingArea,
}

impl Kind {
    pub const ALL: [Self; 5] = [Self::Boundary, Self::Road, Self::CrowdLine, Self::Trees, Self::LandingArea];

    /// Its name in files and on screens.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Boundary => "boundary",
            Self::Road => "road",
            Self::CrowdLine => "crowd line",
            Self::Trees => "trees",
            Self::LandingArea => "landing area",
        }
    }

    /// The kind whose name a text begins with; case, `-` and `_` do not matter.
    fn of(text: &str) -> Option<Self> {
        let text = text.trim().to_lowercase().replace(['-', '_'], " ");
        Self::ALL.into_iter().find(|kind| text.starts_with(kind.name()))
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A line, an outline (its first point is its last), or a single point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    pub kind: Kind,
    pub points: Vec<Degrees>,
}

impl Line {
    /// Its points north and east of a pad, m.
    fn points_m(&self, pad: Degrees) -> Vec<(f64, f64)> {
        self.points.iter().map(|at| pad.to(*at)).collect()
    }
}

/// The lines of a field.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Field {
    pub lines: Vec<Line>,
}

/// Why a file is not a field.
#[derive(Debug, thiserror::Error)]
pub enum FieldError {
    #[error("{path}: cannot be read")]
    Read { path: String, source: std::io::Error },
    #[error("{origin}: neither GeoJSON nor KML: {problem}")]
    Format { origin: String, problem: String },
    #[error("{origin}: feature {number} ({name}): {problem}")]
    Feature {
        origin: String,
        /// From 1.
        number: usize,
        name: String,
        problem: String,
    },
    #[error("{origin}: {problem}")]
    Lines { origin: String, problem: String },
}

/// A name, a kind, if it is stated, and longitudes and latitudes of each line.
type Feature = (String, Option<String>, Vec<Vec<[f64; 2]>>);

impl Field {
    /// Reads the text of a file whose path is relative to that of a mission.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn text_of(file: &str, mission: &Path) -> Result<String, FieldError> {
        let path = mission.parent().unwrap_or(mission).join(file);
        std::fs::read_to_string(&path)
            .map_err(|source| FieldError::Read { path: path.display().to_string(), source })
    }

    /// Reads the lines of a field around a pad from the text of a GeoJSON or KML file; `origin`
    /// names it in messages. A feature's kind is its property `kind`, or its name begins with it.
    ///
    /// # Errors
    /// [`FieldError`] names the feature and what is accepted.
    pub fn parse(text: &str, pad: Degrees, origin: &str) -> Result<Self, FieldError> {
        let is_kml = text.trim_start_matches('\u{feff}').trim_start().starts_with('<');
        let features = if is_kml { of_kml(text) } else { of_geojson(text) };
        let format = |problem| FieldError::Format { origin: origin.to_owned(), problem };
        let mut lines = Vec::new();
        for (place, (name, stated, paths)) in features.map_err(format)?.into_iter().enumerate() {
            let read: Result<Vec<Line>, String> = match Kind::of(stated.as_deref().unwrap_or(&name)) {
                Some(kind) => paths.iter().map(|path| line(kind, path, pad)).collect(),
                None => Err(format!(
                    "its kind is not one of {}; accepted: a property `kind`, or a name that begins with it",
                    Kind::ALL.map(Kind::name).join(", ")
                )),
            };
            let (origin, number) = (origin.to_owned(), place + 1);
            lines.extend(read.map_err(|problem| FieldError::Feature { origin, number, name, problem })?);
        }
        let points = lines.iter().map(|line| line.points.len()).sum::<usize>();
        if !(1..=POINTS_MAX).contains(&points) {
            let problem = format!("has {points} points; accepted: 1 to {POINTS_MAX}");
            return Err(FieldError::Lines { origin: origin.to_owned(), problem });
        }
        Ok(Self { lines })
    }

    /// The lines of each kind as points north and east of a pad, m.
    pub fn lines_m(&self, pad: Degrees) -> impl Iterator<Item = (Kind, Vec<(f64, f64)>)> {
        self.lines.iter().map(move |line| (line.kind, line.points_m(pad)))
    }

    /// Distance of the nearest line of a kind from a position north and east of a pad, m.
    pub fn nearest_m(&self, kind: Kind, pad: Degrees, from_m: (f64, f64)) -> Option<f64> {
        // Only these lines are converted: a screen computes the distances for every picture.
        let lines = self.lines.iter().filter(|line| line.kind == kind);
        lines.map(|line| distance_m(&line.points_m(pad), from_m)).min_by(f64::total_cmp)
    }

    /// The kinds present with the distance of their nearest line, m, in words.
    pub fn distances(&self, pad: Degrees, from_m: (f64, f64)) -> String {
        let near = |kind| Some(format!("{kind} {:.0} m", self.nearest_m(kind, pad, from_m)?));
        Kind::ALL.into_iter().filter_map(near).collect::<Vec<_>>().join(", ")
    }
}

/// Distance of a path from a point, m.
fn distance_m(path: &[(f64, f64)], (north_m, east_m): (f64, f64)) -> f64 {
    let last = path.last().copied();
    let ends = path.iter().copied().zip(path.iter().copied().skip(1).chain(last));
    let distances = ends.map(|(from, to)| {
        let along = (to.0 - from.0, to.1 - from.1);
        let length_m2 = along.0 * along.0 + along.1 * along.1;
        let share = ((north_m - from.0) * along.0 + (east_m - from.1) * along.1) / length_m2;
        let share = if length_m2 > 0.0 { share.clamp(0.0, 1.0) } else { 0.0 };
        libm::hypot(north_m - from.0 - share * along.0, east_m - from.1 - share * along.1)
    });
    distances.fold(f64::INFINITY, f64::min)
}

fn line(kind: Kind, path: &[[f64; 2]], pad: Degrees) -> Result<Line, String> {
    let point = |[longitude, latitude]: &[f64; 2]| {
        let at = Degrees { latitude: *latitude, longitude: *longitude };
        let stated = format!("longitude {longitude}, latitude {latitude}");
        if !at.is_valid() {
            return Err(format!("{stated}; accepted: -180 to 180 and -85 to 85, longitude first"));
        }
        let (north_m, east_m) = pad.to(at);
        let far_m = libm::hypot(north_m, east_m);
        if far_m > FARTHEST_M {
            let (far_km, most_km) = (far_m / 1e3, FARTHEST_M / 1e3);
            return Err(format!(
                "{stated} is {far_km:.0} km from the pad; accepted: up to {most_km:.0} km, longitude first"
            ));
        }
        Ok(at)
    };
    if path.is_empty() {
        return Err("has no point".to_owned());
    }
    Ok(Line { kind, points: path.iter().map(point).collect::<Result<_, _>>()? })
}

fn of_geojson(text: &str) -> Result<Vec<Feature>, String> {
    let parsed: GeoJson = text.parse().map_err(|error: geojson::Error| error.to_string())?;
    let features = match parsed {
        GeoJson::FeatureCollection(collection) => collection.features,
        GeoJson::Feature(feature) => vec![feature],
        GeoJson::Geometry(_) => {
            return Err("a geometry has no kind; accepted: a FeatureCollection".to_owned());
        }
    };
    let read = features.into_iter().map(|feature| {
        let text = |key: &str| feature.property(key).and_then(|value| value.as_str()).map(str::to_owned);
        let mut paths = Vec::new();
        if let Some(geometry) = &feature.geometry {
            add_paths(&geometry.value, &mut paths);
        }
        (text("name").unwrap_or_default(), text("kind"), paths)
    });
    Ok(read.collect())
}

fn add_paths(geometry: &GeometryValue, paths: &mut Vec<Vec<[f64; 2]>>) {
    let path = |positions: &[Position]| {
        let numbers = |at: &Position| [0, 1].map(|axis| at.as_slice().get(axis).copied().unwrap_or(f64::NAN));
        positions.iter().map(numbers).collect::<Vec<_>>()
    };
    match geometry {
        GeometryValue::Point { coordinates } => paths.push(path(std::slice::from_ref(coordinates))),
        GeometryValue::MultiPoint { coordinates } => {
            paths.extend(coordinates.iter().map(|at| path(std::slice::from_ref(at))));
        }
        GeometryValue::LineString { coordinates } => paths.push(path(coordinates)),
        GeometryValue::MultiLineString { coordinates } | GeometryValue::Polygon { coordinates } => {
            paths.extend(coordinates.iter().map(|line| path(line)));
        }
        GeometryValue::MultiPolygon { coordinates } => {
            paths.extend(coordinates.iter().flatten().map(|line| path(line)));
        }
        GeometryValue::GeometryCollection { geometries } => {
            for geometry in geometries {
                add_paths(&geometry.value, paths);
            }
        }
    }
}

/// Placemarks of a KML document (OGC 12-007r2): each `coordinates` is a line of `longitude,
/// latitude[,altitude]`.
fn of_kml(text: &str) -> Result<Vec<Feature>, String> {
    let document = roxmltree::Document::parse(text).map_err(|error| error.to_string())?;
    let is = |node: &roxmltree::Node<'_, '_>, name: &str| node.tag_name().name() == name;
    let marks = document.descendants().filter(|node| is(node, "Placemark"));
    let read = marks.map(|mark| {
        let text = |name: &str| mark.children().find(|node| is(node, name)).and_then(|node| node.text());
        let kind = mark.descendants().find(|node| is(node, "Data") && node.attribute("name") == Some("kind"));
        let kind = kind.and_then(|data| data.descendants().find(|node| is(node, "value"))?.text());
        let paths = mark.descendants().filter(|node| is(node, "coordinates")).map(|node| {
            let points = node.text().unwrap_or_default().split_whitespace();
            let numbers = |point: &str| {
                let mut numbers = point.split(',').map(|number| number.parse().unwrap_or(f64::NAN));
                [(); 2].map(|()| numbers.next().unwrap_or(f64::NAN))
            };
            points.map(numbers).collect()
        });
        (text("name").unwrap_or_default().to_owned(), kind.map(str::to_owned), paths.collect())
    });
    Ok(read.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAD: Degrees = Degrees { latitude: 35.347, longitude: -117.809 };

    const GEOJSON: &str = r#"{"type": "FeatureCollection", "features": [
        {"type": "Feature", "properties": {"kind": "crowd-line", "name": "spectators"},
         "geometry": {"type": "LineString", "coordinates": [[-117.812, 35.3461], [-117.806, 35.3461]]}},
        {"type": "Feature", "properties": {"name": "Landing area"},
         "geometry": {"type": "Polygon", "coordinates": [[[-117.81, 35.347], [-117.809, 35.347], [-117.809, 35.348], [-117.81, 35.347]]]}},
        {"type": "Feature", "properties": {"kind": "trees"}, "geometry": {"type": "Point", "coordinates": [-117.809, 35.349, 640]}}]}"#;
    const KML: &str = r#"<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document>
        <Placemark><name>Crowd line, north</name><LineString><coordinates>
        -117.812,35.3461,0 -117.806,35.3461,0</coordinates></LineString></Placemark>
        <Placemark><name>B 14</name><ExtendedData><Data name="kind"><value>road</value></Data></ExtendedData>
        <LineString><coordinates>-117.812,35.35 -117.806,35.35</coordinates></LineString></Placemark></Document></kml>"#;

    fn read(text: &str) -> Result<Field, String> {
        Field::parse(text, PAD, "field").map_err(|error| error.to_string())
    }

    /// 0.0009 degrees of latitude are 99.86 m at 35.3 degrees north, 0.002 are 221.9 m (110,947 m
    /// a degree).
    #[test]
    fn val_wgs84_distances_to_lines_of_both_formats() {
        let [json, kml] = [GEOJSON, KML].map(|text| read(text).unwrap());
        for field in [&json, &kml] {
            let crowd_m = field.nearest_m(Kind::CrowdLine, PAD, (0.0, 0.0)).unwrap();
            assert!((crowd_m - 99.86).abs() < 0.1, "{crowd_m}");
            // Beyond its end the end is the nearest.
            let past_m = field.nearest_m(Kind::CrowdLine, PAD, (-99.86, 1e3)).unwrap();
            assert!((past_m - (1e3 - 272.7)).abs() < 1.0, "{past_m}");
        }
        assert_eq!(json.distances(PAD, (0.0, 0.0)), "crowd line 100 m, trees 222 m, landing area 0 m");
        assert_eq!(kml.distances(PAD, (0.0, 0.0)), "road 333 m, crowd line 100 m");
        assert_eq!(json.lines.len(), 3);
    }

    #[test]
    fn a_bad_file_is_refused_with_its_feature_and_what_is_accepted() {
        let kinds = "boundary, road, crowd line, trees, landing area";
        for (text, words) in [
            ("", "field: neither GeoJSON nor KML: ".to_owned()),
            ("<kml>", "field: neither GeoJSON nor KML: ".to_owned()),
            (
                "{\"type\": \"FeatureCollection\", \"features\": []}",
                "field: has 0 points; accepted: 1 to 20000".to_owned(),
            ),
            (
                "{\"type\": \"Point\", \"coordinates\": [1, 2]}",
                "field: neither GeoJSON nor KML: a geometry has no kind; accepted: a FeatureCollection"
                    .to_owned(),
            ),
            (
                &GEOJSON.replace("\"kind\": \"trees\"", "\"kind\": \"pond\""),
                format!("field: feature 3 (): its kind is not one of {kinds}"),
            ),
            (
                &GEOJSON.replace("[-117.812, 35.3461]", "[35.3461, -117.812]"),
                "field: feature 1 (spectators): longitude 35.3461, latitude -117.812; accepted: -180 to 180"
                    .to_owned(),
            ),
            (
                &KML.replace("-117.812,35.3461,0", "-11.7812,35.3461,0"),
                "field: feature 1 (Crowd line, north): longitude -11.7812, latitude 35.3461 is 96".to_owned(),
            ),
            (&KML.replace("-117.812,35.35", "x,y"), "field: feature 2 (B 14): longitude NaN".to_owned()),
        ] {
            let refused = read(text).unwrap_err();
            assert!(refused.starts_with(&words), "{refused}\n{words}");
        }
    }

    #[test]
    fn arbitrary_text_is_refused_without_a_panic() {
        for text in [GEOJSON, KML] {
            for end in (0..text.len()).step_by(7) {
                assert!(read(&text[..end]).is_err(), "{end}");
            }
        }
    }
}
