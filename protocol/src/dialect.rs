//! The MAVLink dialect, generated at build time from `dialect/touchdown.xml` (which includes `common.xml`).

use mavlink::Message as _;

pub use generated::touchdown::*;

/// The dialect's own XML, for readers of a log that never saw this project.
pub const DIALECT_XML: &str = include_str!("../dialect/touchdown.xml");

/// A message's name in the dialect, as in `HEARTBEAT`; `None` for an id that it does not have.
pub fn message_name(id: u32) -> Option<&'static str> {
    MavMessage::default_message_from_id(id).map(|message| message.message_name())
}

mod generated {
    #![allow(
        missing_docs,
        unreachable_pub,
        unexpected_cfgs,
        deprecated,
        clippy::all,
        clippy::pedantic,
        clippy::unwrap_used,
        clippy::allow_attributes_without_reason,
        reason = "generated code; its lints are its generator's"
    )]
    include!(concat!(env!("OUT_DIR"), "/mod.rs"));
}
