//! A network with a fixed place in memory: a list of steps with all offsets fixed. Running it allocates nothing.

use fearless_simd::Level;

use crate::engine::buffer_planner::BufferPlanner;
use crate::engine::graph::{Kind, Layer, Network};
use crate::engine::kernels::integers::{self, IntegerMatrix};
use crate::engine::kernels::matmul::{self, Matrix, Rows};
use crate::engine::kernels::{WIDEST, depthwise, stem, upsample};
use crate::engine::memory::Memory;
use crate::error::ModelError;

/// Largest working memory, floats (1 GiB); the embedded network needs about 1 % of it.
const MAX_MEMORY: usize = 1 << 28;

/// A network ready to run.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) level: Level,
    /// All planes.
    memory: Memory,
    /// Scratch memory of the running step.
    scratch: Memory,
    /// Scratch memory of the running step, if it computes with integers.
    words: Vec<i32>,
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
}

#[derive(Debug)]
enum Operation {
    Stem { geometry: stem::Geometry, matrix: Matrix },
    Pointwise { matrix: Matrix, addend: Vec<usize>, length: usize },
    Integers { matrix: IntegerMatrix, addend: Vec<usize>, length: usize },
    Depthwise { geometry: depthwise::Geometry, weights: Vec<f32>, bias: Vec<f32>, relu: bool },
    Upsample { size: (usize, usize) },
}

impl Plan {
    /// Plans `network`, which computes with integers where possible if `integers` is set; `name` stands for the file in error
    /// messages.
    pub(crate) fn new(name: &str, network: Network, level: Level, integers: bool) -> Result<Self, ModelError> {
        if integers && network.layers.iter().all(|layer| layer.scale.is_none()) {
            let what =
                "it has no scales for computing with integers (`integers`); add them with `python -m train.quantize`";
            return Err(ModelError::Mismatch { model: name.into(), what: what.into() });
        }
        let mut buffers = BufferPlanner::new(&network);
        let input = buffers.planes(&network.input, 0, 0);
        let layers = network.layers.iter().enumerate();
        let steps: Vec<Step> =
            layers.map(|(time, layer)| step(&network, layer, time, &mut buffers, integers)).collect();
        let scratch = steps.iter().map(|step| step.operation.scratch()).max().unwrap_or(0);
        let words = steps.iter().map(|step| step.operation.words()).max().unwrap_or(0);
        if buffers.end() + scratch > MAX_MEMORY {
            let mebibytes = (buffers.end() + scratch) >> 18;
            let what =
                format!("the network needs {mebibytes} MiB of working memory, more than 1 GiB; use a smaller network");
            return Err(ModelError::Mismatch { model: name.into(), what });
        }
        let map = |(name, planes): &(String, Vec<usize>)| Map {
            name: name.clone(),
            size: network.planes[planes[0]],
            planes: buffers.offsets(planes),
        };
        Ok(Self {
            level,
            // Vectors may read past the end of the last plane.
            memory: Memory::new(buffers.end() + 4 * WIDEST),
            scratch: Memory::new(scratch),
            words: vec![0; words],
            steps,
            input,
            input_size: network.planes[network.input[0]],
            outputs: network.outputs.iter().map(map).collect(),
        })
    }

    /// Returns the planes of the input, each `height · width` floats, to be filled before [`Plan::run`].
    pub(crate) fn input_mut(&mut self) -> [&mut [f32]; 3] {
        let length = self.input_size.0 * self.input_size.1;
        let ranges = [0, 1, 2].map(|plane| self.input[plane]..self.input[plane] + length);
        self.memory.get_disjoint_mut(ranges).unwrap_or_default()
    }

    /// Returns one plane of an output.
    pub(crate) fn plane(&self, map: &Map, plane: usize) -> &[f32] {
        &self.memory[map.planes[plane]..][..map.size.0 * map.size.1]
    }

