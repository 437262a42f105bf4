//! Runs the controller of the log again on its recorded inputs and compares it with the record.

use prost::Message as _;
use protocol::log::flight_v1::{PilotStart, PilotTick};
use protocol::log::v1::ControllerTick;
use replay::controller::{LoggedController, LoggedPilot, NewPlans, Replayed as _, path_in_world_m};
use replay::log::{FrameOrder, Gap};

use crate::survey::Survey;

/// The controller being run again.
#[derive(Default)]
pub(crate) struct Again {
    controller: Controller,
    /// The first tick with a different result.
    pub(crate) first_different: Option<u64>,
    /// Ticks run again, and how many of them were identical bit for bit.
    pub(crate) ticks: u64,
    pub(crate) identical: u64,
    /// Why it was not run to the end, if so.
    pub(crate) obstacle: Option<String>,
}

#[derive(Default)]
enum Controller {
    #[default]
    None,
    Planar {
        controller: Box<LoggedController>,
        next: u64,
    },
    Pilot {
        pilot: Box<LoggedPilot>,
        plans: NewPlans,
        order: FrameOrder,
    },
}

/// A frame of a flight computer, run again.
pub(crate) struct FrameAgain {
    pub(crate) tick: PilotTick,
    /// A plan made in this frame: its path, m, and the iterations it took.
    pub(crate) plan: Option<(Vec<[f32; 3]>, usize)>,
}

impl Again {
    /// The controller of a planar landing, if the log has its profile.
    pub(crate) fn of(survey: &Survey) -> Self {
        let mut again = Self::default();
        if let (Some(profile), Some(toml)) = (&survey.profile, &survey.profile_toml) {
            match LoggedController::recorded(profile, toml, &survey.run) {
                Ok(controller) => {
                    again.controller = Controller::Planar { controller: Box::new(controller), next: 0 };
                }
                Err(error) => again.give_up(error.to_string()),
            }
        }
        again
    }

    /// Starts the flight computer.
    pub(crate) fn let_go(&mut self, survey: &Survey, start: &PilotStart) {
        let Some(mission_toml) = &survey.profile_toml else {
            return self.give_up("the log has no mission to build the flight computer from".to_owned());
        };
        match LoggedPilot::recorded(mission_toml, start, &survey.run, &[]) {
            Ok(pilot) => {
                let (plans, order) = (NewPlans::default(), FrameOrder::default());
                self.controller = Controller::Pilot { pilot: Box::new(pilot), plans, order };
            }
            Err(error) => self.give_up(error.to_string()),
        }
    }

    /// Runs a tick of a planar landing again.
    pub(crate) fn tick(&mut self, recorded: &ControllerTick) -> Option<ControllerTick> {
        let Controller::Planar { controller, next } = &mut self.controller else { return None };
        let number = recorded.input.tick;
        if number != *next {
            let reason = format!("tick {number} comes where tick {next} should");
            self.give_up(reason);
            return None;
        }
        *next += 1;
        match controller.run_again(recorded) {
            Ok(again) => {
                self.compare(number, again.encode_to_vec() == recorded.encode_to_vec());
                Some(again)
            }
            Err(error) => {
                self.give_up(error.to_string());
                None
            }
        }
    }

    /// Runs a frame of a flight computer again; `record` is the sequence number of its record in the channel.
    pub(crate) fn frame(&mut self, recorded: &PilotTick, record: u32) -> Option<FrameAgain> {
        let Controller::Pilot { pilot, plans, order } = &mut self.controller else { return None };
        let number = recorded.input.frame;
        if let Some(Gap { after, before }) = order.note(number, record) {
            self.give_up(format!("the frames between {after} and {before} are lost"));
            return None;
        }
        match pilot.run_again(recorded) {
            Ok(tick) => {
                let flying = pilot.pilot();
                let plan = plans.made(flying, tick.output.level).map(|(states, step_s)| {
                    let path_m = path_in_world_m(flying, states, step_s);
                    let narrowed = path_m.into_iter().map(|place| place.map(|value| value as f32)).collect();
                    (narrowed, flying.report().iterations)
                });
                self.compare(number, tick.encode_to_vec() == recorded.encode_to_vec());
                Some(FrameAgain { tick, plan })
            }
            Err(error) => {
                self.give_up(error.to_string());
                None
            }
        }
    }

    /// The result in words; `None` if there was nothing to run again.
    pub(crate) fn words(&self) -> Option<String> {
        let Self { ticks, identical, obstacle, .. } = self;
        let ended =
            obstacle.as_ref().map(|reason| format!("; not run to the end: {reason}")).unwrap_or_default();
        (*ticks > 0 || obstacle.is_some()).then(|| {
            format!("run again by this build, {identical} of {ticks} ticks are identical bit for bit{ended}")
        })
    }

    fn compare(&mut self, tick: u64, identical: bool) {
        self.ticks += 1;
        self.identical += u64::from(identical);
        if !identical {
            self.first_different.get_or_insert(tick);
        }
    }

    fn give_up(&mut self, reason: String) {
        self.controller = Controller::None;
        self.obstacle.get_or_insert(reason);
    }
}
