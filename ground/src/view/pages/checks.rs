//! The page of the checks on the pad (every value with its limits, the radio range test, battery and storage), and the
//! page that helps to find the vehicle.

use std::time::Duration;

use protocol::dialect::{TD_PAD_CHECK_DATA, TdPadCheckItem, TdPadCheckState, TdPadCheckVerdict};
use ratatui::text::{Line, Span};

use crate::model::{
    Act, LOSS_MOST, LastPlace, MARGIN_LEAST_DB, Model, PadCheck, RangeTest, RangeTestResult, SURFACES, Spot,
    Standing, dead_reckoning::may_have_left, shown, standing,
};
use crate::view::{TextRole, Theme, fixed, seconds};

/// Columns of one value beside others.
const VALUE_COLUMNS: usize = 39;

/// How the check stands, its values, the radio.
pub fn checks_lines(model: &Model, theme: Theme, now: Duration, columns: usize) -> Vec<Line<'static>> {
    let check = model.vehicle.pad_check.as_ref();
    let mut lines = vec![headline(model, check, theme, now), supply(model, theme)];
    lines.push(theme.line(
        format!(" {:<14}{:>24}{:>20}{:>20}", "surface", "range, least", "error, most", "lag, most"),
        TextRole::Label,
    ));
    lines.extend(SURFACES.map(|of| surface(check, of, theme)));
    let others: Vec<&TD_PAD_CHECK_DATA> =
        check.into_iter().flat_map(PadCheck::values).filter(|value| value.item as u32 >= 18).collect();
    let beside = (columns / VALUE_COLUMNS).max(1);
    // Down the first column first, as they were found.
    let rows = others.len().div_ceil(beside);
    for row in 0..rows {
        let cells = (0..beside).filter_map(|column| others.get(row + column * rows));
        lines.push(Line::from(cells.flat_map(|value| cell(value, theme)).collect::<Vec<_>>()));
    }
    lines.extend(radio(model, theme, now));
    lines
}

/// What runs, or what came of it, and the keys.
fn headline(model: &Model, check: Option<&PadCheck>, theme: Theme, now: Duration) -> Line<'static> {
    use TdPadCheckState as S;
    let keys = &model.settings.keys;
    let [all, still] = [Act::Check, Act::CheckStill].map(|act| keys.name(act));
    let begin = format!("  {all} checks (MOVES), {still} without motion");
    if standing(model, now) == Standing::MayRun {
        return Line::from(vec![
            theme.span(" A CHECK MAY RUN: hands off", TextRole::Caution),
            theme.label(format!("  {all} ends it")),
        ]);
    }
    let Some(check) = check.filter(|check| check.told.state != S::TD_PAD_CHECK_STATE_NOT_RUN) else {
        return Line::from(vec![theme.plain(" no check yet"), theme.label(begin)]);
    };
    let failing = check.failing().count();
    let (words, role, then) = match check.told.state {
        S::TD_PAD_CHECK_STATE_RUNNING => (
            format!(" CHECK {} RUNS {} %: hands off", check.told.run, check.told.progress),
            TextRole::Caution,
            format!("  {all} ends it"),
        ),
        S::TD_PAD_CHECK_STATE_PASSED if check.awaits_eyes() => (
            format!(" CHECK {} PASSED but for what only people see", check.told.run),
            TextRole::Caution,
            format!("  {} says it", keys.name(Act::Seen)),
        ),
        S::TD_PAD_CHECK_STATE_PASSED => (format!(" CHECK {} PASSED", check.told.run), TextRole::Good, begin),
        S::TD_PAD_CHECK_STATE_FAILED => {
            (format!(" CHECK {} FAILED: {failing} outside", check.told.run), TextRole::Alarm, begin)
        }
        _ => (format!(" CHECK {} STOPPED early", check.told.run), TextRole::Caution, begin),
    };
    let told = seconds(now.saturating_sub(check.told_at));
    let by = if check.told.asked_by > 0 {
        format!(", {}", model.operator(check.told.asked_by))
    } else {
        String::new()
    };
    Line::from(vec![
        theme.span(words, role),
        theme.label(format!(" (told {told} ago{by})")),
        theme.label(then),
    ])
}

/// Battery and storage, outside of a check too.
fn supply(model: &Model, theme: Theme) -> Line<'static> {
    let battery = model.vehicle.battery().map_or_else(
        || "not told".to_owned(),
        |battery| {
            let left = battery.value.percent.map_or_else(String::new, |percent| format!(", {percent} %"));
            format!("{} V{left}", fixed(battery.value.volts, 2))
        },
    );
    let space = model
        .vehicle
        .log_space_mib()
        .map_or_else(|| "not told".to_owned(), |space| format!("{} MiB free", fixed(space.value, 0)));
    let (label, plain) = (theme.style(TextRole::Label), theme.style(TextRole::Plain));
    Line::from(vec![
        Span::styled(" battery ", label),
        Span::styled(battery, plain),
        Span::styled("   vehicle's log ", label),
        Span::styled(space, plain),
    ])
}

