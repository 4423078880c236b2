//! Why a model could not be loaded: always the file, the place in it, and the cure.

/// Why a network file was refused.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file could not be read from disk.
    #[error("cannot read the model {path}: {source}")]
    Io {
        /// The path as given.
        path: String,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The bytes are no ONNX model, or they end too early.
    #[error(
        "{model} is not a readable ONNX model: {what}; export it again, or fetch the file again if it was cut short"
    )]
    NotOnnx {
        /// Name of the model.
        model: String,
        /// What was found.
        what: String,
    },
    /// The graph holds something this runtime does not compute.
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
        /// What about it is not supported.
        what: String,
    },
    /// Model and configuration do not fit each other, or a value is out of range.
    #[error("{model}: {what}")]
    Mismatch {
        /// Name of the model.
        model: String,
        /// What does not fit, and the cure.
        what: String,
    },
}
