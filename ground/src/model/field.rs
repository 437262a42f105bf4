//! The lines of the launch field around the pad of the vehicle.

use protocol::field::{Field, Kind};
use protocol::motion::Degrees;

use super::Model;

/// The field and the pad; `None` without a field, or while the position of the pad is not
/// available.
fn around(model: &Model) -> Option<(&Field, Degrees)> {
    model.settings.field.as_ref().zip(model.vehicle.pad)
}

/// The lines as points east and north of the pad, m.
pub(crate) fn lines_m(model: &Model) -> Vec<(Kind, Vec<(f64, f64)>)> {
    let lines = around(model).into_iter().flat_map(|(field, pad)| field.lines_m(pad));
    let turned = |(kind, points): (Kind, Vec<(f64, f64)>)| {
        (kind, points.into_iter().map(|(north_m, east_m)| (east_m, north_m)).collect())
    };
    lines.map(turned).collect()
}

/// Distances of a position east and north of the pad, m, from the nearest line of each kind, and
/// from the crowd line alone; empty without a field.
pub(crate) fn distances(model: &Model, (east_m, north_m): (f64, f64)) -> [String; 2] {
    let Some((field, pad)) = around(model) else { return Default::default() };
    let crowd_m = field.nearest_m(Kind::CrowdLine, pad, (north_m, east_m));
    let crowd = crowd_m.map(|m| format!("{} {m:.0} m", Kind::CrowdLine));
    [field.distances(pad, (north_m, east_m)), crowd.unwrap_or_default()]
}

/// Distance of the crowd line from the pad, and the radius of the fence of the mission, m.
pub(crate) fn crowd_and_fence_m(model: &Model) -> Option<(f64, f64)> {
    let (field, pad) = around(model)?;
    field.nearest_m(Kind::CrowdLine, pad, (0.0, 0.0)).zip(model.vehicle.fence_m())
}

/// A crowd line that crosses the fence of the mission: the vehicle may land among people.
pub(crate) fn crowd_inside_fence(model: &Model) -> Option<String> {
    let (crowd_m, fence_m) = crowd_and_fence_m(model).filter(|(crowd_m, fence_m)| crowd_m < fence_m)?;
    Some(format!("CROWD LINE INSIDE THE FENCE: {crowd_m:.0} m of {fence_m:.0} m from the pad"))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::model::Settings;

    const PAD: Degrees = Degrees { latitude: 35.347, longitude: -117.809 };

    fn model(south_deg: f64) -> Model {
        let latitude = PAD.latitude - south_deg;
        let text = format!(
            "{{\"type\":\"FeatureCollection\",\"features\":[{{\"type\":\"Feature\",\"properties\":{{\"kind\":\"crowd line\"}},\
             \"geometry\":{{\"type\":\"LineString\",\"coordinates\":[[-117.82,{latitude}],[-117.8,{latitude}]]}}}}]}}"
        );
        let field = Field::parse(&text, PAD, "test").ok();
        let mut model = Model::new(Settings { field, ..Settings::on_screen("udpin:1") });
        model.vehicle.pad = Some(PAD);
        model
    }

    /// A degree of latitude is 110,947 m there.
    #[test]
    fn val_wgs84_distances_from_a_position_east_and_north_of_the_pad() {
        let model = model(0.001);
        assert_eq!(distances(&model, (50.0, 89.0)), ["crowd line 200 m", "crowd line 200 m"]);
        let (kind, points) = &lines_m(&model)[0];
        assert!(*kind == Kind::CrowdLine && points[0].0 < -900.0 && (points[0].1 + 110.96).abs() < 0.1);
    }

    #[test]
    fn nothing_is_stated_without_a_field_a_pad_or_a_fence() {
        let mut model = model(0.001);
        assert_eq!(crowd_inside_fence(&model), None, "the vehicle has not reported its fence");
        model.vehicle.pad = None;
        assert!(lines_m(&model).is_empty() && distances(&model, (0.0, 0.0))[0].is_empty());
        let without = Model::new(Settings::on_screen("udpin:1"));
        assert!(lines_m(&without).is_empty() && without.last_place(Duration::ZERO).is_none());
    }
}
