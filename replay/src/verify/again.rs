//! Flies a simulated flight again, closed loop, from the facts in its log: what does not follow from the flight computer's
//! inputs (its measurements, the verdict) follows from the seed.

use std::path::Path;

use prost::Message as _;
use protocol::log::v1::LandingVerdict;

use super::parts::Part;
use crate::controller::AgainError;
use crate::log::{Moment, Recording};
use crate::refly::{ReflyOptions, refly_flight};

/// The facts that a simulated flight is drawn from.
const DRAWN_FROM: [&str; 3] = ["seed", "flight", "dispersion"];

/// What of the metadata no flight follows from.
const BESIDE: &str =
    "what the flight is drawn from; start_unix_ns, the build and touchdown.xml are not compared";

/// Compares the verdict and the run facts of a log of one flight.
pub(super) fn compare(path: &Path, simulated: bool, verdict: &mut Part, facts: &mut Part) {
    let flown = Recording::open(path).map_err(AgainError::from).and_then(|recording| {
        let is_drawn = DRAWN_FROM.iter().any(|fact| recording.head.run.contains_key(*fact));
        if !simulated && !is_drawn {
            return Ok(None);
        }
        // Up to its last frame it is compared frame by frame, and then its end.
        let start =
            recording.frames.last().map(|last| Moment::Frame(recording.release_frame + last.input.frame));
        let options = ReflyOptions { start, ..ReflyOptions::default() };
        let (report, reflown) = refly_flight(&recording, &options)?;
        let bytes = |verdict: Option<&LandingVerdict>| verdict.map(LandingVerdict::encode_to_vec);
        let same = bytes(recording.verdict.as_ref()) == bytes(reflown.verdict.as_ref());
        Ok(Some((report.reached.first_different, same)))
    });
    match flown {
        Ok(None) => {
            for part in [verdict, facts] {
                part.follows = false;
                part.why = Some("no simulated flight: nothing to draw it from again".to_owned());
            }
        }
        Ok(Some((first_different, same_verdict))) => {
            facts.compare(first_different.is_none());
            facts.why = Some(match first_different {
                Some(frame) => format!("drawn again, the flight is another one from frame {frame} on"),
                None => BESIDE.to_owned(),
            });
            verdict.compare(same_verdict);
            verdict.why = (!same_verdict).then(|| "flown again, the flight ends otherwise".to_owned());
        }
        Err(error) => {
            let why = format!("cannot be flown again: {error}");
            (verdict.why, facts.why) = (Some(why.clone()), Some(why));
        }
    }
}
