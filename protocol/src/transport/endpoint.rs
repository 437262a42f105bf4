//! Names of links, as typed on a command line.

use std::fmt;
use std::str::FromStr;

/// Where a link leads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Endpoint {
    /// `udpin:ADDRESS:PORT`: bind it, answer whoever speaks.
    UdpIn(String),
    /// `udpout:HOST:PORT`: speak to it first.
    UdpOut(String),
    /// `tcpin:ADDRESS:PORT`: serve whoever connects.
    TcpIn(String),
    /// `tcpout:HOST:PORT`: connect to it.
    TcpOut(String),
    /// `serial:DEVICE:BAUD`.
    Serial {
        /// Device, as in `/dev/ttyUSB0`.
        path: String,
        /// Baud rate.
        baud: u32,
    },
}

impl Endpoint {
    /// Bytes per second the link can carry; `None` where nothing is known to bound it.
    pub fn capacity_bytes_s(&self) -> Option<u32> {
        match self {
            // Ten bits a byte: start, eight, stop.
            Self::Serial { baud, .. } => Some(baud / 10),
            Self::UdpIn(_) | Self::UdpOut(_) | Self::TcpIn(_) | Self::TcpOut(_) => None,
        }
    }
}

/// Why a link's name was not understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{given}`: {problem}; write udpin:ADDRESS:PORT, udpout:HOST:PORT, tcpin:ADDRESS:PORT, tcpout:HOST:PORT or serial:DEVICE:BAUD"
)]
pub struct EndpointError {
    given: String,
    problem: &'static str,
}

impl FromStr for Endpoint {
    type Err = EndpointError;

    fn from_str(given: &str) -> Result<Self, EndpointError> {
        let refuse = |problem| EndpointError { given: given.to_owned(), problem };
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

impl fmt::Display for Endpoint {
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
    fn names_are_read_and_written_alike() {
        for name in [
            "udpin:0.0.0.0:14550",
            "udpin:[::]:14550",
            "udpout:[::1]:14550",
            "tcpin:0.0.0.0:5760",
            "tcpout:[::1]:5760",
            "serial:/dev/ttyUSB0:57600",
        ] {
            let endpoint: Endpoint = name.parse().unwrap();
            assert_eq!(endpoint.to_string(), name);
        }
        assert_eq!("serial:/dev/ttyUSB0:57600".parse::<Endpoint>().unwrap().capacity_bytes_s(), Some(5760));
    }

    #[test]
    fn a_wrong_name_is_refused_with_what_would_do() {
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
            let error = name.parse::<Endpoint>().unwrap_err().to_string();
            assert!(error.contains("udpin:ADDRESS:PORT") && error.contains(name), "{error}");
        }
    }
}
