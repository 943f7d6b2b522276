//! The one door to vector instructions beyond those that every 64-bit processor has.

use pulp::{Arch, Simd, WithSimd};

/// What may be done with wider vectors. Only what is inlined into [`Work::run`] is.
pub trait Work {
    /// What comes of it.
    type Output;

    /// Does it; to be marked as always inlined.
    fn run(self) -> Self::Output;
}

struct Lanes<W>(W);

impl<W: Work> WithSimd for Lanes<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> W::Output {
        self.0.run()
    }
}

/// Does `work` with the widest vectors that the processor at hand has, up to those of AVX2.
///
/// Nothing is reordered or fused for them: wider vectors give the same bits. AVX-512 takes 2 to 5 % off the rest of a step, but a
/// solve of the programme, whose rows do not fill its vectors, takes 8 % longer, and some processors lower their clock for it
/// (`cargo bench -p lpv-mpc --bench step`, EPYC with Zen 5).
#[inline(always)]
pub fn widest<W: Work>(work: W) -> W::Output {
    Arch::new().dispatch(Lanes(work))
}

/// `y += a x`, the shape that the compiler turns into packed instructions.
#[inline(always)]
pub fn axpy<const M: usize>(a: f64, x: &[f64; M], y: &mut [f64; M]) {
    for m in 0..M {
        y[m] += a * x[m];
    }
}

/// What comes of work that gives the same, to the last bit, with narrow and with wide vectors.
#[cfg(test)]
pub fn same_with_wide<W: Work<Output: std::fmt::Debug>>(mut work: impl FnMut() -> W) -> W::Output {
    let narrow = work().run();
    // Equality of the texts tells zeros by their signs too.
    assert_eq!(format!("{narrow:?}"), format!("{:?}", widest(work())));
    narrow
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use crate::Parameters;
    use crate::discretise::{Discrete, discretise_into};
    use crate::grip::TANGENT_FLOOR;
    use crate::hold::Hold;
    use crate::jordan::{Belief, Measured, Memory, Network};
    use crate::model::{Disturbance, Input, Point, State};

    /// What the model of a stage consists of.
    struct Stage<'a> {
        network: &'a Network,
        memory: Memory,
        x: State,
        u: Input,
        hold: &'a Hold,
    }

    impl Work for Stage<'_> {
        type Output = (Memory, Belief, Discrete<f64, 7>, f64);

        #[inline(always)]
        fn run(self) -> Self::Output {
            let Self { network, memory, x, u, hold } = self;
            let [v_x, v_y, yaw_rate, _, _] = x.into();
            let measured = Measured { v_x, v_y, yaw_rate, delta: u[0], a_x: u[1], ..Measured::default() };
            let (memory, belief) = network.linearise(&memory, &measured);
            let body = Parameters::default().body();
            let (tyres, point) = (belief.tangent(TANGENT_FLOOR), Point::new(x, u, &body));
            let lpv = point.embed(0.02, &tyres, &Disturbance::zeros());
            let mut sample = Discrete::zeros();
            let Discrete { Phi, Gamma, d } = &mut sample;
            discretise_into(&lpv, hold, Phi, Gamma, d);
            (memory, belief, sample, point.progress(0.02))
        }
    }

    #[test]
    fn wider_vectors_give_the_same_bits() {
        let network = Network::from_json(include_str!("../../resources/jordan.json")).unwrap();
        let hold = Hold::new(0.033, [0.1, 0.2]);
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let mut memory = network.nominal();
        for _ in 0..1000 {
            let mut draw = |low: f64, high: f64| rng.random_range(low..high);
            let x = State::from([draw(3.0, 30.0), draw(-2.0, 2.0), draw(-1.0, 1.0), draw(-1.0, 1.0), draw(-0.8, 0.8)]);
            let u = Input::from([draw(-0.7, 0.7), draw(-5.0, 4.0)]);
            let stage = || Stage { network: &network, memory, x, u, hold: &hold };
            memory = same_with_wide(stage).0;
        }
    }
}
