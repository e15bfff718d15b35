//! What a suite has measured: as JSON, CSV, one HTML page and Markdown.
pub mod charts;
pub mod document;
pub mod embedded;
pub mod html;
pub mod markdown;
pub mod results;
pub mod scenes;
pub mod tables;
pub mod write;
