//! A recorded flight at the moment it is flown again from: with the recorded draw up to there, then with the changed
//! settings, as often as is asked.

use std::collections::BTreeMap;

use flight::computer::FRAME_S;
use flight::guidance::baseline::{Controller, Law as BurnLaw};
use flight::rules::phase::Phase;
use flight_log::frame::phase_of;
use flight_log::sortie;
use prost::Message as _;
use protocol::log::computer_v1::{ComputerFrame, ComputerInput, ComputerOutput, ComputerStart};
use protocol::log::record::Record;
use sim::dispersion::Dispersion;
use sim::draw::draw;
use sim::world::Truth;

use super::rerun::{Recorded, Rerun};
use super::{
    From, Law, Reached, ReflownFlight, ReflyError, ReflyOptions, ReflyReport, StartAt, StartState, margin,
    refuse_timed,
};
use crate::controller::{LoggedComputer, SETTINGS_IN_FLIGHT};
use crate::log::Recording;
use crate::log::VerdictFacts;
use crate::settings::{Setting, mission_with, truth_with};

/// Number and time of a record that is kept.
type Kept = Vec<(f64, Record)>;

/// A recorded flight at the moment it is flown again from.
#[derive(Debug)]
pub(crate) struct Prepared<'a> {
    recording: &'a Recording,
    start: &'a ComputerStart,
    frames: &'a [ComputerFrame],
    dispersion: Dispersion,
    number: u64,
    truth: Truth,
    rerun: Rerun,
    first_frame: u64,
    state: StartState,
    reached: Reached,
    recorded: Option<VerdictFacts>,
}

impl<'a> Prepared<'a> {
    /// Flies up to the start; only the start is taken from the options.
    ///
    /// # Errors
    /// See [`ReflyError`].
    pub(crate) fn new(recording: &'a Recording, options: &ReflyOptions) -> Result<Self, ReflyError> {
        let (start, frames) = recording.recorded_frames()?;
        let Recorded { dispersion, number, mut rerun, .. } = Recorded::of(recording)?;
        let place = find(recording, frames, &options.start)?;
        let first_frame = frames[place].input.frame;
        let mut reached = Reached { frames: 0, identical: 0, first_different: None };
        while rerun.flight.frame() + 1 < first_frame && rerun.step() {
            if let Some(now) = rerun.last.take()
                && let Some(then) = recorded_frame(&frames[..place], rerun.flight.frame())
            {
                reached.frames += 1;
                if is_same_flight(&now, then, !recording.from_power_up) {
                    reached.identical += 1;
                } else {
                    reached.first_different.get_or_insert(recording.release_frame + then.input.frame);
                }
            }
        }
        if options.from == From::Estimate {
            place_at_estimate(recording, &mut rerun, first_frame)?;
        }
        let world = rerun.flight.world();
        let place_m = world.state().position_m;
        let before = place
            .checked_sub(1)
            .map_or("DEPLOY", |before| phase_of(&frames[before].output).map_or("unknown", Phase::name));
        let state = StartState {
            frame: recording.release_frame + first_frame,
            since_release: first_frame,
            time_s: frames[place].input.time_s,
            phase: before,
            from: options.from,
            x_m: libm::hypot(place_m.x, place_m.y),
            z_m: world.height_m(),
        };
        Ok(Self {
            recording,
            start,
            frames,
            dispersion,
            number,
            truth: *world.truth(),
            first_frame,
            state,
            reached,
            recorded: recording.verdict.as_ref().map(VerdictFacts::of),
            rerun,
        })
    }

    /// How the frames before the start compare with the record.
    pub(crate) fn reached(&self) -> Reached {
        self.reached
    }

    /// Flies the flight again from the start it was prepared for; `options` must have the same start.
    ///
    /// # Errors
    /// See [`ReflyError`].
    pub(crate) fn fly(&self, options: &ReflyOptions) -> Result<ReflyReport, ReflyError> {
        Ok(self.fly_on(options, None)?.0)
    }

