//! The link: what it carries, what it loses, and how old everything is.

use std::time::Duration;

use ratatui::text::{Line, Span};

use crate::model::Model;
use crate::model::vehicle::{STALE_AFTER, Sample};
use crate::view::number::{STALE_MARK, seconds};
use crate::view::theme::{Role, Theme};
use crate::view::{happenings, top};

/// The figures, then the age of every message.
pub fn lines(model: &Model, theme: Theme, now: Duration, columns: usize) -> Vec<Line<'static>> {
    let link = &model.link;
    let framing = &link.framing;
    let row = |label: &str, value: String| {
        Line::from(vec![
            Span::styled(format!(" {label:<12}"), theme.style(Role::Label)),
            Span::styled(value, theme.style(Role::Plain)),
        ])
    };
    let mut lines = vec![
        Line::from(vec![Span::raw(" "), top::link(model, theme, now)]),
        row("over", model.settings.link_name.clone()),
        happenings::link(model, theme, now, columns),
        row(
            "rejected",
            format!(
                "checksum {}  unknown id {}  cut short {}  flags {}  fields {}  garbage {} B",
                framing.crc_errors,
                framing.unknown_ids,
                framing.cut_short,
                framing.unknown_flags,
                link.undecodable,
                framing.garbage_bytes
            ),
        ),
        row("unsent", format!("{} writes found no room", link.send_drops)),
        Line::styled(
            format!(" Age of what was heard last; {STALE_MARK} older than {}", seconds(STALE_AFTER)),
            theme.style(Role::Title),
        ),
    ];
    let ages = ages(model, now);
    // Two columns where they fit.
    let across = if columns >= 64 { 2 } else { 1 };
    let rows = ages.len().div_ceil(across);
    for row in 0..rows {
        let cells = (0..across).filter_map(|column| ages.get(row + column * rows));
        lines.push(Line::from(cells.flat_map(|(name, age)| age_cell(name, *age, theme)).collect::<Vec<_>>()));
    }
    lines
}

fn age_cell(name: &str, age: Option<Duration>, theme: Theme) -> [Span<'static>; 2] {
    let (text, role) = match age {
        None => (" never".to_owned(), Role::Label),
        Some(age) if age > STALE_AFTER => (format!("{STALE_MARK}{}", seconds(age)), Role::Stale),
        Some(age) => (format!(" {}", seconds(age)), Role::Plain),
    };
    [
        Span::styled(format!(" {name:<22}"), theme.style(Role::Label)),
        Span::styled(format!("{text:<9}"), theme.style(role)),
    ]
}

fn ages(model: &Model, now: Duration) -> Vec<(&'static str, Option<Duration>)> {
    fn age<T>(sample: Option<&Sample<T>>, now: Duration) -> Option<Duration> {
        sample.map(|sample| sample.age(now))
    }
    let vehicle = &model.vehicle;
    vec![
        ("HEARTBEAT", age(vehicle.heartbeat.as_ref(), now)),
        ("TD_FLIGHT_STATUS", age(vehicle.status.as_ref(), now)),
        ("ATTITUDE_QUATERNION", age(vehicle.attitude.as_ref(), now)),
        ("LOCAL_POSITION_NED", age(vehicle.motion.as_ref(), now)),
        ("VFR_HUD", age(vehicle.hud.as_ref(), now)),
        ("TD_FINS", age(vehicle.fins.as_ref(), now)),
        ("TD_GIMBAL", age(vehicle.gimbal.as_ref(), now)),
        ("TD_DESCENT", age(vehicle.descent.as_ref(), now)),
        ("TD_CONTROLLER", age(vehicle.controller.as_ref(), now)),
        ("TD_TOUCHDOWN_PREDICT.", age(vehicle.prediction.as_ref(), now)),
        ("TD_PREDICTED_PATH", age(vehicle.path.as_ref(), now)),
        ("EXTENDED_SYS_STATE", age(vehicle.on_ground.as_ref(), now)),
        ("SYS_STATUS", age(vehicle.ready_to_arm.as_ref(), now)),
    ]
}
