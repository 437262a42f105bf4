//! What a vehicle is on the wire, fixed at its power-up.

use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::num::NonZeroU32;

use protocol::identity::RADIO_BUDGET_BYTES_S;
use protocol::transport::Endpoint;

/// What a vehicle is on the wire beside what it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnTheWire {
    /// Random, drawn once for each power-up: whoever sees another number sees another boot.
    pub boot_number: NonZeroU32,
    /// What each network link may be asked to carry, bytes per second; a serial link leads to a radio and has its budget.
    pub network_bytes_s: u32,
}

impl OnTheWire {
    /// A boot of its own, and a radio's budget on every link.
    pub fn drawn() -> Self {
        // The system's own random keys: every process has others.
        let drawn = RandomState::new().build_hasher().finish() as u32;
        let boot_number = NonZeroU32::new(drawn).unwrap_or(NonZeroU32::MIN);
        Self { boot_number, network_bytes_s: RADIO_BUDGET_BYTES_S }
    }

    pub(super) fn capacity_bytes_s(self, link: &Endpoint) -> u32 {
        match link {
            Endpoint::Serial { .. } => RADIO_BUDGET_BYTES_S,
            Endpoint::UdpIn(_) | Endpoint::UdpOut(_) | Endpoint::TcpIn(_) | Endpoint::TcpOut(_) => {
                self.network_bytes_s
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_boot_draws_a_number_of_its_own() {
        let mut numbers: Vec<_> = (0..50).map(|_| OnTheWire::drawn().boot_number).collect();
        numbers.sort_unstable();
        numbers.dedup();
        assert!(numbers.len() > 45, "{} different of 50", numbers.len());
    }

    #[test]
    fn a_network_link_may_carry_more_and_a_serial_line_has_the_radio_s_budget() {
        let wire = OnTheWire { network_bytes_s: 20_000, ..OnTheWire::drawn() };
        let capacity = |link: &str| wire.capacity_bytes_s(&link.parse().unwrap());
        assert_eq!(capacity("udpout:127.0.0.1:14550"), 20_000);
        assert_eq!(capacity("tcpin:127.0.0.1:5760"), 20_000);
        assert_eq!(capacity("serial:/dev/ttyUSB0:57600"), 2_000);
    }
}
