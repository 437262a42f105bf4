//! The pictures: the vehicle from two sides, height over time, the place from above.
//!
//! What was measured is a thick line, what is predicted are dots, limits are thin, everywhere. A
//! picture is drawn in braille dots over its scales; its words are written into cells afterwards,
//! so that no dot hides a letter.

pub mod attitude;
mod field;
pub mod height;
pub mod map;
pub mod qr;

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Position, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::widgets::canvas::{Canvas, Context, Line, Points};

use super::{Ink, TextRole, Theme, shortest, widgets};

/// Braille dots per cell.
const DOTS_ACROSS: f64 = 2.0;
const DOTS_UP: f64 = 4.0;
/// Of so many dots of a dotted line every second pair is drawn: single ones vanish where a line is
/// steep.
const DOT_PERIOD: f64 = 4.0;

/// An area whose cells have places in a plane.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    area: Rect,
    x: [f64; 2],
    y: [f64; 2],
}

impl Plane {
    /// The cell of a place; `None` outside.
    fn cell(&self, x: f64, y: f64) -> Option<(u16, u16)> {
        let share = |value: f64, [low, high]: [f64; 2]| (value - low) / (high - low);
        let (across, up) = (share(x, self.x), share(y, self.y));
        let inside = (0.0..=1.0).contains(&across) && (0.0..=1.0).contains(&up) && !self.area.is_empty();
        inside.then(|| {
            // The cell of the dot that a canvas draws there.
            let cell = |share: f64, cells: u16, dots: f64| {
                (libm::round(share * (f64::from(cells) * dots - 1.0)) / dots) as u16
            };
            let column = cell(across, self.area.width, DOTS_ACROSS);
            (self.area.x + column, self.area.y + cell(1.0 - up, self.area.height, DOTS_UP))
        })
    }

    /// Both axes have the same scale; it reaches at least so far from a place to every side.
    pub fn around(area: Rect, (x, y): (f64, f64), reach: f64) -> Self {
        let (across, up) = (f64::from(area.width) * DOTS_ACROSS, f64::from(area.height) * DOTS_UP);
        let [half_x, half_y] = [across, up].map(|dots| reach * dots / across.min(up));
        Self { area, x: [x - half_x, x + half_x], y: [y - half_y, y + half_y] }
    }

    /// The height of a dot.
    pub fn dot(&self) -> f64 {
        (self.y[1] - self.y[0]) / (f64::from(self.area.height) * DOTS_UP)
    }

    /// Writes a sign or words that begin at a place; moved to the left where they would not fit.
    fn write(&self, frame: &mut Frame, (x, y): (f64, f64), words: &str, style: Style) {
        let length = words.chars().count() as u16;
        let Some((column, row)) = self.cell(x, y).filter(|_| length <= self.area.width) else { return };
        let column = column.min(self.area.right() - length);
        frame.buffer_mut().set_string(column, row, words, style);
    }

    /// Writes the first of some words that has room beside a place, on its row or one near it,
    /// where nothing else stands.
    fn beside(&self, frame: &mut Frame, (x, y): (f64, f64), words: &[String], style: Style) {
        let Some((column, row)) = self.cell(x, y) else { return };
        let buffer = frame.buffer_mut();
        let is_blank = |at: Position| [" ", "\u{2800}"].contains(&buffer[at].symbol());
        let places = words.iter().flat_map(|words| {
            let width = words.chars().count() as u16;
            let columns = [column.checked_sub(width + 1), Some(column + 2), column.checked_sub(width / 2)];
            let rows = (0..4).flat_map(move |k| [row.checked_sub(k), Some(row + k)]);
            let places = rows.flat_map(move |row| columns.map(|column| Some((column?, row?))));
            places.flatten().map(move |(x, y)| (words, Rect { x, y, width, height: 1 }))
        });
        let free = |at: &Rect| self.area.union(*at) == self.area && at.positions().all(is_blank);
        if let Some((words, at)) = places.into_iter().find(|(_, at)| free(at)) {
            buffer.set_string(at.x, at.y, words, style);
        }
    }

    pub fn draw(&self, theme: Theme, frame: &mut Frame, paint: impl Fn(&mut Context)) {
        let canvas = Canvas::default().marker(Marker::Braille).background_color(theme.back());
        frame.render_widget(canvas.x_bounds(self.x).y_bounds(self.y).paint(paint), self.area);
    }

