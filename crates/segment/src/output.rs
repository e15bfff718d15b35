//! What a network's outputs mean, by their ranks, types and sizes.
use crate::error::{SegmentError, invalid};

/// Type of an output's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Float,
    Integer,
}

/// An output as the first run has it.
#[derive(Clone, Debug)]
pub(crate) struct Output {
    pub name: String,
    pub kind: Kind,
    pub shape: Vec<usize>,
}

/// Order of a grid's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// Batch, channels, rows, columns.
    ChannelsFirst,
    /// Batch, rows, columns, channels.
    ChannelsLast,
}

/// Which outputs give classes, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Classes {
    /// Scores of every class at every cell.
    Scores { output: usize, order: Order },
    /// The class at every cell.
    Map { output: usize },
    /// MaskFormer's: classes of queries (and, last, "no object"), and masks of queries.
    Queries { classes: usize, masks: usize },
}

/// Which output gives features.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Features {
    Grid {
        output: usize,
        order: Order,
    },
    /// A vision transformer's tokens, after `skipped` that are of no patch.
    Tokens {
        output: usize,
        skipped: usize,
        rows: usize,
        columns: usize,
    },
}

/// What the outputs mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Understood {
    pub classes: Classes,
    pub features: Option<Features>,
}

/// Whether a grid covers an input, both (rows, columns), but for a cell's rounding.
fn covers([rows, columns]: [usize; 2], input: [usize; 2]) -> bool {
    let [h, w] = input;
    let (cross, other) = (rows.saturating_mul(w), columns.saturating_mul(h));
    rows * columns >= 4 && rows <= 2 * h && columns <= 2 * w && cross.abs_diff(other) <= h.max(w)
}

/// The order in which four dimensions are a grid over the input with several channels.
fn grid(shape: &[usize], input: [usize; 2], classes: usize) -> Option<Order> {
    let &[1, a, b, c] = shape else { return None };
    let (first, last) = (a > 1 && covers([b, c], input), c > 1 && covers([a, b], input));
    match (first, last) {
        (true, true) if c == classes && a != classes => Some(Order::ChannelsLast),
        (true, _) => Some(Order::ChannelsFirst),
        (false, true) => Some(Order::ChannelsLast),
        (false, false) => None,
    }
}

/// Tokens of square patches of the input: how many come before them, and their grid.
fn tokens(shape: &[usize], [h, w]: [usize; 2]) -> Option<(usize, usize, usize)> {
    let &[1, count, channels] = shape else { return None };
    let patches = [8, 14, 16, 32];
    patches.into_iter().filter(|p| channels > 1 && h % p == 0 && w % p == 0).find_map(|p| {
        let (rows, columns) = (h / p, w / p);
        let skipped = count.checked_sub(rows * columns).filter(|&n| n <= 8)?;
        Some((skipped, rows, columns))
    })
}

fn says(output: &Output, words: &[&str]) -> bool {
    let name = output.name.to_lowercase();
    words.iter().any(|word| name.contains(word))
}

