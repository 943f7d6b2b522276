//! Draws of the strategies. All of them come from one stream that a search owns, before anything is evaluated: so a search
//! takes the same way for any number of threads.

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// The stream; it is saved with a search.
pub type Random = Pcg64;

/// Evenly between 0 and 1.
pub fn uniform(random: &mut Random) -> f64 {
    random.random()
}

/// Normal with standard deviation 1.
pub fn normal(random: &mut Random) -> f64 {
    random.sample(StandardNormal)
}

/// An index below `count`, which must not be 0.
pub fn index(random: &mut Random, count: usize) -> usize {
    random.random_range(0..count)
}

/// A point of the unit cube.
pub fn point(random: &mut Random, sides: usize) -> Vec<f64> {
    (0..sides).map(|_| uniform(random)).collect()
}

/// Points of the unit cube, one in each of `count` equal slices of every side.
pub fn latin(random: &mut Random, count: usize, sides: usize) -> Vec<Vec<f64>> {
    let mut points = vec![vec![0.0; sides]; count];
    for side in 0..sides {
        let mut slices: Vec<usize> = (0..count).collect();
        for last in (1..count).rev() {
            slices.swap(last, index(random, last + 1));
        }
        for (point, slice) in points.iter_mut().zip(slices) {
            point[side] = (slice as f64 + uniform(random)) / count as f64;
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn every_slice_of_every_side_is_hit_once() {
        let points = latin(&mut Random::seed_from_u64(1), 20, 3);
        for side in 0..3 {
            let mut hit = [0; 20];
            for point in &points {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 20")]
                let slice = (point[side] * 20.0) as usize;
                hit[slice] += 1;
            }
            assert_eq!(hit, [1; 20]);
        }
    }
}
