//! The key that signs a book's head: Ed25519, so that who checks a book needs no secret.

use std::fmt;

use ed25519_dalek::{Signature, Signer as _, SigningKey, VerifyingKey};
use sha2::{Digest as _, Sha256};

use super::{Head, SignedHead};
use crate::signing::Key;

/// The seed of the signing key is the hash of this and the station's secret: the secret itself signs frames only.
const SEED_DOMAIN: &[u8] = b"touchdown book key 1";
const HEAD_DOMAIN: &[u8] = b"touchdown book head 1";

/// Signs heads.
#[derive(Clone)]
pub struct BookKey(SigningKey);

impl fmt::Debug for BookKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("BookKey(secret)")
    }
}

/// Checks signatures of heads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PublicKey(VerifyingKey);

impl BookKey {
    /// The key that belongs to a station's secret key. Vehicle and station share that secret, so both could sign.
    pub fn of(key: &Key) -> Self {
        let seed = Sha256::new().chain_update(SEED_DOMAIN).chain_update(key.secret()).finalize();
        Self(SigningKey::from_bytes(&seed.into()))
    }

    pub fn public(&self) -> PublicKey {
        PublicKey(self.0.verifying_key())
    }

    pub fn sign(&self, head: Head) -> SignedHead {
        SignedHead { head, signature: self.0.sign(&signed_bytes(&head)).to_bytes() }
    }
}

impl PublicKey {
    /// `None` if these bytes are no key.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        VerifyingKey::from_bytes(bytes.try_into().ok()?).ok().map(Self)
    }

    /// Reads 64 hexadecimal digits; `None` for anything else.
    pub fn from_hex(text: &str) -> Option<Self> {
        Self::from_bytes(Key::from_hex(text)?.secret())
    }

    pub fn bytes(&self) -> &[u8; 32] {
        self.0.as_bytes()
    }

    /// Whether this key signed the head.
    pub fn signed(&self, signed: &SignedHead) -> bool {
        let signature = Signature::from_bytes(&signed.signature);
        self.0.verify_strict(&signed_bytes(&signed.head), &signature).is_ok()
    }
}

/// As 64 hexadecimal digits.
impl fmt::Display for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&Key::new(*self.bytes()).to_hex())
    }
}

fn signed_bytes(head: &Head) -> Vec<u8> {
    [HEAD_DOMAIN, &head.book.to_le_bytes(), &head.entries.to_le_bytes(), &head.hash].concat()
}
