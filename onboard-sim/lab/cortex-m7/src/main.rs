//! The flight computer on this machine: a process, or the only program of a Cortex-M7.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
mod hosted;
#[cfg(target_os = "none")]
extern crate alloc;

#[cfg(target_os = "none")]
mod m7;
#[cfg(target_os = "none")]
mod storm;

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    hosted::main()
}
