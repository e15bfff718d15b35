//! A report as blocks, from which HTML and Markdown are made.

/// A report.
pub struct Document {
    /// First line.
    pub title: String,
    /// Everything below it.
    pub blocks: Vec<Block>,
}

/// One block.
pub enum Block {
    /// A heading of a section (2) or a part of one (3).
    Heading(u8, String),
    /// A paragraph.
    Text(String),
    /// A list.
    List(Vec<String>),
    /// A table.
    Table(Table),
    /// Figures beside each other.
    Figures(Vec<Picture>),
}

/// A picture or chart.
pub struct Picture {
    /// What it shows.
    pub caption: String,
    /// SVG or `img` element; nothing else is in it, and nothing it loads.
    pub html: String,
    /// A file below the output folder that shows the same, for Markdown.
    pub file: Option<String>,
    /// Whether it takes the whole width.
    pub wide: bool,
}

/// A table.
#[derive(Default)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// How it was measured, where it comes from.
    pub notes: Vec<String>,
    /// Column heads.
    pub head: Vec<String>,
    /// How many columns name the row.
    pub labels: usize,
    /// Rows.
    pub rows: Vec<Vec<String>>,
    /// Whether it is of figures published elsewhere.
    pub published: bool,
}

/// For HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
