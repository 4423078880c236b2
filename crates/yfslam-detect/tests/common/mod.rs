//! A YOLO-FastestV2 network with random weights, generated as ONNX bytes and run by a naive executor.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "shared by test programs, of which each uses a part"
)]

mod onnx;
pub mod other;
mod reference;

use std::collections::BTreeMap;

/// Form of a graph, where several are possible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Batch norm folded, shuffle by 5-D reshape and gather.
    Folded,
    /// Batch norm as nodes, shuffle by slices with a step, sizes instead of scales.
    Unfolded,
    /// Channels shuffled, then split in half.
    Split,
}

/// One operator.
pub struct Node {
    pub name: String,
    pub op: &'static str,
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
    pub attributes: Vec<(&'static str, Attribute)>,
}

/// An operator's attribute.
pub enum Attribute {
    Int(i64),
    Ints(Vec<i64>),
    Float(f32),
    Text(&'static str),
}

/// A constant.
#[derive(Clone)]
pub enum Constant {
    Floats(Vec<usize>, Vec<f32>),
    /// Bits of floats of 16 bits.
    Halves(Vec<usize>, Vec<u16>),
    Ints(Vec<usize>, Vec<i64>),
}

/// A network that is being built.
pub struct Net {
    pub height: usize,
    pub width: usize,
    pub nodes: Vec<Node>,
    pub constants: BTreeMap<String, Constant>,
    pub outputs: Vec<(String, Vec<usize>)>,
    pub metadata: Vec<(&'static str, String)>,
    style: Style,
    random: u64,
}

/// Pseudo-random numbers (SplitMix64), uniform in [0, 1).
pub fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
}

/// Channels after the stem; the stages have 2, 4 and 8 times as many, the heads 3 times.
pub struct Size {
    pub height: usize,
    pub width: usize,
    pub channels: usize,
    pub classes: usize,
}

impl Net {
    /// Creates a network without nodes; its input is called `image`.
    pub fn empty(height: usize, width: usize) -> Self {
        let (nodes, constants, outputs, metadata) = Default::default();
        Net { height, width, nodes, constants, outputs, metadata, style: Style::Folded, random: 0 }
    }

    /// Creates the whole architecture.
    pub fn yolo(size: &Size, style: Style, seed: u64) -> Self {
        let &Size { height, width, channels, classes } = size;
        let mut net = Net { style, random: seed, ..Net::empty(height, width) };
        let stem = net.conv("image", (3, channels), 3, 2, 1);
        let stem = net.relu(&stem);
        let mut x = net.node(
            "MaxPool",
            &[&stem],
            "pool",
            vec![
                ("kernel_shape", Attribute::Ints(vec![3, 3])),
                ("strides", Attribute::Ints(vec![2, 2])),
                ("pads", Attribute::Ints(vec![1; 4])),
            ],
        );
        let (mut count, mut side) = (channels, (height / 4, width / 4));
        let mut stages = Vec::new();
        for (stage, repeats) in [4, 8, 4].into_iter().enumerate() {
            let half = channels << stage;
            side = (side.0 / 2, side.1 / 2);
            x = net.downsample(&x, count, half);
            count = 2 * half;
            for _ in 1..repeats {
                x = net.unit(&x, half, side);
            }
            stages.push(x.clone());
        }
        let heads = 3 * channels;
        let coarse = net.pointwise_relu(&stages[2], 8 * channels, heads);
        let (class_coarse, box_coarse) = (net.head(&coarse, heads), net.head(&coarse, heads));
        let up = net.upsample(&stages[2], 8 * channels, (side.0 * 2, side.1 * 2));
        let joined = net.concat(&[&up, &stages[1]]);
        let fine = net.pointwise_relu(&joined, 12 * channels, heads);
        let (class_fine, box_fine) = (net.head(&fine, heads), net.head(&fine, heads));
        for (scale, class, boxes, side) in
            [("fine", class_fine, box_fine, (side.0 * 2, side.1 * 2)), ("coarse", class_coarse, box_coarse, side)]
        {
            for (kind, from, filters) in [("reg", &boxes, 12), ("obj", &class, 3), ("cls", &class, classes)] {
                let output = net.conv(from, (heads, filters), 1, 1, 1);
                let name = format!("{kind}_{scale}");
                net.nodes.last_mut().unwrap().outputs = vec![name.clone()];
                assert!(!output.is_empty());
                net.outputs.push((name, vec![1, filters, side.0, side.1]));
            }
        }
        net
    }

