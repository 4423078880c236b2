//! Plans the buffer of each plane: planes whose last reader has run give their memory to later ones, so that the working set stays
//! in the second-level cache.

use crate::engine::graph::{Network, Plane};
use crate::engine::kernels::WIDEST;
use crate::engine::kernels::depthwise::ROWS;

/// Assigns memory in the order of execution.
#[derive(Debug)]
pub(crate) struct BufferPlanner<'n> {
    network: &'n Network,
    /// Time (index of the layer) of the last read of each plane.
    last_read: Vec<usize>,
    /// Offset of each plane, floats.
    offsets: Vec<usize>,
    /// In ascending order of `start`.
    live: Vec<Block>,
    end: usize,
}

#[derive(Debug)]
struct Block {
    start: usize,
    end: usize,
    last_read: usize,
}

impl<'n> BufferPlanner<'n> {
    pub(crate) fn new(network: &'n Network) -> Self {
        let mut last_read = vec![0; network.planes.len()];
        for (time, layer) in network.layers.iter().enumerate() {
            layer.inputs.iter().chain(&layer.addend).for_each(|plane| last_read[*plane] = time);
        }
        network.outputs.iter().flat_map(|(_, planes)| planes).for_each(|plane| last_read[*plane] = usize::MAX);
        Self { network, last_read, offsets: vec![0; network.planes.len()], live: Vec::new(), end: 0 }
    }

    /// Assigns memory to `planes` (of equal size), which are written at `time`, and to `padding` more planes that are never read.
    /// Returns all offsets.
    pub(crate) fn planes(&mut self, planes: &[Plane], padding: usize, time: usize) -> Vec<usize> {
        let stride = stride(self.network.planes[planes[0]]);
        let last_read = planes.iter().map(|plane| self.last_read[*plane]).max().unwrap_or(time);
        let start = self.block(stride * (planes.len() + padding), time, last_read);
        planes.iter().enumerate().for_each(|(index, plane)| self.offsets[*plane] = start + index * stride);
        (0..planes.len() + padding).map(|index| start + index * stride).collect()
    }

    /// Returns the offsets of planes that have memory.
    pub(crate) fn offsets(&self, planes: &[Plane]) -> Vec<usize> {
        planes.iter().map(|plane| self.offsets[*plane]).collect()
    }

    /// Returns the number of floats that are needed in total.
    pub(crate) fn end(&self) -> usize {
        self.end
    }

    /// Takes the first gap that is large enough.
    fn block(&mut self, floats: usize, time: usize, last_read: usize) -> usize {
        self.live.retain(|block| block.last_read >= time);
        let mut start = 0;
        let mut index = 0;
        while let Some(block) = self.live.get(index).filter(|block| block.start < start + floats) {
            start = block.end;
            index += 1;
        }
        let end = start + floats;
        self.live.insert(index, Block { start, end, last_read: last_read.max(time) });
        self.end = self.end.max(end);
        start
    }
}

/// Returns the number of floats from one plane to the next: room for vectors that reach past the last row and for rows written in
/// blocks, and an odd number of cache lines, so that equal positions of neighbouring planes fall into different sets of the cache.
pub(crate) fn stride((height, width): (usize, usize)) -> usize {
    let whole = (height * width).next_multiple_of(WIDEST);
    let rows = (height.max(ROWS) - 1) * width + width.next_multiple_of(WIDEST);
    (whole.max(rows).div_ceil(WIDEST) | 1) * WIDEST
}
