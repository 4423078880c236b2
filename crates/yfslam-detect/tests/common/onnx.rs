//! Writes a network as the bytes of an ONNX file.

use super::{Attribute, Constant, Net, Node};

fn varint(mut value: u64, out: &mut Vec<u8>) {
    while value > 0x7f {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

fn int(field: u64, value: i64, out: &mut Vec<u8>) {
    varint(field << 3, out);
    varint(value as u64, out);
}

fn bytes(field: u64, content: &[u8], out: &mut Vec<u8>) {
    varint(field << 3 | 2, out);
    varint(content.len() as u64, out);
    out.extend_from_slice(content);
}

fn message(field: u64, out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    let mut content = Vec::new();
    write(&mut content);
    bytes(field, &content, out);
}

fn attribute(name: &str, value: &Attribute, out: &mut Vec<u8>) {
    bytes(1, name.as_bytes(), out);
    match value {
        Attribute::Int(value) => int(3, *value, out),
        Attribute::Ints(values) => values.iter().for_each(|value| int(8, *value, out)),
        Attribute::Float(value) => {
            varint(2 << 3 | 5, out);
            out.extend_from_slice(&value.to_le_bytes());
        }
        Attribute::Text(text) => bytes(4, text.as_bytes(), out),
    }
}

fn node(node: &Node, out: &mut Vec<u8>) {
    node.inputs.iter().for_each(|input| bytes(1, input.as_bytes(), out));
    node.outputs.iter().for_each(|output| bytes(2, output.as_bytes(), out));
    bytes(3, node.name.as_bytes(), out);
    bytes(4, node.op.as_bytes(), out);
    for (name, value) in &node.attributes {
        message(5, out, |out| attribute(name, value, out));
    }
}

fn constant(name: &str, value: &Constant, out: &mut Vec<u8>) {
    let (dims, data_type, raw): (_, _, Vec<u8>) = match value {
        Constant::Floats(dims, values) => (dims, 1, values.iter().flat_map(|value| value.to_le_bytes()).collect()),
        Constant::Halves(dims, values) => (dims, 10, values.iter().flat_map(|value| value.to_le_bytes()).collect()),
        Constant::Ints(dims, values) => (dims, 7, values.iter().flat_map(|value| value.to_le_bytes()).collect()),
    };
    dims.iter().for_each(|dim| int(1, *dim as i64, out));
    int(2, data_type, out);
    bytes(8, name.as_bytes(), out);
    bytes(9, &raw, out);
}

fn value_info(name: &str, dims: &[usize], out: &mut Vec<u8>) {
    bytes(1, name.as_bytes(), out);
    message(2, out, |kind| {
        message(1, kind, |tensor| {
            int(1, 1, tensor);
            message(2, tensor, |shape| dims.iter().for_each(|dim| message(1, shape, |out| int(1, *dim as i64, out))));
        });
    });
}

impl Net {
    /// The bytes of the ONNX file; the structure comes first, the weights last.
    pub fn to_onnx(&self) -> Vec<u8> {
        let mut out = Vec::new();
        int(1, 8, &mut out);
        message(7, &mut out, |graph| {
            self.nodes.iter().for_each(|entry| message(1, graph, |out| node(entry, out)));
            message(11, graph, |out| value_info("image", &[1, 3, self.height, self.width], out));
            self.outputs.iter().for_each(|(name, dims)| message(12, graph, |out| value_info(name, dims, out)));
            self.constants.iter().for_each(|(name, value)| message(5, graph, |out| constant(name, value, out)));
        });
        message(8, &mut out, |opset| int(2, 13, opset));
        for (key, value) in &self.metadata {
            message(14, &mut out, |entry| {
                bytes(1, key.as_bytes(), entry);
                bytes(2, value.as_bytes(), entry);
            });
        }
        out
    }
}
