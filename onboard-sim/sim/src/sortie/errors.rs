//! The estimate against the truth.

use flight::estimation::estimator::Estimate;
use flight::vehicle::rigid::RigidState;
use world::World;

use super::Sortie;

/// Errors of the estimate against the truth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EstimatorErrors {
    /// Vertical velocity, m/s.
    pub vertical_m_s: f64,
    /// Horizontal velocity, m/s.
    pub lateral_m_s: f64,
    pub height_m: f64,
    /// Angle between the estimated and the true nose, rad.
    pub nose_rad: f64,
}

impl EstimatorErrors {
    /// The larger value of each error.
    pub(super) fn or_larger(self, other: &Self) -> Self {
        Self {
            vertical_m_s: self.vertical_m_s.max(other.vertical_m_s),
            lateral_m_s: self.lateral_m_s.max(other.lateral_m_s),
            height_m: self.height_m.max(other.height_m),
            nose_rad: self.nose_rad.max(other.nose_rad),
        }
    }
}

impl Sortie {
    /// Normalised estimation error squared of the motion ([`Estimator::nees_of_motion`]); `None` if the pilot gets the
    /// truth instead of an estimate, and while its computer is dead.
    ///
    /// [`Estimator::nees_of_motion`]: flight::estimation::estimator::Estimator::nees_of_motion
    pub fn nees_of_motion(&self) -> Option<f64> {
        self.measured().filter(|_| !self.dead)?;
        self.pilot().estimator().nees_of_motion(&self.over_the_ground())
    }

    /// The true state with its height above the ground below it, which is what a landing needs and what the lidar shows.
    fn over_the_ground(&self) -> RigidState {
        let mut state = *self.world().state();
        state.position_m.z -= self.world().truth().ground_m(state.position_m.x, state.position_m.y);
        state
    }

    /// Normalised estimation error squared of the motor's impulse scale and burn time ([`MotorEstimate::nees_of_scales`]);
    /// `None` if the pilot gets the truth instead of an estimate, and before the motor has lit. The accelerometer cannot
    /// tell more impulse from less mass.
    ///
    /// [`MotorEstimate::nees_of_scales`]: flight::estimation::motor_estimate::MotorEstimate::nees_of_scales
    pub fn nees_of_motor(&self) -> Option<f64> {
        self.measured().filter(|_| !self.dead)?;
        let motor = self.pilot().motor();
        motor.ignition_s()?;
        let truth = self.world().truth();
        motor.nees_of_scales(truth.impulse_scale / truth.mass_scale, truth.burn_time_scale)
    }

    /// Errors of the estimate at this moment.
    pub fn errors(&self) -> EstimatorErrors {
        let Some(estimate) = self.pilot().estimate() else { return EstimatorErrors::default() };
        let truth = self.over_the_ground();
        let velocity = estimate.state.velocity_m_s - truth.velocity_m_s;
        EstimatorErrors {
            vertical_m_s: velocity.z.abs(),
            lateral_m_s: libm::hypot(velocity.x, velocity.y),
            height_m: (estimate.state.position_m.z - truth.position_m.z).abs(),
            nose_rad: (estimate.state.nose_in_world() - truth.nose_in_world()).norm(),
        }
    }
}

/// The truth, in the form of an estimate.
pub(crate) fn known(world: &World) -> Estimate {
    Estimate::exact(world.time_s(), *world.state(), *world.specific_force_m_s2(), world.wind_m_s().xy())
}
