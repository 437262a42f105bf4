//! The lines of the launch field on the map.

use protocol::field::Kind;
use ratatui::widgets::canvas::{Context, Line};

use super::{Ink, Theme};

/// Draws lines of points east and north of the pad, m: the crowd line as a limit, everything else
/// like the ground.
pub(super) fn draw_lines(context: &mut Context, lines: &[(Kind, Vec<(f64, f64)>)], theme: Theme) {
    for (kind, points) in lines {
        let color = theme.ink(if *kind == Kind::CrowdLine { Ink::Limit } else { Ink::Scale });
        for pair in points.windows(2) {
            let ((x1, y1), (x2, y2)) = (pair[0], pair[1]);
            context.draw(&Line { x1, y1, x2, y2, color });
        }
    }
}
