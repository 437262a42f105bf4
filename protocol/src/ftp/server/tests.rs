use super::*;
use crate::frame::Encoder;
use crate::identity::{GROUND, VEHICLE};
use proptest::prelude::*;

const NOW: Duration = Duration::from_secs(10);

fn log(len: usize) -> InMemory {
    InMemory::new([("old.mcap", vec![1, 2, 3]), ("flight.mcap", content(len))])
}

fn content(len: usize) -> Vec<u8> {
    (0..len).map(|n| (n % 251) as u8).collect()
}

fn request(packet: Packet) -> FileRequest {
    FileRequest { source: GROUND, target: VEHICLE, packet }
}

/// Everything that the server sends to one request.
fn answers(server: &mut Server, files: &mut InMemory, packet: Packet) -> Vec<Packet> {
    server.take(&request(packet), 0, true, files, NOW);
    let mut sent = Vec::new();
    for _ in 0..2000 {
        server.work(files);
        while let Some(message) = server.next(0, files, NOW) {
            let frame = Encoder::new(VEHICLE).encode(&message);
            sent.extend(Packet::answer_in(&frame).map(|(_, packet)| packet));
        }
    }
    sent
}

fn answer(server: &mut Server, files: &mut InMemory, packet: Packet) -> Packet {
    let mut sent = answers(server, files, packet);
    assert_eq!(sent.len(), 1, "{sent:?}");
    sent.remove(0)
}

fn reading(sequence: u16, session: u8, opcode: Opcode, offset: u32, size: u8) -> Packet {
    Packet { size, ..Packet::request(sequence, session, opcode, offset, "") }
}

#[test]
fn directories_are_listed_until_their_end() {
    let (mut server, mut files) = (Server::default(), log(1000));
    let mut list = |path: &str, offset| {
        answer(&mut server, &mut files, Packet::request(7, 3, Opcode::LIST_DIRECTORY, offset, path))
    };
    assert_eq!(list("/", 0).data, b"Dlog\0");
    let told = list("/log", 0);
    assert_eq!((told.sequence, told.session, told.request), (8, 3, Opcode::LIST_DIRECTORY));
    assert_eq!(told.data, b"Fold.mcap\t3\0Fflight.mcap\t1000\0");
    assert_eq!(list("@MAV_LOG", 1).data, b"Fflight.mcap\t1000\0");
    assert_eq!(list("log/", 2).refusal(), Some(Refusal::EndOfFile));
    assert_eq!(list("/etc", 0).refusal(), Some(Refusal::FileNotFound));
}

#[test]
fn everything_that_writes_is_refused_as_protected_and_the_unknown_as_unknown() {
    let (mut server, mut files) = (Server::default(), log(1000));
    for number in 0..=127 {
        let opcode = Opcode(number);
        let told = answers(&mut server, &mut files, Packet::request(1, 0, opcode, 0, "/log/flight.mcap"));
        let why = told[0].refusal();
        match number {
            6..=13 => assert_eq!(why, Some(Refusal::FileProtected), "{number}"),
            16.. => assert_eq!(why, Some(Refusal::UnknownCommand), "{number}"),
            _ => {}
        }
    }
    assert_eq!(files, log(1000));
}

#[test]
fn a_file_comes_in_bursts_and_single_pieces_with_its_checksum() {
    let (mut server, mut files) = (Server::default(), log(100_000));
    let opened =
        answer(&mut server, &mut files, Packet::request(0, 0, Opcode::OPEN_FILE_RO, 0, "/log/flight.mcap"));
    assert_eq!(opened.number(), Some(100_000));
    let mut file = Vec::new();
    while file.len() < 100_000 {
        let request = reading(100, opened.session, Opcode::BURST_READ_FILE, file.len() as u32, 239);
        let burst = answers(&mut server, &mut files, request);
        for (place, packet) in burst.iter().enumerate() {
            assert_eq!(usize::from(packet.sequence), 101 + place);
            assert_eq!(packet.offset as usize, file.len());
            assert_eq!(packet.burst_complete, place + 1 == burst.len());
            file.extend_from_slice(&packet.data);
        }
        assert!(burst.len() <= 256);
    }
    assert_eq!(file, content(100_000));
    let one = answer(&mut server, &mut files, reading(9, opened.session, Opcode::READ_FILE, 99_990, 239));
    assert_eq!((one.sequence, one.offset, &one.data[..]), (10, 99_990, &file[99_990..]));
    let end = answer(&mut server, &mut files, reading(9, opened.session, Opcode::READ_FILE, 100_000, 239));
    assert_eq!(end.refusal(), Some(Refusal::EndOfFile));
    let told = answer(
        &mut server,
        &mut files,
        Packet::request(11, 0, Opcode::CALC_FILE_CRC32, 0, "/log/flight.mcap"),
    );
    assert_eq!(told.number(), Some(crc::continued(0, &file)));
}

