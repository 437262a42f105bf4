//! What a driver hands up.

/// One of the streams of a link, as its driver numbers them: a server on TCP has one for each client. Numbers are not
/// used twice.
pub type Peer = u64;

/// What a link brings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// One datagram: its end is the end of its frames.
    Datagram(Vec<u8>),
    /// A piece of a stream.
    Stream(Peer, Vec<u8>),
    /// The stream has paused for longer than a frame may: what is incomplete will stay so.
    Silence(Peer),
    /// The stream has ended.
    Gone(Peer),
    /// The link works; says with whom.
    Up(String),
    /// The link does not work; says why. It is tried again.
    Down(String),
}
