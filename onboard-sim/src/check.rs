//! Predicts before construction whether the vehicle of a mission will land, and what to change if
//! not: one page of rows, each with a value of the mission's data beside its requirement.
//!
//! All but the last row are formulas on the expected motor in still air or in a steady wind. The
//! last one flies.

use core::fmt;

use flight::control::fins::Allocation;
use flight::guidance::descent::{LEAST_AIRSPEED_M_S, SHORT_FALL_M_S};
use flight::guidance::ignition::IgnitionSettings;
use flight::guidance::vertical::{Column, EvenLanding};
use flight::vehicle::airframe::{Airframe, MassModel, MassProperties};
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::burn::Burn;
use flight::vehicle::fins::{PITCH, YAW};
use flight::vehicle::mission::{Mission, SensorPlaces};
use flight::vehicle::thrust_curve::ThrustCurve;
use flight::vehicles::motors;
use serde::Serialize;
use serde_json::{Value, json};
use sim::dispersion::is_more_benign;
use sim::recipe::Recipe;

use crate::frame::{Frame, FrameError, changed};
use crate::row::Row as Flown;
use crate::run::{RunError, fly};
use crate::statistics::Landings;
use crate::summary::failures;

flight::numbered_enum! {
/// An answer, from the best to the worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    Ok = "ok",
    Tight = "tight",
    No = "no",
}
}

/// Thresholds of a value: below the first number the answer is no, below the second tight.
#[derive(Clone, Copy)]
struct Least(f64, f64);

impl Least {
    fn judge(self, value: f64) -> Verdict {
        match value {
            value if value < self.0 => Verdict::No,
            // Not a number is no good answer.
            value if value >= self.1 => Verdict::Ok,
            _ => Verdict::Tight,
        }
    }
}

/// Thrust over weight in the first 0.3 s. The fall gains speed below 1; `vlr-f15` lands with 0.76.
const AT_FIRST: Least = Least(0.5, 1.0);
/// Mean thrust over weight while the thrust exceeds the weight.
const CARRIED: Least = Least(1.1, 1.3);
/// Thrust over weight [`ENDS_S`] before the thrust falls through the weight, as a limit from above:
/// an abrupt end leaves no time to correct. `mk3` has 1.2, `vlr-f15` 1.3, and of drawn vehicles
/// with 2.3 a third stood.
const AT_LAST: Least = Least(-2.15, -1.35);
const ENDS_S: f64 = 0.3;
/// Lean that lands the expected motor, degrees: with less a weak motor does not stop it.
/// [`EvenLanding::MOST_TILT_RAD`] is the most.
const LEAN_DEG: Least = Least(0.0, 15.0);
/// Width of the heights that suit every motor, over the range covered by two deviations of the
/// igniter to either side. Below zero no height suits all.
const BAND: Least = Least(-0.3, 1.0);
/// Angular acceleration at the gimbal's stop over the immediately required one. With 0.6 nine of
/// ten drawn vehicles still stood.
const GIMBAL: Least = Least(0.3, 1.5);
/// The same over the requirement of the motor's direction alone: eight tenths of a degree, of which
/// five degrees are six times as much.
const STEERED: Least = Least(1.0, 6.4);
/// Angular acceleration by a side wind of a vehicle whose fins do not steer, degrees/s2, as a limit
/// from above. With 80 to 200 half of the drawn vehicles ended under the parachute, with 13 or less
/// none.
const TURNED_DEG_S2: Least = Least(f64::NEG_INFINITY, -40.0);
/// Moment of the fins over that which holds their largest lean. With less they lean less.
const FINS: Least = Least(0.0, 1.0);
/// Distance that fall and burn can make good over the drift. With less it lands beside the pad.
const REACH: Least = Least(0.0, 1.0);
/// Vertical speed that the legs take, m/s. Legs with blocks are designed for 1.5.
const LEGS_M_S: Least = Least(EXPECTED_M_S, 2.0);
const EXPECTED_M_S: f64 = 1.5;
/// Tilt about two feet from which it falls over, degrees.
const FEET_DEG: Least = Least(15.0, 25.0);
/// Speed under the canopy, m/s, as a limit from above.
const CANOPY_M_S: Least = Least(-12.0, -8.0);
/// Time before the ignition at which the parachute must be decided, s, as a limit from above: a
/// later fault has no parachute.
const DECIDED_S: Least = Least(f64::NEG_INFINITY, -0.5);
/// Radius of the fence over the farthest possible touchdown.
const FENCE: Least = Least(0.25, 1.0);
/// Share of the flights that stand undamaged.
const FLIGHTS: Least = Least(0.5, 0.9);

