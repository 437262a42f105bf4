//! Every picture over time, by section.

use flight::computer::pilot::Pilot;
use nalgebra::Vector2;

use super::burn::{AHEAD_S, tracking_errors};
use super::estimate::vibration;
use super::{COMPONENTS, DEGREES, HEIGHT};
use crate::report::chart::{Chart, Line};
use crate::report::track::Part::{Air, Burn, Whole};
use crate::report::track::{Flight, Part, Series, Thought, named_aids, planned};

/// Name and class of a line, and its values.
type Row = (&'static str, &'static str, Series);

/// Collects the pictures of a flight.
struct Pictures<'a> {
    flight: &'a Flight,
    /// Each with its section.
    all: Vec<(&'static str, Chart)>,
}

impl Pictures<'_> {
    /// A picture of a section over a part of the flight, with its horizontal limits and its lines.
    fn draw<const N: usize>(
        &mut self,
        section: &'static str,
        part: Part,
        title: &str,
        limits: &[f64],
        lines: [Row; N],
    ) {
        let lines = lines.into_iter().map(|(name, class, points)| Line { name, class, points }).collect();
        let chart = Chart {
            limits: limits.to_vec(),
            full: matches!(section, "thrust" | "tracking"),
            ..self.flight.over_time(part, title, lines)
        };
        self.all.push((section, chart));
    }
}

/// The pictures, each with its section.
pub(super) fn all(flight: &Flight) -> Vec<(&'static str, Chart)> {
    let mut pictures = Pictures { flight, all: Vec::new() };
    burn(flight, &mut pictures);
    plans(flight, &mut pictures);
    descent(flight, &mut pictures);
    sensors(flight, &mut pictures);
    pictures.all
}

/// What flew, and the thrust.
fn burn(flight: &Flight, draw: &mut Pictures<'_>) {
    let mission = flight.pilot.as_ref().map(Pilot::mission);
    let barometer = flight.framed(|frame| frame.input.measured.pressure_altitude_m);
    let height = [("barometer", "thin", barometer), ("feet", "a", flight.flown(|state| state[HEIGHT]))];
    draw.draw("first", Whole, "Height over the whole flight, m", &[], height);

    for (component, (name, unit, factor)) in COMPONENTS.into_iter().enumerate() {
        let estimate = flight.thought(|thought| Some(factor * thought.state?[component]));
        let beside = if flight.recording.world.is_empty() { Series::new() } else { estimate };
        let flown = flight.flown(|state| factor * state[component]);
        draw.draw(
            "burn",
            Burn,
            &format!("{name}, {unit}"),
            &[],
            [("flown", "a", flown), ("estimate", "b", beside)],
        );
    }
    for (axis, name) in ["pitch", "yaw"].into_iter().enumerate() {
        let limit = mission.map(|mission| mission.airframe.gimbal.limit_deg);
        let limits: Vec<f64> = limit.into_iter().flat_map(|limit| [-limit, limit]).collect();
        let [actual, commanded] = gimbal_deg(flight, axis);
        let lines = [("actual", "a", actual), ("commanded", "b", commanded)];
        draw.draw("burn", Burn, &format!("Gimbal {name}, deg"), &limits, lines);
    }

    if let Some((mission, ignition_s)) = mission.zip(flight.ignition_s) {
        let expected = flight.truth(|sample| {
            let since_s = sample.time_s - ignition_s;
            (since_s >= 0.0).then(|| mission.motor_curve.thrust_at_n(since_s - mission.ignition.delay_s))
        });
        let weight_n = mission.airframe.mass.loaded_kg * mission.gravity_m_s2;
        let lines = [
            ("actual", "c", flight.truth(|sample| Some(sample.thrust_n))),
            ("expected", "b", expected),
            ("inferred", "a", flight.thought(|thought| thought.thrust_n)),
        ];
        draw.draw("thrust", Burn, "Thrust, N", &[weight_n], lines);
    }
}

