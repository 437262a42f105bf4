//! Faults of a flight with their times, and their injection.
//!
//! On a command line a fault is written `NAME[:VALUE]@WHEN`, for example `gnss-out@5`,
//! `fin-stuck:2@apogee`, `gimbal-slow:0.3@ignition+0.3`. `WHEN` is a time since the start of the
//! flight in seconds, or a phase with an optional delay in seconds after the phase was entered. A
//! delay `+0.5..4` is drawn uniformly for each flight.

use core::fmt;
use core::str::FromStr;

use crate::world::Fault;
use crate::world::sensors::{Defect, Sensor};
use flight::rules::phase::Phase;

use crate::draw::fault_shares;
use crate::recipe::nearest;

/// The faulty part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Breakage {
    /// Motor, gimbal or fins.
    Vehicle(Fault),
    /// A sensor.
    Sensor(Sensor, Defect),
    /// The radio is silent. Nothing on board depends on it.
    LinkLoss,
    /// Messages in both directions arrive this much later, s.
    LinkDelay(f64),
    /// The flight computer is dead for this long, s, and then starts again with its stored memory.
    Reboot(f64),
    /// The operator requests an abort.
    Abort,
}

/// When it breaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum When {
    /// Seconds after the start of the flight.
    Time(f64),
    /// Seconds after a phase was entered.
    Phase(Phase, f64),
    /// Seconds after a phase was entered, drawn uniformly between two delays for each flight.
    PhaseBetween(Phase, [f64; 2]),
}

/// A fault of a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedFault {
    /// Name and value, without its time.
    what: String,
    /// The faulty part.
    pub breakage: Breakage,
    pub when: When,
}

/// Why the text of a fault is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("fault `{given}`: {problem}; write {}", how_to_write())]
pub struct FaultError {
    given: String,
    problem: String,
}

