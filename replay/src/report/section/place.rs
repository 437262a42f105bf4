//! Where the vehicle was: the events of its flight, and the place from above.

use flight::rules::phase::Phase;
use protocol::field::{Field, Kind};
use protocol::motion::Degrees;
use protocol::reported::FlightEvent;
use sim::wire::field::{PAD_FACT, RUN_FACT, pad_of};

use crate::report::chart::{Chart, Line, line};
use crate::report::html::{paragraph, table};
use crate::report::track::{Flight, Part, Sample, State, planned};

/// A stage of the flight: its name, its class, and whether a phase belongs to it.
type Stage = (&'static str, &'static str, fn(Phase) -> bool);

const STAGES: [Stage; 4] = [
    ("ascent", "thin", |phase| phase.before_apogee() && !phase.on_pad()),
    ("fall", "a", |phase| phase.in_descent() || phase == Phase::Ignition),
    ("burn", "b", |phase| phase == Phase::Powered),
    ("parachute", "d", |phase| phase == Phase::Chute),
];

/// The title of the map.
const COMPLETE: &str = "Place, north up, m";
/// How far from the pad a field is drawn in the log of a station, which has no fence, m.
const FIELD_REACH_M: f64 = 500.0;

/// The place from above: inside its fence, and closer.
pub(super) fn maps(flight: &Flight) -> String {
    let fence_m = flight.pilot.as_ref().map(|pilot| pilot.mission().gate.fence_radius_m);
    let fence_m = fence_m.filter(|fence_m| fence_m.is_finite());
    let fence = fence_m.map(|fence_m| {
        let corner = |corner: u32| {
            let (sin, cos) = libm::sincos(f64::from(corner).to_radians());
            (fence_m * sin, fence_m * cos)
        };
        line(&format!("fence {fence_m:.0} m"), "fence", (0..=360).step_by(5).map(corner).collect())
    });
    let ignited = |time_s: f64| flight.ignition_s.is_some_and(|ignition_s| time_s >= ignition_s);
    let wind = flight
        .decisions
        .iter()
        .find(|decision| ignited(decision.time_s))
        .and_then(|decision| decision.estimate);
    // East is against y.
    let wind = wind.map(|estimate| (-estimate.wind_m_s.y, estimate.wind_m_s.x));
    let arrow = wind.map(|(east, north)| (east, north, format!("wind {:.1} m/s", libm::hypot(east, north))));
    let picture = |title: &str, more: Vec<Line>| Chart {
        title: title.to_owned(),
        axes: "1 0",
        x_name: "east, m",
        size_px: Some((140.0, 140.0)),
        places: places(flight),
        lines: stages(flight).into_iter().chain(more).collect(),
        arrow: arrow.clone(),
        ..Chart::default()
    };
    let field = field_lines(flight, fence_m.map_or(FIELD_REACH_M, |fence_m| 2.0 * fence_m));
    let outside: Vec<Line> = fence.into_iter().chain(field).collect();
    let closer = || picture("The same closer, m", Vec::new()).svg() + &field_distances(flight);
    let closer = (!outside.is_empty()).then(closer).unwrap_or_default();
    picture(COMPLETE, outside).svg() + &closer
}

/// The field around the pad that the log has.
fn field_of(flight: &Flight) -> Option<(Field, Degrees)> {
    let facts = &flight.recording.head.run;
    let pad = flight.pilot.as_ref().map(|pilot| pad_of(pilot.mission()));
    let pad = pad.or_else(|| facts.get(PAD_FACT)?.parse().ok())?;
    Some((Field::parse(facts.get(RUN_FACT)?, pad, RUN_FACT).ok()?, pad))
}

/// The lines of the field east and north of the pad, m, clipped to a square about it, so that the
/// picture does not shrink.
fn field_lines(flight: &Flight, half_m: f64) -> Vec<Line> {
    const GAP: (f64, f64) = (f64::NAN, f64::NAN);
    let lines = field_of(flight).into_iter().flat_map(|(field, pad)| field.lines_m(pad).collect::<Vec<_>>());
    let drawn = lines.map(|(kind, points): (Kind, Vec<(f64, f64)>)| {
        let segments = points.windows(2).filter_map(|pair| clipped([pair[0], pair[1]], half_m));
        let points = segments.flat_map(|[from, to]| [(from.1, from.0), (to.1, to.0), GAP]).collect();
        line(kind.name(), if kind == Kind::CrowdLine { "fence" } else { "thin" }, points)
    });
    drawn.filter(|line| line.points.iter().any(|at| at.0.is_finite())).collect()
}

