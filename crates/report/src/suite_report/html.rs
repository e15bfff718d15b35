//! The report as one HTML page that loads nothing: style, charts and pictures are in it.
use super::document::{Block, Document, Picture, Table, escape};
use std::fmt::Write;

const STYLE: &str = include_str!("report.css");

/// The text of `report.html`.
pub fn html(document: &Document) -> String {
    let title = escape(&document.title);
    let mut s = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n"
    );
    contents(&mut s, document);
    for (i, block) in document.blocks.iter().enumerate() {
        match block {
            Block::Heading(level, text) => {
                let _ = writeln!(s, "<h{level} id=\"b{i}\">{}</h{level}>", escape(text));
            }
            Block::Text(text) => {
                let _ = writeln!(s, "<p>{}</p>", escape(text));
            }
            Block::List(items) => {
                let items: String =
                    items.iter().map(|item| format!("<li>{}</li>\n", escape(item))).collect();
                let _ = writeln!(s, "<ul>\n{items}</ul>");
            }
            Block::Table(table) => of_table(&mut s, table),
            Block::Figures(pictures) => {
                s += "<div class=\"figures\">\n";
                pictures.iter().for_each(|picture| of_picture(&mut s, picture));
                s += "</div>\n";
            }
        }
    }
    s + "</main>\n</body>\n</html>\n"
}

/// Links to the sections.
fn contents(s: &mut String, document: &Document) {
    *s += "<nav>";
    for (i, block) in document.blocks.iter().enumerate() {
        if let Block::Heading(2, text) = block {
            let _ = write!(s, "<a href=\"#b{i}\">{}</a> ", escape(text));
        }
    }
    *s += "</nav>\n";
}

fn of_table(s: &mut String, table: &Table) {
    let class = if table.published { "table published" } else { "table" };
    let _ = writeln!(
        s,
        "<figure class=\"{class}\">\n<figcaption>{}</figcaption>\n<div class=\"scroll\">\n<table>",
        escape(&table.caption)
    );
    let label = |i: usize| if i < table.labels { " class=\"label\"" } else { "" };
    *s += "<thead><tr>";
    for (i, cell) in table.head.iter().enumerate() {
        let _ = write!(s, "<th scope=\"col\"{}>{}</th>", label(i), escape(cell));
    }
    *s += "</tr></thead>\n<tbody>\n";
    for row in &table.rows {
        let class =
            if row.iter().take(table.labels).any(|c| c == "mean") { " class=\"mean\"" } else { "" };
        let _ = write!(s, "<tr{class}>");
        for (i, cell) in row.iter().enumerate() {
            let _ = write!(s, "<td{}>{}</td>", label(i), escape(cell));
        }
        *s += "</tr>\n";
    }
    *s += "</tbody>\n</table>\n</div>\n";
    for note in &table.notes {
        let _ = writeln!(s, "<p class=\"note\">{}</p>", escape(note));
    }
    *s += "</figure>\n";
}

fn of_picture(s: &mut String, picture: &Picture) {
    let class = if picture.wide { " class=\"wide\"" } else { "" };
    let caption = escape(&picture.caption);
    let _ =
        writeln!(s, "<figure{class}>{}<figcaption>{caption}</figcaption></figure>", picture.html);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_escapes_and_loads_nothing() {
        let table = Table {
            caption: "a < b".to_owned(),
            head: vec!["x".to_owned(), "y".to_owned()],
            labels: 1,
            rows: vec![vec!["mean".to_owned(), "1 & 2".to_owned()]],
            notes: vec!["[1] <script>".to_owned()],
            published: true,
        };
        let document = Document {
            title: "<t>".to_owned(),
            blocks: vec![Block::Heading(2, "Part".to_owned()), Block::Table(table)],
        };
        let page = html(&document);
        assert!(page.contains("<title>&lt;t&gt;</title>") && page.contains("1 &amp; 2"));
        assert!(page.contains("<tr class=\"mean\">") && page.contains("href=\"#b0\""));
        for part in ["<script", "http:", "https:", "url(", "@import", "src="] {
            assert!(!page.contains(part), "{part}");
        }
    }
}
