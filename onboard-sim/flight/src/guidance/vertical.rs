//! The landing burn in one dimension: the heights from which a landing can begin.
//!
//! The vehicle has no throttle, but its tilt reduces the vertical thrust and its fins add drag.
//! Both are bounded, so at every instant the deceleration lies between a soft and a hard one. A
//! landing must end with both height and sinking speed near zero. It must not end before the thrust
//! falls through the weight, or the vehicle would lift off again. For a bounded double integrator
//! the extremes are bang-bang (A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, chapter
//! 3): the highest start brakes softly first and hard later; the lowest start brakes hard first and
//! softly later, but the vehicle never rises. Constant braking lies in between. The heights from
//! which these landings begin span the band of feasible heights ([`Column::band`]). The vehicle's
//! place in the band says how hard to brake ([`Band::place`]). The last moments are flown upright,
//! so that the vehicle arrives settled.
//!
//! Tilt at high speed does not reduce the deceleration: the body lies across the air, and its own
//! drag compensates the lost thrust. The model contains that drag, `1/2 rho V^2 S_n sin^3`, so the
//! fins act as the throttle early in the burn and the tilt late in it.
#![expect(clippy::inline_always, reason = "what is to be compiled for wide vectors must be inlined there")]

use core::array::from_fn;

use ocp::{larger, smaller};
use pulp::{Arch, Simd, WithSimd};

use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::burn::Burn;
use crate::vehicle::mission::Mission;
use serde::Serialize;

/// Number of end times tried between the thrust's fall through the weight and the latest end.
const END_TIMES: usize = 4;

/// Gain of the fin opening: fraction of the fins' travel per fraction of the band.
const FIN_GAIN: f64 = 1.5;

/// The braking of the vehicle: its tilt and its fins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Braking {
    /// Tilt from the vertical, rad.
    pub tilt_rad: f64,
    /// Drag area of the fins together, `C S`, m^2.
    pub fin_drag_area_m2: f64,
}

/// The parameters of the vertical motion except the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Mass before ignition, kg.
    pub mass_at_ignition_kg: f64,
    pub air_density_kg_m3: f64,
    /// Drag area of body and legs along the axis, m^2.
    pub body_drag_area_m2: f64,
    /// The same while the motor burns, m^2.
    pub burning_body_drag_area_m2: f64,
    /// Drag area of the body across its axis, m^2.
    pub crossflow_area_m2: f64,
    /// The softest braking that is still controllable.
    pub soft: Braking,
    /// The hardest braking.
    pub hard: Braking,
    /// Vertical velocity at touchdown, m/s, up positive (so below zero).
    pub touchdown_m_s: f64,
    /// Latest touchdown after the thrust has fallen through the weight, s.
    pub latest_after_s: f64,
    /// How long before touchdown the vehicle is upright, s.
    pub settle_s: f64,
}

/// Heights from which a landing exists, m.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Band {
    /// Lowest start.
    pub low_m: f64,
    /// Highest start.
    pub high_m: f64,
}

impl Band {
    /// Place of a height in the band: 0 at its low end, 1 at its high end, other values outside.
    pub fn place(&self, height_m: f64) -> f64 {
        (height_m - self.low_m) / (self.high_m - self.low_m).max(1e-3)
    }

    /// Whether a height lies inside.
    pub fn contains(&self, height_m: f64) -> bool {
        (self.low_m..=self.high_m).contains(&height_m)
    }
}

impl Column {
    /// Heights from which a landing exists for a motor that has burnt for `burning_s` (0 for an
    /// ignition now) and a vertical velocity of `vertical_m_s` (up positive); `None` if there is no
    /// landing.
    pub fn band(&self, burn: &Burn<'_>, burning_s: f64, vertical_m_s: f64) -> Option<Band> {
        self.landings(burn, burning_s)?.band(vertical_m_s)
    }

