//! How the last command and plan change with what was measured and wanted.
//!
//! The sample is differentiated in two parts. What comes before the quadratic programme (filter, latency, schedule, model) runs
//! once more on dual numbers, which carry exact derivatives; the programme itself is differentiated through its conditions of
//! optimality on the final active set. There is no derivative where an infinitesimal change alters the active set: the one of
//! the side on which the solver ended is returned. Tyres that the network gives are followed by central differences of the
//! network, whose tangents are derivatives already ([`crate::adaptation`]).

use nalgebra::{SMatrix, SVector};
use num_dual::Dual64;
use serde::{Deserialize, Serialize};

use crate::adaptation::Adapter;
use crate::estimator::Estimator;
use crate::feedforward::{Before, FeedForward};
use crate::guide::Guide;
use crate::hold::Hold;
use crate::horizon::{Linear, Surroundings, full_state, linearise, middle, vehicle_part};
use crate::jordan::Memory;
use crate::latency::Latency;
use crate::model::{A_X, Body, DELTA, Disturbance, E_Y, Input, State, Tyres, V_X, V_Y};
use crate::modes::Estimation;
use crate::mpc::{Mpc, TyreModel};
use crate::qp::{Perturbation, Stage};
use crate::trend::Trend;
use crate::{Inputs, Output, Parameters};

/// What the last sample started from.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Snapshot {
    pub inputs: Inputs,
    /// The filter before the measurement.
    pub estimator: Estimator,
    /// Time since the sample before [s], and what the actuators delivered in it.
    pub duration: f64,
    pub delivered: Input,
    /// Tyres of the filter and of the prediction over the latency.
    pub tyres: [Tyres; 2],
    /// The network's answer before the sample.
    pub memory: Memory,
    /// Communication step [s].
    pub step: f64,
}

/// A quantity with its derivative along the direction asked for.
fn dual(value: f64, slope: f64) -> Dual64 {
    Dual64::new(value, slope)
}

impl Snapshot {
    /// Before the first sample.
    pub fn new(tyres: &Tyres, sensor_noise: f64) -> Self {
        Self {
            inputs: Inputs::default(),
            estimator: Estimator::new(sensor_noise),
            duration: 0.0,
            delivered: Input::zeros(),
            tyres: [*tyres; 2],
            memory: Memory::default(),
            step: 0.0,
        }
    }

    /// Estimated state and unexplained accelerations.
    fn estimate(&self, direction: &Inputs, p: &Parameters, body: &Body) -> (State<Dual64>, Trend<Dual64>) {
        let mut measured = self.inputs.state().zip_map(&direction.state(), dual);
        if p.estimation == Estimation::Measured {
            return (measured, Trend::steady(Disturbance::zeros()));
        }
        if !p.v_y_measured {
            measured[V_Y] = Dual64::from(f64::NAN);
        }
        let kappa = dual(self.inputs.kappa_ref[0], direction.kappa_ref[0]);
        let mut estimator = self.estimator.to_dual();
        let tyres = fixed(&self.tyres[0]);
        estimator.update(&measured, kappa, &self.delivered, self.duration, body, &tyres);
        (estimator.x, estimator.trend)
    }
}

/// Tyres that do not move.
fn fixed(tyres: &Tyres) -> Tyres<Dual64> {
    tyres.with_slope(&Tyres { c_f: 0.0, c_r: 0.0, f_f0: 0.0, f_r0: 0.0 })
}

