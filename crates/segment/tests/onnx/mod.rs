//! Networks of a few hundred bytes, written as ONNX has them (protocol buffers): each names the nearest
//! of four colours.
#![allow(dead_code)]

/// The colours, and so the classes.
pub const COLORS: [[u8; 3]; 4] = [[200, 40, 40], [40, 200, 40], [40, 40, 200], [220, 220, 220]];

fn varint(mut x: u64) -> Vec<u8> {
    let mut out = Vec::new();
    while x >= 0x80 {
        out.push(x as u8 | 0x80);
        x >>= 7;
    }
    out.push(x as u8);
    out
}

pub fn number(field: u64, x: u64) -> Vec<u8> {
    [varint(field << 3), varint(x)].concat()
}

pub fn bytes(field: u64, x: &[u8]) -> Vec<u8> {
    [varint(field << 3 | 2), varint(x.len() as u64), x.to_vec()].concat()
}

fn text(field: u64, x: &str) -> Vec<u8> {
    bytes(field, x.as_bytes())
}

/// An attribute of whole numbers (or one), or of text.
pub enum Attribute<'a> {
    Int(&'a str, i64),
    Ints(&'a str, &'a [i64]),
    Text(&'a str, &'a str),
}

fn attribute(a: &Attribute<'_>) -> Vec<u8> {
    match a {
        Attribute::Int(name, x) => [text(1, name), number(3, *x as u64), number(20, 2)].concat(),
        Attribute::Ints(name, xs) => {
            let values: Vec<u8> = xs.iter().flat_map(|x| number(8, *x as u64)).collect();
            [text(1, name), values, number(20, 7)].concat()
        }
        Attribute::Text(name, x) => [text(1, name), text(4, x), number(20, 3)].concat(),
    }
}

pub fn node(kind: &str, inputs: &[&str], output: &str, attributes: &[Attribute<'_>]) -> Vec<u8> {
    let inputs: Vec<u8> = inputs.iter().flat_map(|i| text(1, i)).collect();
    let attributes: Vec<u8> = attributes.iter().flat_map(|a| bytes(5, &attribute(a))).collect();
    [inputs, text(2, output), text(3, output), text(4, kind), attributes].concat()
}

pub fn floats(name: &str, dims: &[u64], values: &[f32]) -> Vec<u8> {
    let dims: Vec<u8> = dims.iter().flat_map(|d| number(1, *d)).collect();
    let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    [dims, number(2, 1), text(8, name), bytes(9, &raw)].concat()
}

/// Name, element type (1 float, 2 byte, 7 whole numbers), dimensions: numbers or names.
pub fn value(name: &str, kind: u64, dims: &[&str]) -> Vec<u8> {
    let dim = |d: &&str| match d.parse::<u64>() {
        Ok(n) => bytes(1, &number(1, n)),
        Err(_) => bytes(1, &text(2, d)),
    };
    let shape: Vec<u8> = dims.iter().flat_map(dim).collect();
    let tensor = [number(1, kind), bytes(2, &shape)].concat();
    [text(1, name), bytes(2, &bytes(1, &tensor))].concat()
}

pub struct Graph {
    pub nodes: Vec<Vec<u8>>,
    pub constants: Vec<Vec<u8>>,
    pub input: Vec<u8>,
    pub outputs: Vec<Vec<u8>>,
}

impl Graph {
    pub fn model(&self) -> Vec<u8> {
        let all = |field, parts: &[Vec<u8>]| -> Vec<u8> {
            parts.iter().flat_map(|p| bytes(field, p)).collect()
        };
        let graph = [
            all(1, &self.nodes),
            text(2, "g"),
            all(5, &self.constants),
            bytes(11, &self.input),
            all(12, &self.outputs),
        ]
        .concat();
        [number(1, 8), bytes(8, &number(2, 13)), bytes(7, &graph)].concat()
    }

    /// Scores of the four colours, as [1, 4, rows, columns] called `logits`: the mean colour of every cell
    /// of `cell` x `cell` pixels, negative squared distance but for what is the same for all.
    pub fn colors(cell: u64) -> Graph {
        let area = (cell * cell) as f32;
        let scale = |x: u8| f32::from(x) / 255.0;
        let mut weights = Vec::new();
        for color in COLORS {
            for c in color {
                weights.extend(vec![5.0 * 2.0 * scale(c) / area; (cell * cell) as usize]);
            }
        }
        let bias = COLORS.map(|c| -5.0 * c.map(|x| scale(x) * scale(x)).iter().sum::<f32>());
        let side = [cell as i64, cell as i64];
        Graph {
            nodes: vec![node(
                "Conv",
                &["image", "w", "b"],
                "logits",
                &[Attribute::Ints("kernel_shape", &side), Attribute::Ints("strides", &side)],
            )],
            constants: vec![floats("w", &[4, 3, cell, cell], &weights), floats("b", &[4], &bias)],
            input: value("image", 1, &["1", "3", "h", "w"]),
            outputs: vec![value("logits", 1, &["1", "4", "r", "c"])],
        }
    }

    /// Puts another output in place of the scores.
    pub fn then(mut self, step: Vec<u8>, output: Vec<u8>) -> Graph {
        self.nodes.push(step);
        self.outputs = vec![output];
        self
    }

    /// Adds a step and an output.
    pub fn and(mut self, step: Vec<u8>, output: Vec<u8>) -> Graph {
        self.nodes.push(step);
        self.outputs.push(output);
        self
    }
}

/// No change of the colours but to 0 to 1, and the image's own size in multiples of 4.
pub const PLAIN: &str = r#"{"do_resize": false, "do_normalize": false, "size_divisor": 4}"#;
/// Names of the four classes.
pub const NAMES: &str = r#"{"id2label": {"0": "red", "1": "green", "2": "blue", "3": "light"}, "raw_ids": [7, 3, 9, 20]}"#;
