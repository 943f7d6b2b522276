//! How the tyres change along a direction: the same tyres a little to either side.

use num_dual::Dual64;

use super::Adapter;
use crate::jordan::Memory;
use crate::model::{Input, State, Tyres};
use crate::modes::Adaptation;
use crate::mpc::TyreModel;

/// The same tyres a small distance ahead and behind along a direction: their derivative is a central difference.
///
/// The tangents already hold the network's first derivatives, so exact ones would need its second derivatives along every
/// direction. The network is smooth on the scale of its training data, where a distance of 1e-4 leaves errors of 1e-8.
pub(crate) struct Neighbours {
    sides: [Adapter; 2],
    distance: f64,
}

/// Distance of the neighbours, in units of the states [m/s, rad/s, m, rad].
const DISTANCE: f64 = 1e-4;

/// Smallest move of a state for which the distance is still measured by it: curvature and wanted speed do not move the
/// measured state itself, only where it goes.
const SMALLEST_MOVE: f64 = 1e-3;

impl Adapter {
    /// The tyres around a sample that began with the network's answer `before`, as its state moves along `x.eps` and the
    /// friction along `mu.eps`.
    pub(crate) fn neighbours(&self, before: Memory, x: &State<Dual64>, u: &Input, mu: Dual64) -> Option<Neighbours> {
        if self.mode == Adaptation::Constant {
            return None;
        }
        let moves = x.iter().chain([&mu]);
        let largest = moves.fold(SMALLEST_MOVE, |largest: f64, moved| largest.max(moved.eps.abs()));
        let distance = DISTANCE / largest;
        let sides = [distance, -distance].map(|distance| {
            let mut side = self.clone();
            side.memory = before;
            side.observe(&x.map(|x| x.re + distance * x.eps), u, mu.re + distance * mu.eps);
            side.restart();
            side
        });
        Some(Neighbours { sides, distance })
    }
}

impl Neighbours {
    /// The tyres at the measurement.
    pub fn present(&self, value: &Tyres) -> Tyres<Dual64> {
        self.slope(value, &self.sides[0].present, &self.sides[1].present)
    }

    /// The tyres of the next stage, which is at `x` and `u` on a road of friction `mu` [1].
    pub fn at(&mut self, value: &Tyres, x: &State<Dual64>, u: &Input<Dual64>, mu: Dual64) -> Tyres<Dual64> {
        let distance = self.distance;
        let mut side = |i: usize, distance: f64| {
            let moved = |q: Dual64| q.re + distance * q.eps;
            self.sides[i].at(&x.map(moved), &u.map(moved), moved(mu))
        };
        let (ahead, behind) = (side(0, distance), side(1, -distance));
        self.slope(value, &ahead, &behind)
    }

    fn slope(&self, value: &Tyres, ahead: &Tyres, behind: &Tyres) -> Tyres<Dual64> {
        let slope = |ahead: f64, behind: f64| (ahead - behind) / (2.0 * self.distance);
        value.with_slope(&Tyres {
            c_f: slope(ahead.c_f, behind.c_f),
            c_r: slope(ahead.c_r, behind.c_r),
            f_f0: slope(ahead.f_f0, behind.f_f0),
            f_r0: slope(ahead.f_r0, behind.f_r0),
        })
    }
}
