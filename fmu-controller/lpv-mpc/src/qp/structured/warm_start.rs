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
    frozen: Vec<bool>,
}

impl<const NX: usize, const NU: usize> From<Structured<NX, NU>> for WarmStart {
    fn from(solver: Structured<NX, NU>) -> Self {
        Self {
            horizon: solver.horizon,
            active: solver.active.into_iter().flatten().collect(),
            sides: solver.sides,
            inputs: solver.inputs.into_iter().flatten().collect(),
            frozen: solver.frozen.to_vec(),
        }
    }
}

impl<const NX: usize, const NU: usize> TryFrom<WarmStart> for Structured<NX, NU> {
    type Error = &'static str;

    fn try_from(saved: WarmStart) -> Result<Self, Self::Error> {
        let N = saved.sides.len();
        let Ok(frozen) = saved.frozen.try_into() else {
            return Err("warm start of the solver has another number of inputs");
        };
        if saved.horizon != N || saved.active.len() != N * NU || saved.inputs.len() != N * NU {
            return Err("warm start of the solver has inconsistent lengths");
        }
        let mut solver = Self { frozen, ..Self::new(N) };
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
    ///
    /// An input that could not move is taken to be free: that it stood on its bounds says nothing of what it does once it can.
    pub fn shift(&mut self) {
        for j in (0..NU).filter(|j| self.frozen[*j]) {
            self.active.iter_mut().for_each(|active| active[j] = Active::NONE);
        }
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
        self.frozen = [false; NU];
    }
}
