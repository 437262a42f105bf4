//! Tests logs that are too long, sparse, or full of impossible numbers: an answer or a reason, in
//! bounded memory.

use std::path::Path;
use std::process::Command;

use proptest::prelude::*;
use protocol::log::computer_v1::{ComputerFrame, Request};
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::writer::{LogHeader, LogWriter};
use replay::compare::{Flown, compare};
use replay::evaluate::evaluate;
use replay::log::{Moment, Recording};
use replay::refly::{ReflyOptions, refly};
use replay::report::report;
use replay::verify::explain::explain;

use crate::flown::{COMPLETE, FLIGHT, FRAME_NS, Recipe, write_log};

/// Runs the command with limited memory; returns the result and the output.
fn within(megabytes: u32, arguments: &[&str], file: &Path) -> (i32, String) {
    let kilobytes = 1024 * megabytes;
    let command = format!("ulimit -v {kilobytes}; exec \"$@\"");
    let output = Command::new("sh")
        .args(["-c", &command, "sh", env!("CARGO_BIN_EXE_replay")])
        .args(arguments)
        .arg(file)
        .output()
        .unwrap();
    let said = [output.stdout, output.stderr].concat();
    (output.status.code().unwrap(), String::from_utf8(said).unwrap())
}

/// Ten gigabytes, nearly all of them a hole: everything before the hole is used.
#[test]
fn a_hollow_log_is_used_up_to_its_hole() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("hollow.mcap");
    let (at, frames) = COMPLETE.synced[4];
    std::fs::write(&path, &COMPLETE.bytes[..usize::try_from(at).unwrap()]).unwrap();
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    file.set_len(10 << 30).unwrap();
    for (arguments, expected) in [
        (&["info"][..], "type 0, which does not exist".to_owned()),
        (&["verify"], format!("{frames} of {frames} frames identical of the readable part")),
        (&["evaluate"], "open loop".to_owned()),
        (&["refly", "--at", "frame:12"], "closed loop".to_owned()),
        (&["report", "--out", "-"], "type 0, which does not exist".to_owned()),
    ] {
        let (code, said) = within(200, arguments, &path);
        assert_eq!(code, 0, "{said}");
        assert!(said.contains(&expected), "{arguments:?}: {said}");
    }
    let recovered = directory.path().join("recovered.mcap");
    let recovery = replay::recover::recover(&path, &recovered).unwrap();
    assert_eq!(recovery.lost[0].bytes, (10 << 30) - at);
    assert_eq!(Recording::open(&recovered).unwrap().frames.len(), frames);

    file.set_len(0).unwrap();
    file.set_len(10 << 30).unwrap();
    let (code, said) = within(200, &["info"], &path);
    assert_eq!(code, 1, "{said}");
}

/// A hundred kilobytes that say that they unpack to four gigabytes, of records of no type.
#[test]
fn a_chunk_that_unpacks_to_gigabytes_does_not_fill_the_memory() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("bomb.mcap");
    let (at, _) = COMPLETE.synced[4];
    for unpacked in [48_u64 << 20, 4 << 30] {
        // Zeros, packed by lz4 into sequences of 255 bytes each.
        let file = std::io::Cursor::new(Vec::new());
        let mut writer =
            mcap::WriteOptions::new().compression(Some(mcap::Compression::Lz4)).create(file).unwrap();
        let schema = writer.add_schema("zeros", "", b"").unwrap();
        let channel = writer.add_channel(schema, "/zeros", "", &std::collections::BTreeMap::new()).unwrap();
        let header =
            mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, &vec![0; 48 << 20]).unwrap();
        writer.finish().unwrap();
        let bomb = writer.into_inner().into_inner();
        let chunk = &mcap::Summary::read(&bomb).unwrap().unwrap().chunk_indexes[0];
        let begins = usize::try_from(chunk.chunk_start_offset).unwrap();
        let mut chunk = bomb[begins..begins + usize::try_from(chunk.chunk_length).unwrap()].to_vec();
        chunk[9 + 16..][..8].copy_from_slice(&unpacked.to_le_bytes());
        std::fs::write(&path, [&COMPLETE.bytes[..usize::try_from(at).unwrap()], &chunk].concat()).unwrap();
        for arguments in [&["info"][..], &["verify"], &["evaluate"]] {
            let (code, said) = within(260, arguments, &path);
            assert!(code <= 2, "{arguments:?}: {said}");
        }
        let output = directory.path().join(format!("{unpacked}.mcap"));
        let command = [&["recover"][..], &[path.to_str().unwrap()]].concat();
        let (code, said) = within(400, &command, &output);
        assert_eq!(code, 0, "{said}");
    }
}

/// A record of MCAP.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

fn text(text: &str) -> Vec<u8> {
    [&u32::try_from(text.len()).unwrap().to_le_bytes()[..], text.as_bytes()].concat()
}

/// The whole log up to its end mark, and an end without a checksum over all data.
fn data_and_ending() -> (Vec<u8>, Vec<u8>) {
    let at = usize::try_from(COMPLETE.synced.last().unwrap().0).unwrap();
    (COMPLETE.bytes[..at].to_vec(), protocol::log::writer::ending())
}

