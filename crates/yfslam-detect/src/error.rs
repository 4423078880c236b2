//! Errors of loading a model: every message names the file, the place in it, and what to do.

/// Why a model file was refused.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file could not be read from disk.
    #[error("cannot read the model {path}: {source}; check the path")]
    Io {
        /// The path.
        path: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The bytes are not an ONNX model, or they end too early.
    #[error(
        "{model} is not a readable ONNX model: {what}; export it again, or fetch the file again if it was cut short"
    )]
    NotOnnx {
        /// Name of the model.
        model: String,
        /// What is wrong with it.
        what: String,
    },
    /// The graph has an operator that this engine does not compute.
    #[error(
        "{model}: node \"{node}\" ({op}): {what}; this runtime computes the YOLO-FastestV2 architecture only: \
         convolutions 1×1, depthwise and one 3×3 stem, ReLU, batch norm, max pool 3/2/1, concat, channel shuffle and \
         nearest ×2 upsampling, exported to ONNX with fixed sizes, with six raw outputs; other YOLO networks need a build with the \
         feature rten"
    )]
    Unsupported {
        /// Name of the model.
        model: String,
        /// Name of the node, or of its first output where it has none.
        node: String,
        /// ONNX operator of the node.
        op: String,
        /// What is not supported.
        what: String,
    },
    /// Model and configuration do not fit each other, or a value is out of range.
    #[error("{model}: {what}")]
    Mismatch {
        /// Name of the model.
        model: String,
        /// What does not fit, and what to do.
        what: String,
    },
}
