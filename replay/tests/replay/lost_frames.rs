//! Tests frames that a damaged log has lost: no command takes them for a restart of the flight
//! computer.

use std::path::PathBuf;
use std::sync::LazyLock;

use replay::controller::AgainError;
use replay::evaluate::evaluate;
use replay::log::Recording;
use replay::recover::recover;
use replay::refly::{ReflyOptions, refly};
use replay::report::report;
use replay::verify::explain::explain;

use crate::command_line::{replay, run};
use crate::from_apogee::LANDED;

/// The landed flight's log, with a bit turned in a chunk in its middle, recovered.
pub(crate) static RECOVERED: LazyLock<PathBuf> = LazyLock::new(|| {
    let (damaged, recovered) = (LANDED.beside("damaged.mcap"), LANDED.beside("recovered.mcap"));
    let mut bytes = std::fs::read(&LANDED.log).unwrap();
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    let chunk = &chunks[chunks.len() / 2];
    let within = usize::try_from(chunk.chunk_start_offset + chunk.chunk_length / 2).unwrap();
    bytes[within] ^= 1;
    std::fs::write(&damaged, bytes).unwrap();
    recover(&damaged, &recovered).unwrap();
    recovered
});

/// The last frame before the loss, and the first after it.
fn around_the_loss(recording: &Recording) -> (u64, u64) {
    let gap = recording.gap().unwrap();
    let last = recording.frames.last().unwrap().input.frame;
    assert!(1 < gap.after && gap.after + 1 < gap.before && gap.before < last, "{gap:?}, {last}");
    (gap.after, gap.before)
}

#[test]
fn an_evaluation_ends_at_the_loss_and_states_it() {
    let recording = Recording::open(&RECOVERED).unwrap();
    let (after, before) = around_the_loss(&recording);
    let evaluated = evaluate(&recording, &[]).unwrap();
    assert_eq!(evaluated.frames.last().unwrap().frame, after);
    assert!(evaluated.frames.iter().all(|frame| frame.recorded == frame.evaluated));
    let (code, _, stderr) = run(&mut replay("evaluate", &RECOVERED));
    let warning = format!("after frame {after} comes frame {before}; nothing after the gap was run again");
    assert!(code == 0 && stderr.contains(&warning), "{stderr}");
}

#[test]
fn a_frame_after_the_loss_is_refused() {
    let recording = Recording::open(&RECOVERED).unwrap();
    let (after, before) = around_the_loss(&recording);
    assert!(explain(&recording, after).unwrap().identical);
    let refusal = explain(&recording, before).unwrap_err();
    assert!(matches!(refusal, AgainError::NoFrame { last, .. } if last == after), "{refusal}");
}

/// The flight is flown again from its draw and compared with the frames on both sides of the loss.
#[test]
fn a_flight_is_flown_again_across_the_loss() {
    let recording = Recording::open(&RECOVERED).unwrap();
    let flown = refly(&recording, &ReflyOptions::default()).unwrap();
    let reached = flown.reached;
    assert_eq!((reached.identical, reached.first_different), (reached.frames, None));
    assert_eq!(reached.frames + flown.commands_identical, recording.frames.len());
}

#[test]
fn the_report_states_up_to_which_frame_the_log_can_be_run_again() {
    let (after, _) = around_the_loss(&Recording::open(&RECOVERED).unwrap());
    let page = report(&RECOVERED).unwrap().html;
    assert!(page.contains(&format!("bit-exact: up to frame {after} of")), "grade");
}
