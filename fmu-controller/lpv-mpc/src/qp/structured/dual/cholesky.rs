//! Cholesky factor of a matrix that grows at its end and shrinks anywhere, with the right-hand side that goes along.

/// Lower factor, packed by columns that all have room to grow, and the right-hand side with the factor already taken off.
#[derive(Clone, Debug)]
pub(super) struct Cholesky {
    size: usize,
    lower: Vec<f64>,
    /// Inverse of the diagonal: divisions would be the slowest part of every solve.
    inverse: Vec<f64>,
    reduced: Vec<f64>,
    /// Column that a removal carries along.
    carried: Vec<f64>,
}

impl Cholesky {
    pub(super) fn new(most: usize) -> Self {
        Self {
            size: 0,
            lower: vec![0.0; most * (most + 1) / 2],
            inverse: vec![0.0; most],
            reduced: vec![0.0; most],
            carried: vec![0.0; most],
        }
    }

    pub(super) fn clear(&mut self) {
        self.size = 0;
    }

    /// Where a column starts, with its diagonal element.
    fn start(&self, column: usize) -> usize {
        let most = self.reduced.len();
        column * most - column * column.saturating_sub(1) / 2
    }

    /// Appends a row and column: what it shares with the others, its diagonal element, its right-hand side. `coupling` becomes
    /// the solution of the lower factor, of which [`Self::back`] makes the combination of the other rows nearest to this one.
    ///
    /// Returns whether there was room and more than a fraction `dependent` of the diagonal was the row's own.
    pub(super) fn append(&mut self, coupling: &mut [f64], diagonal: f64, right: f64, dependent: f64) -> bool {
        let k = self.size;
        for c in 0..k {
            let start = self.start(c);
            let (value, below) = (coupling[c] * self.inverse[c], &mut coupling[c..]);
            below[0] = value;
            for (other, l) in below[1..].iter_mut().zip(&self.lower[start + 1..]) {
                *other -= value * l;
            }
        }
        let pivot = diagonal - dot(coupling, coupling);
        // Comparisons with a NaN are false: such a row is not appended.
        let independent = pivot > dependent * diagonal;
        if !independent || k == self.reduced.len() {
            return false;
        }
        for (c, value) in coupling.iter().enumerate() {
            let start = self.start(c);
            self.lower[start + k - c] = *value;
        }
        let start = self.start(k);
        self.lower[start] = pivot.sqrt();
        self.inverse[k] = 1.0 / self.lower[start];
        self.reduced[k] = (right - dot(coupling, &self.reduced[..k])) * self.inverse[k];
        self.size += 1;
        true
    }

    /// Removes a row and column, by rotations that make the factor triangular again.
    pub(super) fn remove(&mut self, w: usize) {
        let k = self.size;
        for c in 0..w {
            let start = self.start(c);
            self.lower.copy_within(start + w + 1 - c..start + k - c, start + w - c);
        }
        let start = self.start(w);
        let carried = &mut self.carried[..k - w - 1];
        carried.copy_from_slice(&self.lower[start + 1..start + k - w]);
        let mut carried_reduced = self.reduced[w];
        for c in w + 1..k {
            let (before, start) = (self.start(c - 1), self.start(c));
            let (above, column) = self.lower.split_at_mut(start);
            let carried = &mut self.carried[c - w - 1..k - w - 1];
            let (a, b) = (carried[0], column[0]);
            self.inverse[c - 1] = 1.0 / (a * a + b * b).sqrt();
            let (cos, sin) = (a * self.inverse[c - 1], b * self.inverse[c - 1]);
            for ((new, carried), old) in above[before..].iter_mut().zip(carried).zip(column) {
                *new = cos * *carried + sin * *old;
                *carried = cos * *old - sin * *carried;
            }
            let reduced = self.reduced[c];
            self.reduced[c - 1] = cos * carried_reduced + sin * reduced;
            carried_reduced = cos * reduced - sin * carried_reduced;
        }
        self.size -= 1;
    }

