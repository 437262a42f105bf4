//! Generates the log records from their `.proto` files.

use std::path::{Path, PathBuf};
use std::{env, fs};

use anyhow::{Context, Result};
use prost::Message as _;

fn main() -> Result<()> {
    let out_dir = PathBuf::from(env::var("OUT_DIR").context("OUT_DIR")?);
    for package in ["log", "flight", "computer"] {
        generate_log_records(&out_dir, package)?;
    }
    Ok(())
}

fn generate_log_records(out_dir: &Path, package: &str) -> Result<()> {
    let file = format!("proto/touchdown/{package}/v1.proto");
    println!("cargo:rerun-if-changed={file}");
    let descriptors = protox::compile([&file], ["proto"]).with_context(|| file.clone())?;
    fs::write(out_dir.join(format!("{package}_v1.fds")), descriptors.encode_to_vec())?;
    let mut config = prost_build::Config::new();
    if package == "computer" {
        // What it imports is generated already.
        config.extern_path(".touchdown.flight.v1", "crate::flight_v1");
    }
    config.compile_fds(descriptors).with_context(|| file.clone())?;
    Ok(())
}
