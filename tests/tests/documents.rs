//! The documents: every relative link leads to a file and a heading that exist, every page of
//! `docs/` can be reached from its folder's index, and what must stay short is short.
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Component, Path, PathBuf},
    process::Command,
};

/// The repository.
fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// All Markdown files that Git tracks (or would), relative to the repository.
fn documents() -> Vec<PathBuf> {
    let listed = Command::new("git")
        .args(["ls-files", "--cached", "--others", "--exclude-standard", "*.md"])
        .current_dir(root())
        .output();
    let mut files: Vec<PathBuf> = match listed {
        Ok(output) if output.status.success() => {
            String::from_utf8_lossy(&output.stdout).lines().map(PathBuf::from).collect()
        }
        // Not a clone: an unpacked archive of the sources has no built files beside them.
        _ => walk(root()),
    };
    files.retain(|file| root().join(file).is_file());
    files.sort();
    assert!(files.len() > 10, "the documents were not found: {files:?}");
    files
}

fn walk(folder: &Path) -> Vec<PathBuf> {
    const LEFT_OUT: [&str; 6] = ["target", "node_modules", "dist", "pkg", "out", "corpus"];
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if path.is_dir() && !name.starts_with('.') && !LEFT_OUT.contains(&name.as_str()) {
            found.extend(walk(&path));
        } else if name.ends_with(".md") {
            found.extend(path.strip_prefix(root()).map(Path::to_path_buf));
        }
    }
    found
}

fn read(file: &Path) -> String {
    let text = fs::read_to_string(root().join(file));
    text.unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

/// The lines that are no code block, with their number from 1; a code block leaves one empty line.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut lines = Vec::new();
    // The fence that closes the block, and whether an indented line here would be code.
    let (mut fence, mut may_be_code) = (None, true);
    for (i, line) in text.lines().enumerate() {
        let start = line.trim_start();
        let opening = ["```", "~~~"].into_iter().find(|f| start.starts_with(f));
        if let Some(open) = fence {
            if start.starts_with(open) {
                fence = None;
            }
            may_be_code = true;
            continue;
        }
        if opening.is_some() {
            fence = opening;
            lines.push((i + 1, ""));
            continue;
        }
        if line.starts_with("    ") && may_be_code {
            continue;
        }
        may_be_code = start.is_empty() || line.starts_with('#');
        lines.push((i + 1, line));
    }
    lines
}

/// Spans of code become blanks of the same length, so that places stay.
fn without_code_spans(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('`') {
        out.push_str(&rest[..at]);
        let ticks = rest[at..].bytes().take_while(|b| *b == b'`').count();
        let (mark, after) = rest[at..].split_at(ticks);
        let mut close = 0;
        let end = loop {
            match after[close..].find(mark) {
                None => break None,
                Some(found) => {
                    let from = close + found;
                    let run = after[from..].bytes().take_while(|b| *b == b'`').count();
                    if run == ticks {
                        break Some(from);
                    }
                    close = from + run;
                }
            }
        };
        let length = end.map_or(ticks, |end| end + 2 * ticks);
        let blank = |c: char| if c == '\n' { '\n' } else { ' ' };
        out.extend(rest[at..at + length].chars().map(blank));
        rest = &rest[at + length..];
    }
    out.push_str(rest);
    out
}

/// Targets of a document's links and pictures, with their lines.
fn links(text: &str) -> Vec<(usize, String)> {
    let lines = prose(text);
    let joined: Vec<&str> = lines.iter().map(|(_, line)| *line).collect();
    let clean = without_code_spans(&joined.join("\n"));
    let line_of = |at: usize| lines[clean[..at].matches('\n').count()].0;
    let mut found = Vec::new();
    for (at, _) in clean.match_indices("](") {
        let target = &clean[at + 2..];
        let end = target.find([')', '\n']).unwrap_or(target.len());
        let target = target[..end].split_whitespace().next().unwrap_or("");
        found.push((line_of(at), target.trim_matches(['<', '>']).to_owned()));
    }
    // Definitions that links refer to: `[name]: target`.
    let mut at = 0;
    for line in clean.lines() {
        if let Some((_, target)) = line.strip_prefix('[').and_then(|l| l.split_once("]: ")) {
            let target = target.split_whitespace().next().unwrap_or("");
            found.push((line_of(at), target.trim_matches(['<', '>']).to_owned()));
        }
        at += line.len() + 1;
    }
    found
}

/// What links to a document's headings may say after `#`, as GitHub makes it.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut used: BTreeMap<String, usize> = BTreeMap::new();
    let mut all = BTreeSet::new();
    for (_, line) in prose(text) {
        let level = line.bytes().take_while(|b| *b == b'#').count();
        if !(1..=6).contains(&level) || !line[level..].starts_with(' ') {
            continue;
        }
        let mut title = line[level..].trim().to_owned();
        // Of a link in a heading only its text counts.
        while let Some(at) = title.find("](") {
            let end = title[at..].find(')').map_or(title.len(), |e| at + e + 1);
            title.replace_range(at..end, "");
        }
        let slug: String = title
            .to_lowercase()
            .chars()
            .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
            .map(|c| if c == ' ' { '-' } else { c })
            .collect();
        let n = used.entry(slug.clone()).or_default();
        all.insert(if *n == 0 { slug } else { format!("{slug}-{n}") });
        *n += 1;
    }
    all
}

