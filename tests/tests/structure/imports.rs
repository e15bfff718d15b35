//! Which file imports from which, and the circles among them.
//!
//! A file imports from another when a `use` or a path in its code leads to an item of the other,
//! however many `pub use` lie between. Declaring a child (`mod child;`) or handing on its items
//! (`pub use child::Item;`) imports nothing; using the child's items does. Code for tests alone
//! (`#[cfg(test)] mod ...`) does not count: it may look at anything.
use crate::source::{Crate, Import};
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
};

/// Files that import from each other, directly or through others of them.
pub struct Circle {
    /// The files, sorted.
    pub files: Vec<String>,
    /// Who imports from whom, and by which path.
    imports: Vec<String>,
}

impl fmt::Display for Circle {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "  circle of {}:", self.files.len())?;
        self.imports.iter().try_for_each(|import| write!(f, "\n    {import}"))
    }
}

/// Where a path leads.
#[derive(Clone, Copy)]
enum Target {
    Module(usize),
    /// An item in the file of this index.
    Item(usize),
}

/// More `pub use` than any path goes through; imports may refer to each other in a circle.
const MAX_STEPS: usize = 32;

impl Crate {
    /// Where a path in a module leads, or `None` out of the crate.
    fn resolve(&self, module: usize, path: &[String], steps: usize) -> Option<Target> {
        let (first, mut rest) = path.split_first()?;
        let mut target = match first.as_str() {
            "crate" => Target::Module(0),
            "self" => Target::Module(module),
            "super" => Target::Module(self.modules[module].parent),
            name => self.named(module, name, steps)?,
        };
        while let Target::Module(current) = target {
            let Some((name, after)) = rest.split_first() else { break };
            rest = after;
            target = match name.as_str() {
                "self" => target,
                "super" => Target::Module(self.modules[current].parent),
                name => {
                    let handed_on = self.modules[current]
                        .imports
                        .iter()
                        .any(|import| import.name.as_deref() == Some(name));
                    match self.named(current, name, steps) {
                        Some(found) => found,
                        // Handed on from another crate.
                        None if handed_on => return None,
                        // Made by a macro: it stands in that file.
                        None => Target::Item(self.modules[current].file),
                    }
                }
            };
        }
        Some(target)
    }

    /// What a name means in a module.
    fn named(&self, module: usize, name: &str, steps: usize) -> Option<Target> {
        let steps = steps.checked_sub(1)?;
        let m = &self.modules[module];
        if let Some((_, child)) = m.children.iter().find(|(n, _)| n == name) {
            return Some(Target::Module(*child));
        }
        if m.items.contains(name) {
            return Some(Target::Item(m.file));
        }
        let named = |import: &&Import| import.name.as_deref() == Some(name);
        // `use a::b as name` leads on; `use name;` would lead here again.
        if let Some(import) = m.imports.iter().find(named) {
            return match import.path.as_slice() {
                [only] if only == name => None,
                path => self.resolve(module, path, steps),
            };
        }
        m.imports.iter().filter(|import| import.name.is_none()).find_map(|import| {
            match self.resolve(module, &import.path, steps)? {
                Target::Module(other) if other != module => self.named(other, name, steps),
                _ => None,
            }
        })
    }

    fn file_of(&self, target: Target) -> usize {
        match target {
            Target::Module(module) => self.modules[module].file,
            Target::Item(file) => file,
        }
    }

    /// Whether an import hands on a child's item without use of its own.
    fn only_hands_on(&self, module: usize, import: &Import) -> bool {
        let m = &self.modules[module];
        let start = usize::from(import.path.first().is_some_and(|first| first == "self"));
        let child = import.path.get(start);
        let of_child = child.is_some_and(|c| m.children.iter().any(|(name, _)| name == c));
        let used = import.name.as_ref().is_some_and(|name| m.words.contains(name));
        import.is_public && of_child && !used
    }

    /// For each pair of files, one path by which the first imports from the second.
    fn edges(&self) -> BTreeMap<(usize, usize), String> {
        let mut edges = BTreeMap::new();
        for (index, module) in self.modules.iter().enumerate().filter(|(_, m)| !m.is_test) {
            let imports = module.imports.iter().filter(|import| !self.only_hands_on(index, import));
            for path in imports.map(|import| &import.path).chain(&module.paths) {
                let Some(target) = self.resolve(index, path, MAX_STEPS) else { continue };
                let other = self.file_of(target);
                if other != module.file {
                    edges.entry((module.file, other)).or_insert_with(|| path.join("::"));
                }
            }
        }
        edges
    }
}

/// The circles of a crate.
pub fn circles(tree: &Crate) -> Vec<Circle> {
    let edges = tree.edges();
    let reached: Vec<BTreeSet<usize>> = (0..tree.files.len())
        .map(|start| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
            while let Some(file) = open.pop() {
                for (_, next) in edges.keys().filter(|(from, _)| *from == file) {
                    if seen.insert(*next) {
                        open.push(*next);
                    }
                }
            }
            seen
        })
        .collect();
    let mut found = Vec::new();
    let mut done: BTreeSet<usize> = BTreeSet::new();
    for file in 0..tree.files.len() {
        if done.contains(&file) || !reached[file].contains(&file) {
            continue;
        }
        let members: BTreeSet<usize> =
            reached[file].iter().copied().filter(|other| reached[*other].contains(&file)).collect();
        done.extend(&members);
        let inside = edges.iter().filter(|((a, b), _)| members.contains(a) && members.contains(b));
        let name = |file: usize| tree.files[file].clone();
        let imports = inside.map(|((a, b), path)| format!("{} -> {} ({path})", name(*a), name(*b)));
        let mut files: Vec<String> = members.iter().map(|file| name(*file)).collect();
        files.sort();
        found.push(Circle { files, imports: imports.collect() });
    }
    found
}
