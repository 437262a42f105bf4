//! The verdict of the vehicle, beside the verdicts that the ground computes by the other standards.

use ratatui::text::{Line, Span};

use super::limit_rows::{LimitRow, decimals, either_side, limit_rows, range};
use super::number::fixed;
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::judgement::{Compliance, LEGS, Standard, TABLE_2, overall};
use crate::model::touchdown::Touchdown;
use crate::model::vehicle::Verdict;

/// Columns of the values, of their units and of each verdict.
const FIGURE_COLUMNS: usize = 14;
const UNIT_COLUMNS: usize = 8;
const VERDICT_COLUMNS: usize = 11;
/// From this width on the verdict is written in full.
const WORDS_COLUMNS: usize = 70;
/// Marks what the ground has computed.
const COMPUTED: &str = "*";

/// The judgement by one standard, computed by the ground.
struct Beside {
    standard: Standard,
    held: [Compliance; 6],
}

/// The verdicts in words: first the vehicle's own, which decides, then the computed ones.
pub fn words(model: &Model, verdict: &Verdict, theme: Theme, columns: usize) -> Line<'static> {
    let (word, role) =
        if verdict.landed { ("LANDED", TextRole::Good) } else { ("NOT LANDED", TextRole::Alarm) };
    let whose = Standard::whose(model.vehicle.limits.as_ref());
    let says = if columns < WORDS_COLUMNS { "" } else { ", says the vehicle" };
    let mut spans = vec![
        Span::styled(format!(" {word}"), theme.style(role)),
        Span::styled(format!(" by {whose}{says}"), theme.style(TextRole::Plain)),
    ];
    for beside in beside(model, verdict) {
        let (word, role) = in_words(overall(&beside.held));
        let name = beside.standard.name;
        spans.push(Span::styled(format!("; by {name}{COMPUTED} "), theme.style(TextRole::Label)));
        spans.push(Span::styled(word, theme.style(role)));
    }
    Line::from(spans)
}

/// The table with a row per limit: the value, the vehicle's judgement and the computed ones.
pub fn table(model: &Model, verdict: &Verdict, theme: Theme, columns: usize) -> Vec<Line<'static>> {
    let units = columns >= table_columns(model, verdict);
    let figure_columns = FIGURE_COLUMNS + if units { UNIT_COLUMNS } else { 1 };
    let limits = model.vehicle.limits.as_ref();
    let besides = beside(model, verdict);
    let own = limits.and_then(Standard::of).map_or("vehicle", |standard| standard.name);
    let mut heads = vec![format!("{own:<VERDICT_COLUMNS$}")];
    heads.extend(
        besides
            .iter()
            .map(|beside| format!("{:<VERDICT_COLUMNS$}", format!("{}{COMPUTED}", beside.standard.name))),
    );
    let mut lines = vec![Line::styled(
        format!("{:<figure_columns$}{}", "Verdict", heads.concat()),
        theme.style(TextRole::Title),
    )];
    for (place, row) in limit_rows(&verdict.touchdown, limits).iter().enumerate() {
        let mut spans = figure(row, units, theme);
        let kept = if row.kept { Compliance::Kept } else { Compliance::Broken };
        spans.extend(judged(kept, &theme.either_side(&row.limit), theme));
        for beside in &besides {
            spans.extend(judged(
                beside.held[place],
                &theme.either_side(&limit_of(&beside.standard, place)),
                theme,
            ));
        }
        lines.push(Line::from(spans));
    }
    if !besides.is_empty() {
        let doubt = besides.iter().any(|beside| beside.held.contains(&Compliance::Unknown));
        let words = if doubt {
            "* computed here; ? these figures do not tell"
        } else {
            "* computed here from these figures"
        };
        lines.push(Line::styled(words, theme.style(TextRole::Label)));
    }
    lines
}

/// How many columns [`table`] takes.
pub fn table_columns(model: &Model, verdict: &Verdict) -> usize {
    FIGURE_COLUMNS + UNIT_COLUMNS + VERDICT_COLUMNS * (1 + beside(model, verdict).len())
}

/// The standards that the vehicle does not judge by itself. Empty until the vehicle has reported its limits.
fn beside(model: &Model, verdict: &Verdict) -> Vec<Beside> {
    let Some(limits) = model.vehicle.limits.as_ref() else { return Vec::new() };
    let own = Standard::of(limits);
    let touchdown: &Touchdown = &verdict.touchdown;
    [TABLE_2, LEGS]
        .into_iter()
        .filter(|standard| own != Some(*standard))
        .map(|standard| Beside { standard, held: standard.judge(touchdown, model.vehicle.in_space) })
        .collect()
}

fn figure(row: &LimitRow, units: bool, theme: Theme) -> Vec<Span<'static>> {
    let unit = if units { format!(" {:<7}", row.unit) } else { " ".to_owned() };
    vec![
        Span::styled(format!("{:<6}", row.name), theme.style(TextRole::Label)),
        Span::styled(format!("{:>8}", fixed(row.value, decimals(row.value))), theme.style(TextRole::Plain)),
        Span::styled(unit, theme.style(TextRole::Label)),
    ]
}

fn judged(held: Compliance, limit: &str, theme: Theme) -> Vec<Span<'static>> {
    let (word, role) = match held {
        Compliance::Kept => ("ok", TextRole::Good),
        Compliance::Broken => ("NO", TextRole::Alarm),
        Compliance::Unknown => ("? ", TextRole::Caution),
    };
    let columns = VERDICT_COLUMNS - 3;
    vec![
        Span::styled(word, theme.style(role)),
        Span::styled(format!(" {limit:<columns$}"), theme.style(TextRole::Label)),
    ]
}

fn in_words(held: Compliance) -> (&'static str, TextRole) {
    match held {
        Compliance::Kept => ("landed", TextRole::Good),
        Compliance::Broken => ("not landed", TextRole::Caution),
        Compliance::Unknown => ("not known", TextRole::Caution),
    }
}

/// The text of a limit by its place in the order of the state.
fn limit_of(standard: &Standard, place: usize) -> String {
    let upright_deg = 90.0;
    match place {
        0 => standard.distance_m.map_or_else(|| "any".to_owned(), either_side),
        1 => range(standard.altitude_m.0, standard.altitude_m.1),
        2 => {
            let error_deg = standard.tilt_rad.to_degrees();
            range(upright_deg - error_deg, upright_deg + error_deg)
        }
        3 => either_side(standard.along_m_s),
        4 => either_side(standard.across_m_s),
        _ => either_side(standard.rate_rad_s.to_degrees()),
    }
}
