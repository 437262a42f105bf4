//! What is lost in a countdown: the real station and the real vehicle on one simulated clock, and a
//! link that can fail.

use std::sync::LazyLock;
use std::time::Duration;

use flight::computer::LogState;
use flight::rules::arming::all_passed;
use ground::model::{CommandKind, Model, Seat, Settings, why_not_arm};
use ground::update::{Action, Msg, update};
use ground::view::top_lines::readiness;
use protocol::frame::{Encoder, Frame};
use protocol::identity::GROUND;
use sim::wire::endpoint::{VehicleEndpoint, VehicleKind, step};
use sim::wire::fly::load_flight;
use sim::wire::vehicle::Vehicle;

use crate::rig::settings;

/// mk2 on its pad, ready to be armed.
static READY: LazyLock<Vehicle> = LazyLock::new(|| {
    let mut vehicle = load_flight("mk2").expect("built in").vehicle().expect("sound");
    vehicle.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    vehicle.set_pin_out(true);
    while !all_passed(&vehicle.arming_checks()) && vehicle.time_s() < 20.0 {
        vehicle.step(&[]);
    }
    vehicle
});

#[derive(Debug, Clone, Copy, PartialEq)]
enum Loss {
    Station,
    Screen,
    Uplink,
    Downlink,
    Link,
}

/// A station with Anna at its screen, a vehicle, and the way between them.
struct Pad {
    model: Model,
    vehicle: Vehicle,
    endpoint: VehicleEndpoint,
    encoder: Encoder,
    began_s: f64,
    now: Duration,
    delay: Duration,
    lost: Option<Loss>,
    up: Vec<(Duration, Frame)>,
    down: Vec<(Duration, Frame)>,
}

fn anna() -> Seat {
    Seat::new(1, "anna on pts/3")
}

impl Pad {
    fn with_delay(delay_ms: u64) -> Self {
        let vehicle = READY.clone();
        let mut pad = Self {
            model: Model::new(Settings { seat: anna(), ..settings(false, true) }),
            began_s: vehicle.time_s(),
            vehicle,
            endpoint: VehicleEndpoint::new(VehicleKind::Simulated).booted(1),
            encoder: Encoder::new(GROUND),
            now: Duration::ZERO,
            delay: Duration::from_millis(delay_ms),
            lost: None,
            up: Vec::new(),
            down: Vec::new(),
        };
        pad.msg(Msg::Crew { seats: vec![anna()], silent: Vec::new() });
        pad
    }

    fn msg(&mut self, msg: Msg) {
        for action in update(&mut self.model, msg, self.now) {
            let Action::Send(message) = action else { continue };
            let frame = self.encoder.encode(&message);
            if !matches!(self.lost, Some(Loss::Station | Loss::Uplink | Loss::Link)) {
                self.up.push((self.now + self.delay, frame));
            }
        }
    }

    fn request(&mut self, kind: CommandKind) {
        self.msg(Msg::command(kind, anna()));
    }

    fn lose(&mut self, loss: Loss) {
        self.lost = Some(loss);
        if loss == Loss::Screen {
            self.msg(Msg::Crew { seats: Vec::new(), silent: Vec::new() });
        }
    }

    fn run(&mut self, seconds: f64) {
        for _ in 0..(1_000.0 * seconds) as u64 {
            self.pass_a_millisecond();
        }
    }

    fn pass_a_millisecond(&mut self) {
        self.now += Duration::from_millis(1);
        let now = self.now;
        let arrived = |way: &mut Vec<(Duration, Frame)>| -> Vec<Frame> {
            way.extract_if(.., |(at, _)| *at <= now).map(|(_, frame)| frame).collect()
        };
        if self.vehicle.time_s() - self.began_s <= now.as_secs_f64() {
            for frame in arrived(&mut self.up) {
                self.endpoint.on_frame(0, &frame, &self.vehicle.state());
            }
            step(&mut self.endpoint, &mut self.vehicle, &[]);
            for leaving in self.endpoint.poll(&self.vehicle.state()) {
                if !matches!(self.lost, Some(Loss::Station | Loss::Downlink | Loss::Link)) {
                    self.down.push((now + self.delay, leaving.frame));
                }
            }
        }
        for frame in arrived(&mut self.down) {
            self.msg(Msg::Frame(frame));
        }
        if now.subsec_millis().is_multiple_of(100) && self.lost != Some(Loss::Station) {
            self.msg(Msg::Tick);
        }
    }

