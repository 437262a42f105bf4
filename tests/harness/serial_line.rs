//! Two serial ports joined by a line of limited speed: two pseudo-terminals with a paced copy
//! between them.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::os::fd::{AsFd as _, OwnedFd};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use nix::fcntl::{FcntlArg, FdFlag, fcntl};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;

use crate::time::now;

pub struct SerialLine {
    /// The device of one end.
    pub near: PathBuf,
    /// The device of the other end.
    pub far: PathBuf,
    baud: u32,
    carried: [Arc<AtomicU64>; 2],
    cut: Arc<AtomicBool>,
    copies: Vec<JoinHandle<()>>,
    /// Kept open, so that the line survives a program that closes its end.
    _ends: [OwnedFd; 2],
}

impl SerialLine {
    /// Joins two ports by a line of this baud rate, with ten bits a byte.
    pub fn new(baud: u32) -> Self {
        Self::joined(baud, true)
    }

    /// The same, but bytes sent from the near end are never read, as if the radio had stopped.
    pub fn that_takes_nothing_from_near(baud: u32) -> Self {
        Self::joined(baud, false)
    }

    fn joined(baud: u32, takes_from_near: bool) -> Self {
        let [(near_line, near_end), (far_line, far_end)] = [raw_terminal(), raw_terminal()];
        let near = ttyname(&near_end).expect("a device name");
        let far = ttyname(&far_end).expect("a device name");
        let cut = Arc::new(AtomicBool::new(false));
        let carried = [Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0))];
        let clone = |file: &File| file.try_clone().expect("a descriptor");
        let ways = [
            (clone(&near_line), clone(&far_line), Arc::clone(&carried[0])),
            (far_line, near_line, Arc::clone(&carried[1])),
        ];
        let copies = ways.into_iter().skip(usize::from(!takes_from_near)).map(|(from, to, carried)| {
            let cut = Arc::clone(&cut);
            std::thread::Builder::new()
                .name("serial line".to_owned())
                .spawn(move || copy_paced(from, to, baud, &carried, &cut))
                .expect("a thread")
        });
        let copies = copies.collect();
        Self { near, far, baud, carried, cut, copies, _ends: [near_end, far_end] }
    }

    /// The near end as a link.
    pub fn near_link(&self) -> String {
        format!("serial:{}:{}", self.near.display(), self.baud)
    }

    /// The far end as a link.
    pub fn far_link(&self) -> String {
        format!("serial:{}:{}", self.far.display(), self.baud)
    }

    /// Bytes carried from near to far, and from far to near.
    pub fn carried(&self) -> [u64; 2] {
        [self.carried[0].load(Ordering::Relaxed), self.carried[1].load(Ordering::Relaxed)]
    }
}

impl Drop for SerialLine {
    fn drop(&mut self) {
        self.cut.store(true, Ordering::Relaxed);
        for copy in self.copies.drain(..) {
            // If the thread panicked, the test has failed by missing its bytes.
            let _ = copy.join();
        }
    }
}

fn raw_terminal() -> (File, OwnedFd) {
    let pair = openpty(None, None).expect("a pseudo-terminal");
    let mut settings = tcgetattr(&pair.slave).expect("terminal settings");
    cfmakeraw(&mut settings);
    tcsetattr(&pair.slave, SetArg::TCSANOW, &settings).expect("raw mode");
    // If a program under test inherited an end, it would keep the line open.
    for end in [&pair.master, &pair.slave] {
        fcntl(end, FcntlArg::F_SETFD(FdFlag::FD_CLOEXEC)).expect("a descriptor");
    }
    (File::from(pair.master), pair.slave)
}

/// Waits until a port takes bytes. A port without a reader is full after some thousand; returns
/// `false` if the line is cut then.
fn takes_bytes(port: &File, cut: &AtomicBool) -> bool {
    while !cut.load(Ordering::Relaxed) {
        let mut ready = [PollFd::new(port.as_fd(), PollFlags::POLLOUT)];
        if poll(&mut ready, PollTimeout::from(50u8)).unwrap_or(0) > 0 {
            return true;
        }
    }
    false
}

fn copy_paced(mut from: File, mut to: File, baud: u32, carried: &AtomicU64, cut: &AtomicBool) {
    let byte_time = Duration::from_secs(10) / baud;
    let mut buffer = [0; 32];
    let mut free_at = now();
    while !cut.load(Ordering::Relaxed) {
        let mut ready = [PollFd::new(from.as_fd(), PollFlags::POLLIN)];
        // Bytes that wait already have kept the line busy, however late a busy machine runs this
        // thread.
        if poll(&mut ready, PollTimeout::ZERO).unwrap_or(0) == 0 {
            // The time limit lets the thread notice that the line was cut.
            if poll(&mut ready, PollTimeout::from(50u8)).unwrap_or(0) == 0 {
                continue;
            }
            free_at = free_at.max(now());
        }
        let Ok(count @ 1..) = from.read(&mut buffer) else { continue };
        // The line is busy for as long as its speed requires for these bytes.
        free_at += byte_time * count as u32;
        std::thread::sleep(free_at.saturating_duration_since(now()));
        if !takes_bytes(&to, cut) || to.write_all(&buffer[..count]).is_err() {
            return;
        }
        carried.fetch_add(count as u64, Ordering::Relaxed);
    }
}
