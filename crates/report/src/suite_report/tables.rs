//! Tables in the form of the paper's I to VI. A column, and a table by scenes, holds figures of one
//! protocol; published figures stand in tables of their own beside them.
use super::{
    document::{Block, Table},
    results::{Results, RunResult},
};
use crate::{
    ablation::OverSeeds,
    suite::{
        plan::Plan,
        published::{self, Kind},
    },
};
use anyhow::Result;
use std::collections::BTreeSet;

/// Where there is no figure.
const DASH: &str = "-";

/// A figure by its path in `metrics.json`, under one protocol.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Measure {
    path: String,
    protocol_id: String,
}

impl Measure {
    fn of(&self, run: &RunResult) -> Option<f64> {
        let figure = run.figures.get(&self.path)?;
        (figure.protocol_id == self.protocol_id).then_some(figure.value)
    }
}

/// A sentence with the number of views left out, which differs from scene to scene; for people
/// alone.
fn without_counts(protocol: &str) -> String {
    let words: Vec<&str> = protocol.split(' ').collect();
    let keep = |i: usize| {
        let counted = words.get(i + 1).is_some_and(|next| next.starts_with("views"));
        if counted && words[i].bytes().all(|b| b.is_ascii_digit()) { "N" } else { words[i] }
    };
    (0..words.len()).map(keep).collect::<Vec<_>>().join(" ")
}

/// Everything there is to tabulate, sections I to VI.
pub fn blocks(plan: &Plan, results: &Results) -> Result<Vec<Block>> {
    let t = Tables { plan, results };
    let mut blocks = Vec::new();
    let mut section = |title: &str, tables: Vec<Table>, kind: Kind| -> Result<()> {
        blocks.push(Block::Heading(2, title.to_owned()));
        if tables.is_empty() {
            blocks.push(Block::Text("No finished run has such figures.".to_owned()));
        }
        blocks.extend(tables.into_iter().map(Block::Table));
        blocks.extend(t.published(kind)?.map(Block::Table));
        Ok(())
    };
    let tracking = t.by_scene("ATE RMSE, aligned (cm)", 3, |p| p == "trajectory.aligned_cm.rmse");
    section("Tracking (form of Tables I and II)", tracking, Kind::Tracking)?;
    let surface = t.by_figure("Reconstruction", &t.surface_columns());
    section("Reconstruction (form of Table III)", surface, Kind::Reconstruction)?;
    let classes = t.by_scene("mIoU (%)", 2, |p| last(p) == "miou_percent");
    section("Semantic segmentation (form of Table IV)", classes, Kind::Semantics)?;
    let mut times = t.by_figure("Seconds per frame, and memory", &t.time_columns());
    times.iter_mut().for_each(|table| table.notes.extend(t.machines()));
    section("Runtime (form of Table V)", times, Kind::Runtime)?;
    section("Ablation (form of Table VI)", t.ablation(), Kind::Ablation)?;
    Ok(blocks)
}

struct Tables<'a> {
    plan: &'a Plan,
    results: &'a Results,
}

/// A column: its figure, head, decimals and factor.
struct Column {
    measure: Measure,
    head: String,
    decimals: usize,
    factor: f64,
}

