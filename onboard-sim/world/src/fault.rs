//! The faults that can occur in flight. A fault acts from the step after its injection and never ends.

use serde::Deserialize;

/// A fault of motor or actuators.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Fault {
    /// The motor never lights.
    NoLight,
    /// The motor lights late.
    LateLight {
        /// Added to the ignition delay, s.
        delay_s: f64,
    },
    /// The motor has less impulse, in the same time.
    WeakMotor {
        /// Thrust, as a fraction of the thrust without the fault.
        scale: f64,
    },
    /// The motor goes out.
    EarlyBurnout {
        /// Time since the first thrust, s.
        after_s: f64,
    },
    /// The ascent motor never lights.
    AscentNoLight,
    /// The ascent motor lights without a command.
    AscentSelfLights,
    /// The ascent motor has less impulse, in the same time.
    AscentWeak {
        /// Thrust, as a fraction of the thrust without the fault.
        scale: f64,
    },
    /// The booster stays on the vehicle.
    SeparationFails,
    /// The charge of the parachute does not burn: the parachute stays in.
    ParachuteFails,
    /// Both gimbal axes are stuck.
    GimbalStuck,
    /// The servo of the pitch axis runs to an angle and stays there.
    GimbalJams {
        /// The angle, degrees; beyond the stop it is the stop.
        deg: f64,
    },
    /// The gimbal servos turn slowly.
    GimbalSlow {
        /// Rate, as a fraction of the rate without the fault.
        scale: f64,
    },
    FinStuck {
        /// The fin, 0 to 3; another number has no effect.
        fin: usize,
    },
}
