//! Computes the height of the ignition as the flight computer does, from the heard height, speed, drag and fins.
//!
//! The vehicle renews its outlook every 0.05 s near the ignition and every 0.2 s before, and the message has the height and
//! speed of its own instant, so the outlook may be 0.2 s older than they are. The shadow makes the outlook for now and for
//! 0.2 s ago, back along the fall, and allows what lies between them, and 3 m beside: the fins are heard twice a second and turn
//! between. (With 1.5 m one of 100 nominal falls of mk2 is flagged.)

use flight::guidance::vertical::Column;
use flight::vehicle::atmosphere::Air;
use flight::vehicle::mission::Mission;

use super::heard::{Descent, Fins};

/// Largest age of the outlook, s.
const AGE_S: f64 = 0.2;
/// Allowed beside, m.
const BESIDE_M: f64 = 3.0;

/// The height that the flight computer of this build chooses, m; `None` where none lands.
fn chosen_m(mission: &Mission, descent: &Descent, fins: &Fins, before_s: f64) -> Option<f64> {
    let airframe = &mission.airframe;
    let height_m = descent.height_m - descent.vertical_m_s * before_s;
    let density_kg_m3 = Air::at_height_m(mission.pad_altitude_m + height_m).density_kg_m3;
    let mass_kg = airframe.mass.loaded_kg;
    let drag_scale = descent.drag_scale;
    let column = Column::of_mission(mission, mass_kg, density_kg_m3, drag_scale, mission.soft_tilt_deg);
    let fins_m2 = drag_scale * airframe.fin_drag_area_m2(&fins.commanded_rad);
    // The fall brakes or gains by what the air leaves of gravity.
    let area_m2 = drag_scale * airframe.drag_area_m2(0.0) + fins_m2;
    let falls_m_s = -descent.vertical_m_s;
    let drag_m_s2 = 0.5 * density_kg_m3 * area_m2 * falls_m_s * falls_m_s / mass_kg;
    let vertical_m_s = descent.vertical_m_s + (mission.gravity_m_s2 - drag_m_s2) * before_s;
    let outlook = mission.ignition.outlook(&column, &mission.motor_curve, height_m, vertical_m_s, fins_m2);
    outlook.chosen_m
}

/// The expected height, m, if the heard one is not it.
pub(super) fn other_height_m(mission: &Mission, descent: &Descent, fins: &Fins) -> Option<f64> {
    if !descent.chosen_m.is_finite() {
        return None;
    }
    let now_m = chosen_m(mission, descent, fins, 0.0)?;
    let then_m = chosen_m(mission, descent, fins, AGE_S)?;
    let (low_m, high_m) = (now_m.min(then_m) - BESIDE_M, now_m.max(then_m) + BESIDE_M);
    let expected = (low_m..=high_m).contains(&descent.chosen_m);
    (!expected).then_some(now_m)
}
