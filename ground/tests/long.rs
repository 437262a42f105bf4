//! Ten hours on the pad and in flight on a simulated clock: memory does not grow.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::time::Duration;

use ground::model::{Model, Settings};
use ground::update::{Msg, update};
use ground::view::draw;
use ground::view::theme::{Palette, Theme};
use protocol::dialect::{
    ATTITUDE_QUATERNION_DATA, HEARTBEAT_DATA, LOCAL_POSITION_NED_DATA, MavAutopilot, MavMessage, MavSeverity,
    MavType, TD_FLIGHT_STATUS_DATA, TdPhase,
};
use protocol::frame::Encoder;
use protocol::identity::VEHICLE;
use protocol::text::chunks;
use ratatui::Terminal;
use ratatui::backend::TestBackend;

const HOURS: u64 = 10;
/// The allowed growth between the first and the last hour, for variations of the allocator.
const GROWTH_MAX_BYTES: u64 = 1024 * 1024;

/// The resident memory of this process, bytes (Linux: the second number of `statm`, in pages of 4
/// KiB).
fn resident_bytes() -> u64 {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap();
    statm.split(' ').nth(1).unwrap().parse::<u64>().unwrap() * 4096
}

#[test]
fn ten_hours_take_no_more_memory_than_one() {
    let mut model = Model::new(Settings::on_screen("udpin:0.0.0.0:14550"));
    let mut encoder = Encoder::new(VEHICLE);
    let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
    let mut after_one_hour = 0;
    for second in 0..HOURS * 3_600 {
        // Half an hour on the pad and half an hour of flight, in turn.
        let flying = (second / 1_800) % 2 == 1;
        let phase = if flying { TdPhase::TD_PHASE_AERO_DESCENT } else { TdPhase::TD_PHASE_PAD_IDLE };
        for tenth in 0..10 {
            let now = Duration::from_millis(second * 1_000 + tenth * 100);
            let time_boot_ms = u32::try_from(now.as_millis()).unwrap();
            let mut messages = vec![MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
                time_boot_ms,
                phase,
                countdown_ms: i32::MAX,
                ..TD_FLIGHT_STATUS_DATA::default()
            })];
            if tenth == 0 {
                let custom_mode = phase as u32;
                messages.push(MavMessage::HEARTBEAT(HEARTBEAT_DATA {
                    custom_mode,
                    mavtype: MavType::MAV_TYPE_ROCKET,
                    autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
                    ..HEARTBEAT_DATA::default()
                }));
            }
            if tenth % 2 == 0 {
                let q1 = 1.0;
                messages.push(MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
                    time_boot_ms,
                    q1,
                    ..ATTITUDE_QUATERNION_DATA::default()
                }));
                let (x, z) = ((second % 977) as f32, -((second % 1_009) as f32));
                messages.push(MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA {
                    time_boot_ms,
                    x,
                    z,
                    ..LOCAL_POSITION_NED_DATA::default()
                }));
            }
            if tenth == 5 && second % 7 == 0 {
                let text = format!("second {second}: all is well");
                messages.extend(
                    chunks(MavSeverity::MAV_SEVERITY_INFO, &text, 0).into_iter().map(MavMessage::STATUSTEXT),
                );
            }
            for message in messages {
                drop(update(&mut model, Msg::Frame(encoder.encode(&message)), now));
            }
            drop(update(&mut model, Msg::Tick, now));
        }
        if second % 60 == 0 {
            let now = Duration::from_secs(second);
            terminal
                .draw(|frame| {
                    draw(&model, Theme { palette: Palette::Dark, ascii: false }, now, frame);
                })
                .unwrap();
        }
        if second == 3_600 {
            after_one_hour = resident_bytes();
        }
    }
    let ended = resident_bytes();
    println!("after one hour {after_one_hour} bytes, after {HOURS} hours {ended}");
    let grown = ended.saturating_sub(after_one_hour);
    assert!(grown < GROWTH_MAX_BYTES, "{grown} bytes more after {HOURS} hours than after one");
    assert!(model.events.total() > 5_000, "much was said meanwhile");
}
