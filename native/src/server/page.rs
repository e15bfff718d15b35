//! The page's files.
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Larger files are not sent \[bytes\].
const MAX_PAGE_FILE_BYTES: u64 = 64 << 20;
/// Says to the page that its server has a recording to offer.
const MARK: &str = r#"<meta name="mte-slam-serve" content="api/info">"#;

/// The folder of the built page, if there is one.
pub struct Page {
    root: Option<PathBuf>,
}

impl Page {
    /// A folder that was named, or `www/dist` in the current folder or above the program.
    pub fn find(named: Option<&Path>) -> Page {
        let candidates = match named {
            Some(path) => vec![path.to_owned()],
            None => {
                let program = std::env::current_exe().unwrap_or_default();
                let above = program.ancestors().skip(1).map(|folder| folder.join("www/dist"));
                [PathBuf::from("www/dist")].into_iter().chain(above).collect()
            }
        };
        let whole = |path: &PathBuf| path.join("index.html").is_file();
        let root = candidates.into_iter().find(whole).and_then(|path| path.canonicalize().ok());
        Page { root }
    }

    /// Whether there is a page.
    pub fn found(&self) -> bool {
        self.root.is_some()
    }

    /// A file by the path of its address, and its media type. Only plain names below the folder.
    pub fn file(&self, path: &str) -> Option<(Vec<u8>, &'static str)> {
        let name = path.strip_prefix('/')?;
        let name = if name.is_empty() { "index.html" } else { name };
        let plain = |part: &str| {
            let known = |b: u8| b.is_ascii_alphanumeric() || b"-_.".contains(&b);
            !part.is_empty() && !part.starts_with('.') && part.bytes().all(known)
        };
        if !name.split('/').all(plain) {
            return None;
        }
        let Some(root) = &self.root else {
            return (name == "index.html").then(|| (NO_PAGE.into(), "text/html; charset=utf-8"));
        };
        // A link inside the folder may lead out of it.
        let file = root.join(name).canonicalize().ok().filter(|f| f.starts_with(root))?;
        let meta = fs::metadata(&file).ok()?;
        if !meta.is_file() || meta.len() > MAX_PAGE_FILE_BYTES {
            return None;
        }
        let bytes = fs::read(&file).ok()?;
        if name == "index.html" {
            let text = String::from_utf8(bytes).ok()?;
            return Some((
                text.replacen("<head>", &format!("<head>\n{MARK}"), 1).into(),
                kind(name),
            ));
        }
        Some((bytes, kind(name)))
    }
}

fn kind(name: &str) -> &'static str {
    match name.rsplit('.').next().unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "wasm" => "application/wasm",
        "svg" => "image/svg+xml",
        "json" => "application/json",
        "png" => "image/png",
        _ => "application/octet-stream",
    }
}

const NO_PAGE: &str = "<!doctype html><html lang=\"en\"><head><title>MTE-SLAM</title></head><body>\
    <h1>The page is not built</h1><p>Run <code>./scripts/build-web.sh</code>, or name the folder of a \
    built page by <code>--page</code>. The recording is served at <code>api/info</code> and \
    <code>api/stream</code>.</p></body></html>\n";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_the_page_are_found() {
        let outer = tempfile::tempdir().unwrap();
        let root = outer.path().join("dist");
        fs::create_dir_all(root.join("assets")).unwrap();
        fs::write(outer.path().join("secret.txt"), "s").unwrap();
        fs::write(root.join("index.html"), "<html><head></head></html>").unwrap();
        fs::write(root.join("assets/a.js"), "a").unwrap();
        fs::write(root.join(".hidden"), "h").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(outer.path().join("secret.txt"), root.join("link.txt")).unwrap();
        let page = Page::find(Some(&root));
        assert!(page.found());
        assert!(String::from_utf8(page.file("/").unwrap().0).unwrap().contains("mte-slam-serve"));
        assert_eq!(page.file("/assets/a.js").unwrap(), (b"a".to_vec(), kind("a.js")));
        for path in [
            "/../secret.txt",
            "/assets/../../secret.txt",
            "/%2e%2e/secret.txt",
            "//etc/hostname",
            "/.hidden",
            "/assets",
            "/link.txt",
            "/nothing.js",
            "assets/a.js",
            "/assets\\a.js",
        ] {
            assert!(page.file(path).is_none(), "{path}");
        }
    }

    #[test]
    fn without_a_page_the_server_says_how_to_build_it() {
        let empty = tempfile::tempdir().unwrap();
        let page = Page::find(Some(empty.path()));
        assert!(!page.found());
        let text = String::from_utf8(page.file("/").unwrap().0).unwrap();
        assert!(text.contains("build-web.sh"));
        assert!(page.file("/assets/a.js").is_none());
    }
}
