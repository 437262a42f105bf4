//! The headline of a page: what must be seen first, in letters as large as the room allows.

use std::time::Duration;

use protocol::dialect::TdPhase;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;
use tui_big_text::{BigText, PixelSize};

use super::top_lines::readiness;
use super::{STALE_MARK, TextRole, Theme, age_mark, fixed};
use crate::model::{
    Approach, Ending, Model, Page, Sample, Spot,
    dead_reckoning::{is_unheard, may_have_left, predict_position},
    hold_words, is_liftoff_by_itself, is_on_pad,
};

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
pub fn draw_headline(items: &[Item], theme: Theme, frame: &mut Frame, area: Rect) -> Rect {
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
        let label = theme.line(item.label.clone(), TextRole::Label);
        frame.render_widget(label, Rect { height: 1.min(at.height), ..at });
    }
    let below = Rect { y: at.y + labelled, height: at.height.saturating_sub(labelled), ..at };
    let style = theme.style(item.role);
    let text = &item.text[form];
    if theme.ascii && size.pixels == PixelSize::Quadrant {
        // Quarter blocks cannot be distinguished in ASCII.
        let spaced: String = text.chars().flat_map(|c| [c, ' ']).collect();
        let middle = Rect { y: below.y + 1, height: 1, ..below };
        return frame.render_widget(Line::styled(spaced, style), middle.intersection(below));
    }
    let big =
        BigText::builder().pixel_size(size.pixels).style(style).lines([Line::raw(text.clone())]).build();
    frame.render_widget(big, below);
}

// The largest words of every page, when people may be in danger or have waited for the word: DO NOT APPROACH, ONE
// PERSON: PIN IN, MAY BE APPROACHED, LIFT-OFF, MAY BE IN THE AIR, LOST. While they stand, no page shows a headline of its own.

/// What is said of a vehicle that has left the pad, and nobody commanded it.
const LIFT_OFF: &str = "LIFT-OFF";
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
    /// Whether it is about approaching a vehicle that is down.
    is_of_approach: bool,
}

/// The present words; `None` on the pad and in flight, as long as all is as planned.
pub fn banner(model: &Model, now: Duration) -> Option<Banner> {
    let vehicle = &model.vehicle;
    let ending = Ending::of(vehicle, now);
    if let Some(approach) = Approach::of(vehicle, now) {
        let stale = vehicle.status.as_ref().is_some_and(|status| status.is_stale(now));
        let mark = if stale { STALE_MARK } else { " " };
        let ending = ending.map_or_else(String::new, |ending| format!("{}; ", ending.word()));
        let role = match approach {
            Approach::DoNot(_) => TextRole::Alarm,
            Approach::OneForThePin(_) => TextRole::Caution,
            Approach::May(_) => TextRole::Good,
        };
        let words = approach.headline();
        let lead = format!("{mark}{ending}{}", words.to_lowercase());
        return Some(Banner { words, lead, rest: approach.reason(), role, is_of_approach: true });
    }
    if ending.is_none() && may_have_left(vehicle, now).is_some() {
        return Some(may_fly(model));
    }
    if is_liftoff_by_itself(vehicle) {
        let rest = " that nobody commanded: TAKE COVER, look up".to_owned();
        let lead = format!(" {LIFT_OFF}");
        return Some(Banner { words: LIFT_OFF, lead, rest, role: TextRole::Alarm, is_of_approach: false });
    }
    ending.filter(|ending| *ending == Ending::Lost)?;
    let words = Ending::Lost.word();
    let rest = format!("{}: do not approach", Ending::Lost.detail(vehicle));
    Some(Banner { words, lead: format!(" {words}"), rest, role: TextRole::Alarm, is_of_approach: false })
}

/// Since when, and where it is meant to come down. The moment stands still; the clock in the line above runs.
fn may_fly(model: &Model) -> Banner {
    let left_s = model.vehicle.countdown_s().map_or(0.0, |left| left.value);
    let place = match model.meant_to_come_down() {
        Some(Spot { north_m, east_m, error_m }) if libm::hypot(north_m, east_m) < 1.0 => {
            format!("meant to land within {error_m:.0} m")
        }
        Some(Spot { north_m, east_m, error_m }) => {
            format!("meant {north_m:.0} m N, {east_m:.0} m E, within {error_m:.0} m")
        }
        None => "where is not told".to_owned(),
    };
    let rest = format!(" since T-0, unheard from T-{left_s:.1} s; {place}");
    Banner { words: MAY_FLY, lead: format!(" {MAY_FLY}"), rest, role: TextRole::Alarm, is_of_approach: false }
}

