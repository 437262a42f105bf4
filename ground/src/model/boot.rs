//! Which boot of the vehicle a message comes from, and whether the vehicle has always reported to be simulated.

use std::num::NonZeroU32;

use protocol::dialect::{MavMessage, MavModeFlag, TD_FLIGHT_STATUS_DATA, TdVehicleFlag};

/// A vehicle without a boot number: its clock may go back by this much when messages of a slow and a fast link mix; a
/// larger step back is a reboot.
const REORDERED_MS: u32 = 5_000;
/// How many former boots are remembered. Messages still in transit belong to one of the last few.
const FORMER_MAX: usize = 8;

/// Which boot a message comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MessageBoot {
    /// The present boot, as far as the ground knows.
    Present,
    /// A new boot: everything known so far is void.
    New,
    /// A former boot: the message is late.
    Former,
}

/// What is known about the present boot of the vehicle.
#[derive(Debug, Clone, Default)]
pub struct Boot {
    number: Option<NonZeroU32>,
    former: Vec<NonZeroU32>,
    /// The latest time on the vehicle's clock, ms since its boot.
    clock_ms: Option<u32>,
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

    /// Whether both flags have been set in every message since this boot's number was first received. A missing or
    /// contradictory flag means a real vehicle.
    pub fn is_simulated(&self) -> bool {
        self.number.is_some() && self.hil == Some(true) && self.flagged == Some(true)
    }

    /// Whether both flags have been received since the boot number was.
    pub fn has_said_what_it_is(&self) -> bool {
        self.hil.is_some() && self.flagged.is_some()
    }

    /// Takes a message of the vehicle and says which boot it comes from.
    pub fn hear(&mut self, message: &MavMessage) -> MessageBoot {
        match message {
            MavMessage::HEARTBEAT(beat) => {
                let set = beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED);
                self.hil = Some(set && self.hil != Some(false));
                MessageBoot::Present
            }
            MavMessage::TD_FLIGHT_STATUS(status) => self.hear_status(status),
            _ => time_boot_ms(message).map_or(MessageBoot::Present, |at_ms| self.hear_clock(at_ms)),
        }
    }

    fn hear_status(&mut self, status: &TD_FLIGHT_STATUS_DATA) -> MessageBoot {
        let Some(told) = NonZeroU32::new(status.boot_number) else {
            let spoken = self.hear_clock(status.time_boot_ms);
            self.note_flag(status);
            return spoken;
        };
        if self.former.contains(&told) {
            return MessageBoot::Former;
        }
        let spoken = match self.number {
            Some(known) if known == told => MessageBoot::Present,
            Some(_) => MessageBoot::New,
            // The first boot number: the clock decides one last time whether this is still the same boot.
            None => {
                let spoken = self.hear_clock(status.time_boot_ms);
                (self.hil, self.flagged) = (None, None);
                spoken
            }
        };
        if spoken == MessageBoot::New {
            self.begin_anew();
        }
        self.number = Some(told);
        self.note_flag(status);
        spoken
    }

    fn note_flag(&mut self, status: &TD_FLIGHT_STATUS_DATA) {
        let set = status.vehicle_flags.contains(TdVehicleFlag::TD_VEHICLE_FLAG_SIMULATED);
        self.flagged = Some(set && self.flagged != Some(false));
    }

    /// Detects a reboot by the clock, for a vehicle without a boot number.
    fn hear_clock(&mut self, at_ms: u32) -> MessageBoot {
        if self.number.is_some() {
            return MessageBoot::Present;
        }
        let fell = self.clock_ms.is_some_and(|last_ms| at_ms.saturating_add(REORDERED_MS) < last_ms);
        if fell {
            self.begin_anew();
        }
        self.clock_ms = Some(self.clock_ms.map_or(at_ms, |last_ms| last_ms.max(at_ms)));
        if fell { MessageBoot::New } else { MessageBoot::Present }
    }

    fn begin_anew(&mut self) {
        let mut former = std::mem::take(&mut self.former);
        former.extend(self.number);
        former.drain(..former.len().saturating_sub(FORMER_MAX));
        *self = Self { former, ..Self::default() };
    }
}

