//! An abort over a link that loses half of the frames in both directions: the real station and the
//! real vehicle on one simulated clock.

use std::time::Duration;

use ground::key::Key;
use ground::model::{CommandKind, Model};
use ground::update::{Action, Msg, update};
use protocol::command::CommandRequest;
use protocol::dialect::MavCmd;
use protocol::frame::{Encoder, Frame};
use protocol::identity::GROUND;
use sim::wire::endpoint::{VehicleEndpoint, VehicleKind, step};
use sim::wire::fly::{StartPoint, load_flight};

use crate::rig::settings;

/// Reproducible random numbers (Knuth's MMIX generator).
struct Random(u64);

impl Random {
    fn coin(&mut self) -> bool {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) & 1 == 1
    }
}

/// A link that delivers half of the frames, with a delay.
struct LossyLink {
    random: Random,
    in_transit: Vec<(Duration, Frame)>,
}

impl LossyLink {
    const DELAY: Duration = Duration::from_millis(30);

    fn new(seed: u64) -> Self {
        Self { random: Random(seed), in_transit: Vec::new() }
    }

    fn send(&mut self, frame: Frame, now: Duration) {
        if self.random.coin() {
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
    let (mut up, mut down) = (LossyLink::new(2 * seed + 1), LossyLink::new(2 * seed + 2));
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
    let runs: Vec<Run> = (0..100).map(run).collect();
    let percentile = |of: fn(&Run) -> f64, percent: usize| {
        let mut times: Vec<f64> = runs.iter().map(of).collect();
        times.sort_by(f64::total_cmp);
        times[times.len() * percent / 100 - 1]
    };
    let (latched, acknowledged) = (|run: &Run| run.latched_s, |run: &Run| run.acknowledged_s);
    println!(
        "latched: median {:.2} s, p99 {:.2} s; acknowledged: median {:.2} s, p99 {:.2} s; sent at most {} times",
        percentile(latched, 50),
        percentile(latched, 99),
        percentile(acknowledged, 50),
        percentile(acknowledged, 99),
        runs.iter().map(|run| run.sent).max().unwrap_or(0)
    );
    assert!(percentile(latched, 99) <= 0.5);
    assert!(percentile(acknowledged, 99) <= 1.2);
    assert!(runs.iter().all(|run| run.sent_afterwards == 0), "it ends once it is latched and answered");
}
