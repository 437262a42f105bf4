//! A bar for each limit of a touchdown: how much of the limit is used.

use ratatui::text::Span;

use protocol::dialect::TD_TOUCHDOWN_LIMITS_DATA;

use super::theme::{TextRole, Theme};
use crate::model::touchdown::Touchdown;

/// The least columns of a bar with its brackets.
pub const COLUMNS_MIN: usize = 6;
/// A cell filled from the left, in eighths.
const EIGHTHS: [char; 8] = [' ', '▏', '▎', '▍', '▌', '▋', '▊', '▉'];
/// The most columns: a longer one says no more.
const COLUMNS_MAX: usize = 24;

/// How much of each limit is used, in the order of the rows: 0 for a perfect landing, 1 at the limit.
pub fn used(touchdown: &Touchdown, limits: &TD_TOUCHDOWN_LIMITS_DATA) -> [f64; 6] {
    let share = |value: f64, most: f32| value.abs() / f64::from(most);
    // From the ground towards the edge on its side; one edge may be the ground itself.
    let edge_m = if touchdown.altitude_m < 0.0 { limits.altitude_min_m } else { limits.altitude_max_m };
    [
        share(touchdown.x_m, limits.x_m),
        if touchdown.altitude_m.abs() > 0.0 { share(touchdown.altitude_m, edge_m.abs()) } else { 0.0 },
        share(touchdown.pitch_rad - std::f64::consts::FRAC_PI_2, limits.pitch_error_rad),
        share(touchdown.u_m_s, limits.u_m_s),
        share(touchdown.w_m_s, limits.w_m_s),
        share(touchdown.q_rad_s, limits.q_rad_s),
    ]
}

/// A bar of this many columns; beyond the limit it ends in `>`. It has one colour and blanks: six of them with more are
/// too much for a slow line when the page changes.
pub fn bar(used: f64, columns: usize, theme: Theme) -> Span<'static> {
    let cells = columns.min(COLUMNS_MAX).saturating_sub(3);
    // Not finite: the vehicle has sent no such limit.
    let (share, end, role) = match used {
        used if !used.is_finite() => (0.0, "?", TextRole::Label),
        used if used > 1.0 => (1.0, ">", TextRole::Alarm),
        used => (used, "]", TextRole::Plain),
    };
    // A short bar still shows eighths of a cell, where the terminal has them.
    let steps = if theme.ascii { 1 } else { EIGHTHS.len() };
    let filled = ((share * (cells * steps) as f64).round() as usize).min(cells * steps);
    let mut text = "█".repeat(filled / steps);
    if !filled.is_multiple_of(steps) {
        text.push(EIGHTHS[filled % steps]);
    }
    Span::styled(format!(" [{text:<cells$}{end}"), theme.style(role))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::theme::Palette;
    use protocol::dialect::TdLimit;

    fn text(used: f64, columns: usize) -> String {
        let theme = Theme { palette: Palette::None, ascii: false };
        bar(used, columns, theme).content.into_owned()
    }

    #[test]
    fn a_bar_is_full_at_the_limit_and_pointed_beyond_it() {
        assert_eq!(text(0.0, 13), " [          ]");
        assert_eq!(text(0.5, 13), " [█████     ]");
        assert_eq!(text(0.5, 6), " [█▌ ]");
        assert_eq!(text(0.04, 6), " [▏  ]");
        assert_eq!(text(1.0, 13), " [██████████]");
        assert_eq!(text(1.01, 13), " [██████████>");
        assert_eq!(text(f64::NAN, 8), " [     ?");
        for columns in 0..40 {
            for used in [0.0, 0.3, 7.0, f64::INFINITY] {
                assert!(text(used, columns).chars().count() <= columns.max(3), "{columns}");
            }
        }
    }

    #[test]
    fn every_limit_is_used_from_a_perfect_landing_to_its_edge() {
        let limits = TD_TOUCHDOWN_LIMITS_DATA {
            x_m: 3.0,
            altitude_min_m: -0.1,
            altitude_max_m: 0.3,
            pitch_error_rad: 0.1,
            u_m_s: 1.5,
            w_m_s: 0.6,
            q_rad_s: 0.2,
            gimbal_limit_rad: 0.1,
        };
        let at = |x_m, altitude_m, pitch_rad, u_m_s, w_m_s, q_rad_s| {
            let violated = TdLimit::empty();
            used(&Touchdown { x_m, altitude_m, pitch_rad, u_m_s, w_m_s, q_rad_s, violated }, &limits)
        };
        let upright = std::f64::consts::FRAC_PI_2;
        let close = |found: [f64; 6], expected: f64| found.iter().all(|used| (used - expected).abs() < 1e-6);
        assert!(close(at(0.0, 0.0, upright, 0.0, 0.0, 0.0), 0.0));
        assert!(close(at(-3.0, -0.1, upright - 0.1, -1.5, 0.6, -0.2), 1.0));
        assert!(close(at(6.0, 0.6, upright + 0.2, 3.0, 1.2, 0.4), 2.0));
    }
}
