//! Where to look for the vehicle after a flight: its last received position, the predicted one, and
//! the file for maps.

use std::time::Duration;

use protocol::dialect::ESTIMATOR_STATUS_DATA;
pub use protocol::motion::Degrees;
use serde::{Deserialize, Serialize};

use super::dead_reckoning::{POSITION_ERROR_M, may_have_left, predict_position};
use super::{Model, Sample};

/// Radius around a position that holds it in 19 of 20 cases, in standard deviations of each axis:
/// sqrt(-2 ln 0.05).
const WITHIN_95: f64 = 2.45;

/// Age from which the station's own position is not current: a receiver sends one a second.
pub(crate) const OWN_POSITION_OLD: Duration = Duration::from_secs(10);

/// A position over the ground, from the pad, with its error.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Spot {
    pub north_m: f64,
    pub east_m: f64,
    /// The radius around it in which it may be, m; of a place where it was or is, in 19 of 20
    /// cases. NaN if it is not known.
    pub error_m: f64,
}

/// The last position of a vehicle that has left the pad.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LastPlace {
    /// The vehicle's boot number.
    pub boot: u32,
    /// When the position was received: seconds since 1970, UTC.
    pub received_unix_s: u64,
    pub received: Spot,
    /// Height above the pad at that time, m.
    pub height_m: f64,
    /// Where it is predicted to be, if it fell silent in flight.
    pub predicted: Option<Spot>,
    /// The position of the pad, if available.
    pub pad: Option<Degrees>,
}

/// The way to a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    pub distance_m: f64,
    /// Clockwise from true north, degrees, 0 to 360.
    pub bearing_deg: f64,
    /// Whether it begins at the station; otherwise at the pad.
    pub from_station: bool,
}

impl Way {
    /// The bearing in whole degrees of three digits; 359.6 is 000, as on a compass.
    pub fn compass(&self) -> String {
        format!("{:03}", self.bearing_deg.round() as u32 % 360)
    }
}

impl LastPlace {
    /// Where to look first.
    pub fn best(&self) -> Spot {
        self.predicted.unwrap_or(self.received)
    }

    /// The point on the Earth of a spot, if the pad is known.
    pub fn degrees(&self, spot: &Spot) -> Option<Degrees> {
        self.pad.map(|pad| pad.moved(spot.north_m, spot.east_m))
    }

    /// The way to a spot from the station, or from the pad if one of the two is not known.
    pub fn way(&self, spot: &Spot, station: Option<Degrees>) -> Way {
        let to = self.pad.zip(station).map(|(pad, station)| {
            let (north_m, east_m) = station.to(pad);
            (north_m + spot.north_m, east_m + spot.east_m)
        });
        let (north_m, east_m) = to.unwrap_or((spot.north_m, spot.east_m));
        let bearing_deg = libm::atan2(east_m, north_m).to_degrees();
        Way {
            distance_m: libm::hypot(north_m, east_m),
            bearing_deg: if bearing_deg < 0.0 { bearing_deg + 360.0 } else { bearing_deg },
            from_station: to.is_some(),
        }
    }
}

/// Another vehicle that reports its position, as the booster's tracker does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tracker {
    pub(crate) at: Sample<Degrees>,
    /// Height above its home position, m.
    pub(crate) height_m: f64,
}

impl Model {
    /// The station's own position: by its receiver, otherwise by its settings.
    pub fn here(&self) -> Option<Degrees> {
        self.here.map(|here| here.value).or(self.settings.here)
    }

    /// The tracker that the crew looks for; `None` for the vehicle.
    pub(crate) fn chosen_tracker(&self) -> Option<(u8, &Tracker)> {
        let id = self.pages.tracker?;
        self.trackers.get(&id).map(|tracker| (id, tracker))
    }

    /// The position to look for: of the chosen tracker, otherwise of the vehicle.
    pub(crate) fn sought(&self, now: Duration) -> Option<LastPlace> {
        let stored = self.last_place(now).or(self.place);
        let Some((_, Tracker { at, height_m })) = self.chosen_tracker() else {
            return stored.filter(|_| may_have_left(&self.vehicle, now).is_none());
        };
        let pad = self.vehicle.pad.or_else(|| stored?.pad)?;
        let (north_m, east_m) = pad.to(at.value);
        Some(LastPlace {
            boot: 0,
            received_unix_s: self.settings.start_unix_s + at.received_at.as_secs(),
            received: Spot { north_m, east_m, error_m: f64::NAN },
            height_m: *height_m,
            predicted: None,
            pad: Some(pad),
        })
    }