    /// Truncates the weights to 11 significant bits; with `store`, also writes them as 16-bit floats, each with a cast to 32 bits.
    pub fn halve(&mut self, store: bool) {
        let mut stored = BTreeMap::new();
        for (name, constant) in &mut self.constants {
            let Constant::Floats(dims, values) = constant else { continue };
            // Values outside the range of 16 bits become 0.
            let kept = |value: f32| (6.2e-5..6.5e4).contains(&value.abs());
            let cut = |value: f32| if kept(value) { value.to_bits() & !0x1fff } else { 0 };
            let half = |bits: u32| {
                let magnitude = (bits & 0x7fff_ffff).saturating_sub(112 << 23) >> 13;
                (bits >> 16 & 0x8000 | magnitude) as u16
            };
            stored.insert(name.clone(), (dims.clone(), values.iter().map(|value| half(cut(*value))).collect()));
            values.iter_mut().for_each(|value| *value = f32::from_bits(cut(*value)));
        }
        if store {
            for (name, (dims, bits)) in stored {
                let half = format!("{name}_half");
                self.constants.remove(&name);
                self.constants.insert(half.clone(), Constant::Halves(dims, bits));
                let attributes = vec![("to", Attribute::Int(1))];
                let cast = Node {
                    name: format!("{name}_cast"),
                    op: "Cast",
                    inputs: vec![half],
                    outputs: vec![name],
                    attributes,
                };
                self.nodes.insert(0, cast);
            }
        }
    }

    fn weights(&mut self, dims: Vec<usize>, scale: f32, offset: f32) -> String {
        let name = format!("weight{}", self.constants.len());
        let count = dims.iter().product();
        let values = (0..count).map(|_| offset + scale * (2.0 * random(&mut self.random) - 1.0)).collect();
        self.constants.insert(name.clone(), Constant::Floats(dims, values));
        name
    }

    fn ints(&mut self, values: &[i64]) -> String {
        let name = format!("shape{}", self.constants.len());
        self.constants.insert(name.clone(), Constant::Ints(vec![values.len()], values.to_vec()));
        name
    }

