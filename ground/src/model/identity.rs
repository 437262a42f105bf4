//! Which vehicle is heard: which of its boots, whether it is simulated, whether it is one of ours at all.

use std::collections::BTreeMap;
use std::num::NonZeroU32;
use std::time::Duration;

use protocol::dialect::{
    HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, MavType, TD_FLIGHT_STATUS_DATA, TdVehicleFlag,
};
use protocol::identity::LARGEST_BOOT_NUMBER;

use super::{Sample, words};

/// Messages of a slow and a fast link mix: a vehicle's clock, ms, may go back by this much.
const REORDERED_MS: u32 = 5_000;
/// How many former boots are remembered. Messages still in transit belong to one of the last few.
const FORMER_MAX: usize = 8;
/// Of two vehicles under one id, one that is silent for this long is gone.
pub const GONE_AFTER: Duration = Duration::from_secs(10);

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

/// A boot that was present before another one was heard: of the same vehicle, or of a second one under the same id.
#[derive(Debug, Clone, Copy)]
struct Former {
    number: NonZeroU32,
    /// The latest time on its clock when it was present, ms.
    clock_ms: u32,
    /// It was still heard when the boot that took its place must have run for longer than late messages explain.
    overlapped: bool,
    /// When it was last heard to be alive beside the present one; `None` while its messages may be late ones.
    alive_at: Option<Duration>,
}

/// What is known about the present boot of the vehicle.
#[derive(Debug, Clone, Default)]
pub struct Boot {
    number: Option<NonZeroU32>,
    former: Vec<Former>,
    /// When the present boot last told its number.
    heard_at: Duration,
    /// A vehicle without a boot number was heard beside the present boot.
    unnumbered_at: Option<Duration>,
    /// The present boot was heard before another one, which is gone.
    returned: bool,
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

    /// The boot number as a parameter of a command. 0 names no boot: the vehicle has told none, or, an older one, one that
    /// a parameter cannot hold exactly.
    pub fn parameter(&self) -> f32 {
        let number = self.number().filter(|number| *number <= LARGEST_BOOT_NUMBER);
        number.map_or(0.0, |number| number as f32)
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

    /// The boot of another vehicle that is heard under the same id, beside the present one; 0 if it tells no number.
    ///
    /// Two boots of one vehicle follow each other: the former one's messages may be late, but its clock stands.
    pub fn of_another_vehicle(&self, now: Duration) -> Option<u32> {
        let is_heard = |at: Duration| now.saturating_sub(at) < GONE_AFTER;
        if !is_heard(self.heard_at) {
            return None;
        }
        let alive = self.former.iter().rev().find(|former| former.alive_at.is_some_and(is_heard));
        let unnumbered = self.unnumbered_at.filter(|at| is_heard(*at));
        alive.map(|former| former.number.get()).or(unnumbered.map(|_| 0))
    }

    /// Whether the present boot is that of a vehicle that was known before, after another one under its id has gone.
    pub fn is_back(&self) -> bool {
        self.returned
    }

    /// Takes a message of the vehicle and says which boot it comes from.
    pub fn hear(&mut self, message: &MavMessage, now: Duration) -> MessageBoot {
        match message {
            MavMessage::HEARTBEAT(beat) => {
                let set = beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED);
                self.hil = Some(set && self.hil != Some(false));
                MessageBoot::Present
            }
            MavMessage::TD_FLIGHT_STATUS(status) => self.hear_status(status, now),
            _ => time_boot_ms(message).map_or(MessageBoot::Present, |at_ms| self.hear_clock(at_ms)),
        }
    }

