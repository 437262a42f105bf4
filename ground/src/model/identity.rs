//! Identity of the received vehicle: its boot, whether it is simulated, and whether it is one of
//! ours at all.

use std::num::NonZeroU32;
use std::time::Duration;

use protocol::dialect::{HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, TdVehicleFlag};
use protocol::identity::LARGEST_BOOT_NUMBER;
pub use protocol::reported::may_be_ours;

use super::{Model, Sample, words};

/// The vehicle's report of its boot, and whether it is simulated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Boot {
    number: Option<NonZeroU32>,
    /// Whether every HEARTBEAT so far had the HIL flag set; `None` before the first.
    hil: Option<bool>,
    /// The same for the simulated flag of `TD_FLIGHT_STATUS`.
    flagged: Option<bool>,
}

impl Boot {
    /// The boot number; `None` if the vehicle has not reported one.
    pub fn number(&self) -> Option<u32> {
        self.number.map(NonZeroU32::get)
    }

    /// The boot number as a parameter of a command. 0 names no boot: the vehicle has reported none,
    /// or one that a parameter cannot hold exactly.
    pub fn parameter(&self) -> f32 {
        let number = self.number().filter(|number| *number <= LARGEST_BOOT_NUMBER);
        number.map_or(0.0, |number| number as f32)
    }

    /// Whether both flags have been set in every message since this boot's number was first
    /// received. A missing or contradictory flag means a real vehicle.
    pub fn is_simulated(&self) -> bool {
        self.number.is_some() && self.hil == Some(true) && self.flagged == Some(true)
    }

    /// Whether both flags have been received since the boot number was.
    pub fn is_identified(&self) -> bool {
        self.hil.is_some() && self.flagged.is_some()
    }

    /// Takes a message of this boot.
    pub fn note(&mut self, message: &MavMessage) {
        match message {
            MavMessage::HEARTBEAT(beat) => {
                let set = beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED);
                self.hil = Some(set && self.hil != Some(false));
            }
            MavMessage::TD_FLIGHT_STATUS(status) => {
                let number = NonZeroU32::new(status.boot_number);
                if self.number != number {
                    *self = Self { number, ..Self::default() };
                }
                let set = status.vehicle_flags.contains(TdVehicleFlag::TD_VEHICLE_FLAG_SIMULATED);
                self.flagged = Some(set && self.flagged != Some(false));
            }
            _ => {}
        }
    }
}

/// The time on the vehicle's clock that a message carries, ms.
pub(crate) fn time_boot_ms(message: &MavMessage) -> Option<u32> {
    match message {
        MavMessage::ATTITUDE_QUATERNION(data) => Some(data.time_boot_ms),
        MavMessage::LOCAL_POSITION_NED(data) => Some(data.time_boot_ms),
        MavMessage::TD_FINS(data) => Some(data.time_boot_ms),
        MavMessage::TD_GIMBAL(data) => Some(data.time_boot_ms),
        MavMessage::TD_CONTROLLER(data) => Some(data.time_boot_ms),
        MavMessage::TD_TOUCHDOWN_PREDICTION(data) => Some(data.time_boot_ms),
        MavMessage::TD_FLIGHT_STATUS(data) => Some(data.time_boot_ms),
        MavMessage::ATTITUDE(data) => Some(data.time_boot_ms),
        MavMessage::GLOBAL_POSITION_INT(data) => Some(data.time_boot_ms),
        MavMessage::TIMESYNC(data) if data.tc1 > 0 => u32::try_from(data.tc1 / 1_000_000).ok(),
        _ => None,
    }
}

/// How long the status of one of our vehicles may be lost; it is sent at least once a second, on
/// any line.
const NO_STATUS_FOR: Duration = Duration::from_secs(3);
/// A vehicle with another version of the dialect sends more frames that do not fit in that time.
const MISFITS: u64 = 10;

