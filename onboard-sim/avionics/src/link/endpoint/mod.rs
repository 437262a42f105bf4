//! The vehicle's end of MAVLink, without sockets: frames in, frames out.
//!
//! In every second each link carries at most its budget, whatever is requested. Vital messages go
//! first, then answers and texts within their shares, then telemetry, then requested messages. In
//! the fall texts follow telemetry.

pub mod addressing;
mod lane;
mod questions;
mod requests;

use alloc::borrow::ToOwned as _;
use alloc::collections::{BTreeSet, VecDeque};
use alloc::string::String;
use alloc::vec::Vec;
use alloc::{format, vec};

use flight::computer::crew::CrewCommand;
use flight::computer::messages::Severity;
use flight::rules::operator::Operator;
use flight::rules::phase::{Interlocks, Mode, Phase};
use flight::rules::two_person::{Station, TwoPerson};
use mavlink::MessageData as _;
use protocol::command::{CommandAnswer, CommandRequest};
#[expect(deprecated, reason = "only [`pong`] uses it")]
use protocol::dialect::PING_DATA;
use protocol::dialect::{
    AVAILABLE_MODES_DATA, HEARTBEAT_DATA, MESSAGE_INTERVAL_DATA, MavCmd, MavMessage, MavResult, MavSeverity,
    TD_BOOK_KEPT_DATA, TD_CREW_DATA, TD_FLIGHT_STATUS_DATA, TD_LANDING_VERDICT_DATA, TD_MISSION_DATA,
    TD_OPERATOR_DATA, TD_TOUCHDOWN_LIMITS_DATA, TIMESYNC_DATA,
};
use protocol::frame::{Encoder, Frame, SIGNATURE_LEN};
use protocol::identity::{Address, RADIO, RADIO_BUDGET_BYTES_S, VEHICLE};
use protocol::signing::Rejection;
use protocol::text;

use self::lane::{Lane, QueuedAnswer};
use self::questions::FileService;
pub use self::questions::gives_out_its_log;
pub use self::requests::UplinkState;
use self::requests::{Answered, Refusals, Waiting, Warnings};
use crate::link::commands::Command;
pub use crate::link::stations::Path;
use crate::link::stations::{Sender, Stations};
use crate::link::streams::{CheckReporter, EventReporter, FindingReporter, HURRIED_S, Streams};
use crate::link::vehicle::{Identity, VehicleKind, VehicleState};
use crate::link::{commands, telemetry};

/// Most requested messages that may wait; more are refused for the moment.
const MAX_REQUESTED: usize = 32;
/// Most sources that are remembered, so that a flood of forged ids cannot grow memory.
const MAX_SOURCES: usize = 16;
/// After an abort: interval of heartbeats, s, and for how long, s. The crew soon sees the latched
/// abort, even over a bad link.
const ABORTED_BEAT_S: f64 = 0.2;
const ABORTED_BEATS_FOR_S: f64 = 3.0;
/// In a countdown: the longest interval of flight statuses, s; on a slow line they take half of it.
const COUNTDOWN_STATUS_S: f64 = 0.2;

flight::with_defaults! {
    /// The vehicle's end of its links.
    pub struct VehicleEndpoint {
        us: Address = VEHICLE,
        identity: Identity = Identity { kind: VehicleKind::Real, boot_number: 0, uid: 0 },
        lanes: Vec<Lane> = vec![Lane::default()],
        /// The budget of each link, bytes per second.
        capacities_bytes_s: Vec<u32> = vec![RADIO_BUDGET_BYTES_S],
        text_id: u16 = 0,
        now_s: f64 = 0.0,
        /// Time at which another vehicle under our ids was last received.
        twin_received_at_s: Option<f64> = None,
        /// The stations, with the uplink quality of each.
        stations: Stations = Stations::default(),
        /// Whether the vehicle starts by itself, so that no station is required.
        starts_by_itself: bool = false,
        /// Commands that the vehicle decides in its next frame.
        waiting: Vec<Waiting> = Vec::new(),
        /// The newest first.
        answered: VecDeque<Answered> = VecDeque::new(),
        /// Sources that have sent anything; a new one gets the constant data at once.
        sources: BTreeSet<Address> = BTreeSet::new(),
        refusals: Refusals = Refusals::default(),
        warnings: Warnings = Warnings::default(),
        last_reported: Option<LastReported> = None,
        last_crew: Option<(TwoPerson, Option<Operator>, Option<Station>)> = None,
        aborted_at_s: Option<f64> = None,
        files: FileService = FileService::default(),
        check_reporter: CheckReporter = CheckReporter::default(),
        finding_reporter: FindingReporter = FindingReporter::default(),
        event_reporter: EventReporter = EventReporter::default(),
    }
}

