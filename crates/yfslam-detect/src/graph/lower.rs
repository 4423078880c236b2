//! ONNX nodes in, fused layers out; whatever is not part of YOLO-FastestV2 is refused by name.

use std::collections::BTreeMap;

use super::view::{MAX_PLANES, View};
use super::{Kind, Layer, Network, fold};
use crate::ModelError;
use crate::onnx::{Model, Node, Tensor, TensorData};

/// Largest side of the network input, px.
const MAX_SIDE: usize = 2048;

/// Lowers the graph of `model` and folds what can be folded; `name` is what errors call it.
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

struct Lowering<'m> {
    name: &'m str,
    model: &'m Model<'m>,
    constants: BTreeMap<&'m str, Tensor>,
    views: BTreeMap<&'m str, View>,
    /// How often each value is read.
    uses: BTreeMap<&'m str, usize>,
    /// The layer that each value comes from, for values that are a layer's whole result.
    producers: BTreeMap<&'m str, usize>,
    network: Network,
}

type Step<T> = Result<T, String>;

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
        Ok(Self { name, model, constants: BTreeMap::new(), views, uses, producers: BTreeMap::new(), network })
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

    fn view(&self, node: &Node, index: usize) -> Step<&View> {
        let name = node.inputs.get(index).copied().unwrap_or_default();
        self.views.get(name).ok_or_else(|| format!("input \"{name}\" is not the result of an earlier layer"))
    }

    fn tensor(&self, node: &Node<'m>, index: usize) -> Step<(&'m str, &Tensor)> {
        let name = node.inputs.get(index).copied().unwrap_or_default();
        let tensor = self.model.initializers.get(name).or_else(|| self.constants.get(name));
        Ok((name, tensor.ok_or_else(|| format!("input {index} (\"{name}\") must be a constant"))?))
    }

    fn ints(&self, node: &Node<'m>, index: usize) -> Step<Vec<i64>> {
        match self.tensor(node, index)? {
            (_, Tensor { data: TensorData::Ints(values), .. }) => Ok(values.clone()),
            (name, _) => Err(format!("constant \"{name}\" must hold 64-bit integers")),
        }
    }

    /// A float constant with finite values and `dims`' number of dimensions.
    fn floats(&self, node: &Node<'m>, index: usize) -> Step<(&[usize], &[f32])> {
        let (name, tensor) = self.tensor(node, index)?;
        match &tensor.data {
            TensorData::Floats(values) if values.iter().all(|value| value.is_finite()) => Ok((&tensor.dims, values)),
            TensorData::Floats(_) => {
                Err(format!("constant \"{name}\" holds values that are not finite; the training diverged"))
            }
            TensorData::External => {
                Err(format!("constant \"{name}\" lies in another file; export everything into one"))
            }
            TensorData::Ints(_) => Err(format!("constant \"{name}\" must be float32, not int64")),
            TensorData::Other(data_type) => Err(format!(
                "constant \"{name}\" must be float32, not ONNX data type {data_type}; export in full precision"
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

    fn conv(&mut self, node: &Node<'m>) -> Step<View> {
        let input = self.view(node, 0)?;
        let (dims, weights) = self.floats(node, 1)?;
        let [filters, depth, kernel, kernel_w] = *dims else {
            return Err(format!("weights of shape {dims:?} are not two-dimensional filters"));
        };
        let bias = if node.inputs.len() > 2 { self.floats(node, 2)?.1.to_vec() } else { vec![0.0; filters] };
        let groups = node.int("group", 1);
        let channels = input.planes.len();
        let stride = node.ints("strides").first().copied().unwrap_or(1);
        let half = (kernel / 2) as i64;
        let all = |name: &str, wanted: i64, default: i64| {
            let values = node.ints(name);
            values.iter().all(|value| *value == wanted) && (!values.is_empty() || default == wanted)
        };
        let plain = all("pads", half, 0) && all("dilations", 1, 1) && all("strides", stride, 1);
        let kind = match (kernel, stride, groups) {
            (1, 1, 1) if depth == channels => Kind::Pointwise,
            (3, 2, 1) if depth == channels && channels == 3 => Kind::Dense,
            (3 | 5, 1 | 2, groups) if depth == 1 && groups == channels as i64 && filters == channels => {
                Kind::Depthwise { kernel, stride: stride as usize }
            }
            _ => {
                return Err(format!(
                    "a {kernel}×{kernel_w} convolution of stride {stride} with {groups} groups, {channels} channels in and \
                     {filters} out is not part of the architecture"
                ));
            }
        };
        let auto_pad = node.text("auto_pad", "NOTSET");
        if !plain || kernel != kernel_w || auto_pad != "NOTSET" || !input.is_image() {
            return Err(format!("padding must be {half} on all sides, dilation 1, and the input one image"));
        }
        if bias.len() != filters || filters == 0 || filters > MAX_PLANES {
            return Err(format!("{filters} filters with {} biases", bias.len()));
        }
        let (inputs, weights) = (input.planes.clone(), weights.to_vec());
        let size = (input.size.0.div_ceil(stride as usize), input.size.1.div_ceil(stride as usize));
        let outputs = self.network.new_planes(filters, size);
        let view = View::image(outputs.clone(), size);
        let name = node.name.to_owned();
        self.network.layers.push(Layer { name, kind, inputs, outputs, weights, bias, relu: false, addend: Vec::new() });
        Ok(view)
    }

    /// The layer whose whole output is input 0 of `node` and that nothing else reads.
    fn producer(&mut self, node: &Node<'m>) -> Step<&mut Layer> {
        let value = node.inputs.first().copied().unwrap_or_default();
        let layer = self.producers.get(value).filter(|_| self.uses.get(value) == Some(&1));
        let layer = layer.and_then(|index| self.network.layers.get_mut(*index));
        layer.ok_or_else(|| "it must directly follow a convolution whose result nothing else reads".into())
    }

    fn relu(&mut self, node: &Node<'m>) -> Step<View> {
        self.producer(node)?.relu = true;
        self.view(node, 0).cloned()
    }

    fn batch_norm(&mut self, node: &Node<'m>) -> Step<View> {
        let epsilon = f64::from(node.attributes.get("epsilon").and_then(|epsilon| epsilon.float).unwrap_or(1e-5));
        let parameters: Step<Vec<Vec<f32>>> =
            (1..5).map(|index| self.floats(node, index).map(|(_, values)| values.to_vec())).collect();
        let parameters = parameters?;
        let layer = self.producer(node)?;
        if layer.relu || parameters.iter().any(|values| values.len() != layer.outputs.len()) {
            return Err("it must directly follow a convolution and have one parameter per channel".into());
        }
        let taps = layer.weights.len() / layer.outputs.len();
        for (channel, weights) in layer.weights.chunks_exact_mut(taps).enumerate() {
            let [gamma, beta, mean, variance] = [0, 1, 2, 3].map(|index| f64::from(parameters[index][channel]));
            let scale = gamma / (variance + epsilon).sqrt();
            weights.iter_mut().for_each(|weight| *weight = (f64::from(*weight) * scale) as f32);
            layer.bias[channel] = ((f64::from(layer.bias[channel]) - mean) * scale + beta) as f32;
            if !scale.is_finite() {
                return Err(format!("channel {channel} has the variance {variance}"));
            }
        }
        self.view(node, 0).cloned()
    }

    fn max_pool(&mut self, node: &Node<'m>) -> Step<View> {
        let exact = |name: &str, wanted: i64, count: usize| node.ints(name) == vec![wanted; count];
        let dilated = !node.ints("dilations").iter().all(|value| *value == 1);
        let windows = exact("kernel_shape", 3, 2) && exact("strides", 2, 2) && exact("pads", 1, 4);
        if !windows || dilated || node.int("ceil_mode", 0) != 0 || node.text("auto_pad", "NOTSET") != "NOTSET" {
            return Err("only windows of 3, stride 2, padding 1 are supported".into());
        }
        let (height, width) = self.view(node, 0)?.size;
        let size = (height.div_ceil(2), width.div_ceil(2));
        let layer = self.producer(node)?;
        if layer.kind != Kind::Dense || !layer.relu {
            return Err("it must follow the first 3×3 convolution and its ReLU".into());
        }
        layer.kind = Kind::Stem;
        let outputs = layer.outputs.clone();
        outputs.iter().for_each(|plane| self.network.planes[*plane] = size);
        Ok(View::image(outputs, size))
    }

    fn upsample(&mut self, node: &Node<'m>) -> Step<View> {
        let view = self.view(node, 0)?.clone();
        let (height, width) = (view.size.0 * 2, view.size.1 * 2);
        let given = |index: usize| node.inputs.get(index).is_some_and(|name| !name.is_empty());
        let twice = if given(3) {
            self.ints(node, 3)?[..] == [1, view.planes.len() as i64, height as i64, width as i64]
        } else {
            self.floats(node, if node.inputs.len() > 2 { 2 } else { 1 })?.1 == [1.0, 1.0, 2.0, 2.0]
        };
        let old = node.op == "Upsample" || node.inputs.len() == 2;
        let coordinates = node.text("coordinate_transformation_mode", if old { "asymmetric" } else { "half_pixel" });
        let rounding = node.text("nearest_mode", if old { "floor" } else { "round_prefer_floor" });
        let plain = match coordinates {
            "asymmetric" => matches!(rounding, "floor" | "round_prefer_floor"),
            "half_pixel" | "pytorch_half_pixel" => matches!(rounding, "round_prefer_floor" | "round_prefer_ceil"),
            _ => false,
        };
        if !twice || !plain || node.text("mode", "nearest") != "nearest" || !view.is_image() {
            return Err("only nearest-neighbour upsampling of height and width by 2 is supported".into());
        }
        if height.max(width) > MAX_SIDE {
            return Err(format!("the result is {width}×{height} px; at most {MAX_SIDE} are supported"));
        }
        let outputs = self.network.new_planes(view.planes.len(), (height, width));
        self.network.layers.push(Layer {
            name: node.name.into(),
            kind: Kind::Upsample,
            inputs: view.planes,
            outputs: outputs.clone(),
            weights: Vec::new(),
            bias: Vec::new(),
            relu: false,
            addend: Vec::new(),
        });
        Ok(View::image(outputs, (height, width)))
    }

    fn gather(&self, node: &Node<'m>) -> Step<View> {
        let axis = node.int("axis", 0);
        let indices = self.ints(node, 1)?;
        let picked = self.view(node, 0)?.select(axis, &indices)?;
        if self.tensor(node, 1)?.1.dims.is_empty() { picked.squeeze(&[axis]) } else { Ok(picked) }
    }

    fn slice(&self, node: &Node<'m>) -> Step<View> {
        let view = self.view(node, 0)?;
        let (starts, ends, axes) = (self.ints(node, 1)?, self.ints(node, 2)?, self.ints(node, 3)?);
        let steps = if node.inputs.len() > 4 { self.ints(node, 4)? } else { vec![1] };
        let ([start], [end], [axis], [step]) = (&starts[..], &ends[..], &axes[..], &steps[..]) else {
            return Err("only slices along one axis are supported".into());
        };
        let step = usize::try_from(*step).ok().filter(|step| *step > 0).ok_or("its step must be positive")?;
        let position = if *axis < 0 { axis + view.dims.len() as i64 } else { *axis };
        let length = usize::try_from(position).ok().and_then(|axis| view.dims.get(axis)).copied().unwrap_or(0) as i64;
        let absolute = |index: i64| if index < 0 { index.saturating_add(length) } else { index }.clamp(0, length);
        view.select(*axis, &(absolute(*start)..absolute(*end)).step_by(step).collect::<Vec<_>>())
    }

    fn split(&self, node: &Node<'m>) -> Step<Vec<View>> {
        let view = self.view(node, 0)?;
        let axis = node.int("axis", 0);
        let position = if axis < 0 { axis + view.dims.len() as i64 } else { axis };
        let length = usize::try_from(position).ok().and_then(|axis| view.dims.get(axis)).copied().unwrap_or(0) as i64;
        let parts = node.outputs.len() as i64;
        let sizes = match (node.inputs.len(), node.ints("split")) {
            (2.., _) => self.ints(node, 1)?,
            (_, []) => vec![length / parts.max(1); node.outputs.len()],
            (_, sizes) => sizes.to_vec(),
        };
        let fits = sizes.iter().try_fold(0_i64, |sum, size| sum.checked_add(*size)) == Some(length);
        if !fits || sizes.iter().any(|size| *size < 0) {
            return Err(format!("axis {axis} of {:?} cannot be split into {sizes:?}", view.dims));
        }
        let mut start = 0;
        let part = |size: &i64| {
            start += size;
            view.select(axis, &(start - size..start).collect::<Vec<_>>())
        };
        sizes.iter().map(part).collect()
    }
}

impl Node<'_> {
    fn int(&self, name: &str, default: i64) -> i64 {
        self.attributes.get(name).and_then(|attribute| attribute.int).unwrap_or(default)
    }

    fn ints(&self, name: &str) -> &[i64] {
        self.attributes.get(name).map_or(&[], |attribute| &attribute.ints)
    }

    fn text(&self, name: &str, default: &'static str) -> &str {
        self.attributes.get(name).and_then(|attribute| std::str::from_utf8(attribute.text).ok()).unwrap_or(default)
    }
}
