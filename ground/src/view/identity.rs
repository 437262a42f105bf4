//! The first line of every screen: mode, vehicle and boot, station and link, and who commands.

use std::time::Duration;

use protocol::identity::Address;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};

use super::draw_line;
use super::theme::{TextRole, Theme};
use crate::model::{Model, Role, words};

/// Columns of `REPLAY SIM` with its spaces.
const MODE_COLUMNS: u16 = 12;
/// Columns of `by ` and a few names.
const CREW_COLUMNS: u16 = 14;

/// Draws the line; each part has a fixed place.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let vehicle = vehicle(model, theme, now);
    let crew = crew(model, theme, now);
    let crew_columns = CREW_COLUMNS.max(crew.width() as u16);
    let [mode_area, vehicle_area, station_area, crew_area] = area.layout(&Layout::horizontal([
        Constraint::Length(MODE_COLUMNS),
        Constraint::Length(vehicle.width() as u16 + 1),
        Constraint::Fill(1),
        Constraint::Length(crew_columns),
    ]));
    draw_line(frame, mode_area, mode(model, theme).into());
    draw_line(frame, vehicle_area, vehicle.into());
    let Address { system_id, component_id } = model.settings.us;
    let station = format!("{system_id}/{component_id} {}", model.settings.link_name);
    draw_line(frame, station_area, Line::styled(station, theme.style(TextRole::Label)));
    draw_line(frame, crew_area, crew.into());
}

/// The same for narrow screens.
pub fn line(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    if let Some(words) = doubt(model, now) {
        return Line::from(vec![
            mode(model, theme),
            Span::styled(format!(" {words}"), theme.style(TextRole::Alarm)),
        ]);
    }
    let number = model.vehicle.boot.number().map_or_else(|| "--".to_owned(), words::boot);
    let system = model.settings.vehicle.system_id;
    Line::from(vec![
        mode(model, theme),
        Span::styled(format!(" {system} {number} "), theme.style(TextRole::Plain)),
        crew(model, theme, now),
        Span::styled(format!(" {}", model.settings.link_name), theme.style(TextRole::Label)),
    ])
}

/// A vehicle counts as real unless it has always reported to be simulated.
fn mode(model: &Model, theme: Theme) -> Span<'static> {
    let simulated = model.vehicle.is_simulated();
    let (word, role) = match model.settings.role {
        Role::Station if model.settings.demonstration => ("DEMO", TextRole::Title),
        Role::Watching if simulated => ("WATCH SIM", TextRole::Title),
        Role::Watching => ("WATCH LIVE", TextRole::Caution),
        Role::Replaying if simulated => ("REPLAY SIM", TextRole::Title),
        Role::Replaying => ("REPLAY", TextRole::Title),
        Role::Station | Role::Attached if simulated => ("SIM", TextRole::Title),
        Role::Station | Role::Attached => ("LIVE", TextRole::Caution),
    };
    Span::styled(format!(" {word}"), theme.style(role))
}

/// Why the vehicle under this id may not be obeyed, or may not be the one that is meant.
fn doubt(model: &Model, now: Duration) -> Option<String> {
    let id = model.settings.vehicle.system_id;
    if model.vehicle.beside(now).is_some() {
        return Some(format!("TWO VEHICLES under id {id}"));
    }
    model.vehicle.as_foreign().map(|foreign| format!("NOT A TOUCHDOWN VEHICLE: {}", foreign.name()))
}

fn vehicle(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    if let Some(words) = doubt(model, now) {
        return Span::styled(words, theme.style(TextRole::Alarm));
    }
    let boot = model.vehicle.boot.number().map_or_else(|| "--".to_owned(), words::boot);
    let name = model.settings.vehicle_name.as_deref().unwrap_or_default();
    let words = format!("system {} boot {boot} {name}", model.settings.vehicle.system_id);
    Span::styled(words, theme.style(TextRole::Plain))
}

/// Whether other screens than this one can command.
fn others_can_command(model: &Model) -> bool {
    model.crew.seats().iter().any(|seat| *seat != model.settings.seat)
}

/// Who commands: another station that armed the vehicle, otherwise who can command here.
fn crew(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    if model.link.station_gone_for(now).is_some() {
        return Span::styled(" NO STATION", theme.style(TextRole::Alarm));
    }
    if let Some(people) = model.people() {
        let who = match model.own_number() {
            0 if model.settings.role == Role::Attached && model.key_number() > 0 => {
                "HOLD/ABORT ONLY".to_owned()
            }
            0 => "OBSERVER".to_owned(),
            number => model.operator(number),
        };
        let mode = if people == 2 { "TWO-PERSON" } else { "one-person" };
        return Span::styled(format!(" {who} {mode}"), theme.style(TextRole::Title));
    }
    if let Some(other) = model.link.uplink.armed_by_other {
        // Another station under our own id is not this one.
        let whose = if other == model.settings.us { "by another " } else { "" };
        let text = format!("armed {whose}{}/{}", other.system_id, other.component_id);
        return Span::styled(format!(" {text}"), theme.style(TextRole::Caution));
    }
    let text = match model.settings.role {
        Role::Replaying => "nobody".to_owned(),
        _ if others_can_command(model) => format!("by {}", model.crew.names().join(",")),
        Role::Watching => "watches only".to_owned(),
        _ if model.link.uplink.armed_by_us && model.link.state(now).carries() => "armed here".to_owned(),
        _ if model.link.uplink.armed_by_us => "~armed here".to_owned(),
        _ => "commands here".to_owned(),
    };
    Span::styled(format!(" {text}"), theme.style(TextRole::Plain))
}
