//! How well the radio worked.

use super::rms_and_max;
use crate::info::Info;
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, escaped, paragraph, table};
use crate::report::track::Flight;

pub(super) fn html(flight: &Flight, info: &Info) -> String {
    let frames: Vec<Vec<String>> = info
        .channels
        .iter()
        .filter(|channel| channel.message_encoding == protocol::log::record::ENCODING_MAVLINK)
        .map(|channel| {
            let fact = |key: &str| channel.metadata.get(key).map(|text| escaped(text)).unwrap_or_default();
            vec![
                escaped(&channel.topic),
                fact("endpoint"),
                fact("link"),
                channel.messages.to_string(),
                channel.lost.to_string(),
            ]
        })
        .collect();
    let heard = &flight.recording.telemetry;
    if frames.is_empty() && heard.is_empty() {
        return paragraph("The log has neither frames nor a ground station's telemetry.");
    }
    let mut html = String::new();
    if !frames.is_empty() {
        html.push_str(&table(&["frames", "recorded by", "link", "#count", "#missing in the log"], &frames));
    }
    if heard.is_empty() {
        return html
            + &paragraph("No ground station wrote into this log, so the link's age and loss are not known.");
    }
    let of = |value: &dyn Fn(&protocol::log::v1::Telemetry) -> Option<f64>| -> Vec<(f64, f64)> {
        heard.iter().filter_map(|told| Some((flight.axis_s(told.time_s), value(told)?))).collect()
    };
    let series = [
        ("Age of the last heartbeat, s", of(&|told| told.link_age_s)),
        ("Frames lost, %", of(&|told| told.link_loss.map(|loss| 100.0 * loss))),
        ("Received, bytes/s", of(&|told| told.link_rx_bytes_s)),
    ];
    let mut rows = Vec::new();
    let mut pictures = Vec::new();
    for (name, points) in series {
        if let Some((_, max)) = rms_and_max(points.iter().map(|point| point.1)) {
            rows.push(vec![name.to_owned(), format!("{max:.2}")]);
        }
        let lines = vec![Line { name: "", class: "a", points }];
        let title = name.to_owned();
        pictures.push(
            Chart { title, x_label: flight.axis_name(), lines, marks: flight.marks(), ..Chart::default() }
                .svg(),
        );
    }
    html.push_str(&table(&["as the ground station knew it", "#largest"], &rows));
    html + &charts(&pictures)
}