impl Tables<'_> {
    fn measures(&self, wanted: impl Fn(&str) -> bool) -> Vec<Measure> {
        let all: BTreeSet<Measure> = self
            .results
            .finished()
            .flat_map(|r| &r.figures)
            .filter(|(path, _)| wanted(path))
            .map(|(path, f)| Measure { path: path.clone(), protocol_id: f.protocol_id.clone() })
            .collect();
        all.into_iter().collect()
    }

    fn parts(&self) -> impl Iterator<Item = (&str, &str)> {
        let suite = &self.plan.suite;
        let ablations = move |p| suite.ablations.iter().map(move |a: &_| (p, a.name.as_str()));
        suite.presets.iter().flat_map(move |p| ablations(p.as_str()))
    }

    fn scenes(&self) -> impl Iterator<Item = &str> {
        self.plan.suite.scenes.iter().map(|s| s.name.as_str())
    }

    /// Over the seeds of one scene.
    fn cell(&self, measure: &Measure, part: (&str, &str, &str), format: (usize, f64)) -> String {
        let values: Vec<f64> = self.results.of(part).filter_map(|r| measure.of(r)).collect();
        self.text(&values, format)
    }

    fn text(&self, values: &[f64], (decimals, factor): (usize, f64)) -> String {
        let Some(over) = OverSeeds::of(values.iter().copied().map(Some)) else {
            return DASH.to_owned();
        };
        let text = over.text(decimals, factor);
        let all = self.plan.suite.seeds.len();
        if values.len() < all { format!("{text} (n = {})", values.len()) } else { text }
    }

    /// Mean over those scenes that have the figure at all, seed by seed; then over the seeds for
    /// which all of them have it.
    fn mean_cell(
        &self,
        measure: &Measure,
        (preset, ablation): (&str, &str),
        format: (usize, f64),
    ) -> String {
        let of = |scene: &str, seed: u32| {
            let mut runs = self.results.of((scene, preset, ablation));
            measure.of(runs.find(|r| r.seed == seed)?)
        };
        let seeds = &self.plan.suite.seeds;
        // A scene of which no run has finished yet leaves no mean: it would be over fewer scenes.
        let counts = |scene: &&str| {
            let part = (*scene, preset, ablation);
            let mut runs = self.results.of(part);
            self.results.of(part).next().is_none() || runs.any(|r| measure.of(r).is_some())
        };
        let scenes: Vec<&str> = self.scenes().filter(counts).collect();
        let mean = |seed: &u32| {
            let values: Option<Vec<f64>> = scenes.iter().map(|s| of(s, *seed)).collect();
            let values = values.filter(|v| !v.is_empty())?;
            Some(values.iter().sum::<f64>() / values.len() as f64)
        };
        let values: Vec<f64> = seeds.iter().filter_map(mean).collect();
        self.text(&values, format)
    }

    /// One table per measure, one column per scene, as the paper's I, II and IV.
    fn by_scene(&self, what: &str, decimals: usize, wanted: fn(&str) -> bool) -> Vec<Table> {
        let table = |measure: Measure| {
            let format = (decimals, 1.0);
            let mut head = vec!["preset".to_owned(), "ablation".to_owned()];
            head.extend(self.scenes().map(str::to_owned));
            head.push("mean".to_owned());
            let row = |(preset, ablation): (&str, &str)| {
                let mut row = vec![preset.to_owned(), ablation.to_owned()];
                row.extend(
                    self.scenes().map(|s| self.cell(&measure, (s, preset, ablation), format)),
                );
                row.push(self.mean_cell(&measure, (preset, ablation), format));
                row
            };
            let name = match measure.path.as_str() {
                "trajectory.aligned_cm.rmse" | "semantics.miou_percent" => what.to_owned(),
                path => format!("{what}: {}", words(path)),
            };
            Table {
                caption: format!("{name}; measured here, {}", self.spread()),
                notes: vec![format!("Protocol: {}", self.protocol(&measure))],
                head,
                labels: 2,
                rows: self.parts().map(row).collect(),
                published: false,
            }
        };
        let mut measures = self.measures(wanted);
        // The map's own classes before those of labels and other variants.
        measures.sort_by_key(|m| !m.path.starts_with("semantics."));
        measures.into_iter().map(table).collect()
    }

    /// One table, a column per measure, a row per scene and one for their mean, as the paper's III and V.
    fn by_figure(&self, what: &str, columns: &[Column]) -> Vec<Table> {
        if columns.is_empty() {
            return Vec::new();
        }
        let mut protocols: Vec<(&str, String)> = Vec::new();
        let mut head = vec!["preset".to_owned(), "ablation".to_owned(), "scene".to_owned()];
        for column in columns {
            let id = column.measure.protocol_id.as_str();
            let number = match protocols.iter().position(|(known, _)| *known == id) {
                Some(i) => i + 1,
                None => {
                    protocols.push((id, self.protocol(&column.measure)));
                    protocols.len()
                }
            };
            head.push(format!("{} [{number}]", column.head));
        }
        let mut rows = Vec::new();
        for (preset, ablation) in self.parts() {
            let start =
                |scene: &str| vec![preset.to_owned(), ablation.to_owned(), scene.to_owned()];
            let mut mean = start("mean");
            mean.extend(
                columns.iter().map(|c| {
                    self.mean_cell(&c.measure, (preset, ablation), (c.decimals, c.factor))
                }),
            );
            rows.push(mean);
            for scene in self.scenes() {
                let mut row = start(scene);
                row.extend(columns.iter().map(|c| {
                    self.cell(&c.measure, (scene, preset, ablation), (c.decimals, c.factor))
                }));
                rows.push(row);
            }
        }
        let notes =
            protocols.iter().enumerate().map(|(i, (_, p))| format!("[{}] {p}", i + 1)).collect();
        vec![Table {
            caption: format!("{what}; measured here, {}", self.spread()),
            notes,
            head,
            labels: 3,
            rows,
            published: false,
        }]
    }

    /// Errors of depth and meshes, under every protocol that there is.
    fn surface_columns(&self) -> Vec<Column> {
        let heads = [
            ("l1_cm", "Depth L1 (cm)"),
            ("accuracy_cm", "Acc. (cm)"),
            ("completion_cm", "Comp. (cm)"),
            ("completion_ratio_percent", "Comp. ratio (%)"),
        ];
        let head_of = |path: &str| heads.iter().position(|(end, _)| last(path) == *end);
        let mut measures = self.measures(|path| head_of(path).is_some());
        let section = |m: &Measure| m.path.rsplit_once('.').map_or("", |p| p.0).to_owned();
        measures.sort_by_key(|m| (section(m), m.protocol_id.clone(), head_of(&m.path)));
        let column = |measure: Measure| {
            let head = heads[head_of(&measure.path)?].1;
            let context = match section(&measure).as_str() {
                // Beside those of meshes, which have protocols of their own.
                "depth" => "views".to_owned(),
                section => words(section),
            };
            let head = format!("{head}, {context}");
            Some(Column { measure, head, decimals: 2, factor: 1.0 })
        };
        measures.into_iter().filter_map(column).collect()
    }

    fn time_columns(&self) -> Vec<Column> {
        let columns = [
            ("time.tracking.mean_s", "Track. FPT (s)", 3, 1.0),
            ("time.mapping.mean_s", "Map. FPT (s), mapped frames", 3, 1.0),
            ("time.total.mean_s", "SLAM FPT (s)", 3, 1.0),
            ("time.wall_s", "whole program (s)", 0, 1.0),
            ("memory.peak_host_bytes", "peak host memory (MiB)", 0, 1.0 / 1_048_576.0),
            ("memory.device_bytes", "device buffers (MiB)", 0, 1.0 / 1_048_576.0),
        ];
        let all = columns.into_iter().flat_map(|(path, head, decimals, factor)| {
            let column = move |measure| Column { measure, head: head.to_owned(), decimals, factor };
            self.measures(|p| p == path).into_iter().map(column)
        });
        all.collect()
    }

    /// What computed, and whether runs shared it.
    fn machines(&self) -> Vec<String> {
        let name = |r: &RunResult| {
            let of = |key: &str| r.engine[key].as_str().unwrap_or("?").to_owned();
            format!("{} ({})", of("kind"), of("adapter"))
        };
        let all: BTreeSet<String> = self.results.finished().map(name).collect();
        let mut notes =
            vec![format!("Computed on: {}.", all.into_iter().collect::<Vec<_>>().join(", "))];
        let shared = |r: &&RunResult| r.started["runs_at_a_time"].as_u64().unwrap_or(1) > 1;
        let n = self.results.finished().filter(shared).count();
        if n > 0 {
            notes.push(format!(
                "{n} of the runs shared the machine with others (--jobs above 1): their times are \
                 longer than those of a run alone."
            ));
        }
        notes
    }

    /// mIoU by modules, as the paper's VI.
    fn ablation(&self) -> Vec<Table> {
        let measures = self.measures(|p| p == "semantics.miou_percent");
        let table = |measure: Measure| {
            let mut head: Vec<String> =
                ["preset", "ablation", "MTFF", "FRS"].map(str::to_owned).to_vec();
            head.push("mIoU (%), mean".to_owned());
            let scenes: Vec<&str> = self
                .scenes()
                .filter(|s| {
                    self.results.finished().any(|r| r.scene == *s && measure.of(r).is_some())
                })
                .collect();
            head.extend(scenes.iter().map(|s| (*s).to_owned()));
            let row = |(preset, ablation): (&str, &str)| {
                let of_part = |r: &&RunResult| r.preset == preset && r.ablation == ablation;
                let modules = self.results.finished().find(of_part).and_then(|r| r.modules);
                let mark = |on: Option<bool>| match on {
                    Some(true) => "✓",
                    Some(false) => "",
                    None => "?",
                };
                let mut row = vec![preset.to_owned(), ablation.to_owned()];
                row.push(mark(modules.map(|m| m.0)).to_owned());
                row.push(mark(modules.map(|m| m.1)).to_owned());
                row.push(self.mean_cell(&measure, (preset, ablation), (2, 1.0)));
                let cells =
                    scenes.iter().map(|s| self.cell(&measure, (s, preset, ablation), (2, 1.0)));
                row.extend(cells);
                row
            };
            Table {
                caption: format!("mIoU with and without modules; measured here, {}", self.spread()),
                notes: vec![format!("Protocol: {}", self.protocol(&measure))],
                head,
                labels: 4,
                rows: self.parts().map(row).collect(),
                published: false,
            }
        };
        measures.into_iter().map(table).collect()
    }

    /// The paper's table, where the suite is named after its data set.
    fn published(&self, kind: Kind) -> Result<Option<Table>> {
        let Some(found) = published::table(self.plan.suite.benchmark, kind)? else {
            return Ok(None);
        };
        let mut head = vec!["method".to_owned()];
        head.extend(found.columns.iter().cloned());
        let row = |row: &published::PublishedRow| {
            let figure =
                |i| row.figures.get(i).map_or(DASH.to_owned(), |v: &f64| format!("{v:.2}"));
            let figures = (0..found.columns.len()).map(figure);
            std::iter::once(row.method.clone()).chain(figures).collect()
        };
        let mut notes = vec![format!(
            "Source: Table {} of the MTE-SLAM paper (Lu et al.), figures as printed there. \
             Protocol: {}.",
            found.number,
            found.protocol.sentence()
        )];
        let partial = self.plan.runs.iter().any(|r| r.partial);
        if partial {
            notes.push(
                "The suite asks for a part of the recordings, or smaller images (frames, stride, \
                 start, scale): its figures are not those of the whole scenes that these are."
                    .to_owned(),
            );
        }
        Ok(Some(Table {
            caption: format!("Published: {}", found.caption),
            notes,
            head,
            labels: 1,
            rows: found.rows.iter().map(row).collect(),
            published: true,
        }))
    }

    /// What a protocol says; where runs say it with other numbers of views, without these.
    fn protocol(&self, measure: &Measure) -> String {
        let all: BTreeSet<&str> = self
            .results
            .finished()
            .filter(|r| measure.of(r).is_some())
            .filter_map(|r| Some(r.figures.get(&measure.path)?.protocol.as_str()))
            .collect();
        match all.first() {
            Some(one) if all.len() == 1 => (*one).to_owned(),
            Some(one) => without_counts(one),
            None => measure.protocol_id.clone(),
        }
    }

    fn spread(&self) -> String {
        match self.plan.suite.seeds.len() {
            1 => "one seed".to_owned(),
            n => format!("mean ± standard deviation over {n} seeds"),
        }
    }
}

