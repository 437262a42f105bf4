//! The station's own position, from gpsd or from a receiver that sends NMEA 0183 sentences.

use std::time::Duration;

use anyhow::Context as _;
use nmea::sentences::FixType;
use nmea::{ParseResult, parse_bytes};
use protocol::hub::Received;
use protocol::transport::{LinkAddress, Transport};
use serde::Deserialize;
use tokio::time::{Instant, timeout_at};

use crate::cli::PositionSource;
use crate::model::Degrees;
use crate::update::Msg;

/// Requests the reports of gpsd (gpsd_json(5), WATCH).
const WATCH: &[u8] = b"?WATCH={\"enable\":true,\"json\":true};\n";
/// The shortest time between two positions: a receiver may send ten a second.
const EVERY: Duration = Duration::from_millis(900);
/// A source that works reports once a second, also without a fix.
const QUIET_FOR: Duration = Duration::from_secs(10);
/// The longest line, bytes: gpsd's longest report has 10,240.
const LINE_MAX: usize = 16 * 1024;

/// A TPV report of gpsd (gpsd_json(5), TPV); degrees. Other reports have another class.
#[derive(Deserialize)]
struct Report {
    class: String,
    #[serde(default)]
    mode: u8,
    lat: Option<f64>,
    lon: Option<f64>,
}

/// The mode of a report with a fix of latitude and longitude.
const MODE_2D: u8 = 2;

/// The position in a line, or why it has none; `None` for a line about something else.
fn position_in(line: &[u8]) -> Option<Result<Degrees, String>> {
    let (has_fix, latitude, longitude) = if line.starts_with(b"{") {
        let report: Report = serde_json::from_slice(line).ok()?;
        (report.class == "TPV").then_some((report.mode >= MODE_2D, report.lat, report.lon))?
    } else {
        let Ok(ParseResult::GGA(data)) = parse_bytes(line) else { return None };
        (data.fix_type.is_some_and(FixType::is_valid), data.latitude, data.longitude)
    };
    let found = latitude.zip(longitude).filter(|_| has_fix);
    Some(match found.map(|(latitude, longitude)| Degrees { latitude, longitude }) {
        None => Err("no fix".to_owned()),
        Some(at) if at.is_valid() => Ok(at),
        Some(Degrees { latitude, longitude }) => Err(format!("{latitude},{longitude} is no position")),
    })
}

/// The open source of the station's own position.
pub(super) struct Locator {
    source: PositionSource,
    transport: Transport,
    /// A line that is not complete yet.
    line: Vec<u8>,
    /// The trouble that was reported last.
    trouble: Option<String>,
    /// When the next position is reported.
    due_at: Instant,
    /// The end of a silence after which the source is in trouble.
    quiet_at: Instant,
}

impl Locator {
    /// # Errors
    /// The address cannot be bound or resolved. A source that does not answer is no error.
    pub(super) async fn open(source: PositionSource) -> anyhow::Result<Self> {
        let transport = Transport::open(source.link.clone()).await.context("--position")?;
        let (now, line, trouble) = (Instant::now(), Vec::new(), None);
        Ok(Self { source, transport, line, trouble, due_at: now, quiet_at: now + QUIET_FOR })
    }