#[test]
fn a_repeated_request_gets_the_same_answer_and_no_second_session() {
    let (mut server, mut files) = (Server::default(), log(1000));
    let open = Packet::request(5, 9, Opcode::OPEN_FILE_RO, 0, "/log/flight.mcap");
    let first = answer(&mut server, &mut files, open.clone());
    assert_eq!(first, answer(&mut server, &mut files, open.clone()));
    assert_eq!(server.sessions.len(), 1);
    let close = Packet::request(6, first.session, Opcode::TERMINATE_SESSION, 0, "");
    let closed = answer(&mut server, &mut files, close.clone());
    assert_eq!(closed.opcode, Opcode::ACK);
    assert_eq!(closed, answer(&mut server, &mut files, close));
    assert_eq!(server.sessions.len(), 0);
    // The session of the first answer is closed: this client has been started again.
    assert_eq!(answer(&mut server, &mut files, open).opcode, Opcode::ACK);
    assert_eq!(server.sessions.len(), 1);
}

#[test]
fn a_client_that_starts_again_ends_its_old_burst_and_gets_another_session() {
    let (mut server, mut files) = (Server::default(), log(100_000));
    let open = |sequence| Packet::request(sequence, 0, Opcode::OPEN_FILE_RO, 0, "/log/flight.mcap");
    let first = answer(&mut server, &mut files, open(0));
    server.take(&request(reading(1, first.session, Opcode::BURST_READ_FILE, 0, 239)), 0, true, &files, NOW);
    let second = answer(&mut server, &mut files, open(77));
    assert_ne!(first.session, second.session);
    assert_eq!(server.sessions.len(), 1);
}

#[test]
fn nothing_is_read_while_it_is_not_allowed_and_other_paths_are_not_found() {
    let (mut server, mut files) = (Server::default(), log(1000));
    let open = Packet::request(5, 0, Opcode::OPEN_FILE_RO, 0, "/log/flight.mcap");
    let session = answer(&mut server, &mut files, open.clone()).session;
    let refused = |server: &mut Server, files: &mut InMemory, packet: Packet| {
        let taken = server.take(&request(packet), 0, false, files, NOW);
        let frame = Encoder::new(VEHICLE).encode(&server.next(0, files, NOW).unwrap());
        assert_eq!(server.next(0, files, NOW), None);
        (taken, Packet::answer_in(&frame).unwrap().1.refusal())
    };
    for packet in [
        reading(6, session, Opcode::BURST_READ_FILE, 0, 239),
        reading(7, session, Opcode::READ_FILE, 0, 239),
        open,
        Packet::request(8, 0, Opcode::CALC_FILE_CRC32, 0, "log/flight.mcap"),
        Packet::request(9, 0, Opcode::LIST_DIRECTORY, 0, "/log"),
    ] {
        assert_eq!(refused(&mut server, &mut files, packet), (Taken::NotNow, Some(Refusal::Busy)));
    }
    // MAVProxy requests it, and waits if it gets another answer.
    let parameters = Packet::request(10, 0, Opcode::OPEN_FILE_RO, 0, "@PARAM/param.pck");
    assert_eq!(refused(&mut server, &mut files, parameters), (Taken::Answered, Some(Refusal::FileNotFound)));
    // A client without permission does not close the files of others.
    assert_eq!(server.sessions.len(), 1);
    server.close_all();
    let read = reading(11, session, Opcode::READ_FILE, 0, 239);
    assert_eq!(answer(&mut server, &mut files, read).refusal(), Some(Refusal::InvalidSession));
}

#[test]
fn sessions_are_bounded_and_end_when_nobody_reads() {
    let names: Vec<String> = (0..20).map(|n| format!("{n}.mcap")).collect();
    let many = names.iter().map(|name| (name.as_str(), vec![0; 10]));
    let (mut server, mut files) = (Server::default(), InMemory::new(many));
    for system_id in 1..=5 {
        for name in &names {
            let packet = Packet::request(1, 0, Opcode::OPEN_FILE_RO, 0, &format!("/log/{name}"));
            let source = Address { system_id, component_id: 190 };
            server.take(&FileRequest { source, target: VEHICLE, packet }, 0, true, &files, NOW);
            while server.next(0, &mut files, NOW).is_some() {}
        }
    }
    assert_eq!(server.sessions.len(), MAX_SESSIONS);
    let late = NOW + IDLE;
    server.take(&request(Packet::request(1, 0, Opcode::NONE, 0, "")), 0, true, &files, late);
    assert!(server.sessions.is_empty() && !server.is_busy(0, late));
}

proptest! {
    /// For any input the server answers with a valid packet, stays within its bounds and never
    /// panics.
    #[test]
    fn hostile_requests_are_answered_within_bounds(
        requests in proptest::collection::vec((any::<u8>(), any::<u8>(), any::<u16>(), any::<u32>(), "[a-z/@_A-Z.0]{0,30}", any::<u8>()), 0..200),
    ) {
        let (mut server, mut files) = (Server::default(), log(3000));
        for (opcode, session, sequence, offset, path, size) in requests {
            let opcode = Opcode(opcode % 18);
            let path = if size % 3 == 0 { "/log/flight.mcap" } else { &path };
            let packet = Packet { size, ..Packet::request(sequence, session % 4, opcode, offset % 4000, path) };
            server.take(&request(packet), usize::from(session % 2), size % 7 != 0, &files, NOW);
            server.work(&mut files);
            if size % 2 == 0 {
                server.next(0, &mut files, NOW);
            }
            prop_assert!(server.sessions.len() <= MAX_SESSIONS && server.ready.len() <= MAX_READY);
            prop_assert!(server.sums.len() <= MAX_SUMS && server.remembered.len() <= MAX_REMEMBERED);
        }
    }
}
