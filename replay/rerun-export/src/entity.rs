//! The entity paths of the recording. Names of plots contain their unit.

/// The space: x as in the log, y to the left of it, z up, in metres; the origin is at altitude 0.
pub const WORLD: &str = "world";
/// The ground and the pad, drawn where the feet stand when the altitude is 0.
pub const PAD: &str = "world/pad";
/// The circle that a touchdown must lie in.
pub const PAD_LIMIT: &str = "world/pad/limit";
/// The pose of the rocket: its centre of gravity, its x axis towards the nose.
pub const ROCKET: &str = "world/rocket";
/// A dot on the rocket, which is small in a view of the whole flight.
pub const MARKER: &str = "world/rocket/marker";
/// The position of the rocket without its attitude; the camera of the close-up follows it.
pub const FOLLOWED: &str = "world/followed";
/// The shape of the rocket.
pub const BODY: &str = "world/rocket/body";
/// The legs of the rocket.
pub const LEGS: &str = "world/rocket/legs";
/// The nozzle, turned by the gimbal angle.
pub const NOZZLE: &str = "world/rocket/nozzle";
/// The shape of the nozzle.
pub const BELL: &str = "world/rocket/nozzle/bell";
/// The thrust on the nozzle: one body length is one weight.
pub const THRUST: &str = "world/rocket/nozzle/thrust";
/// The whole path that was flown, at all times.
pub const FLOWN: &str = "world/path/flown";
/// The path up to now, one piece for each record.
pub const TRAIL: &str = "world/path/trail";
/// The path that the flight computer plans. Its plans are not in its log: these are made by running it again.
pub const PREDICTED: &str = "world/path/predicted";
/// The end of that path.
pub const PREDICTED_TOUCHDOWN: &str = "world/path/predicted_touchdown";
/// The first plan under thrust, at all times: the intended flight.
pub const FIRST_PLAN: &str = "world/path/first_plan";

/// All plots. A line `replayed` is the decision of the controller when it is run again on the recorded inputs.
pub const PLOTS: &str = "plots";
/// The flight phase, as states.
pub const PHASE: &str = "states/phase";
/// The control level that decides the gimbal command, as states.
pub const LEVEL: &str = "states/level";
/// The same, run again on the recorded inputs.
pub const LEVEL_REPLAYED: &str = "states/level_replayed";

/// The log's events, as text.
pub const EVENTS: &str = "log/events";
/// Each change of phase, as text.
pub const PHASES: &str = "log/phases";
/// Where running the controller again differs from the record or ends, as text.
pub const REPLAY: &str = "log/replay";
/// The landing verdict, as text.
pub const VERDICT: &str = "log/verdict";
/// A document that says which flight this is and how it ended.
pub const REPORT: &str = "report";

/// Name of the timeline of vehicle time.
pub const TIMELINE_FLIGHT_TIME: &str = "flight_time";
/// Name of the timeline of controller ticks.
pub const TIMELINE_TICK: &str = "tick";

/// Name below which the entities of a second flight lie, in the first part of their path and in each plot.
pub const BESIDE: &str = "beside";

/// The path of the second flight's entity: `world/rocket` becomes `world/beside/rocket`, and `plots/x_m/true` becomes
/// `plots/x_m/beside/true`, so that both flights are in the same views.
pub fn beside(path: &str) -> String {
    let parts: Vec<&str> = path.trim_start_matches('/').split('/').collect();
    let shared = if parts.first() == Some(&PLOTS) { 2 } else { 1 };
    let (shared, own) = parts.split_at(shared.min(parts.len()));
    let all: Vec<&str> = shared.iter().chain([&BESIDE]).chain(own).copied().collect();
    all.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_flight_lies_in_the_views_of_the_first() {
        assert_eq!(beside(ROCKET), "world/beside/rocket");
        assert_eq!(beside("/plots/x_m/true"), "plots/x_m/beside/true");
        assert_eq!(beside(REPORT), "report/beside");
    }
}