impl Banner {
    /// The line above the large words, which also says them as text.
    pub fn reason(&self) -> String {
        format!("{}{}", self.lead, self.rest)
    }

    /// Whether the words stand in large letters on this page. The others keep their rows; the line stands on every page.
    pub fn is_large_on(&self, page: Page) -> bool {
        let of_a_phase = matches!(page, Page::Ascent | Page::Descent | Page::Landing);
        matches!(page, Page::Pad | Page::Review) || (of_a_phase && !self.is_of_approach)
    }

    /// The words and the reason in one line, for small screens and without a screen.
    pub fn sentence(&self) -> String {
        format!("{}{}", self.words, self.rest)
    }
}

/// Draws the words in letters as large as the room allows. Returns the area below.
pub fn draw_banner(banner: &Banner, theme: Theme, frame: &mut Frame, area: Rect) -> Rect {
    let letters = u16::try_from(banner.words.chars().count()).unwrap_or(u16::MAX);
    draw_headline(&[word("", banner.words, letters, banner.role)], theme, frame, area)
}

/// What a page shows largest; nothing while larger words stand above every page.
pub fn headline(model: &Model, now: Duration, of_page: fn(&Model, Duration) -> Vec<Item>) -> Vec<Item> {
    let large = banner(model, now).is_some_and(|banner| banner.is_large_on(model.page()));
    if large { Vec::new() } else { of_page(model, now) }
}

// What each page shows largest: on the pad GO or NO-GO, in flight phase, height, speed and time, in the burn the time
// to touchdown and the predicted speed, at the end the verdict.

/// The most letters of a word on the pad, as in `NO DATA`.
const PAD_LETTERS: u16 = 8;

/// Whether the vehicle may be armed; on the way to the start, how far it is.
pub fn pad_headline(model: &Model, now: Duration) -> Vec<Item> {
    let (text, role) = pad_word(model, now);
    vec![word("", &text, PAD_LETTERS, role)]
}

fn pad_word(model: &Model, now: Duration) -> (String, TextRole) {
    let vehicle = &model.vehicle;
    let word = |text: &str, role| (text.to_owned(), role);
    if vehicle.as_foreign().is_some() {
        return word("NOT OURS", TextRole::Alarm);
    }
    let Some(status) = vehicle.status.as_ref().filter(|status| !status.is_stale(now)) else {
        return word("NO DATA", TextRole::Caution);
    };
    if !is_on_pad(status.value.phase) {
        return word("FLIGHT", TextRole::Title);
    }
    if hold_words(vehicle, model.link.uplink.armed_by_us).is_some() {
        return word("HOLD", TextRole::Alarm);
    }
    if let Some(left) = vehicle.countdown_s().filter(|left| left.value > 0.0) {
        return (format!("T-{}", fixed(left.value, 1)), TextRole::Alarm);
    }
    if vehicle.is_armed() {
        return word("ARMED", TextRole::Alarm);
    }
    match readiness(model, now) {
        Some((_, TextRole::Good)) => word("GO", TextRole::Good),
        _ => word("NO-GO", TextRole::Caution),
    }
}

/// After a loss of the link in flight: the predicted height instead of an old one, its error, and the silence.
fn lost(model: &Model, now: Duration) -> Vec<Item> {
    let at = predict_position(&model.vehicle, now);
    let sample = |value: f64| Some(Sample::new(value, now));
    let silence_s = model.vehicle.best_motion().map(|motion| motion.age(now).as_secs_f64());
    vec![
        word("link", "LOST", 5, TextRole::Alarm),
        number("PREDICTED m up", at.and_then(|at| sample(at.altitude_m)), [0, 0], [5, 4], now),
        number("error m", at.and_then(|at| sample(at.error_m)), [0, 0], [5, 4], now),
        number("silent s", silence_s.and_then(sample), [0, 0], [4, 4], now),
    ]
}

