//! Reads the needed part of an ONNX file: nodes, weights, inputs, outputs and metadata.
//!
//! Field numbers are those of `onnx.proto` (<https://github.com/onnx/onnx/blob/main/onnx/onnx.proto>).

pub(crate) mod wire;

use std::collections::BTreeMap;

use wire::{Fields, Value, WireError};

type Read<T> = Result<T, WireError>;

/// A model with its graph; it borrows from the bytes of the file where possible.
#[derive(Debug, Default)]
pub(crate) struct Model<'a> {
    pub(crate) nodes: Vec<Node<'a>>,
    pub(crate) initializers: BTreeMap<&'a str, Tensor>,
    pub(crate) inputs: Vec<ValueInfo<'a>>,
    pub(crate) outputs: Vec<ValueInfo<'a>>,
    pub(crate) metadata: BTreeMap<&'a str, &'a str>,
}

/// One operator.
#[derive(Debug, Default)]
pub(crate) struct Node<'a> {
    pub(crate) name: &'a str,
    pub(crate) op: &'a str,
    pub(crate) domain: &'a str,
    pub(crate) inputs: Vec<&'a str>,
    pub(crate) outputs: Vec<&'a str>,
    pub(crate) attributes: BTreeMap<&'a str, Attribute<'a>>,
}

/// An attribute; only the member for its type is filled.
#[derive(Debug, Default)]
pub(crate) struct Attribute<'a> {
    pub(crate) float: Option<f32>,
    pub(crate) int: Option<i64>,
    pub(crate) text: &'a [u8],
    pub(crate) tensor: Option<Tensor>,
    pub(crate) floats: Vec<f32>,
    pub(crate) ints: Vec<i64>,
}

/// A constant.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tensor {
    pub(crate) dims: Vec<usize>,
    pub(crate) data: TensorData,
}

/// Elements of a constant, row-major.
#[derive(Clone, Debug)]
pub(crate) enum TensorData {
    Floats(Vec<f32>),
    Ints(Vec<i64>),
    /// A type that is not supported; the number is ONNX's `TensorProto.DataType`.
    Other(i64),
    /// Stored in another file.
    External,
}

impl Default for TensorData {
    fn default() -> Self {
        TensorData::Other(0)
    }
}

/// Name and declared shape of an input or output; `None` stands for a size left open.
#[derive(Debug, Default)]
pub(crate) struct ValueInfo<'a> {
    pub(crate) name: &'a str,
    pub(crate) dims: Vec<Option<usize>>,
}

impl<'a> Model<'a> {
    /// Reads a `ModelProto`.
    pub(crate) fn parse(bytes: &'a [u8]) -> Read<Self> {
        let mut model = Model::default();
        let mut has_graph = false;
        for field in Fields::new(bytes) {
            match field? {
                (7, graph) => {
                    has_graph = true;
                    model.graph(graph.bytes()?)?;
                }
                (14, entry) => {
                    let (mut key, mut value) = ("", "");
                    for field in Fields::new(entry.bytes()?) {
                        match field? {
                            (1, text) => key = text.text()?,
                            (2, text) => value = text.text()?,
                            _ => {}
                        }
                    }
                    model.metadata.insert(key, value);
                }
                _ => {}
            }
        }
        if !has_graph || model.nodes.is_empty() {
            return Err(WireError("it holds no graph".into()));
        }
        Ok(model)
    }

    fn graph(&mut self, bytes: &'a [u8]) -> Read<()> {
        for field in Fields::new(bytes) {
            match field? {
                (1, node) => self.nodes.push(Node::parse(node.bytes()?)?),
                (5, tensor) => {
                    let (name, tensor) = Tensor::parse(tensor.bytes()?)?;
                    self.initializers.insert(name, tensor);
                }
                (11, input) => self.inputs.push(ValueInfo::parse(input.bytes()?)?),
                (12, output) => self.outputs.push(ValueInfo::parse(output.bytes()?)?),
                _ => {}
            }
        }
        Ok(())
    }
}

impl<'a> Node<'a> {
    fn parse(bytes: &'a [u8]) -> Read<Self> {
        let mut node = Node::default();
        for field in Fields::new(bytes) {
            match field? {
                (1, name) => node.inputs.push(name.text()?),
                (2, name) => node.outputs.push(name.text()?),
                (3, name) => node.name = name.text()?,
                (4, op) => node.op = op.text()?,
                (5, attribute) => {
                    let (name, attribute) = Attribute::parse(attribute.bytes()?)?;
                    node.attributes.insert(name, attribute);
                }
                (7, domain) => node.domain = domain.text()?,
                _ => {}
            }
        }
        Ok(node)
    }
}

impl<'a> Attribute<'a> {
    fn parse(bytes: &'a [u8]) -> Read<(&'a str, Self)> {
        let mut name = "";
        let mut attribute = Attribute::default();
        for field in Fields::new(bytes) {
            match field? {
                (1, text) => name = text.text()?,
                (2, Value::Fixed32(bits)) => attribute.float = Some(f32::from_bits(bits)),
                (3, int) => attribute.int = Some(int.int()?),
                (4, text) => attribute.text = text.bytes()?,
                (5, tensor) => attribute.tensor = Some(Tensor::parse(tensor.bytes()?)?.1),
                (7, floats) => floats.floats(&mut attribute.floats)?,
                (8, ints) => ints.ints(&mut attribute.ints)?,
                _ => {}
            }
        }
        Ok((name, attribute))
    }
}

