//! Runs a network node by node in double precision, following the definitions of the ONNX operators literally.

use std::collections::BTreeMap;

use super::{Attribute, Constant, Net, Node};

#[derive(Clone)]
struct Tensor {
    dims: Vec<usize>,
    data: Vec<f64>,
}

impl Net {
    /// Returns the outputs for an input of `3 × height × width`.
    pub fn run(&self, image: &[f32]) -> Vec<Vec<f64>> {
        let values = self.values(image);
        self.outputs.iter().map(|(name, dims)| (&values[name], dims)).map(|(value, dims)| value.checked(dims)).collect()
    }

    /// Returns, for each 1×1 convolution, its name and the least and the largest value of its input.
    #[allow(dead_code, reason = "each test uses what it needs")]
    pub fn ranges<'a>(&'a self, image: &[f32]) -> Vec<(&'a str, f64, f64)> {
        let values = self.values(image);
        let pointwise = |node: &&Node| node.op == "Conv" && values[&node.inputs[1]].dims[2..] == [1, 1];
        let range = |node: &'a Node| {
            let Node { name, inputs, .. } = node;
            let data = &values[&inputs[0]].data;
            (name.as_str(), data.iter().copied().fold(0.0, f64::min), data.iter().copied().fold(0.0, f64::max))
        };
        self.nodes.iter().filter(pointwise).map(range).collect()
    }

    fn values(&self, image: &[f32]) -> BTreeMap<String, Tensor> {
        let mut values = BTreeMap::new();
        let image = image.iter().map(|value| f64::from(*value)).collect();
        values.insert("image".to_owned(), Tensor { dims: vec![1, 3, self.height, self.width], data: image });
        for (name, constant) in &self.constants {
            let (dims, data) = match constant {
                Constant::Floats(dims, data) => (dims, data.iter().map(|value| f64::from(*value)).collect()),
                Constant::Halves(..) => unreachable!("the reference computes networks in full precision"),
                Constant::Ints(dims, data) => (dims, data.iter().map(|value| *value as f64).collect()),
            };
            values.insert(name.clone(), Tensor { dims: dims.clone(), data });
        }
        for node in &self.nodes {
            let inputs: Vec<&Tensor> = node.inputs.iter().filter_map(|name| values.get(name)).collect();
            let results = node.run(&inputs);
            values.extend(node.outputs.iter().cloned().zip(results));
        }
        values
    }
}

impl Tensor {
    fn checked(&self, dims: &[usize]) -> Vec<f64> {
        assert_eq!(self.dims, dims);
        self.data.clone()
    }

    /// Builds a tensor whose elements are those of `self` at the positions that `source` returns.
    fn pick(&self, dims: Vec<usize>, source: impl Fn(&[usize]) -> Vec<usize>) -> Self {
        let mut data = Vec::new();
        for flat in 0..dims.iter().product() {
            let mut position = vec![0; dims.len()];
            let mut rest: usize = flat;
            for axis in (0..dims.len()).rev() {
                position[axis] = rest % dims[axis];
                rest /= dims[axis];
            }
            let index = source(&position).iter().zip(&self.dims).fold(0, |index, (at, dim)| index * dim + at);
            data.push(self.data[index]);
        }
        Self { dims, data }
    }

    /// Returns a pixel of plane `plane`; `None` outside.
    fn at(&self, plane: usize, y: isize, x: isize) -> Option<f64> {
        let (height, width) = (self.dims[2] as isize, self.dims[3] as isize);
        let inside = (0..height).contains(&y) && (0..width).contains(&x);
        inside.then(|| self.data[(plane as isize * height * width + y * width + x) as usize])
    }

    fn indices(&self) -> Vec<i64> {
        self.data.iter().map(|value| *value as i64).collect()
    }
}

impl Node {
    fn int(&self, wanted: &str, default: i64) -> i64 {
        let found = self.attributes.iter().find(|(name, _)| *name == wanted);
        if let Some((_, Attribute::Int(value))) = found { *value } else { default }
    }

    fn ints(&self, wanted: &str) -> Vec<i64> {
        let found = self.attributes.iter().find(|(name, _)| *name == wanted);
        if let Some((_, Attribute::Ints(values))) = found { values.clone() } else { Vec::new() }
    }

