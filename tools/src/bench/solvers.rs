//! Our solvers on the clock: the structured one, both forms of Clarabel, and the condensing that dense solvers need first.

use std::hint::black_box;
use std::time::Instant;

use lpv_mpc::qp::{Clarabel, Outcome, Solution, Structured, optimality};
use nalgebra::{DMatrix, DVector, SVector};

use super::file::{NU, NX, Problem};

/// Clarabel's own default, which is what its users run.
const CLARABEL_TOLERANCE: f64 = 1e-8;
/// Residual that makes a solution a reference; its check knows nothing of the solver that found it.
const REFERENCE_RESIDUAL: f64 = 1e-7;

/// One problem solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Time taken [s].
    pub seconds: f64,
    /// First input of the plan.
    pub u: SVector<f64, NU>,
    /// Whether the solver says that it solved it.
    pub solved: bool,
}

/// Something that solves a problem after the other and reports its time.
pub trait Solver {
    /// Solves the next problem in the order of time.
    fn solve(&mut self, problem: &Problem) -> Run;

    /// Forgets what earlier problems left behind.
    fn restart(&mut self);
}

fn run(seconds: f64, solution: &Solution<NX, NU>, outcome: Outcome) -> Run {
    Run { seconds, u: solution.u[0], solved: outcome.is_solved() }
}

/// The structured solver with its shifted warm start.
pub struct OnStructure(Structured<NX, NU>, Solution<NX, NU>);

impl OnStructure {
    pub fn new(horizon: usize) -> Self {
        Self(Structured::new(horizon), Solution::new(horizon))
    }
}

impl Solver for OnStructure {
    fn solve(&mut self, problem: &Problem) -> Run {
        let Self(solver, solution) = self;
        let start = Instant::now();
        solver.shift();
        solver.solve(black_box(problem), solution);
        run(start.elapsed().as_secs_f64(), black_box(solution), solution.outcome)
    }

    fn restart(&mut self) {
        self.0.reset();
    }
}

/// Clarabel, with one workspace for all problems or a new one for each.
pub struct General {
    solver: Clarabel<NX, NU>,
    solution: Solution<NX, NU>,
    anew: bool,
}

impl General {
    pub fn new(horizon: usize, anew: bool) -> Self {
        Self { solver: Clarabel::new(CLARABEL_TOLERANCE), solution: Solution::new(horizon), anew }
    }
}

impl Solver for General {
    fn solve(&mut self, problem: &Problem) -> Run {
        if self.anew {
            self.solver.reset();
        }
        let start = Instant::now();
        self.solver.solve(black_box(problem), &mut self.solution);
        run(start.elapsed().as_secs_f64(), black_box(&self.solution), self.solution.outcome)
    }

    // The workspace holds no answer, and keeping it is what this form is about.
    fn restart(&mut self) {}
}

/// The condensed problem: Hessian, slope.
pub struct Condensing {
    effect: DMatrix<f64>,
    hessian: DMatrix<f64>,
    slope: DVector<f64>,
    free: Vec<SVector<f64, NX>>,
}

impl Condensing {
    pub fn new(horizon: usize) -> Self {
        Self {
            effect: DMatrix::zeros(NX * horizon, NU * horizon),
            hessian: DMatrix::zeros(NU * horizon, NU * horizon),
            slope: DVector::zeros(NU * horizon),
            free: vec![SVector::zeros(); horizon],
        }
    }

    /// Eliminates the states, the step that a solver for dense problems cannot do without [s].
    ///
    /// The slope and the last block row of the Hessian come from costates, so that no product of full matrices is formed.
    pub fn time(&mut self, problem: &Problem) -> f64 {
        let start = Instant::now();
        let N = problem.stages.len();
        let mut x = problem.x_0;
        for (i, stage) in black_box(problem).stages.iter().enumerate() {
            x = stage.A * x + stage.d;
            self.free[i] = x;
            for j in 0..i {
                let before = self.effect.fixed_view::<NX, NU>(NX * (i - 1), NU * j).into_owned();
                self.effect.fixed_view_mut::<NX, NU>(NX * i, NU * j).copy_from(&(stage.A * before));
            }
            self.effect.fixed_view_mut::<NX, NU>(NX * i, NU * i).copy_from(&stage.B);
        }
        for j in 0..N {
            let mut costate = nalgebra::SMatrix::<f64, NX, NU>::zeros();
            let mut slope = SVector::<f64, NX>::zeros();
            for i in (j..N).rev() {
                let error = self.free[i] - problem.stages[i].x_ref;
                let effect = self.effect.fixed_view::<NX, NU>(NX * i, NU * j);
                if i + 1 == N {
                    costate = problem.q_terminal * effect;
                    slope = problem.q_terminal * error;
                } else {
                    let next = &problem.stages[i + 1].A;
                    costate = next.tr_mul(&costate);
                    slope = next.tr_mul(&slope);
                    for k in 0..NX {
                        for l in 0..NU {
                            costate[(k, l)] += problem.q[k] * effect[(k, l)];
                        }
                        slope[k] += problem.q[k] * error[k];
                    }
                }
                let block = problem.stages[i].B.tr_mul(&costate);
                self.hessian.fixed_view_mut::<NU, NU>(NU * i, NU * j).copy_from(&block);
            }
            self.slope.fixed_rows_mut::<NU>(NU * j).copy_from(&problem.stages[j].B.tr_mul(&slope));
        }
        black_box((&self.hessian, &self.slope));
        start.elapsed().as_secs_f64()
    }
}

/// First input that fulfils the conditions of optimality, from a solve without a warm start; none where no solver got there.
pub fn reference(problem: &Problem) -> Option<SVector<f64, NU>> {
    let mut solution = Solution::new(problem.stages.len());
    Structured::new(problem.stages.len()).solve(problem, &mut solution);
    if !solution.outcome.is_solved() || optimality::residual(problem, &solution) > REFERENCE_RESIDUAL {
        Clarabel::new(1e-12).solve(problem, &mut solution);
    }
    (solution.outcome.is_solved() && optimality::residual(problem, &solution) <= REFERENCE_RESIDUAL)
        .then_some(solution.u[0])
}

/// Error of a first input as a fraction of the inputs' ranges.
pub fn scaled_error(problem: &Problem, u: &SVector<f64, NU>, reference: &SVector<f64, NU>) -> f64 {
    (0..NU).map(|j| (u[j] - reference[j]).abs() / optimality::span(problem, j)).fold(0.0, f64::max)
}
