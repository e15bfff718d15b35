//! The network itself, run by [`rten`].
use crate::{
    config::{InputSize, MAX_SIDE, Preprocessing},
    error::{SegmentError, invalid},
    output::{Kind, Output},
    repair::with_kernel_shapes,
};
use rten::{DataType, Dimension, Model, NodeId, RunOptions, ThreadPool, Value, ValueType};
use rten_tensor::{Layout as _, prelude::AsView as _};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

/// Length of a text attribute and the text itself, as ONNX (protobuf) has a cubic Resize's mode.
const CUBIC: &[u8] = b"\x22\x05cubic";

/// A loaded network.
pub(crate) struct Network {
    pub name: String,
    pub input_name: String,
    /// The size that it asks for, if it takes no other.
    pub fixed_size: Option<InputSize>,
    pub warnings: Vec<String>,
    model: Model,
    input: NodeId,
    channels_first: bool,
    bytes: bool,
    outputs: Vec<(String, NodeId)>,
    threads: Option<Arc<ThreadPool>>,
}

/// An output.
pub(crate) struct Tensor {
    name: String,
    shape: Vec<usize>,
    numbers: Numbers,
}

enum Numbers {
    Floats(Vec<f32>),
    Integers(Vec<i32>),
}

impl Tensor {
    pub fn output(&self) -> Output {
        let kind = match self.numbers {
            Numbers::Floats(_) => Kind::Float,
            Numbers::Integers(_) => Kind::Integer,
        };
        Output { name: self.name.clone(), kind, shape: self.shape.clone() }
    }

    pub fn floats(&self) -> Option<(&[f32], &[usize])> {
        match &self.numbers {
            Numbers::Floats(values) => Some((values, &self.shape)),
            Numbers::Integers(_) => None,
        }
    }

    /// A map of classes: its columns and rows, and the classes.
    pub fn map(&self) -> Option<([usize; 2], &[i32])> {
        let Numbers::Integers(values) = &self.numbers else { return None };
        let grid = match *self.shape.as_slice() {
            [h, w] | [1, h, w] | [1, 1, h, w] | [1, h, w, 1] => [w, h],
            _ => return None,
        };
        Some((grid, values))
    }
}

/// The runtime checks what it reads, but a panic in it must not take a room that is being mapped
/// with it.
fn guarded<T>(run: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(run)).map_err(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        let text = text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
        format!("the runtime failed inside: {}", text.unwrap_or_else(|| "no reason given".into()))
    })
}

impl Network {
    pub fn load(
        name: &str,
        onnx: Vec<u8>,
        threads: Option<usize>,
    ) -> Result<Network, SegmentError> {
        let mut warnings = Vec::new();
        if onnx.windows(CUBIC.len()).any(|w| w == CUBIC) {
            warnings.push(format!(
                "{name}: its cubic Resize is computed as a linear one, so edges may lie elsewhere; \
                 export it with linear resizing"
            ));
        }
        let bytes = onnx.len();
        let onnx = with_kernel_shapes(onnx);
        let expected = "a network in ONNX format, with operators of the standard";
        let loaded = guarded(|| Model::load(onnx).map_err(|e| e.to_string())).and_then(|m| m);
        let model = loaded.map_err(|reason| {
            invalid(
                name,
                "network",
                format!("{bytes} bytes that cannot be loaded ({reason})"),
                expected,
            )
        })?;
        let mut inputs = model.input_ids().iter();
        let (Some(&input), None) = (inputs.next(), inputs.next()) else {
            let n = model.input_ids().len();
            return Err(invalid(name, "inputs of the network", n, "1, the image"));
        };
        let info = model.node_info(input);
        let input_name =
            info.as_ref().and_then(|i| i.name()).unwrap_or("without a name").to_owned();
        let shape = info.as_ref().and_then(|i| i.shape()).unwrap_or_default();
        let fixed = |d: &Dimension| if let Dimension::Fixed(n) = d { Some(*n) } else { None };
        let sizes: Vec<Option<usize>> = shape.iter().map(fixed).collect();
        let shown = || {
            let one = |d: &Dimension| match d {
                Dimension::Fixed(n) => n.to_string(),
                Dimension::Symbolic(name) => name.clone(),
            };
            format!("{input_name} [{}]", shape.iter().map(one).collect::<Vec<_>>().join(", "))
        };
        let expected = "[1, 3, height, width] or [1, height, width, 3], numbers or names";
        let (channels_first, height, width) = match *sizes.as_slice() {
            [None | Some(1), None | Some(3), h, w] if w != Some(3) => (true, h, w),
            [None | Some(1), h, w, Some(3)] => (false, h, w),
            // Nothing is said of it: as PyTorch exports.
            [] => (true, None, None),
            _ => return Err(invalid(name, "input", shown(), expected)),
        };
        let in_bytes = match info.and_then(|i| i.dtype()) {
            None | Some(ValueType::Tensor(DataType::Float)) => false,
            Some(ValueType::Tensor(DataType::UInt8)) => true,
            Some(other) => {
                return Err(invalid(name, "type of the input", other, "32-bit floats, or bytes"));
            }
        };
        let fixed_size = match (width, height) {
            (Some(width), Some(height)) => {
                if [width, height].iter().any(|x| !(8..=MAX_SIDE).contains(x)) {
                    let limit = format!("8 to {MAX_SIDE} pixels");
                    return Err(invalid(name, "size of the input", shown(), limit));
                }
                Some(InputSize { width, height })
            }
            (None, None) => None,
            _ => return Err(invalid(name, "input", shown(), expected)),
        };
        let outputs: Vec<(String, NodeId)> = model
            .output_ids()
            .iter()
            .map(|&id| {
                let name = model.node_info(id).and_then(|i| i.name().map(str::to_owned));
                (name.unwrap_or_else(|| "without a name".into()), id)
            })
            .collect();
        if outputs.is_empty() || outputs.len() > 64 {
            return Err(invalid(name, "outputs of the network", outputs.len(), "1 to 64"));
        }
        let threads = threads.map(|n| Arc::new(ThreadPool::with_num_threads(n.max(1))));
        Ok(Network {
            name: name.into(),
            input_name,
            fixed_size,
            warnings,
            model,
            input,
            channels_first,
            bytes: in_bytes,
            outputs,
            threads,
        })
    }

