//! This crate is the flight software: it turns sensor samples into commands, and does nothing else.
//!
//! The crate is pure: state, inputs and time are arguments, and the same arguments give the same
//! bits on any machine. It uses no clock, socket, file, thread or random source, and it needs no
//! operating system. So a log of the inputs is enough to fly a flight again.
//!
//! The modules, in reading order:
//!
//! * [`vehicle`] describes the rocket, its motor, the air and a mission, as data.
//! * [`estimation`] estimates from the sensors where the rocket is and how strong its motor is.
//! * [`guidance`] decides where to steer, when to light the motor, and how to land.
//! * [`control`] turns a commanded direction into commands for gimbal and fins.
//! * [`rules`] decides the permitted actions: phases, checks and limits.
//! * [`computer`] is the flight computer: one frame, from sensor samples to commands.
//! * [`text`](mod@text) formats the texts for the crew in fixed memory.
//!
//! With the feature `files`, `vehicles` reads the files that describe a vehicle. The crate [`ocp`]
//! solves the landing problem.
//!
//! Units are SI and radians; names carry units and frames. The frames are those of
//! [`vehicle::rigid`].
#![cfg_attr(not(test), no_std)]

extern crate alloc;
#[cfg(test)]
extern crate self as flight;

/// An enumeration whose variants have a number, from 0, and a name that people see.
#[macro_export]
macro_rules! numbered_enum {
    ($(#[$attribute:meta])* pub enum $name:ident { $($(#[$meaning:meta])* $variant:ident = $word:literal,)+ }) => {
        $(#[$attribute])*
        #[repr(u8)]
        pub enum $name { $($(#[$meaning])* $variant),+ }

        impl $name {
            /// Every one, in the order of the numbers.
            pub const ALL: [Self; [$($word),+].len()] = [$(Self::$variant),+];

            /// The name that people see.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $word),+ }
            }

            /// The number in telemetry and logs, from 0.
            pub fn index(self) -> u8 {
                self as u8
            }

            /// The one of a number, if there is one.
            pub fn from_index(index: u8) -> Option<Self> {
                Self::ALL.get(usize::from(index)).copied()
            }
        }
    };
}

/// A struct that has a default value beside each field, as Rust's `default_field_values` will have
/// it.
#[macro_export]
macro_rules! with_defaults {
    ($(#[$attribute:meta])* $seen:vis struct $name:ident {
        $($(#[$about:meta])* $field_seen:vis $field:ident: $kind:ty = $default:expr,)+
    }) => {
        $(#[$attribute])*
        $seen struct $name { $($(#[$about])* $field_seen $field: $kind,)+ }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)+ }
            }
        }
    };
}

pub mod vehicle {
    //! Describes the rocket, its motor, the air and a mission as data.
    //!
    //! * [`mission`] holds a flight from apogee: the vehicle, the start, the settings and the
    //!   limits.
    //! * [`airframe`] holds masses, shape and actuators.
    //! * [`thrust_curve`] is the certified motor, [`lot`] the measured burns of its lot, and
    //!   [`burn`] the expected burn of this motor.
    //! * [`atmosphere`] and [`fins`] give the air and its forces on the fins.
    //! * [`rigid`] is the state in space.
    //! * [`site`] is the launch site: position, air and ground.
    //! * [`launch`] is the ascent: the rail, and the booster stage; [`drop`](mod@drop) the release
    //!   from a drone.

    pub mod airframe;
    pub mod atmosphere;
    pub mod burn;
    pub mod drop;
    pub mod fins;
    pub mod launch;
    pub mod lot;
    pub mod mission;
    pub mod rigid;
    pub mod site;
    pub mod thrust_curve;
}

pub mod estimation {
    //! Estimates the rocket's state and the strength of its motor from the sensors.
    //!
    //! * [`estimator`] finds state and wind from the sensors.
    //! * [`motor_estimate`] finds impulse, burn time and ignition of the motor.
    //! * `spikes` removes single wrong pressures.
    //! * [`sensor_watch`] detects silent sensors and implausible samples.

    pub mod estimator;
    pub mod motor_estimate;
    pub mod sensor_watch;
    pub(crate) mod spikes;
}

pub mod guidance {
    //! Decides where to steer, when to light the motor, and how to land.
    //!
    //! * [`descent`] steers by the fins before ignition.
    //! * [`vertical`] computes the band of heights from which a landing exists, [`ignition`] when
    //!   to light the motor.
    //! * [`powered`] plans and flies the landing burn.

    pub mod descent;
    pub mod ignition;
    pub mod powered;
    pub mod vertical;
}

pub mod control {
    //! Turns commanded directions into commands for gimbal and fins.
    //!
    //! * [`aim`] points the rocket by its gimbal.
    //! * [`fins`] finds the four openings for commanded moments and drag.

    pub mod aim;
    pub mod fins;
    pub(crate) mod servo;
}

pub mod rules {
    //! The rules for permitted actions.
    //!
    //! * [`phase`] has the flight phases and the one table that moves between them.
    //! * [`arming`] has the checks before arming, [`gate`] the checks before ignition.
    //! * [`outputs`] decides which igniter, charge or parachute is energised.
    //! * [`operator`] has the people who may command; [`two_person`] lets two of them arm and start
    //!   together.
    //! * [`verdict`] has the touchdown limits, and the verdict on a landing.

    pub mod arming;
    pub mod gate;
    pub mod operator;
    pub mod outputs;
    pub mod phase;
    pub mod two_person;
    pub mod verdict;
}

pub mod computer;
pub mod text;

#[cfg(any(test, feature = "files"))]
pub mod vehicles;