fn role_of(verdict: TdPadCheckVerdict) -> (&'static str, TextRole) {
    match verdict {
        TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_OK => ("ok ", TextRole::Good),
        TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_OK => ("NO ", TextRole::Alarm),
        TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_JUDGED => ("   ", TextRole::Plain),
    }
}

/// One surface: range, error and lag, each with its limit; of one that tells nothing, what people see.
fn surface(check: Option<&PadCheck>, (name, first, seen): (&str, u32, &str), theme: Theme) -> Line<'static> {
    let values: Vec<Option<&TD_PAD_CHECK_DATA>> = (first..first + 3)
        .map(|item| check.and_then(|check| check.values().find(|value| value.item as u32 == item)))
        .collect();
    let mut spans = vec![theme.plain(format!(" {name:<14}"))];
    let tells = values
        .iter()
        .flatten()
        .any(|value| value.verdict != TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_JUDGED);
    if check.is_some() && !tells {
        spans.push(theme.plain(seen.to_owned()));
        return Line::from(spans);
    }
    for (value, columns) in values.into_iter().zip([24, 20, 20]) {
        let Some(value) = value else {
            spans.push(theme.label(format!("{:>columns$}", "--")));
            continue;
        };
        let (mark, role) = role_of(value.verdict);
        let (_, unit, factor, decimals) = shown(value);
        let number = |number: f32| fixed(factor * f64::from(number), decimals);
        let limit = if value.least.is_finite() { value.least } else { value.most };
        let (found, limit) = (number(value.value), number(limit));
        let text = format!("{mark}{found}, {limit} {unit}");
        spans.push(theme.span(format!("{text:>columns$}"), role));
    }
    Line::from(spans)
}

/// A value with its limits, in a column.
fn cell(value: &TD_PAD_CHECK_DATA, theme: Theme) -> Vec<Span<'static>> {
    let (mark, role) = role_of(value.verdict);
    let (name, unit, factor, decimals) = shown(value);
    let number = |number: f32| fixed(factor * f64::from(number), decimals);
    let found = match value.item {
        item if is_switch(item) => if value.value > 0.5 { "yes" } else { "no" }.to_owned(),
        _ => format!("{} {unit}", number(value.value)),
    };
    let limits = match (value.least.is_finite(), value.most.is_finite()) {
        _ if is_switch(value.item) => String::new(),
        (true, true) => format!("{}..{}", number(value.least), number(value.most)),
        (true, false) => format!("least {}", number(value.least)),
        (false, true) => format!("most {}", number(value.most)),
        (false, false) => String::new(),
    };
    vec![
        theme.span(format!(" {mark}"), role),
        theme.plain(format!("{name:<13.13}")),
        theme.span(format!("{found:>10.10}"), role),
        theme.label(format!(" {limits:<11.11}")),
    ]
}

fn is_switch(item: TdPadCheckItem) -> bool {
    use TdPadCheckItem as I;
    matches!(
        item,
        I::TD_PAD_CHECK_ITEM_IGNITER_CONTINUITY
            | I::TD_PAD_CHECK_ITEM_BOOSTER_WIRE
            | I::TD_PAD_CHECK_ITEM_PIN_OUT
            | I::TD_PAD_CHECK_ITEM_LOG_RUNNING
    )
}

/// The radio range test: what was found with its limits.
fn radio(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let label = theme.style(TextRole::Label);
    let key = model.settings.keys.name(Act::RangeTest);
    let Some(test) = model.range_test.as_ref() else {
        return vec![Line::from(vec![
            theme.plain(" radio: no range test yet"),
            Span::styled(format!("  {key} begins one: 30 s, antennas as in flight"), label),
        ])];
    };
    let found = test.found.unwrap_or_else(|| test.so_far(None));
    vec![result(test, &found, theme, now)]
}

/// In one line: the smallest whole screen has no more.
fn result(test: &RangeTest, found: &RangeTestResult, theme: Theme, now: Duration) -> Line<'static> {
    let (words, role) = match (test.is_running(), found.stopped, found.passed()) {
        (true, ..) => (format!("RUNS {:.0} s", test.left(now).as_secs_f64()), TextRole::Caution),
        (false, Some(_), _) => ("STOPPED".to_owned(), TextRole::Caution),
        (false, None, true) => ("PASSED".to_owned(), TextRole::Good),
        (false, None, false) => ("FAILED".to_owned(), TextRole::Alarm),
    };
    let mut spans = vec![theme.span(format!(" RADIO {words}"), role)];
    let judged = |ok: bool| if ok { ("ok ", TextRole::Good) } else { ("NO ", TextRole::Alarm) };
    for (name, loss) in [("lost down", found.loss_down), ("up", found.loss_up)] {
        let (mark, role) = judged(loss <= LOSS_MOST);
        spans.push(theme.span(format!(" {mark}{name} {} %", fixed(100.0 * loss, 1)), role));
    }
    spans.push(theme.label(format!(" most {:.0}", 100.0 * LOSS_MOST)));
    match found.margin_db {
        Some(margin_db) => {
            let (mark, role) = judged(margin_db >= MARGIN_LEAST_DB);
            spans.push(theme.span(format!(" {mark}margin {} dB", fixed(margin_db, 1)), role));
            let least = format!(" least {MARGIN_LEAST_DB:.0}");
            spans.push(theme.label(least));
        }
        None => spans.push(theme.label(" no margin told")),
    }
    Line::from(spans)
}

