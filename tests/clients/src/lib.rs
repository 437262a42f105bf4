//! Runs other people's programs: MAVLink ground stations and libraries, Wireshark, readers of MCAP
//! and of tables, a browser.
//!
//! Python and Node packages are installed with pinned versions into `target/clients` and nowhere
//! else. Other programs must be on the machine. If one is missing, its test fails and says what to
//! install, so that a test that did not run never counts as passed.
//!
//! Each program runs with settings of its own ([`outside`]), independent of the user's plugins,
//! paths and preferences.
#![expect(clippy::missing_panics_doc, reason = "a function that panics fails its test, which is its purpose")]

mod install;
mod run;

pub use install::{NodePackages, PythonPackages};
pub use run::{found, outside, tshark, tshark_folder};

use std::path::{Path, PathBuf};

/// Without dependencies, because MAVProxy depends on plotting and vision packages that its command
/// line does not need.
pub static PYMAVLINK: PythonPackages = PythonPackages::without_dependencies(
    "pymavlink",
    &[
        "pymavlink==2.4.50",
        "fastcrc==0.5.0",
        "lxml==6.1.3",
        "MAVProxy==1.8.75",
        "pyserial==3.5",
        "pynmeagps==1.1.8",
        "packaging==26.3",
        "numpy==2.4.6",
    ],
);

/// MAVSDK as one native library.
pub static MAVSDK_NATIVE: PythonPackages =
    PythonPackages::without_dependencies("mavsdk-native", &["mavsdk==4.1.0"]);

/// MAVSDK with its server.
pub static MAVSDK_GRPC: PythonPackages = PythonPackages::without_dependencies(
    "mavsdk-grpc",
    &["mavsdk==3.17.4", "grpcio==1.85.1", "protobuf==7.36.2", "typing_extensions==4.16.0"],
);

/// Readers of the files that `replay` writes.
pub static READERS: PythonPackages = PythonPackages::with_dependencies(
    "readers",
    &[
        "mcap==1.6.0",
        "mcap-protobuf-support==0.6.0",
        "pymcap-cli==0.34.0",
        "pandas==3.1.1",
        "polars==2.1.0",
        "pyarrow==26.0.1",
        "pymavlink==2.4.50",
    ],
);

/// A simulator of ascents.
pub static ROCKETPY: PythonPackages = PythonPackages::with_dependencies("rocketpy", &["rocketpy==1.13.0"]);

/// A flight dynamics model.
pub static JSBSIM: PythonPackages =
    PythonPackages::without_dependencies("jsbsim", &["jsbsim==1.3.3", "numpy==2.4.6"]);

/// Rerun with its command-line program.
pub static RERUN: PythonPackages = PythonPackages::with_dependencies("rerun", &["rerun-sdk==0.36.3"]);

/// A MAVLink library for Node.
pub static NODE_MAVLINK: NodePackages = NodePackages::new("node-mavlink", &["node-mavlink@2.3.0"]);

/// The libraries with which Foxglove reads MCAP.
pub static NODE_MCAP: NodePackages =
    NodePackages::new("node-mcap", &["@mcap/core@2.2.2", "@mcap/support@1.1.0", "protobufjs@8.8.1"]);

/// The last open-source version of Foxglove's application, and a library that controls a browser.
pub static FOXGLOVE: NodePackages = NodePackages::new(
    "foxglove",
    &["@foxglove/studio-base@1.48.0", "react@17.0.2", "react-dom@17.0.2", "puppeteer-core@24.43.1"],
);

/// The path of a file of this package.
pub fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The path of our MAVLink definitions.
pub fn dialect() -> PathBuf {
    file("../../protocol/dialect/touchdown.xml")
}
