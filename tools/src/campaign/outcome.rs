//! What the modes of adaptation did in one situation, and which of them did worse than constant stiffness.

use super::{MODES, Situation};

/// Lateral error beyond which a car has left the road [m]: how far beyond says nothing, so such runs are counted, not averaged.
const ROAD: f64 = 2.0;
/// What counts as no difference [m]: a tenth of a sensor's standard deviation of 1 cm.
const NOISE: f64 = 1e-3;

/// Largest lateral error [m] and RMSE of the speed [m/s] of every mode.
pub(super) type Run = [(f64, f64); 3];

/// What the modes did in one situation, a run for each seed.
pub(super) struct Outcome {
    pub(super) situation: Situation,
    pub(super) runs: Vec<Run>,
}

impl Outcome {
    /// Runs of a mode that stayed on the road.
    fn stayed(&self, mode: usize) -> impl Iterator<Item = (f64, f64)> {
        self.runs.iter().map(move |run| run[mode]).filter(|(e_y, _)| *e_y < ROAD)
    }

    /// With how many seeds a mode left the road.
    pub(super) fn left(&self, mode: usize) -> usize {
        self.runs.len() - self.stayed(mode).count()
    }

    /// Means of a mode's figures over the runs that stayed on the road; nothing when none did.
    pub(super) fn mean(&self, mode: usize) -> Option<(f64, f64)> {
        let n = self.stayed(mode).count() as f64;
        let sum = self.stayed(mode).fold((0.0, 0.0), |sum, run| (sum.0 + run.0, sum.1 + run.1));
        (n > 0.0).then_some((sum.0 / n, sum.1 / n))
    }

    /// Whether a mode did worse than constant stiffness: it left the road with more seeds or, when both left it with as many, its
    /// error is larger by more than noise, that of the sensors included, in the mean over the seeds with which both stayed.
    pub(super) fn loses(&self, mode: usize) -> bool {
        if self.left(mode) != self.left(0) {
            return self.left(mode) > self.left(0);
        }
        let pairs: Vec<[f64; 2]> = self.runs.iter().map(|run| [run[0].0, run[mode].0]).collect();
        let shared: Vec<[f64; 2]> = pairs.into_iter().filter(|pair| pair.iter().all(|e_y| *e_y < ROAD)).collect();
        let n = shared.len() as f64;
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| shared.iter().map(of).sum::<f64>() / n;
        let (reference, difference) = (mean(&|pair| pair[0]), mean(&|pair| pair[1] - pair[0]));
        let squares = shared.iter().map(|pair| (pair[1] - pair[0] - difference).powi(2)).sum::<f64>();
        let error = if shared.len() > 1 { (squares / (n - 1.0) / n).sqrt() } else { 0.0 };
        // Without a seed that both share the difference is no number, and nobody loses.
        difference > NOISE.max(0.1 * reference).max(2.0 * error)
    }
}

/// A mode's error as people read it [cm], with how many of its runs left the road.
pub(super) fn cell(result: &Outcome, mode: usize) -> String {
    let (left, all) = (result.left(mode), result.runs.len());
    match result.mean(mode) {
        None => "off the road".to_owned(),
        Some((e_y, _)) if left == 0 => format!("{:.2}", 100.0 * e_y),
        Some((e_y, _)) => format!("{left} of {all} off the road, {:.2}", 100.0 * e_y),
    }
}

/// A row for each situation and mode; no figures where no run stayed on the road.
pub(super) fn as_csv(results: &[Outcome]) -> String {
    let mut csv = "road,tyre,mu,noise,speed,mode,runs,left_road,e_y_max,v_x_rmse\n,,1,1,m/s,,1,1,m,m/s\n".to_owned();
    for result in results {
        let Situation { road, tyre, mu, noise, speed } = &result.situation;
        for (i, mode) in MODES.iter().enumerate() {
            let (runs, left) = (result.runs.len(), result.left(i));
            let figures = result.mean(i).map_or_else(|| ",".to_owned(), |(e_y, v_x)| format!("{e_y},{v_x}"));
            csv.push_str(&format!("{road},{tyre},{mu},{noise},{speed},{mode},{runs},{left},{figures}\n"));
        }
    }
    csv
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::situations;

    fn outcome(runs: &[[f64; 3]]) -> Outcome {
        let runs = runs.iter().map(|run| run.map(|e_y| (e_y, 0.0))).collect();
        Outcome { situation: situations().swap_remove(0), runs }
    }

    #[test]
    fn losing_is_more_than_noise_and_leaving_the_road_is_the_worst() {
        let loses = |runs: &[[f64; 3]]| outcome(runs).loses(2);
        assert!(!loses(&[[0.010, 0.0105, 0.011]]));
        assert!(loses(&[[0.010, 0.010, 0.0125]]));
        assert!(!loses(&[[30.0, 40.0, f64::INFINITY]]));
        assert!(loses(&[[0.5, 0.5, f64::INFINITY]]));
        // Five millimetres more in the mean, once by a seed that is bad luck and once by each.
        assert!(!loses(&[[0.01, 0.01, 0.03], [0.01, 0.01, 0.005], [0.01, 0.01, 0.01]]));
        assert!(loses(&[[0.01, 0.01, 0.015], [0.02, 0.01, 0.025], [0.01, 0.01, 0.0151]]));
    }

    #[test]
    fn runs_off_the_road_are_counted_and_the_others_compared_seed_by_seed() {
        let lost = f64::INFINITY;
        // Constant stiffness has the smaller mean because it lost its worst seed.
        let fewer = outcome(&[[0.01, 0.01, 0.02], [lost, 0.01, 0.05]]);
        assert_eq!((fewer.left(0), fewer.left(2)), (1, 0));
        assert_eq!(fewer.mean(0), Some((0.01, 0.0)));
        assert!(!fewer.loses(2));
        // As many lost, and on the only seed that both drove to the end the network is better, whatever the means say.
        let shared = outcome(&[[0.02, 0.01, 0.01], [0.001, 0.01, lost], [3.0, 0.01, 0.3]]);
        assert!(shared.mean(2) > shared.mean(0) && !shared.loses(2));
        assert!(outcome(&[[0.01, 0.01, 0.02], [0.5, 0.01, 5.0], [lost, 0.01, 0.02]]).loses(2));
        assert!(!outcome(&[[0.01, 0.01, lost], [lost, 0.01, 0.01]]).loses(2), "no seed in common");
        assert_eq!(cell(&fewer, 0), "1 of 2 off the road, 1.00");
        assert_eq!(cell(&outcome(&[[lost; 3]]), 1), "off the road");
        let csv = as_csv(&[fewer, outcome(&[[lost; 3]])]);
        assert!(csv.contains(",constant,2,1,0.01,0\n") && csv.contains(",constant,1,1,,\n"), "{csv}");
    }
}
