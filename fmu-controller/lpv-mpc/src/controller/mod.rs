//! The controller as its importer sees it: measurements in, commands out, one communication step at a time.

use serde::{Deserialize, Serialize};

use crate::adaptation::Adapter;
use crate::estimator::Estimator;
use crate::guide::Guide;
use crate::hold::Hold;
use crate::horizon::{NX_LAGS, vehicle_part};
use crate::jordan::Network;
use crate::ladder::{Status, safe_stop};
use crate::latency::Latency;
use crate::lateness::Lateness;
use crate::model::{
    A_X, Body, DELTA, Disturbance, E_PSI, E_Y, Input, NU, NX, State, Tyres, V_GUARD, V_X, V_Y, YAW_RATE,
};
use crate::modes::{Adaptation, Estimation};
use crate::mpc::Mpc;
use crate::qp::Problem;
use crate::recovery::Recovery;
use crate::sensitivity::{self, Snapshot};
use crate::signals::{Inputs, Output};
use crate::trend::Trend;
use crate::{Error, Parameters};

mod steps;

/// The predictive controller in the dimension that the actuators ask for.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Core {
    Ideal(Box<Mpc<NX>>),
    Lags(Box<Mpc<NX_LAGS>>),
}

macro_rules! with_mpc {
    ($core:expr, $mpc:ident => $body:expr) => {
        match $core {
            Core::Ideal($mpc) => $body,
            Core::Lags($mpc) => $body,
        }
    };
}

/// What the controller holds to be true, derived from its parameters.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Beliefs {
    body: Body,
    tyres: Adapter,
    /// Period and lags of the prediction model.
    hold: Hold,
}

/// Adaptive LPV-MPC of steering and speed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Controller {
    parameters: Parameters,
    beliefs: Beliefs,
    core: Core,
    latency: Latency,
    lateness: Lateness,
    estimator: Estimator,
    /// Samples since speed and position on the path were last measured.
    blind: usize,
    /// Time of the first sample [s].
    start: f64,
    /// Samples taken.
    samples: u64,
    /// The command that was given last.
    u_prev: Input,
    output: Output,
    /// Samples in the last communication step, and what the last of them started from.
    sampled: u32,
    snapshot: Snapshot,
}

impl Controller {
    /// A controller whose first sample is at time `start` [s], wheels straight, without a network.
    ///
    /// # Errors
    /// [`Error::Parameter`] names the first parameter outside its range, [`Error::NoNetwork`] an adaptation that needs one.
    pub fn new(parameters: Parameters, start: f64) -> Result<Self, Error> {
        if parameters.adaptation != Adaptation::Constant {
            return Err(Error::NoNetwork);
        }
        Self::build(parameters, start, None)
    }

    /// A controller that may adapt its tyres by a trained network. That of another car ([`crate::adaptation::other_car`]) is
    /// not used: the nominal tyres stay.
    ///
    /// # Errors
    /// [`Error::Parameter`] names the first parameter outside its range.
    pub fn with_network(parameters: Parameters, start: f64, network: Network) -> Result<Self, Error> {
        Self::build(parameters, start, Some(network))
    }

    fn build(parameters: Parameters, start: f64, network: Option<Network>) -> Result<Self, Error> {
        parameters.validate()?;
        let p = &parameters;
        let tau = [p.tau_delta, p.tau_a_x];
        let tyres = p.nominal_tyres();
        Ok(Self {
            beliefs: Beliefs { body: p.body(), tyres: Adapter::new(p, network), hold: Hold::new(p.t_s, tau) },
            estimator: Estimator::new(p.sensor_noise),
            blind: 0,
            core: if tau == [0.0, 0.0] {
                Core::Ideal(Box::new(Mpc::new(p)))
            } else {
                Core::Lags(Box::new(Mpc::new(p)))
            },
            latency: Latency::new(start, p.input_delay, tau, p.t_s),
            lateness: Lateness::new(),
            start,
            samples: 0,
            u_prev: Input::zeros(),
            output: Output::initial(&tyres),
            sampled: 0,
            snapshot: Snapshot::new(&tyres, p.sensor_noise),
            parameters,
        })
    }

