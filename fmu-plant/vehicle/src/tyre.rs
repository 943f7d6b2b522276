//! Lateral tyre forces of an axle: the magic formula with presets, or a linear law.

use serde::{Deserialize, Serialize};

use crate::{Error, Parameters, Scalar};

/// A preset by name, or coefficients of one's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// B 10, C 1.4, E 0 on both axles: dry asphalt with a falling branch beyond the peak.
    DryAsphalt,
    /// The magic formula of the plant that the paper cites: no falling branch.
    Alcala,
    /// Forces proportional to the slip angle, without a limit: twice 19 and 33 kN/rad at rest, in proportion to the load.
    Linear,
    /// The coefficients of the parameters `tyre_b_f`, `tyre_b_r`, `tyre_c` and `tyre_e`.
    Custom,
}

impl Preset {
    /// All presets with the names that users type.
    pub const ALL: [(&'static str, Self); 4] = [
        ("dry_asphalt", Self::DryAsphalt),
        ("alcala", Self::Alcala),
        ("linear", Self::Linear),
        ("custom", Self::Custom),
    ];

    /// The preset of a name.
    pub fn named(name: &str) -> Result<Self, Error> {
        Self::ALL.iter().find(|(known, _)| *known == name).map(|&(_, preset)| preset).ok_or_else(|| {
            Error::UnknownTyre { name: name.to_owned(), known: Self::ALL.map(|(known, _)| known).join(", ") }
        })
    }

    /// The name that users type.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(_, preset)| *preset == self)
            .map(|(name, _)| *name)
            .expect("every preset is listed in ALL")
    }
}

/// Coefficients of the magic formula without its peak, which is `mu F_z`, [Pacejka, eq. (4.49)].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pacejka {
    /// Stiffness factor [1/rad].
    pub b: f64,
    /// Shape factor [1].
    pub c: f64,
    /// Curvature factor [1].
    pub e: f64,
}

/// The law of one axle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Axle {
    /// `D sin(C atan(B a - E (B a - atan(B a))))` with `D = mu F_z`.
    MagicFormula(Pacejka),
    /// `c F_z a`, whatever the friction: stiffness over load `c` [1/rad].
    Linear(f64),
}

impl Axle {
    /// Front and rear law of the parameters' tyre.
    #[must_use]
    pub fn pair(parameters: &Parameters) -> (Self, Self) {
        let magic = |b, c, e| Self::MagicFormula(Pacejka { b, c, e });
        match parameters.tyre {
            // A common set for dry asphalt; at the loads of the paper's table it gives 101 and 76 kN/rad.
            Preset::DryAsphalt => (magic(10.0, 1.4, 0.0), magic(10.0, 1.4, 0.0)),
            // C = 1 rises to the peak force without ever falling. B is chosen for 58.9 and 44.7 kN/rad at the loads of
            // the paper's table (8829 N and 6621.75 N) and its mu of 0.82: b = c_alpha / (c mu F_z).
            Preset::Alcala => {
                (magic(58_900.0 / (0.82 * 8829.0), 1.0, 0.0), magic(44_700.0 / (0.82 * 6621.75), 1.0, 0.0))
            }
            // The per-tyre stiffnesses of the lane-keeping example that the paper's Table 2 comes from, two an axle.
            Preset::Linear => {
                let load = parameters.m * parameters.g / (parameters.l_f + parameters.l_r);
                (
                    Self::Linear(2.0 * 19_000.0 / (load * parameters.l_r)),
                    Self::Linear(2.0 * 33_000.0 / (load * parameters.l_f)),
                )
            }
            Preset::Custom => (
                magic(parameters.tyre_b_f, parameters.tyre_c, parameters.tyre_e),
                magic(parameters.tyre_b_r, parameters.tyre_c, parameters.tyre_e),
            ),
        }
    }