    /// The landings on a motor that has burnt for `burning_s`, at any velocity; `None` if the
    /// thrust never carries the vehicle.
    pub fn landings(&self, burn: &Burn<'_>, burning_s: f64) -> Option<Landings> {
        let carried_until_s = burn.falls_through_weight_s(self.mass_at_ignition_kg)?;
        let soonest_s = carried_until_s.max(burning_s + 0.02);
        let ends_s = from_fn(|i| soonest_s + self.latest_after_s * i as f64 / (END_TIMES - 1) as f64);
        Some(Landings(Falls::new(self, burn, burning_s, ends_s)))
    }

    /// Height, m, and vertical velocity, m/s, after falling without thrust for a time.
    pub fn fallen(&self, height_m: f64, vertical_m_s: f64, fin_drag_area_m2: f64, time_s: f64) -> (f64, f64) {
        /// Short enough for the midpoint rule at any speed of a fall.
        const STEP_S: f64 = 0.05;
        let steps = libm::ceil(time_s / STEP_S).max(1.0);
        let step_s = time_s / steps;
        let area_m2 = self.body_drag_area_m2 + fin_drag_area_m2;
        let drag_per_v2 = 0.5 * self.air_density_kg_m3 * area_m2 / self.mass_at_ignition_kg;
        let acceleration =
            |speed_m_s: f64| -STANDARD_GRAVITY_M_S2 - drag_per_v2 * speed_m_s * speed_m_s.abs();
        let (mut height_m, mut vertical_m_s) = (height_m, vertical_m_s);
        for _ in 0..steps as u32 {
            let midway_m_s = vertical_m_s + 0.5 * step_s * acceleration(vertical_m_s);
            height_m += step_s * midway_m_s;
            vertical_m_s += step_s * acceleration(midway_m_s);
        }
        (height_m, vertical_m_s)
    }

