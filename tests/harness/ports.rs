//! Which port a program has bound. A program under test binds port 0, and the system gives it one that is nobody's: a test
//! that chose a port and let go of it would find it taken now and then.

use std::collections::BTreeSet;
use std::net::Ipv6Addr;
use std::path::Path;
use std::process::Child;
use std::time::Duration;

use crate::PATIENCE;
use crate::process::{left, now};

/// The system does not report that a program has bound a port; it is looked for this often.
const LOOKS_EVERY: Duration = Duration::from_millis(10);

/// A transport protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// A UDP socket.
    Udp,
    /// A TCP socket that listens.
    Tcp,
}

/// The loopback port that a program has bound; waits until it has.
///
/// # Panics
/// It does not bind one.
pub(crate) fn bound_port(child: &mut Child, bound: Bound) -> u16 {
    let deadline = now() + PATIENCE;
    loop {
        if let Some(port) = port_of(child.id(), bound) {
            return port;
        }
        let ended = child.try_wait().expect("a process");
        assert!(ended.is_none() && !left(deadline).is_zero(), "no {bound:?} port is bound ({ended:?})");
        std::thread::sleep(LOOKS_EVERY);
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

/// The loopback ports in one of the kernel's tables, of these sockets. A socket bound to every address speaks to somebody
/// else's port.
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

/// The kernel writes an address as words of four bytes in the machine's order.
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