    /// Solution for the right-hand side that the rows brought along.
    pub(super) fn solution(&self, solution: &mut [f64]) {
        solution.copy_from_slice(&self.reduced[..self.size]);
        self.back(solution);
    }

    /// Takes the transposed factor off.
    pub(super) fn back(&self, vector: &mut [f64]) {
        for r in (0..self.size).rev() {
            let start = self.start(r);
            let (here, below) = vector[r..].split_at_mut(1);
            here[0] = (here[0] - dot(&self.lower[start + 1..][..below.len()], below)) * self.inverse[r];
        }
    }
}

/// Scalar product in four sums, which the compiler may keep apart; one sum would tie it to the order of the terms.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a_fours, a_rest) = a.as_chunks::<4>();
    let (b_fours, b_rest) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (x, y) in a_fours.iter().zip(b_fours) {
        for m in 0..4 {
            sums[m] += x[m] * y[m];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::Cholesky;
    use nalgebra::{DMatrix, DVector};

    /// A positive definite matrix whose rows are of different magnitude.
    fn matrix(size: usize) -> DMatrix<f64> {
        let root = DMatrix::from_fn(size, size, |r, c| ((3 * r * r + 7 * c + r * c) % 11) as f64 - 5.0);
        let scale = DMatrix::from_fn(size, size, |r, c| if r == c { [1.0, 10.0, 100.0, 1000.0][r % 4] } else { 0.0 });
        &scale * (&root * root.transpose() + DMatrix::identity(size, size)) * &scale
    }

    #[test]
    fn solution_stands_when_rows_come_and_go() {
        let size = 9;
        let (matrix, right) = (matrix(size), DVector::from_fn(size, |r, _| (r as f64).cos()));
        let mut cholesky = Cholesky::new(size);
        let mut rows: Vec<usize> = Vec::new();
        // Removals at the end, in the middle, at the beginning; some rows come back at another place.
        for (row, removed) in [
            (4, None),
            (0, None),
            (7, Some(2)),
            (2, Some(1)),
            (7, None),
            (1, Some(0)),
            (0, None),
            (8, None),
            (3, Some(3)),
        ] {
            let mut coupling: Vec<f64> = rows.iter().map(|other| matrix[(row, *other)]).collect();
            assert!(cholesky.append(&mut coupling, matrix[(row, row)], right[row], 1e-12));
            rows.push(row);
            if let Some(w) = removed {
                rows.remove(w);
                cholesky.remove(w);
            }
            let k = rows.len();
            let mut got = vec![0.0; k];
            cholesky.solution(&mut got);
            let part = DMatrix::from_fn(k, k, |r, c| matrix[(rows[r], rows[c])]);
            let want = part.clone().lu().solve(&DVector::from_fn(k, |r, _| right[rows[r]])).unwrap();
            let error = (&part * (DVector::from_vec(got) - &want)).amax();
            // The residual of a backward stable solution, whatever the condition.
            assert!(error < 1e-12 * part.amax() * want.amax(), "{rows:?}: off by {error:e}");
        }
    }

    #[test]
    fn row_that_others_make_up_is_refused_with_its_combination() {
        let base = matrix(3);
        // Row 3 is row 0 minus twice row 2.
        let mix = DMatrix::from_row_slice(4, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, -2.0]);
        let matrix = &mix * base * mix.transpose();
        let mut cholesky = Cholesky::new(4);
        for row in 0..4 {
            let mut coupling: Vec<f64> = (0..row).map(|other| matrix[(row, other)]).collect();
            let appended = cholesky.append(&mut coupling, matrix[(row, row)], 0.0, 1e-11);
            assert_eq!(appended, row < 3, "row {row}");
            if row == 3 {
                cholesky.back(&mut coupling);
                for (got, want) in coupling.iter().zip([1.0, 0.0, -2.0]) {
                    // The condition of the matrix is below 1e8.
                    assert!((got - want).abs() < 1e-8, "got {coupling:?}");
                }
            }
        }
    }
}
