//! Lowers ONNX nodes to fused layers; nodes that are not part of YOLO-FastestV2 are refused by name.

use std::collections::BTreeMap;

use super::view::View;
use super::{Kind, Network, fold};
use crate::engine::kernels::integers::Scale;
use crate::engine::onnx::{FLOAT, Model, Node, Tensor, TensorData};
use crate::error::ModelError;

/// Largest side of the network input and of any plane, px.
pub(super) const MAX_SIDE: usize = 2048;

/// Lowers the graph of `model` and simplifies it; `name` stands for the file in error messages.
pub(crate) fn lower(name: &str, model: &Model) -> Result<Network, ModelError> {
    let mut lowering = Lowering::new(name, model)?;
    for node in &model.nodes {
        lowering.node(node).map_err(|what| {
            let place = if node.name.is_empty() { node.outputs.first().copied().unwrap_or("?") } else { node.name };
            ModelError::Unsupported { model: name.into(), node: place.into(), op: node.op.into(), what }
        })?;
    }
    let mut network = lowering.finish()?;
    fold::fold_linear_pointwise(&mut network);
    fold::defer_upsampling(&mut network);
    Ok(network)
}

pub(super) struct Lowering<'m> {
    name: &'m str,
    model: &'m Model<'m>,
    constants: BTreeMap<&'m str, Tensor>,
    views: BTreeMap<&'m str, View>,
    /// Scale of the input of each convolution in bytes, by the name of the node.
    pub(super) scales: BTreeMap<&'m str, Scale>,
    /// Number of readers of each value.
    pub(super) uses: BTreeMap<&'m str, usize>,
    /// The layer of each value, for values that are the whole result of a layer.
    pub(super) producers: BTreeMap<&'m str, usize>,
    pub(super) network: Network,
}

pub(super) type Step<T> = Result<T, String>;

impl<'m> Lowering<'m> {
    fn new(name: &'m str, model: &'m Model<'m>) -> Result<Self, ModelError> {
        let mismatch = |what: String| ModelError::Mismatch { model: name.into(), what };
        let inputs: Vec<_> = model.inputs.iter().filter(|info| !model.initializers.contains_key(info.name)).collect();
        let [input] = inputs.as_slice() else {
            return Err(mismatch(format!("the graph has {} inputs; one image is expected", inputs.len())));
        };
        let (height, width) = match input.dims.as_slice() {
            [None | Some(1), Some(3), Some(height), Some(width)] => (*height, *width),
            other => {
                return Err(mismatch(format!(
                    "the input has the shape {other:?}; [1, 3, height, width] with fixed numbers is expected"
                )));
            }
        };
        if [height, width].iter().any(|side| !(32..=MAX_SIDE).contains(side) || side % 32 != 0) {
            return Err(mismatch(format!(
                "the input is {width}×{height} px; sides must be multiples of 32 from 32 to {MAX_SIDE}"
            )));
        }
        let mut uses = BTreeMap::new();
        let read = model.nodes.iter().flat_map(|node| node.inputs.iter().copied());
        for value in read.chain(model.outputs.iter().map(|info| info.name)) {
            *uses.entry(value).or_insert(0) += 1;
        }
        let mut network = Network::default();
        network.input = network.new_planes(3, (height, width));
        let view = View::image(network.input.clone(), (height, width));
        let views = BTreeMap::from([(input.name, view)]);
        let scales = scales(model).map_err(mismatch)?;
        let (constants, producers) = (BTreeMap::new(), BTreeMap::new());
        Ok(Self { name, model, constants, views, scales, uses, producers, network })
    }

    fn finish(mut self) -> Result<Network, ModelError> {
        let mismatch = |what: String| ModelError::Mismatch { model: self.name.into(), what };
        for info in &self.model.outputs {
            let view = self.views.get(info.name).filter(|view| view.is_image());
            let view = view.ok_or_else(|| mismatch(format!("output \"{}\" is no raw feature map", info.name)))?;
            self.network.outputs.push((info.name.into(), view.planes.clone()));
        }
        if let Some(layer) = self.network.layers.iter().find(|layer| layer.kind == Kind::Dense) {
            return Err(ModelError::Unsupported {
                model: self.name.into(),
                node: layer.name.clone(),
                op: "Conv".into(),
                what: "a 3×3 convolution over all channels must be followed by ReLU and max pool 3/2/1".into(),
            });
        }
        Ok(self.network)
    }

    fn node(&mut self, node: &'m Node<'m>) -> Step<()> {
        if !matches!(node.domain, "" | "ai.onnx") {
            return Err(format!("operators of the domain \"{}\" are not supported", node.domain));
        }
        let views = match node.op {
            "Constant" => return self.constant(node),
            "Cast" => return self.cast(node),
            "Identity" => vec![self.view(node, 0)?.clone()],
            "Conv" => vec![self.conv(node)?],
            "BatchNormalization" => vec![self.batch_norm(node)?],
            "Relu" => vec![self.relu(node)?],
            "MaxPool" => vec![self.max_pool(node)?],
            "Resize" | "Upsample" => vec![self.upsample(node)?],
            "Concat" => {
                let views: Step<Vec<&View>> = (0..node.inputs.len()).map(|index| self.view(node, index)).collect();
                vec![View::concat(&views?, node.int("axis", 1))?]
            }
            "Reshape" => vec![self.view(node, 0)?.reshape(&self.ints(node, 1)?)?],
            "Transpose" => vec![self.view(node, 0)?.transpose(node.ints("perm"))?],
            "Gather" => vec![self.gather(node)?],
            "Slice" => vec![self.slice(node)?],
            "Split" => self.split(node)?,
            "Squeeze" => {
                let axes = if node.inputs.len() > 1 { self.ints(node, 1)? } else { node.ints("axes").to_vec() };
                vec![self.view(node, 0)?.squeeze(&axes)?]
            }
            _ => return Err("this operator is not supported".into()),
        };
        if views.len() < node.outputs.len() {
            return Err(format!("{} outputs are asked for, {} are computed", node.outputs.len(), views.len()));
        }
        let producer = match node.op {
            "Conv" => self.network.layers.len().checked_sub(1),
            "BatchNormalization" | "Relu" => self.producers.get(node.inputs[0]).copied(),
            _ => None,
        };
        self.producers.extend(node.outputs.first().copied().zip(producer));
        self.views.extend(node.outputs.iter().copied().zip(views));
        Ok(())
    }