/// A deviation of one igniter's delay, as in the set of dispersions `field`, s.
const IGNITER_S: f64 = 0.05;
/// Two deviations of the thrust's direction in that set, degrees.
const MISALIGNED_DEG: f64 = 0.8;
/// A side wind at the ignition, m/s, and the wind in which a fall drifts.
const SIDE_WIND_M_S: f64 = 8.0;
const WIND_M_S: f64 = 5.0;
/// Masses are tried in these steps, kg, up to this share of the mass more or less.
const STEP_KG: f64 = 0.05;
const MOST_SHARE: f64 = 0.4;
/// Motors that are proposed.
const PROPOSED: usize = 2;

/// One question with its answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    pub what: &'static str,
    /// Value of the data.
    pub found: String,
    /// Requirement.
    pub beside: String,
    pub verdict: Verdict,
    /// Change that would improve it, if it is not ok.
    pub change: Option<String>,
}

impl Row {
    fn new(what: &'static str, verdict: Verdict, found: String, beside: String) -> Self {
        Self { what, found, beside, verdict, change: None }
    }

    /// Adds the change to make if it is not ok.
    fn or(self, change: impl FnOnce() -> String) -> Self {
        let change = (self.verdict > Verdict::Ok).then(change);
        Self { change, ..self }
    }
}

/// The page.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    pub title: String,
    pub rows: Vec<Row>,
}

impl Page {
    /// The page as JSON.
    pub fn json(&self) -> Value {
        json!({ "title": self.title, "verdict": self.verdict(), "rows": self.rows })
    }

    /// The worst answer.
    pub fn verdict(&self) -> Verdict {
        worst(&self.rows)
    }
}

impl fmt::Display for Page {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}", self.title)?;
        for Row { what, found, beside, verdict, change } in &self.rows {
            let line = format!("{:<6}{what:<11}{found:<34}{beside}", verdict.name());
            writeln!(out, "{}", line.trim_end())?;
            change.iter().try_for_each(|change| writeln!(out, "{:<17}-> {change}", ""))?;
        }
        writeln!(out, "{}", self.verdict().name())
    }
}

fn worst(rows: &[Row]) -> Verdict {
    rows.iter().map(|row| row.verdict).max().unwrap_or(Verdict::Ok)
}

/// A motor to propose.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Value of a mission's `airframe.motor`: the name of a built-in motor, or the text of its
    /// file.
    pub motor: String,
    pub curve: ThrustCurve,
    /// Still in production, according to its file.
    pub in_production: bool,
}

/// The built-in motors.
pub fn built_in() -> Vec<Candidate> {
    let found = motors::names().filter_map(|name| {
        let in_production = motors::status(name).is_none_or(|(in_production, _)| in_production);
        Some(Candidate { motor: name.to_owned(), curve: motors::builtin(name).ok()?, in_production })
    });
    found.collect()
}

