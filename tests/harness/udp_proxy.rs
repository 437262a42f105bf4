//! A UDP proxy between a vehicle and a ground station. It loses, duplicates, delays and drops
//! datagrams as a test requests.

use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use protocol::command::CommandRequest;
use protocol::frame::Framer;

use crate::time::{left, now};
use crate::{PATIENCE, Random};

/// The message id of COMMAND_ACK.
const COMMAND_ACK_ID: u32 = 77;
/// The proxy's threads check this often whether the test is over.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// What the proxy does with datagrams, in both directions.
#[derive(Debug, Clone, Copy, Default)]
pub struct Impairment {
    /// This many of a thousand are lost.
    pub lost_per_1000: u64,
    /// This many of a thousand arrive twice.
    pub duplicated_per_1000: u64,
    /// Each one is delayed by a random time up to this, so that datagrams overtake each other.
    pub delay_max: Duration,
    /// Answers to commands are dropped.
    pub drops_answers: bool,
    /// Everything is dropped.
    pub drops_all: bool,
    /// Everything that the ground sends is dropped.
    pub drops_uplink: bool,
}

/// A proxy between one vehicle and one ground station; both send to it first. A program that is
/// restarted replaces the one before it.
pub struct UdpProxy {
    to_vehicle: UdpSocket,
    to_ground: UdpSocket,
    state: Arc<Mutex<State>>,
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

struct State {
    impairment: Impairment,
    vehicle: Option<SocketAddr>,
    ground: Option<SocketAddr>,
    commands: Vec<CommandRequest>,
    from_ground: u64,
}

impl Default for UdpProxy {
    fn default() -> Self {
        Self::new()
    }
}

impl UdpProxy {
    /// A proxy that forwards everything.
    pub fn new() -> Self {
        let bind = || UdpSocket::bind("127.0.0.1:0").expect("a free port");
        let (to_vehicle, to_ground) = (bind(), bind());
        let impairment = Impairment::default();
        let state = State { impairment, vehicle: None, ground: None, commands: Vec::new(), from_ground: 0 };
        let (state, over) = (Arc::new(Mutex::new(state)), Arc::new(AtomicBool::new(false)));
        let clone = |socket: &UdpSocket| socket.try_clone().expect("a descriptor");
        let (from, to) = (clone(&to_vehicle), clone(&to_ground));
        let down = Forwarder {
            from,
            to,
            up: false,
            state: Arc::clone(&state),
            over: Arc::clone(&over),
            random: Random(1),
        };
        let (from, to) = (clone(&to_ground), clone(&to_vehicle));
        let up = Forwarder {
            from,
            to,
            up: true,
            state: Arc::clone(&state),
            over: Arc::clone(&over),
            random: Random(2),
        };
        let spawn = |name: &str, run: Box<dyn FnOnce() + Send>| {
            std::thread::Builder::new().name(name.to_owned()).spawn(run).expect("a thread")
        };
        let threads = vec![
            spawn("proxy downlink", Box::new(move || down.forward(|state| state.ground, note_vehicle))),
            spawn("proxy uplink", Box::new(move || up.forward(|state| state.vehicle, note_ground))),
        ];
        Self { to_vehicle, to_ground, state, over, threads }
    }

    /// The vehicle's link, for `--mavlink`.
    pub fn vehicle_link(&self) -> String {
        format!("udpout:{}", self.to_vehicle.local_addr().expect("bound"))
    }

    /// The ground station's link, for `--connect`.
    pub fn ground_link(&self) -> String {
        format!("udpout:{}", self.to_ground.local_addr().expect("bound"))
    }

    /// The address to which a ground station made of a socket sends.
    pub fn ground_address(&self) -> SocketAddr {
        self.to_ground.local_addr().expect("bound")
    }

    /// Impairs the datagrams that arrive from now on.
    pub fn impair(&self, impairment: Impairment) {
        lock(&self.state).impairment = impairment;
    }

    /// Sends a datagram to the ground as if it came from the vehicle.
    pub fn send_to_ground(&self, datagram: &[u8]) {
        let ground = lock(&self.state).ground.expect("a received ground");
        self.to_ground.send_to(datagram, ground).expect("sent");
    }

