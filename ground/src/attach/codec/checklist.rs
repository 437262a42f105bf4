//! Encodes a checklist with its signatures: name, mission, hash, a `u32` count, each step with its limits and its mark.

use protocol::dialect::TdRole;

use super::bytes::{CodecError, Reader, Writer};
use crate::model::checklist::{Checklist, Limits, Mark, Signature, Step};
use crate::model::quantity::Quantity;

/// The number for no role.
const NOBODY: u8 = u8::MAX;

pub(super) fn encode(list: &Checklist, out: &mut Writer) {
    out.text(&list.name).text(list.mission.as_deref().unwrap_or_default()).text(&list.hash);
    out.u32(list.steps.len() as u32);
    for step in &list.steps {
        out.text(&step.words).u8(number(step.role));
        let limits = step.value.as_ref();
        out.text(limits.map_or("", |limits| limits.quantity.name));
        out.f64(limits.and_then(|limits| limits.least).unwrap_or(f64::NAN));
        out.f64(limits.and_then(|limits| limits.most).unwrap_or(f64::NAN));
        let (kind, signature) = match &step.mark {
            Mark::Open => (0, None),
            Mark::Signed(signature) => (1, Some(signature)),
            Mark::Voided(signature) => (2, Some(signature)),
        };
        out.u8(kind);
        if let Some(signature) = signature {
            out.text(&signature.by).u8(number(signature.role)).u64(signature.unix_s);
            out.f64(signature.found.unwrap_or(f64::NAN));
        }
    }
}

pub(super) fn decode(rest: &mut Reader) -> Result<Checklist, CodecError> {
    let name = rest.text()?;
    let mission = Some(rest.text()?).filter(|mission| !mission.is_empty());
    let hash = rest.text()?;
    // No memory is reserved by the count: a wrong count ends with the bytes.
    let steps = (0..rest.u32()?).map(|_| step(rest)).collect::<Result<_, _>>()?;
    Ok(Checklist { name, mission, hash, steps })
}

fn step(rest: &mut Reader) -> Result<Step, CodecError> {
    let (words, role, name) = (rest.text()?, role(rest.u8()?)?, rest.text()?);
    let (least, most) = (number_or_none(rest.f64()?), number_or_none(rest.f64()?));
    let value = match Quantity::named(&name) {
        Some(quantity) => Some(Limits { quantity, least, most }),
        None if name.is_empty() => None,
        None => return Err(CodecError("an unknown value")),
    };
    let mark = match rest.u8()? {
        0 => Mark::Open,
        1 => Mark::Signed(signature(rest)?),
        2 => Mark::Voided(signature(rest)?),
        _ => return Err(CodecError("an unknown mark")),
    };
    Ok(Step { words, role, value, mark })
}

fn signature(rest: &mut Reader) -> Result<Signature, CodecError> {
    Ok(Signature {
        by: rest.text()?,
        role: role(rest.u8()?)?,
        unix_s: rest.u64()?,
        found: number_or_none(rest.f64()?),
    })
}

fn number_or_none(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn number(role: Option<TdRole>) -> u8 {
    role.map_or(NOBODY, |role| role as u8)
}

fn role(number: u8) -> Result<Option<TdRole>, CodecError> {
    let roles =
        [TdRole::TD_ROLE_OBSERVER, TdRole::TD_ROLE_RANGE_SAFETY, TdRole::TD_ROLE_FLIGHT, TdRole::TD_ROLE_PAD];
    match roles.into_iter().find(|role| *role as u8 == number) {
        None if number != NOBODY => Err(CodecError("an unknown role")),
        role => Ok(role),
    }
}
