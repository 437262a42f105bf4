//! Which boot of the vehicle speaks, and whether it has always said of itself that it is a simulated one.

use std::num::NonZeroU32;

use protocol::dialect::{MavMessage, MavModeFlag, TD_FLIGHT_STATUS_DATA, TdVehicleFlag};

/// Without a boot number: the vehicle's clock may jump back this far by a slow link beside a fast one; more is a reboot.
const REORDERED_MS: u32 = 5_000;
/// Former boots remembered. What is still on its way belongs to one of the last few.
const FORMER_MAX: usize = 8;

/// What a message says of the boot that it comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spoken {
    /// The present boot, as far as is known.
    Present,
    /// A new boot: nothing that was known holds any more.
    New,
    /// A boot that is over: the message was late.
    Former,
}

/// One boot of the vehicle, as far as it has told about it.
#[derive(Debug, Clone, Default)]
pub struct Boot {
    number: Option<NonZeroU32>,
    former: Vec<NonZeroU32>,
    /// The vehicle's clock, ms since its boot: the greatest heard.
    clock_ms: Option<u32>,
    /// HEARTBEAT's HIL flag, if any was heard: whether it was set in every one.
    hil: Option<bool>,
    /// The flag of `TD_FLIGHT_STATUS`, likewise.
    flagged: Option<bool>,
}

impl Boot {
    /// The number; `None` for a vehicle that has told none.
    pub fn number(&self) -> Option<u32> {
        self.number.map(NonZeroU32::get)
    }

    /// Whether both of the vehicle's flags have said so ever since this boot's number was first heard. Absent or
    /// contradictory means a real vehicle.
    pub fn is_simulated(&self) -> bool {
        self.number.is_some() && self.hil == Some(true) && self.flagged == Some(true)
    }

    /// Whether it has told in both places, since its number was heard, whether it is a simulated one.
    pub fn has_said_what_it_is(&self) -> bool {
        self.hil.is_some() && self.flagged.is_some()
    }

    /// Takes a message of the vehicle.
    pub fn hear(&mut self, message: &MavMessage) -> Spoken {
        match message {
            MavMessage::HEARTBEAT(beat) => {
                let set = beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED);
                self.hil = Some(set && self.hil != Some(false));
                Spoken::Present
            }
            MavMessage::TD_FLIGHT_STATUS(status) => self.hear_status(status),
            _ => time_boot_ms(message).map_or(Spoken::Present, |at_ms| self.hear_clock(at_ms)),
        }
    }

    fn hear_status(&mut self, status: &TD_FLIGHT_STATUS_DATA) -> Spoken {
        let Some(told) = NonZeroU32::new(status.boot_number) else {
            let spoken = self.hear_clock(status.time_boot_ms);
            self.note_flag(status);
            return spoken;
        };
        if self.former.contains(&told) {
            return Spoken::Former;
        }
        let spoken = match self.number {
            Some(known) if known == told => Spoken::Present,
            Some(_) => Spoken::New,
            // Nothing was told of numbers so far: the clock decides once more whether this is still the same boot.
            None => {
                let spoken = self.hear_clock(status.time_boot_ms);
                (self.hil, self.flagged) = (None, None);
                spoken
            }
        };
        if spoken == Spoken::New {
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

    /// A boot that has a number is told from others by it alone.
    fn hear_clock(&mut self, at_ms: u32) -> Spoken {
        if self.number.is_some() {
            return Spoken::Present;
        }
        let fell = self.clock_ms.is_some_and(|last_ms| at_ms.saturating_add(REORDERED_MS) < last_ms);
        if fell {
            self.begin_anew();
        }
        self.clock_ms = Some(self.clock_ms.map_or(at_ms, |last_ms| last_ms.max(at_ms)));
        if fell { Spoken::New } else { Spoken::Present }
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
    fn another_number_is_another_boot_however_soon_it_comes() {
        let mut boot = Boot::default();
        assert_eq!(boot.hear(&status(7, 4_000, false)), Spoken::Present);
        assert_eq!(boot.hear(&status(7, 4_100, false)), Spoken::Present);
        assert_eq!(boot.hear(&status(9, 100, false)), Spoken::New);
        assert_eq!(boot.hear(&status(7, 4_200, false)), Spoken::Former, "it was late");
        assert_eq!(boot.number(), Some(9));
    }

    #[test]
    fn a_number_counts_and_then_the_clock_does_not() {
        let mut boot = Boot::default();
        boot.hear(&status(7, 60_000, false));
        assert_eq!(boot.hear(&at(10)), Spoken::Present);
        assert_eq!(boot.hear(&status(7, 60_100, false)), Spoken::Present);
    }

    #[test]
    fn without_a_number_a_falling_clock_is_a_reboot_and_a_late_message_is_not() {
        let mut boot = Boot::default();
        boot.hear(&status(0, 60_000, false));
        assert_eq!(boot.hear(&at(59_000)), Spoken::Present);
        assert_eq!(boot.hear(&at(200)), Spoken::New);
        assert_eq!(boot.hear(&at(300)), Spoken::Present);
    }

    #[test]
    fn simulated_is_what_both_flags_have_always_said() {
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