    fn left_s(&self) -> Option<f64> {
        self.vehicle.mode().countdown_remaining_s(self.vehicle.time_s())
    }

    /// Armed and started from the station, until so long before the release.
    fn counting_until(delay_ms: u64, left_s: f64) -> Self {
        let mut pad = Self::with_delay(delay_ms);
        pad.run(2.5);
        pad.request(CommandKind::Arm);
        pad.run(1.5);
        pad.request(CommandKind::Start);
        pad.run(1.1);
        while pad.left_s().expect("it counts down") > left_s {
            pad.pass_a_millisecond();
        }
        pad
    }

    /// Whether it launches.
    fn launches(&mut self) -> bool {
        while self.left_s().is_some() && self.vehicle.phase().on_pad() {
            self.pass_a_millisecond();
        }
        !self.vehicle.phase().on_pad()
    }
}

/// "What is lost before T-3 s holds the countdown; what is lost later may fly." Nothing holds from
/// T-2 s on.
#[test]
fn what_is_lost_before_t_minus_three_seconds_holds_and_what_is_lost_in_the_last_two_flies() {
    let pad = Pad::counting_until(20, 6.0);
    let sentence = "What is lost before T-3 s holds the countdown; what is lost later may fly.";
    assert_eq!(pad.model.loss_in_words().as_deref(), Some(sentence));
    for loss in [Loss::Station, Loss::Screen, Loss::Uplink, Loss::Downlink, Loss::Link] {
        for tenths in (10..=60).rev() {
            let left_s = 0.1 * f64::from(tenths);
            let mut pad = Pad::counting_until(20, left_s);
            pad.lose(loss);
            let launches = pad.launches();
            match tenths {
                31.. => assert!(!launches, "{loss:?} lost at T-{left_s:.1} s flies"),
                ..=20 => assert!(launches, "{loss:?} lost at T-{left_s:.1} s holds"),
                _ => {}
            }
        }
    }
}

#[test]
fn no_arm_or_start_on_telemetry_older_than_three_seconds() {
    let mut pad = Pad::with_delay(3_000);
    pad.run(20.0);
    assert!(pad.model.link.state(pad.now).carries(), "frames arrive all the time");
    let why = why_not_arm(&pad.model, pad.now).expect("refused");
    assert!(why.starts_with("the newest telemetry is 6."), "{why}");
    let (words, _) = readiness(&pad.model, pad.now).expect("checks");
    assert!(words.starts_with("NO-GO: the newest telemetry"), "{words}");
    pad.request(CommandKind::Arm);
    pad.run(7.0);
    assert!(!pad.vehicle.mode().interlocks.armed);
    // Armed before the way became long: nothing is started either.
    let mut pad = Pad::with_delay(20);
    pad.run(2.5);
    pad.request(CommandKind::Arm);
    pad.run(1.5);
    assert!(pad.vehicle.mode().interlocks.armed);
    pad.delay = Duration::from_secs(3);
    pad.run(10.0);
    pad.request(CommandKind::Start);
    pad.run(4.0);
    assert_eq!(pad.left_s(), None);
}

/// Half a second each way: what the screen shows as the last moment is one in which a hold still
/// arrives in time.
#[test]
fn the_last_moment_of_a_hold_counts_the_round_trip() {
    let mut pad = Pad::counting_until(500, 6.0);
    while !pad.model.is_past_hold(pad.now) {
        pad.pass_a_millisecond();
        if pad.model.is_past_hold(pad.now + Duration::from_millis(20)) {
            break;
        }
    }
    let last_s = pad.model.last_hold_s(&pad.model.vehicle).expect("reported");
    assert!((2.9..3.2).contains(&last_s), "{last_s}");
    pad.request(CommandKind::Hold);
    assert!(!pad.launches());
    let mut pad = Pad::counting_until(500, 2.4);
    pad.request(CommandKind::Hold);
    assert!(pad.launches(), "too late, and the screen says so");
    assert!(pad.model.last_hold_s(&pad.model.vehicle).is_some_and(|last_s| last_s > 2.9));
}
