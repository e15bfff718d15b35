//! Recordings as a browser meets them: files of a folder, archives, and folders on servers. All
//! are read synchronously, which a worker may do.
mod files;
mod http;
mod listing;
mod zip;

pub use files::FilesSource;
pub(crate) use files::reason;
pub use http::HttpSource;
pub use zip::ZipSource;

/// Larger than any file of a recording that is read as a whole \[bytes\].
pub(crate) const MAX_FILE_BYTES: u64 = 256 << 20;

/// The last part of an address, as a name.
pub(crate) fn last_part(url: &str) -> String {
    let path = url.split(['?', '#']).next().unwrap_or(url);
    let name = path.trim_end_matches('/').rsplit('/').next().unwrap_or(path);
    if name.is_empty() { url.into() } else { name.into() }
}
