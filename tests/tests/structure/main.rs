//! The structure of the sources: within a crate, imports between files run one way. A circle ties
//! its files into one that can only be read, tested and changed as a whole.
//!
//! What counts as an import, and what does not, is described in [`imports`].
mod imports;
mod source;

use imports::{Circle, circles};
use source::Crate;
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

/// The repository's root.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The folders of all crates, relative to the root.
fn crates() -> Vec<String> {
    let folders = |below: &str| -> Vec<String> {
        let entries = fs::read_dir(root().join(below)).expect("a folder of the repository");
        entries
            .filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned()))
            .map(|name| if below.is_empty() { name } else { format!("{below}/{name}") })
            .filter(|folder| root().join(folder).join("Cargo.toml").exists())
            .collect()
    };
    let mut all = folders("");
    all.extend(folders("crates"));
    all.sort();
    all
}

/// The circles of the crate in `folder`, of its library and of its program.
fn circles_of(folder: &str) -> Vec<Circle> {
    let read = |file: &str| fs::read_to_string(root().join(folder).join(file)).ok();
    let roots = ["src/lib.rs", "src/main.rs"].into_iter().filter(|file| read(file).is_some());
    roots.flat_map(|file| circles(&Crate::load(file, &read).unwrap())).collect()
}

#[test]
fn no_crate_has_import_circles() {
    let mut failures = String::new();
    for folder in crates() {
        let found = circles_of(&folder);
        let files: usize = found.iter().map(|circle| circle.files.len()).sum();
        println!("{folder}: {files} files in circles");
        for circle in &found {
            println!("{circle}");
        }
        if files > 0 {
            failures += &format!("{folder}: {files} files in circles\n");
            found.iter().for_each(|circle| failures += &format!("{circle}\n"));
        }
    }
    assert!(crates().len() > 5, "only {:?} were found", crates());
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn the_guide_shows_the_layouts_of_recordings() {
    let text = |file: &str| fs::read_to_string(root().join(file)).expect(file);
    let table = text("crates/dataset/src/layouts.md");
    assert!(
        text("docs/guide/recordings.md").contains(&table),
        "docs/guide/recordings.md lacks the table of crates/dataset/src/layouts.md:\n{table}"
    );
}

/// The files of every circle of a made-up crate.
fn circles_in(files: &[(&str, &str)]) -> Vec<Vec<String>> {
    let files: BTreeMap<String, String> =
        files.iter().map(|(name, text)| ((*name).into(), (*text).into())).collect();
    let tree = Crate::load("src/lib.rs", &|file| files.get(file).cloned()).unwrap();
    circles(&tree).into_iter().map(|circle| circle.files).collect()
}

#[test]
fn two_files_that_import_each_other_are_a_circle() {
    let lib = ("src/lib.rs", "mod a; mod b; mod c; pub use a::A;");
    let b = ("src/b.rs", "use super::a::A; pub struct B(A);");
    let c = ("src/c.rs", "use crate::{a::A, b::B}; fn f(_: A, _: B) {}");
    assert_eq!(circles_in(&[lib, ("src/a.rs", "pub struct A;"), b, c]), [[""; 0]; 0]);
    for a in [
        "use crate::b::B; pub struct A;",
        "use super::{b::B}; pub struct A;",
        "pub struct A(crate::b::B);",
        "pub struct A; mod inner { use super::super::b::B; }",
        "use crate::b as other; pub struct A(other::B);",
        "pub struct A; macro_rules! m { () => { $crate::b::B }; }",
    ] {
        assert_eq!(circles_in(&[lib, ("src/a.rs", a), b, c]), [["src/a.rs", "src/b.rs"]], "{a}");
    }
}

#[test]
fn comments_texts_and_tests_are_no_imports() {
    let lib = ("src/lib.rs", "mod a; mod b;");
    let b = ("src/b.rs", "use super::a::A;");
    for a in [
        "pub struct A; // use crate::b::B;",
        "/// As [`crate::b::B`].\npub struct A; /* use /* nested */ crate::b::B; */",
        "pub struct A; const T: &str = \"use crate::b::B;\"; const C: char = '\"';",
        "pub struct A; const T: &str = r#\"a \" crate::b::B\"#; fn f<'a>(x: &'a str) {}",
        "pub struct A; #[cfg(test)] mod tests { use crate::b::B; }",
        "pub struct A; #[cfg(test)] #[path = \"elsewhere.rs\"] mod tests;",
        "pub struct A; use other_crate::b::B;",
    ] {
        let elsewhere = ("src/elsewhere.rs", "use crate::b::B;");
        assert_eq!(circles_in(&[lib, ("src/a.rs", a), b, elsewhere]), [[""; 0]; 0], "{a}");
    }
}

#[test]
fn a_child_may_import_from_a_parent_that_only_declares_it() {
    let lib = ("src/lib.rs", "mod parent;");
    let child = ("src/parent/child.rs", "use super::Shared; pub struct Child(Shared);");
    for parent in [
        "mod child; pub struct Shared;",
        "mod child; pub use child::Child; pub struct Shared;",
        "mod child; pub(crate) use self::child::{Child as Other}; pub struct Shared;",
    ] {
        let files = [lib, ("src/parent/mod.rs", parent), child];
        assert_eq!(circles_in(&files), [[""; 0]; 0], "{parent}");
        let flat = [lib, ("src/parent.rs", parent), child];
        assert_eq!(circles_in(&flat), [[""; 0]; 0], "{parent}");
    }
    for parent in [
        "mod child; use child::Child; pub struct Shared;",
        "mod child; pub struct Shared; fn f() { child::g(); }",
        "mod child; pub use child::Child; pub struct Shared; fn f(_: Child) {}",
    ] {
        let files = [lib, ("src/parent/mod.rs", parent), child];
        assert_eq!(circles_in(&files), [["src/parent/child.rs", "src/parent/mod.rs"]], "{parent}");
    }
}

#[test]
fn names_lead_to_the_file_that_defines_them() {
    // `a` imports `B` from the crate's root, which only hands it on.
    let lib = ("src/lib.rs", "mod a; mod b; mod c; pub use b::B; pub use c::*;");
    let b = ("src/b.rs", "use crate::a::A; pub struct B;");
    let c = ("src/c.rs", "use crate::b::B; pub fn d() {}");
    let circle = [("src/a.rs", "use crate::B; pub struct A;"), lib, b, c];
    assert_eq!(circles_in(&circle), [["src/a.rs", "src/b.rs"]]);
    let by_glob = [("src/a.rs", "use crate::d; pub struct A;"), lib, b, c];
    assert_eq!(circles_in(&by_glob), [["src/a.rs", "src/b.rs", "src/c.rs"]]);
    let external = [("src/a.rs", "use crate::e; pub struct A;"), lib, b, c];
    assert_eq!(circles_in(&external), [[""; 0]; 0]);
}

#[test]
fn a_missing_file_is_an_error() {
    let read = |file: &str| (file == "src/lib.rs").then(|| "mod a;".to_string());
    let error = Crate::load("src/lib.rs", &read).err().unwrap();
    assert!(error.contains("src/a.rs") && error.contains("src/a/mod.rs"), "{error}");
}
