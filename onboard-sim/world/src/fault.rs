//! What can break in flight. A fault acts from the step after it is injected, and stays.

use serde::Deserialize;

/// A fault of motor or actuators.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Fault {
    /// The motor never lights.
    NoLight,
    /// The motor lights later than it should.
    LateLight {
        /// Added to the ignition delay, s.
        delay_s: f64,
    },
    /// The motor has less impulse, in the same time.
    WeakMotor {
        /// Thrust over what it would be.
        scale: f64,
    },
    /// The motor goes out.
    EarlyBurnout {
        /// Time since the first thrust, s.
        after_s: f64,
    },
    /// Both gimbal axes stay where they are.
    GimbalStuck,
    /// The gimbal servos turn slowly.
    GimbalSlow {
        /// Rate over what it would be.
        scale: f64,
    },
    /// One fin stays where it is.
    FinStuck {
        /// Which, 0 to 3; another number breaks nothing.
        fin: usize,
    },
}
