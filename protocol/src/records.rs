//! The records of the flight log, as plain types: generated from `proto/touchdown/`. Without `std`,
//! so that a flight computer on a board reads and writes the same records.
//!
//! * [`v1`]: the verdict, telemetry, operators.
//! * [`flight_v1`]: the pilot, and the simulated truth.
//! * [`computer_v1`]: the complete flight computer, from power-up on.

macro_rules! generated {
    ($($(#[$about:meta])* $module:ident = $file:literal,)*) => {$(
        $(#[$about])*
        pub mod $module {
            #![allow(
                unreachable_pub,
                clippy::pedantic,
                clippy::allow_attributes_without_reason,
                reason = "generated code; its documentation is in the .proto"
            )]
            include!(concat!(env!("OUT_DIR"), $file));
        }
    )*};
}

generated! {
    /// The records of `proto/touchdown/log/v1.proto`.
    v1 = "/touchdown.log.v1.rs",
    /// The records of `proto/touchdown/flight/v1.proto`.
    flight_v1 = "/touchdown.flight.v1.rs",
    /// The records of `proto/touchdown/computer/v1.proto`.
    computer_v1 = "/touchdown.computer.v1.rs",
}

/// Serialised `google.protobuf.FileDescriptorSet` of [`computer_v1`] and its imports.
pub const DESCRIPTORS_COMPUTER_V1: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/computer_v1.fds"));

/// Serialised `google.protobuf.FileDescriptorSet` of [`flight_v1`].
pub const DESCRIPTORS_FLIGHT_V1: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/flight_v1.fds"));

/// Serialised `google.protobuf.FileDescriptorSet` of [`v1`]: the schema data of its MCAP channels.
pub const DESCRIPTORS_V1: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/log_v1.fds"));
