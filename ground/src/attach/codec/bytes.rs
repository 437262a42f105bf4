//! Writes numbers, texts and frames as bytes, and reads them back.

use std::time::Duration;

use protocol::frame::{Frame, Framer};

/// Bytes of the length that stands before every message.
pub(super) const PREFIX_LEN: usize = 4;

/// The bytes are no valid message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unexpected bytes on the socket: {0}")]
pub struct CodecError(pub(super) &'static str);

pub(super) struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    pub(super) fn new(now: Duration) -> Self {
        let mut bytes = vec![0; PREFIX_LEN + 1];
        bytes.extend(u64::try_from(now.as_nanos()).unwrap_or(u64::MAX).to_le_bytes());
        Self { bytes }
    }

    pub(super) fn kind(&mut self, kind: u8) -> &mut Self {
        self.bytes[PREFIX_LEN] = kind;
        self
    }

    pub(super) fn raw(&mut self, bytes: &[u8]) -> &mut Self {
        self.bytes.extend_from_slice(bytes);
        self
    }

    pub(super) fn u8(&mut self, value: u8) -> &mut Self {
        self.raw(&[value])
    }

    pub(super) fn u32(&mut self, value: u32) -> &mut Self {
        self.raw(&value.to_le_bytes())
    }

    pub(super) fn u64(&mut self, value: u64) -> &mut Self {
        self.raw(&value.to_le_bytes())
    }

    pub(super) fn f64(&mut self, value: f64) -> &mut Self {
        self.u64(value.to_bits())
    }

    /// Writes at most 4,000 bytes of the text; no valid text is longer.
    pub(super) fn text(&mut self, text: &str) -> &mut Self {
        let mut end = text.len().min(4_000);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        self.u32(end as u32).raw(&text.as_bytes()[..end])
    }

    pub(super) fn finish(mut self) -> Vec<u8> {
        let length = (self.bytes.len() - PREFIX_LEN) as u32;
        self.bytes[..PREFIX_LEN].copy_from_slice(&length.to_le_bytes());
        self.bytes
    }
}

pub(super) struct Reader<'a>(pub(super) &'a [u8]);

impl Reader<'_> {
    pub(super) fn take<const N: usize>(&mut self) -> Result<[u8; N], CodecError> {
        let (taken, rest) = self.0.split_first_chunk().ok_or(CodecError("too short"))?;
        self.0 = rest;
        Ok(*taken)
    }

    pub(super) fn u8(&mut self) -> Result<u8, CodecError> {
        Ok(self.take::<1>()?[0])
    }

    pub(super) fn u32(&mut self) -> Result<u32, CodecError> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    pub(super) fn u64(&mut self) -> Result<u64, CodecError> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    pub(super) fn f64(&mut self) -> Result<f64, CodecError> {
        Ok(f64::from_bits(self.u64()?))
    }

    pub(super) fn size(&mut self) -> Result<usize, CodecError> {
        usize::try_from(self.u64()?).map_err(|_too_large| CodecError("a size beyond this machine"))
    }

    pub(super) fn text(&mut self) -> Result<String, CodecError> {
        let length = usize::try_from(self.u32()?).unwrap_or(usize::MAX);
        let text = self.0.get(..length).ok_or(CodecError("too short"))?;
        self.0 = &self.0[length..];
        String::from_utf8(text.to_vec()).map_err(|_not_text| CodecError("not text"))
    }

    pub(super) fn frame(&mut self) -> Result<Frame, CodecError> {
        let mut framer = Framer::new();
        framer.push_datagram(std::mem::take(&mut self.0));
        framer.next_frame().ok_or(CodecError("not a frame"))
    }

    /// Ignores the remaining bytes.
    pub(super) fn skip(&mut self) {
        self.0 = &[];
    }

    pub(super) fn end(&self) -> Result<(), CodecError> {
        if self.0.is_empty() { Ok(()) } else { Err(CodecError("too long")) }
    }
}