    fn hear_status(&mut self, status: &TD_FLIGHT_STATUS_DATA, now: Duration) -> MessageBoot {
        let Some(told) = NonZeroU32::new(status.boot_number) else {
            if self.number.is_some() {
                self.unnumbered_at = Some(now);
                return MessageBoot::Former;
            }
            let spoken = self.hear_clock(status.time_boot_ms);
            self.note_flag(status);
            return spoken;
        };
        let known = self.former.iter().position(|former| former.number == told);
        if let Some(place) = known {
            if !self.hear_former(place, status.time_boot_ms, now) {
                return MessageBoot::Former;
            }
            self.former.remove(place);
        }
        let spoken = match self.number {
            Some(present) if present == told => MessageBoot::Present,
            Some(_) => {
                self.begin_anew(status.time_boot_ms, now);
                self.returned = known.is_some();
                MessageBoot::New
            }
            // The first boot number: the clock decides one last time whether this is still the same boot.
            None => {
                let spoken = self.hear_clock(status.time_boot_ms);
                (self.hil, self.flagged) = (None, None);
                spoken
            }
        };
        self.number = Some(told);
        self.heard_at = now;
        self.clock_ms = self.clock_ms.max(Some(status.time_boot_ms));
        self.note_flag(status);
        spoken
    }

    /// Notes a status of a former boot. Returns whether that one is present again: it is alive, and the present one is
    /// gone.
    fn hear_former(&mut self, place: usize, clock_ms: u32, now: Duration) -> bool {
        let former = &mut self.former[place];
        let room_ms = if former.overlapped { 0 } else { REORDERED_MS };
        if clock_ms > former.clock_ms.saturating_add(room_ms) {
            former.alive_at = Some(now);
        }
        former.alive_at == Some(now) && now.saturating_sub(self.heard_at) >= GONE_AFTER
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
            *self = Self { former: std::mem::take(&mut self.former), ..Self::default() };
        }
        self.clock_ms = Some(self.clock_ms.map_or(at_ms, |last_ms| last_ms.max(at_ms)));
        if fell { MessageBoot::New } else { MessageBoot::Present }
    }

    /// Another boot is present from now on; its clock is at this time.
    fn begin_anew(&mut self, clock_ms: u32, now: Duration) {
        let mut former = std::mem::take(&mut self.former);
        // A vehicle that reboots is silent until its new clock begins.
        let silence_ms = now.saturating_sub(self.heard_at).as_millis();
        let overlapped = u128::from(clock_ms) > silence_ms + u128::from(REORDERED_MS);
        former.extend(self.number.map(|number| Former {
            number,
            clock_ms: self.clock_ms.unwrap_or(0),
            overlapped,
            alive_at: None,
        }));
        former.drain(..former.len().saturating_sub(FORMER_MAX));
        *self = Self { former, ..Self::default() };
    }
}

