//! A ground station on a bench: its model, a clock turned by hand, and a vehicle made of frames.

use std::time::Duration;

use ground::key::Key;
use ground::model::{Model, Settings};
use ground::update::{Action, Msg, update};
use ground::view::theme::Theme;
use ground::view::view;
use protocol::command::CommandAnswer;
use protocol::dialect::{
    ATTITUDE_QUATERNION_DATA, COMMAND_LONG_DATA, HEARTBEAT_DATA, LOCAL_POSITION_NED_DATA, MavAutopilot,
    MavCmd, MavMessage, MavModeFlag, MavState, MavType, TD_CONTROLLER_DATA, TD_DESCENT_DATA, TD_FINS_DATA,
    TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA, TD_LANDING_VERDICT_DATA, TD_PREDICTED_PATH_DATA,
    TD_TOUCHDOWN_LIMITS_DATA, TD_TOUCHDOWN_PREDICTION_DATA, TdAbortEffect, TdCheck, TdChute, TdControlLevel,
    TdInterlock, TdLimit, TdPhase, TdSolverStatus,
};
use protocol::frame::{Encoder, Frame};
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::text::chunks;
use ratatui::Terminal;
use ratatui::backend::TestBackend;

pub(crate) const MONO: Theme = Theme { colour: false, ascii: false };

pub(crate) struct Bench {
    pub(crate) model: Model,
    pub(crate) now: Duration,
    pub(crate) actions: Vec<Action>,
    /// The vehicle, as its telemetry will show it.
    pub(crate) phase: TdPhase,
    pub(crate) armed: bool,
    pub(crate) countdown_ms: i32,
    pub(crate) abort_effect: TdAbortEffect,
    pub(crate) interlocks: TdInterlock,
    pub(crate) checks_failed: u16,
    pub(crate) pad_wait_s: u16,
    /// Whether the vehicle sends anything at all.
    pub(crate) speaks: bool,
    encoder: Encoder,
}

impl Bench {
    pub(crate) fn new(settings: Settings) -> Self {
        Self {
            model: Model::new(settings),
            now: Duration::ZERO,
            actions: Vec::new(),
            phase: TdPhase::TD_PHASE_PAD_IDLE,
            armed: false,
            countdown_ms: i32::MAX,
            abort_effect: TdAbortEffect::TD_ABORT_EFFECT_SAFE_ON_PAD,
            interlocks: TdInterlock::TD_INTERLOCK_PIN_OUT,
            checks_failed: 0,
            pad_wait_s: 0,
            speaks: true,
            encoder: Encoder::new(VEHICLE),
        }
    }

    /// A crewed ground whose vehicle has been heard.
    pub(crate) fn crewed() -> Self {
        let mut bench = Self::new(settings(false, true));
        bench.run(1.0);
        bench
    }

    pub(crate) fn msg(&mut self, msg: Msg) {
        let actions = update(&mut self.model, msg, self.now);
        self.actions.extend(actions);
    }

    pub(crate) fn key(&mut self, key: Key) {
        self.msg(Msg::Key(key));
    }

    pub(crate) fn keys(&mut self, keys: &[Key]) {
        for key in keys {
            self.key(*key);
        }
    }

    /// Ctrl-X, then Enter.
    pub(crate) fn abort(&mut self) {
        self.keys(&[Key::CtrlX, Key::Enter]);
    }

    /// Ctrl-X twice, by an unhurried finger, and the proof that it is not held.
    pub(crate) fn abort_chord(&mut self) {
        self.key(Key::CtrlX);
        self.run(0.4);
        self.key(Key::CtrlX);
        self.run(0.2);
    }

    /// A key held on a terminal that tells no repeats: pressed, again after the keyboard's delay, then on
    /// and on. A tick every 10 ms, as the run loop may bring them.
    pub(crate) fn hold(&mut self, key: Key, delay_ms: u64, period_ms: u64, seconds: u64) {
        for elapsed_ms in (0..seconds * 1_000).step_by(1) {
            let repeats = elapsed_ms >= delay_ms && (elapsed_ms - delay_ms).is_multiple_of(period_ms);
            if elapsed_ms == 0 || repeats {
                self.key(key);
            }
            if elapsed_ms.is_multiple_of(10) {
                self.msg(Msg::Tick);
            }
            self.now += Duration::from_millis(1);
        }
    }