/// An outgoing frame, and the links that carry it.
#[derive(Debug, Clone)]
pub struct Outgoing {
    pub frame: Frame,
    /// The links, by their numbers.
    pub links: Vec<usize>,
}

/// Data shared by all messages of one instant.
struct Context {
    now_s: f64,
    identity: Identity,
}

/// State that is reported to the crew at once when it changes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LastReported {
    phase: Phase,
    interlocks: Interlocks,
    counting_down: bool,
    held: bool,
}

impl From<&Mode> for LastReported {
    fn from(mode: &Mode) -> Self {
        let Mode { phase, interlocks, countdown_end_s, hold, .. } = *mode;
        Self { phase, interlocks, counting_down: countdown_end_s.is_some(), held: hold.is_some() }
    }
}

impl VehicleEndpoint {
    /// An endpoint with the standard messages at their default rates, over one link with a radio's
    /// budget.
    pub fn new(kind: VehicleKind) -> Self {
        Self::over(kind, Streams::over_a_radio(0, false))
    }

    /// The same for signed frames, which are longer.
    pub fn sending_signed(kind: VehicleKind) -> Self {
        Self::over(kind, Streams::over_a_radio(SIGNATURE_LEN, false))
    }

    /// The same for a vehicle with operators. A frame's signature must have been checked with the
    /// key that its link id names ([`protocol::signing::Signing::with_operators`]): here it only
    /// identifies the operator.
    pub fn sending_to_crew(kind: VehicleKind) -> Self {
        let endpoint = Self::over(kind, Streams::over_a_radio(SIGNATURE_LEN, true));
        Self { stations: Stations::of_a_crew(), ..endpoint }
    }

    fn over(kind: VehicleKind, streams: Streams) -> Self {
        let lanes = vec![Lane::new(streams, Encoder::new(VEHICLE))];
        let endpoint = Self { lanes, ..Self::default() };
        Self { identity: Identity { kind, ..endpoint.identity }, ..endpoint }
    }

    /// Sets the boot number, which only a new power-up changes.
    #[must_use]
    pub fn booted(self, boot_number: u32) -> Self {
        Self { identity: Identity { boot_number, ..self.identity }, ..self }
    }

    /// Sets the unique id of the vehicle, which is the same at each power-up.
    #[must_use]
    pub fn with_uid(self, uid: u16) -> Self {
        Self { identity: Identity { uid, ..self.identity }, ..self }
    }

    /// Sets the links by their budgets in bytes per second. All carry the same frames, limited by
    /// the slowest link, until a station requests something else on one link.
    #[must_use]
    pub fn over_links(mut self, capacities_bytes_s: &[u32]) -> Self {
        self.capacities_bytes_s = capacities_bytes_s.to_vec();
        let slowest_bytes_s = capacities_bytes_s.iter().copied().min().unwrap_or(RADIO_BUDGET_BYTES_S);
        for lane in &mut self.lanes {
            lane.links = (0..capacities_bytes_s.len()).collect();
            lane.set_capacity(slowest_bytes_s, 0.0);
        }
        self
    }

    /// Sets the MAVLink system id.
    #[must_use]
    pub fn of_system(self, system_id: u8) -> Self {
        let us = VEHICLE.of_system(system_id);
        let mut lanes = self.lanes;
        for lane in &mut lanes {
            lane.encoder = Encoder::new(us);
        }
        Self { us, lanes, ..self }
    }

