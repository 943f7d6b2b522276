use super::*;
use crate::optimise::functions::{Function, SIDES};

fn run(method: Method, function: Function, shift: f64, budget: usize, seed: u64) -> Search {
    let space = function.space().unwrap();
    let mut search = Search::new(method, SIDES, 25, budget, seed);
    while !search.finished() {
        search.advance(|point| {
            let x: Vec<f64> = space.values(point).iter().map(|x| x - shift).collect();
            function.value(&x)
        });
    }
    search
}

fn least(search: &Search) -> f64 {
    search.best().unwrap().value
}

fn median(method: Method, function: Function, shift: f64, seeds: u64) -> f64 {
    let budget = evaluations(25, 100);
    let mut all: Vec<f64> =
        (0..seeds).into_par_iter().map(|seed| least(&run(method, function, shift, budget, seed))).collect();
    all.sort_by(f64::total_cmp);
    // The worse of the two middle ones: at least the median.
    all[all.len() / 2]
}

#[test]
fn the_hybrid_beats_the_papers_on_the_papers_sphere() {
    // 25 individuals, 25 particles, 100 iterations; 30 seeds.
    let found = median(Method::Hybrid, Function::Sphere, 0.0, 30);
    assert!(found <= 4.24e-8, "{found:e}");
}

#[test]
fn the_default_is_no_worse_than_the_papers_methods_on_any_function() {
    for function in Function::ALL {
        let ours = median(Method::Guided, function, 0.0, 9);
        for method in [Method::Ga, Method::Pso, Method::Hybrid] {
            let theirs = median(method, function, 0.0, 9);
            assert!(ours <= theirs, "{}: {ours:e}, {} {theirs:e}", function.name(), method.name());
        }
    }
}

#[test]
fn an_optimum_in_the_middle_of_the_box_is_no_advantage() {
    // A tenth of the box off its middle. Ackley rises by 0.2 / sqrt(5) * 20 per unit, and places in its box of 66 are rounded to
    // 7e-15.
    for function in [Function::Sphere, Function::Ackley, Function::Griewank] {
        let [low, high] = function.bounds();
        let found = median(Method::Guided, function, 0.1 * (high - low), 9);
        assert!(found < 1e-13, "{}: {found:e}", function.name());
    }
}

#[test]
fn a_seed_gives_the_same_search_for_any_number_of_threads() {
    for method in Method::ALL {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run(method, Function::Rastrigin, 0.0, 400, 7))
        };
        let (one, many) = (with(1), with(5));
        assert_eq!((one.history(), one.best()), (many.history(), many.best()), "{}", method.name());
        assert_ne!(one.history(), run(method, Function::Rastrigin, 0.0, 400, 8).history());
    }
}

#[test]
fn a_saved_search_goes_on_as_if_it_had_not_stopped() {
    let f = |point: &[f64]| Function::Rosenbrock.value(point);
    for method in Method::ALL {
        let mut search = Search::new(method, SIDES, 10, 300, 3);
        for _ in 0..5 {
            search.advance(f);
        }
        let mut other: Search = serde_json::from_str(&serde_json::to_string(&search).unwrap()).unwrap();
        while !search.finished() {
            search.advance(f);
            other.advance(f);
        }
        assert_eq!((search.history(), search.best()), (other.history(), other.best()), "{}", method.name());
        assert_eq!(search.evaluations(), 300);
    }
}

#[test]
fn values_that_are_no_numbers_are_survived() {
    for method in Method::ALL {
        let mut search = Search::new(method, 2, 10, 200, 1);
        while !search.finished() {
            search.advance(|x| if x[0] > 0.3 { [f64::NAN, f64::INFINITY][usize::from(x[1] > 0.5)] } else { x[1] });
        }
        assert!(least(&search) < 0.1, "{}: {}", method.name(), least(&search));
    }
}

#[test]
fn the_hundred_iterations_of_the_paper_are_what_the_budget_says() {
    for (population, iterations) in [(25, 100), (25, 15), (10, 3)] {
        let mut search = Search::new(Method::Hybrid, 2, population, evaluations(population, iterations), 1);
        while !search.finished() {
            search.advance(|x| x[0] + x[1]);
        }
        // The first populations, then the iterations.
        assert_eq!(search.history().len(), 1 + iterations);
    }
    let space = Space::cube(2, -1.0, 3.0).unwrap();
    let (at, value) = minimise(|x| (x[0] - 1.0).powi(2) + x[1].powi(2), &space, Method::Guided, 200, 1).unwrap();
    assert!(value < 1e-20 && (at[0] - 1.0).abs() < 1e-9, "{at:?} {value:e}");
}

#[test]
fn the_middle_of_a_generation_cut_short_is_that_of_what_was_evaluated() {
    for method in Method::ALL {
        // One evaluation, a first generation cut short, a later one cut short.
        for budget in [1, 3, 30, 103] {
            let search = run(method, Function::Sphere, 0.0, budget, 1);
            for Progress { evaluations, best, median } in search.history() {
                let name = method.name();
                // The sphere's box ends at 100: five squares of it are the most.
                assert!(best <= median && *median <= 5e4, "{name}, {evaluations} of {budget}: {median:e}");
            }
        }
    }
}