pub(crate) fn time_boot_ms(message: &MavMessage) -> Option<u32> {
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

// A vehicle with another autopilot: it is shown as what its standard messages say, and never armed or started from here.

/// The most names of modes that are kept; PX4 and ArduPilot have about thirty.
const MODES_MAX: usize = 64;

/// What another autopilot tells in standard messages.
#[derive(Debug, Clone)]
pub struct Foreign {
    pub autopilot: MavAutopilot,
    pub mavtype: MavType,
    pub armed: bool,
    custom_mode: u32,
    /// `AVAILABLE_MODES`: names by number.
    modes: BTreeMap<u32, String>,
    /// The last heartbeat.
    pub heard_at: Duration,
    /// The newest text of each message, with its name.
    pub told: BTreeMap<&'static str, Sample<String>>,
}

/// Whether a heartbeat is one that our vehicles send. Whether it is ours only its `TD_FLIGHT_STATUS` shows.
pub fn may_be_ours(beat: &HEARTBEAT_DATA) -> bool {
    beat.autopilot == MavAutopilot::MAV_AUTOPILOT_GENERIC && beat.mavtype == MavType::MAV_TYPE_ROCKET
}

impl Foreign {
    pub(crate) fn of(beat: &HEARTBEAT_DATA, before: Option<Self>, now: Duration) -> Self {
        let same =
            before.filter(|before| (before.autopilot, before.mavtype) == (beat.autopilot, beat.mavtype));
        let (modes, told) = same.map_or_else(Default::default, |same| (same.modes, same.told));
        Self {
            autopilot: beat.autopilot,
            mavtype: beat.mavtype,
            armed: beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED),
            custom_mode: beat.custom_mode,
            modes,
            heard_at: now,
            told,
        }
    }

    /// Takes another standard message.
    pub(crate) fn hear(&mut self, message: &MavMessage, now: Duration) {
        let degrees = |rad: f32| f64::from(rad).to_degrees();
        let (name, text) = match message {
            MavMessage::AVAILABLE_MODES(mode) if self.modes.len() < MODES_MAX => {
                let end = mode.mode_name.iter().position(|byte| *byte == 0).unwrap_or(mode.mode_name.len());
                self.modes.insert(mode.custom_mode, protocol::text::printable(&mode.mode_name[..end]));
                return;
            }
            MavMessage::CURRENT_MODE(mode) => {
                self.custom_mode = mode.custom_mode;
                return;
            }
            MavMessage::ATTITUDE(data) => {
                let [roll, pitch, yaw] = [data.roll, data.pitch, data.yaw].map(degrees);
                ("attitude", format!("roll {roll:.0} deg, pitch {pitch:.0} deg, yaw {yaw:.0} deg"))
            }
            MavMessage::GLOBAL_POSITION_INT(data) => {
                let [latitude, longitude] = [data.lat, data.lon].map(|e7| f64::from(e7) * 1e-7);
                let [above_home_m, above_sea_m] =
                    [data.relative_alt, data.alt].map(|mm| f64::from(mm) * 1e-3);
                let place = format!("{latitude:.6}, {longitude:.6}");
                ("position", format!("{place}, {above_home_m:.1} m above home, {above_sea_m:.0} m above sea"))
            }
            MavMessage::VFR_HUD(data) => {
                let (speed, climb, throttle) = (data.groundspeed, data.climb, data.throttle);
                ("speed", format!("{speed:.1} m/s over ground, climbs {climb:.1} m/s, throttle {throttle} %"))
            }
            MavMessage::GPS_RAW_INT(data) => {
                let fix = words::lower_case(&data.fix_type, "GPS_FIX_TYPE_");
                ("GNSS", format!("{fix}, {} satellites", data.satellites_visible))
            }
            MavMessage::SYS_STATUS(data) => {
                ("battery", battery(data.voltage_battery, data.battery_remaining))
            }
            MavMessage::BATTERY_STATUS(data) => {
                let cells = data.voltages.iter().filter(|millivolts| **millivolts != u16::MAX);
                let millivolts = cells.fold(0_u16, |sum, cell| sum.saturating_add(*cell));
                let known = if millivolts == 0 { u16::MAX } else { millivolts };
                ("battery", battery(known, data.battery_remaining))
            }
            _ => return,
        };
        self.told.insert(name, Sample::new(text, now));
    }

    /// As in `ArduPilot quadrotor`.
    pub fn name(&self) -> String {
        let autopilot = match self.autopilot {
            MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA => "ArduPilot".to_owned(),
            MavAutopilot::MAV_AUTOPILOT_PX4 => "PX4".to_owned(),
            other => words::lower_case(&other, "MAV_AUTOPILOT_"),
        };
        format!("{autopilot} {}", words::lower_case(&self.mavtype, "MAV_TYPE_"))
    }

    /// The name of its mode: as it tells it, otherwise from the tables of the two great autopilots.
    pub fn mode(&self) -> String {
        let told = self.modes.get(&self.custom_mode).filter(|name| !name.is_empty()).map(String::as_str);
        let known = || match self.autopilot {
            MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA => ardupilot_mode(self.mavtype, self.custom_mode),
            MavAutopilot::MAV_AUTOPILOT_PX4 => px4_mode(self.custom_mode),
            _ => None,
        };
        told.or_else(known).map_or_else(|| format!("mode {}", self.custom_mode), str::to_owned)
    }

    /// What `MAV_CMD_DO_FLIGHTTERMINATION` would do there.
    pub fn termination(&self) -> &'static str {
        match self.mavtype {
            _ if turns_rotors(self.mavtype) => "CUTS ITS MOTORS: in the air it falls",
            MavType::MAV_TYPE_FIXED_WING => "stops its motor and sets its surfaces to crash",
            MavType::MAV_TYPE_GROUND_ROVER | MavType::MAV_TYPE_SURFACE_BOAT => "stops it where it is",
            _ => "ends its flight as it is set to: it may fall",
        }
    }
}