impl Tensor {
    fn parse(bytes: &[u8]) -> Read<(&str, Self)> {
        let (mut name, mut data_type, mut external) = ("", 0, false);
        let (mut dims, mut floats, mut ints, mut raw) = (Vec::new(), Vec::new(), Vec::new(), None);
        for field in Fields::new(bytes) {
            match field? {
                (1, value) => value.ints(&mut dims)?,
                (2, value) => data_type = value.int()?,
                (4, value) => value.floats(&mut floats)?,
                (7, value) => value.ints(&mut ints)?,
                (8, value) => name = value.text()?,
                (9, value) => raw = Some(value.bytes()?),
                (14, value) => external = value.int()? == 1,
                _ => {}
            }
        }
        let data = match (data_type, raw) {
            _ if external => TensorData::External,
            (FLOAT, None) => TensorData::Floats(floats),
            (FLOAT, Some(raw)) => TensorData::Floats(elements(name, raw, f32::from_le_bytes)?),
            (FLOAT16, Some(raw)) => TensorData::Floats(elements(name, raw, |bytes| half(u16::from_le_bytes(bytes)))?),
            (INT64, None) => TensorData::Ints(ints),
            (INT64, Some(raw)) => TensorData::Ints(elements(name, raw, i64::from_le_bytes)?),
            (other, _) => TensorData::Other(other),
        };
        let dims: Option<Vec<usize>> = dims.iter().map(|dim| usize::try_from(*dim).ok()).collect();
        let dims = dims.ok_or_else(|| WireError(format!("constant \"{name}\" has a negative size")))?;
        let count = dims.iter().try_fold(1_usize, |product, dim| product.checked_mul(*dim));
        let stored = match &data {
            TensorData::Floats(values) => Some(values.len()),
            TensorData::Ints(values) => Some(values.len()),
            TensorData::Other(_) | TensorData::External => count,
        };
        if count.is_none() || count != stored {
            return Err(WireError(format!("constant \"{name}\" of shape {dims:?} holds {stored:?} values")));
        }
        Ok((name, Tensor { dims, data }))
    }
}

/// `TensorProto.DataType.FLOAT`, `INT64` and `FLOAT16`.
pub(crate) const FLOAT: i64 = 1;
const INT64: i64 = 7;
const FLOAT16: i64 = 10;

/// Converts a 16-bit float (IEEE 754 binary16) to 32 bits, which is exact.
fn half(bits: u16) -> f32 {
    let sign = u32::from(bits & 0x8000) << 16;
    let (exponent, fraction) = (u32::from(bits >> 10 & 0x1f), u32::from(bits & 0x3ff));
    let magnitude = match exponent {
        0 => return f32::from_bits(sign | (fraction as f32 * 2.0_f32.powi(-24)).to_bits()),
        0x1f => 0xff << 23 | fraction << 13,
        _ => (exponent + 112) << 23 | fraction << 13,
    };
    f32::from_bits(sign | magnitude)
}

fn elements<const N: usize, T>(name: &str, raw: &[u8], convert: fn([u8; N]) -> T) -> Read<Vec<T>> {
    let (chunks, rest) = raw.as_chunks::<N>();
    if !rest.is_empty() {
        return Err(WireError(format!("constant \"{name}\": {} bytes are no multiple of {N}", raw.len())));
    }
    Ok(chunks.iter().map(|chunk| convert(*chunk)).collect())
}

impl<'a> ValueInfo<'a> {
    fn parse(bytes: &'a [u8]) -> Read<Self> {
        let mut info = ValueInfo::default();
        for field in Fields::new(bytes) {
            match field? {
                (1, name) => info.name = name.text()?,
                (2, kind) => {
                    // TypeProto.tensor_type (1) → TypeProto.Tensor.shape (2) → TensorShapeProto.dim (1)
                    for shape in children(kind.bytes()?, 1).flat_map(|kind| children(kind, 2)) {
                        for dim in children(shape, 1) {
                            info.dims.push(fixed_size(dim)?);
                        }
                    }
                }
                _ => {}
            }
        }
        Ok(info)
    }
}

/// Returns the sub-messages with field number `number`.
fn children(message: &[u8], number: u64) -> impl Iterator<Item = &[u8]> {
    Fields::new(message).filter_map(move |field| match field {
        Ok((found, Value::Bytes(bytes))) if found == number => Some(bytes),
        _ => None,
    })
}

fn fixed_size(dim: &[u8]) -> Read<Option<usize>> {
    for field in Fields::new(dim) {
        if let (1, value) = field? {
            return Ok(usize::try_from(value.int()?).ok());
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::half;

    #[test]
    fn floats_of_16_bits_are_read_as_what_they_are() {
        let cases =
            [(0x3c00, 1.0), (0xc000, -2.0), (0x7bff, 65504.0), (0x3555, 0.333_251_95), (0x0400, 6.103_515_6e-5)];
        for (bits, value) in cases {
            assert_eq!(half(bits), value, "{bits:#x}");
        }
        // The smallest value, the largest below the normal ones, both zeros.
        assert_eq!([half(0x0001), half(0x83ff)], [2.0_f32.powi(-24), -1023.0 * 2.0_f32.powi(-24)]);
        assert_eq!([half(0), half(0x8000)].map(f32::to_bits), [0, 1 << 31]);
        assert!(half(0x7c00) == f32::INFINITY && half(0xfc00) == f32::NEG_INFINITY && half(0x7e00).is_nan());
        // Positive values ascend with their bits.
        assert!((0..0x7c00).map(half).is_sorted());
    }
}
