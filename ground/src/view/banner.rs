//! The largest words of every page, when people may be in danger or have waited for the word: DO NOT APPROACH, MAY BE
//! APPROACHED, MAY BE IN THE AIR, LOST. While they stand, no page shows a headline of its own.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;

use super::draw_line;
use super::headline::{self, Item};
use super::number::STALE_MARK;
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::dead_reckoning::may_have_left;
use crate::model::ending::Ending;
use crate::model::motor::Approach;
use crate::model::place::Spot;

/// What is said of a vehicle that may have left the pad unheard.
pub const MAY_FLY: &str = "MAY BE IN THE AIR";

/// The words, and a line that gives the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Banner {
    pub words: &'static str,
    /// The beginning of the line: how the flight ended, and the words as text.
    lead: String,
    /// Its end: for how long, and why.
    rest: String,
    pub role: TextRole,
}

/// The present words; `None` on the pad and in flight, as long as all is as planned.
pub fn of(model: &Model, now: Duration) -> Option<Banner> {
    let vehicle = &model.vehicle;
    let ending = Ending::of(vehicle, now);
    if let Some(approach) = Approach::of(vehicle, now) {
        let stale = vehicle.status.as_ref().is_some_and(|status| status.is_stale(now));
        let mark = if stale { STALE_MARK } else { " " };
        let ending = ending.map_or_else(String::new, |ending| format!("{}; ", ending.word()));
        let role = match approach {
            Approach::DoNot(_) => TextRole::Alarm,
            Approach::May(_) => TextRole::Good,
        };
        let words = approach.headline();
        let lead = format!("{mark}{ending}{}", words.to_lowercase());
        return Some(Banner { words, lead, rest: approach.reason(), role });
    }
    if ending.is_none()
        && let Some(since) = may_have_left(vehicle, now)
    {
        return Some(may_fly(model, since));
    }
    ending.filter(|ending| *ending == Ending::Lost)?;
    let words = Ending::Lost.word();
    let rest = format!("{}: do not approach", Ending::Lost.detail(vehicle));
    Some(Banner { words, lead: format!(" {words}"), rest, role: TextRole::Alarm })
}

/// Since when, and where it is meant to come down.
fn may_fly(model: &Model, since: Duration) -> Banner {
    let left_s = model.vehicle.countdown_s().map_or(0.0, |left| left.value);
    let place = match model.meant_to_come_down() {
        Some(Spot { north_m, east_m, error_m }) if libm::hypot(north_m, east_m) < 1.0 => {
            format!("meant to land within {error_m:.0} m of the pad")
        }
        Some(Spot { north_m, east_m, error_m }) => {
            format!("meant to land {north_m:.0} m N, {east_m:.0} m E, within {error_m:.0} m")
        }
        None => "where is not told".to_owned(),
    };
    let since_s = since.as_secs_f64();
    let rest = format!(" since T+{since_s:.1} s, not heard since T-{left_s:.1} s; {place}");
    Banner { words: MAY_FLY, lead: String::new(), rest, role: TextRole::Alarm }
}

impl Banner {
    /// The line above the large words, which also says them as text.
    pub fn reason(&self) -> String {
        format!("{}{}", self.lead, self.rest)
    }

    /// The words and the reason in one line, for small screens and without a screen.
    pub fn sentence(&self) -> String {
        format!("{}{}", self.words, self.rest)
    }
}

/// Draws the reason and, in letters as large as the room allows, the words. Returns the area below.
pub fn draw(banner: &Banner, theme: Theme, frame: &mut Frame, area: Rect) -> Rect {
    let reason = Line::styled(banner.reason(), theme.style(banner.role));
    draw_line(frame, area, reason);
    let below = Rect { y: area.y + area.height.min(1), height: area.height.saturating_sub(1), ..area };
    let words = banner.words.to_owned();
    let letters = u16::try_from(words.chars().count()).unwrap_or(u16::MAX);
    let item =
        Item { label: String::new(), text: [words.clone(), words], letters: [letters; 2], role: banner.role };
    headline::draw(&[item], theme, frame, below)
}
