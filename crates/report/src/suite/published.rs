//! What the paper's tables say, to be shown beside figures measured here.
use super::file::Benchmark;
use crate::protocol::Protocol;
use anyhow::{Context, Result};
use serde::Deserialize;

/// What a table measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Trajectory error by scene (Tables I and II).
    Tracking,
    /// Meshes (Table III).
    Reconstruction,
    /// mIoU by scene (Table IV).
    Semantics,
    /// Seconds per frame (Table V).
    Runtime,
    /// Modules on and off (Table VI).
    Ablation,
}

/// A published table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Its number in the paper.
    pub number: String,
    /// The data set.
    pub benchmark: Benchmark,
    /// What it measures.
    pub kind: Kind,
    /// What it is called.
    pub caption: String,
    /// What the paper says about how it was measured.
    pub protocol: Protocol,
    /// Columns after the method.
    pub columns: Vec<String>,
    /// Method and figures; a row may end early where the paper has dashes.
    pub rows: Vec<PublishedRow>,
}

/// A method and its figures.
#[derive(Clone, Debug, Deserialize)]
#[serde(from = "Vec<toml::Value>")]
pub struct PublishedRow {
    /// The method.
    pub method: String,
    /// Its figures.
    pub figures: Vec<f64>,
}

impl From<Vec<toml::Value>> for PublishedRow {
    fn from(values: Vec<toml::Value>) -> Self {
        let method = values.first().and_then(|v| v.as_str()).unwrap_or_default().to_owned();
        let figures = values.iter().skip(1).filter_map(toml::Value::as_float).collect();
        PublishedRow { method, figures }
    }
}

/// The table of a benchmark, if the paper has one.
pub fn table(benchmark: Option<Benchmark>, kind: Kind) -> Result<Option<Published>> {
    #[derive(Deserialize)]
    struct File {
        table: Vec<Published>,
    }
    let file: File = toml::from_str(include_str!("published.toml"))
        .context("the published figures cannot be read")?;
    let mut tables = file.table.into_iter();
    Ok(tables.find(|t| Some(t.benchmark) == benchmark && t.kind == kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_table_of_the_paper_is_there() {
        let replica = |kind| table(Some(Benchmark::Replica), kind).unwrap().unwrap();
        let rows = |t: &Published| t.rows.len();
        let one = table(Some(Benchmark::ScanNet), Kind::Tracking).unwrap().unwrap();
        assert_eq!((one.number.as_str(), rows(&one)), ("I", 6));
        for (kind, number, count) in [
            (Kind::Tracking, "II", 6),
            (Kind::Reconstruction, "III", 6),
            (Kind::Semantics, "IV", 4),
            (Kind::Runtime, "V", 9),
            (Kind::Ablation, "VI", 4),
        ] {
            let t = replica(kind);
            assert_eq!((t.number.as_str(), rows(&t)), (number, count));
            for row in &t.rows {
                assert!(!row.method.is_empty() && row.figures.len() <= t.columns.len());
                // A dash in the middle of a row would shift what follows it.
                let whole = row.figures.len() == t.columns.len();
                assert!(whole || kind == Kind::Semantics, "{} in Table {number}", row.method);
            }
        }
        assert_eq!(replica(Kind::Semantics).rows[3].figures[4], 90.21);
        assert!(table(None, Kind::Tracking).unwrap().is_none());
        assert!(table(Some(Benchmark::ScanNet), Kind::Runtime).unwrap().is_none());
    }
}
