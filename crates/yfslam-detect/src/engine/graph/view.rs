//! A tensor as a list of planes with a shape; the reshaping operators of ONNX move planes and never floats.

use super::Plane;

/// Largest number of channels, which keeps a malicious graph from filling the memory.
pub(crate) const MAX_PLANES: usize = 4096;

/// `dims` = leading dimensions (their product is the number of planes) followed by `[height, width]` or `[height · width]`.
#[derive(Clone, Debug)]
pub(crate) struct View {
    pub(crate) dims: Vec<usize>,
    /// Number of the last dimensions that lie within a plane, 1 or 2.
    pub(crate) inner: usize,
    pub(crate) size: (usize, usize),
    pub(crate) planes: Vec<Plane>,
}

type Outcome = Result<View, String>;

impl View {
    /// Creates a view of shape `[1, channels, height, width]`.
    pub(crate) fn image(planes: Vec<Plane>, size: (usize, usize)) -> Self {
        Self { dims: vec![1, planes.len(), size.0, size.1], inner: 2, size, planes }
    }

    /// Returns whether this is one image of shape `[1, channels, height, width]` with at least one channel.
    pub(crate) fn is_image(&self) -> bool {
        self.inner == 2 && self.dims.len() == 4 && self.dims[0] == 1 && !self.planes.is_empty()
    }

    fn leading(&self) -> &[usize] {
        &self.dims[..self.dims.len() - self.inner]
    }

    /// Converts a possibly negative axis to an index of the leading dimensions.
    pub(crate) fn leading_axis(&self, axis: i64) -> Result<usize, String> {
        let absolute = if axis < 0 { axis + self.dims.len() as i64 } else { axis };
        usize::try_from(absolute)
            .ok()
            .filter(|axis| *axis < self.leading().len())
            .ok_or_else(|| format!("axis {axis} of shape {:?} is no channel axis", self.dims))
    }

    /// Applies ONNX `Reshape`: 0 keeps a dimension, −1 follows from the others.
    pub(crate) fn reshape(&self, shape: &[i64]) -> Outcome {
        let failed = || format!("cannot reshape {:?} to {shape:?} by moving whole channels", self.dims);
        let total: usize = self.dims.iter().product();
        let mut dims = Vec::new();
        for (index, dim) in shape.iter().enumerate() {
            dims.push(match *dim {
                0 => *self.dims.get(index).ok_or_else(failed)?,
                -1 => 0,
                dim => usize::try_from(dim).map_err(|_| failed())?,
            });
        }
        let known =
            dims.iter().filter(|dim| **dim != 0).try_fold(1, |a: usize, b| a.checked_mul(*b)).ok_or_else(failed)?;
        if let Some(open) = dims.iter_mut().find(|dim| **dim == 0) {
            *open = total / known;
        }
        let (height, width) = self.size;
        let inner = match dims.as_slice() {
            [.., h, w] if (*h, *w) == self.size => 2,
            [.., area] if *area == height * width => 1,
            _ => return Err(failed()),
        };
        if dims.iter().try_fold(1, |a: usize, b| a.checked_mul(*b)) != Some(total) {
            return Err(failed());
        }
        Ok(View { dims, inner, ..self.clone() })
    }

    /// Applies ONNX `Transpose` to the leading dimensions.
    pub(crate) fn transpose(&self, perm: &[i64]) -> Outcome {
        let failed = || format!("cannot transpose {:?} by {perm:?}; only channel axes may change places", self.dims);
        let rank = self.dims.len();
        let leading = self.leading().len();
        let perm: Vec<usize> = perm.iter().filter_map(|p| usize::try_from(*p).ok()).collect();
        let mut sorted = perm.clone();
        sorted.sort_unstable();
        let fixed_inner = perm.len() == rank && (leading..rank).all(|axis| perm[axis] == axis);
        if !fixed_inner || sorted != (0..rank).collect::<Vec<_>>() {
            return Err(failed());
        }
        let dims: Vec<usize> = perm.iter().map(|axis| self.dims[*axis]).collect();
        let stride = |axis: usize| self.dims[axis + 1..leading].iter().product::<usize>();
        let planes = (0..self.planes.len())
            .map(|mut index| {
                let mut source = 0;
                for axis in (0..leading).rev() {
                    source += index % dims[axis] * stride(perm[axis]);
                    index /= dims[axis];
                }
                self.planes[source]
            })
            .collect();
        Ok(View { dims, planes, ..self.clone() })
    }

