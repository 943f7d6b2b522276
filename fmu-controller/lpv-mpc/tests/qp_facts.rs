//! What is known of solutions without another solver: closed forms, limits, symmetry, refusals, repeatability.
#![allow(non_snake_case, reason = "matrices keep the paper's capitals")]

mod qp_support;

use lpv_mpc::qp::{Clarabel, Outcome, Problem, Solution, Structured, optimality};
use nalgebra::{SMatrix, SVector, Vector1, Vector2};
use qp_support::{Stress, random_problem, violation};

const STRESS: Stress =
    Stress { seed: 11, horizon: 10, growth: 0.5, decades: 2.0, demand: 3.0, degenerate: false, outside: false };

fn solve<const NX: usize, const NU: usize>(problem: &Problem<NX, NU>) -> Solution<NX, NU> {
    let mut solution = Solution::new(problem.stages.len());
    Structured::new(problem.stages.len()).solve(problem, &mut solution);
    solution
}

/// A double integrator with a position to be reached.
fn double_integrator(horizon: usize) -> Problem<2, 1> {
    let mut problem = Problem::new(horizon);
    for stage in &mut problem.stages {
        stage.A = SMatrix::<f64, 2, 2>::new(1.0, 0.1, 0.0, 1.0);
        stage.B = Vector2::new(0.005, 0.1);
        stage.x_ref = Vector2::new(1.0, 0.0);
    }
    problem.q = Vector2::new(10.0, 1.0);
    problem.q_terminal = SMatrix::from_diagonal(&problem.q);
    problem.r = Vector1::new(0.1);
    problem
}

#[test]
fn one_free_stage_matches_the_normal_equations() {
    let mut problem = random_problem::<5, 2>(&Stress { horizon: 1, ..STRESS });
    problem.u_min.fill(f64::NEG_INFINITY);
    problem.u_max.fill(f64::INFINITY);
    problem.du_max.fill(f64::INFINITY);
    problem.soft = 0.0;
    let stage = problem.stages[0];
    let W = problem.q_terminal;
    let R = SMatrix::<f64, 2, 2>::from_diagonal(&problem.r);
    let error = stage.A * problem.x_0 + stage.d - stage.x_ref;
    let hessian = stage.B.transpose() * W * stage.B + R;
    let u = hessian.lu().solve(&(R * (problem.u_prev + stage.du_ref) - stage.B.transpose() * W * error)).unwrap();
    let solution = solve(&problem);
    assert_eq!(solution.outcome, Outcome::Optimal);
    // Two direct solutions of a system of two: only rounding differs.
    assert!((solution.u[0] - u).amax() < 1e-12 * (1.0 + u.amax()), "got {}, want {u}", solution.u[0]);
}

#[test]
fn long_horizon_gain_solves_the_riccati_equation() {
    let problem = double_integrator(80);
    let stage = problem.stages[0];
    // State and previous input together, driven by the increment: the stationary equation by fixed-point iteration.
    let mut A = SMatrix::<f64, 3, 3>::identity();
    A.fixed_view_mut::<2, 2>(0, 0).copy_from(&stage.A);
    A.fixed_view_mut::<2, 1>(0, 2).copy_from(&stage.B);
    let B = SMatrix::<f64, 3, 1>::new(stage.B[0], stage.B[1], 1.0);
    let Q = SMatrix::<f64, 3, 3>::from_diagonal(&SVector::from([problem.q[0], problem.q[1], 0.0]));
    let mut P = Q;
    let mut K = SMatrix::<f64, 1, 3>::zeros();
    for _ in 0..2000 {
        K = -(B.transpose() * P * A) / (problem.r[0] + (B.transpose() * P * B)[0]);
        P = Q + A.transpose() * P * (A + B * K);
    }
    let solution = solve(&problem);
    // The closed loop forgets the end of the horizon by about 0.75 per sample.
    let got = SVector::from([solution.gain[0], solution.gain[1], solution.gain_u_prev[0] - 1.0]);
    assert!((got - K.transpose()).amax() < 1e-6, "got {got}, want {K}");
}

#[test]
fn plan_of_the_mirrored_problem_is_mirrored() {
    let problem = random_problem::<7, 2>(&STRESS);
    let mut mirrored = problem.clone();
    mirrored.x_0 = -problem.x_0;
    mirrored.u_prev = -problem.u_prev;
    (mirrored.u_min, mirrored.u_max) = (-problem.u_max, -problem.u_min);
    for stage in &mut mirrored.stages {
        stage.d = -stage.d;
        stage.x_ref = -stage.x_ref;
        stage.du_ref = -stage.du_ref;
    }
    let (one, other) = (solve(&problem), solve(&mirrored));
    assert!(one.mu_u.iter().chain(&one.mu_du).any(|mu| mu.amax() > 0.0), "the case must have active bounds");
    for (u, u_mirrored) in one.u.iter().zip(&other.u) {
        // Every operation is odd, so not even rounding may differ.
        assert_eq!(*u, -u_mirrored);
    }
}

