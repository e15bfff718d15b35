//! Names of files in the listing pages of common servers (Apache, nginx, Python, Caddy).

/// Whether a listed name stays below its folder.
pub fn is_inside(name: &str) -> bool {
    let parts = || name.trim_end_matches('/').split('/');
    !name.is_empty()
        && !name.contains(['\\', '\0'])
        && parts().all(|p| !matches!(p, "" | "." | ".."))
}

/// Entries of a page that lie directly below it, folders with a final `/`. Links elsewhere, to
/// the parent, and to other orders of the same list are left out.
pub fn names(html: &str) -> Vec<String> {
    let mut found = Vec::new();
    for rest in html.split("href=").skip(1) {
        let Some(quote) = rest.chars().next().filter(|c| matches!(c, '"' | '\'')) else { continue };
        let Some(link) = rest[1..].split(quote).next() else { continue };
        let link = link.strip_prefix("./").unwrap_or(link).replace("&amp;", "&");
        let Some(name) = decoded(&link) else { continue };
        let single = !name.trim_end_matches('/').contains('/');
        if single && is_inside(&name) && !link.contains(['?', '#', ':']) {
            found.push(name);
        }
    }
    found
}

/// Percent-decoded, if that is text.
fn decoded(link: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = link.bytes();
    while let Some(byte) = rest.next() {
        if byte == b'%' {
            let hex = [rest.next()?, rest.next()?];
            bytes.push(u8::from_str_radix(core::str::from_utf8(&hex).ok()?, 16).ok()?);
        } else {
            bytes.push(byte);
        }
    }
    String::from_utf8(bytes).ok()
}

/// Percent-encoded for a path.
pub fn encoded(name: &str) -> String {
    let plain = |b: &u8| b.is_ascii_alphanumeric() || b"-._~/".contains(b);
    name.bytes()
        .map(|b| if plain(&b) { char::from(b).to_string() } else { format!("%{b:02X}") })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_of_servers_are_understood() {
        let python =
            r#"<li><a href="a%20b.png">a b.png</a></li><li><a href="results/">results/</a></li>"#;
        assert_eq!(names(python), ["a b.png", "results/"]);
        let apache =
            r#"<a href="?C=N;O=D">Name</a> <a href="/up/">Parent</a> <a href='x.txt'>x</a>"#;
        assert_eq!(names(apache), ["x.txt"]);
        let caddy = r#"<a href="./traj.txt"> <a href="../"> <a href="https://example.org/x"> <a href=bare>"#;
        assert_eq!(names(caddy), ["traj.txt"]);
    }

    #[test]
    fn nothing_leads_out() {
        for name in ["../x", "a/../../x", "/etc/passwd", "a//b", "", "a\\b", "%2e%2e/"] {
            assert!(!is_inside(&decoded(name).unwrap()), "{name}");
        }
        assert!(names(r#"<a href="%2e%2e/">"#).is_empty());
        assert!(is_inside("a/b..png"));
        assert_eq!(encoded("a b/ä%.png"), "a%20b/%C3%A4%25.png");
    }
}
