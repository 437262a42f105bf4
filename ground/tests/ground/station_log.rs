//! The station's own log as a check of its own.

use ground::key::Key;
use ground::model::{LogFault, LogHealth, LogSpace, LogStanding, Prompt, Seat, Settings};
use ground::update::{Action, Msg, Request};
use protocol::dialect::{MavCmd, TdPhase};
use protocol::log::record::Record;

use crate::rig::{Rig, enter, is_arm, settings};
use crate::screens::{armed, on_the_pad};

const MIB: u64 = 1 << 20;

fn health(free_mib: u64, grows_bytes_s: u32) -> LogHealth {
    let space = Some(LogSpace { free_bytes: free_mib * MIB, grows_bytes_s });
    LogHealth { space, ..LogHealth::default() }
}

const FAILED: LogHealth = LogHealth { dropped: 0, failed: true, removed: false, space: None };

#[test]
fn a_log_is_changed_on_the_pad_or_in_silence_and_never_in_a_flight() {
    let mut rig = on_the_pad();
    rig.run(1.0);
    assert!(rig.model.may_change_log(rig.now), "disarmed on the pad");
    rig.model.settings.auto = true;
    assert!(!rig.model.may_change_log(rig.now), "an automatic run ends with its flight");
    rig.model.settings.auto = false;
    for ((is_armed, phase), may) in [
        ((true, TdPhase::TD_PHASE_PAD_ARMED), false),
        ((true, TdPhase::TD_PHASE_AERO_DESCENT), false),
        ((false, TdPhase::TD_PHASE_AERO_DESCENT), false),
        ((false, TdPhase::TD_PHASE_TOUCHDOWN), false),
    ] {
        (rig.armed, rig.phase) = (is_armed, phase);
        rig.run(1.0);
        assert_eq!(rig.model.may_change_log(rig.now), may, "{is_armed} {phase:?}");
        rig.now += std::time::Duration::from_mins(11);
        rig.msg(Msg::Tick);
        let is_over = phase == TdPhase::TD_PHASE_TOUCHDOWN;
        assert_eq!(rig.model.may_change_log(rig.now), is_over, "silent, {is_armed} {phase:?}");
    }
}

/// The crew is warned before the disk is full: by what is left, and by the time that it lasts.
#[test]
fn the_space_is_judged_by_what_is_left_and_by_how_long_it_lasts() {
    let mut rig = on_the_pad();
    let mut standing = |health| {
        rig.msg(Msg::Log(health));
        rig.model.station_log(rig.now)
    };
    assert_eq!(standing(health(9_999, 30_000)), LogStanding::Fine);
    assert_eq!(standing(health(255, 0)), LogStanding::Warned("255 MiB left".to_owned()));
    let unfit = |words: &str| LogStanding::Unfit(LogFault::Full, words.to_owned());
    assert_eq!(standing(health(63, 0)), unfit("63 MiB left"));
    // 1 MB/s: 900 MB last 15 minutes.
    assert_eq!(standing(health(859, 1_000_000)), LogStanding::Warned("859 MiB left (15 min)".to_owned()));
    assert_eq!(standing(health(858, 1_000_000)), unfit("858 MiB left (14 min)"));
}

/// NO-GO, with the reason on the pad page, in the alarm and in the voice; nothing is armed.
#[test]
fn a_failed_or_full_log_is_a_no_go_for_arming_from_this_station() {
    for (broken, words) in [
        (FAILED, "station log FAILED: nothing is recorded"),
        (health(12, 0), "station log 12 MiB left"),
        (LogHealth { dropped: 7, ..LogHealth::default() }, "station log loses records, 7 so far"),
    ] {
        let mut rig = on_the_pad();
        rig.expect_screen(" every arming check passes");
        rig.msg(Msg::Log(broken));
        let screen = rig.screen(80, 24);
        assert!(screen.contains(&format!("NO-GO: {words}")), "{screen}");
        assert!(screen.contains(" NO  station log "), "{screen}");
        assert!(screen.contains(&format!("ALARM STATION LOG {}", &words[12..20])), "{screen}");
        rig.keys(&enter("AARM"));
        assert!(!rig.take_commands().iter().any(is_arm), "{words}");
    }
}

