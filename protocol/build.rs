//! Generates the MAVLink dialect from its XML and the records of the log from their `.proto` files,
//! and notes which build this is, so that every log can name it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use anyhow::{Context, Result, ensure};
use prost::Message as _;
use sha2::Digest as _;

fn main() -> Result<()> {
    let out_dir = PathBuf::from(env::var("OUT_DIR").context("OUT_DIR")?);
    generate_dialect(&out_dir)?;
    for package in ["log", "flight", "computer"] {
        generate_records(&out_dir, package)?;
    }
    note_the_build()
}

fn generate_dialect(out_dir: &Path) -> Result<()> {
    // The generated code checks for features that this crate does not have.
    println!("cargo:rustc-check-cfg=cfg(feature, values(\"serde\", \"arbitrary\", \"ts-rs\"))");
    for file in ["minimal", "standard", "common", "touchdown"] {
        println!("cargo:rerun-if-changed=dialect/{file}.xml");
    }
    // Only the messages: their numbers, fields and checksums are the same.
    let folder = if env::var_os("CARGO_FEATURE_STD").is_some() {
        PathBuf::from("dialect")
    } else {
        let folder = out_dir.join("dialect");
        only_messages_of_a_vehicle(&folder)?;
        folder
    };
    let file = folder.join("touchdown.xml");
    mavlink_bindgen::generate(mavlink_bindgen::XmlDefinitions::Files(vec![&file]), out_dir)
        .with_context(|| file.display().to_string())?;
    Ok(())
}

fn generate_records(out_dir: &Path, package: &str) -> Result<()> {
    let file = format!("proto/touchdown/{package}/v1.proto");
    println!("cargo:rerun-if-changed={file}");
    let descriptors = protox::compile([&file], ["proto"]).with_context(|| file.clone())?;
    fs::write(out_dir.join(format!("{package}_v1.fds")), descriptors.encode_to_vec())?;
    let mut config = prost_build::Config::new();
    if package == "computer" {
        // What it imports is generated already.
        config.extern_path(".touchdown.flight.v1", "crate::records::flight_v1");
    }
    for judged in ["LandingVerdict", "Landing", "LimitResult"] {
        config.type_attribute(judged, "#[cfg_attr(feature = \"program\", derive(serde::Serialize))]");
    }
    // Each message says its name, which the log names its schema by.
    config.enable_type_names().compile_fds(descriptors).with_context(|| file.clone())
}

/// What a vehicle says and hears of the standard's messages; beside them it knows all of ours. The
/// code of all 254 messages would not fit into a flight computer's flash.
const OF_A_VEHICLE: &str = include_str!("dialect/of_a_vehicle.txt");

/// Writes the dialect's files without all other messages.
fn only_messages_of_a_vehicle(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let mut missing: BTreeSet<&str> = OF_A_VEHICLE.split_whitespace().collect();
    for file in ["minimal.xml", "standard.xml", "common.xml", "touchdown.xml"] {
        let (mut kept, mut leaves_out) = (String::new(), false);
        for line in fs::read_to_string(Path::new("dialect").join(file)).context(file)?.lines() {
            let name = line.trim_start().strip_prefix("<message ").and_then(|rest| {
                let (_, name) = rest.split_once("name=\"")?;
                name.split('"').next()
            });
            if let Some(name) = name {
                let ours = file == "touchdown.xml";
                leaves_out = !ours && !OF_A_VEHICLE.split_whitespace().any(|known| known == name);
                missing.remove(name);
            }
            if !leaves_out {
                kept += line;
                kept.push('\n');
            }
            leaves_out &= !line.contains("</message>");
        }
        fs::write(folder.join(file), kept).context(file)?;
    }
    ensure!(missing.is_empty(), "the dialect has no {missing:?}");
    Ok(())
}

/// A development build names no commit: it contains later edits, and a name that changes with every
/// commit would make Cargo compile everything that depends on this crate again.
fn commit_of_a_release() -> Result<String> {
    if env::var("PROFILE").context("PROFILE")? != "release" {
        return Ok("none: a development build".to_owned());
    }
    let git = |args: &[&str]| {
        let output = Command::new("git").args(args).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    if let Some(git_dir) = git(&["rev-parse", "--absolute-git-dir"]) {
        println!("cargo:rerun-if-changed={git_dir}/HEAD");
        println!("cargo:rerun-if-changed={git_dir}/logs/HEAD");
    }
    Ok(git(&["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".to_owned()))
}

fn note_the_build() -> Result<()> {
    let commit = commit_of_a_release()?;
    let rustc = env::var("RUSTC").context("RUSTC")?;
    let version = Command::new(rustc).arg("--version").output().context("rustc --version")?;
    let version = String::from_utf8_lossy(&version.stdout).trim().to_owned();

    println!("cargo:rerun-if-changed=../Cargo.lock");
    let lock = fs::read("../Cargo.lock").unwrap_or_default();
    let lock_hash =
        sha2::Sha256::digest(&lock).iter().fold(String::new(), |hex, byte| format!("{hex}{byte:02x}"));

    println!("cargo:rustc-env=TOUCHDOWN_GIT_COMMIT={commit}");
    println!("cargo:rustc-env=TOUCHDOWN_RUSTC={version}");
    println!("cargo:rustc-env=TOUCHDOWN_TARGET={}", env::var("TARGET").context("TARGET")?);
    let features = env::var("CARGO_CFG_TARGET_FEATURE").unwrap_or_default();
    println!("cargo:rustc-env=TOUCHDOWN_TARGET_FEATURES={features}");
    println!("cargo:rustc-env=TOUCHDOWN_LOCK_SHA256={lock_hash}");
    Ok(())
}
