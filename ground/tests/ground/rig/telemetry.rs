//! The telemetry of the vehicle of a rig.

use mavlink::types::CharArray;
use protocol::dialect::{
    ATTITUDE_QUATERNION_DATA, LOCAL_POSITION_NED_DATA, MavMessage, TD_CONTROLLER_DATA, TD_DESCENT_DATA,
    TD_FINDING_DATA, TD_FINS_DATA, TD_GIMBAL_DATA, TD_LANDING_VERDICT_DATA, TD_PREDICTED_PATH_DATA,
    TD_TOUCHDOWN_LIMITS_DATA, TD_TOUCHDOWN_PREDICTION_DATA, TdBooster, TdChute, TdControlLevel, TdLanding,
    TdLimit, TdMotor, TdSolverStatus,
};

use super::Rig;

impl Rig {
    /// State in the plane of north and up: position, velocity and pitch.
    pub(crate) fn state(&mut self, x: f32, altitude: f32, vx: f32, climb: f32, pitch_deg: f64) {
        let (sin, cos) = libm::sincos(pitch_deg.to_radians() / 2.0);
        self.attitude([cos, 0.0, sin, 0.0], [0.0, -0.005, 0.0]);
        self.motion([x, 0.0, -altitude], [vx, 0.0, -climb]);
    }

    /// State in space: position and velocity north, east and up, and the lean with its heading.
    pub(crate) fn state_in_space(
        &mut self,
        position: [f32; 3],
        velocity: [f32; 3],
        (heading_deg, lean_deg): (f64, f64),
    ) {
        // Upright is a quarter turn about east; the lean is a rotation about the horizontal axis
        // across the heading.
        let (sin_lean, cos_lean) = libm::sincos(lean_deg.to_radians() / 2.0);
        let (across_north, across_east) = {
            let (sin, cos) = libm::sincos(heading_deg.to_radians());
            (sin * sin_lean, -cos * sin_lean)
        };
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (w, x, y) = (cos_lean, across_north, across_east);
        self.attitude([half * (w - y), half * x, half * (w + y), half * x], [0.0, -0.02, 0.03]);
        let down = |[north, east, up]: [f32; 3]| [north, east, -up];
        self.motion(down(position), down(velocity));
    }

