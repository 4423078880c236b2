//! Converts an ONNX graph to a short list of fused layers over planes.
//!
//! A *plane* is one channel of one activation, `height × width` floats. A layer reads any list of planes and writes new ones, so
//! that concatenation, channel split and channel shuffle are list operations at load time and cost nothing per frame.

mod channels;
mod compute;
mod fold;
mod lower;
mod view;

pub(crate) use lower::lower;

use crate::engine::kernels::integers::Scale;

/// Index into [`Network::planes`].
pub(crate) type Plane = usize;

/// The network after lowering, with all sizes known and without memory.
#[derive(Debug, Default)]
pub(crate) struct Network {
    /// Height and width of every plane, px.
    pub(crate) planes: Vec<(usize, usize)>,
    /// In order of execution.
    pub(crate) layers: Vec<Layer>,
    /// Planes of the network input.
    pub(crate) input: Vec<Plane>,
    /// Name and planes of each output, in the order of the file.
    pub(crate) outputs: Vec<(String, Vec<Plane>)>,
}

/// One step of the forward pass.
#[derive(Debug)]
pub(crate) struct Layer {
    /// Name of its node in the graph.
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) inputs: Vec<Plane>,
    pub(crate) outputs: Vec<Plane>,
    /// `outputs × (inputs · taps)`, row-major; empty for [`Kind::Upsample`].
    pub(crate) weights: Vec<f32>,
    /// One per output; empty for [`Kind::Upsample`].
    pub(crate) bias: Vec<f32>,
    /// Whether negative results become 0.
    pub(crate) relu: bool,
    /// Planes added to the outputs before ReLU, one per output; mostly empty.
    pub(crate) addend: Vec<Plane>,
    /// Scale of the inputs in bytes, if the model file has one.
    pub(crate) scale: Option<Scale>,
}

/// Operation of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Convolution 3×3, stride 2, padding 1, over all inputs, before it is joined with its pool.
    Dense,
    /// [`Kind::Dense`] with ReLU, then max pool 3×3, stride 2, padding 1.
    Stem,
    /// Convolution 1×1.
    Pointwise,
    /// One square filter per plane, padding `kernel / 2`.
    Depthwise { kernel: usize, stride: usize },
    /// Nearest ×2.
    Upsample,
}

impl Network {
    /// Adds planes of equal size.
    fn new_planes(&mut self, count: usize, size: (usize, usize)) -> Vec<Plane> {
        let first = self.planes.len();
        self.planes.resize(first + count, size);
        (first..first + count).collect()
    }

    /// Returns the layers that read plane `plane`.
    fn readers(&self, plane: Plane) -> impl Iterator<Item = usize> {
        let reads = move |layer: &Layer| layer.inputs.contains(&plane) || layer.addend.contains(&plane);
        self.layers.iter().enumerate().filter(move |(_, layer)| reads(layer)).map(|(index, _)| index)
    }

    /// Returns whether plane `plane` is an output of the network.
    fn is_output(&self, plane: Plane) -> bool {
        self.outputs.iter().any(|(_, planes)| planes.contains(&plane))
    }
}