/// What the plans predicted, and how they were solved.
fn plans(flight: &Flight, draw: &mut Pictures<'_>) {
    let mut predicted = |title: &str, actual: Option<f64>, value: &dyn Fn(&Thought) -> Option<f64>| {
        let values = flight.thought(value);
        let ends = [values.first(), values.last()];
        let actual = ends.into_iter().flatten().filter_map(|(at_s, _)| Some((*at_s, actual?))).collect();
        let lines = [("predicted", "a", values), ("actual", "b", actual)];
        draw.draw("touchdown", Burn, title, &[], lines);
    };
    predicted(
        &format!("Touchdown, {}", flight.axis_name()),
        flight.touchdown_s.map(|at_s| flight.axis_s(at_s)),
        &|thought| Some(flight.axis_s(thought.time_s + thought.plan.as_ref()?.left_s(thought.time_s))),
    );
    let contact = flight.touchdown_s.and_then(|contact_s| {
        flight.track.iter().rfind(|sample| sample.time_s <= contact_s).map(|sample| sample.state)
    });
    for (component, (name, unit, factor)) in COMPONENTS.into_iter().enumerate() {
        if component != HEIGHT {
            predicted(
                &format!("{name} at touchdown, {unit}"),
                contact.map(|state| factor * state[component]),
                &|thought| Some(factor * planned(thought.plan.as_ref()?.states().last()?)[component]),
            );
        }
    }

    let iterations = flight.thought(|thought| thought.plan.as_ref().map(|_| thought.iterations as f64));
    draw.draw("solver", Burn, "Newton iterations of each plan", &[], [("", "a", iterations)]);
    let timings = &flight.recording.timings;
    let took = timings.iter().map(|timing| (flight.axis_s(timing.time_s), 1e3 * timing.solve_time_s));
    let deadline = timings.first().map(|timing| 1e3 * timing.deadline_s);
    let title = "From the frame that posed each plan to the one that took it over, ms";
    draw.draw("solver", Whole, title, deadline.as_slice(), [("", "a", took.collect())]);

    let [near, far] = AHEAD_S.map(|ahead_s| -> Series {
        let errors = tracking_errors(flight, ahead_s).into_iter();
        let apart_m = |[north, east, up, ..]: [f64; 7]| libm::hypot(libm::hypot(north, east), up);
        errors.map(|(time_s, error)| (flight.axis_s(time_s), apart_m(error))).collect()
    });
    let lines = [("0.5 s ahead", "b", far), ("0.1 s ahead", "a", near)];
    draw.draw("tracking", Burn, "Distance between the planned and the actual position, m", &[], lines);
}

/// Along a direction of the ground.
type Along = fn(&Vector2<f64>) -> f64;

