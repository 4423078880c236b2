//! The network placed in memory: a list of steps with all offsets fixed. Nothing is allocated when it runs.

use fearless_simd::Level;

use crate::ModelError;
use crate::graph::{Kind, Layer, Network};
use crate::kernels::matmul::{self, Matrix, Rows, WIDEST};
use crate::kernels::{depthwise, stem, upsample};
use crate::places::Places;

/// Largest working memory, floats (1 GiB); the real network needs about 1 % of it.
const MAX_MEMORY: usize = 1 << 28;

/// A network ready to run.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) level: Level,
    memory: Vec<f32>,
    /// Where memory starts, on a cache line; all offsets count from here.
    base: usize,
    steps: Vec<Step>,
    input: Vec<usize>,
    /// Height and width of the input, px.
    pub(crate) input_size: (usize, usize),
    /// In the order of the model file.
    pub(crate) outputs: Vec<Map>,
}

/// One output of the network.
#[derive(Debug)]
pub(crate) struct Map {
    pub(crate) name: String,
    /// Height and width.
    pub(crate) size: (usize, usize),
    pub(crate) planes: Vec<usize>,
}

#[derive(Debug)]
struct Step {
    operation: Operation,
    inputs: Vec<usize>,
    outputs: Vec<usize>,
    scratch: usize,
}

#[derive(Debug)]
enum Operation {
    Stem { geometry: stem::Geometry, matrix: Matrix },
    Pointwise { matrix: Matrix, addend: Vec<usize>, length: usize },
    Depthwise { geometry: depthwise::Geometry, weights: Vec<f32>, bias: Vec<f32>, relu: bool },
    Upsample { size: (usize, usize) },
}

impl Plan {
    /// Places `network`; `name` is what errors call it.
    pub(crate) fn new(name: &str, network: Network, level: Level) -> Result<Self, ModelError> {
        let mut places = Places::new(&network);
        let input = places.planes(&network.input, 0, 0);
        let steps =
            network.layers.iter().enumerate().map(|(time, layer)| step(&network, layer, time, &mut places)).collect();
        if places.end() > MAX_MEMORY {
            let what =
                format!("the network needs {} MiB of working memory; it is no small detector", places.end() >> 18);
            return Err(ModelError::Mismatch { model: name.into(), what });
        }
        let map = |(name, planes): &(String, Vec<usize>)| Map {
            name: name.clone(),
            size: network.planes[planes[0]],
            planes: places.offsets(planes),
        };
        // Vectors may read past the end of the last plane.
        let memory = vec![0.0; places.end() + 6 * WIDEST];
        let base = memory.as_ptr().align_offset(64).min(WIDEST);
        let outputs = network.outputs.iter().map(map).collect();
        Ok(Self { level, memory, base, steps, input, input_size: network.planes[network.input[0]], outputs })
    }

    /// The planes of the input, each `height · width` floats, to be filled before [`Plan::run`].
    pub(crate) fn input_mut(&mut self) -> [&mut [f32]; 3] {
        let length = self.input_size.0 * self.input_size.1;
        let ranges = [0, 1, 2].map(|plane| self.base + self.input[plane]..self.base + self.input[plane] + length);
        self.memory.get_disjoint_mut(ranges).unwrap_or_default()
    }

    /// One plane of an output.
    pub(crate) fn plane(&self, map: &Map, plane: usize) -> &[f32] {
        &self.memory[self.base + map.planes[plane]..][..map.size.0 * map.size.1]
    }

    /// The forward pass.
    pub(crate) fn run(&mut self) {
        let memory = &mut self.memory[self.base..];
        for Step { operation, inputs, outputs, scratch } in &self.steps {
            match operation {
                Operation::Stem { geometry, matrix } => {
                    let planes = stem::Planes { inputs, outputs, scratch: *scratch };
                    stem::stem(self.level, memory, geometry, matrix, planes);
                }
                Operation::Pointwise { matrix, addend, length } => {
                    matmul::multiply(self.level, memory, matrix, Rows { inputs, outputs, addend, length: *length });
                }
                Operation::Depthwise { geometry, weights, bias, relu } => {
                    let planes = depthwise::Planes { inputs, outputs, scratch: *scratch, weights, bias, relu: *relu };
                    depthwise::convolve(self.level, memory, geometry, planes);
                }
                Operation::Upsample { size } => upsample::double(self.level, memory, *size, inputs, outputs),
            }
        }
    }
}

/// Places the outputs and the scratch memory of the layer that runs at `time`.
fn step(network: &Network, layer: &Layer, time: usize, places: &mut Places) -> Step {
    let size = network.planes[layer.inputs[0]];
    let (operation, scratch) = match layer.kind {
        Kind::Dense | Kind::Stem => {
            let matrix = Matrix::pack(&layer.weights, &layer.bias, layer.relu);
            let geometry = stem::Geometry::new(size, layer.inputs.len(), matrix.padded_rows());
            let scratch = geometry.scratch();
            (Operation::Stem { geometry, matrix }, scratch)
        }
        Kind::Pointwise => {
            let matrix = Matrix::pack(&layer.weights, &layer.bias, layer.relu);
            let mut addend = places.offsets(&layer.addend);
            addend.resize(if addend.is_empty() { 0 } else { matrix.padded_rows() }, 0);
            (Operation::Pointwise { matrix, addend, length: size.0 * size.1 }, 0)
        }
        Kind::Depthwise { kernel, stride } => {
            let geometry = depthwise::Geometry::new(size, kernel, stride);
            let scratch = geometry.scratch();
            let (weights, bias) = (layer.weights.clone(), layer.bias.clone());
            (Operation::Depthwise { geometry, weights, bias, relu: layer.relu }, scratch)
        }
        Kind::Upsample => (Operation::Upsample { size }, 0),
    };
    let padding = match &operation {
        Operation::Pointwise { matrix, .. } => matrix.padded_rows() - layer.outputs.len(),
        _ => 0,
    };
    let inputs = places.offsets(&layer.inputs);
    let outputs = places.planes(&layer.outputs, padding, time);
    Step { operation, inputs, outputs, scratch: places.scratch(scratch, time) }
}
