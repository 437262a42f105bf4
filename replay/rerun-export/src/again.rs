//! Runs the flight computer of the log again on its recorded inputs and compares it with the record.

use prost::Message as _;
use protocol::log::computer_v1::{ComputerFrame, ComputerStart};
use replay::controller::{LoggedComputer, NewPlans, path_in_world_m};
use replay::log::{FrameOrder, Gap};

use crate::survey::Survey;

/// The flight computer being run again.
#[derive(Default)]
pub(crate) struct Again {
    running: Option<Running>,
    /// The first frame with a different result.
    pub(crate) first_different: Option<u64>,
    /// Frames run again, and how many of them were identical bit for bit.
    pub(crate) frames: u64,
    pub(crate) identical: u64,
    /// Why it was not run to the end, if so.
    pub(crate) obstacle: Option<String>,
}

struct Running {
    computer: Box<LoggedComputer>,
    plans: NewPlans,
    order: FrameOrder,
}

/// A frame of a flight computer, run again.
pub(crate) struct FrameAgain {
    pub(crate) tick: ComputerFrame,
    /// A plan made in this frame: its path, m, and the iterations it took.
    pub(crate) plan: Option<(Vec<[f32; 3]>, usize)>,
}

impl Again {
    /// Starts the flight computer.
    pub(crate) fn start(&mut self, survey: &Survey, start: &ComputerStart) {
        // A computer from power-up needs no other start.
        if start.released && self.running.is_some() {
            return;
        }
        let Some(mission_toml) = &survey.profile_toml else {
            return self.give_up("the log has no mission to build the flight computer from".to_owned());
        };
        match LoggedComputer::recorded(mission_toml, start, &survey.run, &[]) {
            Ok(computer) => {
                let (plans, order) = (NewPlans::default(), FrameOrder::default());
                self.running = Some(Running { computer: Box::new(computer), plans, order });
            }
            Err(error) => self.give_up(error.to_string()),
        }
    }

    /// Runs a frame of a flight computer again; `record` is the sequence number of its record in the channel.
    pub(crate) fn frame(&mut self, recorded: &ComputerFrame, record: u32) -> Option<FrameAgain> {
        let Running { computer, plans, order } = self.running.as_mut()?;
        let number = recorded.input.frame;
        if let Some(Gap { after, before }) = order.note(number, record) {
            self.give_up(format!("the frames between {after} and {before} are lost"));
            return None;
        }
        match computer.run_again(recorded) {
            Ok(tick) => {
                let flying = computer.pilot();
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
        let Self { frames, identical, obstacle, .. } = self;
        let ended =
            obstacle.as_ref().map(|reason| format!("; not run to the end: {reason}")).unwrap_or_default();
        (*frames > 0 || obstacle.is_some()).then(|| {
            format!(
                "run again by this build, {identical} of {frames} frames are identical bit for bit{ended}"
            )
        })
    }

    fn compare(&mut self, frame: u64, identical: bool) {
        self.frames += 1;
        self.identical += u64::from(identical);
        if !identical {
            self.first_different.get_or_insert(frame);
        }
    }

    fn give_up(&mut self, reason: String) {
        self.running = None;
        self.obstacle.get_or_insert(reason);
    }
}