    /// The vehicle's last position in this flight; `None` before it left the pad.
    pub fn last_place(&self, now: Duration) -> Option<LastPlace> {
        let left_at = self.vehicle.left_pad_at?;
        let motion = self.vehicle.best_motion().filter(|motion| motion.received_at >= left_at);
        let (received, height_m, at) = match (motion, self.vehicle.verdict()) {
            (Some(Sample { value, received_at }), _) => {
                let spot = Spot { north_m: value.x_m, east_m: value.y_m, error_m: self.position_error_m() };
                (spot, value.altitude_m, received_at)
            }
            // A verdict has the distance from the pad, and no direction.
            (None, Some(Sample { value, received_at })) => {
                let spot = Spot { error_m: value.touchdown.distance_m + POSITION_ERROR_M, ..Spot::default() };
                (spot, value.touchdown.height_m, received_at)
            }
            (None, None) => return None,
        };
        Some(LastPlace {
            boot: self.vehicle.boot.number().unwrap_or(0),
            received_unix_s: self.settings.start_unix_s + at.as_secs(),
            received,
            height_m,
            predicted: predict_position(&self.vehicle, now).map(|at| at.spot),
            pad: self.vehicle.pad,
        })
    }

    /// Error of the reported position, m: the vehicle's accuracy, if that is worse than usual.
    pub(crate) fn position_error_m(&self) -> f64 {
        let sigma_m = |status: Sample<ESTIMATOR_STATUS_DATA>| f64::from(status.value.pos_horiz_accuracy);
        self.vehicle.last().map_or(0.0, |status| WITHIN_95 * sigma_m(status)).max(POSITION_ERROR_M)
    }

    /// Intended touchdown of a vehicle that left the pad in silence: the touchdown that it
    /// predicted, else the pad, with the fence of its mission as the error. `None` if it has
    /// reported no fence.
    pub fn intended_touchdown(&self) -> Option<Spot> {
        let fence_m = self.vehicle.fence_m()?;
        let predicted = self.vehicle.descent().map(|descent| descent.value);
        let finite = |m: Option<f32>| m.map(f64::from).filter(|m| m.is_finite()).unwrap_or(0.0);
        Some(Spot {
            north_m: finite(predicted.as_ref().map(|descent| descent.touchdown_x_m)),
            east_m: finite(predicted.map(|descent| descent.touchdown_y_m)),
            error_m: fence_m,
        })
    }
}

// The last position of a vehicle as KML, for maps. The file for a restart of the station is stored
// beside it, also without the pad's position on the Earth.

/// Corners of the polygon that stands for the circle of uncertainty.
const CORNERS: u32 = 36;

/// The KML of a position; `None` without the pad's position on the Earth.
pub fn kml(place: &LastPlace) -> Option<String> {
    let pad = place.pad?;
    let coordinates = |at: Degrees| format!("{:.7},{:.7},0", at.longitude, at.latitude);
    let mark = |name: &str, words: &str, at: Degrees| {
        let at = coordinates(at);
        format!(
            "<Placemark><name>{name}</name><description>{words}</description><Point><coordinates>{at}</coordinates></Point></Placemark>\n"
        )
    };
    let mut marks = mark("pad", "", pad);
    let spots = [("last received", Some(place.received)), ("predicted", place.predicted)];
    for (name, spot) in spots.into_iter().filter_map(|(name, spot)| Some((name, spot?))) {
        let words = format!("within {:.0} m in 19 of 20 cases; boot {:08X}", spot.error_m, place.boot);
        marks += &mark(name, &words, pad.moved(spot.north_m, spot.east_m));
    }
    // Closed, and counter-clockwise.
    let best = place.best();
    let corner = |corner: u32| {
        // The last corner is the first one, to the last bit.
        let turn_rad = std::f64::consts::TAU * f64::from(corner % CORNERS) / f64::from(CORNERS);
        let (sin, cos) = libm::sincos(turn_rad);
        coordinates(pad.moved(best.north_m + best.error_m * sin, best.east_m + best.error_m * cos))
    };
    let ring: Vec<String> = (0..=CORNERS).map(corner).collect();
    let ring = ring.join(" ");
    Some(format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>\n\
         <name>where to look for the vehicle</name>\n{marks}\
         <Placemark><name>19 of 20 cases</name><Polygon><outerBoundaryIs><LinearRing><coordinates>{ring}\
         </coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>\n</Document></kml>\n"
    ))
}

#[cfg(test)]
mod place_tests {
    use super::*;

    const PAD: Degrees = Degrees { latitude: 45.0, longitude: 10.0 };