    /// The parameters in force.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Changes weights and bounds between steps; what shapes the controller (horizon, period, delays) must stay.
    ///
    /// # Errors
    /// [`Error::Parameter`] names the first parameter outside its range; nothing is changed then.
    pub fn tune(&mut self, parameters: &Parameters) -> Result<(), Error> {
        parameters.validate()?;
        self.parameters.clone_from(parameters);
        self.beliefs.body = parameters.body();
        self.beliefs.tyres.tune(parameters);
        with_mpc!(&mut self.core, mpc => mpc.tune(parameters));
        Ok(())
    }

    /// The quadratic programme of the last sample, when the actuators are ideal.
    pub fn problem(&self) -> Option<&Problem<NX, NU>> {
        match &self.core {
            Core::Ideal(mpc) => Some(&mpc.problem),
            Core::Lags(_) => None,
        }
    }

    /// Samples taken so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// What is visible now.
    pub fn output(&self) -> &Output {
        &self.output
    }

    /// One sample with what was measured at `t` [s], whose command is visible after `h` [s]: estimate, predict over the
    /// latency, plan, take the first command.
    #[inline(always)]
    fn sample(&mut self, t: f64, h: f64, inputs: &Inputs) {
        let (duration, delivered) = self.latency.advance(t);
        // Tyres are judged by what was measured, not by what was made up for it.
        let is_known = self.output.status < Status::Estimated && self.estimator.is_settled();
        if self.parameters.estimation == Estimation::Kalman && is_known {
            let Self { beliefs: Beliefs { body, tyres, .. }, estimator, snapshot, latency, lateness, .. } = self;
            tyres.learn(&estimator.x, &snapshot.delivered, &mut estimator.trend.now, duration, body);
            // What the tyres do not explain.
            if self.parameters.adaptation != Adaptation::Constant && estimator.x[V_X] > V_GUARD && duration > 0.0 {
                let gives = tyres.present().c_f * body.l_f / body.i_z;
                lateness.learn(snapshot.delivered[DELTA], gives, estimator.trend.now[YAW_RATE], duration);
                latency.set_late(lateness.seconds());
            }
        }
        (self.snapshot.inputs, self.snapshot.estimator) = (*inputs, self.estimator);
        (self.snapshot.duration, self.snapshot.delivered, self.snapshot.step) = (duration, delivered, h);
        (self.snapshot.tyres[0], self.snapshot.memory) = (*self.beliefs.tyres.present(), self.beliefs.tyres.memory());
        let (x, trend, complete) = self.estimate(inputs, duration, &delivered);
        let Self { parameters: p, beliefs: Beliefs { body, tyres, hold }, core, latency, .. } = self;
        let road = inputs.road(p);
        tyres.observe(&x, &delivered, road.friction(0.0));
        self.snapshot.tyres[1] = *tyres.present();
        let at = latency.predict(&x, h, |s| road.curvature(s), body, tyres.present(), &trend);
        let u_prev = self.u_prev;
        let guide = Guide::new(&road, &at, &u_prev, latency.until_acting(h), (p, body, hold), &trend);
        let recovery = Recovery::new(&at, road.friction(at.distance), p);
        let guide = recovery.iter().fold(guide, |guide, recovery| guide.no_faster_than(recovery.pace));
        let sighted = self.blind < p.horizon && (p.estimation == Estimation::Measured || self.estimator.is_started());
        let (status, command) = with_mpc!(core, mpc => {
            let outcome = mpc.step(&at, &u_prev, (&guide, recovery.as_ref()), hold, body, tyres);
            // Without an answer the plan has only moved on; its next command is as good as it was foreseen.
            if mpc.plan.is_left() && sighted {
                (Status::of(outcome, complete), mpc.plan.u[0])
            } else {
                (Status::SafeStop, safe_stop(&u_prev, inputs.v_x, p))
            }
        });
        self.u_prev = command;
        self.publish(status);
    }