/// Argument of a fault.
enum Takes {
    Nothing(Breakage),
    /// A value, with its meaning; `None` of one that is not accepted.
    Value(&'static str, fn(f64) -> Option<Breakage>),
}

/// Each fault by its name.
#[rustfmt::skip]
const NAMES: &[(&str, Takes)] = {
    use Breakage::Vehicle;
    use Takes::{Nothing, Value};
    &[
        ("link-loss", Nothing(Breakage::LinkLoss)),
        ("link-delay", Value("s, 0 to 60", |s| within(s, 0.0, 60.0).map(Breakage::LinkDelay))),
        ("fin-stuck", Value("0 to 3", |fin| Some(Vehicle(Fault::FinStuck { fin: surface(within(fin, 0.0, 3.0)? + 1.0)? })))),
        ("reversed", Value("1 or 2, the gimbal's axes, 3 to 6, the fins", |number| {
            Some(Vehicle(Fault::Reversed { surface: surface(number)? }))
        })),
        ("swapped", Value("two of these digits, as 36", |numbers| {
            let surfaces = [surface(libm::trunc(numbers / 10.0))?, surface(numbers % 10.0)?];
            Some(Vehicle(Fault::Swapped { surfaces }))
        })),
        ("gimbal-stuck", Nothing(Vehicle(Fault::GimbalStuck))),
        ("brown-out", Value("s, 0 to 10", |s| {
            Some(Vehicle(Fault::BrownOut { lasts_s: within(s, 0.0, 10.0)? }))
        })),
        ("gimbal-jams", Value("deg, -90 to 90", |deg| Some(Vehicle(Fault::GimbalJams { deg: within(deg, -90.0, 90.0)? })))),
        ("gimbal-slow", Value("rate over nominal, 0 to 1", |scale| {
            Some(Vehicle(Fault::GimbalSlow { scale: within(scale, 0.0, 1.0)? }))
        })),
        ("no-light", Nothing(Vehicle(Fault::NoLight))),
        ("late-light", Value("s", |s| Some(Vehicle(Fault::LateLight { delay_s: within(s, 0.0, f64::INFINITY)? })))),
        ("weak-motor", Value("thrust over nominal, 0.01 to 1", |scale| {
            Some(Vehicle(Fault::WeakMotor { scale: within(scale, 0.01, 1.0)? }))
        })),
        ("early-burnout", Value("s after the first thrust", |s| {
            Some(Vehicle(Fault::EarlyBurnout { after_s: within(s, 0.0, f64::INFINITY)? }))
        })),
        ("ascent-no-light", Nothing(Vehicle(Fault::AscentNoLight))),
        ("ascent-self-lights", Nothing(Vehicle(Fault::AscentSelfLights))),
        ("ascent-weak", Value("thrust over nominal, 0.01 to 1", |scale| {
            Some(Vehicle(Fault::AscentWeak { scale: within(scale, 0.01, 1.0)? }))
        })),
        ("separation-fails", Nothing(Vehicle(Fault::SeparationFails))),
        ("parachute-fails", Nothing(Vehicle(Fault::ParachuteFails))),
        ("reboot", Value("s", |s| within(s, 0.0, 10.0).map(Breakage::Reboot))),
        ("abort", Nothing(Breakage::Abort)),
    ]
};

fn within(value: f64, least: f64, most: f64) -> Option<f64> {
    Some(value).filter(|value| (least..=most).contains(value))
}

/// A surface by its number from 1.
fn surface(number: f64) -> Option<usize> {
    (1..=6_u8)
        .find(|known| f64::from(*known).to_bits() == number.to_bits())
        .map(|known| usize::from(known) - 1)
}

/// The defects of a sensor without a value, and those with one.
const SILENT: [(&str, Defect); 4] =
    [("out", Defect::Out), ("dead", Defect::Dead), ("stuck", Defect::Stuck), ("nan", Defect::NotANumber)];
type OfValue = fn(f64) -> Defect;
const WRONG: [(&str, OfValue); 8] = [
    ("step", Defect::Step),
    ("bias", Defect::Step),
    ("ramp", Defect::Ramp),
    ("spike", Defect::Spike),
    ("noise", Defect::Noise),
    ("blocked", Defect::Blocked),
    ("scale", Defect::Scale),
    ("stale", Defect::Stale),
];

/// A sensor's defect by its name; the value it takes, if it takes one, and the unit of that value.
fn sensor_fault(name: &str, value: Option<f64>) -> Option<(&'static str, Option<Breakage>)> {
    let (sensor, how) = name.rsplit_once('-')?;
    let (sensor, _, unit) = Sensor::ALL.iter().find(|(_, known, _)| *known == sensor)?;
    let silent = SILENT.iter().find(|(known, _)| *known == how);
    if let Some((_, defect)) = silent {
        return Some(("", value.is_none().then_some(Breakage::Sensor(*sensor, *defect))));
    }
    let (_, of) = WRONG.iter().find(|(known, _)| *known == how)?;
    Some((unit, value.map(|value| Breakage::Sensor(*sensor, of(value)))))
}

/// The phases, with their names in the text of a fault.
const PHASES: &[(&str, Phase)] = &[
    ("pad", Phase::PadIdle),
    ("pad-armed", Phase::PadArmed),
    ("boost", Phase::Boost),
    ("coast", Phase::Coast),
    ("apogee", Phase::Deploy),
    ("descent", Phase::AeroDescent),
    ("armed", Phase::LandArmed),
    ("ignition", Phase::Ignition),
    ("powered", Phase::Powered),
    ("chute", Phase::Chute),
    ("touchdown", Phase::Touchdown),
];

/// How to write a fault, with every name, for a help text.
pub fn how_to_write() -> String {
    format!(
        "NAME[:VALUE]@WHEN, as in gnss-out@5 or fin-stuck:2@apogee. NAME: {}. WHEN: seconds, or with +SECONDS or +FROM..TO one of {}",
        fault_forms(),
        phases()
    )
}

fn fault_names() -> impl Iterator<Item = String> {
    let defects = SILENT.iter().map(|(defect, _)| *defect).chain(WRONG.iter().map(|(defect, _)| *defect));
    let of_sensors = Sensor::ALL
        .iter()
        .flat_map(move |(_, sensor, _)| defects.clone().map(move |defect| format!("{sensor}-{defect}")));
    NAMES.iter().map(|(name, _)| (*name).to_owned()).chain(of_sensors)
}

fn fault_forms() -> String {
    let with_value = |(name, takes): &(&str, Takes)| match takes {
        Takes::Nothing(_) => (*name).to_owned(),
        Takes::Value(meaning, _) => format!("{name}:VALUE ({meaning})"),
    };
    let names = NAMES.iter().map(with_value).collect::<Vec<_>>().join(", ");
    let sensors = Sensor::ALL.map(|(_, name, unit)| format!("{name} ({unit})")).join(", ");
    let (silent, wrong) = (SILENT.map(|(name, _)| name).join(", "), WRONG.map(|(name, _)| name).join(", "));
    format!(
        "{names}, or SENSOR-DEFECT with a sensor of {sensors} and a defect of {silent}, or with :VALUE of {wrong}"
    )
}

fn phases() -> String {
    PHASES.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

fn name_of(phase: Phase) -> &'static str {
    PHASES.iter().find(|(_, known)| *known == phase).map_or("?", |(name, _)| name)
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

impl FromStr for When {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(time_s) = number(text) {
            return if time_s >= 0.0 {
                Ok(Self::Time(time_s))
            } else {
                Err(format!("{text} s is before the start"))
            };
        }
        let (name, delay) = text.split_once('+').unwrap_or((text, "0"));
        let (_, phase) = PHASES
            .iter()
            .find(|(known, _)| *known == name)
            .ok_or_else(|| format!("`{name}` is neither a time nor a phase"))?;
        let seconds = |text: &str| number(text).filter(|delay_s| *delay_s >= 0.0);
        let read = match delay.split_once("..") {
            None => seconds(delay).map(|delay_s| Self::Phase(*phase, delay_s)),
            Some((from, to)) => seconds(from)
                .zip(seconds(to))
                .filter(|(from_s, to_s)| from_s <= to_s)
                .map(|(from_s, to_s)| Self::PhaseBetween(*phase, [from_s, to_s])),
        };
        read.ok_or_else(|| format!("`{delay}` is no delay in seconds"))
    }
}

impl FromStr for TimedFault {
    type Err = FaultError;

