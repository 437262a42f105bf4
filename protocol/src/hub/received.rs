//! Defines what a transport hands to the hub.

use alloc::string::String;
use alloc::vec::Vec;
use core::net::SocketAddr;

/// The number of one stream of a link. A TCP server has a stream for each client. Numbers are not used twice.
pub type StreamId = u64;

/// The sender of some bytes, as a link tells its senders apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    Datagram(SocketAddr),
    Stream(StreamId),
}

/// What a link received.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// One datagram. A frame never continues in the next datagram.
    Datagram {
        /// The address that the datagram names as its sender, which may be forged.
        from: SocketAddr,
        bytes: Vec<u8>,
    },
    /// A piece of a byte stream.
    Stream(StreamId, Vec<u8>),
    /// The stream has paused for longer than a frame may; an incomplete frame will stay incomplete.
    Silence(StreamId),
    Gone(StreamId),
    /// The link does not answer some senders; the text says how many. It comes at most once in ten seconds.
    Strangers(String),
    /// The link works; the text names the peer.
    Up(String),
    /// The link does not work; the text says why. The transport tries again.
    Down(String),
}

impl Received {
    /// The sender of received bytes; `None` for news of the link itself.
    pub fn origin(&self) -> Option<Origin> {
        match self {
            Self::Datagram { from, .. } => Some(Origin::Datagram(*from)),
            Self::Stream(id, _) | Self::Silence(id) => Some(Origin::Stream(*id)),
            Self::Gone(_) | Self::Strangers(_) | Self::Up(_) | Self::Down(_) => None,
        }
    }
}