    /// Lateral force [N] at slip angle `alpha` [rad] with friction `mu` [1] and load [N].
    #[inline]
    pub fn force<D: Scalar>(&self, alpha: D, mu: D, load: D) -> D {
        match *self {
            Self::MagicFormula(Pacejka { b, c, e }) => {
                let ba = alpha * b;
                let bent = if e == 0.0 { ba } else { ba - (ba - ba.atan()) * e };
                mu * load * (bent.atan() * c).sin()
            }
            Self::Linear(stiffness) => load * alpha * stiffness,
        }
    }

    /// Slip angle of the largest force [rad]; none if the force rises for ever.
    #[must_use]
    pub fn peak_slip(&self) -> Option<f64> {
        let Self::MagicFormula(Pacejka { b, c, e }) = *self else { return None };
        // The sine peaks where C atan(..) is a right angle; with C below 1 it never gets there.
        if c <= 1.0 {
            return None;
        }
        let wanted = (std::f64::consts::FRAC_PI_2 / c).tan();
        // x - E (x - atan x) = wanted: rising and concave or convex throughout for E <= 1, so Newton's method converges
        // from below; with E = 1 it levels off at a right angle and may never reach the peak.
        let mut x = wanted;
        for _ in 0..60 {
            let (value, slope) = (x - e * (x - x.atan()), 1.0 - e + e / (1.0 + x * x));
            x += (wanted - value) / slope.max(1e-9);
        }
        let reached = (x - e * (x - x.atan()) - wanted).abs() < 1e-9 * (1.0 + wanted);
        (reached && x > 0.0).then_some(x / b)
    }

    /// Slope of the force at zero slip [N/rad].
    pub fn cornering_stiffness<D: Scalar>(&self, mu: D, load: D) -> D {
        match *self {
            Self::MagicFormula(Pacejka { b, c, .. }) => mu * load * (b * c),
            Self::Linear(stiffness) => load * stiffness,
        }
    }
}

/// Secant stiffness [N/rad]: force over slip angle, continued by the slope `c_0` at zero slip.
///
/// The paper's `F / alpha` is undefined there; this is `(F a + c_0 e^2) / (a^2 + e^2)` with `e` = 1e-6 rad, far below any
/// slip that matters.
pub fn secant_stiffness<D: Scalar>(force: D, alpha: D, c_0: D) -> D {
    const EPSILON_SQUARED: f64 = 1e-12;
    (force * alpha + c_0 * EPSILON_SQUARED) / (alpha * alpha + EPSILON_SQUARED)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_peaks_at_the_peak_slip() {
        for (c, e) in [(1.4, 0.0), (1.3, 0.5), (1.9, -3.0), (1.6, 0.9), (1.05, -0.5)] {
            let axle = Axle::MagicFormula(Pacejka { b: 10.0, c, e });
            let peak = axle.peak_slip().unwrap();
            let force = |alpha: f64| axle.force(alpha, 0.8, 5000.0);
            assert!((force(peak) - 4000.0).abs() < 1e-6, "C {c}, E {e}: {} N at {peak} rad", force(peak));
            assert!(force(0.9 * peak) < force(peak) && force(1.2 * peak) < force(peak), "C {c}, E {e}");
        }
    }

    #[test]
    fn tyres_without_a_falling_branch_have_no_peak() {
        for axle in [Axle::Linear(10.0), Axle::MagicFormula(Pacejka { b: 8.0, c: 1.0, e: 0.0 })] {
            assert_eq!(axle.peak_slip(), None);
        }
    }

    #[test]
    fn force_is_odd_and_zero_at_zero_slip() {
        let axle = Axle::MagicFormula(Pacejka { b: 10.0, c: 1.4, e: -0.7 });
        assert_eq!(axle.force(0.0, 0.8, 5000.0), 0.0);
        for alpha in [1e-3, 0.1, 0.7] {
            assert_eq!(axle.force(alpha, 0.8, 5000.0), -axle.force(-alpha, 0.8, 5000.0));
        }
    }
}
