//! Who sits where: the first line of every screen. What this is, which vehicle and which boot of it, which station and link,
//! and who commands.

use protocol::identity::Address;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};

use super::theme::{Role, Theme};
use crate::model::{self, Model, words};

/// `REPLAY SIM`, its spaces included.
const MODE_COLUMNS: u16 = 12;
/// `system 1 boot 1A2B3C4D mk2`, likewise.
const VEHICLE_COLUMNS: u16 = 27;
/// `by ` and a few names.
const CREW_COLUMNS: u16 = 14;

/// Draws the line; each part has its place, whatever the others say.
pub fn draw(model: &Model, theme: Theme, frame: &mut Frame, area: Rect) {
    let [mode_area, vehicle_area, station_area, crew_area] = area.layout(&Layout::horizontal([
        Constraint::Length(MODE_COLUMNS),
        Constraint::Length(VEHICLE_COLUMNS),
        Constraint::Fill(1),
        Constraint::Length(CREW_COLUMNS),
    ]));
    frame.render_widget(mode(model, theme), mode_area);
    frame.render_widget(Span::styled(vehicle(model), theme.style(Role::Plain)), vehicle_area);
    let Address { system_id, component_id } = model.settings.us;
    let station = format!("{system_id}/{component_id} {}", model.settings.link_name);
    frame.render_widget(Span::styled(station, theme.style(Role::Label)), station_area);
    frame.render_widget(crew(model, theme), crew_area);
}

/// The same in a narrow line, as far as there is room.
pub fn line(model: &Model, theme: Theme) -> Line<'static> {
    let number = model.vehicle.boot.number().map_or_else(|| "--".to_owned(), words::boot);
    let system = model.settings.vehicle.system_id;
    Line::from(vec![
        mode(model, theme),
        Span::styled(format!(" {system} {number} "), theme.style(Role::Plain)),
        crew(model, theme),
        Span::styled(format!(" {}", model.settings.link_name), theme.style(Role::Label)),
    ])
}

/// A real vehicle is what does not say, and has not always said, that it is none.
fn mode(model: &Model, theme: Theme) -> Span<'static> {
    let simulated = model.vehicle.is_simulated();
    let (word, role) = match model.settings.role {
        model::Role::Station if model.settings.demonstration => ("DEMO", Role::Title),
        model::Role::Watching if simulated => ("WATCH SIM", Role::Title),
        model::Role::Watching => ("WATCH LIVE", Role::Caution),
        model::Role::Replaying if simulated => ("REPLAY SIM", Role::Title),
        model::Role::Replaying => ("REPLAY", Role::Title),
        model::Role::Station | model::Role::Attached if simulated => ("SIM", Role::Title),
        model::Role::Station | model::Role::Attached => ("LIVE", Role::Caution),
    };
    Span::styled(format!(" {word}"), theme.style(role))
}

fn vehicle(model: &Model) -> String {
    let boot = model.vehicle.boot.number().map_or_else(|| "--".to_owned(), words::boot);
    let name = model.settings.vehicle_name.as_deref().unwrap_or_default();
    format!("system {} boot {boot} {name}", model.settings.vehicle.system_id)
}

/// Not this screen alone.
fn others_sit_there(model: &Model) -> bool {
    model.crew.seats().iter().any(|seat| *seat != model.settings.seat)
}

/// Who commands: the station that armed the vehicle, if it is another; else who may, here.
fn crew(model: &Model, theme: Theme) -> Span<'static> {
    if let Some(other) = model.link.uplink.other {
        let text = format!("armed {}/{}", other.system_id, other.component_id);
        return Span::styled(format!(" {text}"), theme.style(Role::Caution));
    }
    let text = match model.settings.role {
        model::Role::Replaying => "nobody".to_owned(),
        _ if others_sit_there(model) => format!("by {}", model.crew.names().join(",")),
        model::Role::Watching => "watches only".to_owned(),
        _ if model.link.uplink.commands => "armed here".to_owned(),
        _ => "commands here".to_owned(),
    };
    Span::styled(format!(" {text}"), theme.style(Role::Plain))
}