    /// Fin opening, 0 to 1, that holds the vehicle at a place between the lowest height that suits
    /// the weaker of two motors and the highest height that suits the stronger.
    ///
    /// Without a band the vehicle is too fast or too slow for any landing, and the result is an end
    /// of the range.
    pub fn fin_share(
        &self,
        burns: [&Burn<'_>; 2],
        burning_s: f64,
        vertical_m_s: f64,
        height_m: f64,
        place: f64,
    ) -> f64 {
        /// Smallest width that is assumed for a band, as time at the present speed, s. Above a
        /// narrow band there is hardly a landing, but closed fins would only make the vehicle
        /// faster.
        const NARROW_S: f64 = 0.25;
        let [weak, strong] = burns.map(|burn| self.band(burn, burning_s, vertical_m_s));
        let Some(weak) = weak else {
            return if self.falls_too_slowly(burns[0], burning_s, vertical_m_s) { 0.0 } else { 1.0 };
        };
        let strong = strong.unwrap_or(weak);
        let (low_m, high_m) = (weak.low_m.max(strong.low_m), strong.high_m.min(weak.high_m));
        let width_m = (high_m - low_m).max(-NARROW_S * vertical_m_s).max(1e-3);
        (0.5 + FIN_GAIN * (place - (height_m - low_m) / width_m)).clamp(0.0, 1.0)
    }

    /// Whether a vehicle without a band falls more slowly than a landing needs: even the softest
    /// braking stops it before the thrust falls through the weight.
    pub fn falls_too_slowly(&self, burn: &Burn<'_>, burning_s: f64, vertical_m_s: f64) -> bool {
        if vertical_m_s > -1.0 {
            return true;
        }
        let carried_until_s = burn.falls_through_weight_s(self.mass_at_ignition_kg);
        carried_until_s.filter(|end_s| *end_s > burning_s).is_some_and(|end_s| {
            let falls = Falls::new(self, burn, burning_s, [end_s]);
            let [softest] = falls.along::<false, 1>([Way::Even], vertical_m_s, [[1.0]]);
            softest.speeds_m_s[0] > self.touchdown_m_s
        })
    }

    /// Terminal speed of the unpowered fall, m/s, positive downwards.
    pub fn terminal_speed_m_s(&self, fin_drag_area_m2: f64) -> f64 {
        let area_m2 = self.body_drag_area_m2 + fin_drag_area_m2;
        libm::sqrt(
            2.0 * self.mass_at_ignition_kg * STANDARD_GRAVITY_M_S2 / (self.air_density_kg_m3 * area_m2),
        )
    }
}

/// Speed at the ground, m/s, positive downwards, after a fall from a height with a vertical
/// velocity (up positive) towards a terminal speed `V_t`: the difference of `v^2` from `V_t^2`
/// falls by a factor of e in each `V_t^2 / (2 g)` of height. A vehicle that rises is assumed to
/// fall from its present height.
pub fn fall_ends_m_s(height_m: f64, vertical_m_s: f64, terminal_m_s: f64) -> f64 {
    let [begins, terminal] = [(-vertical_m_s).max(0.0), terminal_m_s].map(|speed_m_s| speed_m_s * speed_m_s);
    let left = libm::exp(-2.0 * STANDARD_GRAVITY_M_S2 * height_m.max(0.0) / terminal);
    libm::sqrt(terminal + (begins - terminal) * left)
}

// The vertical motion of a mission's vehicle as its data say.

impl Column {
    /// The column of a mission's vehicle before ignition, with all drag along the axis multiplied
    /// by `air_scale` (1 as certified), and with a largest tilt, degrees.
    pub fn of_mission(
        mission: &Mission,
        mass_at_ignition_kg: f64,
        air_density_kg_m3: f64,
        air_scale: f64,
        soft_tilt_deg: f64,
    ) -> Self {
        let airframe = &mission.airframe;
        let scaled = |area_m2: f64| air_scale * area_m2;
        let open_fins_m2 = airframe.open_fin_drag_area_m2();
        let final_box = &mission.powered.final_box;
        Self {
            mass_at_ignition_kg,
            air_density_kg_m3,
            body_drag_area_m2: scaled(airframe.unfinned_drag_area_m2(0.0)),
            burning_body_drag_area_m2: scaled(airframe.unfinned_drag_area_m2(mission.exhaust.body_loss)),
            crossflow_area_m2: airframe.body.crossflow_area_m2(),
            soft: Braking { tilt_rad: soft_tilt_deg.to_radians(), fin_drag_area_m2: 0.0 },
            hard: Braking {
                tilt_rad: 0.0,
                fin_drag_area_m2: scaled(open_fins_m2 * (1.0 - mission.exhaust.fin_loss)),
            },
            touchdown_m_s: 0.5 * (final_box.u_min_m_s + final_box.u_max_m_s),
            latest_after_s: mission.powered.latest_after_s,
            settle_s: mission.settle_s,
        }
    }
}

/// The landing that holds one tilt from ignition to touchdown, with half-open fins, on the expected
/// motor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EvenLanding {
    /// How long the thrust exceeds the weight, s; of a motor that never does, how long it burns.
    pub carried_s: f64,
    /// Speed at ignition, m/s: that of the fall from the mission's start, with open fins.
    pub speed_m_s: f64,
    /// Height of the ignition, m.
    pub height_m: f64,
    /// The tilt, rad; `None` if even upright the vehicle is still too fast at the ground.
    pub tilt_rad: Option<f64>,
}