    /// Ten ticks a second; the vehicle speaks at its usual rates.
    pub(crate) fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 10.0).round() as u64 {
            self.now += Duration::from_millis(100);
            if self.speaks {
                if self.now.subsec_millis() == 0 {
                    self.heartbeat();
                }
                self.flight_status();
            }
            self.msg(Msg::Tick);
        }
    }

    pub(crate) fn boot_ms(&self) -> u32 {
        u32::try_from(self.now.as_millis()).unwrap_or(u32::MAX)
    }

    pub(crate) fn hear(&mut self, message: &MavMessage) {
        let frame = self.encoder.encode(message);
        self.msg(Msg::Frame(frame));
    }

    pub(crate) fn hear_from(&mut self, source: Address, message: &MavMessage) {
        let frame = Encoder::new(source).encode(message);
        self.msg(Msg::Frame(frame));
    }

    pub(crate) fn hear_payload(&mut self, message_id: u32, payload: &[u8]) {
        if let Some(frame) = self.encoder.encode_payload(message_id, payload) {
            self.msg(Msg::Frame(frame));
        }
    }

    pub(crate) fn heartbeat(&mut self) {
        let base_mode =
            if self.armed { MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED } else { MavModeFlag::empty() };
        let phase = self.phase as u32;
        self.hear(&MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            custom_mode: phase,
            mavtype: MavType::MAV_TYPE_ROCKET,
            autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
            base_mode,
            system_status: MavState::MAV_STATE_ACTIVE,
            mavlink_version: 3,
        }));
    }

    pub(crate) fn flight_status(&mut self) {
        let status = TD_FLIGHT_STATUS_DATA {
            time_boot_ms: self.boot_ms(),
            countdown_ms: self.countdown_ms,
            interlocks: self.interlocks,
            checks_failed: TdCheck::from_bits_truncate(self.checks_failed),
            pad_wait_s: self.pad_wait_s,
            phase: self.phase,
            abort_effect: self.abort_effect,
        };
        self.hear(&MavMessage::TD_FLIGHT_STATUS(status));
    }

    pub(crate) fn answer(&mut self, command: MavCmd, result: u8) {
        self.answer_to(GROUND, command, result);
    }

    pub(crate) fn answer_to(&mut self, target: Address, command: MavCmd, result: u8) {
        let answer = CommandAnswer { command: command as u16, result, progress: 0, target };
        let frame: Option<Frame> = answer.encode(&mut self.encoder);
        if let Some(frame) = frame {
            self.msg(Msg::Frame(frame));
        }
    }

    pub(crate) fn text(&mut self, text: &str) {
        for chunk in chunks(protocol::dialect::MavSeverity::MAV_SEVERITY_WARNING, text, 7) {
            self.hear(&MavMessage::STATUSTEXT(chunk));
        }
    }

    /// In the plane of north and up: at an altitude, moving, pitched.
    pub(crate) fn state(&mut self, x: f32, altitude: f32, vx: f32, climb: f32, pitch_deg: f64) {
        let (sin, cos) = libm::sincos(pitch_deg.to_radians() / 2.0);
        self.attitude([cos, 0.0, sin, 0.0], [0.0, -0.005, 0.0]);
        self.motion([x, 0.0, -altitude], [vx, 0.0, -climb]);
    }

    /// In space: position and velocity north, east and up; leaning towards this heading by this much.
    pub(crate) fn state_in_space(
        &mut self,
        position: [f32; 3],
        velocity: [f32; 3],
        (heading_deg, lean_deg): (f64, f64),
    ) {
        // Upright is a quarter turn about east; the lean turns about the horizontal across the heading.
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
        self.hear(&MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
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
        self.hear(&MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA {
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
        self.hear(&MavMessage::TD_GIMBAL(TD_GIMBAL_DATA {
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
        self.hear(&MavMessage::TD_FINS(TD_FINS_DATA {
            time_boot_ms,
            commanded: [9000; 4],
            measured: [9000, 8990, 9000, 8400],
        }));
    }

    /// What acts, and how its solver does.
    pub(crate) fn controller(&mut self, level: TdControlLevel) {
        self.hear(&MavMessage::TD_CONTROLLER(TD_CONTROLLER_DATA {
            time_boot_ms: self.boot_ms(),
            tick: 12,
            cost: 8465.2,
            kkt_stationarity: 2.4e-7,
            kkt_feasibility: 1.1e-9,
            thrust_scale: 1.0,
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
        self.hear(&MavMessage::TD_TOUCHDOWN_PREDICTION(TD_TOUCHDOWN_PREDICTION_DATA {
            time_boot_ms,
            time_to_go_ms: 2_300,
            x_m: -1.4,
            altitude_m: 0.0,
            pitch_rad: 1.555,
            u_m_s: -0.05,
            w_m_s: 0.03,
            q_rad_s: -0.008,
            limits_violated: violated,
        }));
        let points: Vec<(f64, f64)> =
            (0..12).rev().map(|k| (-1.4 + 0.1 * f64::from(k), 0.6 * f64::from(k))).collect();
        self.path(&points);
    }

    /// A plan that lands, along these points, north and up.
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
        self.hear(&MavMessage::TD_PREDICTED_PATH(TD_PREDICTED_PATH_DATA {
            time_boot_ms: self.boot_ms(),
            x,
            altitude,
            count: points.len() as u8,
        }));
    }

    /// Coming down under fins, this far above the pad.
    pub(crate) fn descent(&mut self, height_m: f32) {
        self.hear(&MavMessage::TD_DESCENT(TD_DESCENT_DATA {
            time_boot_ms: self.boot_ms(),
            height_m,
            vertical_speed_m_s: -21.5,
            band_low_m: 48.0,
            band_high_m: 71.5,
            chosen_height_m: 58.0,
            commit_height_m: 95.0,
            time_to_ignition_s: (height_m - 58.0) / 21.5,
            wind_x_m_s: 2.4,
            wind_y_m_s: -1.8,
            drag_scale: 1.042,
            thrust_scale: 0.985,
            touchdown_x_m: 0.8,
            touchdown_y_m: -1.1,
            chute: TdChute::TD_CHUTE_STOWED,
        }));
    }

    /// What counts as a landing for this vehicle: Table 2 of the landing paper.
    pub(crate) fn limits(&mut self) {
        self.touchdown_limits([20.0, 5.0, 0.4, 0.1, 2.0, 20.0]);
    }

    /// What counts as a landing for mk2: what its legs take, inside its fence.
    pub(crate) fn limits_of_legs(&mut self) {
        self.touchdown_limits([120.0, 10.0, 1.0, 0.7, 30.0, 7.0]);
    }

    fn touchdown_limits(&mut self, [x_m, pitch_deg, u_m_s, w_m_s, q_deg_s, gimbal_deg]: [f32; 6]) {
        self.hear(&MavMessage::TD_TOUCHDOWN_LIMITS(TD_TOUCHDOWN_LIMITS_DATA {
            x_m,
            altitude_min_m: 0.0,
            altitude_max_m: 0.2,
            pitch_error_rad: pitch_deg.to_radians(),
            u_m_s,
            w_m_s,
            q_rad_s: q_deg_s.to_radians(),
            gimbal_limit_rad: gimbal_deg.to_radians(),
        }));
    }

    pub(crate) fn verdict(&mut self, landed: bool, violated: TdLimit) {
        self.contact([-1.428, 1.554, if landed { -0.058 } else { -1.2 }, 0.029, -0.0078], landed, violated);
    }

    /// The figures of a contact: distance, pitch, speeds, rate.
    pub(crate) fn contact(&mut self, figures: [f32; 5], landed: bool, limits_violated: TdLimit) {
        let [x_m, pitch_rad, u_m_s, w_m_s, q_rad_s] = figures;
        self.hear(&MavMessage::TD_LANDING_VERDICT(TD_LANDING_VERDICT_DATA {
            time_boot_ms: self.boot_ms(),
            x_m,
            altitude_m: 0.0,
            pitch_rad,
            u_m_s,
            w_m_s,
            q_rad_s,
            limits_violated,
            landed: u8::from(landed),
        }));
    }

    /// Takes everything done since the last call; of that, the commands sent.
    pub(crate) fn take_commands(&mut self) -> Vec<COMMAND_LONG_DATA> {
        let commands = self.commands();
        self.actions.clear();
        commands
    }

    /// The commands sent since the last taking.
    pub(crate) fn commands(&self) -> Vec<COMMAND_LONG_DATA> {
        let command = |action: &Action| match action {
            Action::Send(message) => match &**message {
                MavMessage::COMMAND_LONG(command) => Some(command.clone()),
                _ => None,
            },
            _ => None,
        };
        self.actions.iter().filter_map(command).collect()
    }

    pub(crate) fn wants_to_quit(&self) -> bool {
        self.actions.contains(&Action::Quit)
    }

    pub(crate) fn events(&self) -> String {
        self.model.events.newest(500).map(|event| event.text.as_str()).collect::<Vec<_>>().join("\n")
    }

    pub(crate) fn screen(&self, columns: u16, rows: u16) -> String {
        let terminal = self.draw(columns, rows, MONO);
        terminal.backend().to_string()
    }

    pub(crate) fn draw(&self, columns: u16, rows: u16, theme: Theme) -> Terminal<TestBackend> {
        let mut terminal = Terminal::new(TestBackend::new(columns, rows)).expect("a test terminal");
        terminal.draw(|frame| view(&self.model, theme, self.now, frame)).expect("drawing in memory");
        terminal
    }
}

pub(crate) fn settings(auto: bool, interactive: bool) -> Settings {
    let log_path = Some("flight.mcap".to_owned());
    Settings { log_path, auto, interactive, ..Settings::on_screen("udpin:127.0.0.1:14550") }
}

pub(crate) fn is_arm(command: &COMMAND_LONG_DATA) -> bool {
    command.command == MavCmd::MAV_CMD_COMPONENT_ARM_DISARM && command.param1 > 0.5
}

pub(crate) fn is_abort(command: &COMMAND_LONG_DATA) -> bool {
    command.command == MavCmd::MAV_CMD_DO_FLIGHTTERMINATION && command.param1 > 0.5
}

pub(crate) fn typed(word: &str) -> Vec<Key> {
    word.chars().map(Key::Char).collect()
}
