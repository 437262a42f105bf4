//! The MAVLink addresses of vehicle and ground, and the radio's budget.

/// The MAVLink address of a component.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct Address {
    /// System id; 0 addresses every system.
    pub system_id: u8,
    /// Component id; 0 addresses every component.
    pub component_id: u8,
}

/// The vehicle's autopilot (MAV_COMP_ID_AUTOPILOT1, the only component that some clients accept as
/// an autopilot). The user may choose another system id.
pub const VEHICLE: Address = Address { system_id: 1, component_id: 1 };

/// The ground station (MAV_COMP_ID_MISSIONPLANNER, as other ground stations use). The user may
/// choose another system id.
pub const GROUND: Address = Address { system_id: 255, component_id: 190 };

/// A SiK radio's reports about itself (RADIO_STATUS) come from here, on every line that has one.
pub const RADIO: Address = Address { system_id: 51, component_id: 68 };

/// Bytes per second that the default telemetry may use: a SiK radio at 57,600 baud carries this
/// much downwards without error correction.
pub const RADIO_BUDGET_BYTES_S: u32 = 2_000;

/// Bytes per second that telemetry may use over UDP and TCP: ten radios, and 1.5 % of the slowest
/// Wi-Fi (802.11b, 11 Mbit/s). The default rates use an eighth of it; the rest is for clients'
/// requests.
pub const NETWORK_BUDGET_BYTES_S: u32 = 20_000;

/// Largest boot number; the smallest is 1. A command carries the boot that it is addressed to in a
/// parameter, and a float represents every integer up to 2^24 exactly.
pub const LARGEST_BOOT_NUMBER: u32 = 0x00FF_FFFF;

/// The phase has the lowest bits of a vehicle's `custom_mode` (HEARTBEAT), and its boot number the
/// others.
pub const PHASE_BITS: u32 = 8;

/// The commit that this build was made from; other words in a development build.
pub const GIT_COMMIT: &str = env!("TOUCHDOWN_GIT_COMMIT");

impl Address {
    /// Returns the same component of another system: two rockets on one link need different system
    /// ids.
    #[must_use]
    pub fn of_system(self, system_id: u8) -> Self {
        Self { system_id, ..self }
    }

    /// Returns whether a message to `target` is addressed to this component: the ids match or are
    /// the broadcast id 0.
    pub fn accepts(self, target: Address) -> bool {
        (target.system_id == 0 || target.system_id == self.system_id)
            && (target.component_id == 0 || target.component_id == self.component_id)
    }
}
