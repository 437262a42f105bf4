//! The motor and the fin opening that a plan assumes.
//!
//! Surplus thrust can be wasted late in the burn, missing thrust cannot be made up. A plan is therefore made for a
//! motor that is weaker than estimated, by the number of standard deviations that the mission sets as its caution. The
//! motor must not be so weak that no landing is possible: such a plan would turn the vehicle across the air to brake,
//! and spoil the landing for every stronger motor. So the plan takes the weakest of these motors that can still land
//! from here. The fins are assumed as open as they would be with that motor, because they follow the motor's estimate.
//!
//! High in the band of feasible heights, a hard landing in a plan has another cause: the plan has not found a way to sink
//! faster. There the motor as estimated is tried as well, and the guidance flies a hard plan rather than braking upright,
//! which helps a vehicle that is too low and makes this vehicle hover.

use super::known::{Burning, Known};
use crate::estimation::estimator::Estimate;
use crate::guidance::powered::PoweredSituation;
use crate::guidance::vertical::{Band, share_for};
use crate::vehicle::burn::Burn;

/// Number of steps from full caution to none.
const CAUTION_STEPS: u32 = 3;

/// Above this place in the band a vehicle is high. Halved and doubled: 144, 144. Of 600 `real` flights (seeds 77 and 78) 545 land,
/// 542 if no vehicle counts as high; none lands only then.
const HIGH_PLACE: f64 = 0.5;

/// A motor, and how far open its fins would be on average until touchdown, 0 to 1.
struct Assumed<'a> {
    burn: Burn<'a>,
    fin_share: f64,
}

impl Known {
    /// The preferred situation to plan with, and a fallback for the case that its plan lands hard.
    pub(super) fn situations_to_plan<'a>(
        &'a self,
        estimate: &Estimate,
        burning: &Burning,
        fins_rad: &[f64; 4],
    ) -> (PoweredSituation<'a>, Option<PoweredSituation<'a>>) {
        let column = self.column(burning.density_kg_m3, self.mission.fin_soft_tilt_deg);
        let height_m = estimate.state.position_m.z - self.feet_below_cg_m(&burning.mass);
        let band = |burn: &Burn<'_>| column.band(burn, burning.burning_s, estimate.state.velocity_m_s.z);
        let fin_share = |band: Option<Band>| {
            band.map_or(0.5, |band| share_for(self.mission.fin_place, band.place(height_m)))
        };
        let estimated = self.burn();
        let estimated_band = band(&estimated);
        let high = match &estimated_band {
            Some(band) => band.place(height_m) > HIGH_PLACE,
            None => column.falls_too_slowly(&estimated, burning.burning_s, estimate.state.velocity_m_s.z),
        };
        let situation = |assumed: Assumed<'a>| {
            let kept = self.mission.fins_kept;
            let fin_drag_area_m2 = kept * self.fin_drag_area_m2(fins_rad)
                + (1.0 - kept) * assumed.fin_share * self.largest_fin_drag_area_m2();
            PoweredSituation {
                high,
                ..self.powered_situation(estimate, burning, assumed.burn, fin_drag_area_m2)
            }
        };
        let caution_sigmas = self.caution_sigmas(burning.burning_s);
        // Without caution, only the motor as estimated is tried.
        let steps = if caution_sigmas > 0.0 { CAUTION_STEPS } else { 0 };
        let weaker = (0..steps).find_map(|step| {
            let share = 1.0 - f64::from(step) / f64::from(CAUTION_STEPS);
            let burn = self.doubted_burn(burning.burning_s, -caution_sigmas * share);
            let found = band(&burn).filter(|band| band.place(height_m) >= 0.0)?;
            Some(Assumed { burn, fin_share: fin_share(Some(found)) })
        });
        let as_estimated = || Assumed { burn: estimated, fin_share: fin_share(estimated_band) };
        let fallback = (high && weaker.is_some()).then(as_estimated).map(situation);
        (situation(weaker.unwrap_or_else(as_estimated)), fallback)
    }

    /// By how many standard deviations a plan takes the motor to be weaker than estimated: the mission's full caution
    /// early, none in the last moments, when no thrust can be wasted any more.
    fn caution_sigmas(&self, burning_s: f64) -> f64 {
        let carried_until_s =
            self.burn().falls_through_weight_s(self.mass.at(0.0).mass_kg, self.mission.gravity_m_s2);
        let left_s = carried_until_s.unwrap_or(0.0) - burning_s;
        self.mission.caution_sigmas * (left_s / self.mission.caution_fades_s).clamp(0.0, 1.0)
    }
}
