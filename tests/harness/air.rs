//! The air between a vehicle and a ground station that speak over UDP: it loses, repeats, delays and forges as told.

use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use protocol::command::CommandRequest;
use protocol::frame::Framer;

use crate::PATIENCE;
use crate::process::{left, now};

/// The number of COMMAND_ACK.
const COMMAND_ACK_ID: u32 = 77;
/// Looks up this often, to notice that the test is over.
const LOOKS_UP_EVERY: Duration = Duration::from_millis(20);

/// What becomes of a datagram, either way.
#[derive(Debug, Clone, Copy, Default)]
pub struct Weather {
    /// Of a thousand, so many are lost.
    pub lost: u64,
    /// Of a thousand, so many arrive twice.
    pub doubled: u64,
    /// Each is up to this late, one more than another: they overtake each other.
    pub late: Duration,
    /// No answer to a command arrives.
    pub eats_answers: bool,
    /// Nothing arrives.
    pub silent: bool,
    /// Nothing that the ground says arrives.
    pub uplink_silent: bool,
}

/// A proxy between one vehicle and one ground station, which both speak to it first. One that starts again takes the
/// place of the one before it.
pub struct Air {
    to_vehicle: UdpSocket,
    to_ground: UdpSocket,
    state: Arc<Mutex<State>>,
    over: Arc<AtomicBool>,
    ways: Vec<JoinHandle<()>>,
}

struct State {
    weather: Weather,
    vehicle: Option<SocketAddr>,
    ground: Option<SocketAddr>,
    commands: Vec<CommandRequest>,
    /// Datagrams.
    from_ground: u64,
}

impl Default for Air {
    fn default() -> Self {
        Self::new()
    }
}

impl Air {
    /// Clear air.
    ///
    /// # Panics
    /// There is no free port.
    pub fn new() -> Self {
        let bind = || UdpSocket::bind("127.0.0.1:0").expect("a free port");
        let (to_vehicle, to_ground) = (bind(), bind());
        let weather = Weather::default();
        let state = State { weather, vehicle: None, ground: None, commands: Vec::new(), from_ground: 0 };
        let (state, over) = (Arc::new(Mutex::new(state)), Arc::new(AtomicBool::new(false)));
        let clone = |socket: &UdpSocket| socket.try_clone().expect("a descriptor");
        let (from, to) = (clone(&to_vehicle), clone(&to_ground));
        let down =
            Way { from, to, up: false, state: Arc::clone(&state), over: Arc::clone(&over), dice: Dice(1) };
        let (from, to) = (clone(&to_ground), clone(&to_vehicle));
        let up =
            Way { from, to, up: true, state: Arc::clone(&state), over: Arc::clone(&over), dice: Dice(2) };
        let spawn = |name: &str, run: Box<dyn FnOnce() + Send>| {
            std::thread::Builder::new().name(name.to_owned()).spawn(run).expect("a thread")
        };
        let ways = vec![
            spawn("air down", Box::new(move || down.carry(|state| state.ground, note_vehicle))),
            spawn("air up", Box::new(move || up.carry(|state| state.vehicle, note_ground))),
        ];
        Self { to_vehicle, to_ground, state, over, ways }
    }

    /// What the vehicle is to be given for `--mavlink`.
    ///
    /// # Panics
    /// The socket has no address.
    pub fn vehicle_link(&self) -> String {
        format!("udpout:{}", self.to_vehicle.local_addr().expect("bound"))
    }

    /// What the ground station is to be given for `--connect`.
    ///
    /// # Panics
    /// The socket has no address.
    pub fn ground_link(&self) -> String {
        format!("udpout:{}", self.to_ground.local_addr().expect("bound"))
    }

    /// Where a ground station of the test's own speaks to.
    ///
    /// # Panics
    /// The socket has no address.
    pub fn ground_address(&self) -> SocketAddr {
        self.to_ground.local_addr().expect("bound")
    }

    /// From now on.
    pub fn set(&self, weather: Weather) {
        look(&self.state).weather = weather;
    }

    /// Says something to the ground in the vehicle's place.
    ///
    /// # Panics
    /// The ground has not been heard yet, or the system refuses.
    pub fn forge(&self, datagram: &[u8]) {
        let ground = look(&self.state).ground.expect("a ground that has been heard");
        self.to_ground.send_to(datagram, ground).expect("sent");
    }

    /// Waits until the ground says something more: at least its heartbeat, from the loop that does everything.
    ///
    /// # Panics
    /// It does not.
    pub fn wait_for_ground(&self) {
        let before = look(&self.state).from_ground;
        let deadline = now() + PATIENCE;
        while look(&self.state).from_ground == before {
            assert!(!left(deadline).is_zero(), "the ground has fallen silent");
            std::thread::sleep(LOOKS_UP_EVERY);
        }
    }

    /// Every command that the ground has sent, whatever became of it.
    pub fn commands(&self) -> Vec<CommandRequest> {
        look(&self.state).commands.clone()
    }
}

impl Drop for Air {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        for way in self.ways.drain(..) {
            // One that panicked has failed its test by carrying nothing.
            let _ = way.join();
        }
    }
}

fn look(state: &Mutex<State>) -> MutexGuard<'_, State> {
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

/// One direction.
struct Way {
    from: UdpSocket,
    to: UdpSocket,
    /// From the ground to the vehicle.
    up: bool,
    state: Arc<Mutex<State>>,
    over: Arc<AtomicBool>,
    dice: Dice,
}

impl Way {
    /// Carries until the test is over.
    fn carry(
        mut self,
        address: impl Fn(&State) -> Option<SocketAddr>,
        note: impl Fn(&mut State, SocketAddr, &[u8]),
    ) {
        let mut flying: Vec<(Instant, Vec<u8>)> = Vec::new();
        let mut datagram = [0; 2048];
        while !self.over.load(Ordering::Relaxed) {
            let next = flying.iter().map(|(due, _)| due.saturating_duration_since(now())).min();
            // A time limit of nought would be none.
            let wait = next.unwrap_or(LOOKS_UP_EVERY).clamp(Duration::from_millis(1), LOOKS_UP_EVERY);
            self.from.set_read_timeout(Some(wait)).expect("a time limit");
            if let Ok((count, from)) = self.from.recv_from(&mut datagram) {
                let weather = {
                    let mut state = look(&self.state);
                    note(&mut state, from, &datagram[..count]);
                    state.weather
                };
                self.launch(&datagram[..count], weather, &mut flying);
            }
            let Some(to) = address(&look(&self.state)) else {
                // Nobody has spoken there yet: nobody hears it.
                flying.clear();
                continue;
            };
            for (_, arrived) in flying.extract_if(.., |(due, _)| *due <= now()) {
                // A program that does not listen yet hears the next one.
                let _ = self.to.send_to(&arrived, to);
            }
        }
    }

    fn launch(&mut self, datagram: &[u8], weather: Weather, flying: &mut Vec<(Instant, Vec<u8>)>) {
        let silent = weather.silent || (weather.uplink_silent && self.up);
        let mut happens = |of_thousand| self.dice.next() % 1_000 < of_thousand;
        if happens(weather.lost) || silent || (weather.eats_answers && holds_answer(datagram)) {
            return;
        }
        let copies = if happens(weather.doubled) { 2 } else { 1 };
        for _ in 0..copies {
            let late = weather.late * (self.dice.next() % 1_000) as u32 / 1_000;
            flying.push((now() + late, datagram.to_vec()));
        }
    }
}

/// Numbers that are the same in every run (Knuth's MMIX generator).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }
}