// The page that helps to find the vehicle: where it was last heard, where it is predicted, and the way there.

/// The places and the ways to them.
pub fn find_lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let place = model.last_place(now).or(model.place);
    let label = |words: &'static str| theme.line(words, TextRole::Label);
    if may_have_left(&model.vehicle, now).is_some() {
        return may_have_left_lines(model, theme);
    }
    let Some(place) = place else {
        if model.vehicle.left_pad_at.is_some() {
            return vec![
                theme.line(" The vehicle has left the pad, and has not told its place.", TextRole::Caution),
            ];
        }
        return vec![
            label(" The vehicle has not left the pad."),
            label(" In flight its last place is kept beside the log, for maps"),
            label(" (GeoJSON, and KML with the pad's place)."),
        ];
    };
    let now_unix_s = model.settings.start_unix_s + now.as_secs();
    let mut lines = Vec::new();
    if let Some(predicted) = &place.predicted {
        lines.push(theme.line(" PREDICTED: look here first", TextRole::Caution));
        lines.extend(spot(model, &place, predicted, theme));
        lines.push(Line::default());
    }
    lines.push(theme.line(" Last heard", TextRole::Title));
    lines.extend(spot(model, &place, &place.heard, theme));
    lines.push(row("height then", format!("{} m", fixed(place.height_m, 1)), theme));
    let ago = now_unix_s.saturating_sub(place.heard_unix_s);
    lines.push(row("heard", format!("{ago} s ago, boot {:08X}", place.boot), theme));
    lines.push(Line::default());
    if place.pad.is_none() {
        let words = " Latitude, longitude and KML need the pad's place: `pad` in the settings";
        lines.push(theme.line(words, TextRole::Label));
    } else if model.settings.here.is_none() {
        let words = " The way from this station needs its place: `here` in the settings";
        lines.push(theme.line(words, TextRole::Label));
    }
    lines
}

/// It was last heard on the pad, in a countdown that must have ended.
fn may_have_left_lines(model: &Model, theme: Theme) -> Vec<Line<'static>> {
    let words = " MAY BE IN THE AIR since T-0".to_owned();
    let mut lines = vec![theme.line(words, TextRole::Alarm)];
    let Some(meant) = model.meant_to_come_down() else {
        let words = " It has not told the fence of its mission: look around the pad.";
        lines.push(theme.line(words, TextRole::Caution));
        return lines;
    };
    let (north, east) = (fixed(meant.north_m, 0), fixed(meant.east_m, 0));
    lines.push(row("meant to land", format!("north {north} m, east {east} m of the pad"), theme));
    lines.push(row("within", format!("{} m, the fence of its mission", fixed(meant.error_m, 0)), theme));
    if let Some(at) = model.settings.pad.map(|pad| pad.moved(meant.north_m, meant.east_m)) {
        lines.push(row("degrees", format!("{:.6}, {:.6}", at.latitude, at.longitude), theme));
    }
    let words = " Under a parachute, or without its landing motor, it may come down farther away.";
    lines.push(theme.line(words, TextRole::Caution));
    lines
}

fn row(label: &str, value: String, theme: Theme) -> Line<'static> {
    Line::from(vec![theme.label(format!("   {label:<16}")), theme.plain(value)])
}

fn spot(model: &Model, place: &LastPlace, spot: &Spot, theme: Theme) -> Vec<Line<'static>> {
    let way = place.way(spot, model.settings.here);
    let from = if way.from_station { "from here" } else { "from the pad" };
    // 359.6 is 000, as on a compass.
    let bearing_deg = way.bearing_deg.round() as u32 % 360;
    let plus_minus = theme.either_side(&format!("±{} m", fixed(spot.error_m, 0)));
    let mut rows = vec![
        row(from, format!("{} m, bearing {bearing_deg:03} deg", fixed(way.distance_m, 0)), theme),
        row(
            "pad frame",
            format!("north {} m, east {} m", fixed(spot.north_m, 1), fixed(spot.east_m, 1)),
            theme,
        ),
        row("19 of 20 cases", plus_minus, theme),
    ];
    if let Some(at) = place.degrees(spot) {
        rows.push(row("degrees", format!("{:.6}, {:.6}", at.latitude, at.longitude), theme));
    }
    rows
}