    /// Continues the flight to its end; keeps the frames if a place for them is given.
    pub(crate) fn fly_on(
        &self,
        options: &ReflyOptions,
        mut kept: Option<&mut Kept>,
    ) -> Result<(ReflyReport, Option<protocol::log::v1::LandingVerdict>), ReflyError> {
        let mut rerun = self.changed(options)?;
        let (mut frames, mut commands_recorded, mut commands_identical) = (0, 0, 0);
        let mut gimbal_difference_max_rad = 0.0_f64;
        let mut phase = rerun.flight.computer().mode().phase;
        loop {
            let goes_on = rerun.step();
            let flight = &rerun.flight;
            if let Some(commands) = rerun.commands() {
                frames += 1;
                if let Some(then) = recorded_frame(self.frames, flight.frame()) {
                    let then = &then.output.gimbal_rad;
                    let pairs = || then.iter().zip(&commands.gimbal_rad);
                    commands_recorded += 1;
                    commands_identical += usize::from(pairs().all(|(a, b)| a.to_bits() == b.to_bits()));
                    let apart_rad = pairs().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    gimbal_difference_max_rad = gimbal_difference_max_rad.max(apart_rad);
                }
            }
            if let Some(kept) = &mut kept {
                keep(kept, &mut rerun, phase);
            }
            phase = rerun.flight.computer().mode().phase;
            if !goes_on {
                break;
            }
        }
        let verdict = sortie::verdict(&rerun.flight);
        let reflown = verdict.as_ref().map(VerdictFacts::of);
        let listed = |settings: &[Setting]| settings.iter().map(ToString::to_string).collect();
        let stands = |verdict: &Option<VerdictFacts>| verdict.as_ref().map(|verdict| verdict.landing.stands);
        let report = ReflyReport {
            kind: "closed loop: flown again in simulation",
            file: self.recording.name.clone(),
            settings: listed(&options.settings),
            plant_settings: listed(&options.plant_settings),
            law: options.law,
            faults: options.faults.clone(),
            seed: options.seed,
            start: self.state,
            reached: self.reached,
            thrust_scale: rerun.flight.world().truth().impulse_scale,
            verdict_changed: stands(&self.recorded).map(|then| Some(then) != stands(&reflown)),
            recorded: self.recorded.clone(),
            margin: reflown.as_ref().map(margin),
            reflown,
            frames,
            commands_recorded,
            commands_identical,
            gimbal_difference_max_rad,
        };
        Ok((report, verdict))
    }

    /// Continues the flight to its end and keeps everything from apogee on. The frames before the start are the
    /// re-flown ones, too: recorded frames may come from another build or be partly lost, and the flight after the
    /// start would not continue them.
    ///
    /// # Errors
    /// See [`ReflyError`].
    pub(crate) fn fly_kept(
        &self,
        options: &ReflyOptions,
    ) -> Result<(ReflyReport, ReflownFlight), ReflyError> {
        let Recorded { mut rerun, faults, .. } = Recorded::with_faults(self.recording, &options.faults)?;
        let ComputerStart { believed, gyro_bias_rad_s, .. } = sortie::start(&rerun.flight);
        let start = ComputerStart { believed, gyro_bias_rad_s, ..*self.start };
        let mut records: Kept = vec![(0.0, Record::ComputerStart(Box::new(start)))];
        let mut phase = rerun.flight.computer().mode().phase;
        while rerun.flight.frame() + 1 < self.first_frame && rerun.step() {
            keep(&mut records, &mut rerun, phase);
            phase = rerun.flight.computer().mode().phase;
        }
        let (report, verdict) = self.fly_on(options, Some(&mut records))?;
        let mut run = self.run_facts(options)?;
        run.insert("faults".to_owned(), faults);
        Ok((report, ReflownFlight { records, run, verdict }))
    }

    /// Facts that the log of this flight has in addition to those of the recorded flight.
    fn run_facts(&self, options: &ReflyOptions) -> Result<BTreeMap<String, String>, ReflyError> {
        let lines: Vec<String> = self.in_flight(options)?.iter().map(ToString::to_string).collect();
        Ok(BTreeMap::from([(SETTINGS_IN_FLIGHT.to_owned(), lines.join("\n"))]))
    }

    /// The settings as timed ones. None applies before the start (half a frame before the end of its first frame),
    /// because until then the flight is the recorded one. If another controller of the landing burn is requested, its
    /// ignition height is included.
    fn in_flight(&self, options: &ReflyOptions) -> Result<Vec<Setting>, ReflyError> {
        let start_s = (self.first_frame as f64 - 0.5) * FRAME_S;
        let mut in_flight = options.settings.clone();
        // Of two settings that take effect at the start, the later setting wins, as it would have in flight.
        in_flight.sort_by(|a, b| a.at_s.unwrap_or(f64::MIN).total_cmp(&b.at_s.unwrap_or(f64::MIN)));
        for setting in &mut in_flight {
            setting.at_s = Some(setting.at_s.map_or(start_s, |at_s| at_s.max(start_s)));
        }
        if let Some(controller) = Self::other_controller(options) {
            let mission = mission_with(self.recording.profile_toml()?, &lasting(options))?;
            let fixed_m = self.start.fixed_ignition_height_m.or(mission.ignition.fixed_height_m);
            let height_m = BurnLaw::of(controller, &mission).ignition_height_m();
            if let (Some(height_m), None) = (height_m, fixed_m) {
                in_flight.push(Setting {
                    path: "ignition.fixed_height_m".to_owned(),
                    value: toml::Value::Float(height_m),
                    at_s: Some(start_s),
                });
            }
        }
        Ok(in_flight)
    }

