//! What the format allows and the runtime does not take: convolutions that leave their kernel's shape to
//! be read off the weights. It is written into them.
//!
//! ONNX is protocol buffers: fields of a number and a type, where messages hold messages as bytes.

/// Field numbers of ONNX.
const MODEL_GRAPH: u64 = 7;
const GRAPH_NODE: u64 = 1;
const GRAPH_INITIALIZER: u64 = 5;
const NODE_INPUT: u64 = 1;
const NODE_OPERATOR: u64 = 4;
const NODE_ATTRIBUTE: u64 = 5;
const ATTRIBUTE_NAME: u64 = 1;
const TENSOR_DIMS: u64 = 1;
const TENSOR_NAME: u64 = 8;

/// A field: its number, its contents, and its bytes with number and length.
struct Field<'a> {
    number: u64,
    contents: Contents<'a>,
    whole: &'a [u8],
}

enum Contents<'a> {
    Number(u64),
    Bytes(&'a [u8]),
    Fixed,
}

/// Takes `n` bytes off the front; `None` where there are fewer.
fn take<'a>(bytes: &mut &'a [u8], n: u64) -> Option<&'a [u8]> {
    let (taken, rest) = bytes.split_at_checked(usize::try_from(n).ok()?)?;
    *bytes = rest;
    Some(taken)
}

fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut x = 0u64;
    for shift in (0..64).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        x |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(x);
        }
    }
    None
}

/// The fields of a message; `None` where it is none.
fn fields(message: &[u8]) -> Option<Vec<Field<'_>>> {
    let mut rest = message;
    let mut out = Vec::new();
    while !rest.is_empty() {
        let begin = rest;
        let key = varint(&mut rest)?;
        let contents = match key & 7 {
            0 => Contents::Number(varint(&mut rest)?),
            1 => take(&mut rest, 8).map(|_| Contents::Fixed)?,
            5 => take(&mut rest, 4).map(|_| Contents::Fixed)?,
            2 => {
                let n = varint(&mut rest)?;
                Contents::Bytes(take(&mut rest, n)?)
            }
            _ => return None,
        };
        out.push(Field { number: key >> 3, contents, whole: &begin[..begin.len() - rest.len()] });
    }
    Some(out)
}

fn bytes_of<'a>(all: &[Field<'a>], number: u64) -> impl Iterator<Item = &'a [u8]> {
    let bytes = |f: &Field<'a>| if let Contents::Bytes(b) = f.contents { Some(b) } else { None };
    all.iter().filter(move |f| f.number == number).filter_map(bytes)
}

fn push_varint(out: &mut Vec<u8>, mut x: u64) {
    while x >= 0x80 {
        out.push(x as u8 | 0x80);
        x >>= 7;
    }
    out.push(x as u8);
}

fn push_bytes(out: &mut Vec<u8>, number: u64, contents: &[u8]) {
    push_varint(out, number << 3 | 2);
    push_varint(out, contents.len() as u64);
    out.extend_from_slice(contents);
}

/// The attribute `kernel_shape`.
fn kernel_shape(sides: &[u64]) -> Vec<u8> {
    let mut out = Vec::new();
    push_bytes(&mut out, ATTRIBUTE_NAME, b"kernel_shape");
    for side in sides {
        push_varint(&mut out, 8 << 3);
        push_varint(&mut out, *side);
    }
    // Its type: whole numbers.
    push_varint(&mut out, 20 << 3);
    push_varint(&mut out, 7);
    out
}

/// Dimensions of a tensor, each a field or all in one.
fn dims(tensor: &[Field<'_>]) -> Option<Vec<u64>> {
    let mut out = Vec::new();
    for field in tensor.iter().filter(|f| f.number == TENSOR_DIMS) {
        match field.contents {
            Contents::Number(n) => out.push(n),
            Contents::Bytes(mut packed) => {
                while !packed.is_empty() {
                    out.push(varint(&mut packed)?);
                }
            }
            Contents::Fixed => return None,
        }
    }
    Some(out)
}

/// The same network, with the shapes of kernels where convolutions leave them out. What cannot be
/// understood stays as it is: the runtime says what is wrong with it.
pub(crate) fn with_kernel_shapes(onnx: Vec<u8>) -> Vec<u8> {
    repaired(&onnx).unwrap_or(onnx)
}

fn repaired(onnx: &[u8]) -> Option<Vec<u8>> {
    let model = fields(onnx)?;
    let graph = fields(bytes_of(&model, MODEL_GRAPH).next()?)?;
    let mut changed = false;
    let mut new_graph = Vec::with_capacity(onnx.len() + 64);
    for field in &graph {
        let attribute = match field.contents {
            Contents::Bytes(node) if field.number == GRAPH_NODE => missing_shape(node, &graph),
            _ => None,
        };
        match (attribute, &field.contents) {
            (Some(attribute), Contents::Bytes(node)) => {
                let mut node = node.to_vec();
                push_bytes(&mut node, NODE_ATTRIBUTE, &attribute);
                push_bytes(&mut new_graph, GRAPH_NODE, &node);
                changed = true;
            }
            _ => new_graph.extend_from_slice(field.whole),
        }
    }
    if !changed {
        return None;
    }
    let mut out = Vec::with_capacity(new_graph.len() + 64);
    for field in &model {
        if field.number == MODEL_GRAPH {
            push_bytes(&mut out, MODEL_GRAPH, &new_graph);
        } else {
            out.extend_from_slice(field.whole);
        }
    }
    Some(out)
}

/// The attribute that a convolution lacks, if it can be made.
fn missing_shape(node: &[u8], graph: &[Field<'_>]) -> Option<Vec<u8>> {
    let node = fields(node)?;
    if bytes_of(&node, NODE_OPERATOR).next()? != b"Conv" {
        return None;
    }
    let named = |attribute: &[u8]| {
        fields(attribute)
            .is_some_and(|f| bytes_of(&f, ATTRIBUTE_NAME).next() == Some(&b"kernel_shape"[..]))
    };
    if bytes_of(&node, NODE_ATTRIBUTE).any(named) {
        return None;
    }
    let weights = bytes_of(&node, NODE_INPUT).nth(1)?;
    let tensor = bytes_of(graph, GRAPH_INITIALIZER)
        .filter_map(fields)
        .find(|t| bytes_of(t, TENSOR_NAME).next() == Some(weights))?;
    let dims = dims(&tensor)?;
    dims.get(2..).filter(|sides| !sides.is_empty()).map(kernel_shape)
}
