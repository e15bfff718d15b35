//! Shaders as the browser's module holds them: without comments and indentation, at compile time.
//! Lines stay lines, so that messages count them as the source does.

/// Whether a comment begins at byte `i`.
const fn comment(s: &[u8], i: usize) -> bool {
    s[i] == b'/' && i + 1 < s.len() && s[i + 1] == b'/'
}

/// Goes through the text of a shader and writes what is kept to `out`, as far as that reaches; the
/// number of bytes kept.
const fn write(source: &str, out: &mut [u8]) -> usize {
    let s = source.as_bytes();
    let (mut i, mut n) = (0, 0);
    while i < s.len() {
        // A line: its indentation, what is kept, blanks and a comment.
        while i < s.len() && (s[i] == b' ' || s[i] == b'\t') {
            i += 1;
        }
        let start = i;
        while i < s.len() && s[i] != b'\n' && s[i] != b'\r' && !comment(s, i) {
            i += 1;
        }
        let mut end = i;
        while end > start && (s[end - 1] == b' ' || s[end - 1] == b'\t') {
            end -= 1;
        }
        let mut at = start;
        while at < end {
            if n < out.len() {
                out[n] = s[at];
            }
            (at, n) = (at + 1, n + 1);
        }
        while i < s.len() && s[i] != b'\n' {
            i += 1;
        }
        if i < s.len() {
            if n < out.len() {
                out[n] = b'\n';
            }
            (i, n) = (i + 1, n + 1);
        }
    }
    n
}

/// Bytes of `source` that are kept.
#[doc(hidden)]
pub const fn bare_length(source: &str) -> usize {
    write(source, &mut [])
}

/// `source` without comments and indentation; `N` is its [`bare_length`].
#[doc(hidden)]
pub const fn bare<const N: usize>(source: &str) -> [u8; N] {
    let mut out = [0; N];
    assert!(write(source, &mut out) == N);
    out
}

/// A text that is known to be one.
#[doc(hidden)]
pub const fn text(bytes: &'static [u8]) -> &'static str {
    match core::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(_) => panic!("not UTF-8"),
    }
}

/// The text of a shader file: as it is, or bare in a browser's module, which is downloaded.
#[doc(hidden)]
#[cfg(not(target_arch = "wasm32"))]
#[macro_export]
macro_rules! embedded_shader {
    ($path:expr) => {
        include_str!($path)
    };
}

/// The text of a shader file: as it is, or bare in a browser's module, which is downloaded.
#[doc(hidden)]
#[cfg(target_arch = "wasm32")]
#[macro_export]
macro_rules! embedded_shader {
    ($path:expr) => {{
        const SOURCE: &str = include_str!($path);
        const LENGTH: usize = $crate::embed::bare_length(SOURCE);
        static BARE: [u8; LENGTH] = $crate::embed::bare(SOURCE);
        $crate::embed::text(&BARE)
    }};
}

/// The text of one of this package's kernels by name.
macro_rules! shader {
    ($name:literal) => {
        $crate::embedded_shader!(concat!(env!("CARGO_MANIFEST_DIR"), "/", $name, ".wgsl"))
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{kernels, shader::SHARED};
    use alloc::{string::String, vec, vec::Vec};

    fn bared(source: &str) -> String {
        let mut out = vec![0; bare_length(source)];
        assert_eq!(write(source, &mut out), out.len());
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn comments_and_indentation_go_and_lines_stay() {
        let source = "// head\n\n\tlet a = b / c;  // why\r\n  #if X\n} // ü\n//\n  d";
        assert_eq!(bared(source), "\n\nlet a = b / c;\n#if X\n}\n\nd");
        const SOURCE: &str = "  a // b\n";
        const BARE: [u8; bare_length(SOURCE)] = bare(SOURCE);
        assert_eq!(text(&BARE), "a\n");
    }

    #[test]
    fn every_shader_says_the_same_in_fewer_bytes() {
        let sources = kernels::ALL.iter().map(|k| k.wgsl).chain(SHARED.iter().map(|s| s.1));
        for source in sources {
            let words = |text: &str| -> Vec<String> {
                let code = text.lines().map(|l| l.split_once("//").map_or(l, |(code, _)| code));
                code.flat_map(str::split_whitespace).map(String::from).collect()
            };
            let bare = bared(source);
            assert_eq!(words(source), words(&bare));
            assert_eq!(source.lines().count(), bare.lines().count());
            assert!(bare.len() < source.len() && !bare.contains("//"));
        }
    }
}