    /// The requested controller of the landing burn, if it differs from the recorded controller.
    fn other_controller(options: &ReflyOptions) -> Option<Controller> {
        match options.law {
            Law::AsRecorded => None,
            Law::Nmpc => Some(Controller::Nmpc),
            Law::OpenLoop => Some(Controller::OpenLoop),
            Law::Oscillating => Some(Controller::Oscillating),
        }
    }

    /// The flight at the start. With other faults it is flown there anew, and may have come another way.
    fn with_other_faults(&self, options: &ReflyOptions) -> Result<Rerun, ReflyError> {
        if options.faults.is_none() {
            return Ok(self.rerun.clone());
        }
        let Recorded { mut rerun, .. } = Recorded::with_faults(self.recording, &options.faults)?;
        while rerun.flight.frame() + 1 < self.first_frame && rerun.step() {}
        if options.from == From::Estimate {
            place_at_estimate(self.recording, &mut rerun, self.first_frame)?;
        }
        Ok(rerun)
    }

    /// The flight at the start, with the changes that apply from there.
    fn changed(&self, options: &ReflyOptions) -> Result<Rerun, ReflyError> {
        refuse_timed(&options.plant_settings)?;
        let toml = self.recording.profile_toml()?;
        let estimator = |setting: &&Setting| setting.path.starts_with("estimator.");
        if let Some(setting) = options.settings.iter().find(estimator) {
            let reason = format!("{setting}: the estimator is set up at apogee; evaluate takes it");
            return Err(ReflyError::Recipe { name: self.recording.name.clone(), reason });
        }
        refuse_misplaced(options)?;
        let mut rerun = self.with_other_faults(options)?;
        let in_flight = self.in_flight(options)?;
        rerun.schedule = Some(LoggedComputer::schedule(toml, self.start, &in_flight)?);

        // The world gets its airframe from all settings without a time, and its draw from the settings of the draw.
        let lasting = lasting(options);
        let (of_truth, of_mission): (Vec<Setting>, Vec<Setting>) =
            options.plant_settings.iter().cloned().partition(|setting| setting.path.starts_with("truth."));
        let all: Vec<Setting> = lasting.iter().chain(&of_mission).cloned().collect();
        let true_mission = mission_with(toml, &all)?;
        if let Some(controller) = Self::other_controller(options) {
            let mission = mission_with(toml, &lasting)?;
            rerun.flight.set_law(BurnLaw::of(controller, &mission));
        }
        let other_draw =
            options.seed.map(|seed| draw(&true_mission, &self.dispersion, seed, self.number).truth);
        let truth = truth_with(&other_draw.unwrap_or(self.truth), &of_truth)?;
        let world = rerun.flight.world();
        if truth != *world.truth() || true_mission.airframe != *world.airframe() {
            let changed =
                world.changed(&true_mission.airframe, truth.curve(&true_mission)?.as_ref(), &truth)?;
            *rerun.flight.world_mut() = changed;
        }
        Ok(rerun)
    }
}

/// The plant takes settings of the airframe and of the draw; the controller takes all but those of the draw.
fn refuse_misplaced(options: &ReflyOptions) -> Result<(), ReflyError> {
    let of_truth = |setting: &&Setting| setting.path.starts_with("truth.");
    let of_plant = |setting: &&Setting| of_truth(setting) || setting.path.starts_with("airframe");
    if let Some(setting) = options.settings.iter().find(of_truth) {
        let belongs = "the random draw belongs to the plant alone (--plant)";
        return Err(ReflyError::Misplaced { setting: setting.to_string(), belongs });
    }
    if let Some(setting) = options.plant_settings.iter().find(|setting| !of_plant(setting)) {
        let belongs = "the plant has airframe.* and truth.*; everything else is the controller's (--set)";
        return Err(ReflyError::Misplaced { setting: setting.to_string(), belongs });
    }
    Ok(())
}