    /// Selects the entries `indices` along `axis`.
    pub(crate) fn select(&self, axis: i64, indices: &[i64]) -> Outcome {
        let axis = self.leading_axis(axis)?;
        let length = self.dims[axis];
        let block: usize = self.leading()[axis + 1..].iter().product();
        let outer: usize = self.leading()[..axis].iter().product();
        if outer.saturating_mul(indices.len()).saturating_mul(block) > MAX_PLANES {
            return Err(format!("more than {MAX_PLANES} channels"));
        }
        let mut planes = Vec::new();
        for outer in 0..outer {
            for index in indices {
                let absolute = if *index < 0 { index + length as i64 } else { *index };
                let index = usize::try_from(absolute).ok().filter(|index| *index < length);
                let index =
                    index.ok_or_else(|| format!("index {absolute} is outside of axis {axis} of {:?}", self.dims))?;
                planes.extend_from_slice(&self.planes[(outer * length + index) * block..][..block]);
            }
        }
        let mut dims = self.dims.clone();
        dims[axis] = indices.len();
        Ok(View { dims, planes, ..self.clone() })
    }

    /// Removes the dimensions `axes`, which must be 1.
    pub(crate) fn squeeze(&self, axes: &[i64]) -> Outcome {
        let mut dims: Vec<Option<usize>> = self.dims.iter().copied().map(Some).collect();
        for axis in axes {
            dims[self.leading_axis(*axis)?].take_if(|dim| *dim == 1);
        }
        let dims: Vec<usize> = dims.into_iter().flatten().collect();
        if dims.len() + axes.len() != self.dims.len() {
            return Err(format!("cannot squeeze axes {axes:?} of {:?}", self.dims));
        }
        Ok(View { dims, ..self.clone() })
    }

    /// Applies ONNX `Concat` along a leading axis.
    pub(crate) fn concat(views: &[&View], axis: i64) -> Outcome {
        let first = views.first().ok_or("nothing to concatenate")?;
        let axis = first.leading_axis(axis)?;
        let frame = |view: &View| {
            let mut dims = view.dims.clone();
            dims[axis] = 0;
            (dims, view.size, view.inner)
        };
        if views.iter().any(|view| view.dims.len() != first.dims.len() || frame(view) != frame(first)) {
            let shapes: Vec<_> = views.iter().map(|view| &view.dims).collect();
            return Err(format!("cannot concatenate the shapes {shapes:?} along axis {axis}"));
        }
        if views.iter().map(|view| view.planes.len()).sum::<usize>() > MAX_PLANES {
            return Err(format!("more than {MAX_PLANES} channels"));
        }
        let outer: usize = first.leading()[..axis].iter().product();
        let mut planes = Vec::new();
        for outer in 0..outer {
            for view in views {
                let block: usize = view.leading()[axis..].iter().product();
                planes.extend_from_slice(&view.planes[outer * block..][..block]);
            }
        }
        let mut dims = first.dims.clone();
        dims[axis] = views.iter().map(|view| view.dims[axis]).sum();
        Ok(View { dims, planes, ..(*first).clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(channels: usize) -> View {
        View::image((0..channels).collect(), (4, 5))
    }

    #[test]
    fn channel_shuffle_separates_even_and_odd_channels() {
        let shuffled = image(6).reshape(&[3, 2, 20]).unwrap().transpose(&[1, 0, 2]).unwrap();
        let halves = shuffled.reshape(&[2, -1, 3, 4, 5]).unwrap();
        let odd = halves.select(0, &[1]).unwrap().squeeze(&[0]).unwrap();
        assert_eq!(odd.planes, [1, 3, 5]);
        assert!(odd.is_image());
        let even = halves.select(0, &[0]).unwrap().squeeze(&[0]).unwrap();
        assert_eq!(View::concat(&[&even, &odd], 1).unwrap().planes, [0, 2, 4, 1, 3, 5]);
    }

    #[test]
    fn transposing_twice_gives_the_original_back() {
        let view = image(24).reshape(&[2, 3, 4, 20]).unwrap();
        let there = view.transpose(&[2, 0, 1, 3]).unwrap();
        assert_eq!(there.dims, [4, 2, 3, 20]);
        assert_eq!(there.transpose(&[1, 2, 0, 3]).unwrap().planes, view.planes);
    }

    #[test]
    fn operations_that_split_a_plane_are_refused() {
        let view = image(6);
        assert!(view.reshape(&[1, 12, 2, 5]).is_err());
        assert!(view.reshape(&[-1, 7]).is_err());
        assert!(view.reshape(&[0, 0, 0, 0, 0]).is_err());
        assert!(view.transpose(&[0, 2, 1, 3]).is_err());
        assert!(view.transpose(&[1, 1, 2, 3]).is_err());
        assert!(view.select(1, &[6]).is_err());
        assert!(view.select(2, &[0]).is_err());
        assert!(view.squeeze(&[1]).is_err());
        assert!(view.squeeze(&[0, 0]).is_err());
        assert!(View::concat(&[&view, &image(6)], 2).is_err());
        assert!(View::concat(&[], 0).is_err());
    }
}