/// A row that names the sensors without a station; `None` if each has one.
fn without_place(places: &SensorPlaces) -> Option<Row> {
    let stations = [
        ("imu", places.imu_station_m),
        ("gnss", places.gnss_station_m),
        ("barometer", places.barometer_station_m),
        ("lidar", places.lidar_station_m),
    ];
    let missing = stations.into_iter().filter(|(_, station_m)| station_m.is_none());
    let keys = missing.map(|(sensor, _)| format!("{sensor}_station_m")).collect::<Vec<_>>().join(", ");
    let beside = "a station in [sensors]; without, at the centre of gravity".to_owned();
    (!keys.is_empty()).then(|| Row::new("sensors", Verdict::Tight, format!("no {keys}"), beside))
}

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    #[error(transparent)]
    Frame(#[from] FrameError),
    #[error(transparent)]
    Fly(#[from] RunError),
}

/// The page of a recipe's mission. Other motors are proposed of `motors`. So many flights of the
/// recipe are flown; without any their row is left out. `done` gets how many are flown.
///
/// # Errors
/// The motor cannot be taken out of the airframe, or a flight cannot be set up.
pub fn check(
    recipe: &Recipe,
    motors: &[Candidate],
    flights: u64,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Page, CheckError> {
    let vehicle = Vehicle::of(&recipe.mission);
    let mut rows = vehicle.lands();
    let verdict = worst(&rows);
    if let Some(row) = rows.iter_mut().find(|row| row.verdict == verdict && verdict > Verdict::Ok) {
        row.change = Some(proposal(recipe, motors, verdict)?);
    }
    rows.extend(vehicle.stands());
    rows.extend(without_place(&recipe.mission.sensors));
    rows.extend(crate::field::crowd(recipe));
    if flights > 0 {
        rows.push(flown(recipe, &fly(recipe, 0..flights, done)?));
    }
    let Mission { name, site, airframe, motor_curve, .. } = &recipe.mission;
    let EvenLanding { height_m, speed_m_s, .. } = vehicle.landing;
    let title = format!(
        "{name}: {:.3} kg on {}, ignition at about {height_m:.0} m and {speed_m_s:.0} m/s\nSite: {site}\nWind: {}",
        airframe.mass.loaded_kg,
        motor_curve.name(),
        recipe.dispersion.wind_over_height()
    );
    Ok(Page { title, rows })
}

/// The nearest mass and some motors that make the landing better than `than`.
fn proposal(recipe: &Recipe, motors: &[Candidate], than: Verdict) -> Result<String, FrameError> {
    let Mission { airframe, motor_curve, .. } = &recipe.mission;
    let frame = Frame::of(&recipe.mission)?;
    let with = |motor: &str, curve, ballast_kg: f64| {
        // A vehicle that the reader refuses is skipped.
        let other = changed(recipe, motor, &frame.with(curve, ballast_kg)).ok()?;
        Some(worst(&Vehicle::of(&other.mission).lands())).filter(|verdict| *verdict < than)
    };
    let steps = (MOST_SHARE * airframe.mass.loaded_kg / STEP_KG) as i32;
    let masses_kg = (1..=steps).flat_map(|step| [-step, step]).map(|step| f64::from(step) * STEP_KG);
    let mass = masses_kg.into_iter().find(|kg| with(&airframe.motor, motor_curve, *kg).is_some());
    let mass = mass.map(|kg| format!("{:.2} kg {}", kg.abs(), if kg < 0.0 { "less" } else { "more" }));
    // Files round to a millimetre.
    let widest_m = motor_curve.diameter_m() + 5e-4;
    let fit =
        motors.iter().filter(|other| other.curve.diameter_m() <= widest_m && other.curve != *motor_curve);
    let fit = fit.filter_map(|other| {
        Some((!other.in_production, with(&other.motor, &other.curve, 0.0)?, other.curve.name()))
    });
    let mut fit: Vec<_> = fit.collect();
    fit.sort();
    let fit = fit.into_iter().take(PROPOSED);
    let fit =
        fit.map(|(gone, _, name)| format!("on {name}{}", if gone { ", out of production" } else { "" }));
    let found: Vec<String> = mass.into_iter().chain(fit).collect();
    if found.is_empty() {
        return Ok("no mass of it and no motor of these: another vehicle".to_owned());
    }
    Ok(found.join(", or "))
}

fn flown(recipe: &Recipe, rows: &[Flown]) -> Row {
    let stands = Landings::of(rows.iter().map(Flown::landing)).stands;
    let found = format!("{} of {} flights stand", stands.count, stands.of);
    let kinder = if is_more_benign(&recipe.dispersion_name) { "; real may be harder" } else { "" };
    let beside = format!("{}{kinder}", recipe.dispersion_name);
    Row::new("flights", FLIGHTS.judge(stands.share), found, beside).or(|| {
        let most = failures(rows).into_iter().next();
        most.map_or_else(String::new, |most| format!("mostly {}: {} flights", most.reason, most.flights))
    })
}

/// A mission's vehicle with the inputs of the rows.
struct Vehicle<'a> {
    mission: &'a Mission,
    landing: EvenLanding,
    burn: Burn<'a>,
    mass: MassModel,
    column: Column,
    /// Speed of a fall with open fins that does not end, m/s.
    terminal_m_s: f64,
}

impl<'a> Vehicle<'a> {
    fn of(mission: &'a Mission) -> Self {
        let (airframe, curve) = (&mission.airframe, &mission.motor_curve);
        let density_kg_m3 = mission.site.air_at_m(0.0).density_kg_m3;
        let column =
            Column::of_mission(mission, airframe.mass.loaded_kg, density_kg_m3, 1.0, mission.soft_tilt_deg);
        Self {
            mission,
            landing: EvenLanding::of(mission),
            burn: Burn::nominal(curve),
            mass: MassModel::new(&airframe.mass, curve.propellant_mass_kg()),
            column,
            terminal_m_s: column.terminal_speed_m_s(airframe.open_fin_drag_area_m2()),
        }
    }

    /// Whether motor and mass go together.
    fn lands(&self) -> Vec<Row> {
        vec![self.thrust(), self.spare(), self.ignition()]
    }

    /// Whether it is steered, bears its landing and has a parachute and a fence.
    fn stands(&self) -> Vec<Row> {
        let rows = [
            self.gimbal(),
            self.fins(),
            self.reach(),
            self.legs(),
            self.feet(),
            self.parachute(),
            self.fence(),
        ];
        self.inertia().into_iter().chain(rows).collect()
    }

    fn thrust(&self) -> Row {
        const FIRST_S: f64 = 0.3;
        let carried_s = self.landing.carried_s;
        let weight_n = self.mission.airframe.mass.loaded_kg * STANDARD_GRAVITY_M_S2;
        let [first, mean] = [FIRST_S, carried_s].map(|of_s| self.burn.mean_thrust_n(0.0, of_s) / weight_n);
        let last = self.burn.thrust_n(carried_s - ENDS_S) / weight_n;
        let verdict = AT_FIRST.judge(first).max(CARRIED.judge(mean)).max(AT_LAST.judge(-last));
        let found = format!("{first:.2}, {mean:.2} in {carried_s:.1} s, {last:.2} at last");
        let beside = format!("{} x weight, {}, up to {}", AT_FIRST.1, CARRIED.1, -AT_LAST.1);
        Row::new("thrust", verdict, found, beside)
    }

    fn spare(&self) -> Row {
        const WHAT: &str = "impulse";
        if let Some(misfit) = self.landing.misfit() {
            return Row::new(WHAT, Verdict::No, misfit.to_owned(), String::new());
        }
        let tilt_deg = self.landing.tilt_rad.unwrap_or_default().to_degrees();
        let found = format!("lands with {tilt_deg:.0} deg of lean");
        let beside = format!("{} to {:.0} deg", LEAN_DEG.1, EvenLanding::MOST_TILT_RAD.to_degrees());
        Row::new(WHAT, LEAN_DEG.judge(tilt_deg), found, beside)
    }

    fn ignition(&self) -> Row {
        let mission = self.mission;
        let settings = IgnitionSettings { delay_s: 0.0, fixed_height_m: None, ..mission.ignition };
        let speed_m_s = self.landing.speed_m_s;
        let heights = settings.prediction(&self.column, &mission.motor_curve, 0.0, -speed_m_s, 0.0);
        let required_m = 4.0 * IGNITER_S * mission.airframe.igniter_scatter() * speed_m_s;
        let beside = format!("{required_m:.1} m for the igniter");
        let (Some(certified), Some(nearest)) = (heights.band, heights.nearest) else {
            return Row::new("ignition", Verdict::No, "no height suits the motor".to_owned(), beside);
        };
        let (middle_m, width_m) = (0.5 * (nearest.low_m + nearest.high_m), nearest.high_m - nearest.low_m);
        let found = if width_m < 0.0 {
            format!("at {middle_m:.0} m: {:.1} m between weak and strong", -width_m)
        } else {
            format!(
                "at {middle_m:.0} m: {width_m:.1} of {:.1} m suit all",
                certified.high_m - certified.low_m
            )
        };
        Row::new("ignition", BAND.judge(width_m / required_m), found, beside)
    }

    /// Dynamic pressure at an airspeed, Pa.
    fn pressure_pa(&self, speed_m_s: f64) -> f64 {
        0.5 * self.column.air_density_kg_m3 * speed_m_s * speed_m_s
    }

    /// Moment with which the air turns the nose into the wind, N m, at an angle of attack with the
    /// fins of a drag area.
    fn air_n_m(&self, mass: &MassProperties, speed_m_s: f64, angle_rad: f64, fins_m2: f64) -> f64 {
        let airframe = &self.mission.airframe;
        let behind_m = mass.cg_station_m - 0.5 * airframe.body.length_m;
        let sin = libm::sin(angle_rad);
        let turns_m3 = airframe.restoring_m3(fins_m2, mass.cg_station_m)
            - self.column.crossflow_area_m2 * behind_m * sin;
        self.pressure_pa(speed_m_s) * turns_m3 * sin
    }

    /// Moment of a side wind at the speed of the ignition, N m, with the fins of a drag area.
    fn in_the_wind_n_m(&self, mass: &MassProperties, fins_m2: f64) -> f64 {
        let speed_m_s = self.landing.speed_m_s;
        let [through_m_s, side_rad] =
            [libm::hypot(speed_m_s, SIDE_WIND_M_S), libm::atan2(SIDE_WIND_M_S, speed_m_s)];
        self.air_n_m(mass, through_m_s, side_rad, fins_m2).abs()
    }

    fn gimbal(&self) -> Row {
        let airframe = &self.mission.airframe;
        let middle_s = 0.5 * self.landing.carried_s;
        let mass = self.mass.at(self.burn.burnt_kg(middle_s));
        let moment_n_m = self.burn.thrust_n(middle_s) * airframe.thrust_arm_m(mass.cg_station_m);
        let half_m2 = airframe.fin_drag_area_m2(&[0.5 * airframe.fins.open_rad(); 4]);
        let [stop, motor, wind] = [
            moment_n_m * libm::sin(airframe.gimbal.limit_rad()),
            moment_n_m * libm::sin(MISALIGNED_DEG.to_radians()),
            self.in_the_wind_n_m(&mass, half_m2),
        ]
        .map(|moment_n_m| (moment_n_m / mass.pitch_inertia_kg_m2).to_degrees());
        let found = format!("turns it by {stop:.0} deg/s2");
        let beside = format!("motor {motor:.0}, wind {wind:.0} deg/s2");
        let verdict = GIMBAL.judge(stop / (motor + wind)).max(STEERED.judge(stop / motor));
        Row::new("gimbal", verdict, found, beside)
            .or(|| "a wider gimbal.limit_deg, or the weight nearer to the nose".to_owned())
    }

    fn fins(&self) -> Row {
        let (airframe, descent, mass) = (&self.mission.airframe, &self.mission.descent, self.mass.at(0.0));
        let (fins, arm_m) = (&airframe.fins, airframe.fins.station_m - mass.cg_station_m);
        if !descent.steers() {
            let found = format!("do not steer: {arm_m:.2} m of arm");
            if self.landing.speed_m_s > SHORT_FALL_M_S {
                let beside = "they do not hold it upright".to_owned();
                return Row::new("fins", Verdict::Tight, found, beside)
                    .or(|| "hinges near the nose, or let go lower".to_owned());
            }
            let fins_m2 = airframe.open_fin_drag_area_m2();
            let turned_deg_s2 =
                (self.in_the_wind_n_m(&mass, fins_m2) / mass.pitch_inertia_kg_m2).to_degrees();
            let beside = format!("wind turns it by {turned_deg_s2:.0} deg/s2");
            return Row::new("fins", TURNED_DEG_S2.judge(-turned_deg_s2), found, beside)
                .or(|| "the centre of gravity in the middle of the body".to_owned());
        }
        if !descent.opens_fins {
            let found = format!("stay closed: {:.0} m/s are too slow", self.landing.speed_m_s);
            return Row::new("fins", Verdict::Tight, found, "nothing holds it upright".to_owned())
                .or(|| "let go higher, or hinges at the centre of gravity".to_owned());
        }
        let (min_rad, max_rad) = (fins.control_min_rad(), fins.open_rad());
        let allocation = Allocation { model: airframe.fin_model(), arm_m, min_rad, max_rad };
        let pressure_pa = self.pressure_pa(self.terminal_m_s);
        let opened = |pattern: [f64; 4]| pattern.map(|sign| if sign > 0.0 { max_rad } else { min_rad });
        let most_n_m = f64::min(
            allocation.moments_n_m(pressure_pa, opened(PITCH)).y.abs(),
            allocation.moments_n_m(pressure_pa, opened(YAW)).z.abs(),
        );
        let lean_deg = descent.lean_max_deg;
        let fins_m2 = airframe.fin_drag_area_m2(&opened(PITCH));
        let required_n_m = self.air_n_m(&mass, self.terminal_m_s, lean_deg.to_radians(), fins_m2).abs();
        let found = format!("{most_n_m:.1} N m at {:.0} m/s", self.terminal_m_s);
        let beside = format!("{required_n_m:.1} N m for {lean_deg:.0} deg of lean");
        Row::new("fins", FINS.judge(most_n_m / required_n_m), found, beside)
            .or(|| "longer fins, or hinges nearer to the nose".to_owned())
    }

    /// Time of a fall from rest with open fins to a speed, s: `V_t tanh(g t / V_t)` is the speed
    /// after `t`.
    fn falls_s(&self, speed_m_s: f64) -> f64 {
        let share = (speed_m_s / self.terminal_m_s).min(1.0 - 1e-9);
        self.terminal_m_s / STANDARD_GRAVITY_M_S2 * libm::atanh(share)
    }

    fn reach(&self) -> Row {
        let EvenLanding { carried_s, speed_m_s, .. } = self.landing;
        let falls_s = self.falls_s(speed_m_s);
        let burn_m = self.mission.powered.homing.reach_m_s2 * carried_s * carried_s;
        let steered_s = falls_s - self.falls_s(LEAST_AIRSPEED_M_S);
        let fall_m = if self.mission.descent.steers() && steered_s > 0.0 {
            // The mean of the squared speed: the integral of tanh^2 is t - tanh. A push one way and
            // back is a quarter of a t^2.
            let terminal2 = self.terminal_m_s * self.terminal_m_s;
            let gained_s = (speed_m_s - LEAST_AIRSPEED_M_S) / STANDARD_GRAVITY_M_S2;
            let pressure_pa = self.pressure_pa(libm::sqrt(terminal2 * (1.0 - gained_s / steered_s)));
            let sin = libm::sin(self.mission.descent.lean_max_deg.to_radians());
            let push_n = pressure_pa * self.column.crossflow_area_m2 * sin * sin;
            0.25 * push_n / self.column.mass_at_ignition_kg * steered_s * steered_s
        } else {
            0.0
        };
        let drift_m = WIND_M_S * falls_s;
        let found = format!("{fall_m:.0} m falling, {burn_m:.0} m burning");
        let beside = format!("drifts {drift_m:.0} m in {WIND_M_S} m/s");
        Row::new("reach", REACH.judge((fall_m + burn_m) / drift_m), found, beside)
            .or(|| "a lower start, or less wind: else it lands beside the pad".to_owned())
    }

    /// At touchdown.
    fn landed(&self) -> MassProperties {
        self.mass.at(self.burn.burnt_kg(self.landing.carried_s))
    }

    fn legs(&self) -> Row {
        let (legs, mass_kg) = (&self.mission.airframe.legs, self.landed().mass_kg);
        let beside = format!("expected up to {EXPECTED_M_S} m/s");
        let Some(crush) = legs.crush else {
            let limit_m_s = self.mission.leg_limits.vertical_m_s;
            let verdict = LEGS_M_S.judge(limit_m_s).min(Verdict::Tight);
            return Row::new("legs", verdict, format!("no blocks: {limit_m_s} m/s"), beside)
                .or(|| "a block that crushes in each leg: [airframe.legs.crush]".to_owned());
        };
        let upwards_n = 4.0 * crush.force_n - mass_kg * STANDARD_GRAVITY_M_S2;
        let speed_m_s = libm::sqrt((2.0 * upwards_n * crush.stroke_m / mass_kg).max(0.0));
        let stroke_mm = 1e3 * 0.5 * mass_kg * LEGS_M_S.1 * LEGS_M_S.1 / upwards_n;
        let found = format!("{speed_m_s:.1} m/s into the blocks");
        Row::new("legs", LEGS_M_S.judge(speed_m_s), found, beside).or(|| {
            if upwards_n > 0.0 && stroke_mm < -1e3 * legs.foot_station_m {
                format!("a stroke of {stroke_mm:.0} mm, or a larger crush.force_n")
            } else {
                "a larger crush.force_n".to_owned()
            }
        })
    }

    fn feet(&self) -> Row {
        let (airframe, mass) = (&self.mission.airframe, self.landed());
        let height_m = airframe.above_feet_m(mass.cg_station_m);
        // Between two of the four.
        let across_m = airframe.legs.foot_radius_m * core::f64::consts::FRAC_1_SQRT_2;
        let tips_deg = libm::atan2(across_m, height_m).to_degrees();
        let found = format!("falls over at {tips_deg:.0} deg");
        Row::new("feet", FEET_DEG.judge(tips_deg), found, format!("{} deg or more", FEET_DEG.1)).or(|| {
            let radius_m = height_m * libm::tan(FEET_DEG.1.to_radians()) / core::f64::consts::FRAC_1_SQRT_2;
            format!("feet {radius_m:.2} m from the axis")
        })
    }

    /// A row only if an inertia is not that of such a vehicle: one in another unit makes a vehicle
    /// that tumbles.
    fn inertia(&self) -> Option<Row> {
        let Airframe { mass, body, legs, .. } = &self.mission.airframe;
        let gyration_m = |inertia_kg_m2: f64| libm::sqrt(inertia_kg_m2 / mass.loaded_kg);
        let [pitch_m, roll_m] = [mass.loaded_pitch_inertia_kg_m2, mass.roll_inertia_kg_m2].map(gyration_m);
        // A rod has 0.29 of its length, the built-in vehicles 0.27 to 0.31; a tube has its radius,
        // and legs reach their feet.
        let is_such = (0.15..0.45).contains(&(pitch_m / body.length_m))
            && (0.3 * body.diameter_m..0.6 * legs.foot_radius_m).contains(&roll_m);
        let found = format!("radii of {:.0} and {:.0} mm", 1e3 * pitch_m, 1e3 * roll_m);
        let row = Row::new("inertia", Verdict::No, found, "of gyration, pitch and roll".to_owned());
        (!is_such).then(|| row.or(|| "measure it again, in kg m2".to_owned()))
    }

    /// Speed under the canopy, m/s, with an unignited motor.
    fn canopy_m_s(&self, area_m2: f64) -> f64 {
        let lift_kg_m =
            0.5 * self.column.air_density_kg_m3 * self.mission.airframe.parachute.drag_coefficient * area_m2;
        libm::sqrt(self.column.mass_at_ignition_kg * STANDARD_GRAVITY_M_S2 / lift_kg_m)
    }

    fn parachute(&self) -> Row {
        let parachute = &self.mission.airframe.parachute;
        let EvenLanding { speed_m_s, height_m, .. } = self.landing;
        let canopy_m_s = self.canopy_m_s(parachute.area_m2);
        let opens_m = speed_m_s * parachute.ejection_delay_s + parachute.inflation_distance_m;
        let [slow, decided] =
            [CANOPY_M_S.judge(-canopy_m_s), DECIDED_S.judge((height_m - opens_m) / speed_m_s)];
        let found = format!("{canopy_m_s:.1} m/s, opens in {opens_m:.0} m");
        let beside = format!("{} m/s, ignition at {height_m:.0} m", -CANOPY_M_S.1);
        Row::new("parachute", slow.max(decided), found, beside).or(|| {
            let larger_m2 = parachute.area_m2 * canopy_m_s * canopy_m_s / (CANOPY_M_S.1 * CANOPY_M_S.1);
            if slow > Verdict::Ok {
                format!("a canopy of {larger_m2:.2} m2")
            } else {
                format!("a shorter ejection delay: below {opens_m:.0} m there is no parachute")
            }
        })
    }

    fn fence(&self) -> Row {
        let EvenLanding { speed_m_s, height_m, .. } = self.landing;
        // The rest of the fall, as fast as at the ignition.
        let fall_m = WIND_M_S * (self.falls_s(speed_m_s) + height_m / speed_m_s);
        let hangs_m = WIND_M_S * height_m / self.canopy_m_s(self.mission.airframe.parachute.area_m2);
        let (bound_m, how) = if fall_m > hangs_m { (fall_m, "falling") } else { (hangs_m, "hanging") };
        let fence_m = self.mission.gate.fence_radius_m;
        let beside = format!("{bound_m:.0} m, {how} in {WIND_M_S} m/s");
        Row::new("fence", FENCE.judge(fence_m / bound_m), format!("{fence_m:.0} m"), beside)
            .or(|| format!("gate.fence_radius_m of {:.0} m, or a lower start", libm::ceil(bound_m)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row_of(name: &str, change: impl FnOnce(&mut Mission), what: &str) -> Row {
        let mut mission = flight::vehicles::mission::builtin(name).unwrap().unwrap();
        change(&mut mission);
        Vehicle::of(&mission).stands().into_iter().find(|row| row.what == what).unwrap()
    }

    /// In kg cm2, in g m2, and as it is.
    #[test]
    fn an_inertia_in_another_unit_is_found() {
        for (scale, wrong) in [(1e4, true), (1e3, true), (1.0, false), (1e-3, true)] {
            let mut mission = flight::vehicles::mission::builtin("mk3").unwrap().unwrap();
            mission.airframe.mass.roll_inertia_kg_m2 *= scale;
            assert_eq!(Vehicle::of(&mission).inertia().is_some(), wrong, "roll {scale}");
            mission = flight::vehicles::mission::builtin("mk3").unwrap().unwrap();
            mission.airframe.mass.loaded_pitch_inertia_kg_m2 *= scale;
            assert_eq!(Vehicle::of(&mission).inertia().is_some(), wrong, "pitch {scale}");
        }
    }

    /// 4 x 90 N over 0.06 m, less 3.5 kg of weight: (360 - 34) 0.06 / (0.5 x 3.5) = 11.2 m2/s2.
    /// The canopy of 2.05 m2 carries 3.7 kg at
    /// sqrt(2 x 3.7 x 9.80665 / (1.153 x 0.8 x 2.05)) = 6.2 m/s in the air of Mojave, 1.153 kg/m3.
    #[test]
    fn val_hand_legs_and_parachute_of_mk3() {
        let legs = row_of("mk3", |_| {}, "legs");
        assert_eq!((legs.found.as_str(), legs.verdict), ("3.3 m/s into the blocks", Verdict::Ok));
        let parachute = row_of("mk3", |_| {}, "parachute");
        assert!(parachute.found.starts_with("6.2 m/s, "), "{parachute:?}");
    }

    /// Feet at 0.4 m are 0.283 m from the axis between two of them; as high is 45 degrees.
    #[test]
    fn val_hand_feet_fall_over_where_the_weight_stands_above_the_line_between_two() {
        let feet = |radius_m: f64| {
            let change = |mission: &mut Mission| mission.airframe.legs.foot_radius_m = radius_m;
            row_of("mk2", change, "feet")
        };
        let narrow = feet(0.1);
        assert_eq!(narrow.verdict, Verdict::No);
        let words = narrow.change.unwrap();
        let required_m: f64 = words.split(' ').nth(1).unwrap().parse().unwrap();
        assert!(
            feet(required_m - 0.02).verdict == Verdict::Tight
                && feet(required_m + 0.01).verdict == Verdict::Ok,
            "{words}"
        );
    }

    /// The proposed change meets the requirement of the legs.
    #[test]
    fn legs_that_fail_are_reported_with_the_stroke_that_would_do() {
        let legs = |force_n: f64, stroke_m: f64| {
            let change = |mission: &mut Mission| {
                let crush = mission.airframe.legs.crush.as_mut().unwrap();
                (crush.force_n, crush.stroke_m) = (force_n, stroke_m);
            };
            row_of("mk3", change, "legs")
        };
        let weak = legs(10.0, 0.06);
        assert_eq!(weak.verdict, Verdict::No);
        assert!(weak.change.unwrap().contains("crush.force_n"));
        let short = legs(90.0, 0.01);
        assert_eq!(short.verdict, Verdict::No);
        let stroke_mm: f64 = short.change.unwrap().split(' ').nth(3).unwrap().parse().unwrap();
        assert_eq!(legs(90.0, 1e-3 * (stroke_mm + 0.5)).verdict, Verdict::Ok);
        let none = row_of("mk3", |mission| mission.airframe.legs.crush = None, "legs");
        assert!(none.verdict == Verdict::Tight && none.change.unwrap().contains("[airframe.legs.crush]"));
    }

    #[test]
    fn a_fence_inside_of_which_it_may_not_come_down_is_not_ok() {
        let fence = row_of("mk3", |mission| mission.gate.fence_radius_m = 20.0, "fence");
        assert!(fence.verdict > Verdict::Ok && fence.change.unwrap().contains("fence_radius_m of "));
    }

    #[test]
    fn fins_without_an_arm_are_no_fault() {
        let fins = row_of("vlr", |_| {}, "fins");
        assert!(fins.verdict == Verdict::Ok && fins.found.starts_with("do not steer"), "{fins:?}");
    }

    #[test]
    fn what_is_no_number_is_not_ok() {
        assert_eq!(
            [f64::NAN, 0.0, 1.0, 2.0].map(|value| Least(1.0, 2.0).judge(value)),
            [Verdict::Tight, Verdict::No, Verdict::Tight, Verdict::Ok]
        );
    }
}