    /// Appends a node with one output and returns that output's name.
    pub fn node(
        &mut self,
        op: &'static str,
        inputs: &[&str],
        what: &str,
        attributes: Vec<(&'static str, Attribute)>,
    ) -> String {
        let name = format!("{what}{}", self.nodes.len());
        let output = format!("{name}_out");
        let inputs = inputs.iter().map(ToString::to_string).collect();
        self.nodes.push(Node { name, op, inputs, outputs: vec![output.clone()], attributes });
        output
    }

    fn conv(&mut self, x: &str, (from, to): (usize, usize), kernel: usize, stride: i64, groups: usize) -> String {
        let fan_in = (from / groups * kernel * kernel) as f32;
        // Uniform weights of this scale keep the variance through convolution and ReLU.
        let weights = self.weights(vec![to, from / groups, kernel, kernel], (6.0 / fan_in).sqrt(), 0.0);
        let bias = self.weights(vec![to], 0.1, 0.0);
        let half = (kernel / 2) as i64;
        let x = self.node(
            "Conv",
            &[x, &weights, &bias],
            "conv",
            vec![
                ("kernel_shape", Attribute::Ints(vec![kernel as i64; 2])),
                ("strides", Attribute::Ints(vec![stride; 2])),
                ("pads", Attribute::Ints(vec![half; 4])),
                ("group", Attribute::Int(groups as i64)),
            ],
        );
        if self.style != Style::Unfolded || to < 4 {
            return x;
        }
        let parameters = [(0.2, 1.0), (0.1, 0.0), (0.1, 0.0), (0.3, 1.0)]
            .map(|(scale, offset)| self.weights(vec![to], scale, offset));
        let [gamma, beta, mean, variance] = parameters.each_ref().map(String::as_str);
        self.node(
            "BatchNormalization",
            &[&x, gamma, beta, mean, variance],
            "norm",
            vec![("epsilon", Attribute::Float(1e-5))],
        )
    }

    fn relu(&mut self, x: &str) -> String {
        self.node("Relu", &[x], "relu", Vec::new())
    }

    fn pointwise_relu(&mut self, x: &str, from: usize, to: usize) -> String {
        let x = self.conv(x, (from, to), 1, 1, 1);
        self.relu(&x)
    }

    fn concat(&mut self, parts: &[&str]) -> String {
        self.node("Concat", parts, "concat", vec![("axis", Attribute::Int(1))])
    }

    /// Adds the first unit of a stage: two branches, both of stride 2.
    fn downsample(&mut self, x: &str, from: usize, half: usize) -> String {
        let left = self.conv(x, (from, from), 3, 2, from);
        let left = self.pointwise_relu(&left, from, half);
        let right = self.pointwise_relu(x, from, half);
        let right = self.conv(&right, (half, half), 3, 2, half);
        let right = self.pointwise_relu(&right, half, half);
        self.concat(&[&left, &right])
    }

    /// Adds a further unit: even channels pass, odd ones are convolved.
    fn unit(&mut self, x: &str, half: usize, side: (usize, usize)) -> String {
        let (left, right) = self.shuffle(x, half, side);
        let right = self.pointwise_relu(&right, half, half);
        let right = self.conv(&right, (half, half), 3, 1, half);
        let right = self.pointwise_relu(&right, half, half);
        self.concat(&[&left, &right])
    }

    fn shuffle(&mut self, x: &str, half: usize, (height, width): (usize, usize)) -> (String, String) {
        let [channels, height, width] = [half, height, width].map(|value| value as i64);
        if self.style == Style::Unfolded {
            return [0, 1]
                .map(|start| {
                    let [start, end, axis, step] = [start, i64::MAX, 1, 2].map(|value| self.ints(&[value]));
                    self.node("Slice", &[x, &start, &end, &axis, &step], "slice", Vec::new())
                })
                .into();
        }
        let pairs = self.ints(&[channels, 2, height * width]);
        let pairs = self.node("Reshape", &[x, &pairs], "pairs", Vec::new());
        let halves = self.node("Transpose", &[&pairs], "turned", vec![("perm", Attribute::Ints(vec![1, 0, 2]))]);
        if self.style == Style::Split {
            let whole = self.ints(&[1, -1, height, width]);
            let whole = self.node("Reshape", &[&halves, &whole], "whole", Vec::new());
            let left = self.node("Split", &[&whole], "split", vec![("axis", Attribute::Int(1))]);
            let right = format!("{left}_right");
            self.nodes.last_mut().unwrap().outputs.push(right.clone());
            return (left, right);
        }
        let five = self.ints(&[2, -1, channels, height, width]);
        let five = self.node("Reshape", &[&halves, &five], "five", Vec::new());
        [0, 1]
            .map(|index| {
                let name = format!("index{index}");
                self.constants.insert(name.clone(), Constant::Ints(Vec::new(), vec![index]));
                self.node("Gather", &[&five, &name], "half", vec![("axis", Attribute::Int(0))])
            })
            .into()
    }

    fn upsample(&mut self, x: &str, channels: usize, (height, width): (usize, usize)) -> String {
        let by_size = self.style == Style::Unfolded;
        let (scales, sizes) = if by_size {
            (String::new(), self.ints(&[1, channels as i64, height as i64, width as i64]))
        } else {
            self.constants.insert("scales".into(), Constant::Floats(vec![4], vec![1.0, 1.0, 2.0, 2.0]));
            ("scales".into(), String::new())
        };
        let inputs: &[&str] = if by_size { &[x, "", &scales, &sizes] } else { &[x, "", &scales] };
        self.node(
            "Resize",
            inputs,
            "up",
            vec![
                ("mode", Attribute::Text("nearest")),
                ("coordinate_transformation_mode", Attribute::Text("asymmetric")),
                ("nearest_mode", Attribute::Text("floor")),
            ],
        )
    }

    /// Adds a head: twice depthwise 5×5, ReLU, pointwise.
    fn head(&mut self, x: &str, channels: usize) -> String {
        let mut x = x.to_owned();
        for _ in 0..2 {
            x = self.conv(&x, (channels, channels), 5, 1, channels);
            x = self.relu(&x);
            x = self.conv(&x, (channels, channels), 1, 1, 1);
        }
        x
    }
}
