//! Finds the frame to start with.

use flight::rules::phase::Phase;
use protocol::log::flight_v1;

use super::rerun::Rerun;
use crate::controller::{LoggedPilot, Moment, Replayed as _};
use crate::log::Recording;
use crate::refly::{ReflyError, StartAt};

pub(super) fn phase_of(tick: &flight_v1::PilotTick) -> Option<Phase> {
    u8::try_from(tick.output.phase).ok().and_then(Phase::from_index)
}

/// The index of the frame to start with. For a phase it is the frame after the one that entered it, because changes
/// cannot act earlier.
pub(super) fn find(
    recording: &Recording,
    frames: &[flight_v1::PilotTick],
    start: &StartAt,
) -> Result<usize, ReflyError> {
    let in_phase = |wanted: &dyn Fn(Phase) -> bool| {
        let entered = frames.iter().position(|tick| phase_of(tick).is_some_and(wanted))?;
        Some(entered + 1).filter(|place| *place < frames.len())
    };
    let found = match start {
        StartAt::Landing => in_phase(&Phase::is_landing),
        StartAt::Tick(number) => frames.iter().position(|tick| tick.input.frame == *number),
        StartAt::Time(time_s) => frames.iter().position(|tick| tick.input.time_s >= *time_s),
        StartAt::Phase(phase) => in_phase(&|found| found == *phase),
    };
    found.ok_or_else(|| {
        let first = frames.first().map(LoggedPilot::moment);
        let last = frames.last().map(LoggedPilot::moment);
        let number = |moment: Option<Moment>| moment.map_or(0, |moment| moment.tick);
        let reason = match start {
            StartAt::Landing => {
                "no frame of a landing to start from; a frame, a time or a phase names another moment"
                    .to_owned()
            }
            StartAt::Tick(asked) => {
                format!("no frame {asked}; there are {} to {}", number(first), number(last))
            }
            StartAt::Time(time_s) => {
                format!(
                    "no frame at or after {time_s} s; the last is at {:.3} s",
                    last.map_or(0.0, |moment| moment.time_s)
                )
            }
            StartAt::Phase(phase) => format!("no frame in phase {}", phase.name()),
        };
        ReflyError::Start { name: recording.name.clone(), reason }
    })
}

/// Puts the vehicle at the position that its flight computer estimated at the end of the frame before the start.
pub(super) fn put_where_it_believes(
    recording: &Recording,
    rerun: &mut Rerun,
    first_frame: u64,
) -> Result<(), ReflyError> {
    let refused =
        |reason: &str| ReflyError::Start { name: recording.name.clone(), reason: reason.to_owned() };
    let Some(estimate) = rerun.flight.pilot().estimate().filter(|_| first_frame > 1) else {
        return Err(refused("before its first frame the flight computer has estimated nothing yet"));
    };
    let world = rerun.flight.world();
    if world.touchdown().is_some() {
        return Err(refused(
            "it is already on the ground; --from estimate can place only a vehicle in flight",
        ));
    }
    let placed = world.placed(&estimate.state)?;
    *rerun.flight.world_mut() = placed;
    Ok(())
}

/// A recorded frame by its number; a log may have lost it.
pub(super) fn recorded_frame(frames: &[flight_v1::PilotTick], number: u64) -> Option<&flight_v1::PilotTick> {
    let place = frames.binary_search_by_key(&number, |tick| tick.input.frame).ok()?;
    frames.get(place)
}