    fn from_str(given: &str) -> Result<Self, FaultError> {
        let refuse = |problem: String| FaultError { given: given.to_owned(), problem };
        let (what, when) = given.split_once('@').ok_or_else(|| refuse("no `@`".to_owned()))?;
        let when = when.parse().map_err(refuse)?;
        let (name, value) = what.split_once(':').map_or((what, None), |(name, value)| (name, Some(value)));
        let value = match value {
            Some(text) => Some(number(text).ok_or_else(|| refuse(format!("`{text}` is no number")))?),
            None => None,
        };
        let known = NAMES.iter().find(|(known, _)| *known == name);
        let (unit, breakage) = known
            .map(|(_, takes)| match takes {
                Takes::Nothing(breakage) => ("", value.is_none().then_some(*breakage)),
                Takes::Value(meaning, of) => (*meaning, value.and_then(of)),
            })
            .or_else(|| sensor_fault(name, value))
            .ok_or_else(|| {
                let close = nearest(name, fault_names()).map_or_else(String::new, |(close, _)| close);
                refuse(format!("no fault is named `{name}`; did you mean `{close}`?"))
            })?;
        let breakage = breakage.ok_or_else(|| {
            refuse(if unit.is_empty() {
                format!("{name} takes no value")
            } else {
                format!("its value must be {unit}")
            })
        })?;
        // Two words for one thing.
        let name = match breakage {
            Breakage::Sensor(Sensor::Gyro | Sensor::Accelerometer, _) => name.replace("-step", "-bias"),
            _ => name.replace("-bias", "-step"),
        };
        let what = value.map_or(name.clone(), |value| format!("{name}:{value}"));
        Ok(Self { what, breakage, when })
    }
}

impl fmt::Display for When {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time(time_s) => write!(f, "{time_s}"),
            Self::Phase(phase, delay_s) if *delay_s > 0.0 => write!(f, "{}+{delay_s}", name_of(*phase)),
            Self::Phase(phase, _) => f.write_str(name_of(*phase)),
            Self::PhaseBetween(phase, [from_s, to_s]) => write!(f, "{}+{from_s}..{to_s}", name_of(*phase)),
        }
    }
}

impl fmt::Display for TimedFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.what, self.when)
    }
}

// Injects the faults of a flight at their times.

/// The faults of a flight that have not happened yet.
#[derive(Debug, Clone, Default)]
pub struct Injector {
    waiting: Vec<TimedFault>,
    /// When each phase was entered, s since the start.
    entered_s: [Option<f64>; Phase::ALL.len()],
    happened: u64,
}

impl Injector {
    /// The faults of flight `number` of a seed; none has happened yet.
    pub fn new(faults: &[TimedFault], seed: u64, number: u64) -> Self {
        let shares = fault_shares(seed, number, faults.len());
        let waiting = faults.iter().zip(shares).map(|(fault, share)| match fault.when {
            When::PhaseBetween(phase, [from_s, to_s]) => {
                TimedFault { when: When::Phase(phase, from_s + share * (to_s - from_s)), ..fault.clone() }
            }
            When::Time(_) | When::Phase(..) => fault.clone(),
        });
        Self { waiting: waiting.collect(), entered_s: [None; Phase::ALL.len()], happened: 0 }
    }

    /// How many have happened.
    pub fn happened(&self) -> u64 {
        self.happened
    }

