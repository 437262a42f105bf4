//! A test rig: a model, a simulated clock, and a vehicle that exists only as frames.

pub(crate) mod svg;
mod telemetry;

use std::time::Duration;

use ground::key::Key;
use ground::model::{KeyTiming, Model, Settings, is_flight};
use ground::update::{Action, Msg, update};
use ground::view::draw;
use ground::view::theme::{Palette, Theme};
use protocol::command::CommandAnswer;
use protocol::dialect::{
    COMMAND_LONG_DATA, HEARTBEAT_DATA, MavAutopilot, MavCmd, MavMessage, MavModeFlag, MavState, MavType,
    TD_EVENTS_DATA, TD_FLIGHT_STATUS_DATA, TD_UPLINK_DATA, TdAbortEffect, TdCheck, TdHold, TdInterlock,
    TdLatch, TdMotor, TdPhase, TdVehicleFlag,
};
use protocol::frame::{Encoder, Frame};
use protocol::identity::{Address, GROUND, PHASE_BITS, VEHICLE};
use protocol::text::chunks;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Cell;
use ratatui::style::{Color, Modifier};

/// The session of the station.
pub(crate) const SESSION: u32 = 77;

pub(crate) const MONO: Theme = Theme { palette: Palette::None, ascii: false };

pub(crate) struct Rig {
    pub(crate) model: Model,
    pub(crate) now: Duration,
    pub(crate) actions: Vec<Action>,
    /// The state of the vehicle that its telemetry will show.
    pub(crate) phase: TdPhase,
    pub(crate) armed: bool,
    pub(crate) countdown_ms: i32,
    pub(crate) abort_effect: TdAbortEffect,
    pub(crate) interlocks: TdInterlock,
    pub(crate) checks_failed: u32,
    pub(crate) boot_number: u32,
    pub(crate) uid: u16,
    /// Whether both of its flags are set.
    pub(crate) simulated: bool,
    /// Whether the heartbeat of a simulated vehicle says so, too.
    pub(crate) hil: bool,
    pub(crate) motor: TdMotor,
    pub(crate) approach_wait_s: u16,
    pub(crate) hold: TdHold,
    pub(crate) latch: TdLatch,
    /// Whether the vehicle sends anything at all.
    pub(crate) speaks: bool,
    /// How many times as long as real time it takes, as an emulated one does.
    pub(crate) slower: u32,
    /// Whether it reports that it receives this station.
    pub(crate) uplink_alive: bool,
    /// Whether it was this station that armed it.
    pub(crate) armed_here: bool,
    uplink_at: Duration,
    /// When the vehicle was switched on.
    booted_at: Duration,
    encoder: Encoder,
    /// The events so far, and the release.
    flown: (TD_EVENTS_DATA, Duration),
}

