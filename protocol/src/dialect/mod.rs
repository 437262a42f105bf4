//! The messages of the MAVLink dialect, generated at build time from `dialect/touchdown.xml`, which
//! includes `common.xml`.

use mavlink::Message as _;

pub use generated::touchdown::*;

/// The dialect's XML, which is attached to every log for readers outside this project.
pub const DIALECT_XML: &str = include_str!("../../dialect/touchdown.xml");

/// The dialect's XML and that of the files it includes.
pub const XML_FILES: [&str; 4] = [
    DIALECT_XML,
    include_str!("../../dialect/common.xml"),
    include_str!("../../dialect/standard.xml"),
    include_str!("../../dialect/minimal.xml"),
];

/// Returns a message's name in the dialect, for example `HEARTBEAT`; `None` for an unknown id.
pub fn message_name(id: u32) -> Option<&'static str> {
    MavMessage::default_message_from_id(id).map(|message| message.message_name())
}

mod generated {
    #![allow(
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
