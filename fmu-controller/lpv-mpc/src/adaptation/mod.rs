//! What the controller believes about its tyres, now and along the plan.
//!
//! The Jordan network answers from what the car measures. Its answer at present serves the estimator and the prediction over
//! the latency; the plan either holds it (`network_now`, the paper's way) or rolls the network along the previous plan, one
//! stage at a time, so that every stage has the tyre where it will be (`network_horizon`). Tangents carry the answer into the
//! model: near the peak of the force the secant promises a response to steering that the tyre does not give.
//!
//! Where the network is not believed, or there is none for this car, the nominal tyres take over, and their force ends at what
//! friction gives ([`Grip`]): a plan from far off the path, made with tyres that hold any slip, spins the car.
//!
//! On top of both comes what the car shows of its tyres and its road ([`Friction`]): nobody tells a controller each of them.

use serde::{Deserialize, Serialize};

use crate::Parameters;
use crate::friction::{Friction, Given};
use crate::grip::{Grip, TANGENT_FLOOR};
use crate::jordan::{Belief, Document, Measured, Memory, Network};
use crate::model::{A_X, Body, DELTA, Disturbance, E_PSI, E_Y, Input, State, Tyres, V_GUARD, V_X, V_Y, YAW_RATE};
use crate::modes::Adaptation;
use crate::mpc::TyreModel;

mod neighbours;

/// Relative difference of a parameter from which on a car is not the one that a network was trained for [1].
///
/// The shipped network has nominal stiffnesses that are 2e-5 from the default ones, which are rounded. `l_f` as far off as it may
/// be takes the lane change at 16 m/s from 3.14 to 3.19 mm, nominal tyres instead of the network to 3.74
/// (`cargo fmu simulate --step 0.033 --set plant.speed=16 --set plant.l_f=1.2118 --set controller.l_f=1.2118`, and with 1.2122).
const SAME_CAR: f64 = 0.01;

/// Why a network cannot serve the car of the parameters: what it was trained for differs, or it wants to see more than the
/// controller does. Nothing if it fits.
pub fn other_car(network: &Network, p: &Parameters) -> Option<String> {
    let Document { l_f, l_r, c_f_nominal, c_r_nominal, .. } = network.document();
    if network.sees_accelerations() {
        return Some("it wants measured accelerations, which the controller is not given".to_owned());
    }
    [
        ("l_f", *l_f, p.l_f),
        ("l_r", *l_r, p.l_r),
        ("c_f_nominal", *c_f_nominal, p.c_f_nominal),
        ("c_r_nominal", *c_r_nominal, p.c_r_nominal),
    ]
    .into_iter()
    .find(|(_, trained, given)| (trained - given).abs() > SAME_CAR * trained)
    .map(|(name, trained, given)| format!("{name} was {trained}, it is {given} here"))
}

/// Tyres by the mode of adaptation, with the network's memory.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Adapter {
    mode: Adaptation,
    nominal: Tyres,
    grip: Grip,
    friction: Friction,
    network: Option<Network>,
    /// The network's last answer, one sample ago.
    memory: Memory,
    /// The network's answer at the stage that was last asked for.
    rolled: Memory,
    /// The tyres at the last measurement.
    present: Tyres,
    /// Secant stiffnesses at the last measurement [N/rad], and how far the network is believed [1].
    believed: (f64, f64, f64),
}

impl Adapter {
    /// Nothing measured yet: the nominal tyres. Without a network, or with that of another car, they stay.
    pub fn new(p: &Parameters, network: Option<Network>) -> Self {
        let nominal = p.nominal_tyres();
        let network = network.filter(|network| other_car(network, p).is_none());
        let memory = network.as_ref().map_or_else(Memory::default, Network::nominal);
        Self {
            mode: p.adaptation,
            nominal,
            grip: Grip::new(p),
            friction: Friction::new(),
            network,
            memory,
            rolled: memory,
            present: nominal,
            believed: (nominal.c_f, nominal.c_r, 0.0),
        }
    }

    /// Takes over nominal tyres and friction, which may change between samples.
    pub fn tune(&mut self, p: &Parameters) {
        let nominal = p.nominal_tyres();
        if nominal != self.nominal || p.mu != self.grip.friction() {
            // What was found was found beside other beliefs.
            self.friction = Friction::new();
        }
        (self.nominal, self.grip) = (nominal, Grip::new(p));
        if self.mode == Adaptation::Constant {
            self.present = nominal;
            self.believed = (nominal.c_f, nominal.c_r, 0.0);
        }
    }

    /// Takes in one sample: the state, what the actuators deliver, and the friction of the road [1].
    #[inline(always)]
    pub fn observe(&mut self, x: &State, u: &Input, mu: f64) {
        if self.mode == Adaptation::Constant {
            return;
        }
        // A preview that is no number leaves no plan, but the filter goes on.
        let mu = if mu.is_finite() { mu } else { self.grip.friction() };
        let (memory, secant, tangent, confidence) = self.answer(&self.memory, x, u, mu);
        (self.memory, self.present) = (memory, tangent);
        self.believed = (secant.c_f, secant.c_r, confidence);
    }

    /// Learns from what was unexplained at the last sample, whose state and input are given, what the tyres have over their
    /// belief, and leaves of it what that does not explain. `duration` is the time since then [s].
    pub fn learn(&mut self, x: &State, u: &Input, unexplained: &mut Disturbance, duration: f64, body: &Body) {
        if self.mode == Adaptation::Constant || x[V_X] < V_GUARD || duration <= 0.0 {
            return;
        }
        let given = Given::by(&self.present, x, u, body);
        let besides = unexplained.fixed_rows::<2>(V_Y).into_owned();
        if !(given.slope + given.offset + besides).iter().all(|a| a.is_finite()) {
            return;
        }
        let before = self.friction.factors();
        let rest = besides - self.friction.learn(&given, &besides, duration);
        unexplained.fixed_rows_mut::<2>(V_Y).copy_from(&rest);
        self.present = self.friction.factors().over(&before).apply(&self.present);
    }

