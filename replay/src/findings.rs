//! Failures of a flight: the findings of its computer, which is run again on the log's frames from
//! power-up on, and the limits that the landing broke.

use flight::computer::findings::{Findings, Sign};
use flight::rules::verdict::UNDER_PARACHUTE;
use foxglove::messages::{Log as EventRecord, log::Level};
use protocol::dialect::TD_FINDING_DATA;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::v1::LimitResult;
use protocol::text::printable;
use serde::Serialize;

use crate::controller::LoggedComputer;
use crate::log::{Clock, ClockTime, Clocks, Recording, Verdict, worst_first};

/// One finding.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// When it began, s; T+ unless the vehicle did not leave its pad.
    pub since_s: f64,
    pub clock: Clock,
    /// How long it lasted altogether, s.
    pub lasted_s: f64,
    /// A short sentence.
    pub words: String,
    /// An earlier finding explains it.
    pub follows: bool,
    /// The picture of a report that shows it, by its place on the page, or another place.
    #[serde(skip)]
    pub(crate) picture: &'static str,
}

impl Finding {
    /// When it began.
    pub fn since(&self) -> ClockTime {
        ClockTime { clock: self.clock, time_s: self.since_s }
    }
}

/// Whether the vehicle warns of something.
pub(crate) fn is_warning(event: &EventRecord) -> bool {
    event.name == "vehicle" && event.level >= Level::Warning as i32
}

/// How the vehicle's reports begin on a check that its crew runs, and on what is not ready on the
/// pad, as after such a check: a vehicle that was released was ready.
const OF_THE_PAD: [&str; 2] = ["check ", "not ready: "];

/// What the vehicle itself reported before its release, each once, but for what a check found: the
/// crew flew after it. All it reported if it was never released.
fn on_the_pad(recording: &Recording) -> Vec<Finding> {
    let (clock, zero_s, end_s) = match recording.clocks.flight_zero_s {
        Some(zero_s) => (Clock::Flight, zero_s, zero_s),
        None => (Clock::Log, 0.0, f64::INFINITY),
    };
    let mut facts: Vec<Finding> = Vec::new();
    let of_pad = |words: &str| clock != Clock::Log && OF_THE_PAD.iter().any(|on| words.starts_with(on));
    for (log_s, event) in recording.events.iter().filter(|(log_s, _)| *log_s < end_s) {
        let is_new = |words: &str| facts.iter().all(|known| known.words != words);
        if is_warning(event) && !of_pad(&event.message) && is_new(&event.message) {
            let words = event.message.clone();
            let since_s = log_s - zero_s;
            let follows = false;
            facts.push(Finding { since_s, clock, lasted_s: 0.0, words, follows, picture: "events" });
        }
    }
    facts
}

/// Runs the computer of a recorded flight again. `see` receives it after each frame, with the
/// recorded frame and the new one. Returns the computer at the end, and its findings: what a
/// computer that decides otherwise would have commanded says nothing of surfaces that followed
/// other commands.
///
/// # Errors
/// The reason why it cannot be run again.
pub(crate) fn run_again(
    recording: &Recording,
    mut see: impl FnMut(&LoggedComputer, &ComputerFrame, &ComputerFrame),
) -> Result<(LoggedComputer, Result<Findings, String>), String> {
    let (start, frames) = recording.replayable_frames().map_err(|error| error.to_string())?;
    let mut computer = if let Some(computer) = &recording.at_release {
        computer.as_ref().clone()
    } else {
        let toml = recording.profile_toml().map_err(|error| error.to_string())?;
        LoggedComputer::recorded(toml, start, &recording.head.run, &[]).map_err(|error| error.to_string())?
    };
    let mut findings = Ok(Findings::default());
    for frame in frames {
        let again = match &recording.at_release {
            Some(_) => computer.run_again(&recording.since_power_up(frame)),
            None => computer.run_again(frame),
        };
        let again = again.map_err(|error| error.to_string())?;
        if findings.is_ok() && again.output != frame.output {
            let number = recording.release_frame + frame.input.frame;
            findings = Err(format!("this build decides otherwise from frame {number} on"));
        }
        if let Ok(findings) = &mut findings {
            findings.note(computer.computer());
        }
        see(&computer, frame, &ComputerFrame { input: frame.input.clone(), ..again });
    }
    Ok((computer, findings))
}

/// The vehicle's own reports on its pad, the findings of a computer that was run again, and the
/// limits that the landing broke.
///
/// # Errors
/// `findings` has none, and the vehicle was not released, either.
pub(crate) fn facts(
    recording: &Recording,
    findings: Result<Findings, String>,
) -> Result<Vec<Finding>, String> {
    let mut facts = on_the_pad(recording);
    let findings = match findings {
        Err(_) if recording.frames.is_empty() && recording.from_power_up => return Ok(facts),
        findings => findings?,
    };
    let found = findings.found();
    // A computer that was away measures a late ignition and a weak motor, of any motor.
    let was_away = found.iter().any(|finding| finding.sign == Sign::Restart);
    let of_motor = |sign: Sign| matches!(sign, Sign::LateLight | Sign::Impulse | Sign::BurntOutEarly);
    facts.extend(found.iter().filter(|finding| !(was_away && of_motor(finding.sign))).map(|finding| {
        Finding {
            since_s: finding.since_s,
            clock: Clock::Flight,
            lasted_s: finding.held_s,
            words: if finding.follows {
                format!("consequence: {}", finding.words())
            } else {
                finding.words()
            },
            follows: finding.follows,
            picture: picture(finding.sign),
        }
    }));
    if let Some(verdict) = &recording.verdict {
        let contact_s = recording.contact_s().unwrap_or(f64::NAN);
        facts.extend(broken(verdict, contact_s, findings.thrust_over_weight_at_contact(), &facts));
    }
    Ok(facts)
}

