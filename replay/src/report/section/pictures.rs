//! Every picture over time, by section.

use flight::computer::pilot::Pilot;
use flight::estimation::estimator::Estimate;
use onboard_sim::figure::Panel;
use protocol::log::flight_v1::{AidStatus, Measurements, TruthSample, Vector3};

use super::burn::{AHEAD_S, tracking_errors};
use super::estimate::vibration;
use super::{COMPONENTS, DEGREES, HEIGHT};
use crate::log::{Clock, ClockTime};
use crate::report::chart::{Chart, line};
use crate::report::track::Part::{Air, Burn, Whole};
use crate::report::track::{Flight, Part, Series, Thought, planned};

/// As much of a crew's note as stands beside its mark; the events have all of it.
const NOTE_LETTERS: usize = 40;

pub(super) const IGNITION: &str = "ignition";
pub(super) const TOUCHDOWN: &str = "touchdown";

/// A picture of a section.
pub(super) struct Picture<'a> {
    flight: &'a Flight,
    pub(super) section: &'static str,
    part: Part,
    pub(super) chart: Chart,
}

impl<'a> Picture<'a> {
    /// A picture over a part of the flight, with what happened and what went wrong in it.
    fn new(flight: &'a Flight, section: &'static str, part: Part, title: &str) -> Self {
        let mark = |at_s: Option<f64>, name: &str| Some((flight.axis_s(at_s?), name.to_owned()));
        let marks = [mark(flight.ignition_s, IGNITION), mark(flight.touchdown_s, TOUCHDOWN)];
        let (events, clocks) = (&flight.recording.events, &flight.recording.clocks);
        let notes =
            events.iter().filter(|(_, event)| event.name == "ground" && event.message.starts_with("note"));
        let notes = notes.map(|(log_s, event)| {
            let at = clocks.convert(ClockTime { clock: Clock::Log, time_s: *log_s }, Clock::Flight);
            // A station's flight is on the clock of its log.
            let at_s = at.map_or_else(|| flight.axis_s(*log_s), |at| at.time_s);
            let (_, text) = event.message.split_once(": ").unwrap_or_default();
            (at_s, text.chars().take(NOTE_LETTERS).collect())
        });
        let panel = Panel {
            x_label: flight.axis_name().to_owned(),
            marks: marks.into_iter().flatten().chain(notes).collect(),
            signs: flight.signs.clone(),
            ..Panel::default()
        };
        let full = matches!(section, "thrust" | "tracking");
        Self { flight, section, part, chart: Chart { title: title.to_owned(), panel, full, own_x: false } }
    }

    /// With one more line: its name, its class and its values.
    fn line(mut self, name: &str, class: &str, mut points: Series) -> Self {
        points.retain(|(at_s, _)| self.flight.has(self.part, self.flight.time_s(*at_s)));
        self.chart.panel.lines.push(line(name, class, points));
        self
    }

    /// With its only line.
    fn only(self, points: Series) -> Self {
        self.line("", "a", points)
    }

    fn limits(mut self, limits: impl IntoIterator<Item = f64>) -> Self {
        self.chart.panel.limits.extend(limits);
        self
    }
}

/// The pictures, in the order of their sections.
pub(super) fn all(flight: &Flight) -> Vec<Picture<'_>> {
    let mut pictures = of_landing(flight);
    pictures.extend(of_the_rest(flight));
    pictures
}

