//! A quadratic model of what was evaluated around the best point, and its minimum within the region that the points cover.
//!
//! Least squares on the nearest points, as derivative-free trust-region methods do, [Conn, chapters 4 and 10]. Over a wide region the model
//! sees the trend below the dents, over a narrow one it converges like Newton's method.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::Candidate;

/// Points per coefficient of the model: twice as many damp what is no quadratic.
const OVERDETERMINED: f64 = 2.0;

/// Points of the widest model, in units of the narrowest.
const MOST: usize = 4;

/// What the model recommends.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// The model's minimum.
    pub point: Vec<f64>,
    /// Distance of the farthest point of the model from the best.
    pub radius: f64,
}

/// Coefficients of a full model: constant, gradient, symmetric Hessian.
pub fn coefficients(sides: usize) -> usize {
    (sides + 1) * (sides + 2) / 2
}

/// Points that a full model is fitted to at least.
pub fn points_wanted(sides: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count")]
    let count = (OVERDETERMINED * coefficients(sides) as f64).ceil() as usize;
    count
}

/// Fits the `count` points nearest to `best` and minimises the model among them; `None` where the points say nothing.
pub fn propose(archive: &[Candidate], best: &Candidate, count: usize) -> Option<Proposal> {
    let sides = best.point.len();
    let mut near: Vec<(f64, &Candidate)> =
        archive.iter().map(|one| (distance(&one.point, &best.point), one)).filter(|(d, _)| d.is_finite()).collect();
    // Selecting first: sorting all that was ever evaluated would cost more than the fit.
    if count < near.len() {
        near.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0));
        near.truncate(count);
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let radius = near.last()?.0;
    // Many more points say little more and cost time.
    let stride = near.len().div_ceil(MOST * points_wanted(sides));
    let near: Vec<(f64, &Candidate)> = near.into_iter().step_by(stride).collect();
    // Too few for the mixed terms: squares alone, which follow weights that act one by one.
    let full = near.len() >= coefficients(sides) + sides;
    let terms = if full { coefficients(sides) } else { 2 * sides + 1 };
    if radius <= 0.0 || near.len() < terms {
        return None;
    }
    let (gradient, hessian) = fit(&near, best, radius, full, terms)?;
    let step = minimum(&gradient, hessian)?;
    let point: Vec<f64> =
        best.point.iter().zip(step.iter()).map(|(place, step)| (place + radius * step).clamp(0.0, 1.0)).collect();
    point.iter().all(|place| place.is_finite()).then_some(Proposal { point, radius })
}

/// Gradient and Hessian at the best point, with distances in units of the radius.
fn fit(
    near: &[(f64, &Candidate)],
    best: &Candidate,
    radius: f64,
    full: bool,
    terms: usize,
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let sides = best.point.len();
    let mut rows = DMatrix::zeros(near.len(), terms);
    let mut right = DVector::zeros(near.len());
    for (i, (distance, one)) in near.iter().enumerate() {
        let z: Vec<f64> = one.point.iter().zip(&best.point).map(|(place, best)| (place - best) / radius).collect();
        // Far points count less, so that the region has no edge that points jump over.
        let weight = (1.1 - (distance / radius).powi(2)).sqrt();
        let mut term = 0;
        let mut put = |value: f64| {
            rows[(i, term)] = weight * value;
            term += 1;
        };
        put(1.0);
        z.iter().for_each(|z| put(*z));
        for a in 0..sides {
            put(0.5 * z[a] * z[a]);
            if full {
                ((a + 1)..sides).for_each(|b| put(z[a] * z[b]));
            }
        }
        right[i] = weight * (one.value - best.value);
    }
    // Columns of unit length, so that the cut below means the same for all of them.
    let lengths: Vec<f64> = rows.column_iter().map(|column| column.norm()).collect();
    for (mut column, length) in rows.column_iter_mut().zip(&lengths) {
        if *length > 0.0 {
            column /= *length;
        }
    }
    let answer = rows.svd(true, true).solve(&right, 1e-10).ok()?;
    let c: Vec<f64> =
        answer.iter().zip(&lengths).map(|(c, length)| if *length > 0.0 { c / length } else { 0.0 }).collect();
    let gradient = DVector::from_column_slice(&c[1..=sides]);
    let mut hessian = DMatrix::zeros(sides, sides);
    let mut term = sides + 1;
    for a in 0..sides {
        hessian[(a, a)] = c[term];
        term += 1;
        if full {
            for b in (a + 1)..sides {
                hessian[(a, b)] = c[term];
                hessian[(b, a)] = c[term];
                term += 1;
            }
        }
    }
    c.iter().all(|c| c.is_finite()).then_some((gradient, hessian))
}

