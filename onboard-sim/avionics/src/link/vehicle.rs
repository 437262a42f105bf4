//! A vehicle as seen by its links: its flight computer with its stored input, and additional data.

use alloc::string::String;

use flight::computer::findings::Findings;
use flight::computer::pilot::{touchdown_from_below_m, touchdown_m};
use flight::computer::{Computer, SensedInput};
use flight::estimation::estimator::Estimate;
use flight::guidance::powered::{ControlLevel, Plan, PoweredReport};
use flight::rules::operator::Operator;
use flight::rules::phase::{Mode, Phase};
use flight::rules::verdict::{Landing, LandingVerdict, Limits, Touchdown};
use flight::vehicle::airframe::MassModel;
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::burn::Burn;
use flight::vehicle::mission::{Mission, StartPoint};
use flight::vehicle::rigid::RigidState;
use flight::vehicle::site::Site;
use nalgebra::{Quaternion, UnitQuaternion, Vector2, Vector3};
use protocol::mission::MissionHash;
use protocol::motion::Degrees;

/// Largest descent rate under an open parachute, m/s (canopies are sized for 6, an open fall is 20
/// to 40), and smallest specific force as a share of the weight: right after apogee the fall is
/// slow, too, but free.
const CARRIED_M_S: f64 = 10.0;
const CARRIED_WEIGHTS: f64 = 0.5;

/// Whether something real can light and move. A station acts by itself only on a simulated vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VehicleKind {
    Real,
    Simulated,
}

/// Identity of the vehicle, and its power-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    pub kind: VehicleKind,
    pub boot_number: u32,
    /// A random number of the vehicle, the same after each power-up; 0: not reported.
    pub uid: u16,
}

flight::with_defaults! {
    /// Which mission or profile a vehicle flies.
    #[derive(Debug, Clone, PartialEq, Eq)]
    pub struct MissionName {
        pub name: String = String::new(),
        pub hash: MissionHash = MissionHash::of(""),
        /// Where the flight begins, which the hash leaves out.
        pub start: Option<StartPoint> = None,
        /// Burns that confirm the curve of its motor.
        pub motor_burns: u8 = 0,
    }
}

impl MissionName {
    /// Of a mission that was read from this text.
    pub fn of(name: &str, text: &str, mission: &Mission) -> Self {
        Self {
            name: name.into(),
            hash: MissionHash::of(text),
            start: Some(mission.start.at),
            motor_burns: u8::try_from(mission.motor_burns()).unwrap_or(u8::MAX),
        }
    }
}

/// The pad of a mission on the Earth.
pub fn pad_of(mission: &Mission) -> Degrees {
    let Site { latitude_deg: latitude, longitude_deg: longitude, .. } = mission.site;
    Degrees { latitude, longitude }
}

/// The flight computer's pack, and the voltage of the other one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatteryFacts {
    pub volts: f64,
    /// Of the pack of servos and igniters, V; `None` where it is not measured.
    pub servo_volts: Option<f64>,
    /// `None` where it is not measured.
    pub current_a: Option<f64>,
    /// Remaining charge, 0 to 1; `None` if not available.
    pub left: Option<f64>,
}

/// A touchdown and its verdict, available only in a simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// The first contact, s since power-up.
    pub time_s: f64,
    /// The touchdown at the legs.
    pub touchdown: Touchdown,
    pub landing: Landing,
}

/// A vehicle's state at one instant.
#[derive(Debug, Clone, Copy)]
pub struct VehicleState<'a> {
    /// It stores the input of its last frame.
    pub computer: &'a Computer,
    /// Time since power-up, s.
    pub time_s: f64,
    pub name: &'a MissionName,
    /// Who may command; empty without operators.
    pub operators: &'a [Operator],
    /// Findings so far.
    pub findings: &'a Findings,
    /// `None` where its voltage is not measured.
    pub battery: Option<BatteryFacts>,
    /// Report of the rehearsal, if there was one.
    pub rehearsed: Option<&'a PoweredReport>,
    /// The parachute was thrown out, in this phase or before it.
    pub parachute_ejected: bool,
    /// `None` before the landing is judged, and on a real vehicle.
    pub judged: Option<Judged>,
}