    fn run(&self, inputs: &[&Tensor]) -> Vec<Tensor> {
        let x = inputs[0];
        let axis = self.int("axis", 0) as usize;
        vec![match self.op {
            "Conv" => self.conv(x, inputs[1], inputs[2]),
            "BatchNormalization" => {
                let area: usize = x.dims[2..].iter().product();
                let normal = |(index, value): (usize, &f64)| {
                    let [gamma, beta, mean, variance] = [1, 2, 3, 4].map(|input| inputs[input].data[index / area]);
                    (value - mean) / (variance + 1e-5).sqrt() * gamma + beta
                };
                Tensor { dims: x.dims.clone(), data: x.data.iter().enumerate().map(normal).collect() }
            }
            "Relu" => Tensor { dims: x.dims.clone(), data: x.data.iter().map(|value| value.max(0.0)).collect() },
            "MaxPool" => {
                let window = |position: &[usize]| {
                    let (y, x0) = (2 * position[2] as isize - 1, 2 * position[3] as isize - 1);
                    let values = (0..9).filter_map(|tap| x.at(position[1], y + tap / 3, x0 + tap % 3));
                    values.fold(f64::NEG_INFINITY, f64::max)
                };
                each(vec![1, x.dims[1], x.dims[2].div_ceil(2), x.dims[3].div_ceil(2)], window)
            }
            "Resize" => x.pick(vec![1, x.dims[1], 2 * x.dims[2], 2 * x.dims[3]], |position| {
                vec![0, position[1], position[2] / 2, position[3] / 2]
            }),
            "Concat" => {
                let data = inputs.iter().flat_map(|input| input.data.clone()).collect();
                let channels = inputs.iter().map(|input| input.dims[1]).sum();
                Tensor { dims: vec![1, channels, x.dims[2], x.dims[3]], data }
            }
            "Reshape" => {
                let known: i64 = inputs[1].indices().iter().filter(|dim| **dim > 0).product();
                let dim = |dim: &i64| if *dim < 0 { x.data.len() / known as usize } else { *dim as usize };
                Tensor { dims: inputs[1].indices().iter().map(dim).collect(), data: x.data.clone() }
            }
            "Transpose" => {
                let perm: Vec<usize> = self.ints("perm").iter().map(|axis| *axis as usize).collect();
                x.pick(perm.iter().map(|axis| x.dims[*axis]).collect(), |position| {
                    let mut source = vec![0; perm.len()];
                    perm.iter().zip(position).for_each(|(axis, at)| source[*axis] = *at);
                    source
                })
            }
            "Gather" => {
                let index = inputs[1].indices()[0] as usize;
                x.pick(x.dims[1..].to_vec(), |position| [&[index], position].concat())
            }
            "Slice" => {
                let start = inputs[1].indices()[0] as usize;
                let count = (x.dims[1] - start).div_ceil(2);
                x.pick(vec![1, count, x.dims[2], x.dims[3]], |position| {
                    vec![0, start + 2 * position[1], position[2], position[3]]
                })
            }
            "Split" => {
                let half = x.dims[axis] / 2;
                let part = |offset: usize| {
                    x.pick(vec![1, half, x.dims[2], x.dims[3]], |position| {
                        vec![0, offset + position[1], position[2], position[3]]
                    })
                };
                return vec![part(0), part(half)];
            }
            other => unreachable!("{other}"),
        }]
    }

    fn conv(&self, x: &Tensor, weights: &Tensor, bias: &Tensor) -> Tensor {
        let [filters, depth, kernel, _] = weights.dims[..] else { unreachable!() };
        let (stride, pad) = (self.ints("strides")[0] as usize, self.ints("pads")[0] as isize);
        let per_group = filters / self.int("group", 1) as usize;
        let sum = |position: &[usize]| {
            let (filter, y, x0) =
                (position[1], (position[2] * stride) as isize - pad, (position[3] * stride) as isize - pad);
            let mut sum = bias.data[filter];
            for k in 0..depth {
                for tap in 0..kernel * kernel {
                    let (dy, dx) = ((tap / kernel) as isize, (tap % kernel) as isize);
                    let value = x.at(filter / per_group * depth + k, y + dy, x0 + dx).unwrap_or(0.0);
                    sum += value * weights.data[(filter * depth + k) * kernel * kernel + tap];
                }
            }
            sum
        };
        each(vec![1, filters, x.dims[2].div_ceil(stride), x.dims[3].div_ceil(stride)], sum)
    }
}

/// Builds a tensor whose elements are computed from their position.
fn each(dims: Vec<usize>, value: impl Fn(&[usize]) -> f64) -> Tensor {
    let mut data = Vec::new();
    for channel in 0..dims[1] {
        for y in 0..dims[2] {
            for x in 0..dims[3] {
                data.push(value(&[0, channel, y, x]));
            }
        }
    }
    Tensor { dims, data }
}
