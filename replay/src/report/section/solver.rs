//! How long the ticks took, and the results of their solves.

use flight::guidance::controller::ControlLevel;
use protocol::log::v1;

use crate::info::{Info, SolveTimes};
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, paragraph, table};
use crate::report::track::Flight;

pub(super) fn html(flight: &Flight, info: &Info) -> String {
    if flight.from_apogee.is_some() {
        return plans(flight, info);
    }
    let Some(ticks) = &info.ticks else {
        return paragraph("The log has no controller ticks.");
    };
    let mut rows = vec![vec!["ticks".to_owned(), ticks.count.to_string()]];
    rows.extend(time_rows(&ticks.solve_time, "ticks"));
    rows.push(vec!["outputs dropped as too late".to_owned(), ticks.outputs_dropped.to_string()]);
    for named in &ticks.levels {
        rows.push(vec![format!("decided by {}", named.name), named.ticks.to_string()]);
    }
    for named in &ticks.solver_statuses {
        rows.push(vec![format!("solver: {}", named.name), named.ticks.to_string()]);
    }
    let recorded = &flight.recording.ticks;
    let over = |value: &dyn Fn(&protocol::log::v1::ControllerTick) -> f64| -> Vec<(f64, f64)> {
        recorded.iter().map(|tick| (flight.axis_s(tick.input.time_s), value(tick))).collect()
    };
    let chart = |title: &str, points| {
        let lines = vec![Line { name: "", class: "a", points }];
        let title = title.to_owned();
        Chart { title, x_label: flight.axis_name(), lines, marks: flight.marks(), ..Chart::default() }.svg()
    };
    table(&["", "#"], &rows)
        + &charts(&[
            chart("Solve time of each tick, ms", over(&|tick| 1e3 * tick.solve_time_s)),
            chart("Newton iterations of each tick", over(&|tick| f64::from(tick.output.solver.iterations))),
        ])
}

/// Durations as rows of a table; `what` names the operation.
fn time_rows(times: &SolveTimes, what: &str) -> [Vec<String>; 5] {
    let milliseconds = |s: f64| format!("{:.3} ms", 1e3 * s);
    [
        vec!["solve time, median".to_owned(), milliseconds(times.median_s)],
        vec!["solve time, 99 of 100 within".to_owned(), milliseconds(times.p99_s)],
        vec!["solve time, longest".to_owned(), milliseconds(times.max_s)],
        vec!["deadline".to_owned(), milliseconds(times.deadline_s)],
        vec![format!("{what} over their deadline"), times.over_deadline.to_string()],
    ]
}

/// The plans of a flight computer: every tenth frame of the burn.
fn plans(flight: &Flight, info: &Info) -> String {
    let idle = u32::from(ControlLevel::Idle.index());
    let plans: Vec<_> = flight.recording.ticks.iter().filter(|tick| tick.output.level != idle).collect();
    if plans.is_empty() {
        return paragraph("The flight computer planned no landing.");
    }
    let count = |level: ControlLevel| {
        plans.iter().filter(|tick| tick.output.level == u32::from(level.index())).count()
    };
    let mut rows = vec![vec!["plans".to_owned(), plans.len().to_string()]];
    for level in ControlLevel::ALL {
        if count(level) > 0 {
            rows.push(vec![format!("decided by {}", level.name()), count(level).to_string()]);
        }
    }
    let iterations = |tick: &&v1::ControllerTick| f64::from(tick.output.solver.iterations);
    let most = plans.iter().map(iterations).fold(0.0, f64::max);
    rows.push(vec!["most iterations of a plan".to_owned(), format!("{most:.0}")]);
    let chart = |title: &str, points: Vec<(f64, f64)>, limits: Vec<f64>| Chart {
        title: title.to_owned(),
        x_label: flight.axis_name(),
        lines: vec![Line { name: "", class: "a", points }],
        marks: flight.marks(),
        limits,
        ..Chart::default()
    };
    let points = plans.iter().map(|tick| (flight.axis_s(tick.input.time_s), iterations(tick))).collect();
    let mut pictures = vec![chart("Newton iterations of each plan", points, Vec::new()).svg()];
    let Some(times) = info.frames.and_then(|frames| frames.solve_time) else {
        return table(&["", "#"], &rows)
            + &charts(&pictures)
            + &paragraph(
                "This flight was simulated without a clock: solve times and deadlines are not in its log.",
            );
    };
    rows.push(vec!["frames timed, in descent and burn".to_owned(), times.count.to_string()]);
    rows.extend(time_rows(&times, "frames"));
    let timings = flight.recording.timings.iter();
    let points = timings.map(|timing| (flight.axis_s(timing.time_s), 1e3 * timing.solve_time_s)).collect();
    pictures
        .push(chart("Duration of each frame with a plan, ms", points, vec![1e3 * times.deadline_s]).svg());
    table(&["", "#"], &rows) + &charts(&pictures)
}