/// An attachment of a gigabyte that is nearly all a hole is passed over, and so is a chunk; what
/// follows is read.
#[test]
fn what_is_too_large_is_passed_over_by_its_length() {
    const LENGTH: u64 = 1 << 30;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("sparse.mcap");
    let (data, ending) = data_and_ending();
    let frames = FLIGHT.frames.len();
    for opcode in [mcap::records::op::ATTACHMENT, mcap::records::op::CHUNK] {
        let first = usize::try_from(
            mcap::Summary::read(&COMPLETE.bytes).unwrap().unwrap().chunk_indexes[0].chunk_start_offset,
        )
        .unwrap();
        let head = [&[opcode][..], &LENGTH.to_le_bytes()].concat();
        std::fs::write(&path, [&data[..first], &head].concat()).unwrap();
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        let hole_ends = file.metadata().unwrap().len() + LENGTH;
        std::os::unix::fs::FileExt::write_all_at(&file, &[&data[first..], &ending].concat(), hole_ends)
            .unwrap();
        for arguments in [&["info"][..], &["verify"], &["report", "--out", "-"]] {
            let (code, said) = within(200, arguments, &path);
            assert_eq!(code, 0, "{arguments:?}: {said}");
            assert_eq!(said.contains("was passed over"), opcode == mcap::records::op::CHUNK, "{said}");
        }
        let (_, said) = within(200, &["verify"], &path);
        assert!(said.contains(&format!("{frames} of {frames} frames identical")), "{said}");
    }
}

/// A summary that is said to begin before a hole of a gigabyte is not looked for in it.
#[test]
fn a_hole_is_not_read_as_a_summary() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("hollow.mcap");
    let (data, _) = data_and_ending();
    std::fs::write(&path, &data).unwrap();
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    let footer = [&(data.len() as u64).to_le_bytes()[..], &[0; 12]].concat();
    let end = [&record(mcap::records::op::FOOTER, &footer)[..], mcap::MAGIC].concat();
    std::os::unix::fs::FileExt::write_all_at(&file, &end, (data.len() as u64) + (1 << 30)).unwrap();
    let (code, said) = within(200, &["info"], &path);
    assert!(code == 0 && said.contains("type 0, which does not exist"), "{said}");
}

#[test]
fn many_facts_many_limits_and_many_words_do_not_fill_the_memory() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("many.mcap");
    let (data, ending) = data_and_ending();
    let facts = |from: u32, count: u32| {
        let entries: Vec<u8> =
            (from..from + count).flat_map(|key| [text(&format!("k{key}")), text("v")].concat()).collect();
        let body =
            [text("run"), u32::try_from(entries.len()).unwrap().to_le_bytes().to_vec(), entries].concat();
        record(mcap::records::op::METADATA, &body)
    };
    let in_pieces: Vec<u8> = (0..100).flat_map(|piece| facts(piece * 10_000, 10_000)).collect();
    let limit = protocol::log::v1::LimitResult { unit: "m".to_owned(), ..Default::default() };
    let verdict = protocol::log::v1::LandingVerdict { envelope: vec![limit; 200_000], ..Default::default() };
    let header =
        LogHeader { profile_toml: Some(crate::flown::mission_toml().to_owned()), ..Default::default() };
    let mut writer = LogWriter::new(std::io::Cursor::new(Vec::new()), &header).unwrap();
    writer.write(&Record::ComputerStart(Box::new(FLIGHT.start)), 0).unwrap();
    writer.write(&Record::LandingVerdict(Box::new(verdict)), 0).unwrap();
    let limits = writer.finish().unwrap().into_inner();
    let mut writer = LogWriter::new(std::io::Cursor::new(Vec::new()), &header).unwrap();
    writer.write(&Record::ComputerStart(Box::new(FLIGHT.start)), 0).unwrap();
    let said =
        Event { level: EventLevel::Warning, name: "vehicle".to_owned(), message: "x".repeat(60 << 20) };
    writer.write(&Record::Event(said), 0).unwrap();
    let words = writer.finish().unwrap().into_inner();
    for bytes in [
        [&data[..], &facts(0, 1_000_000), &ending].concat(),
        [&data[..], &in_pieces, &ending].concat(),
        limits,
        words,
    ] {
        std::fs::write(&path, bytes).unwrap();
        let csv = directory.path().join("csv");
        for question in [
            &["info"][..],
            &["verify"],
            &["export", "--out", csv.to_str().unwrap()],
            &["report", "--out", "-"],
            &["compare", path.to_str().unwrap()],
        ] {
            let (code, said) = within(200, question, &path);
            // Only a comparison answers that there is nothing in common.
            assert!(
                [0, 1, 5].contains(&code) || (question[0], code) == ("compare", 3),
                "{question:?}: {said}"
            );
        }
    }
}

