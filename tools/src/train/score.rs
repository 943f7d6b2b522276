//! How good a network is on manoeuvres that it never saw, beside the answers that need no network.

use lpv_mpc::jordan::{FEEDBACK, Network, Pair};

use super::data::{Run, Sample};
use super::marquardt::UNSCORED;

/// One answer for each sample of a run, front and rear [N/rad].
pub type Answers = Vec<[f64; FEEDBACK]>;

/// Scores of both axles for one way to answer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Coefficient of determination [1].
    pub r_squared: [f64; FEEDBACK],
    /// Root mean square of the stiffness error [N/rad].
    pub rmse: [f64; FEEDBACK],
    /// Largest stiffness error [N/rad].
    pub worst: [f64; FEEDBACK],
    /// Root mean square of the force error over the grip [1].
    pub force: [f64; FEEDBACK],
    /// Largest force error over the grip [1].
    pub worst_force: [f64; FEEDBACK],
}

/// A pair for a file.
pub fn pair([c_f, c_r]: [f64; FEEDBACK]) -> Pair {
    Pair { c_f, c_r }
}

/// The network on its own outputs, from the nominal stiffness on.
pub fn free_running(network: &Network, run: &Run) -> Answers {
    let mut memory = network.nominal();
    run.samples
        .iter()
        .map(|sample| {
            memory = network.step(&memory, &sample.measured);
            let (c_f, c_r) = network.stiffness(&memory);
            [c_f, c_r]
        })
        .collect()
}

/// The network with the true stiffness of one sample ago.
pub fn teacher_forced(network: &Network, run: &Run) -> Answers {
    let mut previous = network.nominal();
    run.samples
        .iter()
        .map(|sample| {
            let (c_f, c_r) = network.stiffness(&network.step(&previous, &sample.measured));
            previous = network.memory(sample.c[0], sample.c[1]);
            [c_f, c_r]
        })
        .collect()
}

/// The true stiffness of one sample ago.
pub fn persistence(run: &Run) -> Answers {
    let first = run.samples.first().map(|sample| sample.c);
    first.into_iter().chain(run.samples.iter().map(|sample| sample.c)).take(run.samples.len()).collect()
}

/// One stiffness for ever.
pub fn constant(c: [f64; FEEDBACK], run: &Run) -> Answers {
    vec![c; run.samples.len()]
}

/// Mean stiffness over all scored samples: the best constant.
pub fn mean(runs: &[Run]) -> [f64; FEEDBACK] {
    let samples: Vec<&Sample> = runs.iter().flat_map(|run| run.samples.iter().skip(UNSCORED)).collect();
    std::array::from_fn(|o| samples.iter().map(|sample| sample.c[o]).sum::<f64>() / samples.len() as f64)
}

/// Scores `answers` (one list for each run) over the samples that `select` picks; the first samples of a run do not count.
///
/// `peak` is each axle's grip, `mu F_z` at rest [N].
pub fn score(
    runs: &[Run],
    answers: &[Answers],
    peak: [f64; FEEDBACK],
    select: impl Fn(&Run, &Sample) -> bool,
) -> Score {
    let mut score = Score::default();
    let pairs: Vec<(&Sample, &[f64; FEEDBACK])> = runs
        .iter()
        .zip(answers)
        .flat_map(|(run, answers)| {
            let select = &select;
            run.samples.iter().zip(answers).skip(UNSCORED).filter(move |(sample, _)| select(run, sample))
        })
        .collect();
    let count = pairs.len() as f64;
    for o in 0..FEEDBACK {
        let mean = pairs.iter().map(|(sample, _)| sample.c[o]).sum::<f64>() / count;
        let spread: f64 = pairs.iter().map(|(sample, _)| (sample.c[o] - mean).powi(2)).sum();
        let error = |(sample, answer): &(&Sample, &[f64; FEEDBACK])| answer[o] - sample.c[o];
        let force = |pair: &(&Sample, &[f64; FEEDBACK])| error(pair) * pair.0.alpha[o] / peak[o];
        let squares: f64 = pairs.iter().map(|pair| error(pair).powi(2)).sum();
        // Of a stiffness that never changes there is nothing to explain; missing it is no explanation.
        let nothing = 1e-12 * count * mean * mean;
        score.r_squared[o] = match spread > nothing {
            true => 1.0 - squares / spread,
            false => f64::from(u8::from(squares <= nothing)),
        };
        score.rmse[o] = (squares / count).sqrt();
        score.worst[o] = pairs.iter().map(|pair| error(pair).abs()).fold(0.0, f64::max);
        score.force[o] = (pairs.iter().map(|pair| force(pair).powi(2)).sum::<f64>() / count).sqrt();
        score.worst_force[o] = pairs.iter().map(|pair| force(pair).abs()).fold(0.0, f64::max);
    }
    score
}
