//! The link page: rates and losses, rejected frames, and age and rate of every message.

use std::time::Duration;

use protocol::dialect::message_name;
use protocol::frame::FramerCounters;
use protocol::identity::Address;
use protocol::link_stats::{LinkFigures, MessageFigures, SourceFigures};
use protocol::signing::SigningCounters;
use ratatui::text::{Line, Span};

use crate::model::{LinkReport, Model, STALE_AFTER, refusal};
use crate::view::status_lines::{loss_role, percent};
use crate::view::{STALE_MARK, TextRole, Theme, fixed, seconds};

const NAME_WIDTH: usize = 26;
/// The width of a message name with its age and rate: two beside each other on the smallest whole
/// screen.
const MESSAGE_CELL_WIDTH: usize = 39;
/// The messages that the vehicle sends regularly.
const REGULAR: &str = "HEARTBEAT SYS_STATUS EXTENDED_SYS_STATE TD_FLIGHT_STATUS ATTITUDE_QUATERNION \
    LOCAL_POSITION_NED VFR_HUD TD_FINS TD_GIMBAL TD_DESCENT TD_CONTROLLER TD_TOUCHDOWN_PREDICTION TD_PREDICTED_PATH";

/// Rejected frames by reason; the rates of all links together, of each link and of each component;
/// age and rate of every message.
pub fn lines(model: &Model, theme: Theme, now: Duration, columns: usize, rows: usize) -> Vec<Line<'static>> {
    let mut lines = rejected(model, theme, now);
    let heading = cells(["over 10 s", "rx B/s", "tx", "frames/s", "loss", "copies", "age"]);
    lines.push(theme.line(heading, TextRole::Title));
    for report in reports(model, now) {
        lines.push(report_line(&report, theme));
        lines.extend(report.sources.iter().map(|source| source_line(source, model.settings.vehicle, theme)));
    }
    let older = format!(" messages of the vehicle; {STALE_MARK} older than {}", seconds(STALE_AFTER));
    lines.push(theme.line(older, TextRole::Title));
    lines.extend(message_lines(model, theme, now, columns));
    // Scrolling up goes towards the first line.
    let start = lines.len().saturating_sub(rows).min(model.pages.scroll);
    lines.into_iter().skip(start).take(rows).collect()
}

fn cells([name, rx, tx, frames, loss, copies, age]: [&str; 7]) -> String {
    format!(" {name:<NAME_WIDTH$.NAME_WIDTH$}{rx:>11}{tx:>6}{frames:>9}{loss:>8}{copies:>8}{age:>9}")
}

/// Counts of rejected frames by reason, the vehicle's refusals, and a radio's report about itself.
fn rejected(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let FramerCounters { crc_errors, unknown_ids, cut_short, unknown_flags, garbage_bytes, .. } =
        model.link.framing;
    let fields = model.link.undecodable;
    let unreadable = format!(
        "checksum {crc_errors}  id {unknown_ids}  cut {cut_short}  flags {unknown_flags}  fields {fields}  garbage {garbage_bytes} B"
    );
    let signed = model.link.signing.map(|signing| {
        let SigningCounters { accepted, unsigned, wrong, replayed, too_old, too_new } = signing;
        format!("good {accepted}  unsigned {unsigned}  wrong {wrong}  replayed {replayed}  old {too_old}  new {too_new}")
    });
    let drops = model.link.send_drops;
    let refused = model.link.uplink.refused.map(|refused| {
        let (Address { system_id, component_id }, why) = (refused.source, refusal(refused.why));
        let since = seconds(now.saturating_sub(refused.at));
        format!("{} of {system_id}/{component_id} by the vehicle, {since} ago: {why}", refused.count)
    });
    let radio = model.link.radio(now).map(|radio| {
        let known = |value: u8| if value == u8::MAX { "--".to_owned() } else { value.to_string() };
        let [rssi, remote, noise, far] = [radio.rssi, radio.remrssi, radio.noise, radio.remnoise].map(known);
        format!("rssi {rssi}/{remote} noise {noise}/{far}")
    });
    let rows = [
        ("rejected", Some(unreadable)),
        ("signed", signed),
        ("unsent", (drops > 0).then(|| format!("{drops} writes found no room"))),
        ("refused", refused),
        ("radio", radio),
        ("answers", model.link.round_trip.map(|of| format!("round trip {:.0} ms", 1e3 * of.as_secs_f64()))),
    ];
    let known = rows.into_iter().filter_map(|(label, value)| Some((label, value?)));
    known
        .map(|(label, value)| Line::from(vec![theme.label(format!(" {label:<9}")), theme.plain(value)]))
        .collect()
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
    let [rx, tx, frames] = [fixed(rx_bytes_s, 0) + &capacity, fixed(tx_bytes_s, 0), fixed(rx_frames_s, 1)];
    let row = cells([name, &rx, &tx, &frames, &percent(loss), &report.copies.to_string(), ""]);
    theme.line(row, loss_role(loss))
}