/// Those of the burn and of where it leads.
fn of_landing(flight: &Flight) -> Vec<Picture<'_>> {
    let mission = flight.pilot.as_ref().map(Pilot::mission);
    let over = |section, part, title: &str| Picture::new(flight, section, part, title);
    let predicted = |title: &str, actual: Option<f64>, value: &dyn Fn(&Thought) -> Option<f64>| {
        let values = flight.thought(value);
        let ends = [values.first(), values.last()];
        let actual = ends.into_iter().flatten().filter_map(|(at_s, _)| Some((*at_s, actual?))).collect();
        over("touchdown", Burn, title).line("predicted", "a", values).line("actual", "b", actual)
    };
    let lands = |thought: &Thought| {
        Some(flight.axis_s(thought.time_s + thought.plan.as_ref()?.left_s(thought.time_s)))
    };
    let touchdown_s = flight.touchdown_s.map(|at_s| flight.axis_s(at_s));
    let mut pictures = vec![
        over("first", Whole, "Height over the whole flight, m")
            .line("barometer", "thin", flight.framed(|frame| frame.input.measured.pressure_altitude_m))
            .line("feet", "a", flight.flown(|state| state[HEIGHT])),
        predicted(&format!("Touchdown, {}", flight.axis_name()), touchdown_s, &lands),
    ];

    let contact = flight.touchdown_s.and_then(|contact_s| {
        flight.track.iter().rfind(|sample| sample.time_s <= contact_s).map(|sample| sample.state)
    });
    for (component, (name, unit, factor)) in COMPONENTS.into_iter().enumerate() {
        let estimate = flight.thought(|thought| Some(factor * thought.state?[component]));
        let beside = if flight.recording.world.is_empty() { Series::new() } else { estimate };
        pictures.push(
            over("burn", Burn, &format!("{name}, {unit}"))
                .line("flown", "a", flight.flown(|state| factor * state[component]))
                .line("estimate", "b", beside),
        );
        if component != HEIGHT {
            pictures.push(predicted(
                &format!("{name} at touchdown, {unit}"),
                contact.map(|state| factor * state[component]),
                &|thought| Some(factor * planned(thought.plan.as_ref()?.states().last()?)[component]),
            ));
        }
    }
    for (axis, name) in ["pitch", "yaw"].into_iter().enumerate() {
        let limit = mission.map(|mission| mission.airframe.gimbal.limit_deg);
        let [actual, commanded] = gimbal_deg(flight, axis);
        pictures.push(
            over("burn", Burn, &format!("Gimbal {name}, deg"))
                .limits(limit.into_iter().flat_map(|limit| [-limit, limit]))
                .line("actual", "a", actual)
                .line("commanded", "b", commanded),
        );
    }
    if let Some((mission, ignition_s)) = mission.zip(flight.ignition_s) {
        let expected = flight.truth(|sample| {
            let since_s = sample.time_s - ignition_s;
            (since_s >= 0.0).then(|| mission.motor_curve.thrust_at_n(since_s - mission.ignition.delay_s))
        });
        pictures.push(
            over("thrust", Burn, "Thrust, N")
                .limits([mission.airframe.mass.loaded_kg * mission.gravity_m_s2])
                .line("actual", "c", flight.truth(|sample| Some(sample.thrust_n)))
                .line("expected", "b", expected)
                .line("inferred", "a", flight.thought(|thought| thought.thrust_n)),
        );
    }
    pictures
}

