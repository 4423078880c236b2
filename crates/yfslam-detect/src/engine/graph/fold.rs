//! Algebraic simplifications of the lowered network, which save multiplications and change results by rounding only.

use super::{Kind, Layer, Network};

/// Merges two 1×1 convolutions without a ReLU in between: W₂(W₁x + b₁) + b₂ = (W₂W₁)x + (W₂b₁ + b₂).
pub(crate) fn fold_linear_pointwise(network: &mut Network) {
    for index in (0..network.layers.len()).rev() {
        let first = &network.layers[index];
        if first.kind != Kind::Pointwise || first.relu || !first.addend.is_empty() {
            continue;
        }
        let mut readers: Vec<usize> = first.outputs.iter().flat_map(|plane| network.readers(*plane)).collect();
        readers.sort_unstable();
        readers.dedup();
        let foldable = |reader: &usize| {
            let reader = &network.layers[*reader];
            reader.kind == Kind::Pointwise && reader.inputs == first.outputs && reader.addend.is_empty()
        };
        let leaves = first.outputs.iter().any(|plane| network.is_output(*plane));
        let rows: usize = readers.iter().map(|reader| network.layers[*reader].outputs.len()).sum();
        let (inner, depth) = (first.outputs.len(), first.inputs.len());
        let cheaper = rows * depth <= inner * depth + rows * inner;
        if leaves || readers.is_empty() || !cheaper || !readers.iter().all(foldable) {
            continue;
        }
        let first = network.layers.remove(index);
        for reader in readers {
            prepend(&mut network.layers[reader - 1], &first);
        }
    }
}

fn prepend(second: &mut Layer, first: &Layer) {
    let depth = first.inputs.len();
    let mut weights = Vec::with_capacity(second.outputs.len() * depth);
    for (row, bias) in second.weights.chunks_exact(first.outputs.len()).zip(&mut second.bias) {
        let mut sums = vec![0.0_f64; depth];
        let mut offset = f64::from(*bias);
        for ((factor, inner), inner_bias) in row.iter().zip(first.weights.chunks_exact(depth)).zip(&first.bias) {
            sums.iter_mut().zip(inner).for_each(|(sum, weight)| *sum += f64::from(*factor) * f64::from(*weight));
            offset += f64::from(*factor) * f64::from(*inner_bias);
        }
        weights.extend(sums.iter().map(|sum| *sum as f32));
        *bias = offset as f32;
    }
    second.weights = weights;
    second.inputs.clone_from(&first.inputs);
    second.scale = first.scale;
}

/// Moves 1×1 convolutions before nearest upsampling, with which they commute, so that they run at the small size: W·[up(a), b] =
/// up(Wₐ·a) + W_b·b.
pub(crate) fn defer_upsampling(network: &mut Network) {
    for index in (0..network.layers.len()).rev() {
        let up = &network.layers[index];
        if up.kind != Kind::Upsample {
            continue;
        }
        let mut readers: Vec<usize> = up.outputs.iter().flat_map(|plane| network.readers(*plane)).collect();
        readers.sort_unstable();
        readers.dedup();
        let [reader] = readers[..] else { continue };
        let (wide, count) = (&network.layers[reader], up.outputs.len());
        let Some(start) = wide.inputs.windows(count).position(|window| window == up.outputs) else { continue };
        let repeated = wide.inputs.iter().filter(|plane| up.outputs.contains(plane)).count() != count;
        let leaves = up.outputs.iter().any(|plane| network.is_output(*plane));
        let pays = wide.outputs.len() < count && count < wide.inputs.len();
        if wide.kind != Kind::Pointwise || !wide.addend.is_empty() || repeated || leaves || !pays {
            continue;
        }
        split_off_upsampled(network, index, reader, start);
    }
}

/// Replaces layer `up` and the columns from `start` of layer `reader` by: pointwise, upsample, addend.
fn split_off_upsampled(network: &mut Network, up: usize, reader: usize, start: usize) {
    let count = network.layers[up].outputs.len();
    let rows = network.layers[reader].outputs.len();
    let sizes = [network.layers[up].inputs[0], network.layers[up].outputs[0]].map(|plane| network.planes[plane]);
    let [small, large] = sizes.map(|size| network.new_planes(rows, size));

    let wide = &mut network.layers[reader];
    let depth = wide.inputs.len();
    let (mut taken, mut kept) = (Vec::new(), Vec::new());
    for row in wide.weights.chunks_exact(depth) {
        taken.extend_from_slice(&row[start..start + count]);
        kept.extend_from_slice(&row[..start]);
        kept.extend_from_slice(&row[start + count..]);
    }
    wide.weights = kept;
    wide.inputs.drain(start..start + count);
    wide.addend.clone_from(&large);
    let (name, scale) = (wide.name.clone(), wide.scale);

    let mut upsample = network.layers.remove(up);
    let pointwise = Layer {
        name,
        kind: Kind::Pointwise,
        inputs: std::mem::replace(&mut upsample.inputs, small.clone()),
        outputs: small,
        weights: taken,
        bias: vec![0.0; rows],
        relu: false,
        addend: Vec::new(),
        scale,
    };
    upsample.outputs = large;
    network.layers.splice(reader - 1..reader - 1, [pointwise, upsample]);
}