impl EvenLanding {
    /// That of a mission's vehicle.
    pub fn of(mission: &Mission) -> Self {
        /// Beyond this the thrust carries nothing.
        const LIMIT_RAD: f64 = 1.4;
        /// Halvings of an interval: to a millimetre, and to a ten thousandth of a degree.
        const HALVINGS: usize = 20;
        let (airframe, curve) = (&mission.airframe, &mission.motor_curve);
        let density_kg_m3 = mission.site.air_at_m(0.0).density_kg_m3;
        // Gently: the controller's own touchdown follows from this.
        let column = Column {
            touchdown_m_s: -0.2,
            ..Column::of_mission(mission, airframe.mass.loaded_kg, density_kg_m3, 1.0, 0.0)
        };
        let burn = Burn::nominal(curve);
        let carried_s = burn.falls_through_weight_s(column.mass_at_ignition_kg);
        let carried_s = carried_s.unwrap_or_else(|| curve.burn_time_s());
        let half_m2 = airframe.fin_drag_area_m2(&[0.5 * airframe.fins.open_rad(); 4]);
        let braked = |speed_m_s: f64, tilt_rad: f64| {
            let soft = Braking { tilt_rad, fin_drag_area_m2: half_m2 };
            let falls = Falls::new(&Column { soft, ..column }, &burn, 0.0, [carried_s]);
            let [ended] = falls.along::<false, 1>([Way::Even], -speed_m_s, [[1.0]]);
            ended
        };
        let halved = |mut low: f64, mut high: f64, below: &dyn Fn(f64) -> bool| {
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                *if below(middle) { &mut low } else { &mut high } = middle;
            }
            low
        };
        let tilt_rad = |speed_m_s: f64| {
            let brakes = |tilt_rad: f64| braked(speed_m_s, tilt_rad).speeds_m_s[0] > column.touchdown_m_s;
            brakes(0.0).then(|| halved(0.0, LIMIT_RAD, &brakes))
        };
        let terminal_m_s = column.terminal_speed_m_s(airframe.open_fin_drag_area_m2());
        let start_m = mission.start_height_m();
        let speed_m_s = |height_m: f64| fall_ends_m_s(start_m - height_m, 0.0, terminal_m_s);
        // The higher the ignition, the slower the fall into it, and the lower it might be.
        let height_m = halved(0.0, start_m, &|height_m| {
            let speed_m_s = speed_m_s(height_m);
            braked(speed_m_s, tilt_rad(speed_m_s).unwrap_or_default()).fallen_m[0] > height_m
        });
        let speed_m_s = speed_m_s(height_m);
        Self { carried_s, speed_m_s, height_m, tilt_rad: tilt_rad(speed_m_s) }
    }

    /// From this tilt on, rad, a vehicle that throws away thrust all the way down has nothing left
    /// for a motor that is stronger: 62 degrees.
    pub const MOST_TILT_RAD: f64 = 1.082;

    /// Why no height lands the vehicle, in a builder's words; `None` if some may.
    pub fn misfit(&self) -> Option<&'static str> {
        match self.tilt_rad {
            None => Some("too heavy for its motor: the thrust does not stop it"),
            Some(tilt_rad) if tilt_rad > Self::MOST_TILT_RAD => {
                Some("too light for its motor: no height lands it")
            }
            Some(_) => None,
        }
    }
}

// A fall during the burn to a given end, and ways of braking it.

/// Intervals of the burn ahead.
const INTERVALS: usize = 40;
/// The touchdown speed is met this closely, m/s: a millimetre of height.
const MET_M_S: f64 = 1e-4;
/// Largest number of falls tried for a way of braking; about six are usual.
const MOST_FALLS: usize = 24;
/// How many ways of braking and holding are tried: the last two differ by a four thousandth of the
/// burn. With seven a landing was often missed, because the speed at which the thrust falls must be
/// met to a quarter of a metre per second.
const HOLDS_TRIED: usize = 12;
/// A vehicle that is held ends this near to the touchdown speed, m/s: the last moments, upright,
/// change it a little.
const HELD_M_S: f64 = 0.3;
/// A vehicle that moves upwards faster than this rises, m/s.
const RISING_M_S: f64 = 0.05;

/// The fraction of the thrust and the drag of one way of braking.
#[derive(Clone, Copy)]
struct Share {
    thrust: f64,
    drag_per_v2: f64,
}

impl Share {
    fn new(column: &Column, braking: &Braking) -> Self {
        let (sin, cos) = libm::sincos(braking.tilt_rad);
        let area_m2 = column.burning_body_drag_area_m2 * cos * cos
            + braking.fin_drag_area_m2
            + column.crossflow_area_m2 * sin * sin * sin;
        Self { thrust: cos, drag_per_v2: 0.5 * column.air_density_kg_m3 * area_m2 }
    }
}

/// A family of ways to brake, with one parameter between 0 (all hard) and 1 (all soft).
#[derive(Clone, Copy)]
enum Way {
    /// Soft braking first, for that fraction of the time.
    SoftFirst,
    /// Hard braking first, then soft braking for that fraction of the time.
    HardFirst,
    /// A mixture of both throughout.
    Even,
}

