//! What went wrong in a flight: what its computer shows when it is run again on the log's frames,
//! and the limits that the landing broke.

use flight::computer::findings::{Findings, Sign};
use foxglove::messages::log::Level;
use protocol::log::computer_v1::ComputerFrame;
use serde::Serialize;

use crate::controller::{FrameError, LoggedComputer};
use crate::log::{Clock, ClockTime, Recording, Verdict, worst_first};

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

/// The findings of a recorded flight, first in time; `None` if its computer cannot be run again, or
/// decides otherwise than it did: what it would have commanded says nothing of surfaces that
/// followed other commands.
pub(crate) fn of(recording: &Recording, verdict: Option<&Verdict>) -> Option<Vec<Finding>> {
    let again = run_again(recording, LoggedComputer::run_again);
    facts(recording, verdict, again.and_then(|(_, findings)| findings))
}

/// What the vehicle itself reported before its release, each once; all it reported if it was never
/// released.
fn on_the_pad(recording: &Recording) -> Vec<Finding> {
    let (clock, zero_s, end_s) = match recording.clocks.flight_zero_s {
        Some(zero_s) => (Clock::Flight, zero_s, zero_s),
        None => (Clock::Log, 0.0, f64::INFINITY),
    };
    let mut facts: Vec<Finding> = Vec::new();
    for (log_s, event) in recording.events.iter().filter(|(log_s, _)| *log_s < end_s) {
        let serious = event.name == "vehicle" && event.level >= Level::Warning as i32;
        if serious && facts.iter().all(|known| known.words != event.message) {
            let words = event.message.clone();
            facts.push(Finding { since_s: log_s - zero_s, clock, lasted_s: 0.0, words, picture: "events" });
        }
    }
    facts
}

/// The computer of a recorded flight after all its frames, each of which `run` has run again;
/// `None` if that cannot be. Beside it what it shows; `None` if it decides otherwise than it did.
pub(crate) fn run_again(
    recording: &Recording,
    mut run: impl FnMut(&mut LoggedComputer, &ComputerFrame) -> Result<ComputerFrame, FrameError>,
) -> Option<(LoggedComputer, Option<Findings>)> {
    let (start, frames) = recording.replayable_frames().ok()?;
    let toml = recording.profile_toml().ok()?;
    let mut computer = LoggedComputer::recorded(toml, start, &recording.head.run, &[]).ok()?;
    let mut findings = Some(Findings::default());
    for frame in frames {
        let again = run(&mut computer, frame).ok()?;
        findings = findings.filter(|_| again.output == frame.output);
        if let Some(findings) = &mut findings {
            findings.note(computer.computer());
        }
    }
    Some((computer, findings))
}

/// What the vehicle said on its pad, the findings of a computer that was run again with the
/// recorded decisions, and the limits that were broken.
pub(crate) fn facts(
    recording: &Recording,
    verdict: Option<&Verdict>,
    findings: Option<Findings>,
) -> Option<Vec<Finding>> {
    let Some(findings) = findings else {
        return (recording.frames.is_empty() && recording.from_power_up).then(|| on_the_pad(recording));
    };
    let mut facts = on_the_pad(recording);
    facts.extend(findings.found().iter().map(|finding| Finding {
        since_s: finding.since_s,
        clock: Clock::Flight,
        lasted_s: finding.held_s,
        words: finding.words(),
        picture: picture(finding.sign),
    }));
    if let Some(words) = verdict.and_then(|verdict| broken(verdict, &findings, facts.is_empty())) {
        let since_s = recording.contact_s().unwrap_or(f64::NAN);
        facts.push(Finding { since_s, clock: Clock::Flight, lasted_s: 0.0, words, picture: "limits" });
    }
    Some(facts)
}

/// The pictures of the fins.
pub(crate) const FINS: [&str; 4] = ["fin-1", "fin-2", "fin-3", "fin-4"];

fn picture(sign: Sign) -> &'static str {
    match sign {
        Sign::Gnss | Sign::Barometer | Sign::Lidar | Sign::Accelerometer | Sign::HeightsDisagree => {
            "test-ratio"
        }
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

/// The limits that a landing broke, the worst first, and what the motor still pushed; `None` if it
/// kept all.
fn broken(verdict: &Verdict, findings: &Findings, nothing_else: bool) -> Option<String> {
    // A vehicle that comes down under its parachute is judged by nothing else.
    let judged = verdict.deciding().all(|limit| limit.maximum > limit.minimum);
    let broken = worst_first(verdict.deciding().filter(|limit| judged && !limit.passed));
    let ((worst, share), others) = broken.split_first()?;
    let also: Vec<String> =
        others.iter().map(|(limit, share)| format!("{} {}", limit.name, over(*share))).collect();
    let mut words = vec![format!("{} {:.2} {}: {}", worst.name, worst.value.abs(), worst.unit, over(*share))];
    if !also.is_empty() {
        words.push(format!("also {}", also.join(", ")));
    } else if nothing_else {
        words.push("nothing else wrong".to_owned());
    }
    let ratio = findings.thrust_over_weight_at_contact();
    words.extend(ratio.map(|ratio| format!("the thrust was {ratio:.2} of the weight")));
    Some(words.join("; "))
}

/// How far beyond its limit a value is.
pub(crate) fn over(share: f64) -> String {
    if share < 2.0 {
        format!("{:.1} % over its limit", 100.0 * (share - 1.0))
    } else {
        format!("{share:.1} times its limit")
    }
}
