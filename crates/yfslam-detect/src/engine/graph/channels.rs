//! Operators that select channels: they pass planes on without computation.

use super::lower::{Lowering, Step};
use super::view::View;
use crate::engine::onnx::Node;

impl<'m> Lowering<'m> {
    pub(super) fn gather(&self, node: &Node<'m>) -> Step<View> {
        let axis = node.int("axis", 0);
        let indices = self.ints(node, 1)?;
        let picked = self.view(node, 0)?.select(axis, &indices)?;
        if self.tensor(node, 1)?.1.dims.is_empty() { picked.squeeze(&[axis]) } else { Ok(picked) }
    }

    pub(super) fn slice(&self, node: &Node<'m>) -> Step<View> {
        let view = self.view(node, 0)?;
        let (starts, ends, axes) = (self.ints(node, 1)?, self.ints(node, 2)?, self.ints(node, 3)?);
        let steps = if node.inputs.len() > 4 { self.ints(node, 4)? } else { vec![1] };
        let ([start], [end], [axis], [step]) = (&starts[..], &ends[..], &axes[..], &steps[..]) else {
            return Err("only slices along one axis are supported".into());
        };
        let step = usize::try_from(*step).ok().filter(|step| *step > 0).ok_or("its step must be positive")?;
        let length = view.dims[view.leading_axis(*axis)?] as i64;
        let absolute = |index: i64| if index < 0 { index.saturating_add(length) } else { index }.clamp(0, length);
        view.select(*axis, &(absolute(*start)..absolute(*end)).step_by(step).collect::<Vec<_>>())
    }

    pub(super) fn split(&self, node: &Node<'m>) -> Step<Vec<View>> {
        let view = self.view(node, 0)?;
        let axis = node.int("axis", 0);
        let length = view.dims[view.leading_axis(axis)?] as i64;
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