/// The findings of a landing without warnings that broke no limit, whose vehicle has sent none or
/// one after its contact: `last` was sent last. Only a computer that is run again separates causes
/// from consequences, and has the thrust at a contact.
pub(crate) fn recorded(last: &TD_FINDING_DATA, verdict: &Verdict, clocks: &Clocks) -> Option<Vec<Finding>> {
    let contact_s = clocks.convert(verdict.contact(), Clock::Boot)?.time_s;
    if last.found > 1 || f64::from(last.time_boot_ms) / 1e3 < contact_s {
        return None;
    }
    let to_ms = |time_s: f32| (f64::from(time_s) * 1e3).round() / 1e3;
    let found = (last.found == 1).then(|| Finding {
        since_s: to_ms(last.since_s),
        clock: Clock::Flight,
        lasted_s: to_ms(last.held_s),
        words: printable(last.text[..].split(|byte| *byte == 0).next().unwrap_or_default()),
        follows: false,
        picture: "",
    });
    broken(verdict, contact_s, None, &[]).is_none().then(|| found.into_iter().collect())
}

/// The pictures of the fins.
pub(crate) const FINS: [&str; 4] = ["fin-1", "fin-2", "fin-3", "fin-4"];

fn picture(sign: Sign) -> &'static str {
    match sign {
        Sign::Gnss
        | Sign::Barometer
        | Sign::Lidar
        | Sign::Implausible(_)
        | Sign::Repeats(_)
        | Sign::Jumps(_)
        | Sign::Apart
        | Sign::HeightsDisagree
        | Sign::RangesDisagree => "test-ratio",
        Sign::Estimate => "standard-deviations",
        Sign::Battery => "battery-voltage",
        Sign::Surface(0) | Sign::SlowGimbal => "gimbal-pitch",
        Sign::Surface(1) => "gimbal-yaw",
        Sign::Surface(fin) => FINS[usize::from(fin - 2) % FINS.len()],
        Sign::Tumbles => "tilt",
        Sign::LateLight | Sign::Impulse | Sign::BurntOutEarly => "thrust",
        Sign::NoPlan => "newton-iterations",
        Sign::AscentMotor | Sign::Separation | Sign::Parachute => "height-over-the-whole-flight",
        Sign::Restart | Sign::Gate | Sign::Latched => "events",
    }
}

/// How the landing failed, the limits that it broke, the worst first, and the remaining thrust over
/// the weight; `None` if it kept all, and of a vehicle that came down under its parachute.
fn broken(
    verdict: &Verdict,
    contact_s: f64,
    thrust_over_weight: Option<f64>,
    before: &[Finding],
) -> Option<Finding> {
    // A body strike or a fall is no quantity: its limit has no width.
    let has_width = |limit: &&LimitResult| limit.maximum > limit.minimum;
    let failure = verdict.deciding().find(|limit| !limit.passed && !has_width(limit));
    let limits: Vec<&LimitResult> = match failure {
        Some(failure) if failure.name == UNDER_PARACHUTE => return None,
        Some(_) => verdict.of_the_legs().collect(),
        None => verdict.deciding().collect(),
    };
    let broken = worst_first(limits.into_iter().filter(|limit| !limit.passed && has_width(limit)));
    let mut words: Vec<String> = failure.map(|failure| failure.name.clone()).into_iter().collect();
    if let Some(((worst, share), others)) = broken.split_first() {
        words.push(format!("{} {:.2} {}: {}", worst.name, worst.value.abs(), worst.unit, over(*share)));
        let also: Vec<String> =
            others.iter().map(|(limit, share)| format!("{} {}", limit.name, over(*share))).collect();
        words.extend((!also.is_empty()).then(|| format!("also {}", also.join(", "))));
    }
    if words.is_empty() {
        return None;
    }
    words.extend((words.len() == 1 && before.is_empty()).then(|| "nothing else wrong".to_owned()));
    words.extend(thrust_over_weight.map(|ratio| format!("the thrust was {ratio:.2} of the weight")));
    let (words, follows) = (words.join("; "), !before.is_empty());
    Some(Finding {
        since_s: contact_s,
        clock: Clock::Flight,
        lasted_s: 0.0,
        words,
        follows,
        picture: "limits",
    })
}

/// How far beyond its limit a value is.
pub(crate) fn over(share: f64) -> String {
    if share < 2.0 {
        format!("{:.1} % over its limit", 100.0 * (share - 1.0))
    } else {
        format!("{share:.1} times its limit")
    }
}
