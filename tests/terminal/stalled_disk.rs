//! A disk that stalls, as an SD card does: the link is served, and every command leaves at once.

use std::path::Path;
use std::process::Command;

use e2e::{PATIENCE, Signal, Terminal, now};
use protocol::dialect::MavCmd;

use super::rig::{Pad, SIZE, ground};

/// Every call that reaches a disk waits while the file exists that DISK_STALLS names.
const SHIM: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>
static void stall(void) { const char *flag = getenv("DISK_STALLS"); while (flag && !access(flag, F_OK)) usleep(10000); }
static int is_file(int fd) { struct stat s; return !fstat(fd, &s) && S_ISREG(s.st_mode); }
#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
int fsync(int fd) { stall(); return NEXT(fsync)(fd); }
int fdatasync(int fd) { stall(); return NEXT(fdatasync)(fd); }
int rename(const char *from, const char *to) { stall(); return NEXT(rename)(from, to); }
int unlink(const char *path) { stall(); return NEXT(unlink)(path); }
ssize_t write(int fd, const void *bytes, size_t n) { if (is_file(fd)) stall(); return NEXT(write)(fd, bytes, n); }
int open(const char *path, int flags, mode_t mode) { stall(); return NEXT(open)(path, flags, mode); }
int open64(const char *path, int flags, mode_t mode) { stall(); return ((int (*)(const char *, int, mode_t))dlsym(RTLD_NEXT, "open64"))(path, flags, mode); }
"#;

/// Compiles the shim in this folder.
fn shim(folder: &Path) -> String {
    let (source, library) = (folder.join("stall.c"), folder.join("stall.so"));
    std::fs::write(&source, SHIM).unwrap();
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-fno-builtin", "-o"]).arg(&library).arg(&source).arg("-ldl");
    assert!(compiler.status().unwrap().success());
    library.to_str().unwrap().to_owned()
}

/// A station on a terminal whose disk stalls while the file `stalls` exists.
fn station(pad: &Pad) -> Terminal {
    let mut command = ground(pad.folder.path(), &["--connect", &pad.proxy.ground_link(), "--log", "g.mcap"]);
    command.env("LD_PRELOAD", shim(pad.folder.path())).env("DISK_STALLS", pad.folder.path().join("stalls"));
    Terminal::start(&command, SIZE, false)
}

/// Stalls the disk until the file is removed, and waits until the station has run into it: it
/// writes its log five times a second.
fn stall(pad: &Pad) {
    std::fs::write(pad.folder.path().join("stalls"), "").unwrap();
    let log = pad.folder.path().join("g.mcap");
    let len = || log.metadata().unwrap().len();
    let (begun, mut before) = (now(), len());
    loop {
        std::thread::sleep(std::time::Duration::from_millis(500));
        let after = len();
        if after == before {
            return;
        }
        before = after;
        assert!(begun.elapsed() < PATIENCE, "the log still grows");
    }
}

fn sent(pad: &Pad, command: MavCmd) -> usize {
    pad.proxy.commands().iter().filter(|request| request.is(command)).count()
}

/// The disk does not continue before the vehicle has done what was commanded.
#[test]
fn hold_disarm_and_abort_leave_in_the_countdown_while_the_disk_stalls() {
    let mut pad = Pad::new();
    let mut screen = station(&pad);
    screen.wait_for("every arming check passes");
    stall(&pad);
    screen.type_until(b"AARM\r", " ARMED ");
    screen.type_until(b"SSTART\r", " T-");
    screen.wait_for_fact("START", "observed yes");
    screen.type_bytes(b"H\r");
    pad.vehicle.wait_for_line("HOLD: no countdown");
    screen.type_until(b"D\r", " disarmed ");
    screen.type_until(b"AARM\r", " ARMED ");
    screen.type_until(b"SSTART\r", " T-");
    pad.vehicle.wait_for_line("countdown started");
    screen.type_bytes(b"\x18\r");
    screen.wait_for_fact("ABORT", "acknowledged ");
    assert!(sent(&pad, MavCmd::MAV_CMD_DO_FLIGHTTERMINATION) > 0);
    std::fs::remove_file(pad.folder.path().join("stalls")).unwrap();
    e2e::wait_for_content(&pad.folder.path().join("touchdown-unfinished.json"));
    screen.signal(Signal::SIGTERM);
}

#[test]
fn an_abort_leaves_in_the_fall_while_the_disk_stalls() {
    let mut pad = Pad::new();
    let mut screen = station(&pad);
    screen.wait_for("every arming check passes");
    screen.type_until(b"AARM\r", " ARMED ");
    stall(&pad);
    screen.type_until(b"SSTART\r", "START  commanded");
    pad.vehicle.wait_for_line("AERO_DESCENT");
    screen.type_bytes(b"\x18\r");
    pad.vehicle.wait_for_line("CHUTE");
    std::fs::remove_file(pad.folder.path().join("stalls")).unwrap();
    e2e::wait_for_content(&pad.folder.path().join("touchdown-unfinished.json"));
    screen.signal(Signal::SIGTERM);
}
