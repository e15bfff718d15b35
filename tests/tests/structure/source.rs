//! The modules of a crate as its sources declare them: items, imports and paths, file by file.
//! Not a parser of the language: it knows words, comments and texts, and follows `mod` and `use`.
use std::collections::BTreeSet;

/// A name that a `use` binds.
pub struct Import {
    /// The segments of the path.
    pub path: Vec<String>,
    /// The name bound, or `None` for all of a module (`*`).
    pub name: Option<String>,
    /// Whether it is handed on (`pub use`).
    pub is_public: bool,
}

/// A module: of a file of its own, or inline in one.
#[derive(Default)]
pub struct Module {
    /// Index of the module around it; the root's is its own.
    pub parent: usize,
    /// Index of the file.
    pub file: usize,
    /// Whether it is compiled for tests only, or lies in one that is.
    pub is_test: bool,
    /// Modules declared in it: name and index.
    pub children: Vec<(String, usize)>,
    /// Names of what is defined in it.
    pub items: BTreeSet<String>,
    /// All `use` declarations.
    pub imports: Vec<Import>,
    /// All other paths of at least two segments.
    pub paths: Vec<Vec<String>>,
    /// All words outside `use` declarations that do not follow `.` or `::`.
    pub words: BTreeSet<String>,
}

/// The modules of a library or a program.
pub struct Crate {
    /// All modules, the root first.
    pub modules: Vec<Module>,
    /// All files.
    pub files: Vec<String>,
}

/// Reads a file by its path.
type Read<'a> = &'a dyn Fn(&str) -> Option<String>;

impl Crate {
    /// Follows the `mod` declarations from the file `root` on.
    ///
    /// # Errors
    /// When a declared module has no file.
    pub fn load(root: &str, read: Read) -> Result<Crate, String> {
        let mut tree = Crate { modules: vec![Module::default()], files: Vec::new() };
        let folder = root.rsplit_once('/').map_or("", |(folder, _)| folder);
        let text = read(root).ok_or_else(|| format!("{root}: no such file"))?;
        tree.add_file(root, &text, 0, folder, read)?;
        Ok(tree)
    }

    /// Adds the file of module `module`, whose child modules lie in `folder`.
    fn add_file(
        &mut self,
        file: &str,
        text: &str,
        module: usize,
        folder: &str,
        read: Read,
    ) -> Result<(), String> {
        self.files.push(file.into());
        self.modules[module].file = self.files.len() - 1;
        let tokens = tokens(text);
        // The module around each inline one, its folder, and the depth of braces at which it ends.
        let mut around: Vec<(usize, String, usize)> = Vec::new();
        let (mut module, mut folder, mut depth) = (module, folder.to_string(), 0_usize);
        let (mut test_only, mut path_attribute) = (false, None);
        let mut i = 0;
        while i < tokens.len() {
            let at = |k: usize| tokens.get(i + k).map_or("", String::as_str);
            let before = |k: usize| i.checked_sub(k).map_or("", |j| tokens[j].as_str());
            match at(0) {
                "{" => depth += 1,
                "}" => {
                    depth = depth.saturating_sub(1);
                    if around.last().is_some_and(|(_, _, end)| *end == depth) {
                        (module, folder, _) = around.pop().expect("one was there");
                    }
                }
                "cfg" if at(1) == "(" && at(2) == "test" && at(3) == ")" => test_only = true,
                "path" if at(1) == "=" && before(1) == "[" => {
                    path_attribute = Some(at(2).trim_matches('"').to_string());
                }
                ";" => (test_only, path_attribute) = (false, None),
                "mod" if matches!(at(2), ";" | "{") => {
                    let name = at(1).to_string();
                    let is_test = test_only || self.modules[module].is_test;
                    let current_file = self.modules[module].file;
                    let child = self.modules.len();
                    let new =
                        Module { parent: module, file: current_file, is_test, ..Module::default() };
                    self.modules.push(new);
                    self.modules[module].children.push((name.clone(), child));
                    let below = join(&folder, &name);
                    if at(2) == "{" {
                        around.push((module, std::mem::replace(&mut folder, below), depth));
                        module = child;
                        depth += 1;
                    } else {
                        let own_folder = file.rsplit_once('/').map_or("", |(folder, _)| folder);
                        let candidates = match &path_attribute {
                            Some(path) => vec![join(own_folder, path)],
                            None => vec![format!("{below}.rs"), format!("{below}/mod.rs")],
                        };
                        let found = candidates.iter().find_map(|c| Some((c, read(c)?)));
                        let Some((child_file, text)) = found else {
                            return Err(format!(
                                "mod {name} of {file}: no {}",
                                candidates.join(", no ")
                            ));
                        };
                        self.add_file(child_file, &text, child, &below, read)?;
                    }
                    (test_only, path_attribute) = (false, None);
                    i += 3;
                    continue;
                }
                "use" if at(1) != "<" => {
                    let is_public =
                        before(1) == "pub" || (before(1) == ")" && is_restricted(&tokens[..i]));
                    let length = tokens[i..].iter().position(|t| t == ";").unwrap_or(1);
                    let tree = &tokens[i + 1..i + length];
                    let start = usize::from(tree.first().is_some_and(|t| t == "::"));
                    read_tree(&tree[start..], &[], is_public, &mut self.modules[module].imports);
                    i += length;
                    continue;
                }
                "fn" | "struct" | "enum" | "union" | "trait" | "type" | "const" | "static" => {
                    self.modules[module].items.insert(at(1).into());
                }
                "macro_rules" => {
                    self.modules[module].items.insert(at(2).into());
                }
                word if is_word(word) && before(1) != "::" && before(1) != "." => {
                    self.modules[module].words.insert(word.into());
                    let mut path = vec![word.to_string()];
                    while at(2 * path.len() - 1) == "::" && is_word(at(2 * path.len())) {
                        path.push(at(2 * path.len()).into());
                    }
                    if path.len() > 1 {
                        self.modules[module].paths.push(path);
                    }
                }
                _ => {}
            }
            i += 1;
        }
        Ok(())
    }
}

