//! Finds the name of the person at this screen.

use crate::attach::message::OPERATOR_MAX;

/// The given name, otherwise the user and the terminal or host, as in `anna on pts/3` or `anna from 192.168.1.7`.
pub(super) fn operator(named: Option<&str>) -> String {
    let variable = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    let words = named.map_or_else(
        || {
            let user = variable("USER").or_else(|| variable("LOGNAME"));
            let client = variable("SSH_CLIENT").or_else(|| variable("SSH_CONNECTION"));
            let terminal = std::fs::read_link("/proc/self/fd/0").ok();
            let terminal = terminal.and_then(|path| path.to_str().map(str::to_owned));
            described(user.as_deref(), client.as_deref(), terminal.as_deref())
        },
        str::to_owned,
    );
    protocol::text::printable(words.as_bytes()).chars().take(OPERATOR_MAX).collect()
}

/// `client` is the value of SSH_CLIENT (address, port, port); `terminal` is a path.
fn described(user: Option<&str>, client: Option<&str>, terminal: Option<&str>) -> String {
    let user = user.unwrap_or("somebody");
    let address = client.and_then(|client| client.split_whitespace().next());
    let terminal = terminal.and_then(|path| path.strip_prefix("/dev/")).filter(|name| *name != "null");
    match (address, terminal) {
        (Some(address), _) => format!("{user} from {address}"),
        (None, Some(terminal)) => format!("{user} on {terminal}"),
        (None, None) => user.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operator_is_a_user_and_where_from() {
        assert_eq!(described(Some("anna"), None, Some("/dev/pts/3")), "anna on pts/3");
        assert_eq!(
            described(Some("anna"), Some("10.0.0.7 5022 22"), Some("/dev/pts/3")),
            "anna from 10.0.0.7"
        );
        assert_eq!(described(None, None, Some("pipe:[7]")), "somebody");
        assert_eq!(operator(Some("Anna \u{1b}[2J")).chars().filter(|c| c.is_control()).count(), 0);
    }
}
