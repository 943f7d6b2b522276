//! The set that the method finds, against all sets there are.

use super::super::active::Active;
use super::super::{CONFIRMING_SWEEPS, Outcome, Problem, Solution, Structured};
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector1, Vector2};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const N: usize = 3;
type Plan = ([SVector<f64, 2>; N + 1], [Vector1<f64>; N]);

/// A double integrator far from where it should be, with bounds that are multiples of each other.
fn problem(random: &mut Pcg64Mcg) -> Problem<2, 1> {
    let mut problem = Problem::new(N);
    for stage in &mut problem.stages {
        stage.A = SMatrix::<f64, 2, 2>::new(1.0, 1.0, 0.0, 1.0);
        stage.B = Vector2::new(0.5, 1.0);
        stage.d = Vector2::new(0.0, random.random_range(-0.3..0.3));
        stage.x_ref = Vector2::new(random.random_range(-3.0..3.0), 0.0);
        stage.du_ref = Vector1::new(random.random_range(-0.5..0.5));
    }
    problem.x_0 = Vector2::new(random.random_range(-2.0..2.0), random.random_range(-2.0..2.0));
    problem.q = Vector2::new(1.0, random.random_range(0.0..0.3));
    problem.q_terminal = SMatrix::from_diagonal(&problem.q);
    problem.r = Vector1::new(random.random_range(0.01..1.0));
    (problem.u_min[0], problem.u_max[0]) = (-1.0, 1.0);
    problem.du_max[0] = [0.5, 1.0, 2.0][random.random_range(0..3)];
    problem.u_prev[0] = [-1.0, -0.5, 0.0, 1.0][random.random_range(0..4)];
    (problem.soft_state, problem.soft_bound, problem.soft) = (0, random.random_range(0.2..2.0), 3.0);
    problem
}

fn predicted(problem: &Problem<2, 1>, u: &DVector<f64>) -> Plan {
    let mut x = [problem.x_0; N + 1];
    for (i, stage) in problem.stages.iter().enumerate() {
        x[i + 1] = stage.A * x[i] + stage.B * u[i] + stage.d;
    }
    (x, std::array::from_fn(|i| Vector1::new(u[i])))
}

fn is_feasible(problem: &Problem<2, 1>, u: &DVector<f64>) -> bool {
    // What a solve of three equations leaves.
    let noise = 1e-9;
    (0..N).all(|i| {
        let du = u[i] - if i > 0 { u[i - 1] } else { problem.u_prev[0] };
        u[i].abs() <= 1.0 + noise && du.abs() <= problem.du_max[0] + noise
    })
}

/// Signs of the figures of a number to base three.
fn signs<const M: usize>(mut number: usize) -> [i8; M] {
    std::array::from_fn(|_| {
        let sign = [0, 1, -1][number % 3];
        number /= 3;
        sign
    })
}

/// The cheapest of the plans that fulfil their bounds among those that any set of bounds determines.
fn cheapest(problem: &Problem<2, 1>) -> (f64, Plan) {
    let (free, _) = predicted(problem, &DVector::zeros(N));
    let columns: [_; N] = std::array::from_fn(|j| {
        let (x, _) = predicted(problem, &DVector::from_fn(N, |i, _| f64::from(u8::from(i == j))));
        std::array::from_fn::<_, { N + 1 }, _>(|i| x[i] - free[i])
    });
    let difference = DMatrix::from_fn(N, N, |i, j| f64::from(i8::from(i == j) - i8::from(i == j + 1)));
    let mut best = (f64::INFINITY, predicted(problem, &DVector::zeros(N)));
    for sides in (0..27).map(signs::<N>) {
        let mut hessian = difference.tr_mul(&difference) * problem.r[0];
        let mut slope = DVector::zeros(N);
        slope[0] = -problem.r[0] * problem.u_prev[0];
        slope -= difference.tr_mul(&DVector::from_fn(N, |i, _| problem.stages[i].du_ref[0])) * problem.r[0];
        for i in 0..N {
            let row = |k: usize| DVector::from_fn(N, |j, _| columns[j][i + 1][k]);
            let mut add = |k: usize, weight: f64, target: f64| {
                hessian += row(k) * row(k).transpose() * weight;
                slope += row(k) * (weight * (free[i + 1][k] - target));
            };
            add(0, problem.q[0], problem.stages[i].x_ref[0]);
            add(1, problem.q[1], 0.0);
            if sides[i] != 0 {
                add(0, problem.soft, f64::from(sides[i]) * problem.soft_bound);
            }
        }
        for bounds in (0..729).map(signs::<{ 2 * N }>) {
            let active: Vec<usize> = (0..2 * N).filter(|row| bounds[*row] != 0).collect();
            if active.len() > N {
                continue;
            }
            let size = N + active.len();
            let mut matrix = DMatrix::zeros(size, size);
            let mut right = DVector::zeros(size);
            matrix.view_mut((0, 0), (N, N)).copy_from(&hessian);
            right.rows_mut(0, N).copy_from(&-&slope);
            for (w, row) in active.iter().enumerate() {
                let (i, side) = (row % N, f64::from(bounds[*row]));
                let mut coefficients = DVector::zeros(N);
                coefficients[i] = 1.0;
                right[N + w] = side;
                if *row >= N {
                    coefficients.copy_from(&difference.row(i).transpose());
                    right[N + w] = side * problem.du_max[0] + if i == 0 { problem.u_prev[0] } else { 0.0 };
                }
                matrix.view_mut((N + w, 0), (1, N)).copy_from(&coefficients.transpose());
                matrix.view_mut((0, N + w), (N, 1)).copy_from(&coefficients);
            }
            let Some(solution) = matrix.lu().solve(&right) else { continue };
            let u = solution.rows(0, N).into_owned();
            if is_feasible(problem, &u) {
                let plan = predicted(problem, &u);
                let cost = problem.cost(&plan.0, &plan.1);
                if cost < best.0 {
                    best = (cost, plan);
                }
            }
        }
    }
    best
}

#[test]
fn set_found_from_any_start_gives_the_cheapest_of_all_plans() {
    let random = &mut Pcg64Mcg::seed_from_u64(1);
    let mut with_bounds = 0;
    for case in 0..20 {
        let problem = problem(random);
        let (cost, (_, want)) = cheapest(&problem);
        with_bounds += u32::from(want.iter().any(|u| u[0].abs() > 1.0 - 1e-9));
        for start in 0..30 {
            let mut solver = Structured::<2, 1>::new(N);
            let mut solution = Solution::new(N);
            solution.x[0] = problem.x_0;
            for i in 0..N {
                let [level, rate, side] = signs(random.random_range(0..27));
                solver.active[i][0] = Active { level, rate };
                solver.sides[i] = side;
            }
            let found = solver.find_active_set(&problem, &mut solution);
            assert!(found, "case {case}, start {start}");
            assert!(solver.descend(&problem, &mut solution, CONFIRMING_SWEEPS), "case {case}, start {start}");
            assert_eq!(solution.outcome, Outcome::Optimal);
            let error = (0..N).map(|i| (solution.u[i] - want[i]).amax()).fold(0.0, f64::max);
            let got = problem.cost(&solution.x, &solution.u);
            // Both are direct solutions of well-conditioned equations; the cost is flat around its minimum.
            assert!(error < 1e-8 && (got - cost).abs() < 1e-11 * cost, "case {case}, start {start}: off by {error:e}");
        }
    }
    assert!(with_bounds > 5, "only {with_bounds} cases have active bounds");
}