/// All ways, and the place of the one that brakes hard first.
const WAYS: [Way; 3] = [Way::SoftFirst, Way::HardFirst, Way::Even];
const HARD_FIRST: usize = 1;

impl Way {
    /// The fraction of soft braking in interval `k`, before it is limited to 0 to 1: the first
    /// number times the parameter, plus the second times `k`, plus the third.
    #[inline(always)]
    fn softly(self) -> (f64, f64, f64) {
        const ALL: f64 = INTERVALS as f64;
        match self {
            Self::SoftFirst => (ALL, -1.0, 0.0),
            Self::HardFirst => (ALL, 1.0, 1.0 - ALL),
            Self::Even => (1.0, 0.0, 0.0),
        }
    }
}

/// The landings on one motor from now on, at any velocity.
pub struct Landings(Falls<END_TIMES>);

impl Landings {
    /// Heights from which a landing exists at a vertical velocity (up positive); `None` if there is
    /// no landing.
    pub fn band(&self, vertical_m_s: f64) -> Option<Band> {
        let heights_m = self.0.heights_m(vertical_m_s);
        heights_m.iter().flatten().flatten().fold(None, |band: Option<Band>, &height_m| {
            Some(band.map_or(Band { low_m: height_m, high_m: height_m }, |band| Band {
                low_m: band.low_m.min(height_m),
                high_m: band.high_m.max(height_m),
            }))
        })
    }
}

/// The rest of the burn until `N` given ends, each in equal intervals. A step of a fall waits for
/// the one before it, so the falls to all ends are computed side by side, in vectors, and those of
/// all ways in turn.
struct Falls<const N: usize> {
    step_s: [f64; N],
    touchdown_m_s: f64,
    ahead: [Ahead<N>; INTERVALS],
}

/// An interval of each fall.
struct Ahead<const N: usize> {
    /// Acceleration without drag of the hardest and the softest braking, m/s^2, and their drag over
    /// the mass and the square of the speed, 1/m; upright in the share of the interval that is for
    /// settling.
    pushed_m_s2: [[f64; N]; 2],
    drag_per_m: [[f64; N]; 2],
}

/// Falls of one way, each to its end: how far, the vertical velocity, up positive, and the highest
/// so far.
#[derive(Clone, Copy)]
struct Falling<const N: usize> {
    fallen_m: [f64; N],
    speeds_m_s: [f64; N],
    highest_m_s: [f64; N],
}

impl<const N: usize> Falls<N> {
    /// Falls from `from_s` to `ends_s` of the burn.
    fn new(column: &Column, burn: &Burn<'_>, from_s: f64, ends_s: [f64; N]) -> Self {
        let step_s = ends_s.map(|to_s| (to_s - from_s) / INTERVALS as f64);
        let upright = Share::new(column, &Braking { tilt_rad: 0.0, ..column.soft });
        let shares = [&column.hard, &column.soft].map(|braking| Share::new(column, braking));
        let mut given_n_s = [burn.impulse_n_s(from_s); N];
        let ahead = from_fn(|k| {
            let [at_s, middle_s, until_s] =
                [0.0, 0.5, 1.0].map(|share| step_s.map(|step_s| from_s + (k as f64 + share) * step_s));
            let per_kg = middle_s.map(|at_s| 1.0 / (column.mass_at_ignition_kg - burn.burnt_kg(at_s)));
            let before_n_s = core::mem::replace(&mut given_n_s, until_s.map(|at_s| burn.impulse_n_s(at_s)));
            let thrust_m_s2: [f64; N] = from_fn(|i| {
                let mean_n = (given_n_s[i] - before_n_s[i]) / step_s[i];
                mean_n * burn.deviates(at_s[i], step_s[i]) * per_kg[i]
            });
            // The vehicle is upright once it settles.
            let leaning =
                step_s.map(|step_s| ((INTERVALS - k) as f64 - column.settle_s / step_s).clamp(0.0, 1.0));
            let mixed = |one: f64, i: usize, other: f64| leaning[i] * one + (1.0 - leaning[i]) * other;
            Ahead {
                pushed_m_s2: shares.map(|share| {
                    from_fn(|i| {
                        thrust_m_s2[i] * mixed(share.thrust, i, upright.thrust) - STANDARD_GRAVITY_M_S2
                    })
                }),
                drag_per_m: shares
                    .map(|share| from_fn(|i| per_kg[i] * mixed(share.drag_per_v2, i, upright.drag_per_v2))),
            }
        });
        Self { step_s, touchdown_m_s: column.touchdown_m_s, ahead }
    }