    /// Length of a degree of latitude and of longitude at 45 degrees north on WGS 84, m: 111,131.75
    /// and 78,846.81.
    #[test]
    fn val_wgs84_a_hundredth_of_a_degree_is_as_long_as_it_should_be() {
        let moved = PAD.moved(1_111.317_5, 788.468_1);
        assert!((moved.latitude - 45.01).abs() < 1e-7 && (moved.longitude - 10.01).abs() < 1e-7, "{moved:?}");
        let (north_m, east_m) = PAD.to(moved);
        assert!((north_m - 1_111.317_5).abs() < 1e-6 && (east_m - 788.468_1).abs() < 1e-6);
    }

    #[test]
    fn the_way_is_from_the_station_if_both_positions_are_available() {
        let spot = Spot { north_m: 0.0, east_m: 100.0, error_m: 5.0 };
        let place = LastPlace {
            boot: 1,
            received_unix_s: 0,
            received: spot,
            height_m: 3.0,
            predicted: None,
            pad: Some(PAD),
        };
        let way = place.way(&spot, None);
        assert!(
            !way.from_station
                && (way.bearing_deg - 90.0).abs() < 1e-9
                && (way.distance_m - 100.0).abs() < 1e-9
        );
        // The station is 100 m north of the pad: the vehicle is south-east of it.
        let way = place.way(&spot, Some(PAD.moved(100.0, 0.0)));
        assert!(way.from_station && (way.bearing_deg - 135.0).abs() < 1e-3, "{way:?}");
        let west = place.way(&Spot { north_m: 0.0, east_m: -1.0, error_m: 0.0 }, None);
        assert!((west.bearing_deg - 270.0).abs() < 1e-9);
    }

    #[test]
    fn a_place_is_two_numbers_in_degrees() {
        assert_eq!("35.347,-117.809".parse(), Ok(Degrees { latitude: 35.347, longitude: -117.809 }));
        for wrong in ["", "1", "91,0", "0,181", "a,b", "nan,0", "1,2,3"] {
            let what = "is no place; give latitude,longitude in degrees, as in 35.347,-117.809";
            assert_eq!(wrong.parse::<Degrees>(), Err(format!("`{wrong}` {what}")));
        }
    }

    #[test]
    fn a_path_across_the_date_line_is_short() {
        let (_, east_m) =
            Degrees { latitude: 0.0, longitude: 179.9 }.to(Degrees { latitude: 0.0, longitude: -179.9 });
        assert!((east_m - 22_263.9).abs() < 1.0, "{east_m}");
    }
}

#[cfg(test)]
mod place_file_tests {
    use super::*;

    fn place(pad: Option<Degrees>, predicted: bool) -> LastPlace {
        LastPlace {
            boot: 0x1A2B_3C4D,
            received_unix_s: 1_800_000_000,
            received: Spot { north_m: 10.5, east_m: -3.25, error_m: 1.5 },
            height_m: 42.0,
            predicted: predicted.then_some(Spot { north_m: 12.0, east_m: -4.0, error_m: 30.0 }),
            pad,
        }
    }

    const PAD: Degrees = Degrees { latitude: 35.347, longitude: -117.809 };

    /// OGC 12-007, 10.7: a ring is closed and counter-clockwise, with the longitude first.
    #[test]
    fn val_ogc_12_007_the_circle_is_a_closed_ring() {
        let text = kml(&place(Some(PAD), true)).unwrap();
        let ring = text.split("<LinearRing><coordinates>").nth(1).unwrap().split('<').next().unwrap();
        let corners: Vec<[f64; 2]> = ring
            .split(' ')
            .map(|corner| {
                let mut parts = corner.split(',').map(|part| part.parse().unwrap());
                [parts.next().unwrap(), parts.next().unwrap()]
            })
            .collect();
        assert!((corners[0][0] + 117.809).abs() < 0.01, "longitude first");
        assert_eq!(corners.first(), corners.last());
        let area: f64 =
            corners.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[1][0] * pair[0][1]).sum();
        assert!(area > 0.0, "counter-clockwise");
    }

    #[test]
    fn the_kml_has_the_pad_both_places_and_the_circle() {
        let text = kml(&place(Some(PAD), true)).unwrap();
        for word in [
            "<name>pad</name>",
            "<name>last received</name>",
            "<name>predicted</name>",
            "within 30 m",
            "<Polygon>",
        ] {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert_eq!(text.matches("<Placemark>").count(), text.matches("</Placemark>").count());
        assert_eq!(kml(&place(None, true)), None);
    }
}
