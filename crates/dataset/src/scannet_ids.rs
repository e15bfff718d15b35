//! ScanNet's table of label ids.
use super::folder::{Folder, invalid, shortened};
use mte_slam_types::sequence::SequenceError;

/// The file; it lies beside the scenes.
const TABLE: &str = "scannetv2-labels.combined.tsv";

/// What ScanNet's raw label ids are in NYU's list of 40 classes.
pub(super) struct RawIds(Vec<u8>);

impl RawIds {
    /// The class 1 to 40, or 0 for an id that has none.
    pub fn nyu40(&self, raw: u16) -> u16 {
        self.0.get(usize::from(raw)).copied().unwrap_or(0).into()
    }
}

/// Reads the table, which may lie in the recording's folder or up to two above.
pub(super) fn read(folder: &Folder) -> Result<Option<RawIds>, SequenceError> {
    let Some(file) = folder.here_or_above(TABLE) else { return Ok(None) };
    let text = folder.text(&file)?;
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split('\t').map(str::trim).collect();
    let column = |name: &str| {
        head.iter().position(|h| *h == name).ok_or_else(|| {
            let found = shortened(&head.join(" "));
            invalid(TABLE, None, "columns", found, format!("one named {name}, tabs between"))
        })
    };
    let (id, nyu40) = (column("id")?, column("nyu40id")?);
    let mut ids = Vec::new();
    for (i, line) in lines.enumerate().filter(|(_, l)| !l.trim().is_empty()) {
        let cells: Vec<&str> = line.split('\t').map(str::trim).collect();
        let wrong = |expected: &str| {
            let field = format!("line {}", i + 2);
            invalid(TABLE, None, field, shortened(line), expected)
        };
        let raw: u16 = cells
            .get(id)
            .and_then(|c| c.parse().ok())
            .ok_or_else(|| wrong("an id from 0 to 65535 in the column id"))?;
        let class: u8 = match cells.get(nyu40).copied().unwrap_or_default() {
            "" => 0,
            cell => cell
                .parse()
                .ok()
                .filter(|n| *n <= 40)
                .ok_or_else(|| wrong("0 to 40 in the column nyu40id"))?,
        };
        if ids.len() <= usize::from(raw) {
            ids.resize(usize::from(raw) + 1, 0);
        }
        ids[usize::from(raw)] = class;
    }
    Ok(Some(RawIds(ids)))
}
