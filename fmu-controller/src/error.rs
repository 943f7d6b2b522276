//! What the controller's unit can refuse.

use std::path::PathBuf;

/// A controller that cannot be built or stepped, or a network file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A parameter, a step, a derivative.
    #[error(transparent)]
    Controller(#[from] lpv_mpc::Error),
    /// A network file that cannot be read.
    #[error("network {0}")]
    File(model_description::FileError),
    /// A network file that is refused for what is in it.
    #[error("\"{path}\": {reason}")]
    Network {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: lpv_mpc::Error,
    },
    /// A derivative with respect to a variable that is no input.
    #[error("derivatives exist with respect to inputs alone, not to {0}")]
    NoInput(String),
}