    /// Runs the forward pass.
    pub(crate) fn run(&mut self) {
        let (level, memory, scratch) = (self.level, &mut self.memory[..], &mut self.scratch[..]);
        for Step { operation, inputs, outputs } in &self.steps {
            match operation {
                Operation::Stem { geometry, matrix } => {
                    stem::stem(level, memory, scratch, geometry, matrix, (inputs, outputs));
                }
                Operation::Pointwise { matrix, addend, length } => {
                    let rows = Rows { inputs, outputs, addend, keep_larger: false, length: *length };
                    matmul::multiply(level, memory, matrix, rows);
                }
                Operation::Integers { matrix, addend, length } => {
                    let rows = Rows { inputs, outputs, addend, keep_larger: false, length: *length };
                    integers::multiply(level, memory, &mut self.words, matrix, rows);
                }
                Operation::Depthwise { geometry, weights, bias, relu } => {
                    let planes = depthwise::Planes { inputs, outputs, weights, bias, relu: *relu };
                    depthwise::convolve(level, memory, scratch, geometry, planes);
                }
                Operation::Upsample { size } => upsample::double(level, memory, *size, inputs, outputs),
            }
        }
    }
}

impl Operation {
    /// Creates the operation of `layer`, whose inputs have `size`.
    fn new(layer: &Layer, size: (usize, usize), buffers: &BufferPlanner, integers: bool) -> Self {
        let addend = |rows: usize| {
            let mut addend = buffers.offsets(&layer.addend);
            addend.resize(if addend.is_empty() { 0 } else { rows }, 0);
            addend
        };
        let matrix = || Matrix::pack(&layer.weights, &layer.bias, layer.relu);
        match layer.kind {
            Kind::Dense | Kind::Stem => {
                let matrix = matrix();
                let geometry = stem::Geometry::new(size, layer.inputs.len(), matrix.padded_rows());
                Operation::Stem { geometry, matrix }
            }
            Kind::Pointwise => {
                let length = size.0 * size.1;
                if let Some(scale) = layer.scale.filter(|_| integers) {
                    let matrix = IntegerMatrix::pack(&layer.weights, &layer.bias, layer.relu, scale);
                    let addend = addend(matrix.padded_rows());
                    return Operation::Integers { matrix, addend, length };
                }
                let matrix = matrix();
                let addend = addend(matrix.padded_rows());
                Operation::Pointwise { matrix, addend, length }
            }
            Kind::Depthwise { kernel, stride } => {
                let by_column = |filter: &[f32]| -> Vec<f32> {
                    (0..kernel * kernel).map(|index| filter[index % kernel * kernel + index / kernel]).collect()
                };
                let weights = layer.weights.chunks_exact(kernel * kernel).flat_map(by_column).collect();
                let geometry = depthwise::Geometry::new(size, kernel, stride);
                Operation::Depthwise { geometry, weights, bias: layer.bias.clone(), relu: layer.relu }
            }
            Kind::Upsample => Operation::Upsample { size },
        }
    }

    /// Returns the number of floats of scratch memory.
    fn scratch(&self) -> usize {
        match self {
            Operation::Stem { geometry, .. } => geometry.scratch,
            Operation::Depthwise { geometry, .. } => geometry.scratch(),
            _ => 0,
        }
    }

    /// Returns the number of words of scratch memory for integers.
    fn words(&self) -> usize {
        match self {
            Operation::Integers { matrix, length, .. } => matrix.scratch(*length),
            _ => 0,
        }
    }

    /// Returns the number of rows that are written beyond those of the layer.
    fn padding(&self, rows: usize) -> usize {
        match self {
            Operation::Pointwise { matrix, .. } => matrix.padded_rows() - rows,
            Operation::Integers { matrix, .. } => matrix.padded_rows() - rows,
            _ => 0,
        }
    }
}

/// Creates the step of the layer that runs at `time` and assigns memory to its outputs.
fn step(network: &Network, layer: &Layer, time: usize, buffers: &mut BufferPlanner, integers: bool) -> Step {
    let operation = Operation::new(layer, network.planes[layer.inputs[0]], buffers, integers);
    let padding = operation.padding(layer.outputs.len());
    let inputs = buffers.offsets(&layer.inputs);
    Step { operation, inputs, outputs: buffers.planes(&layer.outputs, padding, time) }
}
