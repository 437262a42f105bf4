//! Tests with files that are damaged, foreign, missing or already there.

use replay_rerun::export;

use crate::logs::{FRAMES, cleared, folder, in_the_third_chunk, write_log};
use crate::read_back::Recording;

#[test]
fn the_readable_part_of_a_cut_log_is_exported() {
    let (_folder, log, rrd) = folder();
    write_log(&log);
    let bytes = std::fs::read(&log).unwrap();
    let mut partly = 0;
    let cuts = (30..100).step_by(5).map(|percent| bytes.len() * percent / 100);
    for cut in cuts.chain([in_the_third_chunk(&bytes)]) {
        std::fs::write(&log, &bytes[..cut]).unwrap();
        let exported = match export(&log, None, cleared(&rrd)) {
            Ok((_, exported)) => exported,
            Err(refused) => {
                assert!(refused.to_string().contains("before its first message"), "{cut}: {refused}");
                assert_eq!(partly, 0, "{cut}: less of the log could be read");
                continue;
            }
        };
        let poses = exported[0].poses;
        assert_eq!(Recording::read(&rrd).rows("world/rocket"), poses, "{cut}");
        assert!(exported[0].damage.is_some() || poses == FRAMES as usize, "{cut}");
        partly += usize::from((1..FRAMES as usize).contains(&poses));
    }
    assert!(partly > 0);
}

#[test]
fn existing_files_are_not_overwritten_and_a_recording_gets_the_next_free_name() {
    let (folder, log, rrd) = folder();
    let other = folder.path().join("other.mcap");
    write_log(&log);
    write_log(&other);
    std::fs::write(&rrd, "precious").unwrap();
    for (to, free) in [(&rrd, "flight-2.rrd"), (&log, "flight-2.mcap"), (&other, "other-2.mcap")] {
        let before = std::fs::read(to).unwrap();
        assert_eq!(export(&log, Some(&other), to).unwrap().0, to.with_file_name(free));
        assert_eq!(std::fs::read(to).unwrap(), before);
    }
    export(&log, None, cleared(&rrd)).unwrap();
    assert_eq!(Recording::read(&rrd).layouts, 1);
}

#[test]
fn a_file_that_is_not_a_log_is_named_and_leaves_nothing_behind() {
    let (folder, log, rrd) = folder();
    let [table, missing, nowhere] =
        ["table.csv", "none.mcap", "nowhere/flight.rrd"].map(|name| folder.path().join(name));
    write_log(&log);
    std::fs::write(&table, "time,altitude\n0,15\n").unwrap();
    for (log, to, words) in [
        (&table, &rrd, "table.csv: is not a flight log"),
        (&missing, &rrd, "none.mcap: cannot be read"),
        (&log, &nowhere, "flight.rrd: cannot be written"),
    ] {
        let error = export(log, None, to).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "the log and the table");
}