impl<'a> VehicleState<'a> {
    /// Phase, latches and countdown.
    pub fn mode(&self) -> &'a Mode {
        self.computer.mode()
    }

    pub fn phase(&self) -> Phase {
        self.mode().phase
    }

    pub fn mission(&self) -> &'a Mission {
        self.computer.pilot().mission()
    }

    /// The input of the computer's last frame.
    pub fn input(&self) -> &'a SensedInput {
        self.computer.input()
    }

    /// The design envelope of the legs.
    pub fn limits(&self) -> Limits {
        Limits::from(&self.mission().leg_limits)
    }

    /// Bit k: arming check k fails now. Zero off the pad.
    pub fn checks_failed(&self) -> u32 {
        if !self.phase().on_pad() {
            return 0;
        }
        bits(self.computer.arming_checks().iter().map(|check| !check.passed))
    }

    /// The flight; `None` before the release.
    pub fn airborne(&self) -> Option<Airborne<'a>> {
        let computer = self.computer;
        let (released_at_s, flown) = computer.released_at_s().zip(computer.flown())?;
        let pilot = computer.pilot();
        let estimate = pilot.estimate()?;
        let burn = pilot.motor().burn(&self.mission().motor_curve);
        let burning_s = pilot.burning_s(flown.time_s);
        let burnt_kg = burning_s.map_or(0.0, |burning_s| burn.burnt_kg(burning_s));
        let feet_m = self.feet_below_cg_m(burnt_kg);
        Some(Airborne { released_at_s, flown, estimate, burn, burning_s, feet_m })
    }

    fn feet_below_cg_m(&self, burnt_kg: f64) -> f64 {
        let (airframe, propellant_kg) =
            (&self.mission().airframe, self.mission().motor_curve.propellant_mass_kg());
        airframe.above_feet_m(MassModel::new(&airframe.mass, propellant_kg).at(burnt_kg).cg_station_m)
    }

    /// Time since T+0, s; stops at touchdown. As in the log: since the release, which ignites the
    /// ascent motor on a pad and lets the vehicle fall elsewhere (see
    /// [`flight::computer::flight_time_s`]).
    pub fn since_zero_s(&self) -> Option<f64> {
        let touchdown = self.findings.events.of(Phase::Touchdown);
        touchdown.map(|(at_s, _)| at_s).or_else(|| Some(self.airborne()?.flown.time_s))
    }

    /// Where it is and how it moves.
    pub fn motion(&self) -> Motion {
        if let Some(air) = self.airborne() {
            return Motion::of(&air.estimate.state, air.feet_m, &air.estimate.wind_m_s);
        }
        let cg_m = self.feet_below_cg_m(0.0);
        let hanging_m = self.computer.stance().hanging_m.filter(|height_m| height_m.is_finite());
        let position_m = Vector3::z() * hanging_m.unwrap_or(cg_m);
        let estimate = RigidState { position_m, ..self.computer.estimated_on_pad() };
        Motion::of(&estimate, cg_m, &Vector2::zeros())
    }

    /// Thrust, N.
    pub fn thrust_n(&self) -> f64 {
        self.airborne().map_or(0.0, |air| air.burning_s.map_or(0.0, |burning_s| air.burn.thrust_n(burning_s)))
    }

    /// How long the last plan took, s; 0 before the first.
    pub fn solve_time_s(&self) -> f64 {
        self.computer.pilot().report().took_s
    }

    /// Level and last report of the controller.
    pub fn controller(&self) -> Option<(ControlLevel, &'a PoweredReport)> {
        match self.airborne() {
            Some(_) => Some((self.computer.level(), self.computer.pilot().report())),
            None => self.rehearsed.map(|report| (ControlLevel::Rehearsal, report)),
        }
    }

    /// The plan that is flown, seen over the ground; `None` outside the landing burn.
    pub fn planned(&self) -> Option<Planned<'a>> {
        let guidance = self.computer.pilot().powered();
        let air = self.airborne()?;
        let plan = guidance.planned().filter(|_| self.phase().in_landing_burn())?;
        Some(Planned { plan, time_to_go_s: plan.left_s(air.flown.time_s) })
    }

    /// Expected touchdown position in the world's axes, m: in the burn the end of its plan, before
    /// it under the motor, otherwise where the present velocity leads to. NaN under a parachute
    /// until it drifts with the wind.
    pub fn touchdown_m(&self, air: &Airborne<'_>) -> Vector2<f64> {
        let (place, velocity) = (&air.estimate.state.position_m, &air.estimate.state.velocity_m_s);
        if self.phase().before_apogee() {
            let awaits_chute = self.mode().interlocks.abort_latched;
            return if awaits_chute {
                Vector2::repeat(f64::NAN)
            } else {
                touchdown_from_below_m(place, velocity)
            };
        }
        if self.phase() == Phase::Chute && !self.is_carried(air) {
            return Vector2::repeat(f64::NAN);
        }
        let landing_m = match self.phase() {
            Phase::AeroDescent | Phase::LandArmed => self.computer.pilot().landing_m(),
            _ => self.planned().and_then(|planned| planned.end_m()),
        };
        landing_m.unwrap_or_else(|| touchdown_m(place, velocity, air.height_m()))
    }

    /// A parachute carries it.
    pub fn is_carried(&self, air: &Airborne<'_>) -> bool {
        let weights_sensed = air.estimate.specific_force_m_s2.norm() / STANDARD_GRAVITY_M_S2;
        air.estimate.state.velocity_m_s.z.abs() < CARRIED_M_S && weights_sensed > CARRIED_WEIGHTS
    }
}