#[test]
fn same_problem_gives_the_same_bits() {
    let mut solver = Structured::<5, 2>::new(10);
    let mut first = Solution::new(10);
    let mut again = Solution::new(10);
    for seed in 0..200 {
        let problem = random_problem::<5, 2>(&Stress { seed, degenerate: seed % 2 == 0, ..STRESS });
        let saved = serde_json::to_string(&solver).unwrap();
        let mut copy = solver.clone();
        let mut restored: Structured<5, 2> = serde_json::from_str(&saved).unwrap();
        solver.shift();
        solver.solve(&problem, &mut first);
        copy.shift();
        copy.solve(&problem, &mut again);
        assert_eq!(first, again, "clone, seed {seed}");
        restored.shift();
        restored.solve(&problem, &mut again);
        assert_eq!(first, again, "saved and restored, seed {seed}");
    }
}

#[test]
fn warm_start_changes_the_work_and_not_the_answer() {
    let problem = random_problem::<5, 2>(&STRESS);
    let mut solver = Structured::new(10);
    let mut cold = Solution::new(10);
    solver.solve(&problem, &mut cold);
    let mut warm = Solution::new(10);
    solver.solve(&problem, &mut warm);
    assert!(cold.iterations > 1 && warm.iterations == 1, "{} then {} sweeps", cold.iterations, warm.iterations);
    for (a, b) in cold.u.iter().zip(&warm.u) {
        // The same active set, reached through other plans.
        assert!((a - b).amax() < 1e-12 * (1.0 + a.amax()), "{a} {b}");
    }
}

#[test]
fn soft_bound_yields_by_what_its_weight_says() {
    let mut problem = double_integrator(1);
    problem.q.fill(0.0);
    problem.q_terminal.fill(0.0);
    problem.x_0 = Vector2::new(2.0, 0.0);
    (problem.soft_state, problem.soft_bound, problem.soft) = (0, 1.0, 3.0);
    let solution = solve(&problem);
    // minimise r u^2 + soft (2 + b u - 1)^2
    let b = problem.stages[0].B[0];
    let u = -problem.soft * b / (problem.r[0] + problem.soft * b * b);
    assert!((solution.u[0][0] - u).abs() < 1e-14, "got {}, want {u}", solution.u[0][0]);
    assert!((solution.slack - (1.0 + b * u)).abs() < 1e-14, "slack {}", solution.slack);
}

#[test]
fn input_meets_both_of_its_bounds_at_a_corner() {
    // Two samples; the second wants to be high, the first low, and the rate ties them: both end where the second's bounds meet.
    let mut problem = Problem::<2, 1>::new(2);
    problem.stages[0].B = Vector2::new(1.0, 0.0);
    problem.stages[1].A = SMatrix::zeros();
    problem.stages[1].B = Vector2::new(0.0, 1.0);
    problem.stages[0].x_ref = Vector2::new(-0.4, 0.0);
    problem.stages[1].x_ref = Vector2::new(0.0, 9.0);
    problem.q = Vector2::new(1.0, 0.0);
    problem.q_terminal = SMatrix::from_diagonal(&Vector2::new(0.0, 1.0));
    problem.r = Vector1::new(1e-3);
    problem.u_min.fill(-1.0);
    problem.u_max.fill(1.0);
    problem.du_max.fill(1.0);
    let solution = solve(&problem);
    assert_eq!(solution.outcome, Outcome::Optimal);
    assert!(solution.u[0][0].abs() < 1e-15 && (solution.u[1][0] - 1.0).abs() < 1e-15, "{:?}", solution.u);
    assert!(solution.mu_u[1][0] > 0.0 && solution.mu_du[1][0] > 0.0);
}

#[test]
fn inputs_without_room_stay_where_they_are() {
    let mut problem = double_integrator(10);
    problem.u_min.fill(-1.0);
    problem.u_max.fill(1.0);
    problem.u_prev.fill(7.0);
    problem.du_max.fill(0.0);
    let solution = solve(&problem);
    assert_eq!(solution.outcome, Outcome::Optimal);
    assert!(solution.u.iter().all(|u| u[0] == 1.0), "moved into the bounds and held: {:?}", solution.u);
    problem.du_max.fill(0.5);
    problem.u_min.fill(0.25);
    problem.u_max.fill(0.25);
    let solution = solve(&problem);
    assert_eq!(solution.outcome, Outcome::Optimal);
    assert!(solution.u.iter().all(|u| u[0] == 0.25), "{:?}", solution.u);
}

