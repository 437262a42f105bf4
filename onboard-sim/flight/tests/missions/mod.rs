//! Missions that only tests fly: other motors and masses than those of the built-in vehicles.

/// Name and TOML text.
pub(crate) const TEST_MISSIONS: [(&str, &str); 4] = [
    ("mk2-h53", include_str!("mk2-h53.toml")),
    ("mini-f10", include_str!("mini-f10.toml")),
    ("vlr-f15", include_str!("vlr-f15.toml")),
    ("vlr-f16", include_str!("vlr-f16.toml")),
];
