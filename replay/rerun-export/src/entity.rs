//! Where in the recording what is: entity paths. Plots carry their unit in their name.

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
/// Where the rocket is, without its attitude: what the close-up follows.
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
/// The path up to now, a piece at each record.
pub const TRAIL: &str = "world/path/trail";
/// The path the controller plans at each tick. A flight computer's plans are not in its log: these are made by running it
/// again.
pub const PREDICTED: &str = "world/path/predicted";
/// Where that path ends.
pub const PREDICTED_TOUCHDOWN: &str = "world/path/predicted_touchdown";
/// The path that the controller of a planar landing, run again on the recorded inputs, plans at each tick.
pub const PREDICTED_REPLAYED: &str = "world/path/predicted_replayed";
/// The first plan under thrust, at all times: what the flight was meant to be.
pub const FIRST_PLAN: &str = "world/path/first_plan";

/// Everything that is plotted. A line `replayed` is what the controller, run again on the recorded inputs, decides beside
/// what is recorded.
pub const PLOTS: &str = "plots";
/// The flight phase, as states.
pub const PHASE: &str = "states/phase";
/// What decides the gimbal command, as states.
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
/// What flight this is and how it ended, as a document.
pub const REPORT: &str = "report";

/// Name of the timeline of vehicle time.
pub const TIMELINE_FLIGHT_TIME: &str = "flight_time";
/// Name of the timeline of controller ticks.
pub const TIMELINE_TICK: &str = "tick";
