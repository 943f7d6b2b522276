//! What a saved state of the solver holds: all that makes one solve differ from another on the same problem.

use super::Structured;
use super::active::Active;
use serde::{Deserialize, Serialize};

/// Warm start alone; the buffers are made anew.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct WarmStart {
    horizon: usize,
    active: Vec<Active>,
    sides: Vec<i8>,
    inputs: Vec<f64>,
}

impl<const NX: usize, const NU: usize> From<Structured<NX, NU>> for WarmStart {
    fn from(solver: Structured<NX, NU>) -> Self {
        Self {
            horizon: solver.horizon,
            active: solver.active.into_iter().flatten().collect(),
            sides: solver.sides,
            inputs: solver.inputs.into_iter().flatten().collect(),
        }
    }
}

impl<const NX: usize, const NU: usize> TryFrom<WarmStart> for Structured<NX, NU> {
    type Error = &'static str;

    fn try_from(saved: WarmStart) -> Result<Self, Self::Error> {
        let N = saved.sides.len();
        if saved.horizon != N || saved.active.len() != N * NU || saved.inputs.len() != N * NU {
            return Err("warm start of the solver has inconsistent lengths");
        }
        let mut solver = Self::new(N);
        for i in 0..N {
            for j in 0..NU {
                let at = saved.active[i * NU + j];
                solver.active[i][j] = Active { level: at.level.signum(), rate: at.rate.signum() };
                solver.inputs[i][j] = saved.inputs[i * NU + j];
            }
            solver.sides[i] = saved.sides[i].signum();
        }
        Ok(solver)
    }
}

impl<const NX: usize, const NU: usize> Structured<NX, NU> {
    /// Moves the warm start on by one sample; the last sample keeps what it had.
    pub fn shift(&mut self) {
        if self.horizon > 0 {
            self.active.copy_within(1.., 0);
            self.sides.copy_within(1.., 0);
            self.inputs.copy_within(1.., 0);
        }
    }

    /// Forgets the warm start.
    pub fn reset(&mut self) {
        self.active.fill([Active::NONE; NU]);
        self.sides.fill(0);
        self.inputs.fill([0.0; NU]);
    }
}