    /// Keeps the outputs at these places alone, in this order.
    pub fn only(self, outputs: &[usize]) -> Network {
        let outputs = outputs.iter().map(|&i| self.outputs[i].clone()).collect();
        Network { outputs, ..self }
    }

    /// The input of an image of `size` (width, height).
    pub fn input_of(&self, image: &[[u8; 3]], [w, h]: [usize; 2], p: &Preprocessing) -> Value {
        let shape = if self.channels_first { [1, 3, h, w] } else { [1, h, w, 3] };
        if self.bytes {
            let data: Vec<u8> = match self.channels_first {
                true => (0..3).flat_map(|c| image.iter().map(move |x| x[c])).collect(),
                false => image.iter().flatten().copied().collect(),
            };
            return rten_tensor::Tensor::from_data(&shape[..], data).into();
        }
        let value = |c: usize, x: u8| (f32::from(x) * p.rescale - p.mean[c]) / p.deviation[c];
        let data: Vec<f32> = match self.channels_first {
            true => (0..3).flat_map(|c| image.iter().map(move |x| value(c, x[c]))).collect(),
            false => image.iter().flat_map(|x| [0, 1, 2].map(|c| value(c, x[c]))).collect(),
        };
        rten_tensor::Tensor::from_data(&shape[..], data).into()
    }

    /// Runs it.
    pub fn run(&self, input: &Value) -> Result<Vec<Tensor>, SegmentError> {
        let failed = |reason: String| SegmentError::Run { model: self.name.clone(), reason };
        let ids: Vec<NodeId> = self.outputs.iter().map(|(_, id)| *id).collect();
        let options = RunOptions::default().with_thread_pool(self.threads.clone());
        let ran = guarded(|| {
            let inputs = vec![(self.input, input.into())];
            self.model.run(inputs, &ids, Some(options)).map_err(|e| e.to_string())
        });
        let values = ran.and_then(|r| r).map_err(failed)?;
        let tensor = |(value, (name, _)): (Value, &(String, NodeId))| {
            let (shape, numbers) = match value {
                Value::FloatTensor(t) => (t.shape().to_vec(), Numbers::Floats(t.to_vec())),
                Value::Int32Tensor(t) => (t.shape().to_vec(), Numbers::Integers(t.to_vec())),
                Value::UInt8Tensor(t) => {
                    let wide = t.to_vec().into_iter().map(i32::from).collect();
                    (t.shape().to_vec(), Numbers::Integers(wide))
                }
                Value::Int8Tensor(t) => {
                    let wide = t.to_vec().into_iter().map(i32::from).collect();
                    (t.shape().to_vec(), Numbers::Integers(wide))
                }
                _ => return Err(failed(format!("output {name} is not a tensor of numbers"))),
            };
            Ok(Tensor { name: name.clone(), shape, numbers })
        };
        values.into_iter().zip(&self.outputs).map(tensor).collect()
    }
}
