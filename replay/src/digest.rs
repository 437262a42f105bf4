//! XXH64: tells files and flights apart, but does not protect against forgery.

use std::hash::Hasher as _;

use twox_hash::XxHash64;

/// The digest of the parts, one after the other.
pub(crate) fn digest<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> u64 {
    let mut hash = XxHash64::with_seed(0);
    parts.into_iter().for_each(|part| hash.write(part));
    hash.finish()
}