    /// The next position, or the next reason why there is none.
    pub(super) async fn next(&mut self) -> Msg {
        loop {
            let found = match timeout_at(self.quiet_at, self.transport.receive()).await {
                Ok(None) => std::future::pending().await,
                Ok(Some(Received::Stream(_, bytes) | Received::Datagram { bytes, .. })) => self.take(&bytes),
                Ok(Some(Received::Up(_))) => {
                    self.line.clear();
                    if self.source.is_gpsd {
                        self.transport.sender().send(WATCH.to_vec());
                    }
                    None
                }
                Ok(Some(Received::Down(why))) => Some(Err(why)),
                Ok(Some(_)) => None,
                Err(_elapsed) => {
                    self.quiet_at = Instant::now() + QUIET_FOR;
                    // The other end may have left without closing the connection.
                    if matches!(self.source.link, LinkAddress::TcpOut(_))
                        && let Ok(again) = Transport::open(self.source.link.clone()).await
                    {
                        self.transport = again;
                    }
                    let words = "no position for 10 s, neither gpsd's TPV nor NMEA's GGA";
                    self.trouble.is_none().then(|| Err(words.to_owned()))
                }
            };
            let now = Instant::now();
            match found {
                Some(Ok(at)) => {
                    self.trouble = None;
                    if now >= self.due_at {
                        self.due_at = now + EVERY;
                        return Msg::Here(Ok(at));
                    }
                }
                Some(Err(why)) if self.trouble.as_ref() != Some(&why) => {
                    (self.due_at, self.trouble) = (now, Some(why.clone()));
                    return Msg::Here(Err(why));
                }
                _ => {}
            }
        }
    }