    /// The heights from which landings to each end begin, one for each way of braking that reaches
    /// the touchdown speed without rising before.
    fn heights_m(&self, vertical_m_s: f64) -> [[Option<f64>; N]; WAYS.len()] {
        Arch::new().dispatch(Heights { falls: self, vertical_m_s })
    }

    /// Finds for each end and way the parameter that gives the touchdown speed, by false position.
    /// The value of an end that stays twice is halved (the Illinois rule; Dowell and Jarratt, BIT
    /// 11, 1971).
    #[inline(always)]
    fn sought_m(&self, vertical_m_s: f64) -> [[Option<f64>; N]; WAYS.len()] {
        let missed_m_s = |fall: &Falling<N>, i: usize| fall.speeds_m_s[i] - self.touchdown_m_s;
        // All ways have the same two extremes.
        let extremes = self.along::<false, 2>([Way::Even; 2], vertical_m_s, [[0.0; N], [1.0; N]]);
        let mut heights_m = [[None; N]; WAYS.len()];
        let mut risen = [[false; N]; WAYS.len()];
        let mut one: [[_; N]; WAYS.len()] = [from_fn(|i| (0.0, missed_m_s(&extremes[0], i))); _];
        // `other` is the newest point.
        let mut other: [[_; N]; WAYS.len()] = [from_fn(|i| (1.0, missed_m_s(&extremes[1], i))); _];
        let mut sought: [[_; N]; WAYS.len()] = [from_fn(|i| one[0][i].1 * other[0][i].1 <= 0.0); _];
        for _ in 0..MOST_FALLS {
            if !sought.as_flattened().contains(&true) {
                break;
            }
            let parameters: [[f64; N]; WAYS.len()] = from_fn(|way| {
                from_fn(|i| {
                    let ((at, miss_m_s), (newest, newest_m_s)) = (one[way][i], other[way][i]);
                    let span_m_s = newest_m_s - miss_m_s;
                    if span_m_s.abs() > 0.0 { at - miss_m_s * (newest - at) / span_m_s } else { newest }
                })
            });
            let ended = self.along::<false, { WAYS.len() }>(WAYS, vertical_m_s, parameters);
            for way in 0..WAYS.len() {
                for i in 0..N {
                    if !sought[way][i] {
                        continue;
                    }
                    let (ended, one, other) = (&ended[way], &mut one[way][i], &mut other[way][i]);
                    let miss_m_s = missed_m_s(ended, i);
                    if miss_m_s.abs() < MET_M_S {
                        sought[way][i] = false;
                        risen[way][i] = ended.highest_m_s[i] > RISING_M_S;
                        heights_m[way][i] = (!risen[way][i]).then_some(ended.fallen_m[i]);
                    } else if miss_m_s * other.1 < 0.0 {
                        *one = *other;
                    } else {
                        one.1 *= 0.5;
                    }
                    *other = (parameters[way][i], miss_m_s);
                }
            }
        }
        let risen = &risen[HARD_FIRST];
        if risen.contains(&true) {
            // It would rise. It may instead be held by its tilt once it sinks as at touchdown:
            // braked hard before that for as long as the softest braking can still hold it.
            let after = |softly: f64, rises: bool, by: f64| (softly + if rises { by } else { -by }).max(0.0);
            let mut softly = [0.0; N];
            let mut softer_by = 0.5;
            for _ in 0..HOLDS_TRIED / 2 {
                // With each, what may follow it.
                let tried = [
                    softly,
                    softly.map(|softly| after(softly, true, softer_by)),
                    softly.map(|softly| after(softly, false, softer_by)),
                ];
                let held = self.along::<true, 3>([Way::HardFirst; 3], vertical_m_s, tried);
                for i in (0..N).filter(|i| risen[*i]) {
                    let mut rises = |held: &Falling<N>| {
                        let rises = held.highest_m_s[i] > RISING_M_S;
                        if missed_m_s(held, i).abs() < HELD_M_S && !rises {
                            heights_m[HARD_FIRST][i] = Some(held.fallen_m[i]);
                        }
                        rises
                    };
                    let next = if rises(&held[0]) { 1 } else { 2 };
                    softly[i] = after(tried[next][i], rises(&held[next]), 0.5 * softer_by);
                }
                softer_by *= 0.25;
            }
        }
        heights_m
    }