fn battery(millivolts: u16, percent: i8) -> String {
    let volts = if millivolts == u16::MAX {
        "voltage not told".to_owned()
    } else {
        format!("{:.2} V", f64::from(millivolts) * 1e-3)
    };
    if percent < 0 { volts } else { format!("{volts}, {percent} % left") }
}

fn turns_rotors(mavtype: MavType) -> bool {
    matches!(
        mavtype,
        MavType::MAV_TYPE_QUADROTOR
            | MavType::MAV_TYPE_HEXAROTOR
            | MavType::MAV_TYPE_OCTOROTOR
            | MavType::MAV_TYPE_TRICOPTER
            | MavType::MAV_TYPE_DODECAROTOR
            | MavType::MAV_TYPE_DECAROTOR
            | MavType::MAV_TYPE_HELICOPTER
            | MavType::MAV_TYPE_COAXIAL
    )
}

/// <https://ardupilot.org/copter/docs/parameters.html#fltmode1>, and the same pages for plane and rover. Only what people
/// fly: other modes are shown by number.
fn ardupilot_mode(mavtype: MavType, number: u32) -> Option<&'static str> {
    let copter = "STABILIZE ACRO ALT_HOLD AUTO GUIDED LOITER RTL CIRCLE - LAND - DRIFT - SPORT FLIP \
        AUTOTUNE POSHOLD BRAKE THROW AVOID_ADSB GUIDED_NOGPS SMART_RTL";
    let plane = "MANUAL CIRCLE STABILIZE TRAINING ACRO FBWA FBWB CRUISE AUTOTUNE - AUTO RTL LOITER TAKEOFF \
        AVOID_ADSB GUIDED - QSTABILIZE QHOVER QLOITER QLAND QRTL";
    let rover = "MANUAL ACRO - STEERING HOLD LOITER FOLLOW SIMPLE - - AUTO RTL SMART_RTL";
    let table = match mavtype {
        MavType::MAV_TYPE_FIXED_WING => plane,
        MavType::MAV_TYPE_GROUND_ROVER | MavType::MAV_TYPE_SURFACE_BOAT => rover,
        _ if turns_rotors(mavtype) => copter,
        _ => return None,
    };
    table.split_whitespace().nth(usize::try_from(number).ok()?).filter(|name| *name != "-")
}

/// PX4 packs a main mode into the third byte and a sub-mode into the fourth (`px4_custom_mode.h`).
fn px4_mode(number: u32) -> Option<&'static str> {
    let [_, _, main, sub] = number.to_le_bytes();
    Some(match (main, sub) {
        (1, _) => "MANUAL",
        (2, _) => "ALTITUDE",
        (3, _) => "POSITION",
        (4, 1) => "READY",
        (4, 2) => "TAKEOFF",
        (4, 3) => "HOLD",
        (4, 4) => "MISSION",
        (4, 5) => "RETURN",
        (4, 6) => "LAND",
        (5, _) => "ACRO",
        (6, _) => "OFFBOARD",
        (7, _) => "STABILIZED",
        _ => return None,
    })
}

