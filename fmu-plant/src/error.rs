//! What the plant's unit can refuse.

use std::path::PathBuf;

/// A vehicle that cannot be built or driven, or a road file that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A parameter, an input or a road.
    #[error(transparent)]
    Vehicle(#[from] vehicle::Error),
    /// A road file that cannot be read.
    #[error("road {0}")]
    File(model_description::FileError),
    /// A road file that is refused for what is in it.
    #[error("road file \"{path}\": {reason}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: vehicle::Error,
    },
    /// A derivative with respect to a variable that is no input.
    #[error("derivatives exist with respect to inputs alone, not to {0}")]
    NoDerivative(String),
}
