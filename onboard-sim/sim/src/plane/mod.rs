//! One flight of the landing paper's planar vehicle: its plant, its random differences and the verdict on its landing.

pub mod draw;
pub mod plant;

use flight::computer::plane::{Plane, PlaneError, PlaneSensed};
use flight::computer::{Commands, Computer, Feeling, Input};
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::profile::Profile;

use self::draw::Draw;
use self::plant::{Impact, Plant};
use crate::outside::{Flown, Outside, Watch};

/// Whether a late output of the landing controller is applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DeadlinePolicy {
    /// Simulated time waits: the output is applied, and the miss is counted.
    #[default]
    Observe,
    /// As in hardware: a late output is dropped, and the previous plan's next command is applied instead.
    Enforce,
}

/// One flight of the planar vehicle. A clone continues with exactly the same bits.
#[derive(Debug, Clone)]
pub struct PlanarFlight {
    computer: Computer,
    plant: Plant,
    drawn: Draw,
    policy: DeadlinePolicy,
    frame: u64,
    /// Nothing has been decided yet: the first frame is decided at the start itself, before the plant moves.
    at_the_beginning: bool,
    lit: bool,
    /// The last tick came too late to be applied.
    late: bool,
    impacts: Vec<Impact>,
    limits: TouchdownLimits,
}

impl PlanarFlight {
    /// The vehicle in its rig at power-up.
    ///
    /// # Errors
    /// The profile asks for something that this simulation does not have.
    pub fn new(profile: &Profile, drawn: Draw, policy: DeadlinePolicy) -> Result<Self, PlaneError> {
        let computer = Computer::in_plane(profile, drawn.release)?;
        Ok(Self {
            computer,
            plant: Plant::new(profile, &drawn),
            drawn,
            policy,
            frame: 0,
            at_the_beginning: true,
            lit: false,
            late: false,
            impacts: Vec::new(),
            limits: TouchdownLimits::from_profile(profile),
        })
    }

    /// Continues a recorded landing from one moment, with the computer and the plant of that moment.
    pub fn at_moment(computer: Computer, plant: Plant, drawn: Draw, limits: TouchdownLimits) -> Self {
        Self {
            frame: computer.frame(),
            at_the_beginning: true,
            lit: computer.mode().phase.in_landing_burn(),
            computer,
            plant,
            drawn,
            policy: DeadlinePolicy::Observe,
            late: false,
            impacts: Vec::new(),
            limits,
        }
    }

    /// Changes the landing controller's profile from now on.
    pub fn reconfigure_controller(&mut self, profile: &Profile) {
        self.computer.reconfigure_controller(profile);
    }

    /// Flies one frame. In the first frame the computer decides before the plant moves.
    pub fn step_with(&mut self, outside: &Outside<'_>, watch: &mut dyn Watch) -> Flown {
        if !std::mem::take(&mut self.at_the_beginning) {
            for _ in 0..self.plane().frame_ms() {
                self.impacts.extend(self.plant.step());
            }
            self.frame += 1;
        }
        self.decide(outside, watch)
    }

    fn decide(&mut self, outside: &Outside<'_>, watch: &mut dyn Watch) -> Flown {
        let input = Input {
            frame: self.frame,
            time_s: self.time_s(),
            feeling: Feeling::InPlane(self.felt()),
            gimbal_rad: [self.plant.gimbal_rad().1, 0.0],
            fins_rad: self.plant.fins_rad().1,
            contact: self.plant.in_contact(),
            igniter_continuity: !self.lit,
            booster_attached: false,
            pin_out: outside.pin_out,
            battery_v: None,
            log: outside.log,
            uplink: outside.uplink,
            commander: outside.commander,
            people: outside.people,
            requests: outside.requests,
            rehearsed: None,
            late: self.late,
        };
        let began = watch.now();
        let output = self.computer.step(&input);
        let took = watch.now().saturating_sub(began);
        watch.decided(&input, &output, &self.computer);
        if output.tick.is_some() {
            self.late = self.policy == DeadlinePolicy::Enforce && took.as_secs_f64() > self.deadline_s();
        }
        self.command(&output.commands);
        if output.released {
            self.plant.release(self.drawn.release);
        }
        Flown { output: Some(output), took }
    }

    fn command(&mut self, commands: &Commands) {
        self.plant.command(commands.gimbal_rad[0], commands.fins_rad);
        if commands.ignite {
            self.lit = true;
            self.plant.ignite();
        }
    }

    fn felt(&self) -> PlaneSensed {
        PlaneSensed {
            state: self.plant.state(),
            axial_specific_force_m_s2: self.plant.axial_specific_force_m_s2(),
            gimbal_rad: self.plant.gimbal_rad().1,
            thrust_n: self.plant.thrust_n(),
            thrust_below_weight: self.plant.thrust_below_weight(),
        }
    }

    /// Moves the vehicle to another state in the air.
    pub fn place(&mut self, state: PlanarState) {
        self.plant.release(state);
    }

    /// Vehicle time, s. It is a product, not a sum, so rounding errors do not add up.
    pub fn time_s(&self) -> f64 {
        self.frame as f64 * self.frame_s()
    }

    /// Length of a frame, s.
    pub fn frame_s(&self) -> f64 {
        self.plane().frame_s()
    }

    /// How long a tick may take, s.
    pub fn deadline_s(&self) -> f64 {
        self.plane().profile().nmpc.sample_time_s
    }

    /// The last tick came too late to be applied.
    pub fn was_late(&self) -> bool {
        self.late
    }

    /// The flight computer.
    pub fn computer(&self) -> &Computer {
        &self.computer
    }

    /// The planar vehicle's part of the flight computer.
    ///
    /// # Panics
    /// Never: the computer of a planar flight has one.
    pub fn plane(&self) -> &Plane {
        self.computer.plane().unwrap_or_else(|| unreachable!("the computer of the planar vehicle"))
    }

    /// The true vehicle.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The drawn differences.
    pub fn drawn(&self) -> &Draw {
        &self.drawn
    }

    /// Every contact with the ground so far.
    pub fn impacts(&self) -> &[Impact] {
        &self.impacts
    }

    /// The verdict on the worst contact; `None` without a contact. A soft contact after a bounce does not replace a
    /// hard one.
    pub fn judge(&self) -> Option<(Impact, LandingVerdict)> {
        let judged = |impact: &Impact| (*impact, LandingVerdict::judge(&self.limits, &impact.state));
        let mut all = self.impacts.iter().map(judged);
        let first = all.next()?;
        let hard = if first.1.landed() { all.find(|(_, verdict)| !verdict.landed()) } else { None };
        Some(hard.unwrap_or(first))
    }
}
