//! Finds ports and addresses that no other program takes.
//!
//! A program under test binds port 0, and [`bound_port`] finds out which port the system gave it. A
//! port that must stay the same while a program is restarted belongs to an [`unshared_address`]. No
//! test binds a port only to learn a free number: another program may take that port before it is
//! used.

use std::collections::BTreeSet;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::Path;
use std::process::Child;
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::Duration;

use crate::PATIENCE;
use crate::time::{left, now};

/// The system does not notify us when a program binds a port, so we poll at this interval.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// The kind of a bound socket.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// A UDP socket.
    Udp,
    /// A TCP socket that listens.
    Tcp,
}

/// A loopback address with a port that only this process uses, also while nothing is bound to it.
///
/// The network address is made from the process id, which Linux keeps below 2^22. The port lies
/// below the range from which Linux chooses ports by itself, so a socket that is bound to every
/// address cannot have it by chance.
pub fn unshared_address() -> SocketAddr {
    static NEXT_PORT: AtomicU16 = AtomicU16::new(20_000);
    let [_, a, b, c] = (std::process::id() << 2).to_be_bytes();
    (Ipv4Addr::new(127, a, b, c), NEXT_PORT.fetch_add(1, Ordering::Relaxed)).into()
}

/// Waits until a program has bound a loopback port, and returns the port.
pub(crate) fn bound_port(child: &mut Child, bound: Bound) -> u16 {
    let deadline = now() + PATIENCE;
    loop {
        if let Some(port) = port_of(child.id(), bound) {
            return port;
        }
        let ended = child.try_wait().expect("a process");
        assert!(ended.is_none() && !left(deadline).is_zero(), "no {bound:?} port is bound ({ended:?})");
        std::thread::sleep(POLL_INTERVAL);
    }
}

fn port_of(process: u32, bound: Bound) -> Option<u16> {
    let folder = Path::new("/proc").join(process.to_string());
    let descriptors = std::fs::read_dir(folder.join("fd")).ok()?;
    let sockets: BTreeSet<String> = descriptors
        .filter_map(|descriptor| std::fs::read_link(descriptor.ok()?.path()).ok())
        .filter_map(|target| Some(target.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned()))
        .collect();
    let tables = match bound {
        Bound::Udp => ["net/udp", "net/udp6"],
        Bound::Tcp => ["net/tcp", "net/tcp6"],
    };
    let tables = tables.iter().filter_map(|table| std::fs::read_to_string(folder.join(table)).ok());
    tables.flat_map(|table| ports_in(&table, &sockets, bound)).next()
}

/// The loopback ports of these sockets in one of the kernel's tables. Sockets bound to every
/// address are left out: a program only sends from them.
fn ports_in(table: &str, sockets: &BTreeSet<String>, bound: Bound) -> Vec<u16> {
    let port = |line: &str| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let (local, state, socket) = (*fields.get(1)?, *fields.get(3)?, *fields.get(9)?);
        let listens = bound == Bound::Udp || state == "0A";
        let (address, port) = local.split_once(':')?;
        (listens && is_loopback(address) && sockets.contains(socket))
            .then(|| u16::from_str_radix(port, 16).ok())?
    };
    table.lines().skip(1).filter_map(port).collect()
}

/// The kernel writes an address as four-byte words in the machine's byte order.
fn is_loopback(address: &str) -> bool {
    let words: Option<Vec<u32>> = (0..address.len())
        .step_by(8)
        .map(|at| u32::from_str_radix(address.get(at..at + 8)?, 16).ok())
        .collect();
    match words.as_deref() {
        Some([word]) => word.to_ne_bytes()[0] == 127,
        Some([a, b, c, d]) => {
            let bytes: Vec<u8> = [a, b, c, d].iter().flat_map(|word| word.to_ne_bytes()).collect();
            <[u8; 16]>::try_from(bytes).is_ok_and(|bytes| Ipv6Addr::from(bytes).is_loopback())
        }
        _ => false,
    }
}