    /// Takes a frame from this path. The vehicle decides requests in its next frame
    /// ([`VehicleEndpoint::uplink_state`], [`VehicleEndpoint::on_answers`]); answers come out of
    /// [`VehicleEndpoint::poll`].
    pub fn on_frame(&mut self, path: impl Into<Path>, frame: &Frame, vehicle: &VehicleState<'_>) {
        if frame.source() == self.us {
            self.note_twin(vehicle.time_s);
            return;
        }
        let path = path.into();
        let link = path.link;
        if let Ok(MavMessage::RADIO_STATUS(radio)) = frame.decode() {
            if frame.source() == RADIO {
                self.lane(link).on_radio(radio.txbuf, vehicle.time_s);
            }
            return;
        }
        self.stations.accepted(frame, &sender_of(frame, path, vehicle), vehicle.time_s);
        if self.sources.len() < MAX_SOURCES && self.sources.insert(frame.source()) {
            for id in [TD_FLIGHT_STATUS_DATA::ID, TD_TOUCHDOWN_LIMITS_DATA::ID, TD_MISSION_DATA::ID] {
                self.lane(link).streams.at_least_every(id, HURRIED_S);
            }
        }
        if let Some(request) = CommandRequest::from_frame(frame) {
            if self.us.accepts(request.target) {
                let by = operator_of(frame, vehicle);
                self.on_command(path, (&request, by), vehicle);
            }
            return;
        }
        if let Some(cancelled) = CommandRequest::cancelled_by(frame) {
            if self.us.accepts(cancelled.target) {
                self.on_cancel(path, (&cancelled, operator_of(frame, vehicle)), vehicle);
            }
            return;
        }
        if self.on_question(path, frame, vehicle) {
            return;
        }
        match frame.decode() {
            Ok(MavMessage::TIMESYNC(sync))
                if sync.tc1 == 0 && self.is_for_us(sync.target_system, sync.target_component) =>
            {
                let answer = TIMESYNC_DATA {
                    tc1: (1e9 * vehicle.time_s) as i64,
                    ts1: sync.ts1,
                    target_system: frame.source().system_id,
                    target_component: frame.source().component_id,
                };
                self.lane(link).answer(MavMessage::TIMESYNC(answer).into());
            }
            Ok(MavMessage::TD_BOOK_HEAD(head))
                if self.is_for_us(head.target_system, head.target_component) =>
            {
                // The frame itself is in the log already.
                let confirmation = TD_BOOK_KEPT_DATA {
                    boot_number: self.identity.boot_number,
                    book: head.book,
                    entries: head.entries,
                    target_system: frame.source().system_id,
                    target_component: frame.source().component_id,
                };
                self.lane(link).request(vec![MavMessage::TD_BOOK_KEPT(confirmation)]);
            }
            Ok(message) => {
                if let Some(pong) = pong(&message, frame.source()) {
                    self.lane(link).answer(pong.into());
                }
            }
            // An unknown message: no answer is better than a guess.
            Err(_) => {}
        }
    }

    /// Takes a copy of a frame that was received before on another path.
    pub fn on_copy(&mut self, path: impl Into<Path>, frame: &Frame, vehicle: &VehicleState<'_>) {
        self.stations.copied(frame, &sender_of(frame, path.into(), vehicle));
    }

    /// Warns the crew about a command without a valid signature. It is not acknowledged: otherwise
    /// a forger could cause an answer that the real ground station takes for its own.
    pub fn on_rejected(&mut self, frame: &Frame, why: Rejection) {
        self.stations.refused(frame.source(), why, self.now_s);
        if let Some(request) = CommandRequest::from_frame(frame).filter(|one| self.us.accepts(one.target)) {
            let Address { system_id, component_id } = request.source;
            let words = format!("command {} from {system_id}/{component_id} refused: {why}", request.command);
            self.send_text(Severity::Warning, &words);
        }
    }

    /// Sends the verdict on the landing to every station at once.
    pub fn announce_verdict(&mut self) {
        self.hurry(TD_LANDING_VERDICT_DATA::ID);
    }

