//! The memory map of the chip: code in flash, stack in the tightly coupled half of the chip's
//! banks, heap and static data in what is left, which is one piece of memory.

use std::env;

use imxrt_rt::{Family, FlexRamBanks, Memory, RuntimeBuilder};

/// Flash of a Teensy 4.1, bytes: 8 MB less the part that its loader keeps.
const FLASH_BYTES: usize = 7936 * 1024;
/// Banks of 32 KB of the chip's 512 KB that can be either kind of memory. Those that serve as OCRAM
/// follow its 512 KB of OCRAM without a gap (i.MX RT1060 reference manual, chapter 9).
const BANKS: FlexRamBanks = FlexRamBanks { ocram: 9, itcm: 1, dtcm: 6 };
/// A plan needs most of it; the stack's lower end is the bank's, so that a stack that overflows
/// leaves the memory, which is a fault, and does not change the heap.
const STACK_BYTES: usize = 184 * 1024;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "none") {
        RuntimeBuilder::from_flexspi(Family::Imxrt1060, FLASH_BYTES)
            .flexram_banks(BANKS)
            .text(Memory::Flash)
            .rodata(Memory::Flash)
            .vectors(Memory::Dtcm)
            .data(Memory::Ocram)
            .bss(Memory::Ocram)
            .uninit(Memory::Ocram)
            .heap(Memory::Ocram)
            .heap_size(0)
            .stack(Memory::Dtcm)
            .stack_size(STACK_BYTES)
            .build()?;
        println!("cargo:rustc-link-arg-bins=-Timxrt-link.x");
    }
    Ok(())
}
