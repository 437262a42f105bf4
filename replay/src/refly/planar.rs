//! Flies a planar landing again from a recorded state.

use std::collections::BTreeMap;

use flight::vehicle::profile::Profile;
use protocol::log::v1;
use sim::plane::draw::draw;

use super::{
    Law, RUN_PLANT_SETTINGS, ReflownFlight, ReflyError, ReflyOptions, ReflyReport, refuse_timed, report,
    simulation, start,
};
use crate::controller::{LoggedController, Replayed as _, SETTINGS_IN_FLIGHT, settings_in_flight};
use crate::info::VerdictFacts;
use crate::log::Recording;
use crate::settings::{Schedule, Setting, SettingError, profile_with};

pub(super) fn fly(
    recording: &Recording,
    options: &ReflyOptions,
) -> Result<(ReflyReport, ReflownFlight), ReflyError> {
    if !matches!(options.law, Law::AsRecorded | Law::Stabiliser) {
        return Err(ReflyError::OtherKind {
            name: recording.name.clone(),
            what: format!("controller {}", options.law.name()),
            of: "a flight from apogee",
            is: "a planar landing",
        });
    }
    if let Some(fault) = options.faults.with.iter().chain(&options.faults.without).next() {
        return Err(ReflyError::OtherKind {
            name: recording.name.clone(),
            what: format!("fault {fault}"),
            of: "a flight from apogee",
            is: "a planar landing",
        });
    }
    let ticks = recording.replayable_ticks()?;
    recording.profile()?;
    let toml = recording.profile_toml()?;
    refuse_wind_and_chance(recording, options)?;
    let plant_profile = plant_profile(recording, options)?;
    // Timed settings of the recorded flight apply to this one, too.
    let recorded = settings_in_flight(&recording.head.run)?;
    let all: Vec<Setting> = recorded.iter().chain(&options.settings).cloned().collect();
    let schedule = Schedule::new(toml, &all)?;
    let start = start::find(recording, ticks, options)?;

    let believed = schedule.base();
    let mut controller = LoggedController::scheduled(&schedule);
    let before: Vec<v1::ControllerTick> =
        ticks.iter().take(start.index).map(|tick| controller.run_again(tick)).collect::<Result<_, _>>()?;
    let seed = options.seed.or_else(|| recording.seed()).unwrap_or(0);
    let dispersed = draw(&plant_profile, seed);
    let mut flight =
        simulation::at_start(believed, &plant_profile, &dispersed, &controller, &start, options.law)?;
    let flown =
        ReflownFlight { before, run: run_facts(&all), ..simulation::fly(&mut flight, controller.schedule()) };

    let (commands_recorded, commands_identical, gimbal_difference_max_rad) = compare_commands(ticks, &flown);
    let recorded = recording.verdict.as_ref().map(VerdictFacts::of);
    let reflown = flown.verdict.as_ref().map(VerdictFacts::of);
    let report = ReflyReport {
        thrust_scale: dispersed.thrust_scale,
        ticks: flown.ticks.len(),
        commands_recorded,
        commands_identical,
        gimbal_difference_max_rad,
        ..report(recording, options, start.state, recorded, reflown)
    };
    Ok((report, flown))
}

/// Facts that the log of this flight adds to those of the recorded one: the timed settings. The others are in its
/// profile.
fn run_facts(settings: &[Setting]) -> BTreeMap<String, String> {
    let timed = settings.iter().filter(|setting| setting.at_s.is_some());
    let lines: Vec<String> = timed.map(ToString::to_string).collect();
    BTreeMap::from([(SETTINGS_IN_FLIGHT.to_owned(), lines.join("\n"))])
}

/// The profile of the plant: the flown profile, the plant settings if the record is itself a re-flown flight, and the
/// new settings.
fn plant_profile(recording: &Recording, options: &ReflyOptions) -> Result<Profile, ReflyError> {
    refuse_timed(&options.plant_settings)?;
    let recorded = recording.head.run.get(RUN_PLANT_SETTINGS).map(String::as_str).unwrap_or_default();
    let mut settings =
        recorded.split_whitespace().map(str::parse).collect::<Result<Vec<Setting>, SettingError>>()?;
    settings.extend(options.settings.iter().filter(|setting| setting.at_s.is_none()).cloned());
    settings.extend(options.plant_settings.iter().cloned());
    Ok(profile_with(recording.profile_toml()?, &settings)?)
}

/// The planar plant flies in still air; its random draw is set by `plant.*` and `dispersion.*`.
fn refuse_wind_and_chance(recording: &Recording, options: &ReflyOptions) -> Result<(), ReflyError> {
    let of_apogee = |setting: &&Setting| setting.path.starts_with("truth.") || setting.path.contains("wind");
    let mut settings = options.settings.iter().chain(&options.plant_settings);
    settings.find(of_apogee).map_or(Ok(()), |setting| {
        Err(ReflyError::OtherKind {
            name: recording.name.clone(),
            what: setting.to_string(),
            of: "a flight from apogee",
            is: "a planar landing, whose plant flies in still air",
        })
    })
}

/// The number of ticks with a recorded tick of the same number, how many of those command the same, and the largest
/// difference of the others, rad.
fn compare_commands(recorded: &[v1::ControllerTick], flown: &ReflownFlight) -> (usize, usize, f64) {
    let (mut known, mut identical) = (0, 0);
    let mut largest_rad = 0.0_f64;
    for now in &flown.ticks {
        let then = usize::try_from(now.record.input.tick).ok().and_then(|number| recorded.get(number));
        if let Some(then) = then {
            let (then_rad, now_rad) = (then.output.gimbal_command_rad, now.record.output.gimbal_command_rad);
            known += 1;
            identical += usize::from(then_rad.to_bits() == now_rad.to_bits());
            largest_rad = largest_rad.max((then_rad - now_rad).abs());
        }
    }
    (known, identical, largest_rad)
}