/// A pipe would be waited for without end.
#[test]
fn a_pipe_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let pipe = directory.path().join("pipe.mcap");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let output = directory.path().join("out.mcap");
    for arguments in [
        &["info"][..],
        &["verify"],
        &["verify", "--strict"],
        &["verify", "--book"],
        &["evaluate"],
        &["report"],
        &["recover", output.to_str().unwrap()],
    ] {
        // Of `recover` the pipe is the second file; both are refused.
        let (code, said) = within(400, arguments, &pipe);
        assert_eq!(code, 1, "{arguments:?}: {said}");
    }
    assert!(replay::recover::recover(&pipe, &output).is_err());
}

/// Writes a log of at least this many bytes; returns its number of frames.
fn write_long_log(path: &Path, bytes: u64) -> u64 {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut writer = LogWriter::new(file, &LogHeader::default()).unwrap();
    let mut number = 0_u64;
    while std::fs::metadata(path).unwrap().len() < bytes {
        for frame in &FLIGHT.frames {
            let mut frame = frame.clone();
            number += 1;
            frame.input.frame = number;
            // Numbers that do not compress, as in a flight; many, so that the log grows fast.
            let mut noise = number;
            frame.input.fins_rad = Vec::new();
            for _ in 0..150 {
                noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                frame.input.fins_rad.push(noise as f64 / 1e18);
            }
            writer.write(&Record::ComputerFrame(Box::new(frame)), number * FRAME_NS).unwrap();
        }
    }
    writer.finish().unwrap();
    number
}

/// The same memory for one megabyte as for a hundred: what is held does not grow with the log.
#[test]
fn a_hundred_megabytes_are_described_in_the_memory_of_one() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("long.mcap");
    for bytes in [1 << 20, 100 << 20] {
        let frames = write_long_log(&path, bytes);
        let (code, said) = within(48, &["info"], &path);
        assert_eq!(code, 0, "{said}");
        assert!(said.contains(&format!("frames      1 to {frames},")), "{said}");
    }
}

/// The rows of a table are streamed too.
#[test]
fn a_hundred_megabytes_are_exported_in_bounded_memory() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("long.mcap");
    let frames = write_long_log(&path, 100 << 20);
    let tables = directory.path().join("tables");
    let arguments = ["export", "--out", tables.to_str().unwrap()];
    let (code, said) = within(64, &arguments, &path);
    assert_eq!(code, 0, "{said}");
    let table = std::fs::read_to_string(tables.join("computer_frame.csv")).unwrap();
    assert_eq!(table.lines().count() as u64, frames + 1);
}

/// Changes some number of a frame to arbitrary bits.
fn spoil(frame: &mut ComputerFrame, field: usize, bits: u64) {
    let number = f64::from_bits(bits);
    let (input, output) = (&mut frame.input, &mut frame.output);
    let measured = &mut input.measured;
    match field {
        0 => input.time_s = number,
        1 => measured.imu.gyro_rad_s.x = number,
        2 => measured.imu.specific_force_m_s2.z = number,
        3 => measured.pressure_altitude_m = Some(number),
        4 => measured.lidar_range_m = Some(number),
        5 => input.fins_rad[0] = number,
        6 => input.contact = true,
        7 => output.phase = (bits % 13) as u32,
        8 => output.gimbal_rad[0] = number,
        9 => output.level = bits as u32,
        10 => input.igniter_continuity = false,
        11 => frame.state_digest = bits,
        // An abort.
        12 => input.requests.push(Request { asked: 4, ..Request::default() }),
        13 => output.ignite = true,
        _ => output.fins_rad = vec![number; (bits % 6) as usize],
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// A log with correct checksums and nonsense numbers: every command gives an answer or a
    /// reason.
    #[test]
    fn nonsense_gets_an_answer_or_a_reason(spoilt in prop::collection::vec((0_usize..30, 0_usize..15, any::<u64>()), 1..12)) {
        let mut frames = FLIGHT.frames[..30].to_vec();
        for (place, field, bits) in spoilt {
            spoil(&mut frames[place], field, bits);
        }
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("nonsense.mcap");
        std::fs::write(&path, write_log(&frames, &Recipe::default()).bytes).unwrap();
        let recording = Recording::open(&path).unwrap();
        prop_assert_eq!(recording.frames.len(), 30);
        let evaluated = evaluate(&recording, &["powered.weights.theta=90".parse().unwrap()]).unwrap();
        let gimbal_rad = |frame: &replay::evaluate::EvaluatedFrame| frame.evaluated.gimbal_rad.clone();
        prop_assert!(evaluated.frames.iter().flat_map(gimbal_rad).all(f64::is_finite));
        prop_assert_eq!(explain(&recording, 20).unwrap().frame, 20);
        for start in [None, Some(Moment::Frame(12))] {
            let options = ReflyOptions { start, ..ReflyOptions::default() };
            if let Ok(report) = refly(&recording, &options) {
                prop_assert!(report.frames > 0);
            }
        }
        prop_assert!(report(&path).unwrap().html.ends_with("</html>\n"));
        let flown = Flown::open(&path).unwrap();
        // A flight is equal to itself, in all samples that are in order and before a cut.
        let compared = compare(&flown, &flown.clone());
        let of_record = |failure: &String| failure.contains("are out of order") || failure.contains("INCOMPLETE");
        prop_assert!(compared.failures.iter().all(of_record), "{:?}", compared.failures);
    }
}
