//! The image of the chip; on a desk a program that makes the head of its log.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod chip;

/// `teensy MISSION FILE` writes the head for the log of a built-in mission.
#[cfg(not(target_os = "none"))]
fn main() -> anyhow::Result<()> {
    use anyhow::Context as _;

    let mut arguments = std::env::args().skip(1);
    let (Some(name), Some(file)) = (arguments.next(), arguments.next()) else {
        anyhow::bail!("which MISSION and FILE?")
    };
    let (toml, mission) = teensy::mission(&name).with_context(|| format!("{name} is no built-in mission"))?;
    let start = avionics::log::frame::start_to_log(&teensy::at_power_up(&mission));
    std::fs::write(&file, teensy::head(&name, toml, &start)?).with_context(|| file.clone())
}
