//! Every picture over time, by section.

use avionics::log::logged::state_from_log;
use flight::computer::pilot::Pilot;
use flight::estimation::estimator::Estimate;
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::rigid::RigidState;
use protocol::log::flight_v1::AidStatus;
use protocol::reported::FlightEvent;

use super::{COMPONENTS, DEGREES, HEIGHT};
use crate::findings::FINS;
use crate::log::{Clock, ClockTime};
use crate::report::chart::{Chart, TIME, line};
use crate::report::track::Part::{Air, Burn, Whole};
use crate::report::track::{Decision, Flight, Part, Series, planned};

/// As much of a crew's note as stands beside its mark; the events have all of it.
const NOTE_LETTERS: usize = 40;

/// The first plan of the landing burn.
pub(super) const PLANNED: &str = "plan at ignition";

/// A picture of a section.
pub(super) struct Picture<'a> {
    flight: &'a Flight,
    pub(super) section: &'static str,
    part: Part,
    pub(super) chart: Chart,
}

impl<'a> Picture<'a> {
    /// A picture over a part of the flight, with its phases, what happened and what went wrong in
    /// it.
    fn new(flight: &'a Flight, section: &'static str, part: Part, title: &str) -> Self {
        let mark = |at_s: Option<f64>, name: &str| Some((flight.axis_s(at_s?), name.to_owned()));
        let marks = [mark(flight.ignition_s, "ignition"), mark(flight.touchdown_s, "touchdown")];
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
        let chart = Chart {
            title: title.to_owned(),
            axes: TIME,
            x_name: flight.axis_name(),
            marks: marks.into_iter().flatten().chain(notes).collect(),
            signs: flight.signs.clone(),
            spans: flight.spans.clone(),
            ..Chart::default()
        };
        Self { flight, section, part, chart }
    }

    /// With one more line: its name, its class and its values.
    fn line(mut self, name: &str, class: &'static str, mut points: Series) -> Self {
        points.retain(|(at_s, _)| self.flight.has(self.part, self.flight.time_s(*at_s)));
        self.chart.lines.push(line(name, class, points));
        self
    }

    /// With its only line.
    fn only(self, points: Series) -> Self {
        self.line("", "a", points)
    }

    fn limits(mut self, limits: impl IntoIterator<Item = f64>) -> Self {
        self.chart.limits.extend(limits);
        self
    }
}

/// The pictures, in the order of their sections.
pub(super) fn all(flight: &Flight) -> Vec<Picture<'_>> {
    let mut pictures = of_landing(flight);
    pictures.extend(of_the_rest(flight));
    pictures
}