/// Those of solver, descent, sensors, battery and link.
fn of_the_rest(flight: &Flight) -> Vec<Picture<'_>> {
    let over = |section, part, title: &str| Picture::new(flight, section, part, title);
    let iterations = |thought: &Thought| thought.plan.as_ref().map(|_| thought.iterations as f64);
    let timings = &flight.recording.timings;
    let took = timings.iter().map(|timing| (flight.axis_s(timing.time_s), 1e3 * timing.solve_time_s));
    let apart_m = |ahead_s: f64| -> Series {
        let errors = tracking_errors(flight, ahead_s).into_iter();
        let apart_m = |[north, east, up, ..]: [f64; 7]| libm::hypot(libm::hypot(north, east), up);
        errors.map(|(time_s, error)| (flight.axis_s(time_s), apart_m(error))).collect()
    };
    // On the way up nothing estimates the wind.
    let wind = |thought: &Thought| {
        let falls = thought.phase.is_some_and(|phase| !phase.before_apogee());
        thought.estimate.filter(|_| falls).map(|estimate| estimate.wind_m_s)
    };
    let fin = |place: usize| flight.truth(move |sample| Some(DEGREES * sample.fins_actual_rad.get(place)?));
    let off = |value: &dyn Fn(&Measurements, &TruthSample) -> Option<f64>| {
        flight.framed(|frame| value(&frame.input.measured, flight.world_at(frame.input.time_s)?))
    };
    // East is against y.
    let fix = |along: fn(&Vector3) -> f64| {
        off(&|it, truth| Some(along(&it.gnss.as_ref()?.position_m) - along(&truth.state.position_m)))
    };
    let ratio = |aid: Option<AidStatus>| Some(aid?.test_ratio.min(3.0));
    let estimated =
        |value: fn(&Estimate) -> f64| flight.thought(|thought| thought.estimate.as_ref().map(value));
    vec![
        over("solver", Burn, "Newton iterations of each plan").only(flight.thought(iterations)),
        over("solver", Whole, "From the frame that posed each plan to the one that took it over, ms")
            .limits(timings.first().map(|timing| 1e3 * timing.deadline_s))
            .only(took.collect()),
        over("tracking", Burn, "Distance between the planned and the actual position, m")
            .line("0.5 s ahead", "b", apart_m(AHEAD_S[1]))
            .line("0.1 s ahead", "a", apart_m(AHEAD_S[0])),
        over("descent", Air, "Wind towards north, m/s")
            .line("true", "c", flight.truth(|sample| Some(sample.wind_m_s.x)))
            .line("estimated", "a", flight.thought(|thought| Some(wind(thought)?.x))),
        over("descent", Air, "Wind towards east, m/s")
            .line("true", "c", flight.truth(|sample| Some(-sample.wind_m_s.y)))
            .line("estimated", "a", flight.thought(|thought| Some(-wind(thought)?.y))),
        over("descent", Air, "Fins, actual, deg")
            .line("fin 1", "a", fin(0))
            .line("fin 2", "b", fin(1))
            .line("fin 3", "c", fin(2))
            .line("fin 4", "d", fin(3)),
        over("descent", Air, "Roll rate, deg/s")
            .only(flight.truth(|sample| Some(DEGREES * sample.state.rate_rad_s.x))),
        over("descent", Air, "Parachute, share open")
            .only(flight.truth(|sample| Some(sample.parachute_open_share))),
        over("descent", Air, "Sensed height less true height, m")
            .line(
                "barometer",
                "a",
                off(&|it, truth| Some(it.pressure_altitude_m? - truth.state.position_m.z)),
            )
            .line("lidar range", "c", off(&|it, truth| Some(it.lidar_range_m? - truth.height_m))),
        over("descent", Air, "Satellite position less true position, m")
            .line("north", "a", fix(|at| at.x))
            .line("east", "b", fix(|at| -at.y))
            .line("up", "c", fix(|at| at.z)),
        over("sensors", Whole, "Test ratio of each measurement; above 1 it was refused")
            .limits([1.0])
            .line("barometer", "thin", flight.estimated(|it| ratio(it.barometer)))
            .line("GNSS velocity", "a", flight.estimated(|it| ratio(it.gnss_velocity)))
            .line("GNSS position", "c", flight.estimated(|it| ratio(it.gnss_position)))
            .line("lidar", "b", flight.estimated(|it| ratio(it.lidar))),
        over("sensors", Whole, "Standard deviations of the estimate")
            .line("height, m", "a", estimated(|estimate| estimate.sigmas.position_m.z))
            .line("place, m", "c", estimated(|estimate| estimate.sigmas.position_m.xy().norm()))
            .line("velocity, m/s", "b", estimated(|estimate| estimate.sigmas.velocity_m_s.norm())),
        over("sensors", Whole, "Gyro bias as estimated, deg/s")
            .line("roll", "a", estimated(|estimate| DEGREES * estimate.gyro_bias_rad_s.x))
            .line("pitch", "b", estimated(|estimate| DEGREES * estimate.gyro_bias_rad_s.y))
            .line("yaw", "c", estimated(|estimate| DEGREES * estimate.gyro_bias_rad_s.z)),
        over("battery", Whole, "Battery, V").only(flight.framed(|frame| frame.input.battery_v)),
        Picture { chart: vibration(flight), ..over("battery", Whole, "") },
        over("link", Whole, "Age of the last heartbeat, s").only(flight.heard(|told| told.link_age_s)),
        over("link", Whole, "Frames lost, %").only(flight.heard(|told| Some(100.0 * told.link_loss?))),
        over("link", Whole, "Received, bytes/s").only(flight.heard(|told| told.link_rx_bytes_s)),
    ]
}

/// Actual and commanded angle of a gimbal's axis, deg.
pub(super) fn gimbal_deg(flight: &Flight, axis: usize) -> [Series; 2] {
    let deg = |angles_rad: &[f64]| angles_rad.get(axis).map(|rad| DEGREES * rad);
    if flight.recording.world.is_empty() {
        return [
            flight.heard(|told| deg(&told.gimbal_measured_rad)),
            flight.heard(|told| deg(&told.gimbal_commanded_rad)),
        ];
    }
    [
        flight.truth(|sample| deg(&sample.gimbal_actual_rad)),
        flight.truth(|sample| deg(&sample.gimbal_commanded_rad)),
    ]
}
