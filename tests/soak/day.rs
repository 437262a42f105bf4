//! A launch day on a simulated clock: one station's model, and every hour another vehicle, which
//! waits on its pad, flies and stays where it landed.

use std::time::Duration;

use e2e::resident_bytes;
use flight::computer::LogState;
use flight::computer::crew::{CrewCommand, Request};
use flight::rules::phase::Phase;
use ground::model::{Model, Settings};
use ground::update::{Msg, update};
use protocol::dialect::{HEARTBEAT_DATA, MavMessage, TdLanding};
use protocol::frame::Encoder;
use protocol::identity::GROUND;
use sim::wire::endpoint::{VehicleEndpoint, VehicleKind, step};
use sim::wire::fly::load_flight;
use sim::wire::vehicle::Vehicle;

use crate::footprint::GROWTH_MAX_BYTES;
use crate::{Failure, print_line};

const HOUR: Duration = Duration::from_hours(1);
const FRAME: Duration = Duration::from_millis(5);
/// Every hour the vehicle waits for so long before it is armed.
const ON_THE_PAD: Duration = Duration::from_mins(50);
const FRAMES_PER_TICK: u32 = 20;
const FRAMES_PER_HEARTBEAT: u32 = 200;

/// Runs so many hours; returns what is wrong.
pub(crate) fn day(hours: u32) -> Result<Vec<String>, Failure> {
    let mut model = Model::new(Settings::on_screen("udpin:0.0.0.0:14550"));
    let mut station = Encoder::new(GROUND);
    let (mut landed, mut after_hours) = (0, Vec::new());
    for hour in 0..hours {
        landed += u32::from(fly(hour, &mut model, &mut station)?);
        after_hours.push(resident_bytes(std::process::id()).unwrap_or(0));
    }
    let (third, last) = (after_hours.get(2), after_hours.last());
    print_line(&format!(
        "{hours} simulated hours, {landed} landed; resident after each, bytes: {after_hours:?}"
    ))?;
    let mut wrong = Vec::new();
    if let (Some(third), Some(last)) = (third, last)
        && *last > third + GROWTH_MAX_BYTES
    {
        wrong.push(format!("the day's memory grew from {third} to {last} bytes"));
    }
    if landed < hours {
        wrong.push(format!("{landed} of {hours} vehicles have landed and reported it"));
    }
    Ok(wrong)
}

/// One hour with one vehicle. Returns whether it landed and the station knows.
fn fly(hour: u32, model: &mut Model, station: &mut Encoder) -> Result<bool, Failure> {
    let mut flight = load_flight("mk2")?;
    flight.number = u64::from(hour);
    let mut vehicle = Vehicle::on_the_pad(&flight)?;
    vehicle.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    vehicle.set_pin_out(true);
    let mut endpoint = VehicleEndpoint::new(VehicleKind::Simulated).booted(hour + 1);
    let mut armed = false;
    for frame in 0..(HOUR.as_millis() / FRAME.as_millis()) as u32 {
        let at = FRAME * frame;
        let now = HOUR * hour + at;
        if frame % FRAMES_PER_HEARTBEAT == 0 {
            let beat = station.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            endpoint.on_frame(0, &beat, &vehicle.state());
        }
        let commands: &[CrewCommand] = if at >= ON_THE_PAD && !armed && vehicle.phase() == Phase::PadIdle {
            armed = true;
            &[CrewCommand::Arm, CrewCommand::Start]
        } else {
            &[]
        };
        let own: Vec<Request> = commands.iter().copied().map(Request::of_the_programme).collect();
        drop(step(&mut endpoint, &mut vehicle, &own));
        for outgoing in endpoint.poll(&vehicle.state()) {
            drop(update(model, Msg::Frame(outgoing.frame), now));
        }
        if frame % FRAMES_PER_TICK == 0 {
            drop(update(model, Msg::Tick, now));
        }
    }
    let landed = vehicle.judged().is_some_and(|judged| judged.landing.stands);
    let told = model
        .vehicle
        .verdict()
        .is_some_and(|verdict| verdict.value.landing.contains(TdLanding::TD_LANDING_STANDS));
    Ok(landed && told)
}
