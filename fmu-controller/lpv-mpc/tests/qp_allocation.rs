//! Solving allocates nothing: counted by the allocator itself.

mod qp_support;

use allocation_counter::measure;
use lpv_mpc::qp::{Outcome, Problem, Solution, Structured};
use qp_support::{Stress, random_problem};

#[test]
fn solve_and_shift_do_not_allocate() {
    let problems: Vec<Problem<7, 2>> = (0..300)
        .map(|seed| {
            random_problem(&Stress {
                seed,
                horizon: 40,
                growth: 1.0,
                decades: 3.0,
                demand: 3.0,
                degenerate: seed % 2 == 0,
                outside: seed % 3 == 0,
            })
        })
        .collect();
    let mut solver = Structured::<7, 2>::new(40);
    let mut solution = Solution::new(40);
    let invalid = Problem::new(0);
    let mut most = 0;
    assert!(measure(|| drop(solution.clone())).count_total > 0, "nothing is counted");
    let counted = measure(|| {
        for problem in &problems {
            solver.shift();
            solver.solve(problem, &mut solution);
            most = most.max(solution.iterations);
        }
        solver.solve(&invalid, &mut solution);
    });
    assert_eq!(solution.outcome, Outcome::Invalid);
    assert!(most > 20, "some problem must reach the interior points, most iterations {most}");
    assert_eq!(counted.count_total, 0);
}
