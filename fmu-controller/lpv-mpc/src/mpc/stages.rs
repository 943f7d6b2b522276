//! The stages of the quadratic programme, filled along the schedule; on the first sample the schedule is steady driving.

use super::{Mpc, TyreModel};
use crate::feedforward::{Before, FeedForward};
use crate::guide::Guide;
use crate::hold::Hold;
use crate::horizon::{Surroundings, linearise, middle, steady_state, vehicle_part};
use crate::lanes::Work;
use crate::model::{Body, DELTA, E_PSI, E_Y, Input, Tyres, V_X};
use crate::recovery::Recovery;

/// A car that is to stand does not want to drive away sooner [s]: at the default rate 0.1 rad are steered meanwhile.
const SOON: f64 = 0.13;

impl<const N_X: usize> Mpc<N_X> {
    /// A schedule for the first sample: steady cornering on the path, at the speed to be followed.
    pub(super) fn expect_steady_driving(&mut self, mut guide: Guide<'_, f64>, body: &Body, tyres: &Tyres) {
        let mut pace = self.problem.x_0[V_X];
        for (x, u) in self.plan.x[1..].iter_mut().zip(&mut self.plan.u) {
            let path = guide.advance(|_| pace);
            pace = path.v_x;
            *x = steady_state(path.v_x, path.kappa[1], body, tyres);
            *u = Input::from([(body.l_f + body.l_r) * path.kappa[0], 0.0]);
        }
    }

    /// Fills the stages of the quadratic programme along the schedule.
    #[inline(always)]
    fn model(
        &mut self,
        (mut guide, recovery): (Guide<'_, f64>, Option<&Recovery>),
        hold: &Hold,
        body: &Body,
        tyres: &mut impl TyreModel,
    ) {
        let around = Surroundings { nominal: tyres.nominal(), hold };
        tyres.restart();
        (self.fastest, self.permitted) = (0.0, 0.0);
        self.schedule.take(&self.plan);
        let from = vehicle_part(&self.problem.x_0);
        // In the middle of the stage before, as the plan goes on from there.
        let v_x = 1.5 * self.schedule.x[0][V_X] - 0.5 * self.schedule.x[1][V_X];
        let before = Before { v_x, disturbance: guide.disturbance_before() };
        let mut ideal = FeedForward::new(body, hold.step, &from, self.past, before);
        for (i, stage) in self.problem.stages.iter_mut().enumerate() {
            let at = middle(&self.schedule.x[i], &self.schedule.x[i + 1], &self.schedule.u[i], body);
            let path = guide.advance(|kappa| at.progress(kappa));
            self.tyres[i] = tyres.at(&at.x, &at.u, path.mu);
            if i as f64 * hold.step < SOON {
                self.fastest = self.fastest.max(path.wanted);
            }
            self.permitted = self.permitted.max(path.permitted);
            linearise(&at, &path, &self.tyres[i], &around, stage.into());
            self.increments[i] = ideal.advance(at.x[V_X], &path, &self.tyres[i]);
            if let Some(recovery) = recovery {
                let (e_y, e_psi) = recovery.at(i, path.v_x);
                stage.x_ref[E_Y] += e_y;
                stage.x_ref[E_PSI] += e_psi;
            }
        }
        self.next = ideal.executable(&mut self.increments, hold.decay[DELTA], self.problem.du_max[DELTA]);
        // The way back from far off the path is another one.
        let share = recovery.map_or(1.0, |recovery| recovery.path);
        for (stage, increment) in self.problem.stages.iter_mut().zip(&self.increments) {
            stage.du_ref[DELTA] = share * increment;
        }
    }
}

/// [`Mpc::model`] with its arguments.
pub(super) struct Modelling<'a, const N_X: usize, M> {
    pub mpc: &'a mut Mpc<N_X>,
    pub guide: Guide<'a, f64>,
    pub recovery: Option<&'a Recovery>,
    pub hold: &'a Hold,
    pub body: &'a Body,
    pub tyres: &'a mut M,
}

impl<const N_X: usize, M: TyreModel> Work for Modelling<'_, N_X, M> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { mpc, guide, recovery, hold, body, tyres } = self;
        mpc.model((guide, recovery), hold, body, tyres);
    }
}