    /// The falls from a vertical velocity, each with its parameter of each way; if it `HOLDS`, no
    /// faster upwards than at touchdown as far as the softest braking allows.
    #[inline(always)]
    fn along<const HOLDS: bool, const W: usize>(
        &self,
        ways: [Way; W],
        vertical_m_s: f64,
        parameters: [[f64; N]; W],
    ) -> [Falling<N>; W] {
        let ways: [_; W] = from_fn(|way| {
            let (per_parameter, per_interval, at_first) = ways[way].softly();
            (parameters[way].map(|parameter| parameter * per_parameter + at_first), per_interval)
        });
        let begins = Falling {
            fallen_m: [0.0; N],
            speeds_m_s: [vertical_m_s; N],
            highest_m_s: [f64::NEG_INFINITY; N],
        };
        let mut falling = [begins; W];
        for (k, ahead) in self.ahead.iter().enumerate() {
            for (falling, (at_first, per_interval)) in falling.iter_mut().zip(&ways) {
                let later = per_interval * k as f64;
                let softly = at_first.map(|at_first| smaller(larger(at_first + later, 0.0), 1.0));
                self.step::<HOLDS>(ahead, &softly, falling);
            }
        }
        falling
    }

    /// One interval of the falls of one way, with these shares of soft braking: the midpoint rule.
    /// Every line is one operation on all falls, which the compiler makes one on vectors.
    #[inline(always)]
    fn step<const HOLDS: bool>(&self, ahead: &Ahead<N>, softly: &[f64; N], falling: &mut Falling<N>) {
        let Ahead { pushed_m_s2: [hard_m_s2, soft_m_s2], drag_per_m: [hard_per_m, soft_per_m] } = ahead;
        let (step_s, speeds_m_s) = (&self.step_s, falling.speeds_m_s);
        let mixed = |hard: &[f64; N], soft: &[f64; N]| -> [f64; N] {
            from_fn(|i| hard[i] + softly[i] * (soft[i] - hard[i]))
        };
        let (pushed_m_s2, drag_per_m) = (mixed(hard_m_s2, soft_m_s2), mixed(hard_per_m, soft_per_m));
        let acceleration = |speeds_m_s: &[f64; N]| -> [f64; N] {
            from_fn(|i| pushed_m_s2[i] - drag_per_m[i] * speeds_m_s[i] * speeds_m_s[i].abs())
        };
        let begins_m_s2 = acceleration(&speeds_m_s);
        let mut midway_m_s = from_fn(|i| speeds_m_s[i] + 0.5 * step_s[i] * begins_m_s2[i]);
        let midway_m_s2 = acceleration(&midway_m_s);
        let mut next_m_s: [f64; N] = from_fn(|i| speeds_m_s[i] + step_s[i] * midway_m_s2[i]);
        if HOLDS {
            next_m_s = from_fn(|i| {
                let least_m_s = speeds_m_s[i] + step_s[i] * soft_m_s2[i];
                let most_m_s = speeds_m_s[i] + step_s[i] * hard_m_s2[i];
                let held_m_s = larger(smaller(self.touchdown_m_s, most_m_s), least_m_s);
                let next_m_s = if next_m_s[i] > self.touchdown_m_s { held_m_s } else { next_m_s[i] };
                if speeds_m_s[i] >= self.touchdown_m_s - MET_M_S { held_m_s } else { next_m_s }
            });
            midway_m_s = from_fn(|i| 0.5 * (speeds_m_s[i] + next_m_s[i]));
        }
        falling.fallen_m = from_fn(|i| falling.fallen_m[i] - step_s[i] * midway_m_s[i]);
        falling.highest_m_s = from_fn(|i| larger(falling.highest_m_s[i], next_m_s[i]));
        falling.speeds_m_s = next_m_s;
    }
}

