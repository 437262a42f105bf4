//! Who is who on the wire, and the radio's budget.

/// A MAVLink address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address {
    /// System id; 0 addresses every system.
    pub system_id: u8,
    /// Component id; 0 addresses every component.
    pub component_id: u8,
}

/// The vehicle's autopilot (MAV_COMP_ID_AUTOPILOT1; some clients take no other for an autopilot), unless it is given
/// another system id.
pub const VEHICLE: Address = Address { system_id: 1, component_id: 1 };

/// The ground station (MAV_COMP_ID_MISSIONPLANNER, as other ground stations use), unless it is given another system id.
pub const GROUND: Address = Address { system_id: 255, component_id: 190 };

/// Bytes per second that the default telemetry may take: what a SiK radio at 57,600 baud carries
/// downwards without error correction.
pub const RADIO_BUDGET_BYTES_S: u32 = 2_000;

impl Address {
    /// The same component of another system: two rockets on one link must not have one id.
    #[must_use]
    pub fn of_system(self, system_id: u8) -> Self {
        Self { system_id, ..self }
    }

    /// Whether a message addressed to `target` is for this component: its own ids or the broadcast 0.
    pub fn accepts(self, target: Address) -> bool {
        (target.system_id == 0 || target.system_id == self.system_id)
            && (target.component_id == 0 || target.component_id == self.component_id)
    }
}