impl Rig {
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
            boot_number: 0x1A2B_3C4D,
            uid: 77,
            simulated: true,
            hil: true,
            motor: TdMotor::TD_MOTOR_LIVE,
            approach_wait_s: 0,
            hold: TdHold::TD_HOLD_NONE,
            latch: TdLatch::TD_LATCH_NONE,
            speaks: true,
            slower: 1,
            uplink_alive: true,
            armed_here: true,
            uplink_at: Duration::ZERO,
            booted_at: Duration::ZERO,
            encoder: Encoder::new(VEHICLE),
            flown: Default::default(),
        }
    }

    /// A ground station with a crew that has received its vehicle.
    pub(crate) fn crewed() -> Self {
        let mut rig = Self::new(settings(false, true));
        rig.run(1.0);
        rig
    }

    pub(crate) fn msg(&mut self, msg: Msg) {
        let actions = update(&mut self.model, msg, self.now);
        self.actions.extend(actions);
    }

    /// A key that is typed some time after the previous one.
    pub(crate) fn key(&mut self, key: Key) {
        self.model.key_timing = KeyTiming::default();
        self.press(key);
    }

    /// A key at this moment.
    pub(crate) fn press(&mut self, key: Key) {
        self.msg(Msg::Keys(vec![key]));
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

    /// Ctrl-X twice, then a pause that shows that it is not held.
    pub(crate) fn abort_chord(&mut self) {
        self.key(Key::CtrlX);
        self.run(0.4);
        self.key(Key::CtrlX);
        self.run(0.2);
    }

    /// A key that is held on a terminal that does not report repeats: a press, a repeat after the
    /// keyboard's delay, then further repeats. A tick every 10 ms.
    pub(crate) fn hold(&mut self, key: Key, delay_ms: u64, period_ms: u64, seconds: u64) {
        for elapsed_ms in (0..seconds * 1_000).step_by(1) {
            let repeats = elapsed_ms >= delay_ms && (elapsed_ms - delay_ms).is_multiple_of(period_ms);
            if elapsed_ms == 0 || repeats {
                self.press(key);
            }
            if elapsed_ms.is_multiple_of(10) {
                self.msg(Msg::Tick);
            }
            self.now += Duration::from_millis(1);
        }
    }

    /// Lets time pass with ten ticks a second; the vehicle sends at its usual rates.
    pub(crate) fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 10.0).round() as u64 {
            self.now += Duration::from_millis(100);
            let theirs = self.now / self.slower;
            if self.speaks
                && theirs.subsec_millis().is_multiple_of(100)
                && theirs.subsec_micros().is_multiple_of(1_000)
            {
                if theirs.subsec_millis() == 0 {
                    self.heartbeat();
                }
                self.flight_status();
                if theirs.subsec_millis().is_multiple_of(500) {
                    self.uplink();
                }
            }
            self.msg(Msg::Tick);
        }
    }

    pub(crate) fn boot_ms(&self) -> u32 {
        let ours = self.now.saturating_sub(self.booted_at);
        u32::try_from((ours / self.slower).as_millis()).unwrap_or(u32::MAX)
    }

    /// The vehicle is switched off and on, with the next boot number.
    pub(crate) fn reboot(&mut self) {
        self.boot_number += 1;
        self.switch_on();
    }

    /// The same with a fixed boot number.
    pub(crate) fn switch_on(&mut self) {
        self.booted_at = self.now;
    }

    pub(crate) fn receive(&mut self, message: &MavMessage) {
        let frame = self.encoder.encode(message);
        self.msg(Msg::Frame(frame));
    }

    pub(crate) fn receive_from(&mut self, source: Address, message: &MavMessage) {
        let frame = Encoder::new(source).encode(message);
        self.msg(Msg::Frame(frame));
    }

    pub(crate) fn receive_payload(&mut self, message_id: u32, payload: &[u8]) {
        if let Some(frame) = self.encoder.encode_payload(message_id, payload) {
            self.msg(Msg::Frame(frame));
        }
    }

    pub(crate) fn heartbeat(&mut self) {
        let mut base_mode = MavModeFlag::empty();
        base_mode.set(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, self.armed);
        base_mode.set(MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED, self.simulated && self.hil);
        let phase = self.phase as u32;
        self.receive(&MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            custom_mode: phase | self.boot_number << PHASE_BITS,
            mavtype: MavType::MAV_TYPE_ROCKET,
            autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
            base_mode,
            system_status: MavState::MAV_STATE_ACTIVE,
            mavlink_version: 3,
        }));
    }

    pub(crate) fn flight_status(&mut self) {
        self.time_the_flight();
        let status = TD_FLIGHT_STATUS_DATA {
            time_boot_ms: self.boot_ms(),
            countdown_ms: self.countdown_ms,
            interlocks: self.interlocks,
            checks_failed: TdCheck::from_bits_truncate(self.checks_failed),
            phase: self.phase,
            abort_effect: self.abort_effect,
            boot_number: self.boot_number,
            approach_wait_s: self.approach_wait_s,
            vehicle_flags: if self.simulated {
                TdVehicleFlag::TD_VEHICLE_FLAG_SIMULATED
            } else {
                TdVehicleFlag::empty()
            },
            motor: self.motor,
            abort_impact_m_s: 0,
            hold: self.hold,
            latch: self.latch,
            last_hold_ds: 20,
            vehicle_uid: self.uid,
            hold_left_s: if self.hold == TdHold::TD_HOLD_NONE { 0 } else { 42 },
        };
        self.receive(&MavMessage::TD_FLIGHT_STATUS(status));
        self.flight_events();
    }

    /// The time since the release runs in flight.
    fn time_the_flight(&mut self) {
        let since = Duration::from_millis(self.countdown_ms.min(0).unsigned_abs().into());
        if self.flown.0.entered == 0 {
            self.flown.1 = self.now.saturating_sub(since);
        }
        if is_flight(self.phase) {
            self.countdown_ms = -(self.now.saturating_sub(self.flown.1).as_millis() as i32);
        }
    }

    /// The event of a new phase in flight, at the height that was sent last.
    fn flight_events(&mut self) {
        let (number, height) = (self.phase as usize, self.model.vehicle.height_m());
        let moves = self.model.vehicle.best_motion().is_some_and(|motion| motion.value.climb_m_s > 1.0);
        if self.phase == TdPhase::TD_PHASE_BOOST && !moves {
            return;
        }
        let (events, released_at) = &mut self.flown;
        let place = number.checked_sub(TdPhase::TD_PHASE_BOOST as usize);
        let (Some(place), 0) = (place, events.entered >> number & 1) else { return };
        events.boot_number = self.boot_number;
        events.at[place] = (self.now.saturating_sub(*released_at).as_millis() / 10) as u16;
        events.height[place] = height.map_or(0, |height| (10.0 * height.value).round() as i16);
        events.entered |= 1 << number;
        let message = MavMessage::TD_EVENTS(events.clone());
        self.receive(&message);
    }

    /// The uplink report: while the vehicle receives this station, its last frame is 0.2 s old.
    pub(crate) fn uplink(&mut self) {
        let fresh = self.now.saturating_sub(Duration::from_millis(200));
        if self.uplink_alive {
            self.uplink_at = fresh;
        }
        let age_ms = (self.now.saturating_sub(self.uplink_at)).as_millis().min(65_534) as u16;
        self.uplink_of(GROUND, age_ms, self.armed && self.armed_here);
    }

    pub(crate) fn uplink_of(&mut self, station: Address, accepted_age_ms: u16, commands: bool) {
        self.receive(&MavMessage::TD_UPLINK(TD_UPLINK_DATA {
            accepted_age_ms,
            refused_age_ms: u16::MAX,
            target_system: station.system_id,
            target_component: station.component_id,
            commands: u8::from(commands),
            session: if station == GROUND { SESSION } else { 0 },
            ..TD_UPLINK_DATA::default()
        }));
    }

    pub(crate) fn answer(&mut self, command: MavCmd, result: u8) {
        self.answer_to(GROUND, command, result);
    }

    pub(crate) fn answer_to(&mut self, target: Address, command: MavCmd, result: u8) {
        self.answer_with(target, command, result, 0);
    }

    /// The answer names the ask that somebody else has to confirm.
    pub(crate) fn answer_with(&mut self, target: Address, command: MavCmd, result: u8, detail: i32) {
        let answer = CommandAnswer { command: command as u16, result, detail, target };
        let frame: Option<Frame> = answer.encode(&mut self.encoder);
        if let Some(frame) = frame {
            self.msg(Msg::Frame(frame));
        }
    }

    pub(crate) fn text(&mut self, text: &str) {
        self.text_of(protocol::dialect::MavSeverity::MAV_SEVERITY_WARNING, text);
    }

    pub(crate) fn text_of(&mut self, severity: protocol::dialect::MavSeverity, text: &str) {
        for chunk in chunks(severity, text, 7) {
            self.receive(&MavMessage::STATUSTEXT(chunk));
        }
    }

    /// Clears the actions since the last call and returns the commands among them.
    pub(crate) fn take_commands(&mut self) -> Vec<COMMAND_LONG_DATA> {
        let commands = self.commands();
        self.actions.clear();
        commands
    }

    /// The commands sent since the last [`Self::take_commands`].
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

    /// These words were said.
    #[track_caller]
    pub(crate) fn expect_event(&self, words: impl AsRef<str>) {
        assert!(self.events().contains(words.as_ref()), "{} in\n{}", words.as_ref(), self.events());
    }

    /// These words are on the smallest screen that shows everything.
    #[track_caller]
    pub(crate) fn expect_screen(&self, words: impl AsRef<str>) {
        let screen = self.screen(80, 24);
        assert!(screen.contains(words.as_ref()), "{} in\n{screen}", words.as_ref());
    }

    pub(crate) fn screen(&self, columns: u16, rows: u16) -> String {
        let terminal = self.draw(columns, rows, MONO);
        terminal.backend().to_string()
    }

    /// The styles of the same screen in the dark theme, one letter per cell, with a legend. Plain
    /// cells at the end of a line are left out.
    pub(crate) fn styles(&self, columns: u16, rows: u16) -> String {
        let terminal = self.draw(columns, rows, Theme { palette: Palette::Dark, ascii: false });
        let rows = terminal.backend().buffer().content.chunks(usize::from(columns));
        let letters =
            rows.map(|row| row.iter().map(letter).collect::<String>().trim_end_matches('.').to_owned());
        letters.chain([LEGEND.to_owned()]).collect::<Vec<_>>().join("\n")
    }

    pub(crate) fn draw(&self, columns: u16, rows: u16, theme: Theme) -> Terminal<TestBackend> {
        let mut terminal = Terminal::new(TestBackend::new(columns, rows)).expect("a test terminal");
        let draws = |frame: &mut ratatui::Frame| {
            draw(&self.model, theme, self.now, frame);
        };
        terminal.draw(draws).expect("drawing in memory");
        terminal
    }
}