    pub(super) fn view(&self, node: &Node, index: usize) -> Step<&View> {
        let name = node.inputs.get(index).copied().unwrap_or_default();
        self.views.get(name).ok_or_else(|| format!("input \"{name}\" is not the result of an earlier layer"))
    }

    pub(super) fn tensor(&self, node: &Node<'m>, index: usize) -> Step<(&'m str, &Tensor)> {
        let name = node.inputs.get(index).copied().unwrap_or_default();
        let tensor = self.model.initializers.get(name).or_else(|| self.constants.get(name));
        Ok((name, tensor.ok_or_else(|| format!("input {index} (\"{name}\") must be a constant"))?))
    }

    pub(super) fn ints(&self, node: &Node<'m>, index: usize) -> Step<Vec<i64>> {
        match self.tensor(node, index)? {
            (_, Tensor { data: TensorData::Ints(values), .. }) => Ok(values.clone()),
            (name, _) => Err(format!("constant \"{name}\" must hold 64-bit integers")),
        }
    }

    /// Returns a float constant with finite values and as many dimensions as `dims`.
    pub(super) fn floats(&self, node: &Node<'m>, index: usize) -> Step<(&[usize], &[f32])> {
        let (name, tensor) = self.tensor(node, index)?;
        match &tensor.data {
            TensorData::Floats(values) if values.iter().all(|value| value.is_finite()) => Ok((&tensor.dims, values)),
            TensorData::Floats(_) => {
                Err(format!("constant \"{name}\" has values that are not finite; the training diverged"))
            }
            TensorData::External => {
                Err(format!("constant \"{name}\" lies in another file; export everything into one"))
            }
            TensorData::Ints(_) => Err(format!("constant \"{name}\" must be float32, not int64")),
            TensorData::Other(data_type) => Err(format!(
                "constant \"{name}\" must be float32 or float16, not ONNX data type {data_type}; export in one of these"
            )),
        }
    }

    fn constant(&mut self, node: &'m Node<'m>) -> Step<()> {
        let attribute = node.attributes.values().next().ok_or("it has no value")?;
        let scalar = |data| Tensor { dims: Vec::new(), data };
        let tensor = match attribute {
            attribute if attribute.tensor.is_some() => attribute.tensor.clone().unwrap_or_default(),
            attribute if attribute.int.is_some() => scalar(TensorData::Ints(attribute.int.into_iter().collect())),
            attribute if attribute.float.is_some() => scalar(TensorData::Floats(attribute.float.into_iter().collect())),
            attribute if attribute.floats.is_empty() => {
                Tensor { dims: vec![attribute.ints.len()], data: TensorData::Ints(attribute.ints.clone()) }
            }
            attribute => {
                Tensor { dims: vec![attribute.floats.len()], data: TensorData::Floats(attribute.floats.clone()) }
            }
        };
        self.constants.extend(node.outputs.first().map(|output| (*output, tensor)));
        Ok(())
    }

    /// Passes on a constant that is stored with fewer bits; floats were widened when they were read.
    fn cast(&mut self, node: &'m Node<'m>) -> Step<()> {
        if node.int("to", 0) != FLOAT {
            return Err("only constants can change their type, to float32".into());
        }
        self.floats(node, 0)?;
        let tensor = self.tensor(node, 0)?.1.clone();
        self.constants.extend(node.outputs.first().map(|output| (*output, tensor)));
        Ok(())
    }
}

/// Parses the scales in the metadata of a model: on each line the name of a convolution, and the step and the zero of its input.
fn scales<'m>(model: &Model<'m>) -> Step<BTreeMap<&'m str, Scale>> {
    let scale = |line: &'m str| {
        let mut words = line.rsplitn(3, ' ');
        let zero = words.next()?.parse().ok()?;
        let step = words.next()?.parse().ok().filter(|step: &f32| step.is_finite() && *step > 0.0)?;
        Some((words.next()?, Scale { step, zero }))
    };
    let lines = model.metadata.get("scales").map_or("", |text| text.trim()).lines();
    lines.map(|line| scale(line).ok_or_else(|| format!("cannot read the scale \"{line}\""))).collect()
}

impl Node<'_> {
    pub(super) fn int(&self, name: &str, default: i64) -> i64 {
        self.attributes.get(name).and_then(|attribute| attribute.int).unwrap_or(default)
    }

    pub(super) fn ints(&self, name: &str) -> &[i64] {
        self.attributes.get(name).map_or(&[], |attribute| &attribute.ints)
    }

    pub(super) fn text(&self, name: &str, default: &'static str) -> &str {
        self.attributes.get(name).and_then(|attribute| std::str::from_utf8(attribute.text).ok()).unwrap_or(default)
    }
}