/// A rocket in the air, or on the ground after its flight.
#[derive(Debug, Clone, Copy)]
pub struct Airborne<'a> {
    pub released_at_s: f64,
    /// The last input, its frame and time counted from the release.
    pub flown: SensedInput,
    pub estimate: &'a Estimate,
    burn: Burn<'a>,
    burning_s: Option<f64>,
    /// The feet below the centre of gravity, m.
    feet_m: f64,
}

impl Airborne<'_> {
    /// Height of the feet, m.
    pub fn height_m(&self) -> f64 {
        self.estimate.state.position_m.z - self.feet_m
    }
}

/// A plan that is flown.
#[derive(Debug, Clone, Copy)]
pub struct Planned<'a> {
    plan: &'a Plan,
    /// From now to its end, s.
    pub time_to_go_s: f64,
}

impl Planned<'_> {
    /// Its end. A plan that misses its end by no more than `landing_miss` counts as a landing: it
    /// ends on the ground.
    pub fn end(&self, landing_miss: f64) -> Touchdown {
        let end = self.plan.touchdown();
        let on_ground = end.height_m.abs() <= landing_miss;
        Touchdown { height_m: if on_ground { 0.0 } else { end.height_m }, ..end }
    }

    /// Position of its end, m.
    fn end_m(&self) -> Option<Vector2<f64>> {
        self.plan.states().last().map(|end| Vector2::new(end[0], end[1]))
    }

    /// Up to `N` points of its path, evenly spread, including both ends, and their number: north
    /// and up, m, as seen from the east, like the flown path.
    pub fn path_from_the_east<const N: usize>(&self) -> ([(f64, f64); N], usize) {
        let states = self.plan.states();
        let count = states.len().min(N);
        let mut points_m = [(0.0, 0.0); N];
        for (point, point_m) in points_m.iter_mut().enumerate().take(count) {
            let state = &states[(states.len() - 1) * point / (count - 1).max(1)];
            *point_m = (state[0], state[2]);
        }
        (points_m, count)
    }
}

/// Position, velocity, attitude and rotation, north-east-down. Body axes: x towards the nose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Turns body vectors to north-east-down: w, x, y, z.
    pub ned_from_body: [f64; 4],
    /// Rotation rate in body axes, rad/s.
    pub rate_rad_s: [f64; 3],
    /// Position from the pad, m; down is measured at the feet.
    pub position_m: [f64; 3],
    pub velocity_m_s: [f64; 3],
    /// Speed through the air, m/s.
    pub airspeed_m_s: f64,
}

impl Motion {
    /// A motion in the world's axes ([`flight::vehicle::rigid`]).
    fn of(state: &RigidState, feet_below_cg_m: f64, wind_m_s: &Vector2<f64>) -> Self {
        // Half a turn about north takes north-west-up to north-east-down.
        let half_turn = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
        let attitude = half_turn * state.world_from_body;
        let through_air: Vector3<f64> = state.velocity_m_s - wind_m_s.push(0.0);
        Self {
            ned_from_body: [attitude.w, attitude.i, attitude.j, attitude.k],
            rate_rad_s: state.rate_rad_s.into(),
            position_m: ned(&(state.position_m - Vector3::z() * feet_below_cg_m)),
            velocity_m_s: ned(&state.velocity_m_s),
            airspeed_m_s: libm::sqrt(through_air.norm_squared()),
        }
    }
}

/// A vector in the world's axes (north, west, up) as north, east, down.
fn ned(in_world: &Vector3<f64>) -> [f64; 3] {
    [in_world.x, -in_world.y, -in_world.z]
}

/// One bit per broken limit, in the verdict's order.
pub fn violations(verdict: &LandingVerdict) -> u16 {
    bits(verdict.results.iter().map(|result| !result.passed)) as u16
}

/// Flags as bits, the first in bit 0.
pub(crate) fn bits(flags: impl Iterator<Item = bool>) -> u32 {
    flags.take(32).enumerate().fold(0, |bits, (place, set)| bits | (u32::from(set) << place))
}