/// The letters of [`Rig::styles`] and what they mean.
const LEGEND: &str = "\nLegend: . plain, b bold, s stale, l label, g good, c caution or flame, ! alarm or danger, ^ another state, \
                      m measured, p predicted, x limit";

fn letter(cell: &Cell) -> char {
    match (cell.fg, cell.bg) {
        (_, Color::Indexed(124)) => '!',
        (_, Color::Indexed(238 | 214 | 79)) => '^',
        (Color::Indexed(249), _) => 'l',
        (Color::Indexed(79), _) => 'g',
        (Color::Indexed(215), _) => 'c',
        (Color::Indexed(75), _) => 'm',
        (Color::Indexed(221), _) => 'p',
        (Color::Indexed(218), _) => 'x',
        _ if cell.modifier.contains(Modifier::ITALIC) => 's',
        _ if cell.modifier.contains(Modifier::BOLD) => 'b',
        _ => '.',
    }
}

pub(crate) fn settings(auto: bool, interactive: bool) -> Settings {
    let log_path = Some("flight.mcap".to_owned());
    Settings { log_path, auto, interactive, session: SESSION, ..Settings::on_screen("udpin:127.0.0.1:14550") }
}

pub(crate) fn is_arm(command: &COMMAND_LONG_DATA) -> bool {
    command.command == MavCmd::MAV_CMD_COMPONENT_ARM_DISARM && command.param1 > 0.5
}

pub(crate) fn is_abort(command: &COMMAND_LONG_DATA) -> bool {
    command.command == MavCmd::MAV_CMD_DO_FLIGHTTERMINATION && command.param1 > 0.5
}

/// A letter or a word, and Enter.
pub(crate) fn enter(word: &str) -> Vec<Key> {
    [typed(word), vec![Key::Enter]].concat()
}

pub(crate) fn typed(word: &str) -> Vec<Key> {
    word.chars().map(Key::Char).collect()
}
