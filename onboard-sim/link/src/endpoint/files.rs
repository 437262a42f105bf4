//! Gives out the vehicle's log (MAVLink FTP), while nobody can be harmed by a thinner telemetry: on the ground, disarmed.

use alloc::borrow::ToOwned as _;
use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use core::time::Duration;

use flight::computer::news::Severity;
use flight::rules::operator::Operator;
use flight::rules::phase::Phase;
use protocol::dialect::MavMessage;
use protocol::ftp::server::{Files, NoFiles, Server, Taken};
use protocol::ftp::{FileRequest, Opcode};

use super::VehicleEndpoint;
use crate::vehicle::Vehicle;

/// The log's files, and what clients have asked for.
pub(super) struct FileService {
    server: Server,
    files: Box<dyn Files + Send>,
}

impl Default for FileService {
    fn default() -> Self {
        Self { server: Server::default(), files: Box::new(NoFiles) }
    }
}

impl FileService {
    /// Whether a client reads over one of these links.
    pub(super) fn is_busy(&self, links: &[usize], now_s: f64) -> bool {
        let now = Duration::from_secs_f64(now_s);
        links.iter().any(|link| self.server.is_busy(*link, now))
    }

    pub(super) fn next_answer(&mut self, links: &[usize]) -> Option<MavMessage> {
        links.iter().find_map(|link| self.server.next_answer(*link))
    }

    pub(super) fn next_piece(&mut self, links: &[usize], now_s: f64) -> Option<MavMessage> {
        let now = Duration::from_secs_f64(now_s);
        links.iter().find_map(|link| self.server.next_piece(*link, &mut *self.files, now))
    }
}

/// Whether the vehicle gives out its log: it is disarmed, and on its pad or safe on the ground.
pub fn gives_out_its_log(vehicle: &dyn Vehicle) -> bool {
    let phase = vehicle.phase();
    !vehicle.mode().interlocks.armed && (phase.on_pad() || matches!(phase, Phase::Touchdown | Phase::Safed))
}

impl VehicleEndpoint {
    /// Offers these files from now on. They must not change any more.
    pub fn offer(&mut self, files: Box<dyn Files + Send>) {
        // What was asked of other files is void.
        self.files = FileService { server: Server::default(), files };
    }

    /// Takes a request for a file. A link that reads gets a lane of its own: its files and its thinner telemetry
    /// concern no other link.
    pub(super) fn on_file_request(
        &mut self,
        link: usize,
        request: &FileRequest,
        by: Option<Operator>,
        vehicle: &dyn Vehicle,
    ) {
        let forbidden = why_forbidden(by, vehicle);
        if forbidden.is_none() && request.packet.opcode == Opcode::OpenFileRo {
            self.separate(link);
        }
        let FileService { server, files } = &mut self.files;
        let now = Duration::from_secs_f64(vehicle.time_s());
        let taken = server.take(request, link, forbidden.is_none(), &**files, now);
        if let (Taken::NotNow, Some(why)) = (taken, forbidden) {
            self.say(Severity::Warning, &why);
        }
    }

    /// Continues with what takes long, and closes every file when the vehicle must not give them out any more.
    pub(super) fn serve_files(&mut self, vehicle: &dyn Vehicle) {
        let FileService { server, files } = &mut self.files;
        if gives_out_its_log(vehicle) {
            server.work(&mut **files);
        } else {
            server.close_all();
        }
    }
}

/// Why this client may not read now, if so.
fn why_forbidden(by: Option<Operator>, vehicle: &dyn Vehicle) -> Option<String> {
    if !vehicle.operators().is_empty() && by.is_none() {
        return Some("log refused: only an operator with a key of their own fetches it".to_owned());
    }
    let armed = if vehicle.mode().interlocks.armed { ", armed" } else { "" };
    (!gives_out_its_log(vehicle)).then(|| {
        format!("log refused: found {}{armed}, required disarmed and on the ground", vehicle.phase().name())
    })
}
