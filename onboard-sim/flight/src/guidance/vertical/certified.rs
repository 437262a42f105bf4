//! The vertical motion of a mission's vehicle as its data say.

use super::{Braking, Column};
use crate::vehicle::mission::Mission;

impl Column {
    /// The column of a mission's vehicle before ignition, with all drag along the axis multiplied by `air_scale` (1 as
    /// certified), and with a largest tilt, degrees.
    pub fn of_mission(
        mission: &Mission,
        mass_at_ignition_kg: f64,
        air_density_kg_m3: f64,
        air_scale: f64,
        soft_tilt_deg: f64,
    ) -> Self {
        let airframe = &mission.airframe;
        let body = &airframe.body;
        let scaled = |area_m2: f64| air_scale * area_m2;
        let body_drag_area_m2 = airframe.drag_area_m2(0.0);
        let open_fins_m2 = airframe.fin_drag_area_m2(&[airframe.fins.open_rad(); 4]);
        let final_box = &mission.powered.final_box;
        Self {
            mass_at_ignition_kg,
            gravity_m_s2: mission.gravity_m_s2,
            air_density_kg_m3,
            body_drag_area_m2: scaled(body_drag_area_m2),
            burning_body_drag_area_m2: scaled(body_drag_area_m2 * (1.0 - mission.exhaust.body_loss)),
            crossflow_area_m2: body.crossflow_drag_coefficient * body.length_m * body.diameter_m,
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