#[test]
fn data_without_sense_is_refused_by_both_solvers() {
    type Spoil = fn(&mut Problem<2, 1>);
    let refused: [(&str, Spoil); 12] = [
        ("no number in A", |p| p.stages[3].A[(0, 1)] = f64::NAN),
        ("infinite d", |p| p.stages[9].d[0] = f64::INFINITY),
        ("no number in d, the input held", |p| (p.stages[5].d[1], p.du_max[0]) = (f64::NAN, 0.0)),
        ("infinite d, the input a single point", |p| (p.stages[0].d[1], p.u_min[0]) = (f64::INFINITY, p.u_max[0])),
        ("no number in the state", |p| p.x_0[1] = f64::NAN),
        ("infinite input before", |p| p.u_prev[0] = f64::NEG_INFINITY),
        ("negative weight", |p| p.q[0] = -1.0),
        ("no weight on increments", |p| p.r[0] = 0.0),
        ("crossed bounds", |p| (p.u_min[0], p.u_max[0]) = (1.0, -1.0)),
        ("negative rate", |p| p.du_max[0] = -1.0),
        ("soft bound on no state", |p| p.soft_state = 2),
        ("no horizon", |p| p.stages.clear()),
    ];
    for (name, spoil) in refused {
        let mut problem = double_integrator(10);
        spoil(&mut problem);
        let mut solution = Solution::new(10);
        Structured::new(problem.stages.len()).solve(&problem, &mut solution);
        assert_eq!(solution.outcome, Outcome::Invalid, "structured, {name}");
        Clarabel::new(1e-8).solve(&problem, &mut solution);
        assert_eq!(solution.outcome, Outcome::Invalid, "Clarabel, {name}");
    }
    let mut solution = Solution::new(10);
    Structured::new(9).solve(&double_integrator(10), &mut solution);
    assert_eq!(solution.outcome, Outcome::Invalid, "another horizon");
}

#[test]
fn numbers_beyond_reason_never_give_a_plan_of_nans() {
    for magnitude in [1e100, 1e150, 1e200, 1e300] {
        let mut problem = double_integrator(10);
        problem.u_max.fill(1.0);
        problem.u_min.fill(-1.0);
        problem.stages[4].A[(0, 1)] = magnitude;
        problem.x_0[1] = 1.0;
        let solution = solve(&problem);
        if solution.outcome.has_plan() {
            assert!(qp_support::is_finite(&solution), "magnitude {magnitude:e}: {:?}", solution.outcome);
        }
    }
}

#[test]
fn clarabel_answers_equal_problems_with_equal_bits_whatever_came_before() {
    let problem = random_problem::<5, 2>(&STRESS);
    let mut used = Clarabel::new(1e-8);
    let mut solution = Solution::new(10);
    used.solve(&random_problem::<5, 2>(&Stress { seed: 5, decades: 4.0, ..STRESS }), &mut solution);
    // Another soft state has another sparsity; it must not linger.
    used.solve(&random_problem::<5, 2>(&Stress { seed: 6, ..STRESS }), &mut solution);
    used.solve(&problem, &mut solution);
    let mut fresh = Solution::new(10);
    Clarabel::new(1e-8).solve(&problem, &mut fresh);
    assert_eq!(solution, fresh);
}

/// The problem's outcome, once its plan is seen to hold the bounds and, where it counts as optimal, the conditions of optimality.
fn checked<const NX: usize>(stress: &Stress) -> Outcome {
    let problem = random_problem::<NX, 2>(stress);
    let solution = solve(&problem);
    let (bounds, prediction) = violation(&problem, &solution);
    // As in the comparison with Clarabel.
    assert!(bounds <= 1e-9 && prediction <= 1e-9, "bounds {bounds:e}, prediction {prediction:e}: {stress:?}");
    let residual = optimality::residual(&problem, &solution);
    assert!(solution.outcome.is_solved() && residual <= 1e-6, "{:?}, {residual:e}: {stress:?}", solution.outcome);
    solution.outcome
}

#[test]
fn interior_points_answer_where_no_active_set_settles() {
    // Two in a hundred thousand problems of the comparison with Clarabel. Powers differ in the last digit between platforms, and
    // either one may then find its active set after all.
    let outcomes = [
        checked::<5>(&Stress {
            seed: 9_705_582_631_361_101_479,
            horizon: 10,
            growth: 0.507_115_639_522_252_1,
            decades: 4.751_901_229_930_953_5,
            demand: 0.487_884_447_670_740_1,
            degenerate: false,
            outside: true,
        }),
        checked::<7>(&Stress {
            seed: 3_267_088_829_496_701_039,
            horizon: 61,
            growth: 2.707_167_579_206_005_5,
            decades: 0.576_619_904_265_935_9,
            demand: 1.968_471_749_082_066,
            degenerate: true,
            outside: true,
        }),
    ];
    assert!(outcomes.contains(&Outcome::InteriorPoint), "{outcomes:?}");
}