/// Whether tokens end in `pub(...)`.
fn is_restricted(tokens: &[String]) -> bool {
    let open = tokens.iter().rposition(|t| t == "(");
    open.and_then(|open| tokens.get(open.checked_sub(1)?)).is_some_and(|t| t == "pub")
}

/// The imports of a `use` tree such as `a::{b, c as d, e::*}`.
fn read_tree(tokens: &[String], before: &[String], is_public: bool, out: &mut Vec<Import>) {
    // Split at the commas outside of braces.
    let mut depth = 0;
    let parts = tokens.split(|token| {
        match token.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            _ => {}
        }
        depth == 0 && token == ","
    });
    for part in parts.filter(|part| !part.is_empty()) {
        let mut path = before.to_vec();
        let mut i = 0;
        while part.get(i).is_some_and(|token| is_word(token)) {
            path.push(part[i].clone());
            i += 1;
            if part.get(i).is_none_or(|token| token != "::") {
                break;
            }
            i += 1;
        }
        match part.get(i).map(String::as_str) {
            Some("{") => read_tree(&part[i + 1..part.len() - 1], &path, is_public, out),
            Some("*") => out.push(Import { path, name: None, is_public }),
            renamed => {
                if path.last().is_some_and(|last| last == "self") && path.len() > 1 {
                    path.pop();
                }
                let new_name = renamed.and(part.get(i + 1)).or(path.last()).cloned();
                out.push(Import { name: new_name, path, is_public });
            }
        }
    }
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// A path below a folder, with `..` taken out.
fn join(folder: &str, path: &str) -> String {
    let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
    for part in path.split('/') {
        match part {
            ".." if parts.last().is_some_and(|last| *last != "..") => drop(parts.pop()),
            _ => parts.push(part),
        }
    }
    parts.join("/")
}

/// Words, `::`, single signs and texts (as they stand); comments are left out.
fn tokens(text: &str) -> Vec<String> {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let part = |from: usize, to: usize| chars[from..to.min(chars.len())].iter().collect::<String>();
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let mut out = Vec::new();
    let mut i = 0;
    while i < chars.len() {
        let start = i;
        match at(i) {
            '/' if at(i + 1) == '/' => {
                while i < chars.len() && at(i) != '\n' {
                    i += 1;
                }
                continue;
            }
            '/' if at(i + 1) == '*' => {
                let mut depth = 1;
                i += 2;
                while i < chars.len() && depth > 0 {
                    match (at(i), at(i + 1)) {
                        ('/', '*') => (depth, i) = (depth + 1, i + 2),
                        ('*', '/') => (depth, i) = (depth - 1, i + 2),
                        _ => i += 1,
                    }
                }
                continue;
            }
            '"' => {
                i += 1;
                while i < chars.len() && at(i) != '"' {
                    i += if at(i) == '\\' { 2 } else { 1 };
                }
                i += 1;
            }
            // A character, or else a lifetime.
            '\'' if at(i + 1) == '\\' => {
                i += 3;
                while i < chars.len() && at(i) != '\'' {
                    i += 1;
                }
                i += 1;
            }
            '\'' if at(i + 2) == '\'' => i += 3,
            c if is_part(c) => {
                while is_part(at(i)) {
                    i += 1;
                }
                // A raw text (r"", br#""#) or a raw identifier (r#type).
                let prefix = part(start, i);
                if matches!(prefix.as_str(), "r" | "br" | "cr") && matches!(at(i), '"' | '#') {
                    let mut hashes = 0;
                    while at(i + hashes) == '#' {
                        hashes += 1;
                    }
                    if at(i + hashes) == '"' {
                        let end: Vec<char> = "\"".chars().chain(vec!['#'; hashes]).collect();
                        i += hashes + 1;
                        while i < chars.len() && !chars[i..].starts_with(&end) {
                            i += 1;
                        }
                        i += end.len();
                        out.push("\"\"".into());
                    } else {
                        i += hashes;
                    }
                    continue;
                }
            }
            ':' if at(i + 1) == ':' => i += 2,
            c if c.is_whitespace() => {
                i += 1;
                continue;
            }
            _ => i += 1,
        }
        out.push(part(start, i));
    }
    out
}