/// A log that has lost records, and loses none any more, is fit again, and says so.
#[test]
fn a_log_that_loses_no_more_records_is_fit_again() {
    let mut rig = on_the_pad();
    rig.msg(Msg::Log(LogHealth { dropped: 7, ..LogHealth::default() }));
    assert!(rig.model.why_no_log(rig.now).is_some());
    rig.run(31.0);
    assert_eq!(rig.model.station_log(rig.now), LogStanding::Warned("has lost 7 records".to_owned()));
    assert_eq!(rig.model.why_no_log(rig.now), None);
}

/// The crew goes on without a log by a word, which is recorded; then the ladder is the usual one.
#[test]
fn the_crew_may_go_on_without_a_log_by_a_word_that_is_recorded() {
    let mut rig = on_the_pad();
    rig.msg(Msg::Log(FAILED));
    rig.key(Key::Char('A'));
    assert!(rig.model.dialog.as_ref().is_some_and(|dialog| dialog.prompt == Prompt::WithoutLog));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("Type NOLOG and Enter") && screen.contains("FAILED"), "{screen}");
    rig.keys(&enter("NOLOG"));
    assert!(!rig.take_commands().iter().any(is_arm), "nothing is armed by it");
    let words = "WITHOUT A LOG: arm and start go on although the station log FAILED: nothing is recorded";
    rig.expect_event(words);
    rig.expect_screen(" !!  station log overruled: FAILED");
    rig.keys(&enter("AARM"));
    assert!(rig.take_commands().iter().any(is_arm));

    let mut rig = on_the_pad();
    rig.msg(Msg::Log(FAILED));
    rig.actions.clear();
    rig.keys(&enter("ANOLOG"));
    let recorded = |action: &Action| matches!(action, Action::Record(Record::OperatorAction(action)) if action.kind == "without log");
    assert!(rig.actions.iter().any(recorded));
    let entered = |action: &Action| matches!(action, Action::Enter(line) if line.kind == "without log");
    assert!(rig.actions.iter().any(entered), "in the book");
}

/// The word counts for the fault that it was typed for, and only as long as the fault lasts.
#[test]
fn the_word_counts_for_one_fault_only() {
    let mut rig = on_the_pad();
    rig.msg(Msg::Log(health(12, 0)));
    rig.keys(&enter("ANOLOG"));
    assert_eq!(rig.model.why_no_log(rig.now), None);
    rig.msg(Msg::Log(FAILED));
    assert!(rig.model.why_no_log(rig.now).is_some(), "another fault");
    rig.msg(Msg::Log(health(9_999, 0)));
    rig.msg(Msg::Log(health(12, 0)));
    assert!(rig.model.why_no_log(rig.now).is_some(), "it was fit in between");
}

/// A log that fails between arm and start stops the start.
#[test]
fn a_log_that_fails_after_the_arming_stops_the_start() {
    let mut rig = armed();
    rig.msg(Msg::Log(FAILED));
    rig.take_commands();
    rig.key(Key::Char('S'));
    assert!(rig.model.dialog.as_ref().is_some_and(|dialog| dialog.prompt == Prompt::WithoutLog));
    rig.keys(&[Key::Escape, Key::Char('S'), Key::Enter]);
    assert!(rig.take_commands().is_empty());
}

/// The vehicle is held, unless the crew has gone on without a log before.
#[test]
fn a_station_log_that_fails_in_the_countdown_holds_it() {
    for nolog in [false, true] {
        let mut rig = armed();
        if nolog {
            rig.msg(Msg::Log(FAILED));
            rig.msg(Msg::Requested { request: Request::WithoutLog, by: Seat::default() });
        }
        rig.countdown_ms = 8_000;
        rig.run(1.0);
        rig.take_commands();
        rig.msg(Msg::Log(FAILED));
        rig.run(1.0);
        let hold = MavCmd::MAV_CMD_DO_PAUSE_CONTINUE;
        let held = rig.take_commands().iter().filter(|sent| sent.command == hold).count();
        assert_eq!(held > 5, !nolog, "{held}");
        let said = "the station's log fails in the countdown: HOLD";
        assert_eq!(rig.events().contains(said), !nolog, "{}", rig.events());
    }
}

/// `--log none` is a choice that was made already.
#[test]
fn a_station_started_without_a_log_may_arm() {
    let mut rig = Rig::new(Settings { log_path: None, ..settings(false, true) });
    rig.run(1.0);
    assert_eq!(rig.model.station_log(rig.now), LogStanding::None);
    rig.keys(&enter("AARM"));
    assert!(rig.take_commands().iter().any(is_arm));
}