/// Whether a target is an address and not a place in the repository.
fn is_address(target: &str) -> bool {
    ["http://", "https://", "mailto:"].iter().any(|scheme| target.starts_with(scheme))
}

/// The file that a target leads to from the document `from`, relative to the repository; `None`
/// where it leaves it.
fn resolve(from: &Path, target: &str) -> Option<PathBuf> {
    let mut at = from.parent().unwrap_or(Path::new("")).to_path_buf();
    for part in Path::new(target).components() {
        match part {
            Component::Normal(name) => at.push(name),
            Component::CurDir => {}
            Component::ParentDir if at.pop() => {}
            _ => return None,
        }
    }
    Some(at)
}

/// What is wrong with the links of a document. `open` gives the text of a file, an empty one of a
/// picture or folder, and `None` where there is nothing.
fn broken(from: &Path, text: &str, open: &dyn Fn(&Path) -> Option<String>) -> Vec<String> {
    let mut wrong = Vec::new();
    for (line, target) in links(text) {
        if is_address(&target) {
            continue;
        }
        let (path, anchor) = target.split_once('#').unwrap_or((&target, ""));
        let place = format!("{}:{line}: {target}", from.display());
        let file = if path.is_empty() { Some(from.to_path_buf()) } else { resolve(from, path) };
        let found = file
            .as_deref()
            .and_then(|file| if file == from { Some(text.to_owned()) } else { open(file) });
        match found {
            None => wrong.push(format!("{place}: there is no such file")),
            Some(to) if !anchor.is_empty() && !anchors(&to).contains(anchor) => {
                wrong.push(format!("{place}: there is no such heading"));
            }
            Some(_) => {}
        }
    }
    wrong
}

#[test]
fn links_lead_to_files_and_headings() {
    let open = |file: &Path| {
        let path = root().join(file);
        let is_text = path.extension().is_some_and(|e| e == "md");
        if is_text { fs::read_to_string(path).ok() } else { path.exists().then(String::new) }
    };
    let documents = documents();
    let wrong: Vec<String> =
        documents.iter().flat_map(|file| broken(file, &read(file), &open)).collect();
    assert!(wrong.is_empty(), "broken links:\n{}", wrong.join("\n"));
    let inner = |file: &PathBuf| links(&read(file)).iter().filter(|l| !is_address(&l.1)).count();
    let count: usize = documents.iter().map(inner).sum();
    assert!(count > 100, "only {count} links were found");
}

#[test]
fn every_page_is_in_the_index_of_its_folder() {
    let mut missing = Vec::new();
    for file in documents() {
        let (Some(folder), Some(name)) = (file.parent(), file.file_name()) else { continue };
        let index = folder.join("README.md");
        if !file.starts_with("docs") || name == "README.md" {
            continue;
        }
        let linked = links(&read(&index)).iter().any(|(_, target)| {
            let path = target.split('#').next().unwrap_or("");
            !is_address(target) && resolve(&index, path).as_ref() == Some(&file)
        });
        if !linked {
            missing.push(file.display().to_string());
        }
    }
    assert!(missing.is_empty(), "not in the index of their folder: {missing:?}");
}

#[test]
fn what_is_read_first_is_short() {
    let readme = read(Path::new("README.md"));
    assert!(readme.lines().count() <= 120, "README.md has {} lines", readme.lines().count());
    for (i, line) in readme.lines().enumerate() {
        let length = line.chars().count();
        assert!(length <= 120, "README.md:{}: {length} characters", i + 1);
    }
    let architecture = read(Path::new("docs/design/architecture.md")).lines().count();
    assert!(architecture <= 150, "docs/design/architecture.md has {architecture} lines");
}

#[test]
fn broken_links_are_found() {
    let text = "# A title\n\nSee [one](other.md), [two](missing.md) and [three\nparts](other.md#no-such).\n\
        `[code](nothing.md)` and [an address](https://example.org/x.md#y).\n\n    [a block](gone.md)\n\n\
        ```\n[a fence](gone.md)\n```\n![a picture](../p.png) [itself](#a-title) [not](#b-title)\n\
        [out](../../x.md) [there](other.md#the-lists-of-x-y_z) [again](other.md#twice-1)\n\n[name]: lost.md\n";
    let open = |file: &Path| match file.to_str() {
        Some("docs/other.md") => Some(
            "# The `list`s of [X](a.md), y_z!\n## Twice\n## Twice\n```\n# no-such\n```\n".into(),
        ),
        Some("p.png") => Some(String::new()),
        _ => None,
    };
    let found = broken(Path::new("docs/this.md"), text, &open);
    let expected = [
        "docs/this.md:3: missing.md: there is no such file",
        "docs/this.md:4: other.md#no-such: there is no such heading",
        "docs/this.md:12: #b-title: there is no such heading",
        "docs/this.md:13: ../../x.md: there is no such file",
        "docs/this.md:15: lost.md: there is no such file",
    ];
    assert_eq!(found, expected);
}
