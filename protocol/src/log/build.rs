//! Identifies the build that wrote a log.

use std::collections::BTreeMap;

/// Returns version, commit, compiler, target and hash of the lock file of this build, as every log contains them.
pub fn build_info() -> BTreeMap<String, String> {
    [
        ("version", env!("CARGO_PKG_VERSION")),
        ("git_commit", env!("TOUCHDOWN_GIT_COMMIT")),
        ("rustc", env!("TOUCHDOWN_RUSTC")),
        ("target", env!("TOUCHDOWN_TARGET")),
        ("target_features", env!("TOUCHDOWN_TARGET_FEATURES")),
        ("lock_sha256", env!("TOUCHDOWN_LOCK_SHA256")),
        ("profile", if cfg!(debug_assertions) { "debug" } else { "release" }),
    ]
    .into_iter()
    .map(|(key, value)| (key.to_owned(), value.to_owned()))
    .collect()
}
