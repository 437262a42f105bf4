//! A figure's legend, in rows below its panels, where it hides nothing.

use plotters::element::Text;

use super::{Area, Drawn, FONT};

/// Width of a letter and of a sample with the room around it, px. SVG does not tell how wide a text is.
const LETTER_PX: i32 = 7;
const SAMPLE_PX: i32 = 26;
const GAP_PX: i32 = 18;
const LEFT_PX: i32 = 16;
const ROW_PX: i32 = 24;
/// Letters of a name that count.
const LONGEST: i32 = 1000;

/// Names at their places.
pub(super) struct Legend {
    names: Vec<String>,
    /// Left end and middle of each name's sample, px.
    places: Vec<(i32, i32)>,
}

impl Legend {
    /// Names in rows of a width, px.
    pub(super) fn new(names: Vec<String>, width_px: u32) -> Self {
        let (mut left_px, mut row) = (LEFT_PX, 0);
        let mut place = |name: &String| {
            let letters = i32::try_from(name.chars().count()).unwrap_or(LONGEST).min(LONGEST);
            let entry_px = SAMPLE_PX + LETTER_PX * letters + GAP_PX;
            if left_px > LEFT_PX && left_px + entry_px > width_px.cast_signed() {
                (left_px, row) = (LEFT_PX, row + 1);
            }
            let place = (left_px, row * ROW_PX + ROW_PX / 2);
            left_px += entry_px;
            place
        };
        let places = names.iter().map(&mut place).collect();
        Self { names, places }
    }

    /// Height of all rows, px.
    pub(super) fn height_px(&self) -> u32 {
        let last = self.places.last().map_or(0, |(_, middle)| middle + ROW_PX / 2);
        last as u32 + ROW_PX as u32 / 2
    }

    /// Draws every name behind what `sample` draws for it from a place, px.
    pub(super) fn draw(
        &self,
        area: &Area<'_>,
        mut sample: impl FnMut(&Area<'_>, usize, (i32, i32)) -> Drawn,
    ) -> Drawn {
        for (entry, (name, (left, middle))) in self.names.iter().zip(&self.places).enumerate() {
            sample(area, entry, (*left, *middle))?;
            area.draw(&Text::new(name.clone(), (left + SAMPLE_PX, middle - 7), FONT))?;
        }
        Ok(())
    }
}