    /// The last position in the lines that these bytes complete, or why it has none.
    fn take(&mut self, bytes: &[u8]) -> Option<Result<Degrees, String>> {
        let mut found = None;
        for byte in bytes {
            if matches!(byte, b'\r' | b'\n') {
                found = position_in(&self.line).or(found);
                self.line.clear();
            } else if self.line.len() < LINE_MAX {
                self.line.push(*byte);
            }
        }
        if found.is_some() {
            self.quiet_at = Instant::now() + QUIET_FOR;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use tokio::io::{AsyncBufReadExt as _, AsyncWriteExt as _, BufReader};
    use tokio::net::{TcpListener, TcpStream};

    use super::*;

    /// With a checksum, as in NMEA 0183.
    fn sentence(text: &str) -> String {
        format!("${text}*{:02X}", text.bytes().fold(0, |sum, byte| sum ^ byte))
    }

    fn read(line: &str) -> Option<Result<Degrees, String>> {
        position_in(line.as_bytes())
    }

    /// The example of gpsd_json(5), and reports without a usable position.
    #[test]
    fn val_gpsd_json_a_position_needs_a_fix() {
        let report = r#"{"class":"TPV","device":"/dev/pts/1","time":"2005-06-08T10:34:48.283Z","ept":0.005,
            "lat":46.498293369,"lon":7.567411672,"alt":1343.127,"eph":36.000,"epv":32.321,
            "track":10.3788,"speed":0.091,"climb":-0.085,"mode":3}"#;
        assert_eq!(read(report), Some(Ok(Degrees { latitude: 46.498_293_369, longitude: 7.567_411_672 })));
        let no_fix = Some(Err("no fix".to_owned()));
        for (was, is) in [(r#""mode":3"#, r#""mode":1"#), (r#","mode":3"#, ""), (r#""lat""#, r#""l""#)] {
            assert_eq!(read(&report.replace(was, is)), no_fix, "{is}");
        }
        let absurd = read(&report.replace("46.498", "946.498")).unwrap().unwrap_err();
        assert_eq!(absurd, "946.498293369,7.567411672 is no position");
        for other in [&report.replace("TPV", "SKY"), &report.replace("46.498293369", "nan"), "{", ""] {
            assert_eq!(read(other), None, "{other}");
        }
    }

    /// The example of gpsd's page on NMEA, and sentences without a usable position.
    #[test]
    fn val_nmea_0183_a_position_needs_a_checksum_and_a_fix() {
        let gga = "GPGGA,123519,4807.038,N,01131.324,E,1,08,0.9,545.4,M,46.9,M,,";
        let at = read(&sentence(gga)).unwrap().unwrap();
        assert!((at.latitude - 48.1173).abs() < 1e-9 && (at.longitude - 11.5221).abs() < 1e-4, "{at:?}");
        assert_eq!(read("$GPGGA,123519,4807.038,N,01131.324,E,1,08,0.9,545.4,M,46.9,M,,*00"), None);
        for (was, is, why) in [
            ("E,1,", "E,0,", "no fix"),
            ("4807.038,N,01131.324,E,1", ",,,,0", "no fix"),
            ("4807.038,N", "9907.000,N", "99.116"),
            ("4807.038,N", "48nan,N", "NaN,11.522066666666667 is no position"),
        ] {
            let refused = read(&sentence(&gga.replace(was, is))).unwrap().unwrap_err();
            assert!(refused.starts_with(why), "{is}: {refused}");
        }
        assert_eq!(read(&sentence("GPGSV,1,1,00")), None);
    }

    proptest! {
        #[test]
        fn no_line_panics_and_each_position_is_one(
            line in prop_oneof![
                ".*", "GPGGA,[0-9.,NSEW]{0,60}".prop_map(|text| sentence(&text)),
                r#"\{"class":"TPV","mode":3,"lat":-?[0-9]{1,4},"lon":-?[0-9]{1,4}\}"#,
            ],
        ) {
            if let Some(Ok(at)) = read(&line) {
                prop_assert!(at.is_valid(), "{line}");
            }
        }
    }

    /// A gpsd that has accepted a connection and was queried.
    async fn accepted(listener: &TcpListener) -> TcpStream {
        let (mut stream, _) = listener.accept().await.unwrap();
        let mut request = String::new();
        BufReader::new(&mut stream).read_line(&mut request).await.unwrap();
        assert_eq!(request.as_bytes(), WATCH);
        stream
    }

    #[tokio::test]
    async fn a_gpsd_that_goes_away_and_comes_back_is_queried_again() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let mut locator = Locator::open(format!("gpsd://{address}").parse().unwrap()).await.unwrap();
        for latitude in [48.25, 48.5] {
            let gpsd = async {
                let mut stream = accepted(&listener).await;
                let reports = format!(
                    "{{\"class\":\"VERSION\"}}\r\n{{\"class\":\"TPV\",\"mode\":3,\"lat\":{latitude},\"lon\":11}}\r\n"
                );
                stream.write_all(reports.as_bytes()).await.unwrap();
            };
            let ((), found) = tokio::join!(gpsd, locator.next());
            assert_eq!(found, Msg::Here(Ok(Degrees { latitude, longitude: 11.0 })));
            let gone = locator.next().await;
            assert!(
                matches!(&gone, Msg::Here(Err(why)) if why.starts_with(&address.to_string())),
                "{gone:?}"
            );
        }
    }

    /// As a phone sends them; a sentence may come in pieces.
    #[tokio::test]
    async fn a_receiver_without_a_fix_is_reported_once() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let mut locator = Locator::open(format!("tcpout:{address}").parse().unwrap()).await.unwrap();
        let no_fix = sentence("GPGGA,123519,,,,,0,00,99.9,,,,,,");
        let fix = sentence("GNGGA,123520,4807.038,S,01131.324,W,4,08,0.9,545.4,M,46.9,M,,");
        let text = format!("{no_fix}\r\n{no_fix}\r\n\u{fffd}{fix}\r\n{}", "x".repeat(LINE_MAX + 9));
        let (mut stream, _) = listener.accept().await.unwrap();
        stream.write_all(text.as_bytes()).await.unwrap();
        assert_eq!(locator.next().await, Msg::Here(Err("no fix".to_owned())));
        for piece in ["\r\n", &fix[..20], &fix[20..], "\r\n"] {
            stream.write_all(piece.as_bytes()).await.unwrap();
            stream.flush().await.unwrap();
        }
        let Msg::Here(Ok(at)) = locator.next().await else { panic!("no position") };
        assert!((at.latitude + 48.1173).abs() < 1e-9 && at.longitude < -11.0, "{at:?}");
    }

    #[test]
    fn a_wrong_source_is_refused_with_what_would_do() {
        for wrong in ["gpsd://localhost", "/dev/ttyACM0", "gpsd://:2947", "serial:/dev/ttyACM0"] {
            let refused = wrong.parse::<PositionSource>().unwrap_err();
            assert!(
                refused.starts_with(&format!("`{wrong}` is no source"))
                    && refused.contains("gpsd://HOST:PORT")
            );
        }
    }
}
