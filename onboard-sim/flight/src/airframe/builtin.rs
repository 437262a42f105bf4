/// The built-in airframes: name and TOML text.
pub(super) const BUILTIN: &[(&str, &str)] = &[
    ("mk2", include_str!("../../airframes/mk2.toml")),
    ("mk2-h53", include_str!("../../airframes/mk2-h53.toml")),
    ("mini-f10", include_str!("../../airframes/mini-f10.toml")),
];
