//! The flown path for maps and other programs, as KML 2.2 or GPX 1.1: the track, the touchdown that
//! was planned at the ignition, and the fence. Altitudes are above mean sea level.

use std::f64::consts::TAU;
use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use flight::vehicles::mission::from_toml;
use protocol::motion::Degrees;
use sim::wire::field::pad_of;

use super::track::{Flight, planned};
use crate::info::{recorded, utc};

/// Least time between two points of the track, s.
const STEP_S: f64 = 0.1;
/// Corners of the fence.
const CORNERS: u32 = 72;

/// A point on the Earth: altitude, m, and Unix time, ns.
struct Point {
    at: Degrees,
    altitude_m: f64,
    unix_ns: u64,
}

/// What a map of a flight shows.
pub(crate) struct FlownPath {
    track: Vec<Point>,
    marks: Vec<(&'static str, Point)>,
    /// A closed ring.
    fence: Vec<Point>,
}

impl FlownPath {
    /// Reads the path of a flight.
    ///
    /// # Errors
    /// The log cannot be read, or lacks a mission or positions.
    pub(crate) fn open(file: &Path) -> Result<Self> {
        let (mut info, recording) = recorded(file)?;
        let mission = from_toml(recording.profile_toml()?, "profile.toml")
            .with_context(|| file.display().to_string())?;
        info.completeness.warn(&info.file);
        let first_ns = info.span.map_or(0, |span| span.first_ns);
        let zero_s = recording.clocks.flight_zero_s.unwrap_or(0.0);
        let flight = Flight::of(recording, &mut info);
        let pad = pad_of(&mission);
        let point = |time_s: f64, [north_m, east_m, up_m]: [f64; 3]| Point {
            at: pad.moved(north_m, east_m),
            altitude_m: mission.site.altitude_m + up_m,
            unix_ns: first_ns.saturating_add_signed(((zero_s + flight.axis_s(time_s)) * 1e9) as i64),
        };
        let mut track: Vec<Point> = Vec::new();
        let mut due_s = f64::NEG_INFINITY;
        for sample in &flight.track {
            let [north_m, east_m, up_m, ..] = sample.state;
            if sample.time_s >= due_s && (north_m + east_m + up_m).is_finite() {
                due_s = sample.time_s + STEP_S;
                track.push(point(sample.time_s, [north_m, east_m, up_m]));
            }
        }
        ensure!(!track.is_empty(), "{}: has no positions", file.display());
        let began_s = flight.track.first().map_or(0.0, |first| first.time_s);
        let ignition_s = flight.ignition_s.unwrap_or(f64::NEG_INFINITY);
        let at_ignition = flight.made().into_iter().find(|(made, _)| made.time_s >= ignition_s);
        let end = at_ignition.and_then(|(made, plan)| Some((made.time_s, planned(plan.states().last()?))));
        let touchdown = flight.touchdown_s.zip(flight.contact());
        let mut marks = vec![("pad", point(began_s, [0.0; 3]))];
        for (name, mark) in [("touchdown planned at ignition", end), ("touchdown", touchdown)] {
            marks
                .extend(mark.map(|(time_s, [north, east, up, ..])| (name, point(time_s, [north, east, up]))));
        }
        let fence_m = mission.gate.fence_radius_m;
        let corner = |corner: u32| {
            let (sin, cos) = libm::sincos(TAU * f64::from(corner % CORNERS) / f64::from(CORNERS));
            // Counter-clockwise.
            point(began_s, [fence_m * sin, fence_m * cos, 0.0])
        };
        let fence = (0..=CORNERS).filter(|_| fence_m.is_finite()).map(corner).collect();
        Ok(Self { track, marks, fence })
    }

    /// Contents in words.
    pub(crate) fn contents(&self) -> String {
        let fence = (!self.fence.is_empty()).then_some("fence");
        let names: Vec<&str> = self.marks.iter().map(|(name, _)| *name).chain(fence).collect();
        format!("{} points of the track, {}", self.track.len(), names.join(", "))
    }

    pub(crate) fn kml(&self) -> String {
        let place = |Point { at, altitude_m, .. }: &Point| {
            format!("{:.7},{:.7},{altitude_m:.2}", at.longitude, at.latitude)
        };
        let places = |points: &[Point]| points.iter().map(place).collect::<Vec<_>>().join(" ");
        let mark = |name: &str, shape: &str, places: &str| {
            let places = format!("<altitudeMode>absolute</altitudeMode><coordinates>{places}</coordinates>");
            format!("<Placemark><name>{name}</name><{shape}>{places}</{shape}></Placemark>\n")
        };
        let points = self.marks.iter().map(|(name, point)| mark(name, "Point", &place(point)));
        let lines = [("track", &self.track), ("fence", &self.fence)].into_iter();
        let lines = lines.filter(|(_, points)| !points.is_empty());
        let lines = lines.map(|(name, points)| mark(name, "LineString", &places(points)));
        let marks: String = points.chain(lines).collect();
        format!(
            "{XML}<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>\n<name>flight of {}</name>\n\
             {marks}</Document></kml>\n",
            self.date()
        )
    }

    pub(crate) fn gpx(&self) -> String {
        let point = |tag: &str, name: &str, Point { at, altitude_m, unix_ns }: &Point| {
            let (Degrees { latitude, longitude }, time) = (at, utc(*unix_ns));
            format!(
                "<{tag} lat=\"{latitude:.7}\" lon=\"{longitude:.7}\"><ele>{altitude_m:.2}</ele>\
                 <time>{time}</time>{name}</{tag}>\n"
            )
        };
        let marks = self.marks.iter().map(|(name, at)| point("wpt", &format!("<name>{name}</name>"), at));
        let marks: String = marks.collect();
        let [fence, track] = [("rtept", &self.fence), ("trkpt", &self.track)]
            .map(|(tag, points)| points.iter().map(|at| point(tag, "", at)).collect::<String>());
        format!(
            "{XML}<gpx version=\"1.1\" creator=\"touchdown replay\" xmlns=\"http://www.topografix.com/GPX/1/1\">\n\
             <metadata><name>flight of {}</name></metadata>\n{marks}<rte><name>fence</name>\n{fence}</rte>\n\
             <trk><name>track</name><trkseg>\n{track}</trkseg></trk>\n</gpx>\n",
            self.date()
        )
    }

    fn date(&self) -> String {
        self.track.first().map_or(String::new(), |first| utc(first.unix_ns))
    }
}

/// The first line of both files.
const XML: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