/// Derivative of the plan of the last sample along `direction`, written as an [`Output`] whose quantities are derivatives.
///
/// Nothing when there is none: the sample's plan is not an exact optimum, or was the first and found its own schedule.
pub(crate) fn along<const N_X: usize>(
    mpc: &Mpc<N_X>,
    snapshot: &Snapshot,
    direction: &Inputs,
    (p, body, adapter, hold, latency): (&Parameters, &Body, &Adapter, &Hold, &Latency),
) -> Option<Output> {
    if !mpc.smooth {
        return None;
    }
    let (x, trend) = snapshot.estimate(direction, p, body);
    let road = snapshot.inputs.road_along(direction, p);
    let mu = road.friction(Dual64::from(0.0));
    let mut neighbours = adapter.neighbours(snapshot.memory, &x, &snapshot.delivered, mu);
    let present = match &neighbours {
        Some(neighbours) => neighbours.present(&snapshot.tyres[1]),
        None => fixed(&snapshot.tyres[1]),
    };
    let at = latency.predict(&x, snapshot.step, |s| road.curvature(s), body, &present, &trend);
    let since = latency.until_acting(snapshot.step);
    let mut guide = Guide::new(&road, &at, &mpc.problem.u_prev, since, (p, body, hold), &trend);
    let around = Surroundings { nominal: adapter.nominal(), hold };

    let mut change = Perturbation::new(mpc.plan.u.len());
    let x_0 = full_state::<Dual64, N_X>(&at);
    change.x_0 = x_0.map(|x| x.eps);
    let before =
        Before { v_x: at.x[V_X] * 1.5 - mpc.schedule.x[1][V_X] * 0.5, disturbance: guide.disturbance_before() };
    let mut ideal = FeedForward::new(body, hold.step, &at.x, mpc.past, before);
    let mut increments = Vec::with_capacity(change.stages.len());
    for (i, stage) in change.stages.iter_mut().enumerate() {
        let node = |i: usize| if i == 0 { x_0 } else { mpc.schedule.x[i].map(Dual64::from) };
        let scheduled = middle(&node(i), &node(i + 1), &mpc.schedule.u[i].map(Dual64::from), body);
        let path = guide.advance(|kappa| scheduled.progress(kappa));
        let tyres = match &mut neighbours {
            Some(neighbours) => neighbours.at(&mpc.tyres[i], &scheduled.x, &scheduled.u, path.mu),
            None => fixed(&mpc.tyres[i]),
        };
        let (mut A, mut B) = (SMatrix::zeros(), SMatrix::zeros());
        let (mut d, mut x_ref) = (SVector::zeros(), SVector::zeros());
        let linear = Linear { A: &mut A, B: &mut B, d: &mut d, x_ref: &mut x_ref };
        linearise::<Dual64, N_X>(&scheduled, &path, &tyres, &around, linear);
        increments.push(ideal.advance(scheduled.x[V_X], &path, &tyres));
        *stage = Stage {
            A: A.map(|a| a.eps),
            B: B.map(|b| b.eps),
            d: d.map(|d| d.eps),
            x_ref: x_ref.map(|x| x.eps),
            du_ref: SVector::zeros(),
        };
    }
    ideal.executable(&mut increments, hold.decay[DELTA], mpc.problem.du_max[DELTA]);
    for (stage, increment) in change.stages.iter_mut().zip(&increments) {
        stage.du_ref[DELTA] = increment.eps;
    }
    let tangent = mpc.structured.tangent(&mpc.problem, &mpc.solution, &change);

    let mut output = Output::initial(&Tyres::secant(0.0, 0.0));
    output.delta = tangent.u[0][DELTA];
    output.a_x = tangent.u[0][A_X];
    let last = tangent.u.len() - 1;
    for (i, (x, u)) in tangent.x[1..].iter().zip(&tangent.u).enumerate() {
        output.set_stage(i, &vehicle_part(x), u);
    }
    output.hold_from(last);
    // The slack is that of the worst stage.
    let excess = |i: &usize| mpc.problem.excess(&mpc.solution.x[*i]);
    if let Some(worst) = (1..=last + 1).max_by(|a, b| excess(a).total_cmp(&excess(b))).filter(|i| excess(i) > 0.0) {
        output.slack_e_y = mpc.solution.x[worst][E_Y].signum() * tangent.x[worst][E_Y];
    }
    Some(output)
}
