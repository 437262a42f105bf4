//! The flight computer's types and their records in the log: each field is named once, for both
//! directions.

use alloc::string::String;
use alloc::vec::Vec;

use flight::computer::crew::{ANSWERED, CrewCommand, Ending, People, Request, Requests};
use flight::computer::{Commander, LogState, Rehearsed, SensedInput};
use flight::estimation::estimator::alignment::ImuCalibration;
use flight::estimation::estimator::{
    Estimate, FixQuality, GnssFix, Health, HealthIssue, HeightSources, ImuSample, Measurements, Sigmas,
};
use flight::rules::arming::{PredictedLanding, Uplink};
use flight::rules::operator::{Name, Operator, Role};
use flight::rules::two_person::Station;
use flight::text::{Text, text};
use flight::vehicle::rigid::RigidState;
use nalgebra::{Quaternion, UnitQuaternion, Vector2, Vector3};
use protocol::records::{computer_v1, flight_v1};

/// Why a recorded frame cannot be given to this build's flight computer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// A number has no meaning in this build.
    #[error("frame {frame}: {field} {found} is unknown; this build knows 0 to {most}")]
    Unknown {
        frame: u64,
        field: &'static str,
        /// The number.
        found: u32,
        /// The largest number that this build supports.
        most: usize,
    },
    /// A list has the wrong length.
    #[error("frame {frame}: {field} has {found} values and should have {should}")]
    Length {
        frame: u64,
        field: &'static str,
        /// The length found.
        found: usize,
        /// The length that it should have.
        should: usize,
    },
}

/// The place of a value in a log, for errors.
#[derive(Debug, Clone, Copy)]
pub struct At {
    pub frame: u64,
    pub field: &'static str,
}

impl At {
    fn unknown(self, found: u32, most: usize) -> RecordError {
        RecordError::Unknown { frame: self.frame, field: self.field, found, most }
    }
}

/// A type of the flight computer that has a record in the log. No bit is lost on the way there and
/// back.
pub trait Logged: Sized {
    /// Its representation in the log.
    type Record;

    fn to_log(&self) -> Self::Record;

    /// Writes the record over an earlier one, whose lists are used again.
    fn log_over(&self, record: &mut Self::Record) {
        *record = self.to_log();
    }

    /// # Errors
    /// The record has a value that is unknown to this build.
    fn from_log(record: &Self::Record, at: At) -> Result<Self, RecordError>;
}

/// A structure whose record has the same fields; `record = field` for a field with another name.
/// After `;` come fields of the record alone, which begin empty.
macro_rules! record {
    ($logged:ident as $record:path { $($field:ident $(= $name:ident)?),+ $(; $($beside:ident),+)? }) => {
        impl Logged for $logged {
            type Record = $record;

            fn to_log(&self) -> Self::Record {
                let Self { $($($name:)? $field),+ } = self;
                $record { $($field: $field.to_log(),)+ $($($beside: Default::default()),+)? }
            }

            fn log_over(&self, record: &mut Self::Record) {
                let Self { $($($name:)? $field),+ } = self;
                $($field.log_over(&mut record.$field);)+
            }

            fn from_log(record: &Self::Record, at: At) -> Result<Self, RecordError> {
                $(let $field = Logged::from_log(&record.$field, At { field: stringify!($field), ..at })?;)+
                Ok(Self { $($($name:)? $field),+ })
            }
        }
    };
}

record!(RigidState as flight_v1::RigidState { position_m, velocity_m_s, world_from_body, rate_rad_s });
record!(ImuSample as flight_v1::ImuSample { gyro_rad_s, specific_force_m_s2 });
record!(ImuCalibration as flight_v1::ImuCalibration { gyro_bias_rad_s, accelerometer_scale });
record!(FixQuality as flight_v1::FixQuality { satellites, horizontal_m, vertical_m, speed_m_s });
record!(GnssFix as flight_v1::GnssFix { position_m, velocity_m_s, valid_at_s, quality });
record!(Measurements as flight_v1::Measurements { imu, pressure_altitude_m, gnss, lidar_range_m });
record!(Sigmas as flight_v1::Sigmas {
    position_m, velocity_m_s, attitude_rad, gyro_bias_rad_s, accelerometer_bias_m_s2, wind_m_s
});
record!(HeightSources as flight_v1::HeightSources { inertial_m, inertial_sigma_m, barometric_m });
record!(Estimate as flight_v1::Estimate {
    time_s, state, specific_force_m_s2, wind_m_s, gyro_bias_rad_s, accelerometer_bias_m_s2, sigmas, heights, health;
    motor, barometer, gnss_velocity, gnss_position, lidar, wind
});
record!(SensedInput as computer_v1::ComputerInput {
    frame, time_s, measured, gimbal_rad, fins_rad, contact, igniter_continuity, booster_attached, pin_out, battery_v, servo_battery_v,
    log, uplink, commander, people;
    requests, rehearsed, plan_ready
});
record!(LogState as computer_v1::LogState { running, space_bytes });
record!(Station as computer_v1::Station { system, component, number });
record!(Operator as computer_v1::Operator { number, role, name });
record!(Commander as computer_v1::Commander { station, age_s, by, deaf });
record!(Request as computer_v1::Request { asked = command, uplink, station, by, confirms });
record!(PredictedLanding as computer_v1::PredictedLanding { lands, found });
record!(Rehearsed as computer_v1::Rehearsed { warm, found, landing });

