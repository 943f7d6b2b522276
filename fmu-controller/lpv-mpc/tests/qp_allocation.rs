//! Solving allocates nothing: counted by the allocator itself.

mod qp_support;

use lpv_mpc::qp::{Outcome, Problem, Solution, Structured};
use qp_support::{Stress, random_problem};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: hands every call on to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

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
    let before = ALLOCATIONS.get();
    for problem in &problems {
        solver.shift();
        solver.solve(problem, &mut solution);
        most = most.max(solution.iterations);
    }
    solver.solve(&invalid, &mut solution);
    let allocations = ALLOCATIONS.get() - before;
    assert_eq!(solution.outcome, Outcome::Invalid);
    assert!(most > 20, "some problem must reach the interior points, most iterations {most}");
    assert_eq!(allocations, 0);
}