    /// Faults due at a time, s since the start, in a phase. Call it before every frame.
    pub fn due(&mut self, time_s: f64, phase: Phase) -> Vec<Breakage> {
        self.entered_s[usize::from(phase.index())].get_or_insert(time_s);
        let entered_s = self.entered_s;
        let waited = || {
            Phase::ALL.iter().any(|phase| phase.on_pad() && entered_s[usize::from(phase.index())].is_some())
        };
        let due = |fault: &TimedFault| match fault.when {
            // Without a wait on the pad the vehicle is broken from the beginning on.
            When::PhaseBetween(since, _) | When::Phase(since, _) if since.on_pad() && !waited() => {
                matches!(fault.breakage, Breakage::Vehicle(_) | Breakage::Sensor(..))
            }
            // The start is the release.
            When::Time(at_s) => !phase.on_pad() && time_s >= at_s,
            // The delay was drawn together with the flight.
            When::PhaseBetween(since, [delay_s, _]) | When::Phase(since, delay_s) => {
                let entered_s = entered_s[usize::from(since.index())];
                // The time restarts at the release.
                since.on_pad() == phase.on_pad()
                    && entered_s.is_some_and(|entered_s| time_s >= entered_s + delay_s)
            }
        };
        let (now, later): (Vec<_>, Vec<_>) = self.waiting.drain(..).partition(due);
        self.waiting = later;
        self.happened += now.len() as u64;
        now.into_iter().map(|fault| fault.breakage).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_of_a_fault_reads_back_to_the_same_fault() {
        for text in [
            "gnss-out@5",
            "fin-stuck:2@apogee",
            "gimbal-slow:0.3@ignition+0.3",
            "gimbal-stuck@powered",
            "accelerometer-dead@boost",
            "barometer-step:-20@coast+1",
            "barometer-ramp:-80@boost+0.5",
            "gnss-spike:200@coast",
            "gyro-stuck@descent",
            "accelerometer-nan@descent",
            "gyro-noise:7@powered",
            "barometer-scale:0.95@pad",
            "gnss-stale:3.2@boost",
            "lidar-blocked:0.3@armed",
            "ascent-self-lights@pad-armed+3",
            "gimbal-jams:3@powered+0.5..2",
            "ascent-weak:0.6@boost",
            "ascent-no-light@0",
            "separation-fails@coast",
            "parachute-fails@0",
            "late-light:0.2@0",
            "reboot:0.5@descent+4",
            "link-loss@0",
            "link-delay:1.5@descent",
            "accelerometer-bias:50@armed",
            "abort@ignition+0..4.5",
        ] {
            assert_eq!(text.parse::<TimedFault>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn a_wrong_fault_is_refused_with_the_accepted_values() {
        for (text, words) in [
            ("gnss-out", "no `@`"),
            ("gnss@5", "no fault is named `gnss`"),
            ("gnss-ot@5", "no fault is named `gnss-ot`; did you mean `gnss-out`?"),
            ("gnss-out:1@5", "takes no value"),
            ("link-delay@0", "must be s, 0 to 60"),
            ("link-delay:-1@0", "must be s, 0 to 60"),
            ("fin-stuck:4@5", "must be 0 to 3"),
            ("fin-stuck:1.5@5", "must be 0 to 3"),
            ("weak-motor@5", "must be thrust over nominal"),
            ("weak-motor:x@5", "`x` is no number"),
            ("no-light@-1", "before the start"),
            ("no-light@orbit", "neither a time nor a phase"),
            ("no-light@powered+soon", "no delay"),
            ("abort@powered+3..2", "no delay"),
            ("abort@powered+-1..2", "no delay"),
            ("abort@powered+1..", "no delay"),
        ] {
            let message = text.parse::<TimedFault>().unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("NAME[:VALUE]@WHEN"), "{message}");
        }
    }

    #[test]
    fn a_random_delay_differs_between_flights_and_repeats_for_the_same_flight() {
        let faults = ["abort@ignition+1..3".parse().unwrap(), "gnss-out@ignition+1..3".parse().unwrap()];
        let drawn_s = |number| {
            Injector::new(&faults, 5, number)
                .waiting
                .iter()
                .map(|fault| match fault.when {
                    When::Phase(Phase::Ignition, delay_s) => delay_s,
                    other => panic!("not drawn: {other:?}"),
                })
                .collect::<Vec<f64>>()
        };
        let all: Vec<f64> = (0..200).flat_map(drawn_s).collect();
        assert!(all.iter().all(|delay_s| (1.0..3.0).contains(delay_s)));
        let mean_s = all.iter().sum::<f64>() / all.len() as f64;
        // Five standard deviations of the mean of 400 uniform draws over two seconds.
        assert!((mean_s - 2.0).abs() < 5.0 * 2.0 / (12.0_f64 * 400.0).sqrt(), "{mean_s}");
        assert_eq!(drawn_s(7), drawn_s(7));
        assert_ne!(drawn_s(7)[0].to_bits(), drawn_s(7)[1].to_bits(), "each fault has its own draw");
    }
}
