//! What each axle can transmit: loads, friction, and the share that drive and brakes leave to the lateral force.

use crate::{Parameters, Scalar, road::Road, smooth};

/// Largest share of an axle's grip that drive or brakes take [1]: beyond it the tyre would spin or lock, which a
/// single-track model without wheel speeds does not show. The lateral force keeps sqrt(1 - 0.98^2) = 0.2 of its value.
const SHARE_MAX: f64 = 0.98;

/// Constants of the grip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grip {
    mu: f64,
    mass: f64,
    /// Share of the weight on each axle [1].
    front: f64,
    rear: f64,
    /// Height of the centre of gravity over the wheelbase, or 0 without load transfer [1].
    lever: f64,
    /// Share of drive and brakes in front, if they use up grip [1].
    combined: Option<(f64, f64)>,
    l_f: f64,
    l_r: f64,
    /// Begin, end, edge length [m] and friction factor [1] of a patch.
    patch: Option<[f64; 4]>,
}

/// One axle's grip at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxleGrip<D> {
    /// Friction [1].
    pub mu: D,
    /// Load [N].
    pub load: D,
    /// What the longitudinal force leaves of the lateral one [1].
    pub left: D,
}

impl Grip {
    pub fn new(p: &Parameters) -> Self {
        let wheelbase = p.l_f + p.l_r;
        Self {
            mu: p.mu,
            mass: p.m,
            front: p.l_r / wheelbase,
            rear: p.l_f / wheelbase,
            lever: if p.load_transfer { p.h_cg / wheelbase } else { 0.0 },
            combined: p.combined_slip.then_some((p.drive_front, p.brake_front)),
            l_f: p.l_f,
            l_r: p.l_r,
            patch: (p.patch_length > 0.0).then_some([
                p.patch_start,
                p.patch_start + p.patch_length,
                p.patch_edge,
                p.patch_mu,
            ]),
        }
    }

    /// Both axles' grip, and the acceleration [m/s2] that drive and brakes reach of the commanded `a_x`.
    #[inline]
    pub fn axles<D: Scalar>(&self, road: &Road, s: D, a_x: D, g_z: D, mu_scale: D) -> (AxleGrip<D>, AxleGrip<D>, D) {
        let mass = self.mass;
        let (load_f, load_r) = if self.lever == 0.0 {
            (g_z * (mass * self.front), g_z * (mass * self.rear))
        } else {
            // Quasi-static pitch balance with the commanded acceleration, as in the single-track model of
            // commonroad-vehicle-models; no axle pulls on the road.
            let transfer = a_x * self.lever;
            (positive(g_z * self.front - transfer) * mass, positive(g_z * self.rear + transfer) * mass)
        };
        let (mu_f, mu_r) = if self.patch.is_none() && !road.has_friction() {
            let mu = mu_scale * self.mu;
            (mu, mu)
        } else {
            (mu_scale * self.friction(road, s + self.l_f), mu_scale * self.friction(road, s - self.l_r))
        };
        let mut front = AxleGrip { mu: mu_f, load: load_f, left: D::one() };
        let mut rear = AxleGrip { mu: mu_r, load: load_r, left: D::one() };
        let Some((drive, brake)) = self.combined else { return (front, rear, a_x) };
        let share = if a_x.re() >= 0.0 { drive } else { brake };
        let used_f = combine(&mut front, a_x * (mass * share));
        let used_r = combine(&mut rear, a_x * (mass * (1.0 - share)));
        (front, rear, (used_f + used_r) * (1.0 / mass))
    }

    /// Friction at arc length `s`, of the road and the patch on it [1].
    pub fn friction<D: Scalar>(&self, road: &Road, s: D) -> D {
        let road = road.friction(s) * self.mu;
        match self.patch {
            None => road,
            Some([begin, end, edge, mu]) => road * (smooth::window(s, begin, end, edge) * (mu - 1.0) + 1.0),
        }
    }
}

/// Takes a longitudinal force [N] out of the friction circle and returns what of it the axle transmits.
fn combine<D: Scalar>(axle: &mut AxleGrip<D>, force: D) -> D {
    let most = axle.mu * axle.load * SHARE_MAX;
    let force = if force.re() > most.re() {
        most
    } else if force.re() < -most.re() {
        -most
    } else {
        force
    };
    if most.re() > 0.0 {
        let share = force / most * SHARE_MAX;
        axle.left = (-share * share + 1.0).sqrt();
    }
    force
}

fn positive<D: Scalar>(x: D) -> D {
    if x.re() < 0.0 { D::zero() } else { x }
}
