//! The shape of what the importer tells about the road ahead.

use nalgebra::SVector;

use crate::parameters::HORIZON_MAX;

/// Elements of a preview: now and the next 40 sample times.
pub const PREVIEW: usize = HORIZON_MAX + 1;

/// A quantity now and at the next 40 sample times.
pub type Preview = SVector<f64, PREVIEW>;