    /// The frames to send now.
    pub fn poll(&mut self, vehicle: &VehicleState<'_>) -> Vec<Outgoing> {
        self.now_s = vehicle.time_s;
        self.watch(vehicle.mode());
        self.watch_the_crew(vehicle);
        for words in self.warnings.counted(self.now_s) {
            self.queue_text(Severity::Warning, &words);
        }
        let context = Context { now_s: self.now_s, identity: self.identity };
        let boot = self.identity.boot_number;
        for message in self.stations.due(boot, self.now_s) {
            for lane in &mut self.lanes {
                lane.queue_uplink_report(message.clone());
            }
        }
        let in_turn = [
            self.check_reporter.due(vehicle, boot, self.now_s),
            self.event_reporter.due(vehicle, boot, self.now_s),
            self.finding_reporter.due(vehicle, boot, self.now_s),
        ];
        for message in in_turn.into_iter().flatten() {
            for lane in &mut self.lanes {
                // A lane without room loses this one: every value is repeated.
                lane.request(vec![message.clone()]);
            }
        }
        self.serve_files(vehicle);
        let Self { lanes, files, .. } = self;
        lanes.iter_mut().flat_map(|lane| lane.poll(&context, vehicle, files)).collect()
    }

    /// Reports a change of state to the crew at once, with the two messages that carry it.
    fn watch(&mut self, mode: &Mode) {
        let now = LastReported::from(mode);
        let before = self.last_reported.replace(now);
        if before != Some(now) {
            self.hurry(HEARTBEAT_DATA::ID);
            self.hurry(TD_FLIGHT_STATUS_DATA::ID);
        }
        // A phase of the flight may be over within a tenth of a second, and no command can bring it
        // back.
        if !now.phase.on_pad() && before.is_some_and(|before| before.phase != now.phase) {
            self.at_least_every(TD_FLIGHT_STATUS_DATA::ID, 0.0);
        }
        // A station without a downlink in the countdown for 1 s reports so, and holds it: even the
        // slowest line carries several of these in that time.
        if mode.countdown_end_s.is_some() {
            self.at_least_every(TD_FLIGHT_STATUS_DATA::ID, COUNTDOWN_STATUS_S);
        }
        if !now.interlocks.armed {
            self.stations.set_commander(None);
        }
        if now.interlocks.abort_latched {
            let aborted_at_s = *self.aborted_at_s.get_or_insert(self.now_s);
            if self.now_s - aborted_at_s < ABORTED_BEATS_FOR_S {
                self.at_least_every(HEARTBEAT_DATA::ID, ABORTED_BEAT_S);
            }
        }
    }

    /// Reports a proposal, a confirmation, a tap and a take-over at once.
    fn watch_the_crew(&mut self, vehicle: &VehicleState<'_>) {
        if vehicle.operators.is_empty() {
            return;
        }
        let memory = vehicle.computer.crew();
        let crew = (memory.two_person, memory.held_by, self.stations.armed_by());
        if self.last_crew.replace(crew) != Some(crew) {
            self.hurry(TD_CREW_DATA::ID);
        }
    }

    fn hurry(&mut self, message_id: u32) {
        self.at_least_every(message_id, HURRIED_S);
    }

    fn at_least_every(&mut self, message_id: u32, interval_s: f64) {
        for lane in &mut self.lanes {
            lane.streams.at_least_every(message_id, interval_s);
        }
    }

    fn lane(&mut self, link: usize) -> &mut Lane {
        let place = self.lanes.iter().position(|lane| lane.links.contains(&link)).unwrap_or(0);
        &mut self.lanes[place]
    }

    /// Takes a command, which may be a broadcast. `by` is the operator whose key has signed it.
    pub fn on_command(
        &mut self,
        path: impl Into<Path>,
        (request, by): (&CommandRequest, Option<Operator>),
        vehicle: &VehicleState<'_>,
    ) {
        let path = path.into();
        let link = path.link;
        let key = by.map_or(0, |by| by.number);
        let station = self.stations.of(&Sender { address: request.source, key, path });
        let (result, reason) = match commands::parse(request) {
            Ok(command) if let Some(unfit) = self.address_refusal(request, &command, station, vehicle) => {
                (unfit.result, unfit.reason)
            }
            Err(unfit) => (unfit.result, unfit.reason),
            Ok(Command::Vehicle(command)) => return self.put(path, (request, by, station), command, vehicle),
            Ok(Command::ForcedDisarm) => {
                let command = if means_abort(vehicle) { CrewCommand::Abort } else { CrewCommand::Disarm };
                return self.put(path, (request, by, station), command, vehicle);
            }
            Ok(Command::SetInterval { message_id, interval_us }) => {
                let now_s = self.now_s;
                if let Some(reason) = self.rates_forbidden(station, by, vehicle) {
                    (MavResult::MAV_RESULT_DENIED, Some(format!("message {message_id}: {reason}")))
                } else {
                    self.with_rates_of(link, |streams| streams.set_interval(message_id, interval_us, now_s))
                }
            }
            Ok(Command::SendMessage { message_id, of }) => self.send_message(link, message_id, of, vehicle),
        };
        self.acknowledge(link, request, (result, None));
        if let Some(reason) = reason {
            self.send_text(Severity::Warning, &reason);
        }
    }