/// Works out what the outputs mean for an input of (rows, columns); `classes`: how many names are known, 0
/// for none.
///
/// # Errors
/// [`SegmentError::Invalid`] with all outputs, when none gives classes.
pub(crate) fn understand(
    model: &str,
    outputs: &[Output],
    input: [usize; 2],
    classes: usize,
) -> Result<Understood, SegmentError> {
    let floats = || outputs.iter().enumerate().filter(|(_, o)| o.kind == Kind::Float);
    let queries = floats().find_map(|(i, o)| {
        let &[1, n, m] = o.shape.as_slice() else { return None };
        let masks = floats().find(
            |(_, o)| matches!(o.shape.as_slice(), &[1, q, h, w] if q == n && covers([h, w], input)),
        )?;
        let named = says(o, &["class_queries", "pred_logits"]);
        (m > 1 && (named || tokens(&o.shape, input).is_none())).then_some((i, masks.0))
    });
    let feature = ["feature", "hidden", "embed", "backbone", "tokens"];
    let grids: Vec<(usize, Order)> =
        floats().filter_map(|(i, o)| Some((i, grid(&o.shape, input, classes)?))).collect();
    let scores = |&&(i, order): &&(usize, Order)| {
        let shape = &outputs[i].shape;
        let channels = if order == Order::ChannelsFirst { shape[1] } else { shape[3] };
        !says(&outputs[i], &feature) && (classes == 0 || channels == classes || outputs.len() == 1)
    };
    let map = outputs.iter().position(|o| {
        o.kind == Kind::Integer
            && match *o.shape.as_slice() {
                [h, w] | [1, h, w] | [1, 1, h, w] => covers([h, w], input),
                [1, h, w, 1] => covers([h, w], input),
                _ => false,
            }
    });
    let found = match (queries, grids.iter().find(scores), map) {
        (Some((classes, masks)), _, _) => Classes::Queries { classes, masks },
        (None, Some(&(output, order)), _) => Classes::Scores { output, order },
        (None, None, Some(output)) => Classes::Map { output },
        (None, None, None) => {
            let kind = |k: Kind| if k == Kind::Float { "float" } else { "integer" };
            let listed: Vec<String> = outputs
                .iter()
                .map(|o| format!("{} {:?} ({})", o.name, o.shape, kind(o.kind)))
                .collect();
            let [h, w] = input;
            let number = if classes > 0 { classes.to_string() } else { "classes".into() };
            let expected = format!(
                "for an input of {w} x {h} pixels: scores [1, {number}, rows, columns] or [1, rows, \
                 columns, {number}], a map of class indices [1, rows, columns] of integers, or \
                 MaskFormer's pair [1, queries, classes + 1] and [1, queries, rows, columns]"
            );
            return Err(invalid(model, "outputs", listed.join(", "), expected));
        }
    };
    let used = match found {
        Classes::Scores { output, .. } | Classes::Map { output } => vec![output],
        Classes::Queries { classes, masks } => vec![classes, masks],
    };
    let rest = || floats().filter(|(i, _)| !used.contains(i));
    let features = grids
        .iter()
        .find(|(i, _)| !used.contains(i))
        .map(|&(output, order)| Features::Grid { output, order })
        .or_else(|| {
            rest().find_map(|(output, o)| {
                let (skipped, rows, columns) = tokens(&o.shape, input)?;
                Some(Features::Tokens { output, skipped, rows, columns })
            })
        });
    Ok(Understood { classes: found, features })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outputs(list: &[(&str, Kind, &[usize])]) -> Vec<Output> {
        list.iter()
            .map(|&(name, kind, shape)| Output { name: name.into(), kind, shape: shape.into() })
            .collect()
    }

    fn meaning(list: &[(&str, Kind, &[usize])], classes: usize) -> Result<Understood, String> {
        understand("m", &outputs(list), [384, 512], classes).map_err(|e| e.to_string())
    }

    #[test]
    fn outputs_are_told_apart_by_rank_type_and_size() {
        use Kind::{Float, Integer};
        let classes = |list: &[(&str, Kind, &[usize])], n| meaning(list, n).map(|u| u.classes);
        let scores = |output, order| Ok(Classes::Scores { output, order });
        assert_eq!(
            classes(&[("logits", Float, &[1, 32, 96, 128])], 0),
            scores(0, Order::ChannelsFirst)
        );
        assert_eq!(classes(&[("x", Float, &[1, 384, 512, 19])], 0), scores(0, Order::ChannelsLast));
        // As many rows as columns as channels: the number of names decides.
        assert_eq!(classes(&[("x", Float, &[1, 24, 32, 40])], 40), scores(0, Order::ChannelsLast));
        assert_eq!(classes(&[("x", Integer, &[1, 384, 512])], 0), Ok(Classes::Map { output: 0 }));
        assert_eq!(classes(&[("x", Integer, &[1, 1, 96, 128])], 0), Ok(Classes::Map { output: 0 }));
        let pair: &[(&str, Kind, &[usize])] = &[
            ("masks_queries_logits", Float, &[1, 100, 96, 128]),
            ("class_queries_logits", Float, &[1, 100, 151]),
        ];
        assert_eq!(classes(pair, 150), Ok(Classes::Queries { classes: 1, masks: 0 }));
        let both = meaning(
            &[("last_hidden_state", Float, &[1, 769, 384]), ("logits", Float, &[1, 150, 96, 128])],
            150,
        );
        let features = Features::Tokens { output: 0, skipped: 1, rows: 24, columns: 32 };
        assert_eq!(both.unwrap().features, Some(features));
        let grid = meaning(
            &[("logits", Float, &[1, 9, 96, 128]), ("features", Float, &[1, 64, 24, 32])],
            0,
        );
        let features = Features::Grid { output: 1, order: Order::ChannelsFirst };
        assert_eq!(grid.unwrap().features, Some(features));
    }

    #[test]
    fn anything_else_is_refused_with_all_that_was_found() {
        for list in [
            &[("pooled", Kind::Float, &[1usize, 1000][..])][..],
            &[("boxes", Kind::Float, &[1, 300, 4]), ("n", Kind::Integer, &[1])],
            &[("logits", Kind::Float, &[2, 32, 96, 128])],
            &[("square", Kind::Float, &[1, 32, 96, 96])],
            &[("one", Kind::Float, &[1, 1, 96, 128])],
        ] {
            let error = meaning(list, 0).unwrap_err();
            assert!(error.contains(list[0].0) && error.contains("MaskFormer"), "{error}");
        }
        let error = meaning(
            &[("a", Kind::Float, &[1, 7, 96, 128]), ("b", Kind::Float, &[1, 8, 96, 128])],
            9,
        );
        assert!(error.unwrap_err().contains("9"));
    }
}