/// Phase, height, vertical speed and time since release.
pub fn flight_headline(model: &Model, now: Duration) -> Vec<Item> {
    let vehicle = &model.vehicle;
    if is_unheard(vehicle, now) {
        return lost(model, now);
    }
    let phase = vehicle.phase();
    let (mark, role) = phase.map_or((" ", TextRole::Label), |phase| age_mark(&phase, now));
    let word = phase.map_or("--", |phase| phase_word(phase.value));
    let role = if role == TextRole::Stale { role } else { TextRole::Title };
    vec![
        Item {
            label: format!("{}phase", mark.trim()),
            text: [word.to_owned(), word.to_owned()],
            letters: [8, 7],
            role,
        },
        number("height m", vehicle.height_m(), [1, 0], [5, 4], now),
        number("vertical m/s", vehicle.vertical_m_s(), [1, 0], [6, 4], now),
        number("T s", vehicle.countdown_s().map(|left| left.map(|s| -s)), [1, 0], [5, 3], now),
    ]
}

/// Time to touchdown and its predicted speed; height and vertical speed.
pub fn burn_headline(model: &Model, now: Duration) -> Vec<Item> {
    let vehicle = &model.vehicle;
    if is_unheard(vehicle, now) {
        return lost(model, now);
    }
    vec![
        number("touchdown in s", vehicle.touchdown_in_s(now), [1, 1], [4, 4], now),
        number("lands at m/s", vehicle.predicted_speed_m_s(), [2, 1], [5, 4], now),
        number("height m", vehicle.height_m(), [1, 1], [5, 5], now),
        number("vertical m/s", vehicle.vertical_m_s(), [1, 1], [5, 5], now),
    ]
}

/// The verdict.
pub fn verdict_headline(model: &Model, now: Duration) -> Vec<Item> {
    let (text, role) = match Ending::of(&model.vehicle, now) {
        Some(Ending::Landed) => ("LANDED", TextRole::Good),
        Some(Ending::UnderParachute) => ("PARACHUTE", TextRole::Caution),
        Some(Ending::Hard) => ("HARD", TextRole::Alarm),
        Some(Ending::Lost) => ("LOST", TextRole::Alarm),
        None => ("NO VERDICT", TextRole::Caution),
    };
    vec![word("", text, 10, role)]
}

/// One word for what the vehicle does; its exact phase is in the top lines.
fn phase_word(phase: TdPhase) -> &'static str {
    match phase {
        TdPhase::TD_PHASE_SAFE | TdPhase::TD_PHASE_SAFED => "SAFE",
        TdPhase::TD_PHASE_PAD_IDLE => "PAD",
        TdPhase::TD_PHASE_PAD_ARMED => "ARMED",
        TdPhase::TD_PHASE_BOOST => "BOOST",
        TdPhase::TD_PHASE_COAST => "COAST",
        TdPhase::TD_PHASE_DEPLOY => "FINS",
        TdPhase::TD_PHASE_AERO_DESCENT | TdPhase::TD_PHASE_LAND_ARMED => "DESCENT",
        TdPhase::TD_PHASE_IGNITION => "IGNITE",
        TdPhase::TD_PHASE_POWERED => "BURN",
        TdPhase::TD_PHASE_TOUCHDOWN => "DOWN",
        TdPhase::TD_PHASE_CHUTE => "CHUTE",
    }
}

/// A word, and what it is, in so many letters.
fn word(label: &str, text: &str, letters: u16, role: TextRole) -> Item {
    Item { label: label.to_owned(), text: [text.to_owned(), text.to_owned()], letters: [letters; 2], role }
}

/// A number with its name and unit; the name of a stale one is marked.
fn number(
    label: &str,
    sample: Option<Sample<f64>>,
    decimals: [usize; 2],
    letters: [u16; 2],
    now: Duration,
) -> Item {
    let (mark, role) = match sample {
        None => ("", TextRole::Label),
        Some(sample) if sample.is_stale(now) => (STALE_MARK, TextRole::Stale),
        Some(_) => ("", TextRole::Title),
    };
    let text = |form: usize| {
        let text = sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, decimals[form]));
        // A number too long for its place loses its decimals, never its first digits.
        if text.len() <= usize::from(letters[form]) {
            return text;
        }
        let whole = sample.map_or_else(String::new, |sample| fixed(sample.value, 0));
        if whole.len() <= usize::from(letters[form]) { whole } else { "many".to_owned() }
    };
    Item { label: format!("{mark}{label}"), text: [text(0), text(1)], letters, role }
}