    /// Cancels a running command: only a check takes a while. Any other is done or refused at once,
    /// and the answer states that it cannot be cancelled.
    fn on_cancel(
        &mut self,
        path: Path,
        (cancelled, by): (&CommandRequest, Option<Operator>),
        vehicle: &VehicleState<'_>,
    ) {
        if cancelled.is(MavCmd::MAV_CMD_TD_PAD_CHECK) && vehicle.computer.pad_check().is_running() {
            let key = by.map_or(0, |by| by.number);
            let station = self.stations.of(&Sender { address: cancelled.source, key, path });
            self.put(path, (cancelled, by, station), CrewCommand::EndCheck, vehicle);
        } else {
            self.acknowledge(path.link, cancelled, (MavResult::MAV_RESULT_DENIED, None));
        }
    }

    /// Answers a command. Repeated refusals to one station are not answered every time. `proposal`
    /// is the number of the proposal that a second person must confirm.
    fn acknowledge(
        &mut self,
        link: usize,
        request: &CommandRequest,
        (result, proposal): (MavResult, Option<u16>),
    ) {
        let is_supported = result != MavResult::MAV_RESULT_UNSUPPORTED;
        if result == MavResult::MAV_RESULT_ACCEPTED
            || self.refusals.may_answer(request.source, is_supported, self.now_s)
        {
            let answer = CommandAnswer::to(request, result);
            let answer = proposal.map_or(answer, |number| answer.for_confirmation(number));
            self.lane(link).answer(QueuedAnswer::Command(answer));
        }
    }

    /// Why this station may not set rates now, if so. While the vehicle is armed, only the station
    /// that armed it may set them; if the vehicle armed itself, every station may.
    fn rates_forbidden(
        &self,
        station: Station,
        by: Option<Operator>,
        vehicle: &VehicleState<'_>,
    ) -> Option<String> {
        if !vehicle.operators.is_empty() && by.is_none() {
            return Some("only an operator with a key of their own sets rates".to_owned());
        }
        let armed_by =
            self.stations.armed_by().filter(|by| vehicle.mode().interlocks.armed && *by != station)?;
        Some(format!("while armed, only {armed_by}, which armed, sets rates"))
    }

    /// Changes the rates of one link: an interval applies to the requesting link. A link that
    /// shared a lane with others gets a separate lane if anything changes.
    fn with_rates_of<T>(&mut self, link: usize, change: impl FnOnce(&mut Streams) -> T) -> T {
        let capacity_bytes_s = self.capacity_bytes_s(link);
        let lane = self.lane(link);
        if lane.links.len() <= 1 {
            return change(&mut lane.streams);
        }
        let mut streams = lane.streams.clone();
        streams.set_capacity(capacity_bytes_s);
        let before = streams.intervals();
        let done = change(&mut streams);
        if streams.intervals() != before {
            self.separate(link).streams = streams;
        }
        done
    }

    /// Gives a link a separate lane, if it shared one.
    fn separate(&mut self, link: usize) -> &mut Lane {
        let (capacity_bytes_s, now_s) = (self.capacity_bytes_s(link), self.now_s);
        let lane = self.lane(link);
        if lane.links.len() > 1 {
            let mut new_lane = lane.split_off(link);
            new_lane.set_capacity(capacity_bytes_s, now_s);
            self.lanes.push(new_lane);
        }
        self.lane(link)
    }

    fn capacity_bytes_s(&self, link: usize) -> u32 {
        self.capacities_bytes_s.get(link).copied().unwrap_or(RADIO_BUDGET_BYTES_S)
    }

