//! The headline of a page: what must be seen first, in letters as large as the room allows.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;
use tui_big_text::{BigText, PixelSize};

use super::theme::{TextRole, Theme};

/// Columns between two items.
const GAP_COLUMNS: u16 = 2;
/// The headline takes at most this part of the rows.
const SHARE: u16 = 3;
/// From this width on, numbers have decimals.
const LONG_FROM_COLUMNS: u16 = 120;

/// A word or number with its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// What it is and its unit; may be empty.
    pub label: String,
    /// The text, and a shorter one for narrow screens.
    pub text: [String; 2],
    /// The most letters of either, so that nothing moves when a number changes.
    pub letters: [u16; 2],
    pub role: TextRole,
}

/// Size of a letter: columns, rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Size {
    pixels: PixelSize,
    columns: u16,
    rows: u16,
}

/// Largest first.
const SIZES: [Size; 3] = [
    Size { pixels: PixelSize::Full, columns: 8, rows: 8 },
    Size { pixels: PixelSize::HalfHeight, columns: 8, rows: 4 },
    Size { pixels: PixelSize::Quadrant, columns: 4, rows: 4 },
];

/// Draws the items at the top of an area and returns the area below.
pub fn draw(items: &[Item], theme: Theme, frame: &mut Frame, area: Rect) -> Rect {
    let form = usize::from(area.width < LONG_FROM_COLUMNS);
    let labelled = u16::from(items.iter().any(|item| !item.label.is_empty()));
    let most = (area.height / SHARE).max(SIZES[2].rows + labelled);
    let fitting = SIZES.into_iter().find_map(|size| {
        let places = places(items, form, size, labelled, area.width)?;
        let rows = places.last().map_or(0, |(_, y)| y + labelled + size.rows);
        (rows <= most).then_some((size, places, rows))
    });
    let Some((size, places, rows)) = fitting else { return area };
    for (item, (x, y)) in items.iter().zip(places) {
        let width = (item.letters[form] * size.columns).max(item.label.chars().count() as u16);
        let at = Rect { x: area.x + x, y: area.y + y, width, height: labelled + size.rows };
        one(item, form, (size, labelled), theme, frame, at.intersection(area));
    }
    Rect { y: area.y + rows, height: area.height - rows, ..area }
}

/// Where each item begins; `None` if one is wider than the area.
fn places(items: &[Item], form: usize, size: Size, labelled: u16, columns: u16) -> Option<Vec<(u16, u16)>> {
    let (mut x, mut y) = (1, 0);
    let mut places = Vec::new();
    for item in items {
        let width = item.letters[form] * size.columns;
        if x + width > columns && x > 1 {
            (x, y) = (1, y + labelled + size.rows);
        }
        if x + width > columns {
            return None;
        }
        places.push((x, y));
        x += width + GAP_COLUMNS;
    }
    Some(places)
}

fn one(item: &Item, form: usize, (size, labelled): (Size, u16), theme: Theme, frame: &mut Frame, at: Rect) {
    if labelled > 0 {
        let label = Line::styled(item.label.clone(), theme.style(TextRole::Label));
        frame.render_widget(label, Rect { height: 1.min(at.height), ..at });
    }
    let below = Rect { y: at.y + labelled, height: at.height.saturating_sub(labelled), ..at };
    let style = theme.style(item.role);
    let text = &item.text[form];
    if theme.ascii && size.pixels == PixelSize::Quadrant {
        // Quarter blocks cannot be told apart in ASCII.
        let spaced: String = text.chars().flat_map(|c| [c, ' ']).collect();
        let middle = Rect { y: below.y + 1, height: 1, ..below };
        return frame.render_widget(Line::styled(spaced, style), middle.intersection(below));
    }
    let big =
        BigText::builder().pixel_size(size.pixels).style(style).lines([Line::raw(text.clone())]).build();
    frame.render_widget(big, below);
}