/// The part of a segment inside a square about the origin (Y.-D. Liang and B. A. Barsky, "A new
/// concept and method for line clipping", ACM Transactions on Graphics 3, 1984).
fn clipped([from, to]: [(f64, f64); 2], half_m: f64) -> Option<[(f64, f64); 2]> {
    let along = (to.0 - from.0, to.1 - from.1);
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for (start, along) in [(from.0, along.0), (from.1, along.1)] {
        if along.abs() > 0.0 {
            let [one, other] = [-half_m, half_m].map(|side| (side - start) / along);
            (enters, leaves) = (enters.max(one.min(other)), leaves.min(one.max(other)));
        } else if start.abs() > half_m {
            return None;
        }
    }
    let at = |share: f64| (from.0 + along.0 * share, from.1 + along.1 * share);
    (enters <= leaves).then(|| [at(enters), at(leaves)])
}

/// Distances of the touchdown from the lines of the field.
fn field_distances(flight: &Flight) -> String {
    let at = flight.contact().zip(field_of(flight));
    at.map_or_else(String::new, |([north, east, ..], (field, pad))| {
        format!("<p>Touchdown to the nearest {}</p>\n", field.distances(pad, (north, east)))
    })
}

/// The pad, where the first plan ends, and where it came down.
fn places(flight: &Flight) -> Vec<(f64, f64, &'static str, String)> {
    let end = flight.made().first().and_then(|(_, plan)| Some(planned(plan.states().last()?)));
    let known = [(Some([0.0; 7]), "pad"), (end, "planned"), (flight.contact(), "touchdown")];
    let place = |(state, kind): (Option<State>, &'static str)| {
        let [north, east, ..] = state?;
        Some((east, north, kind, kind.to_owned()))
    };
    known.into_iter().filter_map(place).collect()
}

/// The flown path from above up to contact; another stage ends a line.
fn stages(flight: &Flight) -> Vec<Line> {
    let flown = || flight.track.iter().filter(|sample| flight.has(Part::Air, sample.time_s));
    let lines = STAGES.iter().map(|(name, class, belongs)| {
        let point = |sample: &Sample| {
            let [north, east, ..] = sample.state;
            if sample.phase.is_some_and(belongs) { (east, north) } else { (f64::NAN, f64::NAN) }
        };
        line(name, class, flown().map(point).collect())
    });
    lines.filter(|line| line.points.iter().any(|point| point.0.is_finite())).collect()
}

/// Events that the page does not show.
const UNIMPORTANT: [&str; 3] = ["falls", "ready", "over"];

/// The events as the vehicle reports them, each with the motion of the track then.
pub(super) fn events_table(flight: &Flight) -> String {
    if flight.events.is_empty() {
        return paragraph("The vehicle reported no times and heights of events.");
    }
    let row = |event: &FlightEvent| {
        let time_s = flight.time_s(event.at_s);
        let then = flight.track.iter().find(|sample| sample.time_s >= time_s).or(flight.track.last());
        let [north, east, _, level_m_s, up_m_s, ..] = then.map_or([f64::NAN; 7], |sample| sample.state);
        let tenth = |value: f64| format!("{:.1}", (10.0 * value).round() / 10.0 + 0.0);
        let cells = [event.height_m, north, east, level_m_s, up_m_s].map(tenth);
        [event.name.to_owned(), format!("{:.2}", event.at_s)].into_iter().chain(cells).collect()
    };
    let heads = ["event", "#T+, s", "#height, m", "#north, m", "#east, m", "#level, m/s", "#up, m/s"];
    let shown = flight.events.iter().filter(|event| !UNIMPORTANT.contains(&event.name));
    table(&heads, shown.map(row).collect::<Vec<Vec<String>>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_hand_a_segment_is_clipped_at_the_sides_of_the_square() {
        let clip = |from, to| clipped([from, to], 10.0);
        assert_eq!(clip((-5.0, 0.0), (5.0, 8.0)), Some([(-5.0, 0.0), (5.0, 8.0)]));
        assert_eq!(clip((-20.0, 4.0), (20.0, 4.0)), Some([(-10.0, 4.0), (10.0, 4.0)]));
        assert_eq!(clip((0.0, 0.0), (40.0, 20.0)), Some([(0.0, 0.0), (10.0, 5.0)]));
        assert_eq!(clip((11.0, -5.0), (11.0, 5.0)), None, "beside it");
        assert_eq!(clip((0.0, 25.0), (25.0, 0.0)), None, "past its corner");
    }

    /// A station has no place of a vehicle on its pad: from there to the rail nothing flew.
    #[test]
    fn a_phase_in_flight_has_one_stage_and_one_on_the_pad_has_none() {
        for phase in Phase::ALL {
            let stages = STAGES.iter().filter(|(.., belongs)| belongs(phase)).count();
            let on_ground = phase.on_pad() || matches!(phase, Phase::Touchdown | Phase::Safed);
            assert_eq!(stages, usize::from(!on_ground), "{phase:?}");
        }
    }
}
