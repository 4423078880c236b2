//! The inference engine: an ONNX file becomes a graph of fused layers, the graph a plan of memory and kernels, and the plan runs.
//!
//! In: the bytes of a model. Out: a [`plan::Plan`] with a forward pass of one thread that allocates nothing.

mod buffer_planner;
pub(crate) mod graph;
pub(crate) mod kernels;
mod memory;
pub(crate) mod onnx;
pub(crate) mod plan;
