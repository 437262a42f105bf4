//! An abort, a hold and a disarm over a link that loses half of the frames or more in both
//! directions: the real station and the real vehicle on one simulated clock.

use std::time::Duration;

use flight::computer::LogState;
use ground::key::Key;
use ground::model::{CommandKind, Model, Seat, Settings};
use ground::update::{Action, Msg, update};
use protocol::command::CommandRequest;
use protocol::dialect::MavCmd;
use protocol::frame::{Encoder, Frame};
use protocol::identity::GROUND;
use sim::wire::endpoint::{VehicleEndpoint, VehicleKind, step};
use sim::wire::fly::{StartPoint, load_flight};
use sim::wire::vehicle::Vehicle;

use crate::rig::settings;

/// Reproducible random numbers (Knuth's MMIX generator).
struct Random(u64);

impl Random {
    /// Below 1,000.
    fn per_mille(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) % 1_000
    }
}

/// A link that loses frames, and delivers the others with a delay.
struct LossyLink {
    lost_per_mille: u64,
    random: Random,
    in_transit: Vec<(Duration, Frame)>,
}

impl LossyLink {
    const DELAY: Duration = Duration::from_millis(30);

    fn new(seed: u64, lost_per_mille: u64) -> Self {
        Self { lost_per_mille, random: Random(seed), in_transit: Vec::new() }
    }

    fn send(&mut self, frame: Frame, now: Duration) {
        if self.random.per_mille() >= self.lost_per_mille {
            self.in_transit.push((now + Self::DELAY, frame));
        }
    }

    fn arrived(&mut self, now: Duration) -> Vec<Frame> {
        self.in_transit.extract_if(.., |(at, _)| *at <= now).map(|(_, frame)| frame).collect()
    }
}

fn is_abort(frame: &Frame) -> bool {
    let abort = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION as u16;
    CommandRequest::from_frame(frame).is_some_and(|request| request.command == abort)
}

/// The result of one abort: when it was latched and acknowledged, s after the key; how often it was
/// sent, in all and after both were known.
struct Run {
    latched_s: f64,
    acknowledged_s: f64,
    sent: usize,
    sent_afterwards: usize,
}

fn run(seed: u64) -> Run {
    let mut flight =
        load_flight("mk2").and_then(|flight| flight.starting_at(Some(StartPoint::Drone))).expect("built in");
    flight.recipe.seed = seed;
    let mut vehicle = flight.vehicle().expect("sound");
    let mut endpoint = VehicleEndpoint::new(VehicleKind::Simulated).booted(1);
    let (mut up, mut down) = (LossyLink::new(2 * seed + 1, 500), LossyLink::new(2 * seed + 2, 500));
    let mut model = Model::new(settings(false, true));
    let mut encoder = Encoder::new(GROUND);
    // The key is pressed at a varying time between the vehicle's frames and the ticks.
    let pressed_at = Duration::from_millis(1_500 + seed * 37 % 100);
    let (mut latched_at, mut done_at) = (None, None);
    let (mut sent, mut sent_afterwards) = (0, 0);
    for milliseconds in 0..8_000 {
        let now = Duration::from_millis(milliseconds);
        let mut msgs = Vec::new();
        if vehicle.time_s() <= now.as_secs_f64() {
            for frame in up.arrived(now) {
                endpoint.on_frame(0, &frame, &vehicle.state());
            }
            step(&mut endpoint, &mut vehicle, &[]);
            for leaving in endpoint.poll(&vehicle.state()) {
                down.send(leaving.frame, now);
            }
            if vehicle.aborted() {
                latched_at.get_or_insert(now);
            }
        }
        msgs.extend(down.arrived(now).into_iter().map(Msg::Frame));
        if now == pressed_at {
            msgs.extend([Key::CtrlX, Key::Enter].map(|key| Msg::Keys(vec![key])));
        }
        if milliseconds % 100 == 0 || model.wakes_at().is_some_and(|at| now >= at) {
            msgs.push(Msg::Tick);
        }
        for msg in msgs {
            for action in update(&mut model, msg, now) {
                let Action::Send(message) = action else { continue };
                let frame = encoder.encode(&message);
                sent += usize::from(is_abort(&frame));
                sent_afterwards += usize::from(is_abort(&frame) && done_at.is_some());
                up.send(frame, now);
            }
        }
        let track = model.commands.of(CommandKind::Abort);
        if track.is_some_and(|track| track.accepted() && track.observed_at.is_some()) {
            done_at.get_or_insert(now);
        }
    }
    let since =
        |at: Option<Duration>| at.map_or(f64::INFINITY, |at| at.saturating_sub(pressed_at).as_secs_f64());
    let track = model.commands.of(CommandKind::Abort);
    let acknowledged_at = track.and_then(|track| track.acknowledged_at);
    Run { latched_s: since(latched_at), acknowledged_s: since(acknowledged_at), sent, sent_afterwards }
}

