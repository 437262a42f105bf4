//! What a driver hands up.

use std::net::SocketAddr;

/// One of the streams of a link, as its driver numbers them: a server on TCP has one for each client. Numbers are not
/// used twice.
pub type Peer = u64;

/// Who sent something over a link, as its driver tells its senders apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The sender of a datagram.
    Datagram(SocketAddr),
    /// One of the link's streams.
    Stream(Peer),
}

/// What a link brings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// One datagram: its end is the end of its frames.
    Datagram {
        /// Its sender, by its own word.
        from: SocketAddr,
        /// What it holds.
        bytes: Vec<u8>,
    },
    /// A piece of a stream.
    Stream(Peer, Vec<u8>),
    /// The stream has paused for longer than a frame may: what is incomplete will stay so.
    Silence(Peer),
    /// The stream has ended.
    Gone(Peer),
    /// Others have sent to it that are not answered; how many, in words. Said now and then.
    Strangers(String),
    /// The link works; says with whom.
    Up(String),
    /// The link does not work; says why. It is tried again.
    Down(String),
}
