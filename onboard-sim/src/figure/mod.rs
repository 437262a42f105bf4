//! Figures as SVG, drawn with `plotters`: the best kept plotting crate that writes SVG without fonts, images or a browser
//! (three small crates, 6 s of a build); ticks, axes and escaping are its own.

mod cells;
mod legend;
mod lines;
mod places;

use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea as _};
use plotters::style::{RGBColor, WHITE};

pub use cells::{CellAxis, Cells, cells_svg};
pub use lines::{Line, Panel, lines_svg};
pub use places::{Places, places_svg};

/// A figure cannot be drawn: its axes are not finite, or too small for their labels.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot draw the figure '{title}': {reason}")]
pub struct FigureError {
    title: String,
    reason: String,
}

/// Okabe and Ito's colours that differ for every kind of colour vision, and in grey.
const COLOURS: [RGBColor; 5] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
];

/// Font and size, px, of titles and of everything else.
const TITLE_FONT: (&str, i32) = ("sans-serif", 18);
const FONT: (&str, i32) = ("sans-serif", 13);

/// Height of the title, px.
const TITLE_PX: u32 = 34;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

/// The SVG of what a function draws on a white ground of this size, px, below a title.
fn drawn(
    title: &str,
    size_px: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<String, FigureError> {
    let mut svg = String::new();
    let (width_px, height_px) = size_px;
    let all = || -> Drawn {
        let root = SVGBackend::with_string(&mut svg, (width_px, TITLE_PX + height_px)).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root.titled(title, TITLE_FONT)?)?;
        root.present()?;
        Ok(())
    };
    all().map_err(|error| FigureError { title: title.to_owned(), reason: error.to_string() })?;
    Ok(svg)
}

/// Writes a tick with the decimals that its axis needs.
fn number((from, to): (f64, f64)) -> impl Fn(&f64) -> String {
    let decimals = (1.0 - libm::floor(libm::log10((to - from) / 2.0))).clamp(0.0, 6.0) as usize;
    move |value| {
        let text = format!("{value:.decimals$}");
        let short = if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        if short == "-0" { "0".to_owned() } else { short.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_the_decimals_of_their_axis() {
        assert_eq!(number((0.0, 5.0))(&2.5), "2.5");
        assert_eq!(number((0.0, 5.0))(&-0.0), "0");
        assert_eq!(number((0.0, 300.0))(&120.0), "120");
        assert_eq!(number((-0.02, 0.02))(&0.005), "0.005");
    }
}
