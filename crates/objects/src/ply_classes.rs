//! The classes of a run from its mesh files.
use crate::error::{ObjectsError, invalid};
use mte_slam_mesh::{Mesh, read_ply};
use mte_slam_types::classes::{Class, ClassTable, UNLABELLED};

/// Reads the classes that the header of a `mesh_semantic.ply` names (`comment class ID NAME`), in
/// their order, without the entry that stands for none. Colors are those of the first vertex of the
/// class, black where there is none.
///
/// # Errors
/// A header without such lines or with one that cannot be read, an id that comes twice, more than
/// 255 classes.
pub fn ply_classes(bytes: &[u8]) -> Result<ClassTable, ObjectsError> {
    let mut table = ClassTable::default();
    for (number, line) in bytes.split(|&b| b == b'\n').enumerate() {
        // As long as a reader of the mesh takes one for a line of the header.
        if line.starts_with(b"end_header") || line.len() > 4096 {
            break;
        }
        let Some(rest) = line.strip_prefix(b"comment class ") else { continue };
        let text = String::from_utf8_lossy(rest);
        let what = || format!("PLY header line {}", number + 1);
        let shown = || format!("`{}`", text.trim().chars().take(60).collect::<String>());
        let id = text.split(' ').next().and_then(|id| id.parse::<u16>().ok());
        let Some((raw_id, (_, name))) = id.zip(text.split_once(' ')) else {
            return Err(invalid(what(), shown(), "`class`, an id up to 65535 and a name"));
        };
        let name = name.trim();
        if name == "(none)" && table.is_empty() {
            continue;
        }
        if table.classes.iter().any(|c| c.raw_id == raw_id) {
            return Err(invalid(what(), shown(), "each id once"));
        }
        if table.len() == usize::from(UNLABELLED) {
            return Err(invalid(what(), "a 256th class", "at most 255"));
        }
        table.classes.push(Class { raw_id, name: name.to_owned(), color: [0; 3] });
    }
    if table.is_empty() {
        let expected = "lines `comment class ID NAME`, as a run writes them";
        return Err(invalid("PLY header", "no classes", expected));
    }
    Ok(table)
}

/// Reads a run's `mesh.ply`, which has colors and compact classes, and checks its classes against the
/// table.
///
/// # Errors
/// A file that cannot be read, a mesh without classes, or a class that the table does not have.
pub fn class_mesh(ply: &[u8], table: &ClassTable) -> Result<Mesh, ObjectsError> {
    let mesh = read_ply(ply)?;
    if mesh.classes.len() != mesh.positions.len() || mesh.positions.is_empty() {
        let found = if mesh.positions.is_empty() { "no vertices" } else { "none" };
        return Err(invalid("classes of the mesh", found, "one per vertex"));
    }
    let known = |c: u8| c == UNLABELLED || usize::from(c) < table.len();
    if let Some(i) = mesh.classes.iter().position(|&c| !known(c)) {
        let found = format!("class {}", mesh.classes[i]);
        let expected = format!("one of the {} classes of the table", table.len());
        return Err(invalid(format!("vertex {i}"), found, expected));
    }
    Ok(mesh)
}
