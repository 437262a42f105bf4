//! A rocket from apogee: the flight computer of a mission in the world in space, with the pad before it.
//!
//! It waits on a simulated pad, with sensors that feel it stand there, self-test, rehearsal and arming checks. When the
//! countdown has ended the simulation goes on at apogee: **the ascent is not flown**. From there on it is the very
//! flight that a campaign flies ([`campaign::sortie`]), frame by frame: the same order, number and seed give the same
//! bits, with a crew or without.
//!
//! Pure but for the stopwatch that its caller hands in to time the flight computer. Time is simulated; a frame is 5 ms.

mod air;
mod craft;
mod limits;
mod pad;
mod rehearsal;
mod sensed;
mod snapshot;
#[cfg(test)]
mod tests;

use campaign::draw::draw;
use campaign::fly::FlyError;
use campaign::order::Order;
use campaign::sortie::Sortie;
use flight::airframe::MassModel;
use flight::arming::Uplink;
use flight::controller::ControlLevel;
use flight::phase::Mode;
use flight::thrust_curve::ThrustCurve;
use world::sensors::FRAME_S;

use self::limits::Limits;
use self::pad::Pad;
use self::rehearsal::Rehearsal;
use self::sensed::SensorWatch;
use crate::craft::{Judged, LogState, MotorWatch, Readiness, VehicleEvent};

/// Which flight is flown.
#[derive(Debug, Clone)]
pub struct RocketFlight {
    /// The mission, its dispersions, its faults.
    pub order: Order,
    /// The flight's number in it.
    pub number: u64,
}

/// One rocket, one flight.
pub struct Rocket {
    flight: RocketFlight,
    curve: ThrustCurve,
    mass: MassModel,
    limits: Limits,
    frame: u64,
    mode: Mode,
    log: LogState,
    uplink: Uplink,
    motor_watch: MotorWatch,
    pad: Pad,
    rehearsal: Rehearsal,
    readiness: Readiness,
    watch: SensorWatch,
    air: Option<Air>,
    events: Vec<VehicleEvent>,
}

/// The flight, once it is let go.
struct Air {
    sortie: Sortie,
    /// When that was, vehicle time, s.
    released_at_s: f64,
    /// A frame was flown just now.
    flown: bool,
    /// There is more to fly.
    goes_on: bool,
    level: ControlLevel,
    gate_refusal: Option<&'static str>,
    touched: bool,
    took_s: f64,
    /// By what the legs take, and by Table 2.
    judged: Option<(Judged, Judged)>,
    /// It lies on the ground and is judged: nothing more is flown.
    over: bool,
    given_up: bool,
}

impl Rocket {
    /// A rocket powered up on its pad.
    ///
    /// # Errors
    /// The mission or the draw cannot be flown.
    pub fn new(flight: &RocketFlight) -> Result<Self, FlyError> {
        let order = &flight.order;
        let mission = &order.mission;
        let curve = mission.motor()?;
        let draw = draw(mission, &order.dispersion, order.seed, flight.number);
        Ok(Self {
            pad: Pad::new(order, &curve, &draw)?,
            rehearsal: Rehearsal::new(order)?,
            mass: MassModel::new(&mission.airframe.mass, curve.propellant_mass_kg()),
            curve,
            limits: Limits::of(mission),
            frame: 0,
            mode: Mode::power_up(0.0),
            log: LogState { running: false, space_bytes: 0 },
            uplink: Uplink::NotNeeded,
            motor_watch: MotorWatch::default(),
            readiness: Readiness::default(),
            watch: SensorWatch::default(),
            air: None,
            events: Vec::new(),
            flight: flight.clone(),
        })
    }
}