/// A choice, by its place in this list.
macro_rules! numbered {
    ($logged:ident: $all:expr) => {
        impl Logged for $logged {
            type Record = u32;

            fn to_log(&self) -> u32 {
                // Every one is in the list; a test checks that.
                $all.iter().position(|known| known == self).unwrap_or($all.len()) as u32
            }

            fn from_log(record: &u32, at: At) -> Result<Self, RecordError> {
                $all.get(*record as usize).copied().ok_or_else(|| at.unknown(*record, $all.len() - 1))
            }
        }
    };
}

const ENDINGS: [Ending; 5] =
    [Ending::Accepted, Ending::NotNow, Ending::Denied, Ending::Failed, Ending::ToConfirm];
pub(crate) const HEALTHS: [Health; 8] = [
    Health::Good,
    Health::Unhealthy(HealthIssue::Restarted),
    Health::Unhealthy(HealthIssue::Imu),
    Health::Unhealthy(HealthIssue::Surprised),
    Health::Unhealthy(HealthIssue::Velocity),
    Health::Unhealthy(HealthIssue::Height),
    Health::Unhealthy(HealthIssue::Horizontal),
    Health::Unhealthy(HealthIssue::Tilt),
];
numbered!(CrewCommand: CrewCommand::ALL);
numbered!(Ending: ENDINGS);
numbered!(Health: HEALTHS);
numbered!(Role: Role::ALL);

/// Types stored in the log unchanged.
macro_rules! plain {
    ($($logged:ident),+) => {$(
        impl Logged for $logged {
            type Record = Self;

            fn to_log(&self) -> Self {
                self.clone()
            }

            fn from_log(record: &Self, _: At) -> Result<Self, RecordError> {
                Ok(record.clone())
            }
        }
    )+};
}

plain!(bool, f64, u32, u64, String);

/// Protobuf's shortest number has 32 bits.
macro_rules! short {
    ($($logged:ident),+) => {$(
        impl Logged for $logged {
            type Record = u32;

            fn to_log(&self) -> u32 {
                u32::from(*self)
            }

            fn from_log(record: &u32, at: At) -> Result<Self, RecordError> {
                $logged::try_from(*record).map_err(|_too_large| at.unknown(*record, usize::from($logged::MAX)))
            }
        }
    )+};
}

short!(u8, u16);

impl<T: Logged> Logged for Option<T> {
    type Record = Option<T::Record>;

    fn to_log(&self) -> Self::Record {
        self.as_ref().map(Logged::to_log)
    }

    fn from_log(record: &Self::Record, at: At) -> Result<Self, RecordError> {
        record.as_ref().map(|record| T::from_log(record, at)).transpose()
    }
}

impl<const N: usize> Logged for [f64; N] {
    type Record = Vec<f64>;

    fn to_log(&self) -> Vec<f64> {
        self.to_vec()
    }

    fn log_over(&self, record: &mut Vec<f64>) {
        record.clear();
        record.extend_from_slice(self);
    }

    fn from_log(record: &Vec<f64>, At { frame, field }: At) -> Result<Self, RecordError> {
        let wrong = |_| RecordError::Length { frame, field, found: record.len(), should: N };
        record.as_slice().try_into().map_err(wrong)
    }
}

impl Logged for Requests {
    type Record = Vec<computer_v1::Request>;

    fn to_log(&self) -> Self::Record {
        self.iter().map(Logged::to_log).collect()
    }

