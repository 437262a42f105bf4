//! The self-test at power-up: every actuator is moved and brought back.

/// Fins and gimbal are moved by this much, rad.
const MOVED_RAD: f64 = 0.05;
/// An actuator farther than this from its command counts as not answering, rad.
pub(super) const ANSWERING_RAD: f64 = 0.02;
/// The self-test has failed if it has not passed this long after power-up, s.
const LIMIT_S: f64 = 3.0;

/// Progress of the self-test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SelfTest {
    NotBegun,
    Moved,
    BroughtBack,
    Failed,
}

/// The next action of the self-test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TestStep {
    /// Command every actuator to this angle from its rest, rad.
    Command(f64),
    /// It has passed.
    Passed,
    /// It has failed just now.
    Failed,
    /// Nothing yet.
    Wait,
}

impl SelfTest {
    /// Called until the test has passed, with the time since power-up. `answering`: every actuator has reached its commanded angle.
    pub(super) fn step(&mut self, answering: bool, since_s: f64) -> TestStep {
        match self {
            Self::NotBegun => {
                *self = Self::Moved;
                TestStep::Command(MOVED_RAD)
            }
            Self::Moved if answering => {
                *self = Self::BroughtBack;
                TestStep::Command(0.0)
            }
            Self::BroughtBack if answering => TestStep::Passed,
            Self::Moved | Self::BroughtBack if since_s > LIMIT_S => {
                *self = Self::Failed;
                TestStep::Failed
            }
            Self::Moved | Self::BroughtBack | Self::Failed => TestStep::Wait,
        }
    }
}
