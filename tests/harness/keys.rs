//! Makes and reads signing keys.

use std::path::Path;

use protocol::signing::{Key, Memory, Signing};

use crate::{Ended, Program, Running, program};

/// Runs `onboard-sim keygen NAME` in this folder.
pub fn keygen(folder: &Path, name: &str) -> Ended {
    Running::to_end(program(Program::OnboardSim).args(["keygen", name]).current_dir(folder))
}

/// Signs with the key in `flight.key` in this folder, as another program would that remembers no
/// timestamps.
pub fn signing_with_key_in(folder: &Path) -> Signing {
    let hex = std::fs::read_to_string(folder.join("flight.key")).expect("a key file");
    Signing::new(Key::from_hex(hex.trim_end()).expect("a key"), Memory::default())
}
