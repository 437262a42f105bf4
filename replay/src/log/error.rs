//! Why a file cannot be used as a flight log.

use protocol::log::record::{TOPIC_COMPUTER_FRAME, TOPIC_PILOT_TICK, TOPIC_RAW_RX, TOPIC_TELEMETRY};
use protocol::text::printable;

/// Most topics of a foreign file listed in a message.
const TOPICS_SHOWN: usize = 8;

/// Why a file cannot be used as a flight log. Damage inside a log is not a reason.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file cannot be read.
    #[error("{name}: cannot be read")]
    Read {
        /// The file.
        name: String,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// The file is empty.
    #[error("{name}: is empty; a flight log is an MCAP file")]
    Empty {
        /// The file.
        name: String,
    },
    /// The file is of another kind.
    #[error(
        "{name}: is not a flight log: it begins with {}, and an MCAP file with 89 4d 43 41 50 30 0d 0a{}",
        hex(found),
        hint(name)
    )]
    NotMcap {
        /// The file.
        name: String,
        /// Its first bytes.
        found: Vec<u8>,
    },
    /// The file begins like a log, but no message can be read.
    #[error("{name}: nothing could be read: it is damaged before its first message: {damage}")]
    NothingReadable {
        /// The file.
        name: String,
        /// What is wrong.
        damage: String,
    },
    /// An MCAP file of another program.
    #[error(
        "{name}: is an MCAP file written by {:?}, but not a flight log: it has {}, and none of {}, {}, {}, {} or similar topics",
        printable(library.as_bytes()), listed(topics), TOPIC_COMPUTER_FRAME, TOPIC_PILOT_TICK, TOPIC_TELEMETRY,
        TOPIC_RAW_RX
    )]
    Foreign {
        /// The file.
        name: String,
        /// The library that wrote it.
        library: String,
        topics: Vec<String>,
    },
}

/// Advice for a file of another known kind.
fn hint(name: &str) -> &'static str {
    let is_tlog =
        std::path::Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("tlog"));
    if is_tlog { "; `replay import` makes a log of a .tlog" } else { "" }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

fn listed(topics: &[String]) -> String {
    if topics.is_empty() {
        return "no topics".to_owned();
    }
    let mut shown: Vec<String> =
        topics.iter().take(TOPICS_SHOWN).map(|topic| printable(topic.as_bytes())).collect();
    if topics.len() > TOPICS_SHOWN {
        shown.push(format!("{} more", topics.len() - TOPICS_SHOWN));
    }
    format!("the topics {}", shown.join(", "))
}
