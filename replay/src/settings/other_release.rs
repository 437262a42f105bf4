//! Explains why the profile of another release cannot be used.

/// The message, and what a missing or an unknown key means for a log.
pub(crate) fn explained(message: &str) -> String {
    let remark = if message.contains("unknown field") {
        "another release wrote this profile, and this build does not know that key; without it the computer would not be \
         the one that flew. The log's `build` says which release reads it"
    } else if message.contains("missing field") {
        "another release wrote this profile, and this build needs that key; no value is known to be the one that flew. \
         The log's `build` says which release reads it"
    } else {
        return message.to_owned();
    };
    format!("{}: {remark}", message.trim_end())
}