/// Step of length at most 1 that minimises the model, [Conn, section 10.2]: the multiplier by bisection on the eigenvalues.
fn minimum(gradient: &DVector<f64>, hessian: DMatrix<f64>) -> Option<DVector<f64>> {
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(hessian);
    let along = eigenvectors.transpose() * gradient;
    if along.norm() <= 0.0 {
        return None;
    }
    let step = |shift: f64| along.zip_map(&eigenvalues, |g, value| -g / (value + shift));
    let least = eigenvalues.min();
    let scale = eigenvalues.amax().max(along.norm());
    let mut low = if least > 0.0 { 0.0 } else { -least + 1e-12 * scale };
    if step(low).norm() > 1.0 {
        // Beyond this shift every step is shorter than 1.
        let mut high = low + along.norm() + scale;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if step(middle).norm() > 1.0 { low = middle } else { high = middle }
        }
        low = high;
    }
    Some(eigenvectors * step(low))
}

/// Euclidean distance.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::optimise::random::{self, Random};

    fn sample(count: usize, sides: usize, f: impl Fn(&[f64]) -> f64) -> Vec<Candidate> {
        let mut random = Random::seed_from_u64(3);
        (0..count)
            .map(|_| random::point(&mut random, sides))
            .map(|point| Candidate { value: f(&point), point })
            .collect()
    }

    fn best(archive: &[Candidate]) -> &Candidate {
        archive.iter().min_by(|a, b| a.value.total_cmp(&b.value)).unwrap()
    }

    #[test]
    fn the_minimum_of_a_quadratic_is_found_at_once() {
        // Mixed terms, minimum at (0.4, 0.3, 0.6), where the gradient vanishes by construction.
        let f = |x: &[f64]| {
            let [a, b, c] = [x[0] - 0.4, x[1] - 0.3, x[2] - 0.6];
            3.0 * a * a + b * b + 2.0 * c * c + a * b - 0.5 * b * c + 7.0
        };
        let archive = sample(points_wanted(3), 3, f);
        let found = propose(&archive, best(&archive), points_wanted(3)).unwrap();
        assert!(distance(&found.point, &[0.4, 0.3, 0.6]) < 1e-10, "{found:?}");
    }

    #[test]
    fn a_model_that_falls_without_end_stops_at_the_edge_of_its_points() {
        let archive = sample(points_wanted(2), 2, |x| -(x[0] * x[0]) - 0.1 * x[1]);
        let best = best(&archive);
        let found = propose(&archive, best, points_wanted(2)).unwrap();
        assert!(distance(&found.point, &best.point) <= found.radius * (1.0 + 1e-9));
        assert!(found.point[0] >= best.point[0]);
    }

    #[test]
    fn few_points_give_a_model_of_squares_and_fewer_give_none() {
        let f = |x: &[f64]| x.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>();
        let archive = sample(14, 5, f);
        let found = propose(&archive, best(&archive), 42).unwrap();
        assert!(distance(&found.point, &[0.5; 5]) < 1e-9, "{found:?}");
        assert!(propose(&archive[..10], &archive[0], 42).is_none());
    }
}