#[cfg(test)]
mod boot_tests {
    use super::*;
    use proptest::prelude::*;
    use protocol::dialect::{HEARTBEAT_DATA, LOCAL_POSITION_NED_DATA};

    const NOW: Duration = Duration::from_secs(100);

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
        assert_eq!(boot.hear(&status(7, 4_000, false), NOW), MessageBoot::Present);
        assert_eq!(boot.hear(&status(7, 4_100, false), NOW), MessageBoot::Present);
        assert_eq!(boot.hear(&status(9, 100, false), NOW), MessageBoot::New);
        assert_eq!(boot.hear(&status(7, 4_200, false), NOW), MessageBoot::Former, "it was late");
        assert_eq!(boot.number(), Some(9));
    }

    #[test]
    fn with_a_boot_number_the_clock_is_ignored() {
        let mut boot = Boot::default();
        boot.hear(&status(7, 60_000, false), NOW);
        assert_eq!(boot.hear(&at(10), NOW), MessageBoot::Present);
        assert_eq!(boot.hear(&status(7, 60_100, false), NOW), MessageBoot::Present);
    }

    #[test]
    fn without_a_number_a_clock_that_goes_back_is_a_reboot_and_a_late_message_is_not() {
        let mut boot = Boot::default();
        boot.hear(&status(0, 60_000, false), NOW);
        assert_eq!(boot.hear(&at(59_000), NOW), MessageBoot::Present);
        assert_eq!(boot.hear(&at(200), NOW), MessageBoot::New);
        assert_eq!(boot.hear(&at(300), NOW), MessageBoot::Present);
    }

    #[test]
    fn a_vehicle_is_simulated_only_if_both_flags_were_always_set() {
        let of = |heard: &[MavMessage]| {
            let mut boot = Boot::default();
            for message in heard {
                boot.hear(message, NOW);
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

    fn s(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    /// Both have run for long before the station was started.
    #[test]
    fn two_boots_that_alternate_are_two_vehicles_until_one_is_silent() {
        let mut boot = Boot::default();
        for second in 0..30 {
            boot.hear(&status(7, 60_000 + 1_000 * second as u32, false), s(100 + second));
            boot.hear(&status(9, 30_000 + 1_000 * second as u32, false), s(100 + second));
            assert_eq!(boot.of_another_vehicle(s(100 + second)).is_some(), second > 0, "{second}");
        }
        assert_eq!((boot.number(), boot.of_another_vehicle(s(129))), (Some(9), Some(7)));
        assert_eq!(boot.of_another_vehicle(s(138)), Some(7));
        assert_eq!(boot.of_another_vehicle(s(139)), None, "one is left, or none");
        // The one that was not shown is the one that is left: it is shown, and it is no reboot.
        assert_eq!(boot.hear(&status(7, 100_000, false), s(140)), MessageBoot::New);
        assert!(boot.number() == Some(7) && boot.is_back() && boot.of_another_vehicle(s(140)).is_none());
        boot.hear(&status(9, 71_000, false), s(141));
        assert_eq!(boot.of_another_vehicle(s(141)), Some(9), "it is switched on again, or was out of range");
    }

    /// The second vehicle is switched on while the first is heard, which looks like a reboot at first.
    #[test]
    fn a_boot_that_goes_on_beside_a_new_one_is_another_vehicle() {
        let mut boot = Boot::default();
        for second in 0..20_u32 {
            let now = s(100 + u64::from(second));
            boot.hear(&status(7, 60_000 + 1_000 * second, false), now);
            if second >= 5 {
                boot.hear(&status(9, 1_000 * (second - 5), false), now);
            }
            assert_eq!(boot.of_another_vehicle(now).is_some(), second > 10, "{second}");
        }
    }

    #[test]
    fn a_vehicle_without_a_number_beside_one_with_a_number_is_another_vehicle() {
        let mut boot = Boot::default();
        boot.hear(&status(7, 60_000, false), NOW);
        boot.hear(&status(0, 9_000, false), NOW);
        assert_eq!((boot.number(), boot.of_another_vehicle(NOW)), (Some(7), Some(0)));
    }

    proptest! {
        /// One vehicle that reboots, over links that deliver up to 4 s late and in any order, is never taken for two.
        #[test]
        fn one_vehicle_is_never_two(
            boots in prop::collection::vec(5_u32..60, 1..6),
            late_ms in prop::collection::vec(0_u64..4_000, 400),
        ) {
            let mut sent = Vec::new();
            let mut at_s = 0;
            for (number, runs_s) in boots.iter().enumerate() {
                for second in 0..*runs_s {
                    let late = Duration::from_millis(late_ms[sent.len() % late_ms.len()]);
                    sent.push((s(at_s) + late, number as u32 + 1, 1_000 * second));
                    at_s += 1;
                }
            }
            sent.sort();
            let mut boot = Boot::default();
            for (now, number, clock_ms) in sent {
                boot.hear(&status(number, clock_ms, false), now);
                prop_assert_eq!(boot.of_another_vehicle(now), None);
            }
        }
    }
}

#[cfg(test)]
mod foreign_tests {
    use super::*;

    fn beat(autopilot: MavAutopilot, mavtype: MavType, custom_mode: u32) -> HEARTBEAT_DATA {
        HEARTBEAT_DATA { autopilot, mavtype, custom_mode, ..HEARTBEAT_DATA::default() }
    }

    /// The numbers are those of the autopilots' own documentation.
    #[test]
    fn val_ardupilot_and_px4_modes_have_their_names() {
        use {MavAutopilot as A, MavType as T};
        for (autopilot, mavtype, number, name) in [
            (A::MAV_AUTOPILOT_ARDUPILOTMEGA, T::MAV_TYPE_QUADROTOR, 1, "ACRO"),
            (A::MAV_AUTOPILOT_ARDUPILOTMEGA, T::MAV_TYPE_HEXAROTOR, 6, "RTL"),
            (A::MAV_AUTOPILOT_ARDUPILOTMEGA, T::MAV_TYPE_QUADROTOR, 9, "LAND"),
            (A::MAV_AUTOPILOT_ARDUPILOTMEGA, T::MAV_TYPE_QUADROTOR, 8, "mode 8"),
            (A::MAV_AUTOPILOT_ARDUPILOTMEGA, T::MAV_TYPE_FIXED_WING, 5, "FBWA"),
            (A::MAV_AUTOPILOT_ARDUPILOTMEGA, T::MAV_TYPE_GROUND_ROVER, 4, "HOLD"),
            (A::MAV_AUTOPILOT_PX4, T::MAV_TYPE_QUADROTOR, 0x0304_0000, "HOLD"),
            (A::MAV_AUTOPILOT_PX4, T::MAV_TYPE_FIXED_WING, 0x0001_0000, "MANUAL"),
            (A::MAV_AUTOPILOT_GENERIC, T::MAV_TYPE_QUADROTOR, 3, "mode 3"),
        ] {
            let foreign = Foreign::of(&beat(autopilot, mavtype, number), None, Duration::ZERO);
            assert_eq!(foreign.mode(), name, "{}", foreign.name());
        }
    }

    #[test]
    fn only_the_heartbeat_of_a_rocket_without_a_known_autopilot_may_be_ours() {
        use {MavAutopilot as A, MavType as T};
        assert!(may_be_ours(&beat(A::MAV_AUTOPILOT_GENERIC, T::MAV_TYPE_ROCKET, 0)));
        assert!(!may_be_ours(&beat(A::MAV_AUTOPILOT_ARDUPILOTMEGA, T::MAV_TYPE_ROCKET, 0)));
        assert!(!may_be_ours(&beat(A::MAV_AUTOPILOT_GENERIC, T::MAV_TYPE_QUADROTOR, 0)));
    }
}