/// Keeps the frame just flown; `phase` is the phase before it.
fn keep(kept: &mut Kept, rerun: &mut Rerun, phase: Phase) {
    let time_s = rerun.flight.frame() as f64 * FRAME_S;
    let records = sortie::frame_and_phase(&rerun.flight, &mut rerun.last, phase);
    kept.extend(records.into_iter().map(|record| (time_s, record)));
}

/// The settings without a time.
fn lasting(options: &ReflyOptions) -> Vec<Setting> {
    options.settings.iter().filter(|setting| setting.at_s.is_none()).cloned().collect()
}

/// Whether two frames are of the same flight: what was felt, what was decided, and what is remembered, unless that covers a
/// pad. What only a crew or a log's disk makes different does not count.
fn is_same_flight(now: &ComputerFrame, then: &ComputerFrame, same_memory: bool) -> bool {
    let felt = |frame: &ComputerFrame| {
        let ComputerInput {
            measured, known, fins_rad, contact, igniter_continuity, booster_attached, ..
        } = frame.input.clone();
        let input = ComputerInput {
            measured,
            known,
            fins_rad,
            contact,
            igniter_continuity,
            booster_attached,
            ..ComputerInput::default()
        };
        let output = ComputerOutput { answers: Vec::new(), released: false, ..frame.output.clone() };
        let state_digest = if same_memory { frame.state_digest } else { 0 };
        ComputerFrame { input, output, state_digest }.encode_to_vec()
    };
    felt(now) == felt(then)
}

/// The index of the frame to start with. For a phase it is the frame after the one that entered it, because changes
/// cannot act earlier.
fn find(recording: &Recording, frames: &[ComputerFrame], start: &StartAt) -> Result<usize, ReflyError> {
    let logged = |frame: &ComputerFrame| recording.release_frame + frame.input.frame;
    let in_phase = |wanted: &dyn Fn(Phase) -> bool| {
        let entered = frames.iter().position(|frame| phase_of(&frame.output).is_some_and(wanted))?;
        Some(entered + 1).filter(|place| *place < frames.len())
    };
    let found = match start {
        StartAt::Landing => in_phase(&Phase::is_landing),
        StartAt::Frame(number) => frames.iter().position(|frame| logged(frame) == *number),
        StartAt::Time(time_s) => frames.iter().position(|frame| frame.input.time_s >= *time_s),
        StartAt::Phase(phase) => in_phase(&|found| found == *phase),
    };
    found.ok_or_else(|| {
        let (first, last) = (frames.first(), frames.last());
        let number = |frame: Option<&ComputerFrame>| frame.map_or(0, logged);
        let reason = match start {
            StartAt::Landing => {
                "no frame of a landing to start from; a frame, a time or a phase names another moment"
                    .to_owned()
            }
            StartAt::Frame(asked) => {
                format!("no frame {asked}; there are {} to {}", number(first), number(last))
            }
            StartAt::Time(time_s) => {
                format!(
                    "no frame at or after {time_s} s; the last is at {:.3} s",
                    last.map_or(0.0, |frame| frame.input.time_s)
                )
            }
            StartAt::Phase(phase) => format!("no frame in phase {}", phase.name()),
        };
        ReflyError::Start { name: recording.name.clone(), reason }
    })
}

/// Puts the vehicle at the position that its flight computer estimated at the end of the frame before the start.
fn place_at_estimate(recording: &Recording, rerun: &mut Rerun, first_frame: u64) -> Result<(), ReflyError> {
    let refused =
        |reason: &str| ReflyError::Start { name: recording.name.clone(), reason: reason.to_owned() };
    let Some(estimate) = rerun.flight.pilot().estimate().filter(|_| first_frame > 1) else {
        return Err(refused("before its first frame the flight computer has estimated nothing yet"));
    };
    let world = rerun.flight.world();
    if world.touchdown().is_some() {
        return Err(refused(
            "it is already on the ground; --from estimate can place only a vehicle in flight",
        ));
    }
    let placed = world.placed(&estimate.state)?;
    *rerun.flight.world_mut() = placed;
    Ok(())
}

/// A recorded frame by its number; a log may have lost it.
fn recorded_frame(frames: &[ComputerFrame], number: u64) -> Option<&ComputerFrame> {
    let place = frames.binary_search_by_key(&number, |frame| frame.input.frame).ok()?;
    frames.get(place)
}
