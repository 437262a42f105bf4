//! Logs that lack something, or seem to: every command gives the same answer about them.

use std::path::{Path, PathBuf};

use mcap::records::{Record, op};
use protocol::log::reader::records_of_chunk;
use replay::info::{Info, info};
use replay::recover::recover;
use replay::verify::{Verification, verify};

use crate::command_line::{refusal, replay, run};
use crate::flown::only;
use crate::from_apogee::LANDED;
use crate::simulated::{MK2, WITH_FRAMES};
use crate::station::{station_log, station_log_with};
use crate::tampered::{Held, LogMessage};

/// Answers of `info`, `verify --strict`, `compare` with itself and `recover`: whether each takes
/// the log for complete.
fn complete(log: &Path) -> [bool; 4] {
    let answers = |command: &str, other: &[&str]| run(replay(command, log).args(other)).0 == 0;
    let recovered = recover(log, &log.with_file_name("recovered.mcap")).unwrap();
    [
        info(log).unwrap().completeness.complete,
        answers("verify", &["--strict"]),
        answers("compare", &[log.to_str().unwrap()]),
        recovered.fault().is_none(),
    ]
}

/// Every third chunk's messages stand beside the chunks, which MCAP allows.
fn beside_chunks(bytes: &[u8]) -> Vec<u8> {
    let mut out = bytes[..8].to_vec();
    let (mut at, mut chunks) = (8, 0);
    let put = |out: &mut Vec<u8>, opcode: u8, body: &[u8]| {
        out.push(opcode);
        out.extend((body.len() as u64).to_le_bytes());
        out.extend(body);
    };
    loop {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        let (opcode, body) = (bytes[at], &bytes[at + 9..at + 9 + length]);
        at += 9 + length;
        chunks += usize::from(opcode == op::CHUNK);
        match opcode {
            op::DATA_END => break,
            op::MESSAGE_INDEX => {}
            op::CHUNK if chunks % 3 == 0 => {
                let (mut beside, mut only_messages) = (Vec::new(), true);
                records_of_chunk(body, |record| {
                    let Record::Message { header, data } = record else {
                        only_messages = false;
                        return Ok(());
                    };
                    let mut message = header.channel_id.to_le_bytes().to_vec();
                    message.extend(header.sequence.to_le_bytes());
                    message.extend(header.log_time.to_le_bytes());
                    message.extend(header.publish_time.to_le_bytes());
                    message.extend(data.as_ref());
                    put(&mut beside, op::MESSAGE, &message);
                    Ok(())
                })
                .unwrap();
                if only_messages {
                    out.extend(beside);
                } else {
                    put(&mut out, opcode, body);
                }
            }
            _ => put(&mut out, opcode, body),
        }
    }
    put(&mut out, op::DATA_END, &[0; 4]);
    put(&mut out, op::FOOTER, &[0; 20]);
    out.extend(mcap::MAGIC);
    out
}

#[test]
fn every_command_agrees_about_messages_beside_the_chunks_and_recover_mends_them() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("beside.mcap");
    std::fs::write(&log, beside_chunks(&std::fs::read(&LANDED.log).unwrap())).unwrap();
    assert_eq!(complete(&log), [false; 4]);
    let output = folder.path().join("mended.mcap");
    let recovery = recover(&log, &output).unwrap();
    assert!(recovery.fault().unwrap().contains("messages stood beside the chunks"), "{recovery:?}");
    assert_eq!(Held::read(&LANDED.log).facts(), Held::read(&output).facts());
}

#[test]
fn every_command_agrees_about_one_counter_for_all_channels() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("shared.mcap");
    let mut held = Held::read(&LANDED.log);
    held.messages.iter_mut().zip(0..).for_each(|(message, number)| message.sequence = number);
    held.write(&log);
    assert_eq!(complete(&log), [true; 4]);
    // A frame is missing.
    let lost = held.messages.iter().rposition(LogMessage::is_frame).unwrap() - 200;
    let lost = lost + held.messages[lost..].iter().position(LogMessage::is_frame).unwrap();
    held.messages.remove(lost);
    held.write(&log);
    let found = info(&log).unwrap();
    assert_eq!((found.completeness.messages_lost, found.completeness.complete), (1, false));
    let outcome = only(verify(&log).unwrap()).outcome;
    assert_eq!(outcome, Verification::NotReplayable);
    assert_eq!(complete(&log), [false; 4]);
}

/// No frame is missing, and no chunk is damaged: the numbers of the records alone show it.
#[test]
fn every_command_agrees_about_records_that_were_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("left-out.mcap");
    let mut held = Held::read(&LANDED.log);
    let left_out = held.messages.iter().position(|message| message.topic == "/vehicle/truth3d").unwrap();
    held.messages.remove(left_out + 2_000);
    held.write(&log);
    assert_eq!(complete(&log), [false; 4]);
    let recovery = recover(&log, &folder.path().join("again.mcap")).unwrap();
    assert_eq!(recovery.fault().unwrap(), "1 message lost");
}