    fn from_log(record: &Self::Record, at: At) -> Result<Self, RecordError> {
        if record.len() > ANSWERED {
            let (found, should) = (record.len(), ANSWERED);
            return Err(RecordError::Length { frame: at.frame, field: "requests", found, should });
        }
        record.iter().map(|request| Logged::from_log(request, at)).collect()
    }
}

impl Logged for Vector2<f64> {
    type Record = flight_v1::Vector2;

    fn to_log(&self) -> Self::Record {
        flight_v1::Vector2 { x: self.x, y: self.y }
    }

    fn from_log(record: &Self::Record, _: At) -> Result<Self, RecordError> {
        Ok(Self::new(record.x, record.y))
    }
}

impl Logged for Vector3<f64> {
    type Record = flight_v1::Vector3;

    fn to_log(&self) -> Self::Record {
        flight_v1::Vector3 { x: self.x, y: self.y, z: self.z }
    }

    fn from_log(record: &Self::Record, _: At) -> Result<Self, RecordError> {
        Ok(vector_from_log(record))
    }
}

impl Logged for UnitQuaternion<f64> {
    type Record = flight_v1::Quaternion;

    fn to_log(&self) -> Self::Record {
        flight_v1::Quaternion { w: self.w, x: self.i, y: self.j, z: self.k }
    }

    fn from_log(record: &Self::Record, _: At) -> Result<Self, RecordError> {
        Ok(attitude_from_log(record))
    }
}

/// Uplink of a station; `None` where none is required.
impl Logged for Uplink {
    type Record = Option<computer_v1::Uplink>;

    fn to_log(&self) -> Self::Record {
        match *self {
            Self::NotNeeded => None,
            Self::NeverReceived => Some(computer_v1::Uplink { age_s: None }),
            Self::Received { age_s } => Some(computer_v1::Uplink { age_s: Some(age_s) }),
        }
    }

    fn from_log(record: &Self::Record, _: At) -> Result<Self, RecordError> {
        Ok(match record {
            None => Self::NotNeeded,
            Some(computer_v1::Uplink { age_s: None }) => Self::NeverReceived,
            Some(computer_v1::Uplink { age_s: Some(age_s) }) => Self::Received { age_s: *age_s },
        })
    }
}

impl Logged for People {
    type Record = computer_v1::People;

    fn to_log(&self) -> Self::Record {
        match self {
            Self::One => computer_v1::People { count: 1, first_ask: None },
            Self::Two { first } => computer_v1::People { count: 2, first_ask: Some(first.to_log()) },
        }
    }

    fn from_log(record: &Self::Record, at: At) -> Result<Self, RecordError> {
        match (record.count, record.first_ask) {
            (1, _) => Ok(Self::One),
            (2, Some(first_ask)) => Ok(Self::Two { first: Logged::from_log(&first_ask, at)? }),
            (found, _) => Err(at.unknown(found, 2)),
        }
    }
}

/// Types stored in the log as text.
macro_rules! written {
    ($($logged:ident: $read:expr),+) => {$(
        impl Logged for $logged {
            type Record = String;

            fn to_log(&self) -> String {
                self.as_str().into()
            }

            fn from_log(record: &String, _: At) -> Result<Self, RecordError> {
                Ok($read(record))
            }
        }
    )+};
}

written!(Name: Name::new, Text: |words: &str| text!("{words}"));

/// A recorded vector.
pub fn vector_from_log(vector: &flight_v1::Vector3) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, vector.z)
}

/// It had length 1 when it was written; normalising it again could change a bit.
fn attitude_from_log(attitude: &flight_v1::Quaternion) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(attitude.w, attitude.x, attitude.y, attitude.z))
}

/// A calibration from its record.
pub fn calibration_from_log(calibration: &flight_v1::ImuCalibration) -> ImuCalibration {
    ImuCalibration {
        gyro_bias_rad_s: vector_from_log(&calibration.gyro_bias_rad_s),
        accelerometer_scale: calibration.accelerometer_scale,
    }
}

/// A recorded state.
pub fn state_from_log(state: &flight_v1::RigidState) -> RigidState {
    RigidState {
        position_m: vector_from_log(&state.position_m),
        velocity_m_s: vector_from_log(&state.velocity_m_s),
        world_from_body: attitude_from_log(&state.world_from_body),
        rate_rad_s: vector_from_log(&state.rate_rad_s),
    }
}

#[cfg(test)]
pub(crate) mod tests;
