//! The link page: rates and losses, rejected frames, and age and rate of every message.

use std::time::Duration;

use protocol::dialect::message_name;
use protocol::identity::Address;
use protocol::link_stats::{LinkFigures, MessageFigures, SourceFigures};
use ratatui::text::{Line, Span};

use super::window;
use crate::model::{LinkReport, LinkState, Model, STALE_AFTER, refusal};
use crate::view::status_lines::{link_line, loss_role, percent};
use crate::view::{STALE_MARK, TextRole, Theme, seconds};

const NAME_WIDTH: usize = 27;
/// The width of a message name with its age and rate: two beside each other on the smallest whole screen.
const MESSAGE_CELL_WIDTH: usize = 40;
/// The messages that the vehicle sends regularly.
const REGULAR: [&str; 13] = [
    "HEARTBEAT",
    "SYS_STATUS",
    "EXTENDED_SYS_STATE",
    "TD_FLIGHT_STATUS",
    "ATTITUDE_QUATERNION",
    "LOCAL_POSITION_NED",
    "VFR_HUD",
    "TD_FINS",
    "TD_GIMBAL",
    "TD_DESCENT",
    "TD_CONTROLLER",
    "TD_TOUCHDOWN_PREDICTION",
    "TD_PREDICTED_PATH",
];

/// The rates of all links together, of each link and of each component; then age and rate of every message.
pub fn lines(model: &Model, theme: Theme, now: Duration, columns: usize, rows: usize) -> Vec<Line<'static>> {
    let mut lines = vec![link_line(model, theme, now, columns)];
    lines.push(directions(model, theme, now));
    lines.extend(rejected(model, theme));
    let heading = format!(
        " {:<NAME_WIDTH$}{:>11}{:>6}{:>9}{:>8}{:>8}{:>9}",
        "Over 10 s", "rx B/s", "tx", "frames/s", "loss", "copies", "age"
    );
    lines.push(theme.line(heading, TextRole::Title));
    for report in reports(model, now) {
        lines.push(report_line(&report, theme));
        lines.extend(report.sources.iter().map(|source| source_line(source, model.settings.vehicle, theme)));
    }
    lines.push(theme.line(
        format!(" Age and rate of what the vehicle says; {STALE_MARK} older than {}", seconds(STALE_AFTER)),
        TextRole::Title,
    ));
    lines.extend(message_lines(model, theme, now, columns));
    // Scrolling up goes towards the first line.
    let start = lines.len().saturating_sub(rows).min(model.pages.scroll);
    window(lines, start, rows)
}

/// The age of the last frame in both directions, and what the vehicle refuses.
fn directions(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let age = |state: LinkState| match state {
        LinkState::NeverHeard => "never".to_owned(),
        LinkState::Alive(age) | LinkState::Doubtful(age) | LinkState::Lost(age) => seconds(age),
    };
    let uplink = &model.link.uplink;
    let refused = uplink.refused.map_or_else(String::new, |refused| {
        let (Address { system_id, component_id }, why) = (refused.source, refusal(refused.why));
        let since = seconds(now.saturating_sub(refused.at));
        format!("; it refused {} of {system_id}/{component_id}, {since} ago: {why}", refused.count)
    });
    Line::from(vec![
        theme.label(" heard    "),
        theme.plain(format!(
            "down {} ago, up {} ago{refused}",
            age(model.link.state(now)),
            age(uplink.state(now))
        )),
    ])
}

/// Counts of rejected frames by reason.
fn rejected(model: &Model, theme: Theme) -> Vec<Line<'static>> {
    let row = |label: &str, value: String| {
        Line::from(vec![theme.label(format!(" {label:<9}")), theme.plain(value)])
    };
    let framing = &model.link.framing;
    let unreadable = format!(
        "checksum {}  id {}  cut {}  flags {}  fields {}  garbage {} B",
        framing.crc_errors,
        framing.unknown_ids,
        framing.cut_short,
        framing.unknown_flags,
        model.link.undecodable,
        framing.garbage_bytes
    );
    let mut lines = vec![row("rejected", unreadable)];
    if let Some(signing) = model.link.signing {
        let counts = format!(
            "good {}  unsigned {}  wrong {}  replayed {}  old {}  new {}",
            signing.accepted,
            signing.unsigned,
            signing.wrong,
            signing.replayed,
            signing.too_old,
            signing.too_new
        );
        lines.push(row("signed", counts));
    }
    if model.link.send_drops > 0 {
        lines.push(row("unsent", format!("{} writes found no room", model.link.send_drops)));
    }
    lines
}