fn last(path: &str) -> &str {
    path.rsplit('.').next().unwrap_or(path)
}

/// A path as words.
pub fn words(path: &str) -> String {
    path.replace('.', ", ").replace('_', " ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        suite::{file::Suite, plan::DataRoot, program::tests::Pretend},
        suite_report::results::Figure,
    };

    #[test]
    fn only_numbers_of_views_are_left_out() {
        let text = "P2P, 200000 samples; culled, 0.03 m in 80 views; no alignment";
        let expected = "P2P, 200000 samples; culled, 0.03 m in N views; no alignment";
        assert_eq!(without_counts(text), expected);
        assert_eq!(without_counts("rendered views 5"), "rendered views 5");
    }

    /// Two scenes and two seeds of figures that are made up.
    fn made_up(change: impl Fn(&mut RunResult)) -> (Plan, Results) {
        let text = "seeds = [1, 2]\npresets = ['fast']\nbenchmark = 'replica'\n\
                    scenes = [{ name = 'a', synthetic = { scene = 'room', frames = 4 } },\n\
                    { name = 'b', synthetic = { scene = 'office', frames = 4 } }]";
        let suite = Suite::parse("s.toml", "s", text, &Pretend).unwrap();
        let data = DataRoot::choose(None, &suite);
        let plan = Plan::new(suite, std::path::Path::new("out"), &data, &Pretend).unwrap();
        let figure = |run: &RunResult| {
            let scene = if run.scene == "a" { 1.0 } else { 3.0 };
            Figure {
                value: scene + 0.5 * f64::from(run.seed),
                protocol_id: "p@1".to_owned(),
                protocol: "P in 8 views".to_owned(),
            }
        };
        let runs = plan.runs.iter().map(|run| {
            let mut run = RunResult::new(run);
            run.state = "finished";
            let figure = figure(&run);
            run.figures.insert("semantics.miou_percent".to_owned(), figure);
            change(&mut run);
            run
        });
        let runs = runs.collect();
        let results = Results::of_runs(&plan, runs);
        (plan, results)
    }

    fn scene_tables((plan, results): &(Plan, Results)) -> Vec<Table> {
        Tables { plan, results }.by_scene("mIoU (%)", 2, |p| p == "semantics.miou_percent")
    }

    #[test]
    fn means_are_over_seeds_and_then_scenes() {
        let made = made_up(|run| {
            // The number of views is no other protocol.
            if run.scene == "b" {
                run.figures.values_mut().for_each(|f| f.protocol = "P in 20 views".to_owned());
            }
        });
        let tables = scene_tables(&made);
        assert_eq!(tables.len(), 1);
        assert_eq!(tables[0].head, ["preset", "ablation", "a", "b", "mean"]);
        let expected = ["fast", "base", "1.75 ± 0.35", "3.75 ± 0.35", "2.75 ± 0.35"];
        assert_eq!(tables[0].rows, [expected]);
        assert_eq!(tables[0].notes, ["Protocol: P in N views"]);
        // A missing seed of one scene is marked, and is in no mean over scenes.
        let made = made_up(|run| {
            if run.scene == "b" && run.seed == 2 {
                run.state = "missing";
            }
        });
        let row = &scene_tables(&made)[0].rows[0];
        assert_eq!(row[3..], ["3.50 (n = 1)", "2.50 (n = 1)"]);
        // A scene without the figure does not count; one without any run yet leaves no mean.
        let of_b = |run: &RunResult| run.scene == "b";
        let without = made_up(|run| {
            if of_b(run) {
                run.figures.clear();
            }
        });
        assert_eq!(scene_tables(&without)[0].rows[0][2..], ["1.75 ± 0.35", "-", "1.75 ± 0.35"]);
        let unfinished = made_up(|run| {
            if of_b(run) {
                run.state = "missing";
            }
        });
        assert_eq!(scene_tables(&unfinished)[0].rows[0][2..], ["1.75 ± 0.35", "-", "-"]);
    }

    #[test]
    fn protocols_never_share_a_table_or_column() {
        let made = made_up(|run| {
            if run.scene == "b" {
                // The same words do not make figures comparable.
                run.figures.values_mut().for_each(|f| f.protocol_id = "q@1".to_owned());
            }
        });
        let tables = scene_tables(&made);
        assert_eq!(tables.len(), 2);
        assert_eq!(tables[0].rows[0][2..], ["1.75 ± 0.35", "-", "1.75 ± 0.35"]);
        assert_eq!(tables[1].rows[0][2..], ["-", "3.75 ± 0.35", "3.75 ± 0.35"]);
        let measured: Vec<&Table> = tables.iter().filter(|t| t.published).collect();
        assert!(measured.is_empty());
        let all = blocks(&made.0, &made.1).unwrap();
        let published = all.iter().filter(|b| matches!(b, Block::Table(t) if t.published)).count();
        assert_eq!(published, 5, "Tables II to VI");
    }

    #[test]
    fn paths_read_as_words() {
        assert_eq!(words("mesh.point_to_surface"), "mesh, point to surface");
        assert_eq!(last("a.b.c"), "c");
    }
}