/// The way down: wind, fins, roll, and what was sensed against the truth.
fn descent(flight: &Flight, draw: &mut Pictures<'_>) {
    // East is against y.
    let winds: [(&str, Along); 2] = [("north", |wind| wind.x), ("east", |wind| -wind.y)];
    for (towards, along) in winds {
        let wind = flight.truth(|sample| Some(along(&[sample.wind_m_s.x, sample.wind_m_s.y].into())));
        // On the way up nothing estimates the wind.
        let falls = |thought: &Thought| thought.phase.is_some_and(|phase| !phase.before_apogee());
        let estimated =
            flight.thought(|thought| Some(along(&thought.estimate.filter(|_| falls(thought))?.wind_m_s)));
        let lines = [("true", "c", wind), ("estimated", "a", estimated)];
        draw.draw("descent", Air, &format!("Wind towards {towards}, m/s"), &[], lines);
    }
    let fins = [("fin 1", "a"), ("fin 2", "b"), ("fin 3", "c"), ("fin 4", "d")];
    let fin = |place: usize| {
        let (name, class) = fins[place];
        (name, class, flight.truth(|sample| Some(DEGREES * sample.fins_actual_rad.get(place)?)))
    };
    draw.draw("descent", Air, "Fins, actual, deg", &[], [fin(0), fin(1), fin(2), fin(3)]);
    let roll = flight.truth(|sample| Some(DEGREES * sample.state.rate_rad_s.x));
    draw.draw("descent", Air, "Roll rate, deg/s", &[], [("", "a", roll)]);
    let parachute = flight.truth(|sample| Some(sample.parachute_open_share));
    draw.draw("descent", Air, "Parachute, share open", &[], [("", "a", parachute)]);
    let barometer = flight.framed(|frame| {
        let sensed_m = frame.input.measured.pressure_altitude_m?;
        Some(sensed_m - flight.world_at(frame.input.time_s)?.state.position_m.z)
    });
    let lidar = flight.framed(|frame| {
        let sensed_m = frame.input.measured.lidar_range_m?;
        Some(sensed_m - flight.world_at(frame.input.time_s)?.height_m)
    });
    let lines = [("barometer", "a", barometer), ("lidar range", "c", lidar)];
    draw.draw("descent", Air, "Sensed height less true height, m", &[], lines);
    let fix = |factors: [f64; 3]| {
        flight.framed(|frame| {
            let sensed = &frame.input.measured.gnss.as_ref()?.position_m;
            let actual = &flight.world_at(frame.input.time_s)?.state.position_m;
            let [north, west, up] = factors;
            Some(north * (sensed.x - actual.x) + west * (sensed.y - actual.y) + up * (sensed.z - actual.z))
        })
    };
    draw.draw(
        "descent",
        Air,
        "Satellite position less true position, m",
        &[],
        [
            ("north", "a", fix([1.0, 0.0, 0.0])),
            ("east", "b", fix([0.0, -1.0, 0.0])),
            ("up", "c", fix([0.0, 0.0, 1.0])),
        ],
    );
}

/// What the estimator made of its sensors; battery, vibration and link.
fn sensors(flight: &Flight, draw: &mut Pictures<'_>) {
    let names = flight.pilot.as_ref().map(|pilot| named_aids(pilot).map(|(name, _)| name));
    let ratios = |place: usize, class| {
        let ratios = flight.test_ratios[place].iter();
        let drawn = ratios.map(|(time_s, ratio)| (flight.axis_s(*time_s), ratio.min(3.0))).collect();
        (names.map_or("", |names| names[place]), class, drawn)
    };
    let lines = [ratios(0, "thin"), ratios(1, "a"), ratios(2, "c"), ratios(3, "b")];
    draw.draw("sensors", Whole, "Test ratio of each measurement; above 1 it was refused", &[1.0], lines);
    draw.draw(
        "sensors",
        Whole,
        "Standard deviations of the estimate",
        &[],
        [
            ("height, m", "a", flight.thought(|thought| Some(thought.estimate?.sigmas.position_m.z))),
            (
                "place, m",
                "c",
                flight.thought(|thought| Some(thought.estimate?.sigmas.position_m.xy().norm())),
            ),
            (
                "velocity, m/s",
                "b",
                flight.thought(|thought| Some(thought.estimate?.sigmas.velocity_m_s.norm())),
            ),
        ],
    );
    let bias =
        |axis: usize| flight.thought(|thought| Some(DEGREES * thought.estimate?.gyro_bias_rad_s[axis]));
    let lines = [("roll", "a", bias(0)), ("pitch", "b", bias(1)), ("yaw", "c", bias(2))];
    draw.draw("sensors", Whole, "Gyro bias as estimated, deg/s", &[], lines);
    let battery = flight.framed(|frame| frame.input.battery_v);
    draw.draw("battery", Whole, "Battery, V", &[], [("", "a", battery)]);
    draw.all.push(("battery", vibration(flight)));

    let age = flight.heard(|told| told.link_age_s);
    draw.draw("link", Whole, "Age of the last heartbeat, s", &[], [("", "a", age)]);
    let loss = flight.heard(|told| told.link_loss.map(|loss| 100.0 * loss));
    draw.draw("link", Whole, "Frames lost, %", &[], [("", "a", loss)]);
    let received = flight.heard(|told| told.link_rx_bytes_s);
    draw.draw("link", Whole, "Received, bytes/s", &[], [("", "a", received)]);
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