    fn attitude(&mut self, [q1, q2, q3, q4]: [f64; 4], [rollspeed, pitchspeed, yawspeed]: [f32; 3]) {
        let [q1, q2, q3, q4] = [q1, q2, q3, q4].map(|part| part as f32);
        self.receive(&MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
            time_boot_ms: self.boot_ms(),
            q1,
            q2,
            q3,
            q4,
            rollspeed,
            pitchspeed,
            yawspeed,
            ..Default::default()
        }));
    }

    fn motion(&mut self, [x, y, z]: [f32; 3], [vx, vy, vz]: [f32; 3]) {
        let time_boot_ms = self.boot_ms();
        self.receive(&MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA {
            time_boot_ms,
            x,
            y,
            z,
            vx,
            vy,
            vz,
        }));
    }

    pub(crate) fn actuators(&mut self, gimbal_cdeg: i16) {
        self.actuated_fins();
        self.gimbal([(gimbal_cdeg, gimbal_cdeg / 2), (0, 0)]);
    }

    /// Commanded and measured, in the pitch and in the yaw plane.
    pub(crate) fn gimbal(&mut self, [pitch, yaw]: [(i16, i16); 2]) {
        self.receive(&MavMessage::TD_GIMBAL(TD_GIMBAL_DATA {
            boot_number: self.boot_number,
            time_boot_ms: self.boot_ms(),
            pitch_commanded: pitch.0,
            pitch_measured: pitch.1,
            yaw_commanded: yaw.0,
            yaw_measured: yaw.1,
        }));
    }

    /// Every fin fully open.
    pub(crate) fn actuated_fins(&mut self) {
        let time_boot_ms = self.boot_ms();
        self.receive(&MavMessage::TD_FINS(TD_FINS_DATA {
            boot_number: self.boot_number,
            time_boot_ms,
            commanded: [9000; 4],
            measured: [9000, 8990, 9000, 8400],
        }));
    }

    /// The controller level and the state of its solver.
    pub(crate) fn controller(&mut self, level: TdControlLevel) {
        self.receive(&MavMessage::TD_CONTROLLER(TD_CONTROLLER_DATA {
            boot_number: self.boot_number,
            time_boot_ms: self.boot_ms(),
            solve_time_us: 1_234,
            deadline_margin_us: 98_766,
            iterations: 3,
            level,
            solver_status: TdSolverStatus::TD_SOLVER_STATUS_CONVERGED,
        }));
    }

    pub(crate) fn plan(&mut self, violated: TdLimit) {
        let time_boot_ms = self.boot_ms();
        self.controller(TdControlLevel::TD_CONTROL_LEVEL_CONVERGED);
        self.receive(&MavMessage::TD_TOUCHDOWN_PREDICTION(TD_TOUCHDOWN_PREDICTION_DATA {
            boot_number: self.boot_number,
            time_boot_ms,
            time_to_go_ms: 2_300,
            distance_m: 1.4,
            height_m: 0.0,
            vertical_m_s: -0.05,
            lateral_m_s: 0.03,
            tilt_rad: 0.016,
            rate_rad_s: 0.008,
            limits_violated: violated,
        }));
        let points: Vec<(f64, f64)> =
            (0..12).rev().map(|k| (-1.4 + 0.1 * f64::from(k), 0.6 * f64::from(k))).collect();
        self.path(&points);
    }

    /// A plan inside every limit along these points, north and up.
    pub(crate) fn plan_along(&mut self, points: &[(f64, f64)]) {
        self.plan(TdLimit::empty());
        self.path(points);
    }

    fn path(&mut self, points: &[(f64, f64)]) {
        let (mut x, mut altitude) = ([0; 12], [0; 12]);
        for (place, (north, up)) in points.iter().enumerate() {
            x[place] = (100.0 * north).round() as i16;
            altitude[place] = (100.0 * up).round() as i16;
        }
        self.receive(&MavMessage::TD_PREDICTED_PATH(TD_PREDICTED_PATH_DATA {
            boot_number: self.boot_number,
            x,
            altitude,
            count: points.len() as u8,
        }));
    }

    /// A descent under fins at this height above the pad.
    pub(crate) fn descent(&mut self, height_m: f32) {
        self.descent_with(height_m, -21.5, TdChute::TD_CHUTE_STOWED);
    }

    /// The same with a vertical speed, up, m/s, and a state of the parachute.
    pub(crate) fn descent_with(&mut self, height_m: f32, vertical_speed_m_s: f32, chute: TdChute) {
        self.falls(height_m, vertical_speed_m_s, chute, [0.8, -1.1]);
    }

    /// The same at 100 m with another touchdown: north and east of the pad, m.
    pub(crate) fn descent_to(&mut self, touchdown_m: [f32; 2]) {
        self.falls(100.0, -21.5, TdChute::TD_CHUTE_STOWED, touchdown_m);
    }

    fn falls(&mut self, height_m: f32, vertical_speed_m_s: f32, chute: TdChute, touchdown_m: [f32; 2]) {
        let falls_to_m = height_m - 58.0;
        let time_to_ignition_s = if falls_to_m > 0.0 { falls_to_m / -vertical_speed_m_s } else { f32::NAN };
        self.receive(&MavMessage::TD_DESCENT(TD_DESCENT_DATA {
            boot_number: self.boot_number,
            time_boot_ms: self.boot_ms(),
            height_m,
            vertical_speed_m_s,
            band_low_m: 48.0,
            band_high_m: 71.5,
            chosen_height_m: 58.0,
            commit_height_m: 95.0,
            time_to_ignition_s,
            wind_x_m_s: 2.4,
            wind_y_m_s: -1.8,
            drag_scale: 1.042,
            thrust_scale: 0.985,
            touchdown_x_m: touchdown_m[0],
            touchdown_y_m: touchdown_m[1],
            chute,
            ..TD_DESCENT_DATA::default()
        }));
    }

    /// TD_DESCENT on the way up, with the apogee that is expected: its height, m, and the time
    /// until then, s.
    pub(crate) fn ascent(&mut self, booster: TdBooster, apogee_m: f32, time_to_apogee_s: f32) {
        self.receive(&MavMessage::TD_DESCENT(TD_DESCENT_DATA {
            boot_number: self.boot_number,
            time_boot_ms: self.boot_ms(),
            height_m: 184.8,
            vertical_speed_m_s: 49.4,
            band_low_m: f32::NAN,
            band_high_m: f32::NAN,
            chosen_height_m: f32::NAN,
            commit_height_m: 0.0,
            time_to_ignition_s: f32::NAN,
            drag_scale: 1.0,
            thrust_scale: 1.0,
            touchdown_x_m: 41.0,
            touchdown_y_m: -3.0,
            chute: TdChute::TD_CHUTE_STOWED,
            booster,
            apogee_m,
            time_to_apogee_s,
            ..TD_DESCENT_DATA::default()
        }));
    }

    /// The design envelope of mk2's legs, and its fence.
    pub(crate) fn limits(&mut self) {
        self.receive(&MavMessage::TD_TOUCHDOWN_LIMITS(TD_TOUCHDOWN_LIMITS_DATA {
            boot_number: self.boot_number,
            vertical_m_s: 1.0,
            lateral_m_s: 0.7,
            tilt_rad: 10_f32.to_radians(),
            rate_rad_s: 30_f32.to_radians(),
            fence_m: 120.0,
            gimbal_limit_rad: 7_f32.to_radians(),
        }));
    }

    pub(crate) fn verdict(&mut self, landed: bool, violated: TdLimit) {
        let (landing, sink_m_s) = if landed { (TdLanding::all(), 0.058) } else { (TdLanding::empty(), 1.2) };
        self.contact([1.428, 0.017, -sink_m_s, 0.029, 0.0078], landing, violated);
    }

    /// A landing at this distance from the pad, m.
    pub(crate) fn verdict_at(&mut self, distance_m: f32) {
        self.contact([distance_m, 0.017, -0.058, 0.029, 0.0078], TdLanding::all(), TdLimit::empty());
    }

    /// What went wrong: the finding at this place of so many.
    pub(crate) fn finding(&mut self, place: u8, found: u8, since_s: f32, text: &str) {
        let mut characters = [0; 96];
        characters[..text.len()].copy_from_slice(text.as_bytes());
        self.receive(&MavMessage::TD_FINDING(TD_FINDING_DATA {
            boot_number: self.boot_number,
            time_boot_ms: self.boot_ms(),
            since_s,
            held_s: 1.0,
            place,
            found,
            text: CharArray::new(characters),
        }));
    }

    /// A verdict with the values at contact: distance, tilt, vertical and lateral speed, rate.
    pub(crate) fn contact(&mut self, figures: [f32; 5], landing: TdLanding, limits_violated: TdLimit) {
        // The motor has burnt out and is hot.
        (self.motor, self.approach_wait_s) = (TdMotor::TD_MOTOR_HOT, 55);
        let [distance_m, tilt_rad, vertical_m_s, lateral_m_s, rate_rad_s] = figures;
        self.receive(&MavMessage::TD_LANDING_VERDICT(TD_LANDING_VERDICT_DATA {
            boot_number: self.boot_number,
            time_boot_ms: self.boot_ms(),
            contact_ms: self.boot_ms(),
            distance_m,
            vertical_m_s,
            lateral_m_s,
            tilt_rad,
            rate_rad_s,
            limits_violated,
            landing,
        }));
    }
}
