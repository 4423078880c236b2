//! Operators that compute: each becomes a layer or is folded into the layer before it.

use super::lower::{Lowering, MAX_SIDE, Step};
use super::view::{MAX_PLANES, View};
use super::{Kind, Layer};
use crate::engine::onnx::Node;

impl<'m> Lowering<'m> {
    pub(super) fn conv(&mut self, node: &Node<'m>) -> Step<View> {
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
            (3, 2, 1) if depth == channels && input.planes == self.network.input => Kind::Dense,
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
        let (name, addend, scale) = (node.name.to_owned(), Vec::new(), self.scales.get(node.name).copied());
        let layer = Layer { name, kind, inputs, outputs, weights, bias, relu: false, addend, scale };
        self.network.layers.push(layer);
        Ok(view)
    }

    /// Returns the layer whose whole output is input 0 of `node` and has no other reader.
    fn producer(&mut self, node: &Node<'m>) -> Step<&mut Layer> {
        let value = node.inputs.first().copied().unwrap_or_default();
        let layer = self.producers.get(value).filter(|_| self.uses.get(value) == Some(&1));
        let layer = layer.and_then(|index| self.network.layers.get_mut(*index));
        layer.ok_or_else(|| "it must directly follow a convolution whose result nothing else reads".into())
    }

    pub(super) fn relu(&mut self, node: &Node<'m>) -> Step<View> {
        self.producer(node)?.relu = true;
        self.view(node, 0).cloned()
    }

    pub(super) fn batch_norm(&mut self, node: &Node<'m>) -> Step<View> {
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

    pub(super) fn max_pool(&mut self, node: &Node<'m>) -> Step<View> {
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

    pub(super) fn upsample(&mut self, node: &Node<'m>) -> Step<View> {
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
            scale: None,
        });
        Ok(View::image(outputs, (height, width)))
    }
}