#[test]
fn an_abort_through_fifty_per_cent_loss_latches_and_is_acknowledged_in_time() {
    let runs: Vec<Run> = (0..200).map(run).collect();
    assert!(runs.iter().all(|run| run.latched_s.is_finite() && run.acknowledged_s.is_finite()));
    let percentile = |of: fn(&Run) -> f64, percent: usize| {
        let mut times: Vec<f64> = runs.iter().map(of).collect();
        times.sort_by(f64::total_cmp);
        times[times.len() * percent / 100 - 1]
    };
    let (latched, acknowledged) = (|run: &Run| run.latched_s, |run: &Run| run.acknowledged_s);
    println!(
        "latched: median {:.2} s, p99 {:.2} s, max {:.2} s; acknowledged: median {:.2} s, p99 {:.2} s; sent at most {} times",
        percentile(latched, 50),
        percentile(latched, 99),
        percentile(latched, 100),
        percentile(acknowledged, 50),
        percentile(acknowledged, 99),
        runs.iter().map(|run| run.sent).max().unwrap_or(0)
    );
    assert!(percentile(latched, 99) <= 0.5);
    assert!(percentile(acknowledged, 99) <= 1.2);
    assert!(runs.iter().all(|run| run.sent_afterwards == 0), "it ends once it is latched and answered");
}

/// Time from the keys to the effect of a hold or a disarm 7 s before the release, s; infinite if it
/// came too late.
fn held_after_s(seed: u64, keys: [Key; 2]) -> f64 {
    let mut flight = load_flight("mk2").expect("built in");
    flight.recipe.seed = seed;
    let mut vehicle = Vehicle::on_the_pad(&flight).expect("sound");
    vehicle.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    vehicle.set_pin_out(true);
    let mut endpoint = VehicleEndpoint::new(VehicleKind::Simulated).booted(1);
    let (mut up, mut down) = (LossyLink::new(2 * seed + 1, 0), LossyLink::new(2 * seed + 2, 0));
    let mut model = Model::new(Settings { log_path: None, ..settings(false, true) });
    let mut encoder = Encoder::new(GROUND);
    let mut pressed_at: Option<Duration> = None;
    for milliseconds in 0..60_000 {
        let now = Duration::from_millis(milliseconds);
        let mut msgs = Vec::new();
        if vehicle.time_s() <= now.as_secs_f64() {
            for frame in up.arrived(now) {
                endpoint.on_frame(0, &frame, &vehicle.state());
            }
            step(&mut endpoint, &mut vehicle, &[]);
            for leaving in endpoint.poll(&vehicle.state()) {
                down.send(leaving.frame, now);
            }
        }
        msgs.extend(down.arrived(now).into_iter().map(Msg::Frame));
        let command = |kind| Msg::command(kind, Seat::default());
        // Armed and started over a good link.
        if milliseconds == 20_000 {
            msgs.push(command(CommandKind::Arm));
        }
        if milliseconds == 22_000 {
            msgs.push(command(CommandKind::Start));
        }
        let left_s = vehicle.mode().countdown_end_s.map(|end_s| end_s - vehicle.time_s());
        match (pressed_at, left_s) {
            (None, Some(left_s)) if left_s <= 7.0 - 0.001 * (seed * 37 % 100) as f64 => {
                (up.lost_per_mille, down.lost_per_mille) = (600, 600);
                pressed_at = Some(now);
                msgs.extend(keys.map(|key| Msg::Keys(vec![key])));
            }
            (Some(at), None) if vehicle.phase().on_pad() => return now.saturating_sub(at).as_secs_f64(),
            (Some(_), None) => return f64::INFINITY,
            _ => {}
        }
        if milliseconds % 100 == 0 || model.wakes_at().is_some_and(|at| now >= at) {
            msgs.push(Msg::Tick);
        }
        for msg in msgs {
            for action in update(&mut model, msg, now) {
                let Action::Send(message) = action else { continue };
                up.send(encoder.encode(&message), now);
            }
        }
    }
    panic!("seed {seed}: no countdown")
}

/// Also a silence of the uplink holds: the time of the command counts.
#[test]
fn a_hold_and_a_disarm_through_sixty_per_cent_loss_arrive_in_time() {
    for (name, keys) in [("hold", ['H', '\r']), ("disarm", ['D', '\r'])] {
        let keys = keys.map(|key| if key == '\r' { Key::Enter } else { Key::Char(key) });
        let mut times_s: Vec<f64> = (0..20).map(|seed| held_after_s(seed, keys)).collect();
        times_s.sort_by(f64::total_cmp);
        println!(
            "{name}: {} of 20, median {:.2} s, max {:.2} s",
            times_s.iter().filter(|s| s.is_finite()).count(),
            times_s[9],
            times_s[19]
        );
        assert!(times_s.iter().all(|time_s| time_s.is_finite()), "{name}: {times_s:?}");
    }
}
