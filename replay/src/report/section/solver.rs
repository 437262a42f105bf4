//! The plans of the flight computer (every tenth frame of the burn), and how long its frames took.

use flight::guidance::controller::ControlLevel;

use crate::info::{Info, SolveTimes};
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph, table};
use crate::report::track::{Flight, Thought};

/// Durations as rows of a table.
fn time_rows(times: &SolveTimes) -> [Vec<String>; 5] {
    let milliseconds = |s: f64| format!("{:.3} ms", 1e3 * s);
    [
        vec!["solve time, median".to_owned(), milliseconds(times.median_s)],
        vec!["solve time, 99 of 100 within".to_owned(), milliseconds(times.p99_s)],
        vec!["solve time, longest".to_owned(), milliseconds(times.max_s)],
        vec!["deadline".to_owned(), milliseconds(times.deadline_s)],
        vec!["frames over their deadline".to_owned(), times.over_deadline.to_string()],
    ]
}

pub(super) fn html(flight: &Flight, info: &Info) -> String {
    let idle = u32::from(ControlLevel::Idle.index());
    let plans: Vec<&Thought> = flight.thoughts.iter().filter(|thought| thought.level != idle).collect();
    if plans.is_empty() {
        return paragraph("The flight computer planned no landing.");
    }
    let count = |level: ControlLevel| {
        plans.iter().filter(|thought| thought.level == u32::from(level.index())).count()
    };
    let mut rows = vec![vec!["plans".to_owned(), plans.len().to_string()]];
    for level in ControlLevel::ALL {
        if count(level) > 0 {
            rows.push(vec![format!("decided by {}", level.name()), count(level).to_string()]);
        }
    }
    let most = plans.iter().map(|plan| plan.iterations).max().unwrap_or(0);
    rows.push(vec!["most iterations of a plan".to_owned(), most.to_string()]);
    let chart = |title: &str, points: Vec<(f64, f64)>, limits: Vec<f64>| Chart {
        title: title.to_owned(),
        x_label: flight.axis_name(),
        lines: vec![Line { name: "", class: "a", points }],
        marks: flight.marks(),
        limits,
        ..Chart::default()
    };
    let point = |plan: &&Thought| (flight.axis_s(plan.sample.time_s), plan.iterations as f64);
    let points = plans.iter().map(point).collect();
    let mut pictures = vec![chart("Newton iterations of each plan", points, Vec::new()).svg()];
    let Some(times) = info.frames.and_then(|frames| frames.solve_time) else {
        return table(&["", "#"], &rows)
            + &charts(&pictures)
            + &paragraph(
                "This flight was simulated without a clock: solve times and deadlines are not in its log.",
            );
    };
    rows.push(vec!["frames timed, in descent and burn".to_owned(), times.count.to_string()]);
    rows.extend(time_rows(&times));
    let timings = flight.recording.timings.iter();
    let points = timings.map(|timing| (flight.axis_s(timing.time_s), 1e3 * timing.solve_time_s)).collect();
    pictures
        .push(chart("Duration of each frame with a plan, ms", points, vec![1e3 * times.deadline_s]).svg());
    table(&["", "#"], &rows) + &charts(&pictures)
}
