//! The band of a page: the one number or word of the present moment in large letters, and beside it two or three others.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;
use tui_big_text::{BigText, PixelSize};

use super::theme::Ink;
use super::{STALE_MARK, TextRole, Theme, draw_line, fixed};
use crate::model::Sample;

/// Rows of the band on a small, a middling and a large screen.
const ROWS: [u16; 3] = [6, 7, 9];
/// From these columns and rows on a screen counts as middling, and as large.
const MIDDLING: (u16, u16) = (116, 34);
const LARGE: (u16, u16) = (180, 46);
/// Columns between two numbers, at least.
const GAP: u16 = 2;

/// How large the screen of a page is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Room {
    Small,
    Middling,
    Large,
}

impl Room {
    pub fn of(area: Rect) -> Self {
        let holds = |(columns, rows)| area.width >= columns && area.height >= rows;
        match () {
            () if holds(LARGE) => Self::Large,
            () if holds(MIDDLING) => Self::Middling,
            () => Self::Small,
        }
    }
}

/// A word or number with its name.
#[derive(Debug, Clone)]
pub struct Item {
    /// What it is and its unit; may be empty.
    pub label: String,
    pub text: String,
    /// The most letters, so that nothing moves when a number changes.
    letters: u16,
    pub role: TextRole,
    /// A prediction has its colour.
    is_predicted: bool,
}

/// A word, and what it is, in so many letters.
pub fn word(label: &str, text: &str, letters: u16, role: TextRole) -> Item {
    let (label, text) = (label.to_owned(), text.to_owned());
    Item { label, text, letters, role, is_predicted: false }
}

/// A number with its name and unit; the name of a stale one is marked.
pub fn number(
    label: &str,
    sample: Option<Sample<f64>>,
    decimals: usize,
    letters: u16,
    now: Duration,
) -> Item {
    let (mark, role) = match sample {
        None => ("", TextRole::Label),
        Some(sample) if sample.is_stale(now) => (STALE_MARK, TextRole::Stale),
        Some(_) => ("", TextRole::Title),
    };
    let text = |decimals| sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, decimals));
    // A number too long for its place loses its decimals, never its first digits.
    let fits = |text: &String| text.len() <= usize::from(letters);
    let text = Some(text(decimals)).filter(fits).or_else(|| Some(text(0)).filter(fits));
    let text = text.unwrap_or_else(|| "many".to_owned());
    Item { label: format!("{mark}{label}"), text, letters, role, is_predicted: false }
}

impl Item {
    #[must_use]
    pub fn predicted(self) -> Self {
        Self { is_predicted: true, ..self }
    }
}

/// Size of a letter: columns, rows.
#[derive(Debug, Clone, Copy)]
struct Size {
    pixels: PixelSize,
    columns: u16,
    rows: u16,
}

const LARGEST: Size = Size { pixels: PixelSize::Full, columns: 8, rows: 8 };
const WIDE: Size = Size { pixels: PixelSize::HalfHeight, columns: 8, rows: 4 };
const NARROW: Size = Size { pixels: PixelSize::Quadrant, columns: 4, rows: 4 };

/// Draws the main item at the left with the line under it, the others to its right, and returns the area below.
pub fn draw_band(
    (main, below, others): (&Item, Line<'static>, &[Item]),
    theme: Theme,
    frame: &mut Frame,
    area: Rect,
) -> Rect {
    let room = Room::of(frame.area());
    let rows = ROWS[room as usize].min(area.height);
    let band = Rect { height: rows, ..area };
    let rest = Rect { y: area.y + rows, height: area.height - rows, ..area };
    frame.buffer_mut().set_style(band, theme.raised());
    if rows < ROWS[0] {
        return rest;
    }
    let (size, other_size) = match room {
        Room::Large => (LARGEST, WIDE),
        Room::Middling | Room::Small => (WIDE, NARROW),
    };
    let others_columns: u16 = others.iter().map(|item| width(item, other_size) + GAP).sum();
    let size = [size, WIDE, NARROW]
        .into_iter()
        .find(|size| 1 + main.letters * size.columns + GAP + others_columns <= area.width)
        .unwrap_or(NARROW);
    letters(main, size, theme, frame, Rect { x: band.x + 1, width: band.width - 1, ..band });
    draw_line(frame, Rect { x: band.x, y: band.bottom() - 1, height: 1, ..band }, below);
    let begin = 1 + (main.letters * size.columns).max(main.label.chars().count() as u16) + GAP;
    let spare = area.width.saturating_sub(begin + others_columns);
    let gap = GAP + spare / (others.len() as u16 + 1);
    let mut x = area.x + begin + spare / (others.len() as u16 + 1);
    for item in others {
        let columns = width(item, other_size);
        let at = Rect { x, width: columns, ..band }.intersection(band);
        letters(item, other_size, theme, frame, at);
        x += columns + gap;
    }
    rest
}

/// Draws a word as large as the area allows. Returns the rows taken.
pub fn draw_word(item: &Item, theme: Theme, frame: &mut Frame, area: Rect) -> u16 {
    let fits = |size: &Size| item.letters * size.columns < area.width && size.rows * 5 <= area.height;
    let size = [LARGEST, WIDE, NARROW].into_iter().find(fits).unwrap_or(NARROW);
    let rows = size.rows.min(area.height);
    big(
        item,
        size,
        theme,
        frame,
        Rect { x: area.x + 1, width: area.width.saturating_sub(1), height: rows, ..area },
    );
    rows
}

fn width(item: &Item, size: Size) -> u16 {
    (item.letters * size.columns).max(item.label.chars().count() as u16)
}

fn letters(item: &Item, size: Size, theme: Theme, frame: &mut Frame, at: Rect) {
    draw_line(
        frame,
        at,
        Line::styled(item.label.clone(), theme.raised().patch(theme.style(TextRole::Label))),
    );
    let below = Rect { y: at.y + 1, height: at.height.saturating_sub(1).min(size.rows), ..at };
    big(item, size, theme, frame, below);
}

fn big(item: &Item, size: Size, theme: Theme, frame: &mut Frame, at: Rect) {
    let mut style = theme.style(item.role);
    if item.is_predicted && item.role == TextRole::Title {
        style = style.fg(theme.ink(Ink::Predicted));
    }
    if theme.ascii && size.pixels == PixelSize::Quadrant {
        // Quarter blocks cannot be distinguished in ASCII.
        let spaced: String = item.text.chars().flat_map(|c| [c, ' ']).collect();
        let middle = Rect { y: at.y + 1, height: 1, ..at };
        return frame.render_widget(Line::styled(spaced, style), middle.intersection(at));
    }
    let line = Line::raw(item.text.clone());
    let big = BigText::builder().pixel_size(size.pixels).style(style).lines([line]).build();
    frame.render_widget(big, at);
}
