//! The page that helps to find the vehicle: where it was last heard, where it is predicted, and the way there.

use std::time::Duration;

use ratatui::text::{Line, Span};

use crate::model::Model;
use crate::model::dead_reckoning::may_have_left;
use crate::model::place::{LastPlace, Spot};
use crate::view::number::fixed;
use crate::view::theme::{TextRole, Theme};

/// The places and the ways to them.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let place = model.last_place(now).or(model.place);
    let label = |words: &'static str| Line::styled(words, theme.style(TextRole::Label));
    if let Some(since) = may_have_left(&model.vehicle, now) {
        return may_have_left_lines(model, since, theme);
    }
    let Some(place) = place else {
        if model.vehicle.left_pad_at.is_some() {
            return vec![Line::styled(
                " The vehicle has left the pad, and has not told its place.",
                theme.style(TextRole::Caution),
            )];
        }
        return vec![
            label(" The vehicle has not left the pad."),
            label(" In flight its last place is kept beside the log, for maps"),
            label(" (GeoJSON, and KML with --pad)."),
        ];
    };
    let now_unix_s = model.settings.start_unix_s + now.as_secs();
    let mut lines = Vec::new();
    if let Some(predicted) = &place.predicted {
        lines.push(Line::styled(" PREDICTED: look here first", theme.style(TextRole::Caution)));
        lines.extend(spot(model, &place, predicted, theme));
        lines.push(Line::default());
    }
    lines.push(Line::styled(" Last heard", theme.style(TextRole::Title)));
    lines.extend(spot(model, &place, &place.heard, theme));
    lines.push(row("height then", format!("{} m", fixed(place.height_m, 1)), theme));
    let ago = now_unix_s.saturating_sub(place.heard_unix_s);
    lines.push(row("heard", format!("{ago} s ago, boot {:08X}", place.boot), theme));
    lines.push(Line::default());
    if place.pad.is_none() {
        let words = " Latitude, longitude and KML need the pad's place: --pad LATITUDE,LONGITUDE";
        lines.push(Line::styled(words, theme.style(TextRole::Label)));
    } else if model.settings.here.is_none() {
        let words = " The way from this station needs its place: --here LATITUDE,LONGITUDE";
        lines.push(Line::styled(words, theme.style(TextRole::Label)));
    }
    lines
}

/// It was last heard on the pad, in a countdown that must have ended.
fn may_have_left_lines(model: &Model, since: Duration, theme: Theme) -> Vec<Line<'static>> {
    let words = format!(" MAY BE IN THE AIR since T+{:.1} s", since.as_secs_f64());
    let mut lines = vec![Line::styled(words, theme.style(TextRole::Alarm))];
    let Some(meant) = model.meant_to_come_down() else {
        let words = " It has not told the fence of its mission: look around the pad.";
        lines.push(Line::styled(words, theme.style(TextRole::Caution)));
        return lines;
    };
    let (north, east) = (fixed(meant.north_m, 0), fixed(meant.east_m, 0));
    lines.push(row("meant to land", format!("north {north} m, east {east} m of the pad"), theme));
    lines.push(row("within", format!("{} m, the fence of its mission", fixed(meant.error_m, 0)), theme));
    if let Some(at) = model.settings.pad.map(|pad| pad.moved(meant.north_m, meant.east_m)) {
        lines.push(row("degrees", format!("{:.6}, {:.6}", at.latitude, at.longitude), theme));
    }
    let words = " Under a parachute, or without its landing motor, it may come down farther away.";
    lines.push(Line::styled(words, theme.style(TextRole::Caution)));
    lines
}

fn row(label: &str, value: String, theme: Theme) -> Line<'static> {
    Line::from(vec![
        Span::styled(format!("   {label:<16}"), theme.style(TextRole::Label)),
        Span::styled(value, theme.style(TextRole::Plain)),
    ])
}

fn spot(model: &Model, place: &LastPlace, spot: &Spot, theme: Theme) -> Vec<Line<'static>> {
    let way = place.way(spot, model.settings.here);
    let from = if way.from_station { "from here" } else { "from the pad" };
    // 359.6 is 000, as on a compass.
    let bearing_deg = way.bearing_deg.round() as u32 % 360;
    let plus_minus = theme.either_side(&format!("±{} m", fixed(spot.error_m, 0)));
    let mut rows = vec![
        row(from, format!("{} m, bearing {bearing_deg:03} deg", fixed(way.distance_m, 0)), theme),
        row(
            "pad frame",
            format!("north {} m, east {} m", fixed(spot.north_m, 1), fixed(spot.east_m, 1)),
            theme,
        ),
        row("19 of 20 cases", plus_minus, theme),
    ];
    if let Some(at) = place.degrees(spot) {
        rows.push(row("degrees", format!("{:.6}, {:.6}", at.latitude, at.longitude), theme));
    }
    rows
}
