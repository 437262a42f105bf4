//! Encodes the link reports: a `u32` count, each link with its rates and components, then the signature counts.

use std::time::Duration;

use protocol::identity::Address;
use protocol::link_stats::{LinkFigures, SourceFigures};
use protocol::signing::SigningCounters;

use super::bytes::{CodecError, Reader, Writer};
use crate::model::link::LinkReport;

pub(super) fn encode(links: &[LinkReport], signing: Option<&SigningCounters>, out: &mut Writer) {
    out.u32(links.len() as u32);
    for link in links {
        let LinkReport { name, figures, sources, capacity_bytes_s, copies, trouble } = link;
        let LinkFigures { rx_bytes_s, tx_bytes_s, rx_frames_s, loss } = *figures;
        out.text(name).f64(rx_bytes_s).f64(tx_bytes_s).f64(rx_frames_s).f64(loss);
        out.u32(sources.len() as u32);
        for SourceFigures { source, age, rx_frames_s, loss } in sources {
            out.u8(source.system_id).u8(source.component_id);
            out.u64(u64::try_from(age.as_nanos()).unwrap_or(u64::MAX)).f64(*rx_frames_s).f64(*loss);
        }
        out.u8(u8::from(capacity_bytes_s.is_some())).u32(capacity_bytes_s.unwrap_or_default());
        out.u64(*copies);
        out.u8(u8::from(trouble.is_some())).text(trouble.as_deref().unwrap_or_default());
    }
    out.u8(u8::from(signing.is_some()));
    if let Some(SigningCounters { accepted, unsigned, wrong, replayed, too_old, too_new }) = signing {
        out.u64(*accepted).u64(*unsigned).u64(*wrong).u64(*replayed).u64(*too_old).u64(*too_new);
    }
}

/// Link reports and signature counts.
type Report = (Vec<LinkReport>, Option<SigningCounters>);

pub(super) fn decode(rest: &mut Reader) -> Result<Report, CodecError> {
    // No memory is reserved by the count: a wrong count ends with the bytes.
    let links = (0..rest.u32()?).map(|_| link(rest)).collect::<Result<_, _>>()?;
    let signing = match rest.u8()? {
        0 => None,
        _ => Some(SigningCounters {
            accepted: rest.u64()?,
            unsigned: rest.u64()?,
            wrong: rest.u64()?,
            replayed: rest.u64()?,
            too_old: rest.u64()?,
            too_new: rest.u64()?,
        }),
    };
    Ok((links, signing))
}

fn link(rest: &mut Reader) -> Result<LinkReport, CodecError> {
    let name = rest.text()?;
    let figures = LinkFigures {
        rx_bytes_s: rest.f64()?,
        tx_bytes_s: rest.f64()?,
        rx_frames_s: rest.f64()?,
        loss: rest.f64()?,
    };
    let sources = (0..rest.u32()?).map(|_| source(rest)).collect::<Result<_, _>>()?;
    let (bounded, capacity) = (rest.u8()? != 0, rest.u32()?);
    let copies = rest.u64()?;
    let (down, why) = (rest.u8()? != 0, rest.text()?);
    Ok(LinkReport {
        name,
        figures,
        sources,
        capacity_bytes_s: bounded.then_some(capacity),
        copies,
        trouble: down.then_some(why),
    })
}

fn source(rest: &mut Reader) -> Result<SourceFigures, CodecError> {
    Ok(SourceFigures {
        source: Address { system_id: rest.u8()?, component_id: rest.u8()? },
        age: Duration::from_nanos(rest.u64()?),
        rx_frames_s: rest.f64()?,
        loss: rest.f64()?,
    })
}
