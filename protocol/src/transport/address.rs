//! The address of a link, as a user types it on a command line.

use std::fmt;
use std::str::FromStr;

/// The address of a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkAddress {
    /// `udpin:ADDRESS:PORT` binds the address and answers whoever sends to it.
    UdpIn(String),
    /// `udpout:HOST:PORT` sends to the host first.
    UdpOut(String),
    /// `tcpin:ADDRESS:PORT` serves whoever connects.
    TcpIn(String),
    /// `tcpout:HOST:PORT` connects to the host.
    TcpOut(String),
    /// `serial:DEVICE:BAUD`.
    Serial {
        /// The device file, for example `/dev/ttyUSB0`.
        path: String,
        baud: u32,
    },
}

impl LinkAddress {
    /// Returns how many bytes per second the link can carry; `None` if no limit is known.
    pub fn capacity_bytes_s(&self) -> Option<u32> {
        match self {
            // A byte takes ten bits: a start bit, eight data bits, a stop bit.
            Self::Serial { baud, .. } => Some(baud / 10),
            Self::UdpIn(_) | Self::UdpOut(_) | Self::TcpIn(_) | Self::TcpOut(_) => None,
        }
    }
}

/// Why a link's address was not understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{given}`: {problem}; write udpin:ADDRESS:PORT, udpout:HOST:PORT, tcpin:ADDRESS:PORT, tcpout:HOST:PORT or serial:DEVICE:BAUD"
)]
pub struct LinkAddressError {
    given: String,
    problem: &'static str,
}

impl FromStr for LinkAddress {
    type Err = LinkAddressError;

    fn from_str(given: &str) -> Result<Self, LinkAddressError> {
        let refuse = |problem| LinkAddressError { given: given.to_owned(), problem };
        let (kind, rest) = given.split_once(':').ok_or_else(|| refuse("no kind of link"))?;
        let (head, tail) =
            rest.rsplit_once(':').ok_or_else(|| refuse("the part after the last colon is missing"))?;
        if head.is_empty() {
            return Err(refuse("the address is empty"));
        }
        match kind {
            "udpin" | "udpout" | "tcpin" | "tcpout" => {
                tail.parse::<u16>()
                    .map_err(|_not_a_port| refuse("the port is not a number from 0 to 65535"))?;
                let address = rest.to_owned();
                Ok(match kind {
                    "udpin" => Self::UdpIn(address),
                    "udpout" => Self::UdpOut(address),
                    "tcpin" => Self::TcpIn(address),
                    _ => Self::TcpOut(address),
                })
            }
            "serial" => {
                let baud = tail.parse().map_err(|_not_a_rate| refuse("the baud rate is not a number"))?;
                if !(1_200..=4_000_000).contains(&baud) {
                    return Err(refuse("the baud rate is not between 1200 and 4000000"));
                }
                Ok(Self::Serial { path: head.to_owned(), baud })
            }
            _ => Err(refuse("unknown kind of link")),
        }
    }
}

impl fmt::Display for LinkAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UdpIn(address) => write!(f, "udpin:{address}"),
            Self::UdpOut(address) => write!(f, "udpout:{address}"),
            Self::TcpIn(address) => write!(f, "tcpin:{address}"),
            Self::TcpOut(address) => write!(f, "tcpout:{address}"),
            Self::Serial { path, baud } => write!(f, "serial:{path}:{baud}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_written_as_it_was_read() {
        for name in [
            "udpin:0.0.0.0:14550",
            "udpin:[::]:14550",
            "udpout:[::1]:14550",
            "tcpin:0.0.0.0:5760",
            "tcpout:[::1]:5760",
            "serial:/dev/ttyUSB0:57600",
        ] {
            let address: LinkAddress = name.parse().unwrap();
            assert_eq!(address.to_string(), name);
        }
        assert_eq!(
            "serial:/dev/ttyUSB0:57600".parse::<LinkAddress>().unwrap().capacity_bytes_s(),
            Some(5760)
        );
    }

    #[test]
    fn a_wrong_address_is_refused_with_the_valid_forms() {
        for name in [
            "",
            "udpin",
            "udpin:14550",
            "udpin:host:x",
            "tcp:host:1",
            "tcpin:5760",
            "serial:/dev/x",
            "serial:/dev/x:9",
            "serial::57600",
        ] {
            let error = name.parse::<LinkAddress>().unwrap_err().to_string();
            assert!(error.contains("udpin:ADDRESS:PORT") && error.contains(name), "{error}");
        }
    }
}
