//! Writes the last known place of a vehicle as GeoJSON and as KML, and reads the GeoJSON back.
//!
//! Both are for maps; the GeoJSON also keeps what the station needs after a restart, also while nobody knows where the
//! pad is on the Earth.

use serde_json::{Value, json};

use crate::model::place::{Degrees, LastPlace, Spot};

/// Corners of the polygon that stands for the circle of uncertainty.
const CORNERS: u32 = 36;

/// The GeoJSON of a place (RFC 7946).
pub fn geojson(place: &LastPlace) -> String {
    let spots = spots(place).map(|(name, spot)| {
        let point = place.degrees(&spot).map(|at| json!({ "type": "Point", "coordinates": position(at) }));
        json!({
            "type": "Feature",
            "geometry": point,
            "properties": { "name": name, "north_m": spot.north_m, "east_m": spot.east_m, "error_m": spot.error_m },
        })
    });
    let circle = place.pad.map(|pad| {
        let ring: Vec<Value> = circle(pad, &place.best()).map(position).collect();
        json!({
            "type": "Feature",
            "geometry": { "type": "Polygon", "coordinates": [ring] },
            "properties": { "name": "19 of 20 cases" },
        })
    });
    let features: Vec<Value> = spots.chain(circle).collect();
    let collection = json!({
        "type": "FeatureCollection",
        "features": features,
        "touchdown": {
            "boot": place.boot,
            "heard_unix_s": place.heard_unix_s,
            "height_m": place.height_m,
            "pad": place.pad.map(position),
        },
    });
    format!("{collection:#}\n")
}

/// Longitude comes first.
fn position(at: Degrees) -> Value {
    json!([at.longitude, at.latitude])
}

fn spots(place: &LastPlace) -> impl Iterator<Item = (&'static str, Spot)> {
    [("last heard", Some(place.heard)), ("predicted", place.predicted)]
        .into_iter()
        .filter_map(|(name, spot)| spot.map(|spot| (name, spot)))
}

/// A closed ring around a spot, counter-clockwise.
fn circle(pad: Degrees, spot: &Spot) -> impl Iterator<Item = Degrees> {
    let spot = *spot;
    (0..=CORNERS).map(move |corner| {
        // The last corner is the first one, to the last bit.
        let turn_rad = std::f64::consts::TAU * f64::from(corner % CORNERS) / f64::from(CORNERS);
        let (north_m, east_m) = (spot.error_m * libm::sin(turn_rad), spot.error_m * libm::cos(turn_rad));
        pad.moved(spot.north_m + north_m, spot.east_m + east_m)
    })
}

/// The KML of a place; `None` if nobody knows where the pad is on the Earth.
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
    for (name, spot) in spots(place) {
        let words = format!("within {:.0} m in 19 of 20 cases; boot {:08X}", spot.error_m, place.boot);
        marks += &mark(name, &words, pad.moved(spot.north_m, spot.east_m));
    }
    let ring: Vec<String> = circle(pad, &place.best()).map(coordinates).collect();
    let ring = ring.join(" ");
    Some(format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>\n\
         <name>where to look for the vehicle</name>\n{marks}\
         <Placemark><name>19 of 20 cases</name><Polygon><outerBoundaryIs><LinearRing><coordinates>{ring}\
         </coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>\n</Document></kml>\n"
    ))
}

/// Reads what [`geojson`] has written; `None` for anything else.
pub fn read(text: &str) -> Option<LastPlace> {
    let collection: Value = serde_json::from_str(text).ok()?;
    let about = collection.get("touchdown")?;
    let number = |of: &Value, key: &str| of.get(key)?.as_f64().filter(|value| value.is_finite());
    let spot = |name: &str| {
        let features = collection.get("features")?.as_array()?;
        let has_name = |properties: &&Value| properties.get("name").and_then(Value::as_str) == Some(name);
        let properties = features.iter().filter_map(|feature| feature.get("properties")).find(has_name)?;
        Some(Spot {
            north_m: number(properties, "north_m")?,
            east_m: number(properties, "east_m")?,
            error_m: number(properties, "error_m")?,
        })
    };
    let pad = about.get("pad").and_then(Value::as_array).and_then(|pad| {
        let (longitude, latitude) = (pad.first()?.as_f64()?, pad.get(1)?.as_f64()?);
        // The same ranges as for a place that is typed in.
        format!("{latitude},{longitude}").parse::<Degrees>().ok()
    });
    Some(LastPlace {
        boot: u32::try_from(about.get("boot")?.as_u64()?).ok()?,
        heard_unix_s: about.get("heard_unix_s")?.as_u64()?,
        heard: spot("last heard")?,
        height_m: number(about, "height_m")?,
        predicted: spot("predicted"),
        pad,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn place(pad: Option<Degrees>, predicted: bool) -> LastPlace {
        LastPlace {
            boot: 0x1A2B_3C4D,
            heard_unix_s: 1_800_000_000,
            heard: Spot { north_m: 10.5, east_m: -3.25, error_m: 1.5 },
            height_m: 42.0,
            predicted: predicted.then_some(Spot { north_m: 12.0, east_m: -4.0, error_m: 30.0 }),
            pad,
        }
    }

    const PAD: Degrees = Degrees { latitude: 35.347, longitude: -117.809 };

    #[test]
    fn what_was_written_is_read_back() {
        for pad in [None, Some(PAD)] {
            for predicted in [false, true] {
                let place = place(pad, predicted);
                assert_eq!(read(&geojson(&place)), Some(place));
            }
        }
    }

    /// RFC 7946: longitude first, rings closed and counter-clockwise, no geometry is null.
    #[test]
    fn val_rfc_7946_the_circle_is_a_closed_ring() {
        let text: Value = serde_json::from_str(&geojson(&place(Some(PAD), true))).unwrap();
        let features = text["features"].as_array().unwrap();
        assert_eq!(features.len(), 3);
        let first = features[0]["geometry"]["coordinates"].as_array().unwrap();
        assert!((first[0].as_f64().unwrap() + 117.809).abs() < 0.01, "longitude first");
        let ring = features[2]["geometry"]["coordinates"][0].as_array().unwrap();
        assert_eq!(ring.first(), ring.last());
        let corner = |k: usize| [0, 1].map(|axis| ring[k][axis].as_f64().unwrap());
        let area: f64 = (0..ring.len() - 1)
            .map(|k| (corner(k), corner(k + 1)))
            .map(|([x, y], [to_x, to_y])| x.mul_add(to_y, -(to_x * y)))
            .sum();
        assert!(area > 0.0, "counter-clockwise");
    }

    #[test]
    fn the_kml_has_the_pad_both_places_and_the_circle() {
        let text = kml(&place(Some(PAD), true)).unwrap();
        for word in [
            "<name>pad</name>",
            "<name>last heard</name>",
            "<name>predicted</name>",
            "within 30 m",
            "<Polygon>",
        ] {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert_eq!(text.matches("<Placemark>").count(), text.matches("</Placemark>").count());
        assert_eq!(kml(&place(None, true)), None);
    }

    proptest! {
        #[test]
        fn no_text_causes_a_panic(text in ".*") {
            let _ = read(&text);
        }
    }
}