/// The search of the heights in the widest vectors that the machine has; the bits are the same.
struct Heights<'a, const N: usize> {
    falls: &'a Falls<N>,
    vertical_m_s: f64,
}

impl<const N: usize> WithSimd for Heights<'_, N> {
    type Output = [[Option<f64>; N]; WAYS.len()];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.falls.sought_m(self.vertical_m_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicles::motors;

    /// Compares with a fall integrated in small steps.
    #[test]
    fn val_a_fall_ends_at_the_speed_of_a_step_by_step_integration() {
        let column = column();
        let fins_m2 = column.hard.fin_drag_area_m2;
        let terminal_m_s = column.terminal_speed_m_s(fins_m2);
        for vertical_m_s in [0.0, -20.0, -60.0] {
            let (mut height_m, mut speed_m_s) = (70.0, vertical_m_s);
            while height_m > 0.0 {
                (height_m, speed_m_s) = column.fallen(height_m, speed_m_s, fins_m2, 1e-3);
            }
            let found_m_s = fall_ends_m_s(70.0, vertical_m_s, terminal_m_s);
            assert!((found_m_s + speed_m_s).abs() < 0.02, "{found_m_s} for {speed_m_s}");
        }
        assert!((fall_ends_m_s(-0.1, -3.0, terminal_m_s) - 3.0).abs() < 1e-12, "on the ground already");
    }

    fn column() -> Column {
        Column {
            mass_at_ignition_kg: 3.13,
            air_density_kg_m3: 1.2,
            body_drag_area_m2: 0.0043,
            burning_body_drag_area_m2: 0.0043,
            crossflow_area_m2: 0.0622,
            soft: Braking { tilt_rad: 40_f64.to_radians(), fin_drag_area_m2: 0.0 },
            hard: Braking { tilt_rad: 0.0, fin_drag_area_m2: 0.0267 },
            touchdown_m_s: -0.15,
            latest_after_s: 0.5,
            settle_s: 0.3,
        }
    }

    #[test]
    fn a_weak_motor_narrows_the_band_and_a_very_weak_one_leaves_none() {
        let curve = motors::builtin("H45W").expect("a built-in motor");
        let column = column();
        let speed_m_s = -column.terminal_speed_m_s(0.0267);
        let band =
            |impulse_scale| column.band(&Burn { impulse_scale, ..Burn::nominal(&curve) }, 0.0, speed_m_s);
        let (nominal, weak) = (band(1.0).expect("a landing exists"), band(0.92).expect("a landing exists"));
        assert!(nominal.low_m < 58.0 && nominal.high_m > 72.0, "{nominal:?}");
        assert!(weak.high_m - weak.low_m < 0.5 * (nominal.high_m - nominal.low_m), "{weak:?}");
        let inside = nominal.contains(weak.low_m) && nominal.contains(weak.high_m);
        assert!(inside, "a start that suits the weak motor suits the nominal one");
        assert_eq!(band(0.8), None);
    }

    #[test]
    fn every_way_of_braking_begins_inside_the_band_and_arrives_at_the_touchdown_speed() {
        let curve = motors::builtin("H45W").expect("a built-in motor");
        let column = column();
        let burn = Burn::nominal(&curve);
        let band = column.band(&burn, 1.0, -25.0).expect("a landing exists");
        let end_s = burn.falls_through_weight_s(3.13).expect("the thrust carries the vehicle");
        let falls = Falls::new(&column, &burn, 1.0, [end_s]);
        let mut found = 0;
        for height_m in falls.heights_m(-25.0).into_iter().flatten().flatten() {
            assert!(band.contains(height_m), "{height_m} in {band:?}");
            found += 1;
        }
        assert!(found >= 2, "{found}");
        assert!((band.place(band.low_m), band.place(band.high_m)) == (0.0, 1.0));
    }
}
