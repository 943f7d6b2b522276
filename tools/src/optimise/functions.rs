//! Functions that optimisers are compared on. Their least value is 0.

use std::f64::consts::{E, TAU};

use anyhow::Result;

use super::space::Space;

/// Sides of the functions: the paper's sphere has five.
pub const SIDES: usize = 5;

/// A function to minimise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Function {
    /// Sum of squares: one bowl
    Sphere,
    /// A long bent valley
    Rosenbrock,
    /// A bowl with 11 dents along each side
    Rastrigin,
    /// A funnel with dents, flat outside
    Ackley,
    /// A wide bowl with shallow waves
    Griewank,
}

impl Function {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Sphere, Self::Rosenbrock, Self::Rastrigin, Self::Ackley, Self::Griewank];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Rosenbrock => "rosenbrock",
            Self::Rastrigin => "rastrigin",
            Self::Ackley => "ackley",
            Self::Griewank => "griewank",
        }
    }

    /// Ends of each side: what the literature takes, [Molga]. The paper gives no box for its sphere.
    pub fn bounds(self) -> [f64; 2] {
        match self {
            Self::Sphere | Self::Rastrigin => [-5.12, 5.12],
            Self::Rosenbrock => [-2.048, 2.048],
            Self::Ackley => [-32.768, 32.768],
            Self::Griewank => [-600.0, 600.0],
        }
    }

    /// The box.
    pub fn space(self) -> Result<Space> {
        let [low, high] = self.bounds();
        Space::cube(SIDES, low, high)
    }

    /// The value, [Molga].
    pub fn value(self, x: &[f64]) -> f64 {
        let n = x.len() as f64;
        let squares: f64 = x.iter().map(|x| x * x).sum();
        match self {
            Self::Sphere => squares,
            Self::Rosenbrock => {
                x.windows(2).map(|pair| 100.0 * (pair[1] - pair[0] * pair[0]).powi(2) + (1.0 - pair[0]).powi(2)).sum()
            }
            Self::Rastrigin => x.iter().map(|x| x * x + 10.0 * (1.0 - (TAU * x).cos())).sum(),
            Self::Ackley => {
                let waves = x.iter().map(|x| (TAU * x).cos()).sum::<f64>() / n;
                // Differences first: at the optimum they vanish to the last bit, where the textbook's sum leaves rounding.
                20.0 * (1.0 - (-0.2 * (squares / n).sqrt()).exp()) + (E - waves.exp())
            }
            Self::Griewank => {
                let waves: f64 = x.iter().zip(1..).map(|(x, k)| (x / f64::from(k).sqrt()).cos()).product();
                squares / 4000.0 + (1.0 - waves)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn every_function_is_0_at_its_optimum_and_above_elsewhere() {
        for function in Function::ALL {
            let optimum = if function == Function::Rosenbrock { [1.0; SIDES] } else { [0.0; SIDES] };
            assert!(function.value(&optimum).abs() < 1e-15, "{}", function.name());
            for side in 0..SIDES {
                let mut near = optimum;
                near[side] += 1e-3;
                assert!(function.value(&near) > 1e-8, "{}", function.name());
            }
        }
    }

    #[test]
    fn values_by_hand() {
        // 100 (1 - 0)^2 + 1 per pair; half a period away from the optimum; the far field of Ackley.
        assert_eq!(Function::Rosenbrock.value(&[0.0, 1.0]), 101.0);
        assert!((Function::Rastrigin.value(&[0.5]) - 20.25).abs() < 1e-12);
        assert!((Function::Griewank.value(&[PI, 0.0]) - (PI * PI / 4000.0 + 2.0)).abs() < 1e-12);
        assert!((Function::Ackley.value(&[30.0, 30.0]) - 20.0 * (1.0 - (-6.0_f64).exp())).abs() < 1e-12);
    }
}
