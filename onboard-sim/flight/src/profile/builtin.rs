/// The built-in profiles: name and TOML text.
pub const BUILTIN: &[(&str, &str)] = &[
    ("paper-calibrated", include_str!("../../profiles/paper-calibrated.toml")),
    ("paper-as-printed", include_str!("../../profiles/paper-as-printed.toml")),
    ("paper-dispersed", include_str!("../../profiles/paper-dispersed.toml")),
];