/// Those of the whole flight and of the burn.
fn of_landing(flight: &Flight) -> Vec<Picture<'_>> {
    let mission = flight.pilot.as_ref().map(Pilot::mission);
    let over = |section, part, title: &str| Picture::new(flight, section, part, title);
    let mut height = over("first", Whole, "Height over the whole flight, m")
        .line("barometer", "thin", flight.framed(|frame| frame.input.measured.pressure_altitude_m))
        .line("flown", "a", flight.flown(|state| state[HEIGHT]))
        .line(PLANNED, "b", flight.planned_first(|state| state[HEIGHT]));
    let shown = flight.events.iter().filter(|event| ["apogee", "ignition"].contains(&event.name));
    let place = |&FlightEvent { name, at_s, height_m, .. }: &FlightEvent| {
        (at_s, height_m, "place", format!("{name} {height_m:.0} m"))
    };
    (height.chart.places, height.chart.named, height.chart.size_px) =
        (shown.map(place).collect(), true, Some((640.0, 130.0)));
    let mut pictures = vec![height];
    for (component, (name, unit, factor)) in COMPONENTS.into_iter().enumerate() {
        pictures.push(
            over("burn", Burn, &format!("{name}, {unit}"))
                .line(PLANNED, "b", flight.planned_first(|state| factor * state[component]))
                .line("flown", "a", flight.flown(|state| factor * state[component])),
        );
    }
    for (axis, name) in ["Gimbal pitch, deg", "Gimbal yaw, deg"].into_iter().enumerate() {
        let limit = mission.map(|mission| mission.airframe.gimbal.limit_deg);
        let limits = limit.into_iter().flat_map(|limit| [-limit, limit]);
        pictures.push(surface(over("burn", Burn, name), axis).limits(limits));
    }
    if let Some((mission, ignition_s)) = mission.zip(flight.ignition_s.filter(|_| flight.is_ignited())) {
        let expected = flight.framed(|frame| {
            let since_s = frame.input.time_s - ignition_s;
            (since_s >= 0.0).then(|| mission.motor_curve.thrust_at_n(since_s - mission.ignition.delay_s))
        });
        pictures.push(
            over("burn", Burn, "Thrust, N; dashed the weight")
                .limits([mission.airframe.mass.loaded_kg * STANDARD_GRAVITY_M_S2])
                .line("actual", "c", flight.truth(|sample| Some(sample.thrust_n)))
                .line("expected", "b", expected)
                .line("inferred", "a", flight.decision(|decision| decision.thrust_n)),
        );
    }
    if let Some((contact, contact_s)) = flight.contact().zip(flight.touchdown_s) {
        // After contact the ground determines the motion.
        let off = |component: usize| {
            flight.decision(|decision| {
                let plan = decision.plan.as_ref().filter(|_| decision.time_s < contact_s)?;
                Some(planned(plan.states().last()?)[component] - contact[component])
            })
        };
        let ends = over("burn", Burn, "Where each plan ends, less where it did, m");
        pictures.push(ends.line("north", "a", off(0)).line("east", "b", off(1)));
    }
    pictures
}