    fn send_message(
        &mut self,
        link: usize,
        message_id: u32,
        of: u32,
        vehicle: &VehicleState<'_>,
    ) -> (MavResult, Option<String>) {
        let identity = self.identity;
        let lane = self.lane(link);
        let messages: Vec<MavMessage> = match message_id {
            // 0 requests all modes, k the k-th.
            AVAILABLE_MODES_DATA::ID if of as usize > Phase::ALL.len() => {
                let reason = format!("mode {of}: there are {}", Phase::ALL.len());
                return (MavResult::MAV_RESULT_DENIED, Some(reason));
            }
            AVAILABLE_MODES_DATA::ID => telemetry::available_modes(identity.boot_number)
                .enumerate()
                .filter(|(place, _)| of == 0 || of as usize == place + 1)
                .map(|(_, message)| message)
                .collect(),
            MESSAGE_INTERVAL_DATA::ID => vec![lane.streams.interval_of(of)],
            _ => telemetry::message(message_id, vehicle, identity).into_iter().collect(),
        };
        if messages.is_empty() {
            // One that this vehicle sends has no content now.
            let sends = matches!(
                lane.streams.interval_of(message_id),
                MavMessage::MESSAGE_INTERVAL(interval) if interval.interval_us != 0
            );
            let of_crew = matches!(message_id, TD_CREW_DATA::ID | TD_OPERATOR_DATA::ID);
            let result = if sends && !(of_crew && vehicle.operators.is_empty()) {
                MavResult::MAV_RESULT_TEMPORARILY_REJECTED
            } else {
                MavResult::MAV_RESULT_UNSUPPORTED
            };
            return (result, None);
        }
        if !lane.request(messages) {
            return (MavResult::MAV_RESULT_TEMPORARILY_REJECTED, None);
        }
        (MavResult::MAV_RESULT_ACCEPTED, None)
    }

    fn is_for_us(&self, system_id: u8, component_id: u8) -> bool {
        self.us.accepts(Address { system_id, component_id })
    }

    /// Sends a text to the crew. A warning that was sent just before is counted instead.
    pub fn send_text(&mut self, severity: Severity, words: &str) {
        if severity != Severity::Warning || self.warnings.is_new(words, self.now_s) {
            self.queue_text(severity, words);
        }
    }

    fn queue_text(&mut self, severity: Severity, words: &str) {
        self.text_id = self.text_id.wrapping_add(1).max(1);
        let severity = match severity {
            Severity::Info => MavSeverity::MAV_SEVERITY_INFO,
            Severity::Notice => MavSeverity::MAV_SEVERITY_NOTICE,
            Severity::Warning => MavSeverity::MAV_SEVERITY_WARNING,
            Severity::Error => MavSeverity::MAV_SEVERITY_ERROR,
            Severity::Critical => MavSeverity::MAV_SEVERITY_CRITICAL,
        };
        for chunk in text::chunks(severity, words, self.text_id) {
            for lane in &mut self.lanes {
                lane.queue_text(MavMessage::STATUSTEXT(chunk.clone()));
            }
        }
    }
}

/// The operator whose key has signed a frame.
fn operator_of(frame: &Frame, vehicle: &VehicleState<'_>) -> Option<Operator> {
    vehicle.operators.iter().find(|operator| operator.number == frame.key_number()).copied()
}

/// Who has sent a frame. Without operators the key number in a signature means nothing.
fn sender_of(frame: &Frame, path: Path, vehicle: &VehicleState<'_>) -> Sender {
    let key = if vehicle.operators.is_empty() { 0 } else { frame.key_number() };
    Sender { address: frame.source(), key, path }
}

/// Whether a forced disarm is an abort, as in the air. Other ground stations call it an emergency
/// stop or a kill.
fn means_abort(vehicle: &VehicleState<'_>) -> bool {
    !(vehicle.phase().on_pad() || matches!(vehicle.phase(), Phase::Touchdown | Phase::Safed))
}

/// The answer to a PING that requests one. PING is deprecated, but older ground stations still
/// measure with it.
#[expect(deprecated, reason = "the standard has replaced PING by TIMESYNC; older ground stations have not")]
fn pong(message: &MavMessage, asker: Address) -> Option<MavMessage> {
    let MavMessage::PING(ping) = message else {
        return None;
    };
    let (target_system, target_component) = (asker.system_id, asker.component_id);
    (ping.target_system == 0)
        .then(|| MavMessage::PING(PING_DATA { target_system, target_component, ..ping.clone() }))
}
