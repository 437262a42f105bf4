//! Puts the memory map of the Cortex-M7 where its linker looks for it.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=memory.x");
    if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "none") {
        let out_dir = PathBuf::from(env::var_os("OUT_DIR").expect("Cargo sets OUT_DIR"));
        fs::write(out_dir.join("memory.x"), include_str!("memory.x")).expect("OUT_DIR can be written");
        println!("cargo:rustc-link-search={}", out_dir.display());
        println!("cargo:rustc-link-arg-bins=-Tlink.x");
    }
}