    /// The next memory, secants, tangents and confidence at a state and input.
    #[inline(always)]
    fn answer(&self, memory: &Memory, x: &State, u: &Input, mu: f64) -> (Memory, Tyres, Tyres, f64) {
        let found = self.friction.factors();
        let slip = found.slip();
        let nominal = || self.grip.tyres(&scaled(&self.nominal, slip), x, u, mu * found.grip);
        // The same car, slipping as much as the believed tyre has to for its share of the force.
        let x_0 = State::from([x[V_X], x[V_Y] * slip, x[YAW_RATE] * slip, x[E_Y], x[E_PSI]]);
        let Some((memory, belief)) = self.ask(memory, &x_0, &Input::from([u[DELTA] * slip, u[A_X]])) else {
            let (secant, tangent) = nominal();
            return (*memory, secant, tangent, 0.0);
        };
        let share = self.share(mu);
        let [secant, tangent] =
            [belief.secant(), belief.tangent(TANGENT_FLOOR)].map(|tyres| found.apply(&scaled(&tyres, share)));
        if belief.confidence == 1.0 {
            return (memory, secant, tangent, 1.0);
        }
        let (nominal_secant, nominal_tangent) = nominal();
        let blend = |believed, nominal| blend(&believed, &nominal, belief.confidence);
        (memory, blend(secant, nominal_secant), blend(tangent, nominal_tangent), belief.confidence)
    }

    /// What a friction [1] makes of the forces that the network knows.
    ///
    /// At the same slip a tyre's force is proportional to the friction, as in the magic formula with `D = mu F_z`. Inside the
    /// range of its training the network is taken to know.
    fn share(&self, mu: f64) -> f64 {
        self.network.as_ref().map_or(1.0, |network| {
            let [lowest, highest] = network.document().provenance.mu;
            mu / mu.clamp(lowest, highest)
        })
    }

    /// Axle forces around the last measurement.
    pub fn present(&self) -> &Tyres {
        &self.present
    }

    /// The network's last answer.
    pub(crate) fn memory(&self) -> Memory {
        self.memory
    }

    /// Secant stiffnesses, front and rear [N/rad], and how far the network is believed [1], at the last measurement.
    pub fn believed(&self) -> (f64, f64, f64) {
        self.believed
    }

    /// The network's answer, unless there is none to ask or the car is slower than any slip angle makes sense.
    #[inline(always)]
    fn ask(&self, memory: &Memory, x: &State, u: &Input) -> Option<(Memory, Belief)> {
        if x[V_X] < V_GUARD {
            return None;
        }
        let measured = Measured {
            v_x: x[V_X],
            v_y: x[V_Y],
            yaw_rate: x[YAW_RATE],
            delta: u[DELTA],
            a_x: u[A_X],
            ..Measured::default()
        };
        Some(self.network.as_ref()?.linearise(memory, &measured))
    }
}

/// The nominal tyres with a share of what is believed instead.
fn blend(believed: &Tyres, nominal: &Tyres, confidence: f64) -> Tyres {
    let share = |believed: f64, nominal: f64| nominal + confidence * (believed - nominal);
    Tyres {
        c_f: share(believed.c_f, nominal.c_f),
        c_r: share(believed.c_r, nominal.c_r),
        f_f0: share(believed.f_f0, nominal.f_f0),
        f_r0: share(believed.f_r0, nominal.f_r0),
    }
}

/// All forces of these tyres times a factor.
fn scaled(tyres: &Tyres, factor: f64) -> Tyres {
    Tyres { c_f: tyres.c_f * factor, c_r: tyres.c_r * factor, f_f0: tyres.f_f0 * factor, f_r0: tyres.f_r0 * factor }
}

impl TyreModel for Adapter {
    fn nominal(&self) -> Tyres {
        self.nominal
    }

    fn restart(&mut self) {
        self.rolled = self.memory;
    }

    #[inline(always)]
    fn at(&mut self, x: &State, u: &Input, mu: f64) -> Tyres {
        match self.mode {
            Adaptation::Constant => self.nominal,
            Adaptation::NetworkNow => self.present,
            Adaptation::NetworkHorizon => {
                let (memory, _, tangent, _) = self.answer(&self.rolled, x, u, mu);
                self.rolled = memory;
                tangent
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_network_of_another_car_leaves_nominal_tyres_that_know_their_grip() {
        let text = include_str!("../../../resources/jordan.json");
        let network = Network::from_json(text).unwrap();
        let p = Parameters { c_f_nominal: 6.0e4, ..Parameters::adaptive() };
        let mut adapter = Adapter::new(&p, Some(network));
        let (x, u) = (State::from([15.0, 0.0, 0.0, 0.0, 0.0]), Input::from([0.4, 0.0]));
        adapter.observe(&x, &u, 0.82);
        let (c_f, _, confidence) = adapter.believed();
        assert_eq!(confidence, 0.0);
        assert!(c_f * 0.4 <= 0.82 * p.m * p.g * p.l_r / (p.l_f + p.l_r), "a force beyond friction: {c_f}");
        let forces = |tyres: &Tyres| crate::model::derivative(&x, &u, 0.0, &p.body(), tyres, &Disturbance::zeros());
        let (front, want) = (forces(adapter.present()), forces(&Tyres::secant(c_f, 0.0)));
        assert!((front[YAW_RATE] - want[YAW_RATE]).abs() < 1e-9, "secant and tangent are one force");
    }
}
