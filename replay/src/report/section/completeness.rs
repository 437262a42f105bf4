//! How complete the log is, and what can be done with it.

use crate::info::Info;
use crate::report::html::{escaped, table};

pub(super) fn html(info: &Info) -> String {
    let found = &info.completeness;
    let complete = if found.complete {
        "<span class=\"good\">yes: ended properly, every checksum holds</span>".to_owned()
    } else {
        "<span class=\"bad\">NO</span>".to_owned()
    };
    let mut rows = vec![
        vec!["complete".to_owned(), complete],
        vec!["grade".to_owned(), escaped(&format!("{}: {}", info.grade.level.name(), info.grade.reason))],
    ];
    let mut row = |name: &str, value: Option<String>| {
        rows.extend(value.map(|value| vec![name.to_owned(), escaped(&value)]));
    };
    row("damage", found.damage.clone());
    row("the flight", found.cut.as_ref().map(ToString::to_string));
    let readable_s = found.readable_until_s.filter(|_| found.damage.is_some());
    row("readable until", readable_s.map(|until_s| format!("{until_s:.3} s after the first record")));
    row("lost after that", found.missing_s.map(|missing_s| format!("{missing_s:.3} s")));
    row("messages missing", Some(found.messages_lost.to_string()));
    row("size", info.size_bytes.map(|bytes| format!("{bytes} bytes")));
    row(
        "profile",
        info.profile.as_ref().map(|profile| {
            let words = profile.name.clone().zip(profile.summary.clone());
            words.map_or_else(
                || format!("cannot be used: {}", profile.problem.clone().unwrap_or_default()),
                |(name, summary)| format!("{name}: {summary}"),
            )
        }),
    );
    row("written by", Some(info.library.clone()));
    for (fact, value) in &info.build {
        row(&format!("build: {fact}"), Some(value.clone()));
    }
    let channels: Vec<Vec<String>> = info
        .channels
        .iter()
        .map(|channel| {
            vec![
                escaped(&channel.topic),
                escaped(&channel.schema),
                channel.messages.to_string(),
                channel.lost.to_string(),
                channel.unreadable.to_string(),
            ]
        })
        .collect();
    table(&["", ""], &rows)
        + &table(&["channel", "schema", "#messages", "#missing", "#unreadable"], &channels)
}
