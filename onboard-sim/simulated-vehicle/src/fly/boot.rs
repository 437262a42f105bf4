//! Identity and budgets of a vehicle on the wire, fixed at power-up.

use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::num::NonZeroU32;

use protocol::hub::line::SHARE;
use protocol::identity::{LARGEST_BOOT_NUMBER, NETWORK_BUDGET_BYTES_S, RADIO_BUDGET_BYTES_S};
use protocol::transport::LinkAddress;

/// Identity and budgets of a vehicle on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnTheWire {
    /// Random number drawn once at each power-up: a different number means a different boot.
    pub boot_number: NonZeroU32,
    /// Budget of each network link, bytes per second.
    pub network_bytes_s: u32,
    /// Budget of each serial link, bytes per second, as far as four fifths of its baud rate go: what a radio behind it carries.
    pub serial_bytes_s: u32,
}

impl OnTheWire {
    /// A random boot number, a network's budget on network links and a radio's on serial ones.
    pub fn drawn() -> Self {
        // The standard library's random hash keys differ in every process.
        let drawn = RandomState::new().build_hasher().finish() as u32 & LARGEST_BOOT_NUMBER;
        let boot_number = NonZeroU32::new(drawn).unwrap_or(NonZeroU32::MIN);
        Self { boot_number, network_bytes_s: NETWORK_BUDGET_BYTES_S, serial_bytes_s: RADIO_BUDGET_BYTES_S }
    }

    pub(super) fn capacity_bytes_s(self, link: &LinkAddress) -> u32 {
        match link {
            LinkAddress::Serial { baud, .. } => {
                self.serial_bytes_s.min((SHARE * f64::from(*baud) / 10.0) as u32)
            }
            LinkAddress::UdpIn(_)
            | LinkAddress::UdpOut(_)
            | LinkAddress::TcpIn(_)
            | LinkAddress::TcpOut(_) => self.network_bytes_s,
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
        let cable = OnTheWire { serial_bytes_s: 20_000, ..OnTheWire::drawn() };
        let line: LinkAddress = "serial:/dev/ttyUSB0:57600".parse().unwrap();
        assert_eq!(cable.capacity_bytes_s(&line), 4_608, "four fifths of what the line carries");
        let slow: LinkAddress = "serial:/dev/ttyUSB0:9600".parse().unwrap();
        for wire in [wire, cable] {
            assert_eq!(wire.capacity_bytes_s(&slow), 768, "whatever a radio would carry");
        }
        let capacity = |link: &str| wire.capacity_bytes_s(&link.parse().unwrap());
        assert_eq!(capacity("udpout:127.0.0.1:14550"), 20_000);
        assert_eq!(capacity("tcpin:127.0.0.1:5760"), 20_000);
        assert_eq!(capacity("serial:/dev/ttyUSB0:57600"), 2_000);
    }
}
