//! The pages: of panels, or of lines.

pub mod checks;
pub mod flight;
pub mod link;
pub mod lists;
pub mod pad;
pub mod plot;
pub mod review;

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length, Percentage};
use ratatui::layout::{Margin, Rect};
use ratatui::text::Line;

use super::band::Room;
use super::pictures::attitude::Side;
use super::shared::{FROM_ABOVE, events, height, map, vehicle};
use super::widgets::{columns, framed, rows};
use super::{Theme, bars, draw_lines};
use crate::model::{Model, Page, flight_began};

/// Draws the present page between the top lines and the alarm line. Returns where the pictures of a
/// flight are.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) -> Option<Rect> {
    let page = model.page();
    match page {
        Page::Ascent | Page::Descent | Page::Landing => {
            return Some(flight::draw_flying(model, theme, now, frame, area));
        }
        Page::Pad if model.vehicle.as_foreign().is_none() => pad::draw_pad(model, theme, now, frame, area),
        Page::Review => review::draw_review(model, theme, now, frame, area),
        Page::Plot => plot::draw_plot_page(model, theme, now, frame, area),
        Page::Find => checks::draw_find(model, theme, now, frame, area),
        _ => return draw_list(model, theme, now, frame, area),
    }
    None
}

/// Columns of the tables of link and checks beside their pictures.
const TABLE_COLUMNS: u16 = 80;
/// Rows of the bars of fins and gimbal, with their borders.
const BARS_ROWS: u16 = 8;
/// Rows of the newest events under a list, with their borders, at least.
const EVENTS_ROWS: u16 = 5;

/// A page of lines, with the newest events under a short one. A larger screen has pictures beside
/// it; returns where.
fn draw_list(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) -> Option<Rect> {
    let page = model.page();
    let has_pictures = Room::of(frame.area()) != Room::Small;
    let part = if matches!(page, Page::Link | Page::Checks) { Length(TABLE_COLUMNS) } else { Percentage(60) };
    let [area, right] = columns(area, if has_pictures { [part, Fill(1)] } else { [Fill(1), Length(1)] });
    if has_pictures {
        // A check moves fins and gimbal, and on the pad there is no flight to show.
        let is_check = page == Page::Checks;
        let [above, below] = rows(right, [Fill(1), if is_check { Length(BARS_ROWS) } else { Fill(1) }]);
        if is_check || flight_began(model).is_none() {
            vehicle(model, &[Side::South, Side::East], theme, now, frame, above);
        } else {
            height(model, theme, now, frame, above);
        }
        if is_check {
            bars::draw_surfaces(model, theme, now, frame, below);
        } else {
            map(FROM_ABOVE, model, theme, now, frame, below);
        }
    }
    let lines = lines(model, theme, now, area.inner(Margin::new(1, 1)));
    let room = (area.height + 1).saturating_sub(lines.len() as u16 + 2);
    // These two list the events themselves.
    let has_events = room >= EVENTS_ROWS && !matches!(page, Page::Messages | Page::Pad);
    let [list, below] = rows(area, [Fill(1), Length(if has_events { room } else { 1 })]);
    let beside = if page == Page::Checks { checks::supply(model, theme) } else { Line::default() };
    let inside = framed(page.name(), beside, theme, frame, list);
    draw_lines(frame, inside, &lines);
    if has_events {
        events(model, theme, frame, below);
    }
    has_pictures.then_some(right)
}

/// A page of lines, which also a small terminal shows; instead of a page of panels the newest
/// events.
pub fn lines(model: &Model, theme: Theme, now: Duration, area: Rect) -> Vec<Line<'static>> {
    let (columns, rows) = (usize::from(area.width), usize::from(area.height));
    match model.page() {
        Page::Link => link::lines(model, theme, now, columns, rows),
        Page::Messages => lists::messages_lines(model, theme, columns, rows),
        Page::Log => lists::log_lines(model, theme),
        Page::Alarms => lists::alarms(model, theme, now, columns, rows),
        Page::Find => checks::find_lines(model, theme, now),
        Page::Checks => checks::checks_lines(model, theme, now, columns),
        Page::Help => lists::help_lines(model, theme, now, columns),
        _ => super::lists::events(model, theme, columns, rows),
    }
}
