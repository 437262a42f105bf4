//! Messages put together again to whole frames and whole answers. What misses a part is not used: a frame with a lost
//! satellite fix is a lost frame, not a frame without a fix.

use flight::computer::pilot::BoosterCommands;
use flight::rules::phase::Phase;
use flight::vehicle::rigid::RigidState;
use hil::carried::{CarriedCommands, CarriedFix, CarriedReadings};
use hil::computer::Answer;
use hil::readings::Switches;
use hil::start::{Pace, Start};
use nalgebra::{Quaternion, UnitQuaternion};
use protocol::dialect::{
    HIL_ACTUATOR_CONTROLS_DATA, HIL_GPS_DATA, HIL_SENSOR_DATA, MavMessage, TD_HIL_COMPUTER_DATA,
    TD_HIL_START_DATA, TD_HIL_VEHICLE_DATA, TdHilPace, TdHilSwitch,
};
use protocol::mission::MissionHash;

use super::messages::{BAROMETER, FRAME_US, channel};

/// What arrives at a flight computer.
#[derive(Debug, Clone, PartialEq)]
pub enum ToComputer {
    /// A flight begins, of the mission with this hash.
    Start(Start, MissionHash),
    /// A whole frame.
    Frame { flight_id: u32, frame: u64, readings: CarriedReadings },
}

/// Puts frames together.
#[derive(Debug, Clone, Default)]
pub struct FrameAssembly {
    vehicle: Option<TD_HIL_VEHICLE_DATA>,
    fix: Option<CarriedFix>,
    range_cm: Option<u16>,
    broken: u64,
}

impl FrameAssembly {
    /// Takes a message; returns what is whole with it.
    pub fn take(&mut self, message: &MavMessage) -> Option<ToComputer> {
        match message {
            MavMessage::TD_HIL_START(start) => Some(start_of(start)),
            MavMessage::TD_HIL_VEHICLE(vehicle) => {
                self.broken += u64::from(self.vehicle.is_some());
                let broken = self.broken;
                *self = Self { vehicle: Some(vehicle.clone()), broken, ..Self::default() };
                None
            }
            MavMessage::HIL_GPS(gps) => {
                let vehicle = self.vehicle.as_ref()?;
                if gps.time_usec == vehicle.gnss_time_usec {
                    self.fix = Some(fix_of(gps));
                }
                None
            }
            MavMessage::DISTANCE_SENSOR(range) => {
                let vehicle = self.vehicle.as_ref()?;
                if u64::from(range.time_boot_ms) * 1000 == vehicle.time_usec {
                    self.range_cm = Some(range.current_distance);
                }
                None
            }
            MavMessage::HIL_SENSOR(sensor) => {
                let whole = self.whole(sensor);
                self.broken += u64::from(whole.is_none());
                self.vehicle = None;
                whole
            }
            _ => None,
        }
    }

    fn whole(&self, sensor: &HIL_SENSOR_DATA) -> Option<ToComputer> {
        let vehicle = self.vehicle.as_ref().filter(|vehicle| vehicle.time_usec == sensor.time_usec)?;
        let has_fix = vehicle.gnss_time_usec != u64::MAX;
        let has_range = vehicle.range != 0;
        let whole_frames = vehicle.time_usec.is_multiple_of(FRAME_US);
        if has_fix != self.fix.is_some() || has_range != self.range_cm.is_some() || !whole_frames {
            return None;
        }
        let readings = CarriedReadings {
            gyro_rad_s: [sensor.xgyro, sensor.ygyro, sensor.zgyro],
            specific_force_m_s2: [sensor.xacc, sensor.yacc, sensor.zacc],
            pressure_altitude_m: sensor.fields_updated.contains(BAROMETER).then_some(sensor.pressure_alt),
            fix: self.fix,
            range_cm: self.range_cm,
            gimbal_rad: vehicle.gimbal,
            fins_rad: vehicle.fins,
            switches: switches_of(vehicle.switches),
        };
        let frame = vehicle.time_usec / FRAME_US;
        Some(ToComputer::Frame { flight_id: vehicle.flight_id, frame, readings })
    }

    /// Frames of which a part was lost.
    pub fn broken(&self) -> u64 {
        self.broken
    }
}

fn start_of(start: &TD_HIL_START_DATA) -> ToComputer {
    let [w, x, y, z] = start.world_from_body;
    let believed = RigidState {
        position_m: start.position_m.into(),
        velocity_m_s: start.velocity_m_s.into(),
        // Not normalised again: the bits stay.
        world_from_body: UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
        rate_rad_s: start.rate_rad_s.into(),
    };
    let pace = match start.pace {
        TdHilPace::TD_HIL_PACE_LOCKSTEP => Pace::Lockstep,
        TdHilPace::TD_HIL_PACE_REAL_TIME => Pace::RealTime,
    };
    let begun = Start { flight_id: start.flight_id, believed, pace };
    ToComputer::Start(begun, MissionHash(start.mission_hash))
}

fn fix_of(gps: &HIL_GPS_DATA) -> CarriedFix {
    CarriedFix {
        latitude_e7: gps.lat,
        longitude_e7: gps.lon,
        altitude_mm: gps.alt,
        velocity_cm_s: [gps.vn, gps.ve, gps.vd],
        valid_at_us: gps.time_usec,
    }
}

fn switches_of(flags: TdHilSwitch) -> Switches {
    Switches {
        contact: flags.contains(TdHilSwitch::TD_HIL_SWITCH_CONTACT),
        igniter_continuity: flags.contains(TdHilSwitch::TD_HIL_SWITCH_IGNITER),
        booster_attached: flags.contains(TdHilSwitch::TD_HIL_SWITCH_BOOSTER),
        pin_out: flags.contains(TdHilSwitch::TD_HIL_SWITCH_PIN_OUT),
    }
}

/// Puts answers together.
#[derive(Debug, Clone, Default)]
pub struct AnswerAssembly {
    computer: Option<TD_HIL_COMPUTER_DATA>,
}

impl AnswerAssembly {
    /// Takes a message; returns the answer that is whole with it.
    pub fn take(&mut self, message: &MavMessage) -> Option<Answer> {
        match message {
            MavMessage::TD_HIL_COMPUTER(computer) => {
                self.computer = Some(computer.clone());
                None
            }
            MavMessage::HIL_ACTUATOR_CONTROLS(controls) => {
                let computer = self.computer.take()?;
                (computer.time_usec == controls.time_usec).then(|| answer_of(&computer, controls)).flatten()
            }
            _ => None,
        }
    }
}

fn answer_of(computer: &TD_HIL_COMPUTER_DATA, actuators: &HIL_ACTUATOR_CONTROLS_DATA) -> Option<Answer> {
    let controls = &actuators.controls;
    let flows = |channel: usize| controls[channel] > 0.5;
    let quarter_turns = |first: usize| core::array::from_fn(|place| controls[first + place]);
    Some(Answer {
        flight_id: computer.flight_id,
        frame: computer.time_usec / FRAME_US,
        commands: CarriedCommands {
            gimbal_quarter_turns: quarter_turns(channel::GIMBAL),
            fins_quarter_turns: core::array::from_fn(|fin| controls[channel::FINS + fin]),
            ignite: flows(channel::IGNITE),
            parachute: flows(channel::PARACHUTE),
            booster: BoosterCommands {
                ignite: flows(channel::IGNITE_BOOSTER),
                separate: flows(channel::SEPARATE),
            },
        },
        phase: Phase::from_index(computer.phase as u8)?,
        digest: computer.digest,
        held: u64::from(computer.frames_held),
    })
}