fn time_boot_ms(message: &MavMessage) -> Option<u32> {
    match message {
        MavMessage::ATTITUDE_QUATERNION(data) => Some(data.time_boot_ms),
        MavMessage::LOCAL_POSITION_NED(data) => Some(data.time_boot_ms),
        MavMessage::TD_FINS(data) => Some(data.time_boot_ms),
        MavMessage::TD_GIMBAL(data) => Some(data.time_boot_ms),
        MavMessage::TD_CONTROLLER(data) => Some(data.time_boot_ms),
        MavMessage::TD_TOUCHDOWN_PREDICTION(data) => Some(data.time_boot_ms),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::dialect::{HEARTBEAT_DATA, LOCAL_POSITION_NED_DATA};

    fn status(boot_number: u32, time_boot_ms: u32, simulated: bool) -> MavMessage {
        let vehicle_flags =
            if simulated { TdVehicleFlag::TD_VEHICLE_FLAG_SIMULATED } else { TdVehicleFlag::empty() };
        MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
            boot_number,
            time_boot_ms,
            vehicle_flags,
            ..Default::default()
        })
    }

    fn beat(hil: bool) -> MavMessage {
        let base_mode = if hil { MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED } else { MavModeFlag::empty() };
        MavMessage::HEARTBEAT(HEARTBEAT_DATA { base_mode, ..HEARTBEAT_DATA::default() })
    }

    fn at(time_boot_ms: u32) -> MavMessage {
        MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA { time_boot_ms, ..Default::default() })
    }

    #[test]
    fn a_new_boot_number_is_a_reboot_even_soon_after_the_last() {
        let mut boot = Boot::default();
        assert_eq!(boot.hear(&status(7, 4_000, false)), MessageBoot::Present);
        assert_eq!(boot.hear(&status(7, 4_100, false)), MessageBoot::Present);
        assert_eq!(boot.hear(&status(9, 100, false)), MessageBoot::New);
        assert_eq!(boot.hear(&status(7, 4_200, false)), MessageBoot::Former, "it was late");
        assert_eq!(boot.number(), Some(9));
    }

    #[test]
    fn with_a_boot_number_the_clock_is_ignored() {
        let mut boot = Boot::default();
        boot.hear(&status(7, 60_000, false));
        assert_eq!(boot.hear(&at(10)), MessageBoot::Present);
        assert_eq!(boot.hear(&status(7, 60_100, false)), MessageBoot::Present);
    }

    #[test]
    fn without_a_number_a_clock_that_goes_back_is_a_reboot_and_a_late_message_is_not() {
        let mut boot = Boot::default();
        boot.hear(&status(0, 60_000, false));
        assert_eq!(boot.hear(&at(59_000)), MessageBoot::Present);
        assert_eq!(boot.hear(&at(200)), MessageBoot::New);
        assert_eq!(boot.hear(&at(300)), MessageBoot::Present);
    }

    #[test]
    fn a_vehicle_is_simulated_only_if_both_flags_were_always_set() {
        let of = |heard: &[MavMessage]| {
            let mut boot = Boot::default();
            for message in heard {
                boot.hear(message);
            }
            boot.is_simulated()
        };
        assert!(of(&[status(7, 0, true), beat(true)]));
        assert!(!of(&[status(7, 0, true)]) && !of(&[beat(true)]), "one flag alone");
        assert!(!of(&[status(0, 0, true), beat(true)]), "no boot number");
        assert!(
            !of(&[status(7, 0, true), beat(true), beat(false), beat(true)]),
            "it has contradicted itself"
        );
        assert!(!of(&[status(7, 0, true), beat(true), status(7, 0, false), status(7, 0, true)]));
        assert!(of(&[status(7, 0, false), beat(false), status(8, 0, true), beat(true)]), "another boot");
    }
}