#[test]
fn a_log_without_checksums_does_not_claim_any() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("unchecked.mcap");
    let held = Held::read(&LANDED.log);
    let without = mcap::WriteOptions::new().calculate_chunk_crcs(false).calculate_data_section_crc(false);
    for (options, words) in [
        (mcap::WriteOptions::new(), "every checksum holds"),
        (without, "but NO CHECKSUM protects all of its messages"),
    ] {
        held.write_with(&log, options);
        let (_, stdout, _) = run(&mut replay("info", &log));
        assert!(stdout.contains(&format!("complete    yes: ended properly, {words}\n")), "{stdout}");
    }
}

fn phases(info: &Info) -> Vec<(String, f64)> {
    info.phases[0].spans.iter().map(|span| (span.phase.clone(), span.from_s)).collect()
}

/// The clock of a station is put forward by an hour between two phases.
#[test]
fn a_jump_of_a_stations_clock_is_reported_and_moves_no_phase() {
    const HOUR_NS: u64 = 3_600_000_000_000;
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("own.mcap");
    std::fs::copy(&WITH_FRAMES.log, &own).unwrap();
    let steady = info(&station_log(&own, "steady.mcap")).unwrap();
    let landed_s = phases(&steady).iter().find(|(phase, _)| phase == "POWERED").unwrap().1;
    let jumps_ns = ((landed_s + 1.0) * 1e9) as u64;
    let clock = |at_ns| if at_ns > jumps_ns { at_ns + HOUR_NS } else { at_ns };
    let log = station_log_with(&own, "jumps.mcap", clock);
    let jumped = info(&log).unwrap();
    let by_s = jumped.clocks.station_jump.unwrap().by_s;
    assert!(steady.clocks.station_jump.is_none() && (by_s - 3600.0).abs() < 1.0, "{by_s}");
    for ((phase, steady_s), (same, jumped_s)) in phases(&steady).iter().zip(phases(&jumped)) {
        assert!(*phase == same && (steady_s - jumped_s).abs() < 0.5, "{phase} {steady_s}, {same} {jumped_s}");
    }
    let (_, stdout, _) = run(&mut replay("info", &log));
    assert!(stdout.contains("clock       the station's clock jumps by +3600."), "{stdout}");
}

/// A log whose front is cut away up to the last frame before the release, and one up to the release
/// itself.
#[test]
fn frames_of_the_pad_before_a_release_are_of_the_same_flight() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("cut.mcap");
    let recording = MK2.recording();
    let whole = info(&MK2.log).unwrap();
    let held = Held::read(&MK2.log);
    let is_start = |message: &LogMessage| message.topic == "/computer/start";
    let release = held.messages.iter().rposition(is_start).unwrap();
    assert!(recording.release_frame > 10);
    for before in [1, 3] {
        let mut cut = held.clone();
        let frames = cut.messages[..release].iter().enumerate().filter(|(_, message)| message.is_frame());
        let first = frames.map(|(place, _)| place).rev().nth(before - 1).unwrap();
        cut.messages.drain(..first);
        cut.write(&log);
        let found = info(&log).unwrap();
        assert_eq!(found.completeness.flights, 1, "{before}");
        let [whole, found] = [&whole, &found].map(|info| {
            let contact = info.verdict.as_ref().unwrap().contact();
            info.clocks.convert(contact, replay::log::Clock::Boot).unwrap().time_s
        });
        assert!((whole - found).abs() < 0.02, "{before}: boot {found}, not {whole}");
    }
}

/// Phases and verdict are of one flight.
#[test]
fn of_two_flights_the_last_is_described() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("two.mcap");
    let mut held = Held::read(&LANDED.log);
    held.append(&Held::read(&LANDED.log), 60_000_000_000);
    held.write(&log);
    let (one, two) = (info(&LANDED.log).unwrap(), info(&log).unwrap());
    assert_eq!((two.completeness.flights, phases(&two)), (2, phases(&one)));
    let (_, stdout, _) = run(&mut replay("info", &log));
    assert!(stdout.contains("flights     2; phases and verdict are of the last; "), "{stdout}");
}

#[test]
fn other_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (start, words) in [
        (&b"PK\x03\x04\0\0\0\0\0"[..], "it is a ZIP archive; unpack it first"),
        (b"\x1f\x8b\x08\0\0\0\0\0\0", "it is compressed by gzip; unpack it first"),
        (b"ULog\x01\x12\x35\x01\0", "it is a log of PX4 (.ulg)"),
        (b"\xa3\x95\x80\x80\x59\x46\x4d\x54", "it is a log of ArduPilot (.bin)"),
        (b"#ROSBAG V2.0\n", "it is a bag of ROS 1"),
        (b"random, no log", "it begins with 72 61 6e 64"),
    ] {
        let file: PathBuf = folder.path().join("file");
        std::fs::write(&file, start).unwrap();
        for command in ["info", "verify", "recover"] {
            let mut asked = replay(command, &file);
            let asked = if command == "recover" { asked.arg(folder.path().join("out")) } else { &mut asked };
            let refused = refusal(asked);
            assert!(refused.contains(&format!("is not a flight log: {words}")), "{command}: {refused}");
        }
    }
}

/// A pipe of the shell has its writer already.
#[cfg(target_os = "linux")]
#[test]
fn a_pipe_of_the_shell_is_read() {
    let script = format!("{} info <(cat {})", env!("CARGO_BIN_EXE_replay"), LANDED.log.display());
    let output = std::process::Command::new("bash").args(["-c", &script]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        said.contains("verdict     STANDS UNDAMAGED"),
        "{said}{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