/// The measured and the commanded angle of a servo.
fn surface(picture: Picture<'_>, surface: usize) -> Picture<'_> {
    let [actual, commanded] = surface_deg(picture.flight, surface);
    picture.line("commanded", "b", commanded).line("actual", "a", actual)
}

/// Those of fall, sensors, solver, battery and link.
fn of_the_rest(flight: &Flight) -> Vec<Picture<'_>> {
    let over = |section, part, title: &str| Picture::new(flight, section, part, title);
    let iterations = |decision: &Decision| decision.plan.as_ref().map(|_| decision.iterations as f64);
    let timings = &flight.recording.timings;
    let took = timings.iter().map(|timing| (flight.axis_s(timing.time_s), 1e3 * timing.solve_time_s));
    // On the way up nothing estimates the wind.
    let wind = |decision: &Decision| {
        let falls = decision.phase.is_some_and(|phase| !phase.before_apogee());
        decision.estimate.filter(|_| falls).map(|estimate| estimate.wind_m_s)
    };
    // East is against y.
    let wrong = |of: fn(&RigidState, &RigidState) -> f64| {
        let truth = |decision: &Decision| Some(state_from_log(&flight.world_at(decision.time_s)?.state));
        flight.decision(|decision| Some(of(&decision.estimate?.state, &truth(decision)?)))
    };
    let ratio = |aid: Option<AidStatus>| Some(aid?.test_ratio.min(3.0));
    let estimated =
        |value: fn(&Estimate) -> f64| flight.decision(|decision| decision.estimate.as_ref().map(value));
    let fin = |fin: usize| {
        let [actual, _] = surface_deg(flight, 2 + fin);
        actual
    };
    let mut pictures = vec![
        over("fall", Air, "Wind towards north, m/s")
            .line("true", "c", flight.truth(|sample| Some(sample.wind_m_s.x)))
            .line("estimated", "a", flight.decision(|decision| Some(wind(decision)?.x))),
        over("fall", Air, "Wind towards east, m/s")
            .line("true", "c", flight.truth(|sample| Some(-sample.wind_m_s.y)))
            .line("estimated", "a", flight.decision(|decision| Some(-wind(decision)?.y))),
        over("fall", Air, "Fins, deg")
            .line("fin 1", "a", fin(0))
            .line("fin 2", "b", fin(1))
            .line("fin 3", "c", fin(2))
            .line("fin 4", "d", fin(3)),
        over("fall", Air, "Roll rate, deg/s")
            .only(estimated(|estimate| DEGREES * estimate.state.rate_rad_s.x)),
        over("fall", Air, "Parachute, share open")
            .only(flight.truth(|sample| Some(sample.parachute_open_share))),
        over("sensors", Whole, "Test ratio, above 1 refused")
            .limits([1.0])
            .line("barometer", "thin", flight.estimated(|it| ratio(it.barometer)))
            .line("GNSS velocity", "a", flight.estimated(|it| ratio(it.gnss_velocity)))
            .line("GNSS position", "c", flight.estimated(|it| ratio(it.gnss_position)))
            .line("lidar", "b", flight.estimated(|it| ratio(it.lidar))),
        over("sensors", Whole, "Standard deviations, m and m/s")
            .line("height", "a", estimated(|estimate| estimate.sigmas.position_m.z))
            .line("place", "c", estimated(|estimate| estimate.sigmas.position_m.xy().norm()))
            .line("velocity", "b", estimated(|estimate| estimate.sigmas.velocity_m_s.norm())),
        over("sensors", Whole, "Gyro bias, estimated, deg/s")
            .line("roll", "a", estimated(|estimate| DEGREES * estimate.gyro_bias_rad_s.x))
            .line("pitch", "b", estimated(|estimate| DEGREES * estimate.gyro_bias_rad_s.y))
            .line("yaw", "c", estimated(|estimate| DEGREES * estimate.gyro_bias_rad_s.z)),
        over("sensors", Air, "Estimated place less true, m")
            .line("north", "a", wrong(|estimate, truth| estimate.position_m.x - truth.position_m.x))
            .line("east", "b", wrong(|estimate, truth| truth.position_m.y - estimate.position_m.y))
            .line("up", "c", wrong(|estimate, truth| estimate.position_m.z - truth.position_m.z)),
        over("solver", Burn, "Newton iterations, of each plan").only(flight.decision(iterations)),
        over("solver", Burn, "From posing a plan to taking it over, ms")
            .limits(timings.first().map(|timing| 1e3 * timing.deadline_s))
            .only(took.collect()),
        over("battery", Whole, "Battery voltage, V").only(flight.framed(|frame| frame.input.battery_v)),
        over("link", Whole, "Age of the last heartbeat, s").only(flight.received(|sample| sample.link_age_s)),
        over("link", Whole, "Frames lost, %").only(flight.received(|sample| Some(100.0 * sample.link_loss?))),
        over("link", Whole, "Received, bytes/s").only(flight.received(|sample| sample.link_rx_bytes_s)),
    ];
    // A fin that did not follow has a picture of its own.
    let stuck = (0..4).filter(|fin| flight.shown.contains(&FINS[*fin]));
    pictures.extend(stuck.map(|fin| surface(over("fall", Air, &format!("Fin {}, deg", fin + 1)), 2 + fin)));
    pictures
}

/// Actual and commanded angle of gimbal pitch and yaw, and of the fins, deg. Without a simulated
/// truth actual is what the servos report.
pub(super) fn surface_deg(flight: &Flight, surface: usize) -> [Series; 2] {
    let deg = |gimbal_rad: &[f64], fins_rad: &[f64]| {
        let of_fins = || fins_rad.get(surface.checked_sub(2)?);
        Some(DEGREES * gimbal_rad.get(surface).or_else(of_fins)?)
    };
    let recording = &flight.recording;
    if !recording.world.is_empty() {
        [
            flight.truth(|sample| deg(&sample.gimbal_actual_rad, &sample.fins_actual_rad)),
            flight.truth(|sample| deg(&sample.gimbal_commanded_rad, &sample.fins_commanded_rad)),
        ]
    } else if !recording.frames.is_empty() {
        [
            flight.framed(|frame| deg(&frame.input.gimbal_rad, &frame.input.fins_rad)),
            flight.framed(|frame| deg(&frame.output.gimbal_rad, &frame.output.fins_rad)),
        ]
    } else {
        [
            flight.received(|sample| deg(&sample.gimbal_measured_rad, &sample.fin_measured_rad)),
            flight.received(|sample| deg(&sample.gimbal_commanded_rad, &sample.fin_commanded_rad)),
        ]
    }
}