fn source_line(source: &SourceFigures, vehicle: Address, theme: Theme) -> Line<'static> {
    let SourceFigures { source: address, age, rx_frames_s, loss } = *source;
    let loss = (rx_frames_s > 0.0).then_some(loss);
    let Address { system_id, component_id } = address;
    // By MAVLink's `MAV_COMPONENT`.
    let what = match component_id {
        _ if address == vehicle => "vehicle",
        190 => "ground station",
        68 => "radio",
        _ => "",
    };
    let name = format!("  {system_id}/{component_id} {what}");
    let (mark, role) = if age > STALE_AFTER { (STALE_MARK, TextRole::Stale) } else { ("", loss_role(loss)) };
    let age = format!("{mark}{}", seconds(age));
    theme.line(cells([&name, "", "", &fixed(rx_frames_s, 1), &percent(loss), "", &age]), role)
}

/// Age and rate of each message, in as many columns as fit.
fn message_lines(model: &Model, theme: Theme, now: Duration, columns: usize) -> Vec<Line<'static>> {
    let messages = messages(model, now);
    let across = (columns / MESSAGE_CELL_WIDTH).max(1);
    let rows = messages.len().div_ceil(across);
    (0..rows)
        .map(|row| {
            let cells = (0..across).filter_map(|column| messages.get(row + column * rows));
            Line::from(cells.flat_map(|(name, at)| message_cell(name, *at, theme)).collect::<Vec<_>>())
        })
        .collect()
}

fn message_cell(name: &str, at: Option<MessageFigures>, theme: Theme) -> [Span<'static>; 2] {
    let (text, role) = match at {
        None => ("  never".to_owned(), TextRole::Label),
        Some(MessageFigures { age, rx_frames_s, .. }) => {
            let (mark, role) =
                if age > STALE_AFTER { (STALE_MARK, TextRole::Stale) } else { (" ", TextRole::Plain) };
            (format!("{:>7}{rx_frames_s:>6.1}/s", format!("{mark}{}", seconds(age))), role)
        }
    };
    [theme.label(format!(" {name:<23.23}")), theme.span(format!("{text:<15}"), role)]
}

/// The regular messages, received or not; then every other message that was received, by its id.
fn messages(model: &Model, now: Duration) -> Vec<(&'static str, Option<MessageFigures>)> {
    let mut messages: Vec<(&str, _)> = REGULAR.split_whitespace().map(|name| (name, None)).collect();
    for figures in model.link.stats.messages(now) {
        let name = message_name(figures.message_id).filter(|_| figures.source == model.settings.vehicle);
        let Some(name) = name else { continue };
        match messages.iter_mut().find(|(known, _)| *known == name) {
            Some((_, at)) => *at = Some(figures),
            None => messages.push((name, Some(figures))),
        }
    }
    messages
}