impl Model {
    /// Whether the heartbeat is that of one of our vehicles, but its messages do not fit this
    /// station's dialect: the two have different versions.
    pub fn speaks_another_version(&self, now: Duration) -> bool {
        let link = &self.link;
        let misfits = link.framing.crc_errors + link.framing.unknown_ids + link.undecodable;
        self.vehicle.status.is_none()
            && self.vehicle.foreign.is_none()
            && self.vehicle.heartbeat.is_some()
            && link.first_heartbeat_at.is_some_and(|at| now.saturating_sub(at) >= NO_STATUS_FOR)
            && misfits >= MISFITS
    }
}

// A vehicle with another autopilot: it is shown by its heartbeat's type, and never armed or started
// from here.

/// Autopilot and type of another make, as in `ArduPilot quadrotor`.
pub fn foreign_name(beat: &Sample<HEARTBEAT_DATA>) -> String {
    let autopilot = match beat.value.autopilot {
        MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA => "ArduPilot".to_owned(),
        MavAutopilot::MAV_AUTOPILOT_PX4 => "PX4".to_owned(),
        other => words::lower_case(&other, "MAV_AUTOPILOT_"),
    };
    format!("{autopilot} {}", words::lower_case(&beat.value.mavtype, "MAV_TYPE_"))
}

/// Effect of `MAV_CMD_DO_FLIGHTTERMINATION` on a vehicle with another autopilot.
pub const TERMINATION: &str = "CUTS ITS MOTORS, or does as set there: it falls";

#[cfg(test)]
mod boot_tests {
    use super::*;
    use protocol::dialect::{HEARTBEAT_DATA, TD_FLIGHT_STATUS_DATA};

    fn status(boot_number: u32, simulated: bool) -> MavMessage {
        let vehicle_flags =
            if simulated { TdVehicleFlag::TD_VEHICLE_FLAG_SIMULATED } else { TdVehicleFlag::empty() };
        MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
            boot_number,
            vehicle_flags,
            ..Default::default()
        })
    }

    fn beat(hil: bool) -> MavMessage {
        let base_mode = if hil { MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED } else { MavModeFlag::empty() };
        MavMessage::HEARTBEAT(HEARTBEAT_DATA { base_mode, ..HEARTBEAT_DATA::default() })
    }

    #[test]
    fn a_vehicle_is_simulated_only_if_both_flags_were_always_set() {
        let of = |heard: &[MavMessage]| {
            let mut boot = Boot::default();
            for message in heard {
                boot.note(message);
            }
            boot.is_simulated()
        };
        assert!(of(&[status(7, true), beat(true)]));
        assert!(!of(&[status(7, true)]) && !of(&[beat(true)]), "one flag alone");
        assert!(!of(&[status(0, true), beat(true)]), "no boot number");
        assert!(!of(&[status(7, true), beat(true), beat(false), beat(true)]), "it has contradicted itself");
        assert!(!of(&[status(7, true), beat(true), status(7, false), status(7, true)]));
    }
}

#[cfg(test)]
mod foreign_tests {
    use protocol::dialect::MavType;

    use super::*;

    fn beat(autopilot: MavAutopilot, mavtype: MavType, custom_mode: u32) -> HEARTBEAT_DATA {
        HEARTBEAT_DATA { autopilot, mavtype, custom_mode, ..HEARTBEAT_DATA::default() }
    }

    #[test]
    fn only_the_heartbeat_of_a_rocket_with_a_generic_autopilot_may_be_ours() {
        use {MavAutopilot as A, MavType as T};
        assert!(may_be_ours(&beat(A::MAV_AUTOPILOT_GENERIC, T::MAV_TYPE_ROCKET, 0)));
        assert!(!may_be_ours(&beat(A::MAV_AUTOPILOT_ARDUPILOTMEGA, T::MAV_TYPE_ROCKET, 0)));
        assert!(!may_be_ours(&beat(A::MAV_AUTOPILOT_GENERIC, T::MAV_TYPE_QUADROTOR, 0)));
    }
}