/// All links together; if there are several, also each link as last reported.
fn reports(model: &Model, now: Duration) -> Vec<LinkReport> {
    let link = &model.link;
    let several = link.reports.len() > 1;
    let all = LinkReport {
        name: if several { "all links".to_owned() } else { model.settings.link_name.clone() },
        figures: link.stats.figures(now),
        sources: link.stats.sources(now),
        capacity_bytes_s: model.settings.link_capacity_bytes_s,
        copies: link.reports.iter().map(|report| report.copies).sum(),
        trouble: link.trouble.clone(),
    };
    let since_reported = now.saturating_sub(link.reported_at);
    let aged = |report: &LinkReport| {
        let mut report = report.clone();
        for source in &mut report.sources {
            source.age += since_reported;
        }
        report
    };
    let each = link.reports.iter().filter(|_| several).map(aged);
    std::iter::once(all).chain(each).collect()
}

fn report_line(report: &LinkReport, theme: Theme) -> Line<'static> {
    let name = &report.name;
    if let Some(why) = &report.trouble {
        return theme.line(format!(" {name} DOWN {why}"), TextRole::Alarm);
    }
    let LinkFigures { rx_bytes_s, tx_bytes_s, rx_frames_s, loss } = report.figures;
    let loss = (rx_frames_s > 0.0).then_some(loss);
    let capacity = report.capacity_bytes_s.map_or_else(String::new, |most| format!("/{most}"));
    let rx = format!("{rx_bytes_s:.0}{capacity}");
    let (loss_words, copies) = (percent(loss), report.copies);
    let text = format!(
        " {name:<NAME_WIDTH$.NAME_WIDTH$}{rx:>11}{tx_bytes_s:>6.0}{rx_frames_s:>9.1}{loss_words:>8}{copies:>8}"
    );
    theme.line(text, loss_role(loss))
}

fn source_line(source: &SourceFigures, vehicle: Address, theme: Theme) -> Line<'static> {
    let SourceFigures { source: address, age, rx_frames_s, loss } = *source;
    let loss = (rx_frames_s > 0.0).then_some(loss);
    let Address { system_id, component_id } = address;
    let name = format!("  {system_id}/{component_id} {}", what(address, vehicle));
    let (loss_words, age_words) = (percent(loss), seconds(age));
    let mark = if age > STALE_AFTER { STALE_MARK } else { " " };
    let text = format!(
        " {name:<NAME_WIDTH$.NAME_WIDTH$}{:>17}{rx_frames_s:>9.1}{loss_words:>8}{:>8}{:>9}",
        "",
        "",
        format!("{mark}{age_words}")
    );
    let role = if age > STALE_AFTER { TextRole::Stale } else { loss_role(loss) };
    theme.line(text, role)
}

/// What a component is, by its ids (MAVLink's `MAV_COMPONENT`).
fn what(address: Address, vehicle: Address) -> &'static str {
    match address {
        _ if address == vehicle => "vehicle",
        Address { component_id: 190, .. } => "ground station",
        Address { component_id: 68, .. } => "radio",
        _ => "",
    }
}

/// Age and rate of each message, in as many columns as fit.
fn message_lines(model: &Model, theme: Theme, now: Duration, columns: usize) -> Vec<Line<'static>> {
    let messages = messages(model, now);
    let across = (columns / MESSAGE_CELL_WIDTH).max(1);
    let rows = messages.len().div_ceil(across);
    (0..rows)
        .map(|row| {
            let cells = (0..across).filter_map(|column| messages.get(row + column * rows));
            Line::from(cells.flat_map(|(name, heard)| message_cell(name, *heard, theme)).collect::<Vec<_>>())
        })
        .collect()
}

fn message_cell(name: &str, heard: Option<MessageFigures>, theme: Theme) -> [Span<'static>; 2] {
    let (text, role) = match heard {
        None => ("   never".to_owned(), TextRole::Label),
        Some(MessageFigures { age, rx_frames_s, .. }) => {
            let (mark, role) =
                if age > STALE_AFTER { (STALE_MARK, TextRole::Stale) } else { (" ", TextRole::Plain) };
            (format!("{:>8}{rx_frames_s:>6.1}/s", format!("{mark}{}", seconds(age))), role)
        }
    };
    [theme.label(format!(" {name:<23.23}")), theme.span(format!("{text:<16}"), role)]
}

/// The regular messages, received or not; then every other message that was received, by its id.
fn messages(model: &Model, now: Duration) -> Vec<(&'static str, Option<MessageFigures>)> {
    let heard: Vec<(&'static str, MessageFigures)> = model
        .link
        .stats
        .messages(now)
        .filter(|figures| figures.source == model.settings.vehicle)
        .filter_map(|figures| Some((message_name(figures.message_id)?, figures)))
        .collect();
    let figures = |name| heard.iter().find(|(known, _)| *known == name).map(|(_, figures)| *figures);
    let others = heard.iter().filter(|(name, _)| !REGULAR.contains(name));
    REGULAR
        .iter()
        .map(|name| (*name, figures(*name)))
        .chain(others.map(|(name, figures)| (*name, Some(*figures))))
        .collect()
}
