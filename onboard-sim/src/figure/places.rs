//! Places on the ground about a pad, with circles.

use plotters::chart::ChartBuilder;
use plotters::element::{Circle, Cross, PathElement};
use plotters::style::{BLACK, Color as _, RGBColor, ShapeStyle};

use super::legend::Legend;
use super::{COLOURS, Drawn, FONT, FigureError, drawn};

/// Side of the square of the places, and room for margins and labels left and below of it, px.
const SIDE_PX: u32 = 620;
const ROOM_PX: u32 = 80;
/// Corners of a circle.
const CORNERS: u32 = 180;
/// Colours of the circles, from the inner to the outer.
const GREYS: [RGBColor; 4] =
    [RGBColor(150, 150, 150), RGBColor(110, 110, 110), RGBColor(60, 60, 60), RGBColor(0, 0, 0)];

/// What to draw, m from the pad.
#[derive(Debug, Clone, PartialEq)]
pub struct Places<'a> {
    /// Names and places of the kinds.
    pub kinds: &'a [(&'a str, Vec<[f64; 2]>)],
    /// Names and radii of the circles.
    pub circles: &'a [(String, f64)],
}

/// The places as SVG, both axes at one scale.
///
/// # Errors
/// There is no finite circle.
pub fn places_svg(title: &str, places: &Places<'_>) -> Result<String, FigureError> {
    let names = places.kinds.iter().map(|(name, _)| (*name).to_owned());
    let names = names.chain(places.circles.iter().map(|(name, _)| name.clone()));
    let width_px = SIDE_PX + ROOM_PX;
    let legend = Legend::new(names.collect(), width_px);
    drawn(title, (width_px, width_px + legend.height_px()), |root| -> Drawn {
        let (upper, lower) = root.split_vertically(width_px);
        let of_places = places.kinds.iter().flat_map(|(_, places)| places.iter().flatten().map(|m| m.abs()));
        let of_circles = places.circles.iter().map(|(_, radius_m)| *radius_m);
        let far_m = 1.05 * of_places.chain(of_circles).filter(|m| m.is_finite()).fold(0.0, f64::max);
        if far_m <= 0.0 {
            return Err("no finite circle".into());
        }
        let mut chart = ChartBuilder::on(&upper)
            .margin(10)
            .x_label_area_size(ROOM_PX - 20)
            .y_label_area_size(ROOM_PX - 20)
            .build_cartesian_2d(-far_m..far_m, -far_m..far_m)?;
        chart
            .configure_mesh()
            .x_labels(9)
            .y_labels(9)
            .x_label_formatter(&|m| format!("{m:.0}"))
            .y_label_formatter(&|m| format!("{m:.0}"))
            .label_style(FONT)
            .axis_desc_style(FONT)
            .x_desc("world x, m from the pad")
            .y_desc("world y, m from the pad")
            .light_line_style(RGBColor(250, 250, 250))
            .bold_line_style(RGBColor(230, 230, 230))
            .draw()?;
        for (kind, (_, places)) in places.kinds.iter().enumerate() {
            let finite = places.iter().filter(|place| place.iter().all(|m| m.is_finite()));
            chart.draw_series(finite.map(|[x, y]| Circle::new((*x, *y), 2, dot(kind))))?;
        }
        for (place, (_, radius_m)) in places.circles.iter().enumerate() {
            let corner = |k: u32| {
                let (sin, cos) = libm::sincos(core::f64::consts::TAU * f64::from(k) / f64::from(CORNERS));
                (radius_m * cos, radius_m * sin)
            };
            chart.draw_series([PathElement::new(
                (0..=CORNERS).map(corner).collect::<Vec<_>>(),
                line(place),
            )])?;
        }
        chart.draw_series([Cross::new((0.0, 0.0), 6, BLACK.stroke_width(2))])?;
        legend.draw(&lower, |area, entry, (left, middle)| {
            match entry.checked_sub(places.kinds.len()) {
                None => area.draw(&Circle::new((left + 10, middle), 4, dot(entry)))?,
                Some(circle) => {
                    let ends = [(left, middle), (left + 20, middle)];
                    area.draw(&PathElement::new(ends, line(circle)))?;
                }
            }
            Ok(())
        })
    })
}

fn dot(kind: usize) -> ShapeStyle {
    COLOURS[kind % COLOURS.len()].mix(0.7).filled()
}

/// The darker, the farther out; each second one is thin.
fn line(circle: usize) -> ShapeStyle {
    GREYS[circle % GREYS.len()].stroke_width(1 + u32::from(circle.is_multiple_of(2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_and_circle_is_drawn_and_named() {
        let kinds = [("as planned", vec![[1.0, 2.0], [3.0, f64::NAN]]), ("a < b", vec![[-40.0, 5.0]])];
        let circles = [("fence".to_owned(), 120.0), ("99 %".to_owned(), 400.0)];
        let svg = places_svg("mk2", &Places { kinds: &kinds, circles: &circles }).unwrap();
        for text in ["as planned", "a &lt; b", "fence", "99 %", "world x, m from the pad", "400"] {
            assert!(svg.contains(text), "{text}");
        }
        // Two places and two in the legend.
        assert_eq!(svg.matches("<circle").count(), 4);
        assert!(places_svg("", &Places { kinds: &[], circles: &[] }).is_err());
    }
}
