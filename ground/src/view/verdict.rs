//! The landing against both standards: the vehicle's own verdict, and beside it what the ground computes from the figures
//! that the vehicle sent.

use protocol::dialect::TD_TOUCHDOWN_LIMITS_DATA;
use ratatui::text::{Line, Span};

use super::number::{fixed, shortest};
use super::theme::{Role, Theme};
use super::touchdown::decimals;
use crate::limits::{LimitRow, Touchdown};
use crate::model::Model;
use crate::model::judgement::{Held, LEGS, Standard, TABLE_2, together};
use crate::model::vehicle::Verdict;

/// Columns of the figures, of their units, and of each verdict behind them.
const FIGURE_COLUMNS: usize = 14;
const UNIT_COLUMNS: usize = 8;
const VERDICT_COLUMNS: usize = 11;
/// From here on the verdict has room for all its words.
const WORDS_COLUMNS: usize = 70;
/// Marks what is computed here.
const COMPUTED: &str = "*";

/// One standard's judgement, computed here.
struct Beside {
    standard: Standard,
    held: [Held; 6],
}

/// The verdicts in words, each with whose it is: the vehicle's, which decides, then what is computed by the other limits. Two
/// verdicts stand side by side here, so none says "every limit".
pub fn words(model: &Model, verdict: &Verdict, theme: Theme, columns: usize) -> Line<'static> {
    let (word, role) = if verdict.landed { ("LANDED", Role::Good) } else { ("NOT LANDED", Role::Alarm) };
    let whose = Standard::whose(model.vehicle.limits.as_ref());
    let says = if columns < WORDS_COLUMNS { "" } else { ", says the vehicle" };
    let mut spans = vec![
        Span::styled(format!(" {word}"), theme.style(role)),
        Span::styled(format!(" by {whose}{says}"), theme.style(Role::Plain)),
    ];
    for beside in beside(model, verdict) {
        let (word, role) = in_words(together(&beside.held));
        let name = beside.standard.name;
        spans.push(Span::styled(format!("; by {name}{COMPUTED} "), theme.style(Role::Label)));
        spans.push(Span::styled(word, theme.style(role)));
    }
    Line::from(spans)
}

/// Every limit a row: the figure, the vehicle's judgement, the computed ones.
pub fn table(model: &Model, verdict: &Verdict, theme: Theme, columns: usize) -> Vec<Line<'static>> {
    let units = columns >= table_columns(model, verdict);
    let figure_columns = FIGURE_COLUMNS + if units { UNIT_COLUMNS } else { 1 };
    let limits = model.vehicle.limits.as_ref();
    let besides = beside(model, verdict);
    let own = own(limits).map_or("vehicle", |standard| standard.name);
    let mut heads = vec![format!("{own:<VERDICT_COLUMNS$}")];
    heads.extend(
        besides
            .iter()
            .map(|beside| format!("{:<VERDICT_COLUMNS$}", format!("{}{COMPUTED}", beside.standard.name))),
    );
    let mut lines = vec![Line::styled(
        format!("{:<figure_columns$}{}", "Verdict", heads.concat()),
        theme.style(Role::Title),
    )];
    for (place, row) in verdict.touchdown.rows(limits).iter().enumerate() {
        let mut spans = figure(row, units, theme);
        let kept = if row.kept { Held::Kept } else { Held::Broken };
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
        let doubt = besides.iter().any(|beside| beside.held.contains(&Held::Unknown));
        let words = if doubt {
            "* computed here; ? these figures do not tell"
        } else {
            "* computed here from these figures"
        };
        lines.push(Line::styled(words, theme.style(Role::Label)));
    }
    lines
}

/// Columns that [`table`] takes.
pub fn table_columns(model: &Model, verdict: &Verdict) -> usize {
    FIGURE_COLUMNS + UNIT_COLUMNS + VERDICT_COLUMNS * (1 + beside(model, verdict).len())
}

/// The standard by which the vehicle judges, if it is one of the two.
pub fn own(limits: Option<&TD_TOUCHDOWN_LIMITS_DATA>) -> Option<Standard> {
    limits.and_then(Standard::of)
}

/// What the vehicle does not judge by. Before it has said by what it judges, nothing is known to be missing.
fn beside(model: &Model, verdict: &Verdict) -> Vec<Beside> {
    let Some(limits) = model.vehicle.limits.as_ref() else { return Vec::new() };
    let own = own(Some(limits));
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
        Span::styled(format!("{:<6}", row.name), theme.style(Role::Label)),
        Span::styled(format!("{:>8}", fixed(row.value, decimals(row.value))), theme.style(Role::Plain)),
        Span::styled(unit, theme.style(Role::Label)),
    ]
}

fn judged(held: Held, limit: &str, theme: Theme) -> Vec<Span<'static>> {
    let (word, role) = match held {
        Held::Kept => ("ok", Role::Good),
        Held::Broken => ("NO", Role::Alarm),
        Held::Unknown => ("? ", Role::Caution),
    };
    let columns = VERDICT_COLUMNS - 3;
    vec![
        Span::styled(word, theme.style(role)),
        Span::styled(format!(" {limit:<columns$}"), theme.style(Role::Label)),
    ]
}

fn in_words(held: Held) -> (&'static str, Role) {
    match held {
        Held::Kept => ("landed", Role::Good),
        Held::Broken => ("not landed", Role::Caution),
        Held::Unknown => ("not known", Role::Caution),
    }
}

/// A limit for reading, in the units of the screen, in state order.
fn limit_of(standard: &Standard, place: usize) -> String {
    let either_side = |limit: f64| format!("±{}", shortest(limit));
    let upright_deg = 90.0;
    match place {
        0 => standard.distance_m.map_or_else(|| "any".to_owned(), either_side),
        1 => format!("{}..{}", shortest(standard.altitude_m.0), shortest(standard.altitude_m.1)),
        2 => {
            let error_deg = standard.tilt_rad.to_degrees();
            format!("{}..{}", shortest(upright_deg - error_deg), shortest(upright_deg + error_deg))
        }
        3 => either_side(standard.along_m_s),
        4 => either_side(standard.across_m_s),
        _ => either_side(standard.rate_rad_s.to_degrees()),
    }
}