    /// What was measured: a line two dots thick.
    pub fn measured(&self, context: &mut Context, path: &[(f64, f64)], color: Color) {
        for pair in path.windows(2) {
            let ((x1, y1), (x2, y2)) = (pair[0], pair[1]);
            let (dx, dy) = if (x2 - x1).abs() * self.dot_ratio() > (y2 - y1).abs() {
                (0.0, self.dot())
            } else {
                (self.dot() / self.dot_ratio(), 0.0)
            };
            context.draw(&Line { x1, y1, x2, y2, color });
            context.draw(&Line { x1: x1 + dx, y1: y1 + dy, x2: x2 + dx, y2: y2 + dy, color });
        }
    }

    /// What is predicted: dots along a path. Their places do not depend on where it begins, so that
    /// they stand still while time passes, which a slow line can carry.
    fn predicted(&self, context: &mut Context, path: &[(f64, f64)], color: Color) {
        let mut dots = Vec::new();
        let (dot_x, dot_y) = (self.dot() / self.dot_ratio(), self.dot());
        for pair in path.windows(2) {
            let ((x1, y1), (x2, y2)) = (pair[0], pair[1]);
            let (across, up) = ((x2 - x1) / dot_x, (y2 - y1) / dot_y);
            let steps = across.abs().max(up.abs()).ceil().clamp(1.0, 2_000.0);
            for step in 0..steps as usize {
                let share = step as f64 / steps;
                let (x, y) = (x1 + share * (x2 - x1), y1 + share * (y2 - y1));
                let place = if across.abs() >= up.abs() { x / dot_x } else { y / dot_y };
                if place.floor().rem_euclid(DOT_PERIOD) < DOT_PERIOD / 2.0 {
                    dots.push((x, y));
                }
            }
        }
        context.draw(&Points { coords: &dots, color });
    }

    /// How much longer a dot is in the units of y than in those of x.
    fn dot_ratio(&self) -> f64 {
        let across = (self.x[1] - self.x[0]) / (f64::from(self.area.width) * DOTS_ACROSS);
        self.dot() / across
    }
}

/// The points of a circle, so that it can be dotted.
fn circle((x, y): (f64, f64), radius: f64) -> Vec<(f64, f64)> {
    let point = |k: u32| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(k) / 60.0);
        (x + radius * sin, y + radius * cos)
    };
    (0..=60).map(point).collect()
}

/// Columns of the numbers beside a scale.
const SCALE_COLUMNS: u16 = 5;

/// Round numbers from one value to another, in at most this many parts, but two.
pub fn ticks([low, high]: [f64; 2], parts_max: u16) -> Vec<f64> {
    let step = widgets::tick_step(high - low, usize::from(parts_max.max(2)));
    widgets::ticks(low, high, step).collect()
}

/// Draws the scales of a picture of one number over another: ticks with their numbers, and thin
/// lines. Returns the plane inside. `across` are the numbers under it, `up` those at its left.
pub fn scales(
    (x, y): ([f64; 2], [f64; 2]),
    (across, up): (&[f64], &[f64]),
    unit: &str,
    theme: Theme,
    frame: &mut Frame,
    area: Rect,
) -> Plane {
    let inside = Rect {
        x: area.x + SCALE_COLUMNS,
        width: area.width.saturating_sub(SCALE_COLUMNS),
        height: area.height.saturating_sub(1),
        ..area
    };
    let plane = Plane { area: inside, x, y };
    let label = theme.style(TextRole::Label);
    for at in up {
        let Some((_, row)) = plane.cell(x[0], *at) else { continue };
        let text = format!("{:>4}", shortest(*at));
        frame.buffer_mut().set_string(area.x, row, text, label);
        // The ground is a line, the others a tick: a slow line has no bytes for more.
        let line = if *at == 0.0 { "─".repeat(inside.width.into()) } else { "┄".to_owned() };
        frame.buffer_mut().set_string(inside.x, row, line, theme.border());
    }
    let room = inside.width.saturating_sub(unit.chars().count() as u16 + 1);
    for at in across {
        let Some((column, _)) = plane.cell(*at, y[0]) else { continue };
        let text = shortest(*at);
        if column + text.len() as u16 <= inside.x + room {
            frame.buffer_mut().set_string(column, inside.bottom(), text, label);
        }
    }
    frame.buffer_mut().set_string(inside.right() - (inside.width - room) + 1, inside.bottom(), unit, label);
    plane
}

/// A moment in seconds since another, negative before it.
pub fn seconds_since(at: Duration, zero: Duration) -> f64 {
    at.as_secs_f64() - zero.as_secs_f64()
}