    /// Derivative of the output along a `direction` of the inputs that were held during the last communication step.
    ///
    /// The result is an [`Output`] whose quantities are derivatives; those of status, iterations, beliefs and residual are not
    /// followed and zero. The command and plan of a step in which no sample was taken, or no new plan was found, do not depend
    /// on its inputs: all derivatives are zero. Where an infinitesimal change alters the active set the derivative of the side
    /// on which the solver ended is returned.
    ///
    /// # Errors
    /// [`Error::NoDerivative`] when the plan is not an exact optimum, is the first one (it finds its own schedule in several
    /// passes), leads a car back that is far off the path, or when several samples followed each other in the step.
    pub fn along(&self, direction: &Inputs) -> Result<Output, Error> {
        if self.sampled == 0 || self.output.status >= Status::PreviousPlan {
            return Ok(Output::initial(&Tyres::secant(0.0, 0.0)));
        }
        if self.sampled > 1 {
            return Err(Error::NoDerivative("several samples were taken in one step"));
        }
        let Self { parameters, beliefs: Beliefs { body, tyres, hold }, latency, snapshot, .. } = self;
        let given = (parameters, body, tyres, hold, latency);
        with_mpc!(&self.core, mpc => sensitivity::along(mpc, snapshot, direction, given)).ok_or(Error::NoDerivative(
            "the plan is the first one, leads back from far off the path, or is not an exact optimum",
        ))
    }

    /// State and unexplained accelerations at the measurement, and whether all of it was measured and believed.
    #[inline(always)]
    fn estimate(&mut self, inputs: &Inputs, duration: f64, delivered: &Input) -> (State, Trend, bool) {
        let mut measured = inputs.state();
        if self.parameters.estimation == Estimation::Measured {
            return (measured, Trend::steady(Disturbance::zeros()), true);
        }
        let usable = |i: usize| measured[i].is_finite();
        self.blind = if usable(V_X) && usable(E_Y) && usable(E_PSI) { 0 } else { self.blind + 1 };
        let complete = measured.iter().all(|z| z.is_finite());
        if !self.parameters.v_y_measured {
            measured[V_Y] = f64::NAN;
        }
        let Beliefs { body, tyres, .. } = &self.beliefs;
        if self.estimator.update(&measured, inputs.kappa_ref[0], delivered, duration, body, tyres.present()) {
            // Some importers show zeros until the first exchange of values: a plan for a car at rest serves no moving one.
            with_mpc!(&mut self.core, mpc => mpc.forget());
        }
        (self.estimator.x, self.estimator.trend, complete && !self.estimator.doubts())
    }

    #[inline(always)]
    fn publish(&mut self, status: Status) {
        let Self { output, .. } = self;
        output.delta = self.u_prev[DELTA];
        output.a_x = self.u_prev[A_X];
        (output.c_f, output.c_r, output.confidence) = self.beliefs.tyres.believed();
        output.status = status;
        with_mpc!(&self.core, mpc => {
            (output.iterations, output.kkt_residual, output.slack_e_y) = mpc.diagnostics();
            // Without an answer they are infinite, which not every importer can show.
            (output.kkt_residual, output.slack_e_y) =
                (output.kkt_residual.min(f64::MAX), output.slack_e_y.min(f64::MAX));
            if !mpc.plan.is_left() {
                // What stands there may not even be finite; the trajectories shown stay those of the last plan.
                return;
            }
            for (i, (x, u)) in mpc.plan.x[1..].iter().zip(&mpc.plan.u).enumerate() {
                output.set_stage(i, &vehicle_part(x), u);
            }
            output.hold_from(mpc.plan.u.len() - 1);
        });
    }
}