    /// Waits until the ground sends a datagram. It sends at least its heartbeat, from the loop that
    /// does everything.
    pub fn wait_for_ground(&self) {
        let before = lock(&self.state).from_ground;
        let deadline = now() + PATIENCE;
        while lock(&self.state).from_ground == before {
            assert!(!left(deadline).is_zero(), "the ground has fallen silent");
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Every command that the ground has sent, forwarded or not.
    pub fn commands(&self) -> Vec<CommandRequest> {
        lock(&self.state).commands.clone()
    }
}

impl Drop for UdpProxy {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // If the thread panicked, the test has failed by missing its datagrams.
            let _ = thread.join();
        }
    }
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

fn note_vehicle(state: &mut State, from: SocketAddr, _datagram: &[u8]) {
    state.vehicle = Some(from);
}

fn note_ground(state: &mut State, from: SocketAddr, datagram: &[u8]) {
    state.ground = Some(from);
    state.from_ground += 1;
    let mut framer = Framer::new();
    framer.push_datagram(datagram);
    while let Some(frame) = framer.next_frame() {
        state.commands.extend(CommandRequest::from_frame(&frame));
    }
}

fn holds_answer(datagram: &[u8]) -> bool {
    let mut framer = Framer::new();
    framer.push_datagram(datagram);
    std::iter::from_fn(|| framer.next_frame()).any(|frame| frame.message_id() == COMMAND_ACK_ID)
}

/// Forwards the datagrams of one direction.
struct Forwarder {
    from: UdpSocket,
    to: UdpSocket,
    /// Whether this direction leads from the ground to the vehicle.
    up: bool,
    state: Arc<Mutex<State>>,
    over: Arc<AtomicBool>,
    random: Random,
}

impl Forwarder {
    /// Forwards datagrams until the test is over.
    fn forward(
        mut self,
        address: impl Fn(&State) -> Option<SocketAddr>,
        note: impl Fn(&mut State, SocketAddr, &[u8]),
    ) {
        let mut in_transit: Vec<(Instant, Vec<u8>)> = Vec::new();
        let mut datagram = [0; 2048];
        while !self.over.load(Ordering::Relaxed) {
            let next = in_transit.iter().map(|(due, _)| due.saturating_duration_since(now())).min();
            // A time limit of zero would mean no limit.
            let wait = next.unwrap_or(POLL_INTERVAL).clamp(Duration::from_millis(1), POLL_INTERVAL);
            self.from.set_read_timeout(Some(wait)).expect("a time limit");
            if let Ok((count, from)) = self.from.recv_from(&mut datagram) {
                let impairment = {
                    let mut state = lock(&self.state);
                    note(&mut state, from, &datagram[..count]);
                    state.impairment
                };
                self.accept(&datagram[..count], impairment, &mut in_transit);
            }
            let Some(to) = address(&lock(&self.state)) else {
                // The receiver has not sent anything yet, so its address is unknown.
                in_transit.clear();
                continue;
            };
            for (_, arrived) in in_transit.extract_if(.., |(due, _)| *due <= now()) {
                // A program that does not listen yet receives the next datagram.
                let _ = self.to.send_to(&arrived, to);
            }
        }
    }

    fn accept(&mut self, datagram: &[u8], impairment: Impairment, in_transit: &mut Vec<(Instant, Vec<u8>)>) {
        let dropped = impairment.drops_all || (impairment.drops_uplink && self.up);
        let mut is_drawn = |per_1000| self.random.next() % 1_000 < per_1000;
        if is_drawn(impairment.lost_per_1000)
            || dropped
            || (impairment.drops_answers && holds_answer(datagram))
        {
            return;
        }
        let copies = if is_drawn(impairment.duplicated_per_1000) { 2 } else { 1 };
        for _ in 0..copies {
            let delay = impairment.delay_max * (self.random.next() % 1_000) as u32 / 1_000;
            in_transit.push((now() + delay, datagram.to_vec()));
        }
    }
}
